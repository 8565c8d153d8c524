//! Message signing: only who has the key may speak.
//!
//! A signature covers the frame, the sender's link and a time stamp that only ever grows
//! (MAVLink's "Message Signing"). A datagram network reorders: a stamp somewhat older than the
//! newest is accepted once, so that reordering costs nothing and a replay still fails.
//!
//! A signature does not say in which network its frame was sent. So there is one verifier for all
//! networks: what was heard in one is refused in another. And there is one signer with one link id:
//! to a drone, another link id would be a new stream, for which it takes frames of up to a minute ago.
//! Vehicles that share a system id in different networks share a stream: their clocks may differ by
//! `REORDER` (the firmware takes them from GPS).
//!
//! What was heard last is kept beside the key file, see `stamps.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::frame::MAVLinkV2MessageRaw;
use super::stamps::{Shelf, Stamps, Stream as StreamId};
use untrusted_io::file::read_whole;
use untrusted_io::plain::Shown as _;

/// How far behind the newest of its stream a frame may be: 2 s in units of 10 us.
const REORDER: u64 = 200_000;
/// How far behind the receiver's own time a new stream may begin: 1 min in units of 10 us.
const NEW_STREAM: u64 = 6_000_000;
/// Streams that are remembered; a station hears a few per vehicle.
const STREAMS: usize = 4_096;
/// Stamps that are remembered per stream.
const SEEN: usize = 4_096;
/// Unix time at which signing time begins, 2015-01-01, in units of 10 us.
const EPOCH: u64 = 142_007_040_000_000;

/// Signing time (10 us since 2015) of a Unix time in us.
pub fn signing_time(unix_us: u64) -> u64 {
    (unix_us / 10).saturating_sub(EPOCH)
}

/// Largest key file, bytes.
const MOST_KEY_BYTES: u64 = 1_000;

/// A signing key, 32 bytes. Not printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Key {
    bytes: [u8; 32],
    file: Option<PathBuf>,
}

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Key(..)")
    }
}

/// Error of reading a signing key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// The file cannot be read.
    #[error("cannot read the key file {}", path.shown())]
    Read {
        /// Path of the key file.
        path: PathBuf,
        /// Reason given by the operating system.
        source: std::io::Error,
    },
    /// The file is empty or far too long to be a key.
    #[error(
        "{} holds no signing key: it must hold 32 bytes, 64 hexadecimal digits, or a \
         passphrase of 8 to 200 characters (hashed as other ground stations do)", path.shown()
    )]
    Content {
        /// Path of the key file.
        path: PathBuf,
    },
}

impl Key {
    /// A key from its 32 bytes.
    pub fn from_bytes(bytes: [u8; 32]) -> Self {
        Self { bytes, file: None }
    }

    /// Reads a key from a file with 32 bytes, 64 hexadecimal digits, or a passphrase, whose SHA-256
    /// is the key (the custom of Mission Planner and MAVProxy).
    ///
    /// # Errors
    ///
    /// If the file cannot be read, is empty, or is far too long to be a key.
    pub fn from_file(path: &Path) -> Result<Self, KeyError> {
        let content = || KeyError::Content { path: path.to_owned() };
        let bytes = read_whole(path, MOST_KEY_BYTES).map_err(|error| match error.source {
            too_large if too_large.kind() == std::io::ErrorKind::FileTooLarge => content(),
            source => KeyError::Read { path: path.to_owned(), source },
        })?;
        let is_key = |bytes| Self { bytes, file: Some(path.to_owned()) };
        if let Ok(key) = <[u8; 32]>::try_from(bytes.as_slice()) {
            return Ok(is_key(key));
        }
        let text = std::str::from_utf8(&bytes).map_err(|_| content())?.trim();
        if let Some(key) = from_hex(text) {
            return Ok(is_key(key));
        }
        if !(8..=200).contains(&text.chars().count()) {
            return Err(content());
        }
        Ok(is_key(Sha256::digest(text.as_bytes()).into()))
    }

    /// Where what was said last with it is kept; `None`: it came from no file.
    pub(super) fn shelf(&self) -> Option<Shelf> {
        self.file.as_deref().map(Shelf::beside)
    }
}

/// Warning that others than its owner may read or change a key file, with the remedy; `None` if
/// they may not, or if that cannot be known.
///
/// That is a warning and no refusal: sticks that crews carry keys on know no owners.
pub fn exposure(path: &Path) -> Option<String> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = std::fs::metadata(path).ok()?.permissions().mode();
        (mode & 0o077 != 0).then(|| {
            format!(
                "the key file {path} can be read or changed by others on this computer (mode \
                 {mode:03o}): whoever has the key commands the drones. chmod 600 {path}",
                path = path.shown(),
                mode = mode & 0o777
            )
        })
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        None
    }
}

fn from_hex(text: &str) -> Option<[u8; 32]> {
    let mut key = [0; 32];
    let whole = base16ct::mixed::decode(text, &mut key).is_ok_and(|bytes| bytes.len() == 32);
    whole.then_some(key)
}

/// Signer of the frames that one station sends.
#[derive(Clone, Debug)]
pub struct Signer {
    key: Key,
    link: u8,
    stamp: u64,
}

impl Signer {
    /// Makes a signer; `link` distinguishes this station's links, `time` is the present
    /// [`signing_time`].
    pub fn new(key: Key, link: u8, time: u64) -> Self {
        Self { key, link, stamp: time }
    }

    /// Goes on above what was sent before, also when the clock was set back meanwhile.
    pub(super) fn go_on_from(&mut self, kept: &Stamps) {
        self.stamp = self.stamp.max(kept.sent);
    }

    /// The stamp of the next frame.
    pub(super) fn stamp(&self) -> u64 {
        self.stamp
    }

    /// Moves the time stamp on to the clock's time, if that is later; each frame adds at least one.
    pub fn advance(&mut self, time: u64) {
        self.stamp = self.stamp.max(time);
    }

    pub(super) fn sign(&mut self, raw: &mut MAVLinkV2MessageRaw) {
        raw.signature_timestamp_bytes_mut().copy_from_slice(&self.stamp.to_le_bytes()[..6]);
        *raw.signature_link_id_mut() = self.link;
        let mut value = [0; 6];
        raw.calculate_signature(&self.key.bytes, &mut value);
        raw.signature_value_mut().copy_from_slice(&value);
        self.stamp += 1;
    }
}

/// Verifier of the frames that arrive, in all networks.
#[derive(Clone, Debug)]
pub struct Verifier {
    key: Key,
    time: u64,
    streams: BTreeMap<StreamId, Stream>,
    /// Newest stamps of streams that were heard before this began.
    kept: BTreeMap<StreamId, u64>,
}

#[derive(Clone, Debug, Default)]
struct Stream {
    /// Stamps below are refused.
    floor: u64,
    newest: u64,
    /// Two vehicles of one id may sign in one moment, but not the same.
    seen: BTreeSet<(u64, [u8; 6])>,
}

impl Verifier {
    /// Makes a verifier; `time` is the present [`signing_time`].
    pub fn new(key: Key, time: u64) -> Self {
        Self { key, time, streams: BTreeMap::new(), kept: BTreeMap::new() }
    }

    /// Refuses what was heard before.
    pub(super) fn go_on_from(&mut self, kept: &Stamps) {
        self.kept.clone_from(&kept.heard);
    }

    /// The newest stamp of each stream that was heard.
    pub(super) fn newest(&self) -> BTreeMap<StreamId, u64> {
        self.streams.iter().map(|(id, stream)| (*id, stream.newest)).collect()
    }

    /// Moves the verifier's time on with the clock.
    pub fn advance(&mut self, time: u64) {
        self.time = self.time.max(time);
    }

    pub(super) fn accepts(&mut self, raw: &MAVLinkV2MessageRaw) -> bool {
        let mut value = [0; 6];
        raw.calculate_signature(&self.key.bytes, &mut value);
        if value != raw.signature_value() {
            return false;
        }
        let stamp = raw.signature_timestamp();
        let stream = (raw.signature_link_id(), raw.system_id() as u8, raw.component_id());
        if !self.streams.contains_key(&stream) {
            if stamp + NEW_STREAM < self.time || self.streams.len() >= STREAMS {
                return false;
            }
            let floor = self.kept.get(&stream).map_or(0, |newest| newest.saturating_add(1));
            if stamp < floor {
                return false;
            }
            self.streams.insert(stream, Stream { floor, ..Stream::default() });
        }
        let Some(stream) = self.streams.get_mut(&stream) else { return false };
        if stamp < stream.floor || !stream.seen.insert((stamp, value)) {
            return false;
        }
        stream.newest = stream.newest.max(stamp);
        self.time = self.time.max(stamp);
        stream.floor = stream.floor.max(stamp.saturating_sub(REORDER));
        // What is forgotten must not be taken again: it lies below the floor from now on.
        while let Some(&first) = stream.seen.first() {
            if first.0 >= stream.floor && stream.seen.len() <= SEEN {
                break;
            }
            stream.seen.pop_first();
            stream.floor = stream.floor.max(first.0 + 1);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frame::{FrameReader, Sender, encode};
    use crate::link::station::heartbeat;

    const KEY: [u8; 32] = [3; 32];

    fn frame(system: u8, link: u8, time: u64) -> Vec<u8> {
        let mut signer = Signer::new(Key::from_bytes(KEY), link, time);
        encode(Sender { system, component: 1 }, 0, &heartbeat(), Some(&mut signer))
    }

    fn accepts(verifier: &mut Verifier, frame: &[u8]) -> bool {
        let mut reader = FrameReader::default();
        reader.push(frame);
        reader.next(Some(verifier)).is_some()
    }

    #[test]
    fn what_was_heard_before_a_station_began_is_refused() {
        let mut first = Verifier::new(Key::from_bytes(KEY), 1_000_000);
        let recorded: Vec<_> = [1_000_000, 1_000_500, 999_800].map(|t| frame(7, 0, t)).into();
        assert!(recorded.iter().all(|frame| accepts(&mut first, frame)));
        assert_eq!(first.newest(), BTreeMap::from([((0, 7, 1), 1_000_500)]));
        // 16 s later, in another process.
        let later = 1_000_000 + 1_600_000;
        let mut second = Verifier::new(Key::from_bytes(KEY), later);
        assert!(recorded.iter().any(|frame| accepts(&mut second.clone(), frame)), "without stamps");
        second.go_on_from(&Stamps { sent: 0, heard: first.newest() });
        assert!(!recorded.iter().any(|frame| accepts(&mut second, frame)));
        assert!(accepts(&mut second, &frame(7, 0, 1_000_501)), "what is newer");
        assert!(accepts(&mut second, &frame(7, 1, later)), "another link of it");
        assert!(accepts(&mut second, &frame(8, 0, later)), "another vehicle");
    }

    #[test]
    fn two_vehicles_of_one_id_may_sign_in_one_moment() {
        let mut verifier = Verifier::new(Key::from_bytes(KEY), 1_000);
        let mut signers = [1, 2].map(|_| Signer::new(Key::from_bytes(KEY), 0, 1_000));
        let mut sequence = 0;
        for signer in &mut signers {
            sequence += 1;
            let sender = Sender { system: 7, component: 1 };
            let frame = encode(sender, sequence, &heartbeat(), Some(signer));
            assert!(accepts(&mut verifier, &frame));
            assert!(!accepts(&mut verifier, &frame), "again");
        }
    }

    #[test]
    fn a_signer_goes_on_though_the_clock_was_set_back() {
        let mut signer = Signer::new(Key::from_bytes(KEY), 1, 50);
        signer.go_on_from(&Stamps { sent: 900, heard: BTreeMap::new() });
        signer.advance(60);
        assert_eq!(signer.stamp(), 900);
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_others_can_read_is_told_of() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("swarm.key");
        std::fs::write(&path, [7; 32]).unwrap();
        for (mode, open) in [(0o600, false), (0o400, false), (0o640, true), (0o604, true)] {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            let told = exposure(&path);
            assert_eq!(told.is_some(), open, "{mode:o}");
            assert!(told.is_none_or(|told| told.contains("chmod 600")));
        }
        assert!(Key::from_file(&path).is_ok(), "a warning, no refusal");
        assert!(matches!(Key::from_file("/dev/zero".as_ref()), Err(KeyError::Content { .. })));
    }
}
