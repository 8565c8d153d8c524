//! MAVLink 2 frames: the one file that names the MAVLink crate.
//!
//! Frames are found in a stream of bytes or in a datagram, checked, and turned into messages.
//! MAVLink 1 is not spoken: its frames are counted, so that the user can be told.

pub(super) use mavlink::MAVLinkV2MessageRaw;
use mavlink::{MavHeader, MavlinkVersion, Message as _, calculate_crc, consts};

/// Messages of the ArduPilot dialect and their enums.
pub use mavlink::dialects::ardupilotmega as dialect;
/// A message of the ArduPilot dialect.
pub use mavlink::dialects::ardupilotmega::MavMessage;

use super::signing::{Signer, Verifier};

/// Length of the longest frame, bytes.
pub const MAX_FRAME: usize = consts::MAX_FRAME_SIZE;
const STX_V1: u8 = 0xFE;
const STX_V2: u8 = 0xFD;
const HEADER: usize = 10;
const CHECKSUM: usize = 2;
const SIGNATURE: usize = 13;
const FLAG_SIGNED: u8 = 0x01;

/// Sender of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Sender {
    /// MAVLink system id.
    pub system: u8,
    /// MAVLink component id; 1 is an autopilot.
    pub component: u8,
}

/// A message with its sender.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Sender of the frame.
    pub sender: Sender,
    /// Number of the frame in the sender's stream, modulo 256.
    pub sequence: u8,
    /// Message in the frame.
    pub message: MavMessage,
}

/// Bytes that gave no message, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameLoss {
    /// Number of bytes outside of frames, or of frames whose checksum is wrong.
    pub noise_bytes: u64,
    /// Number of MAVLink 1 frames (of any content).
    pub version_1: u64,
    /// Number of frames with messages that the dialect does not have; normal.
    pub unknown: u64,
    /// Number of frames without a signature where one is required.
    pub unsigned: u64,
    /// Number of frames whose signature is wrong, or that were sent before (replayed).
    pub forged: u64,
}

/// Encodes a message as one frame.
pub fn encode(
    sender: Sender,
    sequence: u8,
    message: &MavMessage,
    signer: Option<&mut Signer>,
) -> Vec<u8> {
    let header =
        MavHeader { system_id: sender.system.into(), component_id: sender.component, sequence };
    let mut raw = MAVLinkV2MessageRaw::new();
    if let Some(signer) = signer {
        raw.serialize_message_for_signing(header, message);
        signer.sign(&mut raw);
    } else {
        raw.serialize_message(header, message);
    }
    raw.raw_bytes().to_vec()
}

/// Finder of frames in bytes that arrive in pieces. Holds at most one frame's worth of bytes beyond
/// the last push.
///
/// ```
/// use mavlink_station::link::frame::{FrameReader, encode};
/// use mavlink_station::link::station::{STATION, heartbeat};
///
/// let bytes = encode(STATION, 0, &heartbeat(), None);
/// let mut reader = FrameReader::default();
/// reader.push(&bytes[..5]);
/// assert!(reader.next(None).is_none());
/// reader.push(&bytes[5..]);
/// assert_eq!(reader.next(None).map(|frame| frame.message), Some(heartbeat()));
/// ```
#[derive(Clone, Debug, Default)]
pub struct FrameReader {
    bytes: Vec<u8>,
    /// Losses so far, by reason.
    pub loss: FrameLoss,
    /// Number of signed frames that came while signatures are not checked.
    pub signed: u64,
}

impl FrameReader {
    /// Takes bytes of the stream, or a whole datagram.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// Discards the rest of the bytes: what follows a datagram does not continue it.
    pub fn end_of_datagram(&mut self) {
        self.loss.noise_bytes += self.bytes.len() as u64;
        self.bytes.clear();
    }

    /// Takes the next message; `None` if more bytes are needed. With a verifier, frames that it
    /// refuses are counted and skipped.
    pub fn next(&mut self, mut verifier: Option<&mut Verifier>) -> Option<Frame> {
        let mut at = 0;
        let found = loop {
            match look(&self.bytes[at..]) {
                Look::More => break None,
                Look::Noise => {
                    self.loss.noise_bytes += 1;
                    at += 1;
                }
                Look::Version1(length) => {
                    self.loss.version_1 += 1;
                    at += length;
                }
                Look::Whole { length, signed } => {
                    let frame = &self.bytes[at..at + length];
                    at += length;
                    if let Some(verifier) = verifier.as_deref_mut() {
                        if !signed {
                            self.loss.unsigned += 1;
                            continue;
                        }
                        if !verifier.accepts(&raw(frame)) {
                            self.loss.forged += 1;
                            continue;
                        }
                    } else {
                        self.signed += u64::from(signed);
                    }
                    match parse(frame) {
                        Some(frame) => break Some(frame),
                        None => self.loss.unknown += 1,
                    }
                }
            }
        };
        self.bytes.drain(..at);
        found
    }
}

enum Look {
    /// The bytes may be the start of a frame.
    More,
    /// The first byte starts no frame.
    Noise,
    Version1(usize),
    Whole {
        length: usize,
        signed: bool,
    },
}

fn look(bytes: &[u8]) -> Look {
    let Some(&first) = bytes.first() else { return Look::More };
    if first == STX_V1 {
        return version_1(bytes);
    }
    if first != STX_V2 {
        return Look::Noise;
    }
    if bytes.len() < HEADER {
        return Look::More;
    }
    let flags = bytes[2];
    // Flags that are not understood make the frame unreadable, by the protocol's own rule.
    if flags & !FLAG_SIGNED != 0 {
        return Look::Noise;
    }
    let signed = flags & FLAG_SIGNED != 0;
    let content = HEADER + usize::from(bytes[1]);
    let length = content + CHECKSUM + if signed { SIGNATURE } else { 0 };
    if bytes.len() < length {
        return Look::More;
    }
    let id = u32::from_le_bytes([bytes[7], bytes[8], bytes[9], 0]);
    let sum = u16::from_le_bytes([bytes[content], bytes[content + 1]]);
    // An unknown message's checksum cannot be known either; its frame is taken at its word,
    // and the parser refuses it.
    let known = MavMessage::default_message_from_id(id).is_some();
    if known && calculate_crc(&bytes[1..content], MavMessage::extra_crc(id)) != sum {
        return Look::Noise;
    }
    Look::Whole { length, signed }
}

/// A MAVLink 1 frame is told from noise by its checksum.
fn version_1(bytes: &[u8]) -> Look {
    const HEADER_V1: usize = 6;
    if bytes.len() < HEADER_V1 {
        return Look::More;
    }
    let content = HEADER_V1 + usize::from(bytes[1]);
    if bytes.len() < content + CHECKSUM {
        return Look::More;
    }
    let sum = u16::from_le_bytes([bytes[content], bytes[content + 1]]);
    let right = calculate_crc(&bytes[1..content], MavMessage::extra_crc(bytes[5].into()));
    if right == sum { Look::Version1(content + CHECKSUM) } else { Look::Noise }
}

fn raw(frame: &[u8]) -> MAVLinkV2MessageRaw {
    let mut bytes = [0; MAX_FRAME];
    bytes[..frame.len()].copy_from_slice(frame);
    MAVLinkV2MessageRaw::from_bytes_unparsed(bytes)
}

fn parse(frame: &[u8]) -> Option<Frame> {
    let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
    let payload = &frame[HEADER..HEADER + usize::from(frame[1])];
    let message = MavMessage::parse(MavlinkVersion::V2, id, payload).ok()?;
    let sender = Sender { system: frame[5], component: frame[6] };
    Some(Frame { sender, sequence: frame[4], message })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::signing::Key;
    use proptest::prelude::*;

    const DRONE: Sender = Sender { system: 7, component: 1 };

    fn parameter() -> MavMessage {
        MavMessage::PARAM_SET(dialect::PARAM_SET_DATA {
            param_value: 2.5,
            target_system: 7,
            target_component: 1,
            ..Default::default()
        })
    }

    #[test]
    fn a_frame_is_found_among_noise_and_in_pieces() {
        let mut bytes = vec![0, 0xFD, 3, 0xFE, 9];
        bytes.extend(encode(DRONE, 9, &parameter(), None));
        bytes.extend(encode(DRONE, 10, &parameter(), None));
        let mut reader = FrameReader::default();
        let mut found = Vec::new();
        for byte in bytes {
            reader.push(&[byte]);
            found.extend(reader.next(None));
        }
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].sender, found[0].sequence), (DRONE, 9));
        assert_eq!(found[1].message, parameter());
        assert_eq!(reader.loss.noise_bytes, 5);
    }

    #[test]
    fn a_wrong_checksum_is_noise() {
        let mut bytes = encode(DRONE, 1, &parameter(), None);
        bytes[12] ^= 1;
        let mut reader = FrameReader::default();
        reader.push(&bytes);
        assert_eq!(reader.next(None), None);
        reader.end_of_datagram();
        assert_eq!(reader.loss.noise_bytes, bytes.len() as u64);
    }

    #[test]
    fn with_a_key_unsigned_forged_and_replayed_frames_are_refused() {
        let mut signer = Signer::new(Key::from_bytes([1; 32]), 1, 1_000);
        let signed = encode(DRONE, 1, &parameter(), Some(&mut signer));
        let mut foreign = Signer::new(Key::from_bytes([2; 32]), 1, 1_000);
        let mut verifier = Verifier::new(Key::from_bytes([1; 32]), 1_000);
        let mut reader = FrameReader::default();
        reader.push(&signed);
        assert!(reader.next(Some(&mut verifier)).is_some());
        reader.push(&signed);
        reader.push(&encode(DRONE, 1, &parameter(), None));
        reader.push(&encode(DRONE, 2, &parameter(), Some(&mut foreign)));
        assert_eq!(reader.next(Some(&mut verifier)), None);
        assert_eq!((reader.loss.forged, reader.loss.unsigned), (2, 1));
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(bytes: Vec<u8>, cut in 1usize..300) {
            let mut reader = FrameReader::default();
            for piece in bytes.chunks(cut) {
                reader.push(piece);
                while reader.next(None).is_some() {}
                prop_assert!(reader.bytes.len() < MAX_FRAME + cut);
            }
        }
    }
}
