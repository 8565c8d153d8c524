//! Classes of messages by what they can do to a drone.

use crate::fleet::messages::{LAND, RTL};
use crate::link::frame::{MavMessage, dialect};
use crate::protocol::ftp::{Op, Packet};
use crate::protocol::show::{StartConfig, TO_DRONE};
use dialect::MavCmd;

/// Class of a message by what it can do, which decides to whom it may be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Reads, or asks for reports: may go to any drone at any time.
    Harmless,
    /// Changes a drone's files, parameters or mode, or arms it: only on the ground, disarmed.
    Ground,
    /// Sets or authorizes a start. It has no address: every drone that hears it must be on the
    /// ground.
    Start,
    /// Flies a drone (a take-off, a target): only if it is armed.
    Flight,
    /// Ends a flight, or withdraws a start: may go to any drone at any time.
    Emergency,
}

/// Class of a message; `None` if this program never sends it.
pub fn class(message: &MavMessage) -> Option<Class> {
    Some(match message {
        MavMessage::HEARTBEAT(_)
        | MavMessage::PARAM_REQUEST_READ(_)
        | MavMessage::PARAM_REQUEST_LIST(_)
        | MavMessage::MISSION_REQUEST_LIST(_)
        | MavMessage::MISSION_REQUEST_INT(_)
        | MavMessage::MISSION_ACK(_)
        | MavMessage::LOG_REQUEST_LIST(_)
        | MavMessage::LOG_REQUEST_DATA(_)
        | MavMessage::LOG_REQUEST_END(_) => Class::Harmless,
        MavMessage::PARAM_SET(_)
        | MavMessage::MISSION_COUNT(_)
        | MavMessage::MISSION_ITEM_INT(_) => Class::Ground,
        MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_) => Class::Flight,
        MavMessage::FILE_TRANSFER_PROTOCOL(file) => {
            if reads(Packet::from_payload(&file.payload)?.op) {
                Class::Harmless
            } else {
                Class::Ground
            }
        }
        MavMessage::DATA16(data) if data.mavtype == TO_DRONE => {
            let start = StartConfig::from_data(&data.data, data.len)?;
            let takes_back = start.start_tow_s < 0 && start.authorization == 0;
            if takes_back { Class::Emergency } else { Class::Start }
        }
        MavMessage::COMMAND_INT(command) if command.command == MavCmd::MAV_CMD_USER_2 => {
            Class::Ground
        }
        MavMessage::COMMAND_LONG(command) => match command.command {
            MavCmd::MAV_CMD_REQUEST_MESSAGE | MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL => {
                Class::Harmless
            }
            MavCmd::MAV_CMD_DO_SET_MODE if [RTL, LAND].contains(&(command.param2 as u32)) => {
                Class::Emergency
            }
            MavCmd::MAV_CMD_USER_1 | MavCmd::MAV_CMD_DO_SET_MODE => Class::Ground,
            // Nobody is disarmed: in the air that is a crash.
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if command.param1 == 1.0 => Class::Ground,
            MavCmd::MAV_CMD_NAV_TAKEOFF => Class::Flight,
            _ => return None,
        },
        _ => return None,
    })
}

/// Whether an operation leaves the files as they are.
fn reads(op: Op) -> bool {
    match op {
        Op::None
        | Op::TerminateSession
        | Op::ResetSessions
        | Op::ListDirectory
        | Op::OpenFileRO
        | Op::ReadFile
        | Op::CalcFileCRC32
        | Op::BurstReadFile
        | Op::Ack
        | Op::Nak => true,
        Op::CreateFile
        | Op::WriteFile
        | Op::RemoveFile
        | Op::CreateDirectory
        | Op::RemoveDirectory
        | Op::OpenFileWO
        | Op::TruncateFile
        | Op::Rename => false,
    }
}
