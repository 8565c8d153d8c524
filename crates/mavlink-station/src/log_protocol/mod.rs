//! MAVLink's own log messages (LOG_REQUEST_LIST and so on). They have no checksum, but every
//! autopilot has them, and most serve them faster than MAVFTP: by cable 30 times as fast.

pub mod get;
pub mod list;

use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::station::AUTOPILOT;

/// Error of a conversation about logs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LogProtocolError {
    /// The vehicle has not answered for the whole time of patience.
    #[error("no answer for {seconds} s: is it on, and within reach?")]
    Silent {
        /// Time without an answer, s.
        seconds: u64,
    },
    /// The vehicle is armed, and sends no logs.
    #[error("the drone is armed and gives no logs until it has landed")]
    Armed,
    /// The vehicle has no log of this number.
    #[error("the drone has no log {id}")]
    NoLog {
        /// Number of the log.
        id: u16,
    },
    /// The log ends before the size that the vehicle states.
    #[error("the vehicle says that the log has {said} bytes, but it ends at byte {ends}")]
    SizeLies {
        /// Size that the vehicle states, bytes.
        said: u64,
        /// Offset at which reading ends, bytes.
        ends: u64,
    },
    /// The log is larger than the limit.
    #[error("the log has {size} bytes, more than the {most} allowed")]
    TooLarge {
        /// Size that the vehicle states, bytes.
        size: u64,
        /// Largest size accepted, bytes.
        most: u64,
    },
    /// The bytes could not be kept, for this reason.
    #[error("{0}")]
    Sink(String),
    /// The conversation was ended by the station, to continue in another way.
    #[error("it was ended from here")]
    Paused,
}

/// Message that frees the vehicle, which does not arm while it sends a log.
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

/// Message that asks for `count` bytes of log `id` from `ofs` on.
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
