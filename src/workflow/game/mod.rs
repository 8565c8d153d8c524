//! A game with hidden physics for strangers, in steps: hide and fly, let `updraft gap` say what is
//! missing, reveal, and verify that nobody has changed anything.
//!
//! A game is a campaign folder with one flight, `flight/`, and the sealed truth beside it, in `sealed/`,
//! where a comparison does not look.

mod files;
pub mod hide;
pub mod reveal;
pub mod verify;

use std::path::{Path, PathBuf};

use super::error::WorkflowError;
use crate::base::plain::Shown as _;
use crate::blind::BlindError;
use crate::blind::game::{GAME_SCHEMA, GameFile};
use crate::campaign::read_json;

/// Name of what the player is given.
const GAME: &str = "game.json";

/// Path of the file that makes a folder a game.
pub(crate) fn game_path(folder: &Path) -> PathBuf {
    folder.join(GAME)
}

/// What the player was given.
fn read_game(folder: &Path) -> Result<GameFile, WorkflowError> {
    let path = game_path(folder);
    // A folder that is missing is told as what cannot be read.
    if folder.exists() && !path.exists() {
        return Err(WorkflowError::Nothing(format!(
            "{} is no game: it has no {GAME}; make one with `updraft blind hide -o FOLDER`",
            folder.shown()
        )));
    }
    let game: GameFile = read_json(&path)?;
    if game.schema != GAME_SCHEMA {
        let found = game.schema;
        return Err(BlindError::Schema { path, found, wanted: GAME_SCHEMA }.into());
    }
    Ok(game)
}
