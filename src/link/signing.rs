//! Message signing: who has the key may speak.
//!
//! A signature covers the frame, the sender's link and a time stamp that only ever grows
//! (MAVLink's "Message Signing"). A datagram network reorders: a stamp somewhat older than the
//! newest is accepted once, so that reordering costs nothing and a replay still fails.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use mavlink::MAVLinkV2MessageRaw;
use sha2::{Digest, Sha256};

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

/// Signing time of a Unix time, us.
pub fn signing_time(unix_us: u64) -> u64 {
    (unix_us / 10).saturating_sub(EPOCH)
}

/// A signing key, 32 bytes. Not printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Key(..)")
    }
}

/// Why there is no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// The file cannot be read.
    #[error("cannot read the key file {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is empty or far too long to be a key.
    #[error(
        "{path} holds no signing key: it must hold 32 bytes, 64 hexadecimal digits, or a \
         passphrase of 8 to 200 characters (hashed as other ground stations do)"
    )]
    Content {
        /// The file.
        path: PathBuf,
    },
}

impl Key {
    /// From its bytes.
    pub fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// From a file with 32 bytes, 64 hexadecimal digits, or a passphrase, whose SHA-256 is the
    /// key (the custom of Mission Planner and MAVProxy).
    pub fn from_file(path: &Path) -> Result<Self, KeyError> {
        let read = |source| KeyError::Read { path: path.to_owned(), source };
        let size = std::fs::metadata(path).map_err(read)?.len();
        let content = || KeyError::Content { path: path.to_owned() };
        if size > 1_000 {
            return Err(content());
        }
        let bytes = std::fs::read(path).map_err(read)?;
        if let Ok(key) = <[u8; 32]>::try_from(bytes.as_slice()) {
            return Ok(Self(key));
        }
        let text = std::str::from_utf8(&bytes).map_err(|_| content())?.trim();
        if let Some(key) = from_hex(text) {
            return Ok(Self(key));
        }
        if !(8..=200).contains(&text.chars().count()) {
            return Err(content());
        }
        Ok(Self(Sha256::digest(text.as_bytes()).into()))
    }
}

fn from_hex(text: &str) -> Option<[u8; 32]> {
    if text.len() != 64 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let mut key = [0; 32];
    for (byte, digits) in key.iter_mut().zip(text.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    }
    Some(key)
}

/// Signs what one station sends.
#[derive(Clone, Debug)]
pub struct Signer {
    key: Key,
    link: u8,
    stamp: u64,
}

impl Signer {
    /// `link` tells this station's links apart; `time` is [`signing_time`] now.
    pub fn new(key: Key, link: u8, time: u64) -> Self {
        Self { key, link, stamp: time }
    }

    /// Follows the clock: stamps grow by one per frame at least.
    pub fn advance(&mut self, time: u64) {
        self.stamp = self.stamp.max(time);
    }

    pub(super) fn sign(&mut self, raw: &mut MAVLinkV2MessageRaw) {
        raw.signature_timestamp_bytes_mut().copy_from_slice(&self.stamp.to_le_bytes()[..6]);
        *raw.signature_link_id_mut() = self.link;
        let mut value = [0; 6];
        raw.calculate_signature(&self.key.0, &mut value);
        raw.signature_value_mut().copy_from_slice(&value);
        self.stamp += 1;
    }
}

/// Checks what arrives.
#[derive(Clone, Debug)]
pub struct Verifier {
    key: Key,
    time: u64,
    streams: BTreeMap<(u8, u8, u8), Stream>,
}

#[derive(Clone, Debug, Default)]
struct Stream {
    /// Stamps below are refused.
    floor: u64,
    seen: BTreeSet<u64>,
}

impl Verifier {
    /// `time` is [`signing_time`] now.
    pub fn new(key: Key, time: u64) -> Self {
        Self { key, time, streams: BTreeMap::new() }
    }

    /// Follows the clock.
    pub fn advance(&mut self, time: u64) {
        self.time = self.time.max(time);
    }

    pub(super) fn accepts(&mut self, raw: &MAVLinkV2MessageRaw) -> bool {
        let mut value = [0; 6];
        raw.calculate_signature(&self.key.0, &mut value);
        if value != raw.signature_value() {
            return false;
        }
        let stamp = raw.signature_timestamp();
        let stream = (raw.signature_link_id(), raw.system_id() as u8, raw.component_id());
        if !self.streams.contains_key(&stream) {
            if stamp + NEW_STREAM < self.time || self.streams.len() >= STREAMS {
                return false;
            }
            self.streams.insert(stream, Stream::default());
        }
        let Some(stream) = self.streams.get_mut(&stream) else { return false };
        if stamp < stream.floor || !stream.seen.insert(stamp) {
            return false;
        }
        self.time = self.time.max(stamp);
        stream.floor = stream.floor.max(stamp.saturating_sub(REORDER));
        // What is forgotten must not be taken again: it lies below the floor from now on.
        while let Some(&first) = stream.seen.first() {
            if first >= stream.floor && stream.seen.len() <= SEEN {
                break;
            }
            stream.seen.pop_first();
            stream.floor = stream.floor.max(first + 1);
        }
        true
    }
}
