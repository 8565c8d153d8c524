//! Search for the files on cards.

use std::fs;
use std::path::{Path, PathBuf};

use crate::base::file::FileError;

/// Files and folders looked at below a card, at most.
const MOST_FILES: usize = 100_000;

/// What is on the cards.
#[derive(Debug, Default)]
pub(super) struct Cards {
    /// Logs by their names, sorted; each once.
    pub(super) files: Vec<PathBuf>,
    /// Folders and files that cannot be read, and why.
    pub(super) unreadable: Vec<(PathBuf, String)>,
    /// Cards without a log.
    pub(super) empty: Vec<PathBuf>,
}

/// The logs of all cards: folders, or files.
///
/// # Errors
/// When a card is not there: that is a mistyped path, or a card that is not in its reader.
pub(super) fn find(cards: &[PathBuf]) -> Result<Cards, FileError> {
    let mut found = Cards::default();
    for card in cards {
        // A card may be given by a link; below it links are not followed.
        let about = fs::metadata(card).map_err(|error| FileError::new("read", card, error))?;
        let before = found.files.len();
        if about.is_dir() {
            fs::read_dir(card).map_err(|error| FileError::new("read", card, error))?;
            below(card, &mut found);
        } else {
            found.files.push(card.clone());
        }
        if found.files.len() == before {
            found.empty.push(card.clone());
        }
    }
    found.files.sort();
    found.files.dedup();
    Ok(found)
}

fn below(card: &Path, found: &mut Cards) {
    let mut folders = vec![card.to_owned()];
    let mut seen = 0;
    while let Some(folder) = folders.pop() {
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) => {
                found.unreadable.push((folder, format!("cannot be read: {error}")));
                continue;
            }
        };
        for entry in entries.flatten() {
            seen += 1;
            if seen > MOST_FILES {
                let why = format!("more than {MOST_FILES} files: give the cards' folders");
                found.unreadable.push((card.to_owned(), why));
                return;
            }
            let path = entry.path();
            let Ok(about) = fs::symlink_metadata(&path) else { continue };
            if about.is_dir() {
                folders.push(path);
            } else if about.is_file() && is_log(&path) {
                found.files.push(path);
            }
        }
    }
}

/// By its name; what other systems leave beside copied files (`._00000001.BIN`) is none.
fn is_log(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    !hidden && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin"))
}
