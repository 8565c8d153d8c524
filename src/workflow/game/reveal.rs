//! Opening of a game's seal, once there is a verdict, and its record.

use std::path::{Path, PathBuf};

use super::{files, game_path, read_game, verify};
use crate::base::digest::sha256;
use crate::base::file::{read_whole, write_whole};
use crate::base::plain::Shown as _;
use crate::blind::explain::Explain as _;
use crate::blind::record::{self, BlindRecord, Parts, RECORD_SCHEMA};
use crate::blind::{BlindError, play, seal};
use crate::campaign::{FlightFolder, read_json};
use crate::workflow::error::WorkflowError;
use crate::workflow::gap::next::is_of;
use crate::workflow::gap::search::Searched;
use crate::workflow::gap::{VERDICT, proof};
use crate::workflow::host::Host;
use crate::workflow::made_by;

/// Largest `game.json` that is read, bytes.
pub(super) const MAX_GAME_BYTES: u64 = 64 << 20;

/// Folder of the verdict unless another is named.
pub(super) fn gap_folder(folder: &Path) -> PathBuf {
    folder.join("gap")
}

/// Opens the seal, compares verdict and truth, and writes the record. A seal that was opened stays so: the
/// record is given again.
///
/// # Errors
/// When there is no game or no verdict, when verdict, truth or flight were changed, or when the seal was
/// opened for another verdict.
pub fn run(
    host: &dyn Host,
    folder: &Path,
    gap: Option<&Path>,
) -> Result<(BlindRecord, PathBuf), WorkflowError> {
    let game = read_game(folder)?;
    let _lock = host.lock(folder)?;
    let path = record::path(folder);
    let compared = gap.map_or_else(|| gap_folder(folder), Path::to_owned);
    let verdict_path = compared.join(VERDICT);
    let again = proof::again(folder, None, gap);
    if !verdict_path.is_file() {
        if path.exists() {
            return Err(WorkflowError::Nothing(format!(
                "the seal was opened before ({}), and {} has no {VERDICT} now; put it back, or say where \
                 it is (--gap)",
                path.shown(),
                compared.shown()
            )));
        }
        return Err(WorkflowError::Nothing(format!(
            "the truth stays sealed: {} has no {VERDICT}; compare first (`{again}`), or say where that was \
             put (--gap)",
            compared.shown()
        )));
    }
    let proven = proof::read(&compared, &proof::of_game(&again, path.exists()))?;
    if path.exists() {
        let record = opened_before(&path, &proven.sha256)?;
        still_whole(folder)?;
        return Ok((record, path));
    }
    if let Some(other) = files::differences(folder, &game).into_iter().next() {
        return Err(WorkflowError::Usage(format!(
            "the truth stays sealed: {} {}; put it back as it was, or make another game (`updraft blind \
             hide`)",
            folder.join(&other.path).shown(),
            other.how
        )));
    }
    let flight = FlightFolder::at(&play::flight(folder));
    let plan = flight.read_plan()?;
    let why =
        files::stranger(&game, &proven.verdict).or_else(|| is_of(&proven.verdict, &plan).err());
    if let Some(why) = why {
        return Err(WorkflowError::Usage(format!(
            "the truth stays sealed: {} {why}; compare this game (`{again}`)",
            verdict_path.shown()
        )));
    }
    if !seal::truth_path(folder).exists() {
        return Err(WorkflowError::Nothing(format!(
            "the truth is not here: {} is missing; whoever kept it from the player must put it back",
            seal::truth_path(folder).shown()
        )));
    }
    let opened = seal::open(folder, &verdict_path, Some(&game.truth_sha256))?;
    let fisher_z = Searched.fisher_z(&flight.0, &opened.truth);
    let record = BlindRecord::of(&Parts {
        made_by: &made_by(),
        game_sha256: &sha256(&read_whole(&game_path(folder), MAX_GAME_BYTES)?),
        gap: &written(folder, &compared),
        opened: &opened,
        verdict: &proven.verdict,
        fisher_z: &fisher_z,
    })?;
    write_whole(&path, &record.to_json()?)?;
    // Only now: who has read the truth without a record could ask for a second verdict.
    host.say(&format!("Seal opened: it hides {}", opened.truth.words()));
    Ok((record, path))
}

/// The folder of the verdict as the record has it: its path below the game's folder, else its whole path.
fn written(folder: &Path, compared: &Path) -> String {
    let whole = std::path::absolute(compared).unwrap_or_else(|_| compared.to_owned());
    compared.strip_prefix(folder).unwrap_or(&whole).to_string_lossy().into_owned()
}

/// The record of a seal that was opened, if it was for this verdict.
fn opened_before(path: &Path, verdict_sha256: &str) -> Result<BlindRecord, WorkflowError> {
    let record = read_record(path)?;
    if record.verdict_sha256 != verdict_sha256 {
        return Err(WorkflowError::Usage(format!(
            "the seal was opened for another verdict: {} has {}, the one here is {verdict_sha256}; who knows \
             the truth cannot be asked again, make another game (`updraft blind hide`)",
            path.shown(),
            record.verdict_sha256
        )));
    }
    Ok(record)
}

/// Refuses a game of which something was altered after its seal was opened: its record proves nothing.
fn still_whole(folder: &Path) -> Result<(), WorkflowError> {
    let verified = verify::run(folder, None)?;
    match verified.checks.iter().find_map(|check| check.wrong(" ")) {
        Some(altered) => Err(WorkflowError::Usage(format!(
            "{altered}; the seal was opened before, but what lies here is not what it was opened for"
        ))),
        None => Ok(()),
    }
}

/// The record of a seal that was opened, as it was written.
pub(super) fn read_record(path: &Path) -> Result<BlindRecord, WorkflowError> {
    let bytes = read_whole(path, MAX_GAME_BYTES)?;
    let record: BlindRecord = read_json(path)?;
    if record.schema != RECORD_SCHEMA {
        let (path, found) = (path.to_owned(), record.schema);
        return Err(BlindError::Schema { path, found, wanted: RECORD_SCHEMA }.into());
    }
    if !record.is_unedited(&bytes)? {
        return Err(WorkflowError::Usage(format!(
            "{} was edited after `updraft blind reveal` wrote it",
            path.shown()
        )));
    }
    Ok(record)
}
