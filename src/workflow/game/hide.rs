//! Making of a game: the truth is sealed, its hash published, and the flight flown.

use std::path::{Path, PathBuf};

use super::{files, game_path};
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::plain::Shown as _;
use crate::blind::game::{GAME_SCHEMA, Game, GameFile};
use crate::blind::{BlindError, fly, play, record, seal};
use crate::campaign::{self, CAMPAIGN_SCHEMA, CampaignIndex, index_path, to_json};
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::{made_by, words};

/// Request for a game in a folder.
#[derive(Clone, Debug)]
pub struct Wish {
    /// Folder of the game.
    pub folder: PathBuf,
    /// Whether a game that is there is replaced.
    pub force: bool,
    /// Game to fly, with its seed.
    pub game: Game,
    /// Random bytes that nobody can guess: with them the truth's hash tells nothing.
    pub nonce: [u8; 16],
}

/// A game that can be played.
pub struct Ready {
    /// Content of `game.json`: what the player is given beside the flight.
    pub game: GameFile,
    /// Number of drones that could not be flown.
    pub lost: usize,
}

impl Ready {
    /// Ending of the flight: with losses if drones could not be flown.
    pub fn ending(&self) -> Ending {
        Ending::of_losses(self.lost > 0)
    }
}

/// Seals the truth, publishes its hash, and flies. Nothing that is said tells what is hidden.
///
/// # Errors
/// When the folder holds something else, or the flight cannot be drawn or flown.
pub fn run(host: &dyn Host, wish: &Wish) -> Result<Ready, WorkflowError> {
    let Wish { folder, game, .. } = wish;
    let truth = game.truth()?;
    create_folder(folder)?;
    let _lock = host.lock(folder)?;
    make_room(folder, wish.force)?;
    let nonce = format!("{:032x}", u128::from_be_bytes(wish.nonce));
    let truth_sha256 = seal::seal_with(folder, &truth, nonce)?;
    let vehicle = game.base.vehicle_name();
    host.say(&format!(
        "Sealed: something that {vehicle} does not have, or nothing\n  SHA-256 {truth_sha256} -> {}",
        seal::truth_path(folder).shown()
    ));
    let flown = fly::fly(&truth, &play::flight(folder), Some(host.stop_flag()))?;
    if flown.logs == 0 {
        play::remove(folder)?;
        // Only where nothing else lies in it.
        let _ = std::fs::remove_dir(folder);
        return Err(WorkflowError::Nothing(format!(
            "no drone can fly this: {vehicle}, {} in {} air, {:+.1} m/s of updraft{}; no game was made, try another seed or milder air",
            game.protocol.template(),
            game.air.name(),
            game.updraft_mps,
            game.wind_mps.map_or_else(String::new, |wind| format!(", {wind:.1} m/s of wind"))
        )));
    }
    host.say(&format!(
        "Flown: {} in {} air, {} of {} -> {}",
        game.protocol.template(),
        game.air.name(),
        words::count(flown.logs, "log"),
        words::count(usize::from(truth.slots()), "drone"),
        play::flight(folder).shown()
    ));
    let file = GameFile {
        schema: GAME_SCHEMA.to_owned(),
        made_by: made_by(),
        truth_sha256,
        vehicle: vehicle.to_owned(),
        protocol: game.protocol,
        air: game.air,
        rows: game.rows,
        columns: game.columns,
        files: files::digests(folder)?,
    };
    write_index(folder)?;
    // Last: a folder with it is a whole game.
    write_whole(&game_path(folder), &json(&file)?)?;
    Ok(Ready { game: file, lost: flown.lost })
}

/// Makes the folder a campaign, so that a comparison finds its flight.
fn write_index(folder: &Path) -> Result<(), WorkflowError> {
    let flight = play::flight(folder);
    let name = flight.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let index = CampaignIndex {
        schema: CAMPAIGN_SCHEMA.to_owned(),
        name: "game".to_owned(),
        title: "A flight that may hide physics".to_owned(),
        flights: vec![name],
    };
    Ok(write_whole(&index_path(folder), &json(&index)?)?)
}

fn json<T: serde::Serialize>(value: &T) -> Result<Vec<u8>, WorkflowError> {
    to_json(value).map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))
}

/// Removes a game that is to be replaced, and what an interrupted one has left. Nothing else is touched.
fn make_room(folder: &Path, force: bool) -> Result<(), WorkflowError> {
    let is_game = game_path(folder).exists();
    if is_game && !force {
        return Err(WorkflowError::Usage(format!(
            "{} holds a game; choose another folder with -o, or replace it with --force",
            folder.shown()
        )));
    }
    // A seal without a game is what an interrupted one has left, if nobody has searched its flight.
    let was_searched = play::verdict(folder).exists();
    let is_campaign =
        || !play::is_played(folder) && campaign::flights(folder).is_ok_and(|all| !all.is_empty());
    if !is_game && (was_searched || is_campaign()) {
        let what = if was_searched { "a flight of `updraft run --hide`" } else { "a campaign" };
        return Err(WorkflowError::Usage(format!(
            "{} holds {what}; choose another folder with -o",
            folder.shown()
        )));
    }
    if !play::is_played(folder) && play::flight(folder).exists() {
        return Err(WorkflowError::Usage(format!(
            "{} exists and was not made by `updraft blind hide`; choose another folder with -o",
            play::flight(folder).shown()
        )));
    }
    let is_empty = || folder.read_dir().map_or(true, |mut entries| entries.next().is_none());
    if !is_game && !play::is_played(folder) && !is_empty() {
        return Err(WorkflowError::Usage(format!(
            "{} is not empty, and holds no game; choose another folder with -o",
            folder.shown()
        )));
    }
    if is_game {
        let removed = |path: &Path, done: std::io::Result<()>| match done {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(BlindError::from(FileError::new("remove", path, error)))
            }
            _ => Ok(()),
        };
        // A verdict on the old flight is none on the new one. `game.json` last: until then it is known as
        // a game.
        let gap = folder.join("gap");
        removed(&gap, std::fs::remove_dir_all(&gap))?;
        play::remove(folder)?;
        for path in [record::path(folder), index_path(folder), game_path(folder)] {
            removed(&path, std::fs::remove_file(&path))?;
        }
        return Ok(());
    }
    Ok(play::remove(folder)?)
}
