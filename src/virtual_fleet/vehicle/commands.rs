//! Commands and their acknowledgements.

use super::VirtualVehicle;
use super::guided::GUIDED;
use super::show_mode::Reload;
use super::telemetry::AUTOPILOT_VERSION;
use super::words::error;
use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, dialect};
use crate::link::station::STATION;
use crate::protocol::show::{self, SHOW_FILE, SHOW_MODE};
use crate::sim::autopilot::director::Abort;
use dialect::MavResult::{
    self, MAV_RESULT_ACCEPTED as ACCEPTED, MAV_RESULT_DENIED as DENIED,
    MAV_RESULT_FAILED as FAILED, MAV_RESULT_UNSUPPORTED as UNSUPPORTED,
};

/// Numbers of MAVLink's commands.
const NAV_RETURN_TO_LAUNCH: u16 = 20;
const NAV_LAND: u16 = 21;
const NAV_TAKEOFF: u16 = 22;
const DO_SET_MODE: u16 = 176;
const PREFLIGHT_REBOOT: u16 = 246;
const ARM_DISARM: u16 = 400;
const RUN_PREARM_CHECKS: u16 = 401;
const SET_MESSAGE_INTERVAL: u16 = 511;
const REQUEST_MESSAGE: u16 = 512;
const REQUEST_CAPABILITIES: u16 = 520;
/// Modes that are entered on the ground without much ado.
const ON_GROUND: [u32; 8] = [0, 2, 3, 4, 5, 6, 9, 17];
const RTL: u32 = 6;
const LAND: u32 = 9;
/// Second parameter of a disarming that is meant in the air, too.
const FORCE: f32 = 21_196.0;

/// A command of either kind.
pub(super) struct Command {
    number: dialect::MavCmd,
    params: [f32; 4],
    /// Latitude, longitude, altitude; only COMMAND_INT has them exactly.
    place: Option<(i32, i32, f32)>,
    /// The last parameter, m where it is an altitude.
    altitude_m: f32,
}

impl From<&dialect::COMMAND_LONG_DATA> for Command {
    fn from(it: &dialect::COMMAND_LONG_DATA) -> Self {
        let params = [it.param1, it.param2, it.param3, it.param4];
        Self { number: it.command, params, place: None, altitude_m: it.param7 }
    }
}

impl From<&dialect::COMMAND_INT_DATA> for Command {
    fn from(it: &dialect::COMMAND_INT_DATA) -> Self {
        let params = [it.param1, it.param2, it.param3, it.param4];
        let place = Some((it.x, it.y, it.z));
        Self { number: it.command, params, place, altitude_m: it.z }
    }
}

impl VirtualVehicle<'_> {
    pub(super) fn on_command(&mut self, now: Micros, command: &Command, out: &mut Vec<MavMessage>) {
        let result = self.execute(now, command, out);
        out.push(MavMessage::COMMAND_ACK(dialect::COMMAND_ACK_DATA {
            command: command.number,
            result,
            progress: 0,
            result_param2: 0,
            target_system: STATION.system,
            target_component: STATION.component,
        }));
    }

    fn execute(&mut self, now: Micros, command: &Command, out: &mut Vec<MavMessage>) -> MavResult {
        let [first, second, ..] = command.params;
        match command.number as u32 as u16 {
            show::RELOAD if !self.setup.stock => self.reload_or_clear(first),
            show::SET_ORIGIN if !self.setup.stock => self.set_origin(command),
            // Skybrush Server brings drones down by these, not by their modes.
            NAV_RETURN_TO_LAUNCH => self.set_mode(RTL),
            NAV_LAND => self.set_mode(LAND),
            NAV_TAKEOFF if self.mode != GUIDED => FAILED,
            NAV_TAKEOFF => self.take_off(now, command.altitude_m, out),
            DO_SET_MODE if first as u32 & 1 == 0 => DENIED,
            DO_SET_MODE => self.set_mode(second as u32),
            ARM_DISARM => self.arm_or_disarm(now, first, second, out),
            RUN_PREARM_CHECKS if self.is_armed() => FAILED,
            RUN_PREARM_CHECKS => {
                out.extend(self.obstacle(now).map(error));
                ACCEPTED
            }
            PREFLIGHT_REBOOT if self.airborne.is_some() => FAILED,
            PREFLIGHT_REBOOT if first == 1.0 || first == 3.0 => {
                self.reboot(now);
                ACCEPTED
            }
            SET_MESSAGE_INTERVAL => {
                if self.streams.set(now, first as u32, second) {
                    ACCEPTED
                } else {
                    FAILED
                }
            }
            REQUEST_MESSAGE => match self.telling(now).message(first as u32) {
                Some(message) => {
                    out.push(message);
                    ACCEPTED
                }
                None => FAILED,
            },
            REQUEST_CAPABILITIES => {
                out.extend(self.telling(now).message(AUTOPILOT_VERSION));
                ACCEPTED
            }
            _ => UNSUPPORTED,
        }
    }

    fn reload_or_clear(&mut self, which: f32) -> MavResult {
        if self.is_armed() {
            return FAILED;
        }
        if which == 1.0 {
            let _ = self.storage.remove(SHOW_FILE);
        } else if which != 0.0 {
            return UNSUPPORTED;
        }
        match self.reload() {
            Reload::Loaded | Reload::Nothing => ACCEPTED,
            Reload::Broken => FAILED,
        }
    }

    fn set_origin(&mut self, command: &Command) -> MavResult {
        let [which, _, _, orientation_deg] = command.params;
        // A long command's floats would lose half a metre.
        let Some((lat, lon, amsl_mm)) = command.place.filter(|_| which == 0.0) else {
            return UNSUPPORTED;
        };
        if !orientation_deg.is_finite() || !(-900_000_000..=900_000_000).contains(&lat) {
            return FAILED;
        }
        self.show.origin = Some([lat, lon]);
        self.show.amsl_mm = amsl_mm as i32;
        self.show.orientation_deg = Some(orientation_deg);
        for (name, value) in [
            ("SHOW_ORIGIN_LAT", lat as f32),
            ("SHOW_ORIGIN_LNG", lon as f32),
            ("SHOW_ORIGIN_AMSL", amsl_mm),
            ("SHOW_ORIENTATION", orientation_deg),
        ] {
            self.params.put(name, value);
        }
        ACCEPTED
    }

    fn set_mode(&mut self, mode: u32) -> MavResult {
        if self.is_armed() {
            match mode {
                RTL => self.abort(Abort::Return),
                LAND => self.abort(Abort::Land),
                // It is there already.
                _ if mode == self.mode => {}
                _ => return FAILED,
            }
            return ACCEPTED;
        }
        if mode == SHOW_MODE && !self.setup.stock && self.has_files {
            if self.mode != SHOW_MODE {
                self.enter_show_mode();
            }
            return ACCEPTED;
        }
        if !ON_GROUND.contains(&mode) {
            return FAILED;
        }
        self.mode = mode;
        self.show.leave();
        ACCEPTED
    }

    fn arm_or_disarm(
        &mut self,
        now: Micros,
        arm: f32,
        force: f32,
        out: &mut Vec<MavMessage>,
    ) -> MavResult {
        if arm == 1.0 {
            if self.is_armed() {
                return ACCEPTED;
            }
            let obstacle = self.obstacle(now);
            if self.mode == GUIDED && self.airborne.is_none() && obstacle.is_none() {
                return self.arm_guided(now, out);
            }
            out.push(error(obstacle.unwrap_or("Arm: Mode not armable")));
            return FAILED;
        }
        if !self.is_armed() {
            return ACCEPTED;
        }
        let on_ground = self.position_m().z <= self.stands_m.z + 0.05;
        if !on_ground && force != FORCE {
            return FAILED;
        }
        self.kill(now, out);
        ACCEPTED
    }
}
