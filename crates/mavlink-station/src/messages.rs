//! Messages that a station sends, made and described in one place.
//!
//! [`text`] writes a message out as people check it in a dry run: name, fields, units.

use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::station::AUTOPILOT;
use crate::protocol::ftp::Packet;
use crate::protocol::show::{SHOW_MODE, StartConfig, TO_DRONE};
use dialect::{MavCmd, MavFrame, MavMissionResult, MavMissionType, PositionTargetTypemask};
use untrusted_io::plain::{plain, plain_string};

/// Number of ArduCopter's flight mode GUIDED.
pub const GUIDED: u32 = 4;
/// Number of ArduCopter's flight mode RTL.
pub const RTL: u32 = 6;
/// Number of ArduCopter's flight mode LAND.
pub const LAND: u32 = 9;

/// Name of a flight mode by its number; `mode N` for those that have no name here.
pub fn mode_name(mode: u32) -> String {
    match mode {
        0 => "STABILIZE".to_owned(),
        2 => "ALT_HOLD".to_owned(),
        3 => "AUTO".to_owned(),
        GUIDED => "GUIDED".to_owned(),
        5 => "LOITER".to_owned(),
        RTL => "RTL".to_owned(),
        LAND => "LAND".to_owned(),
        17 => "BRAKE".to_owned(),
        SHOW_MODE => "DRONE_SHOW".to_owned(),
        other => format!("mode {other}"),
    }
}

/// A COMMAND_LONG; `confirmation` counts repetitions.
pub fn command_long(
    drone: DroneId,
    command: MavCmd,
    params: [f32; 7],
    confirmation: u8,
) -> MavMessage {
    let [param1, param2, param3, param4, param5, param6, param7] = params;
    MavMessage::COMMAND_LONG(dialect::COMMAND_LONG_DATA {
        param1,
        param2,
        param3,
        param4,
        param5,
        param6,
        param7,
        command,
        target_system: drone.system,
        target_component: AUTOPILOT,
        confirmation,
    })
}

/// A COMMAND_INT with a place: `x` and `y` in the command's unit (1e-7 degrees), and `z`.
pub fn command_int(
    drone: DroneId,
    command: MavCmd,
    params: [f32; 4],
    (x, y, z): (i32, i32, f32),
) -> MavMessage {
    let [param1, param2, param3, param4] = params;
    MavMessage::COMMAND_INT(dialect::COMMAND_INT_DATA {
        param1,
        param2,
        param3,
        param4,
        x,
        y,
        z,
        command,
        target_system: drone.system,
        target_component: AUTOPILOT,
        frame: MavFrame::MAV_FRAME_GLOBAL,
        current: 0,
        autocontinue: 0,
    })
}

/// The command that changes the flight mode.
pub fn set_mode(drone: DroneId, mode: u32, confirmation: u8) -> MavMessage {
    let params = [1.0, mode as f32, 0.0, 0.0, 0.0, 0.0, 0.0];
    command_long(drone, MavCmd::MAV_CMD_DO_SET_MODE, params, confirmation)
}

/// A start packet. It has no address: every drone that hears it obeys.
pub fn start_packet(start: &StartConfig) -> MavMessage {
    let (data, len) = start.to_data();
    MavMessage::DATA16(dialect::DATA16_DATA { mavtype: TO_DRONE, len, data })
}

/// The request for a parameter by its name.
pub fn param_read(drone: DroneId, name: &str) -> MavMessage {
    MavMessage::PARAM_REQUEST_READ(dialect::PARAM_REQUEST_READ_DATA {
        param_index: -1,
        target_system: drone.system,
        target_component: AUTOPILOT,
        param_id: name.into(),
    })
}

/// The request for a parameter by its index.
pub fn param_read_index(drone: DroneId, index: u16) -> MavMessage {
    MavMessage::PARAM_REQUEST_READ(dialect::PARAM_REQUEST_READ_DATA {
        param_index: index as i16,
        target_system: drone.system,
        target_component: AUTOPILOT,
        param_id: "".into(),
    })
}

/// The request for all parameters.
pub fn param_list(drone: DroneId) -> MavMessage {
    MavMessage::PARAM_REQUEST_LIST(dialect::PARAM_REQUEST_LIST_DATA {
        target_system: drone.system,
        target_component: AUTOPILOT,
    })
}

/// The message that sets a parameter. ArduPilot converts the value to the parameter's own type.
pub fn param_set(drone: DroneId, name: &str, value: f32) -> MavMessage {
    MavMessage::PARAM_SET(dialect::PARAM_SET_DATA {
        param_value: value,
        target_system: drone.system,
        target_component: AUTOPILOT,
        param_id: name.into(),
        param_type: dialect::MavParamType::MAV_PARAM_TYPE_REAL32,
    })
}

/// The message that carries a file transfer packet.
pub fn ftp(drone: DroneId, packet: &Packet) -> MavMessage {
    MavMessage::FILE_TRANSFER_PROTOCOL(dialect::FILE_TRANSFER_PROTOCOL_DATA {
        target_network: 0,
        target_system: drone.system,
        target_component: AUTOPILOT,
        payload: packet.to_payload(),
    })
}

/// The announcement of the number of fence items.
pub fn fence_count(drone: DroneId, count: u16) -> MavMessage {
    MavMessage::MISSION_COUNT(dialect::MISSION_COUNT_DATA {
        count,
        target_system: drone.system,
        target_component: AUTOPILOT,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
        opaque_id: 0,
    })
}

/// A corner of an inclusion polygon: latitude and longitude in 1e-7 degrees.
pub fn fence_corner(drone: DroneId, seq: u16, count: u16, (x, y): (i32, i32)) -> MavMessage {
    MavMessage::MISSION_ITEM_INT(dialect::MISSION_ITEM_INT_DATA {
        param1: f32::from(count),
        x,
        y,
        seq,
        command: MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
        target_system: drone.system,
        target_component: AUTOPILOT,
        frame: MavFrame::MAV_FRAME_GLOBAL,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
        ..Default::default()
    })
}

/// The request for the number of fence items.
pub fn fence_list(drone: DroneId) -> MavMessage {
    MavMessage::MISSION_REQUEST_LIST(dialect::MISSION_REQUEST_LIST_DATA {
        target_system: drone.system,
        target_component: AUTOPILOT,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
    })
}

/// The request for a fence item by its number.
pub fn fence_request(drone: DroneId, seq: u16) -> MavMessage {
    MavMessage::MISSION_REQUEST_INT(dialect::MISSION_REQUEST_INT_DATA {
        seq,
        target_system: drone.system,
        target_component: AUTOPILOT,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
    })
}

/// The message that ends a read of the fence.
pub fn fence_ack(drone: DroneId) -> MavMessage {
    MavMessage::MISSION_ACK(dialect::MISSION_ACK_DATA {
        target_system: drone.system,
        target_component: AUTOPILOT,
        mavtype: MavMissionResult::MAV_MISSION_ACCEPTED,
        mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
        opaque_id: 0,
    })
}

/// A target for GUIDED: position, velocity and heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedTarget {
    /// Latitude, 1e-7 degrees, north positive.
    pub lat_1e7: i32,
    /// Longitude, 1e-7 degrees, east positive.
    pub lon_1e7: i32,
    /// Height above home, m.
    pub above_home_m: f64,
    /// Velocity to the north, to the east and **up**, m/s.
    pub neu_mps: [f64; 3],
    /// Heading to keep, rad clockwise from north.
    pub yaw_rad: f64,
}

/// The message of a target for GUIDED: position (frame 6, altitude above home), velocity and
/// heading.
#[expect(deprecated, reason = "frame 6 is what ArduPilot 4.4 documents for this message")]
pub fn position_target(drone: DroneId, time_boot_ms: u32, target: &GuidedTarget) -> MavMessage {
    let ignored = PositionTargetTypemask::POSITION_TARGET_TYPEMASK_AX_IGNORE
        | PositionTargetTypemask::POSITION_TARGET_TYPEMASK_AY_IGNORE
        | PositionTargetTypemask::POSITION_TARGET_TYPEMASK_AZ_IGNORE
        | PositionTargetTypemask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
    MavMessage::SET_POSITION_TARGET_GLOBAL_INT(dialect::SET_POSITION_TARGET_GLOBAL_INT_DATA {
        time_boot_ms,
        lat_int: target.lat_1e7,
        lon_int: target.lon_1e7,
        alt: target.above_home_m as f32,
        vx: target.neu_mps[0] as f32,
        vy: target.neu_mps[1] as f32,
        vz: -target.neu_mps[2] as f32,
        yaw: target.yaw_rad as f32,
        type_mask: ignored,
        target_system: drone.system,
        target_component: AUTOPILOT,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        ..Default::default()
    })
}

/// Text of a fixed-size name without its padding zeros, made plain: a drone may send anything.
pub fn chars(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    plain_string(String::from_utf8_lossy(&bytes[..end]).into_owned())
}

/// Text of a message in one line, for a dry run.
pub fn text(message: &MavMessage) -> String {
    match message {
        MavMessage::COMMAND_LONG(c) => {
            let params = [c.param1, c.param2, c.param3, c.param4, c.param5, c.param6, c.param7];
            let used = params.iter().rposition(|value| *value != 0.0).map_or(1, |last| last + 1);
            let params: Vec<String> = params[..used].iter().map(f32::to_string).collect();
            let params = params.join(" ");
            format!("COMMAND_LONG {} ({}) {params}", command_name(c.command), c.command as u32)
        }
        MavMessage::COMMAND_INT(c) => format!(
            "COMMAND_INT {} ({}) {} {} {} {} x {} y {} z {}",
            command_name(c.command),
            c.command as u32,
            c.param1,
            c.param2,
            c.param3,
            c.param4,
            c.x,
            c.y,
            c.z
        ),
        MavMessage::PARAM_SET(p) => {
            format!("PARAM_SET {} {}", chars(&p.param_id[..]), p.param_value)
        }
        MavMessage::PARAM_REQUEST_READ(p) if p.param_index < 0 => {
            format!("PARAM_REQUEST_READ {}", chars(&p.param_id[..]))
        }
        MavMessage::PARAM_REQUEST_READ(p) => format!("PARAM_REQUEST_READ number {}", p.param_index),
        MavMessage::PARAM_REQUEST_LIST(_) => "PARAM_REQUEST_LIST".to_owned(),
        MavMessage::MISSION_COUNT(m) => format!("MISSION_COUNT fence {}", m.count),
        MavMessage::MISSION_ITEM_INT(m) => format!(
            "MISSION_ITEM_INT fence {}: {} corners {} x {} y {}",
            m.seq,
            command_name(m.command),
            m.param1,
            m.x,
            m.y
        ),
        MavMessage::MISSION_REQUEST_LIST(_) => "MISSION_REQUEST_LIST fence".to_owned(),
        MavMessage::MISSION_REQUEST_INT(m) => format!("MISSION_REQUEST_INT fence {}", m.seq),
        MavMessage::MISSION_ACK(_) => "MISSION_ACK fence".to_owned(),
        MavMessage::DATA16(d) if d.mavtype == TO_DRONE => {
            match StartConfig::from_data(&d.data, d.len) {
                Some(start) => format!(
                    "DATA16 start: second of week {}, authorization {}, countdown {} ms",
                    start.start_tow_s, start.authorization, start.countdown_ms
                ),
                None => format!("DATA16 type {:#04x}", d.mavtype),
            }
        }
        MavMessage::FILE_TRANSFER_PROTOCOL(f) => match Packet::from_payload(&f.payload) {
            Some(packet) => ftp_text(&packet),
            None => "FILE_TRANSFER_PROTOCOL".to_owned(),
        },
        MavMessage::SET_POSITION_TARGET_GLOBAL_INT(t) => format!(
            "SET_POSITION_TARGET_GLOBAL_INT frame {} mask {:#06x}: {} {} {:.2} m, velocity {:.2} \
             {:.2} {:.2} m/s (down), yaw {:.3} rad",
            t.coordinate_frame as u32,
            t.type_mask.bits(),
            t.lat_int,
            t.lon_int,
            t.alt,
            t.vx,
            t.vy,
            t.vz,
            t.yaw
        ),
        other => plain_string(format!("{other:?}")),
    }
}

fn ftp_text(packet: &Packet) -> String {
    use crate::protocol::ftp::Op;
    let name = || plain(String::from_utf8_lossy(&packet.data).trim_end_matches('\0')).into_owned();
    match packet.op {
        Op::WriteFile => {
            format!("FTP WriteFile {} bytes at {}", packet.data.len(), packet.offset)
        }
        op if packet.data.is_empty() => format!("FTP {op:?}"),
        op => format!("FTP {op:?} {}", name()),
    }
}

fn command_name(command: MavCmd) -> String {
    format!("{command:?}").trim_start_matches("MAV_CMD_").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use untrusted_io::plain::acts;

    #[test]
    fn what_a_drone_says_is_text() {
        assert_eq!(chars(b"GO\r\n\x1b[32mGO\0rest"), "GO␍␊␛[32mGO");
        assert!(!chars("a\u{202e}\u{2066}\u{9b}\u{2028}\u{7f}b\u{200f}".as_bytes()).contains(acts));
        let name = Packet::request(crate::protocol::ftp::Op::OpenFileRO).with_data(b"a\x1b[2J\n");
        assert!(!ftp_text(&name).contains(acts), "{}", ftp_text(&name));
    }
}
