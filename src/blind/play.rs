//! One blind flight before an audience: sealed, flown, explained, and only then opened.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::error::BlindError;
use super::explain::Explain;
use super::fly::{Flown, fly};
use super::scenario::Scenario;
use super::score::{Outcome, score};
use super::seal::{self, Opened};
use crate::base::file::FileError;
use crate::gap::Verdict;

/// What has just been done.
#[derive(Clone, Copy, Debug)]
pub enum Act<'a> {
    /// The truth is sealed under this hash.
    Sealed(&'a str),
    /// The flight is flown.
    Flown(Flown),
    /// The verdict is on the disk; the truth is still sealed.
    Explained(&'a Verdict),
}

/// How it ended.
#[derive(Clone, Debug)]
pub struct Played {
    /// What became of the flight.
    pub flown: Flown,
    /// The verdict.
    pub verdict: Verdict,
    /// The truth, opened.
    pub opened: Opened,
    /// The one against the other.
    pub outcome: Outcome,
}

/// Folder of the flight: all that the search is given.
pub fn flight(folder: &Path) -> PathBuf {
    folder.join("flight")
}

/// Where the verdict must be before the seal is opened: as `updraft gap` writes it.
pub fn verdict(folder: &Path) -> PathBuf {
    flight(folder).join("gap").join("verdict.json")
}

/// Whether a folder holds a flight that was played.
pub fn is_played(folder: &Path) -> bool {
    seal::hash_path(folder).exists()
}

/// Removes a flight that was played, with its seal; other things in the folder stay.
///
/// # Errors
/// When something cannot be removed.
pub fn remove(folder: &Path) -> Result<(), BlindError> {
    // The seal last: as long as it is there, the folder is known as one of these.
    for folder in [flight(folder), seal::folder(folder)] {
        match std::fs::remove_dir_all(&folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(FileError::new("remove", &folder, error).into());
            }
            _ => {}
        }
    }
    Ok(())
}

/// Seals a truth, flies it into `folder`, has it explained, and then opens the seal. `search` writes its
/// verdict to [`verdict`]; `tell` is called after each act.
///
/// # Errors
/// As [`fly`]; [`BlindError::Explain`] when the search fails, [`BlindError::NoVerdict`] when it leaves
/// no verdict on the disk.
pub fn play(
    truth: &Scenario,
    folder: &Path,
    search: &dyn Explain,
    stop: Option<&AtomicBool>,
    tell: &mut dyn FnMut(Act<'_>),
) -> Result<Played, BlindError> {
    let hash = seal::seal(folder, truth)?;
    tell(Act::Sealed(&hash));
    let place = flight(folder);
    let flown = fly(truth, &place, stop)?;
    tell(Act::Flown(flown));
    let found = search
        .explain(&place)
        .map_err(|source| BlindError::Explain { flight: place.clone(), source })?;
    tell(Act::Explained(&found));
    let opened = seal::open(folder, &verdict(folder), Some(&hash))?;
    let fisher_z = search.fisher_z(&place, &opened.truth);
    let outcome = score(&opened.truth, &found, &fisher_z);
    Ok(Played { flown, verdict: found, opened, outcome })
}
