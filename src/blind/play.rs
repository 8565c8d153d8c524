//! Play of one blind flight: sealed, flown, explained, and only then opened.

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

/// A completed step of a blind flight, for a progress display.
#[derive(Clone, Copy, Debug)]
pub enum Act<'a> {
    /// The truth is sealed; its SHA-256, hexadecimal.
    Sealed(&'a str),
    /// The flight is flown.
    Flown(Flown),
    /// The verdict is on the disk; the truth is still sealed.
    Explained(&'a Verdict),
}

/// A blind flight that was flown, searched and scored.
#[derive(Clone, Debug)]
pub struct Played {
    /// Logs of the flight.
    pub flown: Flown,
    /// Verdict of the search.
    pub verdict: Verdict,
    /// The truth, opened after the verdict.
    pub opened: Opened,
    /// Score of the verdict against the truth.
    pub outcome: Outcome,
}

/// Path of the flight's folder: all that the search is given.
pub fn flight(folder: &Path) -> PathBuf {
    folder.join("flight")
}

/// Path at which the verdict must lie before the seal is opened: where `updraft gap` writes it.
pub fn verdict(folder: &Path) -> PathBuf {
    flight(folder).join("gap").join("verdict.json")
}

/// Whether a flight was played in a folder, at least until its truth was sealed.
pub fn is_played(folder: &Path) -> bool {
    seal::hash_path(folder).exists()
}

/// Removes a flight that was played, with its seal; other files in the folder stay.
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
