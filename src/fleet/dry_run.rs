//! Messages that a conversation would send, without a vehicle: `--dry-run`.
//!
//! A conversation talks to an [`Obliging`] vehicle that takes everything and answers at once, so that
//! the messages are exactly those of a flight on which nothing goes wrong.

use std::collections::BTreeMap;

use super::messages::{GUIDED, LAND, chars, fence_corner, fence_request, text};
use crate::base::crc::ap_crc32;
use crate::base::frame::Geodetic;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::protocol::ftp::{Op, Packet};
use crate::protocol::show::{
    CAPABILITY, FROM_DRONE, SHOW_MODE, Stage, StartConfig, Status, TO_DRONE, flag,
};
use dialect::{MavCmd, MavMissionResult, MavMissionType, MavModeFlag, MavResult};

/// A vehicle that does what it is ordered to do, at once.
#[derive(Clone, Debug)]
pub struct Obliging {
    /// Identifier of the vehicle.
    pub drone: DroneId,
    /// Whether it has the show firmware.
    pub show: bool,
    /// Position of the vehicle.
    pub place: Geodetic,
    /// Height above home, m.
    pub above_home_m: f64,
    /// Values of its parameters; others are 0.
    pub params: BTreeMap<String, f32>,
    /// Whether parameters that are not in `params` do not exist; otherwise they are 0.
    pub only_these_params: bool,
    /// Contents of its files, by name.
    pub files: BTreeMap<String, Vec<u8>>,
    /// Corners of its fence: latitude and longitude, 1e-7 degrees.
    pub fence: Vec<(i32, i32)>,
    /// Flight mode, as ArduPilot's custom mode number.
    pub mode: u32,
    /// Whether the motors may run.
    pub armed: bool,
    /// Status that it reports in show mode.
    pub status: Status,
    /// Unix time at link time 0, us.
    pub unix_us: u64,
    open_file: Option<String>,
    receiving: u16,
    next: Micros,
    beats: u32,
}

/// The obliging vehicle speaks so often.
const BEAT: Micros = 500 * MS;

impl Obliging {
    /// A vehicle with the show firmware, waiting for its start, nothing loaded; or a stock one.
    pub fn new(drone: DroneId, show: bool, place: Geodetic) -> Self {
        let status = Status {
            start_tow_s: -1,
            colour: 0,
            flags: 0,
            preflight: 0,
            stage: Stage::WaitForStart,
            gps_fix: 6,
            satellites: 20,
            boot_count: 1,
            is_far: false,
            elapsed_s: None,
        };
        Self {
            drone,
            show,
            place,
            above_home_m: 0.0,
            params: BTreeMap::new(),
            only_these_params: false,
            files: BTreeMap::new(),
            fence: Vec::new(),
            mode: if show { SHOW_MODE } else { 0 },
            armed: false,
            status,
            unix_us: 1_795_143_537_000_000,
            open_file: None,
            receiving: 0,
            next: 0,
            beats: 0,
        }
    }

    /// Handles a message from the station; answers go to `out`.
    pub fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        match message {
            MavMessage::COMMAND_LONG(c) => {
                self.command(now, c.command, c.param1, c.param2, c.param7, out);
            }
            MavMessage::COMMAND_INT(c) => {
                self.status.flags |= flag::ORIGIN_SET | flag::ORIENTATION_SET;
                out.push(ack(c.command));
            }
            MavMessage::PARAM_REQUEST_READ(p) => {
                let numbered = usize::try_from(p.param_index).ok();
                let name = numbered.and_then(|index| self.params.keys().nth(index).cloned());
                self.param(&name.unwrap_or_else(|| chars(&p.param_id[..])), out);
            }
            MavMessage::PARAM_SET(p) => {
                let name = chars(&p.param_id[..]);
                if !self.only_these_params || self.params.contains_key(&name) {
                    if name == "FENCE_ENABLE" && p.param_value != 0.0 {
                        self.status.flags |= flag::FENCE_ON;
                    }
                    self.params.insert(name.clone(), p.param_value);
                    self.param(&name, out);
                }
            }
            MavMessage::PARAM_REQUEST_LIST(_) => {
                let names: Vec<String> = self.params.keys().cloned().collect();
                for name in &names {
                    self.param(name, out);
                }
            }
            MavMessage::MISSION_COUNT(m) => {
                self.fence.clear();
                self.receiving = m.count;
                out.push(fence_request(self.drone, 0));
            }
            MavMessage::MISSION_ITEM_INT(m) => self.corner(m, out),
            MavMessage::MISSION_REQUEST_LIST(_) => {
                out.push(super::messages::fence_count(self.drone, self.fence.len() as u16));
            }
            MavMessage::MISSION_REQUEST_INT(m) => {
                if let Some(corner) = self.fence.get(usize::from(m.seq)) {
                    let count = self.fence.len() as u16;
                    out.push(fence_corner(self.drone, m.seq, count, *corner));
                }
            }
            MavMessage::FILE_TRANSFER_PROTOCOL(f) => {
                if let Some(packet) = Packet::from_payload(&f.payload) {
                    let answer = self.file(&packet);
                    out.push(super::messages::ftp(DroneId { network: 0, system: 0 }, &answer));
                }
            }
            MavMessage::DATA16(d) if d.mavtype == TO_DRONE => {
                if let Some(start) = StartConfig::from_data(&d.data, d.len) {
                    self.start(start);
                }
            }
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(t) => {
                self.place.lat_deg = f64::from(t.lat_int) / 1e7;
                self.place.lon_deg = f64::from(t.lon_int) / 1e7;
                self.above_home_m = f64::from(t.alt);
            }
            _ => {}
        }
    }

    /// Adds the messages that the vehicle sends unasked to `out`; returns the time at which it
    /// wants to be polled again.
    pub fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        if now < self.next {
            return self.next;
        }
        self.next = now + BEAT;
        self.beats += 1;
        // What it still lacks of a fence it asks for again.
        if self.fence.len() < usize::from(self.receiving) && self.beats.is_multiple_of(2) {
            out.push(fence_request(self.drone, self.fence.len() as u16));
        }
        out.push(self.position(now));
        if self.show {
            let data = self.status.to_data();
            let (mavtype, len) = (FROM_DRONE, Status::LENGTH);
            out.push(MavMessage::DATA16(dialect::DATA16_DATA { mavtype, len, data }));
        }
        if self.beats % 2 == 1 {
            self.second(now, out);
            if self.mode == LAND && self.armed {
                self.armed = false;
                self.above_home_m = 0.0;
            }
        }
        self.next
    }

    fn second(&self, now: Micros, out: &mut Vec<MavMessage>) {
        let mut base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
        base_mode.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, self.armed);
        out.push(MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA {
            custom_mode: self.mode,
            mavtype: dialect::MavType::MAV_TYPE_QUADROTOR,
            autopilot: dialect::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode,
            system_status: dialect::MavState::MAV_STATE_STANDBY,
            mavlink_version: 3,
        }));
        let prearm = dialect::MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
        out.push(MavMessage::SYS_STATUS(dialect::SYS_STATUS_DATA {
            onboard_control_sensors_present: prearm,
            onboard_control_sensors_enabled: prearm,
            onboard_control_sensors_health: prearm,
            voltage_battery: 12_600,
            battery_remaining: 98,
            ..Default::default()
        }));
        out.push(MavMessage::GPS_RAW_INT(dialect::GPS_RAW_INT_DATA {
            fix_type: dialect::GpsFixType::GPS_FIX_TYPE_RTK_FIXED,
            satellites_visible: 20,
            h_acc: 300,
            ..Default::default()
        }));
        out.push(MavMessage::SYSTEM_TIME(dialect::SYSTEM_TIME_DATA {
            time_unix_usec: self.unix_us + now,
            time_boot_ms: (now / MS) as u32,
        }));
    }

    fn position(&self, now: Micros) -> MavMessage {
        MavMessage::GLOBAL_POSITION_INT(dialect::GLOBAL_POSITION_INT_DATA {
            time_boot_ms: (now / MS) as u32,
            lat: super::fence::degrees_1e7(self.place.lat_deg),
            lon: super::fence::degrees_1e7(self.place.lon_deg),
            alt: ((self.place.amsl_m + self.above_home_m) * 1000.0) as i32,
            relative_alt: (self.above_home_m * 1000.0) as i32,
            hdg: 9000,
            ..Default::default()
        })
    }

    fn command(
        &mut self,
        now: Micros,
        command: MavCmd,
        first: f32,
        second: f32,
        last: f32,
        out: &mut Vec<MavMessage>,
    ) {
        match command {
            MavCmd::MAV_CMD_USER_1 if first == 0.0 => {
                let loaded = self.files.values().any(|file| !file.is_empty());
                self.status.flags &= !flag::LOADED;
                self.status.flags |= if loaded { flag::LOADED } else { 0 };
            }
            MavCmd::MAV_CMD_USER_1 => {
                self.files.clear();
                self.status.flags &= !flag::LOADED;
            }
            MavCmd::MAV_CMD_DO_SET_MODE => {
                self.mode = second as u32;
                if self.mode == SHOW_MODE && self.status.stage == Stage::Off {
                    self.status.stage = Stage::WaitForStart;
                } else if self.mode != SHOW_MODE {
                    self.status.stage = Stage::Off;
                }
            }
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => self.armed = first == 1.0,
            MavCmd::MAV_CMD_NAV_TAKEOFF if self.mode == GUIDED && self.armed => {
                self.above_home_m = last.into();
                out.push(self.position(now));
            }
            MavCmd::MAV_CMD_REQUEST_MESSAGE => {
                let capabilities = if self.show { CAPABILITY } else { 0 };
                out.push(MavMessage::AUTOPILOT_VERSION(dialect::AUTOPILOT_VERSION_DATA {
                    capabilities: dialect::MavProtocolCapability::from_bits_retain(capabilities),
                    flight_sw_version: u32::from_be_bytes([4, 4, 4, 255]),
                    ..Default::default()
                }));
            }
            _ => {}
        }
        out.push(ack(command));
    }

    fn param(&self, name: &str, out: &mut Vec<MavMessage>) {
        let index = self.params.keys().position(|known| known == name);
        if index.is_none() && self.only_these_params {
            return;
        }
        out.push(MavMessage::PARAM_VALUE(dialect::PARAM_VALUE_DATA {
            param_value: self.params.get(name).copied().unwrap_or(0.0),
            param_count: self.params.len() as u16,
            param_index: index.map_or(u16::MAX, |index| index as u16),
            param_id: name.into(),
            param_type: dialect::MavParamType::MAV_PARAM_TYPE_REAL32,
        }));
    }

    fn corner(&mut self, item: &dialect::MISSION_ITEM_INT_DATA, out: &mut Vec<MavMessage>) {
        if usize::from(item.seq) == self.fence.len() && item.seq < self.receiving {
            self.fence.push((item.x, item.y));
        }
        let have = self.fence.len() as u16;
        out.push(if have < self.receiving {
            fence_request(self.drone, have)
        } else {
            MavMessage::MISSION_ACK(dialect::MISSION_ACK_DATA {
                mavtype: MavMissionResult::MAV_MISSION_ACCEPTED,
                mission_type: MavMissionType::MAV_MISSION_TYPE_FENCE,
                ..Default::default()
            })
        });
    }

    fn start(&mut self, start: StartConfig) {
        let flags = &mut self.status.flags;
        if start.start_tow_s < 0 {
            self.status.start_tow_s = -1;
            *flags &= !flag::START_SET;
        } else if start.start_tow_s < 604_800 {
            self.status.start_tow_s = start.start_tow_s;
            *flags |= flag::START_SET;
        }
        *flags &= !flag::AUTHORIZED;
        *flags |= if start.authorization > 0 { flag::AUTHORIZED } else { 0 };
    }

    fn file(&mut self, packet: &Packet) -> Packet {
        let name = String::from_utf8_lossy(&packet.data).trim_end_matches('\0').to_owned();
        let mut answer = Packet::request(Op::Ack);
        match packet.op {
            Op::CalcFileCRC32 => match self.files.get(&name) {
                Some(file) => {
                    answer = answer.with_data(&ap_crc32(file).to_le_bytes());
                }
                None => answer = Packet::request(Op::Nak).with_data(&[10]),
            },
            Op::CreateFile => {
                self.files.insert(name.clone(), Vec::new());
                self.open_file = Some(name);
            }
            Op::WriteFile => {
                if let Some(file) = self.open_file.as_ref().and_then(|f| self.files.get_mut(f)) {
                    let end = packet.offset as usize + packet.data.len();
                    file.resize(file.len().max(end), 0);
                    file[packet.offset as usize..end].copy_from_slice(&packet.data);
                }
            }
            _ => {}
        }
        answer.sequence = packet.sequence.wrapping_add(1);
        answer.session = packet.session;
        answer.request = packet.op;
        answer
    }
}

fn ack(command: MavCmd) -> MavMessage {
    MavMessage::COMMAND_ACK(dialect::COMMAND_ACK_DATA {
        command,
        result: MavResult::MAV_RESULT_ACCEPTED,
        ..Default::default()
    })
}

/// Runs a conversation with an obliging vehicle: its messages, one line each with the time since
/// the first, and its result. The result is `None` if it did not end within a day of its time or
/// `most` messages.
pub fn dry_run<C: Conversation>(
    mut conversation: C,
    vehicle: &mut Obliging,
    most: usize,
) -> (Vec<String>, Option<C::Done>) {
    const DAY: Micros = 24 * 3600 * S;
    let (mut lines, mut now, mut heard) = (Vec::new(), 0, Vec::new());
    while now < DAY && lines.len() < most {
        let wake = vehicle.poll(now, &mut heard);
        for message in heard.drain(..) {
            conversation.on_message(now, &message);
        }
        match conversation.poll(now) {
            Step::Send(message) => {
                lines.push(format!("{:9.3} s  {}", now as f64 / 1e6, text(&message)));
                vehicle.on_message(now, &message, &mut heard);
            }
            Step::Wait(until) => {
                // Answers that are there are taken before time goes on.
                if heard.is_empty() {
                    now = until.min(wake).max(now + 1);
                }
            }
            Step::Done(done) => return (lines, Some(done)),
        }
    }
    (lines, None)
}

#[cfg(test)]
mod tests {
    use super::super::messages::{GuidedTarget, position_target};
    use super::*;

    #[test]
    fn the_vehicle_says_that_it_is_where_it_was_sent() {
        let drone = DroneId { network: 0, system: 1 };
        let home = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 100.0 };
        let mut vehicle = Obliging::new(drone, false, home);
        let target = GuidedTarget {
            lat_1e7: 470_012_345,
            lon_1e7: -190_054_321,
            above_home_m: 12.5,
            neu_mps: [0.0; 3],
            yaw_rad: 0.0,
        };
        let mut said = Vec::new();
        vehicle.on_message(0, &position_target(drone, 0, &target), &mut said);
        vehicle.poll(0, &mut said);
        let at = said.iter().find_map(|message| match message {
            MavMessage::GLOBAL_POSITION_INT(at) => Some((at.lat, at.lon, at.alt, at.relative_alt)),
            _ => None,
        });
        assert_eq!(at, Some((470_012_345, -190_054_321, 112_500, 12_500)));
    }
}
