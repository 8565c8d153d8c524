//! The servo packet: little-endian `u16` magic, `u16` frame rate, `u32` frame count, `u16` pulses.

use thiserror::Error;

/// Starts a packet of 16 pulses.
const MAGIC_16: u16 = 18_458;
/// Starts a packet of 32 pulses (parameter SERVO_32_ENABLE).
const MAGIC_32: u16 = 29_569;
const HEADER_BYTES: usize = 8;
/// Length of the longest packet, bytes.
pub const MAX_PACKET_BYTES: usize = HEADER_BYTES + 2 * 32;

/// Outputs of the firmware for one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoPacket {
    /// Frames per second that the firmware asks for (SIM_RATE_HZ); never 0.
    pub frame_rate_hz: u16,
    /// Number of frames for which the firmware got a reply.
    pub frame_count: u32,
    /// Pulse width of each output, us; 0 where the firmware gives none.
    pub pulses_us: [u16; 32],
}

/// Error of reading a servo packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PacketError {
    /// The packet is too short for its magic number, or too long.
    #[error("a packet of {bytes} bytes is not a servo packet (40 or 72 bytes)")]
    Size {
        /// Length of the packet, bytes.
        bytes: usize,
    },
    /// The packet is not from ArduPilot, or from another version of its interface.
    #[error("a packet that starts with {magic} is not a servo packet ({MAGIC_16} or {MAGIC_32})")]
    Magic {
        /// Number at the start of the packet.
        magic: u16,
    },
    /// The frame rate is 0: there is no time to simulate.
    #[error("a servo packet asks for 0 frames per second")]
    Rate,
}

impl ServoPacket {
    /// Reads a packet.
    ///
    /// # Errors
    /// See [`PacketError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, PacketError> {
        let size = PacketError::Size { bytes: bytes.len() };
        let (header, body) = bytes.split_first_chunk::<HEADER_BYTES>().ok_or(size)?;
        let [m0, m1, r0, r1, count @ ..] = *header;
        let channels = match u16::from_le_bytes([m0, m1]) {
            MAGIC_16 => 16,
            MAGIC_32 => 32,
            magic => return Err(PacketError::Magic { magic }),
        };
        if body.len() != 2 * channels {
            return Err(size);
        }
        let frame_rate_hz = u16::from_le_bytes([r0, r1]);
        if frame_rate_hz == 0 {
            return Err(PacketError::Rate);
        }
        let mut pulses_us = [0; 32];
        for (pulse, bytes) in pulses_us.iter_mut().zip(body.as_chunks::<2>().0) {
            *pulse = u16::from_le_bytes(*bytes);
        }
        Ok(Self { frame_rate_hz, frame_count: u32::from_le_bytes(count), pulses_us })
    }

    /// Bytes of a packet with 16 pulses, as the firmware sends it.
    pub fn to_bytes(&self) -> [u8; HEADER_BYTES + 32] {
        let mut bytes = [0; HEADER_BYTES + 32];
        bytes[..2].copy_from_slice(&MAGIC_16.to_le_bytes());
        bytes[2..4].copy_from_slice(&self.frame_rate_hz.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.frame_count.to_le_bytes());
        for (place, pulse) in bytes[8..].as_chunks_mut::<2>().0.iter_mut().zip(self.pulses_us) {
            *place = pulse.to_le_bytes();
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Written by hand from the interface's description: magic 0x481A, 1200 Hz, frame 258, pulses.
    fn by_hand() -> Vec<u8> {
        let mut bytes = vec![0x1A, 0x48, 0xB0, 0x04, 0x02, 0x01, 0x00, 0x00];
        for channel in 0..16_u8 {
            bytes.extend([0xDC, 0x05 + channel]);
        }
        bytes
    }

    #[test]
    fn reads_what_the_interface_describes() {
        let packet = ServoPacket::parse(&by_hand()).unwrap();
        assert_eq!((packet.frame_rate_hz, packet.frame_count), (1200, 258));
        assert_eq!(packet.pulses_us[..3], [1500, 1756, 2012]);
        assert_eq!(packet.pulses_us[16..], [0; 16]);
        assert_eq!(packet.to_bytes()[..], by_hand());
    }

    #[test]
    fn reads_32_channels() {
        let mut bytes = by_hand();
        bytes[..2].copy_from_slice(&29_569_u16.to_le_bytes());
        assert_eq!(ServoPacket::parse(&bytes), Err(PacketError::Size { bytes: 40 }));
        bytes.extend((0..16_u16).flat_map(|channel| (1000 + channel).to_le_bytes()));
        let packet = ServoPacket::parse(&bytes).unwrap();
        assert_eq!((packet.pulses_us[0], packet.pulses_us[31]), (1500, 1015));
    }

    #[test]
    fn refuses_everything_else_and_says_why() {
        let good = by_hand();
        for length in [0, 1, 7, 8, 39] {
            let refused = ServoPacket::parse(&good[..length]);
            assert_eq!(refused, Err(PacketError::Size { bytes: length }));
        }
        let long = [good.clone(), vec![0]].concat();
        assert_eq!(ServoPacket::parse(&long), Err(PacketError::Size { bytes: 41 }));
        let mut other = good.clone();
        other[0] = 0x1B;
        assert_eq!(ServoPacket::parse(&other), Err(PacketError::Magic { magic: 18_459 }));
        let mut still = good;
        still[2..4].fill(0);
        assert_eq!(ServoPacket::parse(&still), Err(PacketError::Rate));
    }
}
