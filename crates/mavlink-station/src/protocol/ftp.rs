//! MAVFTP: the payload of FILE_TRANSFER_PROTOCOL (MAVLink's "File Transfer Protocol").

/// Largest number of data bytes in one packet.
pub const MOST_DATA: usize = 239;
/// Size of the payload, bytes: a header of 12 and the data.
pub const PAYLOAD: usize = 251;
const HEADER: usize = 12;

/// Operation of a packet: a request, or an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Op {
    /// Request without any effect.
    None = 0,
    /// Request to close a session.
    TerminateSession = 1,
    /// Request to close all sessions.
    ResetSessions = 2,
    /// Request for the entries of a folder.
    ListDirectory = 3,
    /// Request to open a file for reading; the answer's data is its size, u32.
    OpenFileRO = 4,
    /// Request to read from the open file.
    ReadFile = 5,
    /// Request to create a file, or to empty one.
    CreateFile = 6,
    /// Request to write to the open file.
    WriteFile = 7,
    /// Request to remove a file.
    RemoveFile = 8,
    /// Request to create a folder.
    CreateDirectory = 9,
    /// Request to remove a folder.
    RemoveDirectory = 10,
    /// Request to open a file for writing.
    OpenFileWO = 11,
    /// Request to cut a file at a length.
    TruncateFile = 12,
    /// Request to rename a file.
    Rename = 13,
    /// Request for the checksum of a whole file; the answer's data is a u32.
    CalcFileCRC32 = 14,
    /// Request to read from the open file, with many answers.
    BurstReadFile = 15,
    /// Answer that the request was carried out.
    Ack = 128,
    /// Answer that the request was refused; the data's first byte is a [`NakReason`].
    Nak = 129,
}

impl Op {
    fn from_byte(byte: u8) -> Option<Self> {
        const ALL: [Op; 18] = [
            Op::None,
            Op::TerminateSession,
            Op::ResetSessions,
            Op::ListDirectory,
            Op::OpenFileRO,
            Op::ReadFile,
            Op::CreateFile,
            Op::WriteFile,
            Op::RemoveFile,
            Op::CreateDirectory,
            Op::RemoveDirectory,
            Op::OpenFileWO,
            Op::TruncateFile,
            Op::Rename,
            Op::CalcFileCRC32,
            Op::BurstReadFile,
            Op::Ack,
            Op::Nak,
        ];
        ALL.into_iter().find(|op| *op as u8 == byte)
    }
}

/// Reason for a refusal, by the protocol's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NakReason {
    /// 1: no reason given.
    Fail,
    /// 2: the file system's own number follows.
    FailErrno(u8),
    /// 3: the size does not fit the request.
    InvalidDataSize,
    /// 4: no such session.
    InvalidSession,
    /// 5: all sessions are in use.
    NoSessionsAvailable,
    /// 6: the offset is at or behind the end.
    EndOfFile,
    /// 7: not known to the vehicle.
    UnknownCommand,
    /// 8: the file is there already.
    FileExists,
    /// 9: the file is protected.
    FileProtected,
    /// 10: no such file.
    FileNotFound,
    /// A number that the protocol does not have.
    Other(u8),
}

impl std::fmt::Display for NakReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = match self {
            Self::Fail => "failed",
            Self::FailErrno(number) => return write!(f, "file system error {number}"),
            Self::InvalidDataSize => "wrong size of a request",
            Self::InvalidSession => "no such session",
            Self::NoSessionsAvailable => "no free session: another transfer is open",
            Self::EndOfFile => "behind the end of the file",
            Self::UnknownCommand => "the vehicle does not know the request",
            Self::FileExists => "the file exists",
            Self::FileProtected => "the file is protected",
            Self::FileNotFound => "no such file",
            Self::Other(number) => return write!(f, "error {number}"),
        };
        f.write_str(text)
    }
}

/// A packet of the protocol.
///
/// ```
/// use mavlink_station::protocol::ftp::{NakReason, Op, Packet};
///
/// let request = Packet::request(Op::OpenFileRO).with_data(b"/APM/LOGS/00000001.BIN");
/// assert_eq!(Packet::from_payload(&request.to_payload()), Some(request));
/// let answer = Packet::request(Op::Nak).with_data(&[10]);
/// assert_eq!(answer.refusal(), Some(NakReason::FileNotFound));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    /// Number of the packet; an answer's is its request's plus one.
    pub sequence: u16,
    /// Session, as numbered by the vehicle.
    pub session: u8,
    /// Operation that is requested, or [`Op::Ack`] or [`Op::Nak`].
    pub op: Op,
    /// Size that a request asks for, otherwise the size of the data; bytes.
    pub size: u8,
    /// Request that an answer belongs to.
    pub request: Op,
    /// Whether this is the last answer of a burst, after which the vehicle waits for the next
    /// request.
    pub burst_complete: bool,
    /// Offset in the file, bytes.
    pub offset: u32,
    /// Data of the packet, at most [`MOST_DATA`] bytes.
    pub data: Vec<u8>,
}

impl Packet {
    /// A request without data, in session 0.
    pub fn request(op: Op) -> Self {
        Self {
            sequence: 0,
            session: 0,
            op,
            size: 0,
            request: Op::None,
            burst_complete: false,
            offset: 0,
            data: Vec::new(),
        }
    }

    /// Adds data, such as a file's name; what does not fit is cut off.
    #[must_use]
    pub fn with_data(mut self, data: &[u8]) -> Self {
        self.data = data[..data.len().min(MOST_DATA)].to_vec();
        self.size = self.data.len() as u8;
        self
    }

    /// Encodes the packet as the payload of a message.
    pub fn to_payload(&self) -> [u8; PAYLOAD] {
        let mut bytes = [0; PAYLOAD];
        bytes[0..2].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[2] = self.session;
        bytes[3] = self.op as u8;
        bytes[4] = self.size;
        bytes[5] = self.request as u8;
        bytes[6] = u8::from(self.burst_complete);
        bytes[8..12].copy_from_slice(&self.offset.to_le_bytes());
        let length = self.data.len().min(MOST_DATA);
        bytes[HEADER..HEADER + length].copy_from_slice(&self.data[..length]);
        bytes
    }

    /// Decodes the payload of a message; `None` for an unknown operation or an impossible size.
    pub fn from_payload(bytes: &[u8; PAYLOAD]) -> Option<Self> {
        let op = Op::from_byte(bytes[3])?;
        let size = bytes[4];
        if usize::from(size) > MOST_DATA {
            return None;
        }
        Some(Self {
            sequence: u16::from_le_bytes([bytes[0], bytes[1]]),
            session: bytes[2],
            op,
            size,
            request: Op::from_byte(bytes[5])?,
            burst_complete: bytes[6] != 0,
            offset: u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]),
            data: bytes[HEADER..HEADER + usize::from(size)].to_vec(),
        })
    }

    /// Reason of a refusal; `None` if the packet is not a refusal.
    pub fn refusal(&self) -> Option<NakReason> {
        if self.op != Op::Nak {
            return None;
        }
        Some(match self.data.first().copied().unwrap_or(1) {
            1 => NakReason::Fail,
            2 => NakReason::FailErrno(self.data.get(1).copied().unwrap_or(0)),
            3 => NakReason::InvalidDataSize,
            4 => NakReason::InvalidSession,
            5 => NakReason::NoSessionsAvailable,
            6 => NakReason::EndOfFile,
            7 => NakReason::UnknownCommand,
            8 => NakReason::FileExists,
            9 => NakReason::FileProtected,
            10 => NakReason::FileNotFound,
            other => NakReason::Other(other),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn any_payload_is_survived_and_what_is_read_is_written_the_same(
            bytes in proptest::collection::vec(any::<u8>(), PAYLOAD)
        ) {
            let mut payload = [0; PAYLOAD];
            payload.copy_from_slice(&bytes);
            payload[3] %= 18;
            payload[5] %= 16;
            if let Some(packet) = Packet::from_payload(&payload) {
                prop_assert_eq!(Packet::from_payload(&packet.to_payload()), Some(packet));
            }
        }
    }

    #[test]
    fn a_refusal_says_why() {
        let nak = Packet::request(Op::Nak).with_data(&[10]);
        assert_eq!(nak.refusal().unwrap().to_string(), "no such file");
        let errno = Packet::request(Op::Nak).with_data(&[2, 28]);
        assert_eq!(errno.refusal().unwrap().to_string(), "file system error 28");
    }
}
