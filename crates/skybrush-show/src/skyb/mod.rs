//! `.skyb`: the binary show file of one drone, as its firmware reads it.
//!
//! Little-endian. Magic `skyb`, version 1 or 2, in version 2 feature bits and (bit 0) a CRC-32, then
//! blocks of type (u8), length (u16) and body. [`write()`] makes version 2 with CRC; [`read`] takes
//! both. Coordinates are whole units of 1 to 127 mm, durations whole milliseconds.

mod read;
mod units;
mod write;
mod yaw;

use schemars::JsonSchema;
use serde::Serialize;
use thiserror::Error;

pub use read::{BlockInfo, Event, SkybContents, read};
pub use units::Quantisation;
pub use write::{Scale, SkybCost, SkybFile, SkybOptions, measure, write};

/// First bytes of every file.
pub const MAGIC: [u8; 4] = *b"skyb";
/// Largest body of a block, bytes.
pub const MAX_BODY: usize = u16::MAX as usize;
/// Coarsest scale, mm per unit.
pub const MAX_SCALE_MM: u8 = 127;
/// Larger files are refused: all known blocks together have less than 400 kB.
pub const MAX_FILE: usize = 8 << 20;
/// Bytes of a trajectory block before its first piece.
pub(crate) const TRAJECTORY_HEADER: usize = 9;

/// Types of blocks in a `.skyb` file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BlockKind {
    /// The trajectory, one per file.
    Trajectory,
    /// The light program, as Skybrush bytecode.
    Lights,
    /// A comment in UTF-8.
    Comment,
    /// Return-to-home plan. Its layout differs between firmware versions; not read or written.
    RthPlan,
    /// The yaw program: headings over time.
    Yaw,
    /// Timed events, such as pyro.
    Events,
    /// A type that this crate does not know; its blocks are skipped, as in the firmware.
    Unknown(u8),
}

impl BlockKind {
    /// Kind of a block by the byte that marks it.
    pub fn from_code(code: u8) -> Self {
        match code {
            1 => Self::Trajectory,
            2 => Self::Lights,
            3 => Self::Comment,
            4 => Self::RthPlan,
            5 => Self::Yaw,
            6 => Self::Events,
            other => Self::Unknown(other),
        }
    }

    /// The byte that marks this kind of block in a file.
    pub fn code(self) -> u8 {
        match self {
            Self::Trajectory => 1,
            Self::Lights => 2,
            Self::Comment => 3,
            Self::RthPlan => 4,
            Self::Yaw => 5,
            Self::Events => 6,
            Self::Unknown(code) => code,
        }
    }

    /// Name of the kind for people: "light program".
    pub fn name(self) -> &'static str {
        match self {
            Self::Trajectory => "trajectory",
            Self::Lights => "light program",
            Self::Comment => "comment",
            Self::RthPlan => "RTH plan",
            Self::Yaw => "yaw control",
            Self::Events => "event list",
            Self::Unknown(_) => "unknown",
        }
    }
}

/// Error of writing or reading a `.skyb` file. Offsets count bytes from the start of the file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SkybError {
    /// A piece without duration.
    #[error(
        "piece {piece} (at {at_s:.3} s) lasts 0 ms: time must not stand still, remove the piece or \
         give it a duration"
    )]
    TimeStandsStill {
        /// Number of the piece, from 1.
        piece: usize,
        /// Show time at which the piece would start, s.
        at_s: f64,
    },
    /// A coordinate is NaN or infinite.
    #[error("piece {piece} (0: the start point) has a coordinate that is not a finite number")]
    NotFinite {
        /// Number of the piece, from 1.
        piece: usize,
    },
    /// A coordinate is out of reach.
    #[error(
        "a coordinate of {value_m:.3} m does not fit: {scale_mm} mm per unit reaches ±{reach_m:.3} m \
         (move the origin to the middle of the show, or choose a coarser scale)"
    )]
    OutOfRange {
        /// The largest coordinate, control points included, m.
        value_m: f64,
        /// The coarsest scale allowed, mm.
        scale_mm: u8,
        /// Largest coordinate that the coarsest scale reaches, m.
        reach_m: f64,
    },
    /// A fixed scale outside 1..=127.
    #[error("a scale of {0} mm per unit does not exist: it must be 1 to 127")]
    BadScale(u8),
    /// The trajectory has more pieces than a block holds.
    #[error(
        "the trajectory needs {bytes} bytes, a block holds 65535: the first {fit} of its {pieces} \
         pieces fit, until {fit_s:.3} s (use fewer, longer or curved pieces)"
    )]
    TooManyPieces {
        /// Size that the trajectory block would need, bytes.
        bytes: usize,
        /// Number of pieces, after cutting long ones.
        pieces: usize,
        /// Number of pieces that would fit.
        fit: usize,
        /// End of the last piece that would fit, show time, s.
        fit_s: f64,
    },
    /// Another block is too long.
    #[error("the {block} has {bytes} bytes, a block holds 65535")]
    BlockTooLong {
        /// Name of the block.
        block: &'static str,
        /// Size of the block, bytes.
        bytes: usize,
    },
    /// The yaw program cannot be expressed.
    #[error("yaw setpoint {setpoint}: {problem}")]
    Yaw {
        /// Number of the setpoint, from 1.
        setpoint: usize,
        /// Description of the problem with the setpoint.
        problem: &'static str,
    },
    /// The file does not start with the magic of `.skyb`.
    #[error("not a .skyb file: it starts with {found:02x?}, not with \"skyb\" (73 6b 79 62)")]
    BadMagic {
        /// First bytes of the file.
        found: Vec<u8>,
    },
    /// A version that no firmware reads.
    #[error("byte 4: version {0} is not known; versions 1 and 2 are")]
    BadVersion(u8),
    /// The file is larger than any show; its size in bytes.
    #[error("the file has {0} bytes; a .skyb file larger than {MAX_FILE} bytes is refused")]
    TooLarge(usize),
    /// The checksum does not match.
    #[error(
        "byte 6: the file is damaged: its checksum says {stored:#010x}, its content gives \
         {computed:#010x}"
    )]
    BadCrc {
        /// Checksum that the file states.
        stored: u32,
        /// Checksum of the content.
        computed: u32,
    },
    /// The file or a block ends early.
    #[error("byte {offset}: {what} is cut off: {needed} bytes are needed, {left} are left")]
    Truncated {
        /// Offset at which the incomplete part starts.
        offset: usize,
        /// Name of the incomplete part.
        what: &'static str,
        /// Size of the part, bytes.
        needed: usize,
        /// Bytes left in the file.
        left: usize,
    },
    /// The file has no trajectory block.
    #[error("the file has no trajectory block: a drone would refuse the show")]
    NoTrajectory,
    /// The trajectory has pieces, but scale 0.
    #[error(
        "byte {offset}: the trajectory has a scale of 0 mm per unit, and pieces: the scale must be \
         1 to 127"
    )]
    ZeroScale {
        /// Offset of the scale's byte.
        offset: usize,
    },
    /// A piece in the file lasts 0 ms.
    #[error("byte {offset}: piece {piece} lasts 0 ms: time must not stand still")]
    ZeroDuration {
        /// Offset at which the piece starts.
        offset: usize,
        /// Number of the piece, from 1.
        piece: usize,
    },
}
