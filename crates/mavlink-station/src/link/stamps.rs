//! Newest time stamps of a signing key, stored beside it, so that a frame of yesterday is refused
//! today.
//!
//! A station that has just begun knows no stream, and would take whatever was recorded a moment ago for
//! the beginning of one. So the newest stamp of each stream lies in `KEY.stamps` beside the key file:
//! written whole about once a second and at the end, for its owner alone, and never lowered, also when
//! several stations use one key. A station that is killed forgets its last second.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use serde::{Deserialize, Serialize};

use untrusted_io::file::{FileError, read_whole, write_private};
use untrusted_io::parse;

/// Format of the file.
const SCHEMA: &str = "updraft.stamps/1";
/// No file is larger, bytes: one line for each of 4,096 streams.
const MOST_BYTES: u64 = 1 << 20;

/// Who signs: link id, system and component.
pub(super) type Stream = (u8, u8, u8);

/// Newest stamps, in units of 10 us since 2015.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Stamps {
    /// Of what this computer has signed.
    pub(super) sent: u64,
    /// Of what was accepted.
    pub(super) heard: BTreeMap<Stream, u64>,
}

#[derive(Serialize, Deserialize)]
struct Content {
    schema: String,
    sent: u64,
    heard: Vec<(Stream, u64)>,
}

impl Stamps {
    /// Takes whatever is newer.
    pub(super) fn raise(&mut self, other: &Self) {
        self.sent = self.sent.max(other.sent);
        for (stream, stamp) in &other.heard {
            let own = self.heard.entry(*stream).or_default();
            *own = (*own).max(*stamp);
        }
    }

    fn read(path: &Path) -> Result<Self, FileError> {
        let bytes = match read_whole(path, MOST_BYTES) {
            Ok(bytes) => bytes,
            Err(error) if error.source.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self::default());
            }
            Err(error) => return Err(error),
        };
        let wrong = |reason: String| {
            FileError::new(
                "understand",
                path,
                std::io::Error::other(format!(
                    "{reason}; without it, frames of earlier days can be replayed: remove it \
                     only if nobody can have recorded any"
                )),
            )
        };
        let content: Content = parse::json(&bytes).map_err(|error| wrong(error.to_string()))?;
        if content.schema != SCHEMA {
            return Err(wrong(format!("it is \"{}\", not \"{SCHEMA}\"", content.schema)));
        }
        Ok(Self { sent: content.sent, heard: content.heard.into_iter().collect() })
    }
}

/// Where the stamps of a key are kept.
#[derive(Clone, Debug)]
pub(super) struct Shelf {
    key: PathBuf,
    path: PathBuf,
}

impl Shelf {
    /// Beside a key file.
    pub(super) fn beside(key: &Path) -> Self {
        let mut path = key.as_os_str().to_owned();
        path.push(".stamps");
        Self { key: key.to_owned(), path: path.into() }
    }

    /// Raises what is kept to these, and returns what is kept then.
    pub(super) fn keep(&self, stamps: &Stamps) -> Result<Stamps, FileError> {
        // Another station may be about the same: nothing between reading and writing.
        let key = File::open(&self.key).map_err(|e| FileError::new("open", &self.key, e))?;
        // Where files cannot be locked, two stations may lose a second of each other's.
        let _ = key.lock();
        let mut kept = Stamps::read(&self.path)?;
        let before = kept.clone();
        kept.raise(stamps);
        if kept != before || !self.path.exists() {
            let content = Content {
                schema: SCHEMA.to_owned(),
                sent: kept.sent,
                heard: kept.heard.iter().map(|(stream, stamp)| (*stream, *stamp)).collect(),
            };
            let fail = |error: serde_json::Error| {
                FileError::new("write", &self.path, std::io::Error::other(error))
            };
            write_private(&self.path, &serde_json::to_vec(&content).map_err(fail)?)?;
        }
        Ok(kept)
    }
}

/// Keeps stamps on the disk from a thread of its own: whoever flies does not wait for a disk.
#[derive(Debug)]
pub(super) struct Keeper {
    to_keep: Option<Sender<Stamps>>,
    thread: Option<JoinHandle<()>>,
}

impl Keeper {
    pub(super) fn start(shelf: Shelf) -> std::io::Result<Self> {
        let (to_keep, stamps) = channel();
        let thread = std::thread::Builder::new()
            .name("stamps".to_owned())
            .spawn(move || keep_all(&shelf, &stamps))?;
        Ok(Self { to_keep: Some(to_keep), thread: Some(thread) })
    }

    /// Has these kept soon.
    pub(super) fn keep(&self, stamps: Stamps) {
        if let Some(to_keep) = &self.to_keep {
            let _ = to_keep.send(stamps);
        }
    }
}

fn keep_all(shelf: &Shelf, stamps: &Receiver<Stamps>) {
    while let Ok(mut newest) = stamps.recv() {
        // A slow disk gets the last of those that have gathered.
        while let Ok(newer) = stamps.try_recv() {
            newest = newer;
        }
        // It could be written when the station began; a disk that is full by now keeps what it has.
        let _ = shelf.keep(&newest);
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        drop(self.to_keep.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(sent: u64, stream: u64) -> Stamps {
        Stamps { sent, heard: BTreeMap::from([((0, 7, 1), stream)]) }
    }

    #[test]
    fn what_is_kept_is_never_lowered_and_for_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let key = folder.path().join("swarm.key");
        std::fs::write(&key, [7; 32]).unwrap();
        let shelf = Shelf::beside(&key);
        assert_eq!(shelf.keep(&Stamps::default()).unwrap(), Stamps::default());
        assert_eq!(shelf.keep(&stamps(50, 90)).unwrap(), stamps(50, 90));
        assert_eq!(shelf.keep(&stamps(60, 80)).unwrap(), stamps(60, 90));
        assert_eq!(Stamps::read(&shelf.path).unwrap(), stamps(60, 90));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let mode = std::fs::metadata(&shelf.path).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
        std::fs::write(&shelf.path, "{}").unwrap();
        let error = shelf.keep(&Stamps::default()).unwrap_err();
        assert!(error.to_string().contains("swarm.key.stamps"), "{error}");
    }

    #[test]
    fn a_keeper_keeps_the_last_before_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        let key = folder.path().join("key");
        std::fs::write(&key, [7; 32]).unwrap();
        let keeper = Keeper::start(Shelf::beside(&key)).unwrap();
        for stamp in 1..100 {
            keeper.keep(stamps(stamp, stamp));
        }
        drop(keeper);
        assert_eq!(Shelf::beside(&key).keep(&Stamps::default()).unwrap(), stamps(99, 99));
    }
}
