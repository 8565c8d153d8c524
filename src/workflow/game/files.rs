//! Files of a game's flight: their hashes, and how they differ from what was flown.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use rayon::prelude::*;

use crate::base::digest::{sha256, sha256_of_files};
use crate::base::file::{FileError, read_whole};
use crate::blind::game::{FileDigest, GameFile};
use crate::blind::play;
use crate::campaign::FlightFolder;
use crate::campaign::origin::logs_in;
use crate::gap::Verdict;

/// Largest file of a flight that is read, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// Folder of the logs, below the game's folder.
const LOGS: &str = "flight/logs";

/// A file that is not as it was flown.
pub(super) struct Difference {
    /// Path below the game's folder.
    pub(super) path: String,
    /// How it differs, as the rest of a sentence that begins with the file.
    pub(super) how: String,
}

/// Files that a comparison reads, now.
fn present(folder: &Path) -> Vec<PathBuf> {
    let flight = FlightFolder::at(&play::flight(folder));
    let mut paths = vec![flight.template(), flight.vehicle(), flight.plan()];
    let mut logs = logs_in(&flight.logs());
    logs.sort();
    paths.extend(logs);
    paths.retain(|path| path.exists());
    paths
}

fn name_of(folder: &Path, path: &Path) -> String {
    let below = path.strip_prefix(folder).unwrap_or(path);
    let parts: Vec<String> =
        below.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    parts.join("/")
}

/// Hashes of the files of a flight that was just flown.
pub(super) fn digests(folder: &Path) -> Result<Vec<FileDigest>, FileError> {
    let of = |path: &PathBuf| {
        let sha256 = sha256(&read_whole(path, MAX_BYTES)?);
        Ok(FileDigest { path: name_of(folder, path), sha256 })
    };
    present(folder).par_iter().map(of).collect()
}

/// Why a verdict is none on the logs of this game, as the rest of a sentence that begins with the verdict; `None`: it is.
pub(super) fn stranger(game: &GameFile, verdict: &Verdict) -> Option<String> {
    let is_log = |file: &&FileDigest| Path::new(&file.path).starts_with(LOGS);
    let logs = game.files.iter().filter(is_log).map(|file| file.sha256.as_str());
    let compared = &verdict.data.logs_sha256;
    if compared.is_empty() {
        return Some("does not say which logs were compared".to_owned());
    }
    (*compared != sha256_of_files(logs))
        .then(|| "is of other logs than those of this game".to_owned())
}

/// Files that were changed, removed or added since the flight.
pub(super) fn differences(folder: &Path, game: &GameFile) -> Vec<Difference> {
    let differs = |file: &FileDigest| -> Option<Difference> {
        let path = folder.join(&file.path);
        let is_below =
            Path::new(&file.path).components().all(|part| matches!(part, Component::Normal(_)));
        let how = match read_whole(&path, MAX_BYTES) {
            _ if !is_below => "is no path of a game's file".to_owned(),
            _ if !path.exists() => "is missing".to_owned(),
            Ok(bytes) => {
                let found = sha256(&bytes);
                if found == file.sha256 {
                    return None;
                }
                format!(
                    "was changed after the flight: its SHA-256 is {found}, it was {}",
                    file.sha256
                )
            }
            Err(error) => format!("is not as it was flown ({error})"),
        };
        Some(Difference { path: file.path.clone(), how })
    };
    let mut found: Vec<Difference> = game.files.par_iter().filter_map(differs).collect();
    let known: BTreeSet<&str> = game.files.iter().map(|file| file.path.as_str()).collect();
    for path in present(folder) {
        let path = name_of(folder, &path);
        if !known.contains(path.as_str()) {
            found.push(Difference { path, how: "was added after the flight".to_owned() });
        }
    }
    found
}
