//! MAVLink's own log messages (LOG_REQUEST_LIST and so on). They have no checksum, but every
//! autopilot has them, and most serve them faster than MAVFTP: by cable 30 times as fast.

pub mod get;
pub mod list;

use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::station::AUTOPILOT;

/// Why a conversation failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LogProtocolError {
    /// No answer for the whole time of patience.
    #[error("no answer for {seconds} s: is it on, and within reach?")]
    Silent {
        /// So long.
        seconds: u64,
    },
    /// It is armed.
    #[error("the drone is armed and gives no logs until it has landed")]
    Armed,
    /// There is no log of that number.
    #[error("the drone has no log {id}")]
    NoLog {
        /// Which.
        id: u16,
    },
    /// The log ends before its size.
    #[error("the vehicle says that the log has {said} bytes, but it ends at byte {ends}")]
    SizeLies {
        /// Its size by its own word, bytes.
        said: u64,
        /// Where reading ends.
        ends: u64,
    },
    /// More than is taken.
    #[error("the log has {size} bytes, more than the {most} allowed")]
    TooLarge {
        /// Its size by the vehicle's word, bytes.
        size: u64,
        /// The limit, bytes.
        most: u64,
    },
    /// The bytes could not be kept.
    #[error("{0}")]
    Sink(String),
    /// It was ended from here, to go on in another way.
    #[error("it was ended from here")]
    Paused,
}

/// Frees the vehicle, which does not arm while it sends a log.
pub fn end_message(drone: DroneId) -> MavMessage {
    MavMessage::LOG_REQUEST_END(dialect::LOG_REQUEST_END_DATA {
        target_system: drone.system,
        target_component: AUTOPILOT,
    })
}

fn list_message(drone: DroneId, start: u16, end: u16) -> MavMessage {
    MavMessage::LOG_REQUEST_LIST(dialect::LOG_REQUEST_LIST_DATA {
        start,
        end,
        target_system: drone.system,
        target_component: AUTOPILOT,
    })
}

/// Asks for `count` bytes of log `id` from `ofs` on.
pub fn data_message(drone: DroneId, id: u16, ofs: u32, count: u32) -> MavMessage {
    MavMessage::LOG_REQUEST_DATA(dialect::LOG_REQUEST_DATA_DATA {
        ofs,
        count,
        id,
        target_system: drone.system,
        target_component: AUTOPILOT,
    })
}

/// The autopilot's own words when it is asked while armed.
fn says_armed(message: &MavMessage) -> bool {
    matches!(message, MavMessage::STATUSTEXT(text)
        if text.text.to_str().is_ok_and(|text| text.starts_with("Disarm for log")))
}
