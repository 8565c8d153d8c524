//! Messages that a vehicle sends unasked, and their rates.

use nalgebra::Vector3;

use crate::base::frame::Geodetic;
use crate::base::time::GpsTime;
use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, dialect};
use crate::protocol::show::{self, Status};

/// Messages that can be sent regularly: id, us between two unless asked for otherwise (0: never).
const STREAMS: [(u32, Micros); 8] = [
    (HEARTBEAT, 1_000_000),
    (SYS_STATUS, 1_000_000),
    (SYSTEM_TIME, 0),
    (GPS_RAW_INT, 1_000_000),
    (ATTITUDE, 0),
    (GLOBAL_POSITION_INT, 500_000),
    (SERVO_OUTPUT_RAW, 0),
    (DATA16, 500_000),
];
pub(super) const HEARTBEAT: u32 = 0;
pub(super) const SYS_STATUS: u32 = 1;
pub(super) const SYSTEM_TIME: u32 = 2;
pub(super) const GPS_RAW_INT: u32 = 24;
pub(super) const ATTITUDE: u32 = 30;
pub(super) const GLOBAL_POSITION_INT: u32 = 33;
pub(super) const SERVO_OUTPUT_RAW: u32 = 36;
pub(super) const DATA16: u32 = 169;
pub(super) const AUTOPILOT_VERSION: u32 = 148;
/// Capability bit of parameters as floats, which newer descriptions of MAVLink rename.
const PARAM_FLOAT: u64 = 0x02;
/// Revision that virtual vehicles state, in the place of their sources' own.
pub const REVISION: [u8; 8] = *b"updraft\0";
/// Shortest interval that is granted, us.
const SHORTEST: Micros = 20_000;

/// The streams of one vehicle.
#[derive(Clone, Debug)]
pub(super) struct Streams {
    all: [Stream; STREAMS.len()],
}

#[derive(Clone, Copy, Debug)]
struct Stream {
    id: u32,
    every: Micros,
    next: Micros,
}

impl Streams {
    /// All begin at this time, each a little later than the one before.
    pub(super) fn new(now: Micros, stock: bool) -> Self {
        let mut place = 0;
        let all = STREAMS.map(|(id, every)| {
            place += 20_000;
            let every = if stock && id == DATA16 { 0 } else { every };
            Stream { id, every, next: now + place }
        });
        Self { all }
    }

    /// Sets an interval in us as MAV_CMD_SET_MESSAGE_INTERVAL has it: 0 the usual one, -1 never.
    /// Whether the message is one of the streams.
    pub(super) fn set(&mut self, now: Micros, id: u32, interval_us: f32) -> bool {
        let Some(stream) = self.all.iter_mut().find(|stream| stream.id == id) else {
            return false;
        };
        let usual = STREAMS.iter().find(|(known, _)| *known == id).map_or(0, |(_, every)| *every);
        stream.every = match interval_us {
            us if us < 0.0 => 0,
            us if us < 1.0 => usual,
            us => (us as Micros).max(SHORTEST),
        };
        stream.next = now;
        true
    }

    /// Messages that are due. After a gap each comes once.
    pub(super) fn due(&mut self, now: Micros) -> Vec<u32> {
        let mut due = Vec::new();
        for stream in self.all.iter_mut().filter(|stream| stream.every > 0) {
            if now >= stream.next {
                due.push(stream.id);
                stream.next += stream.every;
                if stream.next <= now {
                    stream.next = now + stream.every;
                }
            }
        }
        due
    }

    /// When the next one is due.
    pub(super) fn next(&self) -> Micros {
        self.all
            .iter()
            .filter(|stream| stream.every > 0)
            .map(|stream| stream.next)
            .min()
            .unwrap_or(Micros::MAX)
    }
}

/// What there is to say.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a bit of a message")]
pub(super) struct Telling {
    pub(super) boot_ms: u32,
    pub(super) gps: Option<GpsTime>,
    pub(super) mode: u32,
    pub(super) armed: bool,
    pub(super) booting: bool,
    pub(super) ready: bool,
    pub(super) place: Geodetic,
    pub(super) height_m: f64,
    /// Velocity to the north, to the east and up, m/s.
    pub(super) velocity_mps: Vector3<f64>,
    pub(super) heading_deg: f64,
    /// Roll, right side down, and pitch, nose up, rad.
    pub(super) lean_rad: [f64; 2],
    /// Pulse widths of the motors, us; 0: no output.
    pub(super) pulses_us: [u16; 8],
    pub(super) volts: f64,
    pub(super) amps: f64,
    pub(super) percent: f64,
    pub(super) fence_on: bool,
    pub(super) status: Option<Status>,
}

impl Telling {
    /// State as the message with this id; `None` if it has no such message.
    pub(super) fn message(&self, id: u32) -> Option<MavMessage> {
        Some(match id {
            HEARTBEAT => self.heartbeat(),
            SYS_STATUS => self.sys_status(),
            SYSTEM_TIME => MavMessage::SYSTEM_TIME(dialect::SYSTEM_TIME_DATA {
                time_unix_usec: self.gps.map_or(0, |gps| gps.to_unix_ms().max(0) as u64 * 1000),
                time_boot_ms: self.boot_ms,
            }),
            GPS_RAW_INT => self.gps_raw(),
            GLOBAL_POSITION_INT => self.position(),
            ATTITUDE => MavMessage::ATTITUDE(dialect::ATTITUDE_DATA {
                time_boot_ms: self.boot_ms,
                roll: self.lean_rad[0] as f32,
                pitch: self.lean_rad[1] as f32,
                yaw: self.heading_deg.to_radians() as f32,
                ..Default::default()
            }),
            SERVO_OUTPUT_RAW => self.outputs(),
            DATA16 => {
                let status = self.status?;
                MavMessage::DATA16(dialect::DATA16_DATA {
                    mavtype: show::FROM_DRONE,
                    len: Status::LENGTH,
                    data: status.to_data(),
                })
            }
            AUTOPILOT_VERSION => self.version(),
            _ => return None,
        })
    }

    fn heartbeat(&self) -> MavMessage {
        let mut base = dialect::MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            | dialect::MavModeFlag::MAV_MODE_FLAG_STABILIZE_ENABLED;
        if self.armed {
            base |= dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
        }
        let system_status = match (self.booting, self.armed) {
            (true, _) => dialect::MavState::MAV_STATE_BOOT,
            (false, true) => dialect::MavState::MAV_STATE_ACTIVE,
            (false, false) => dialect::MavState::MAV_STATE_STANDBY,
        };
        MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA {
            custom_mode: self.mode,
            mavtype: dialect::MavType::MAV_TYPE_QUADROTOR,
            autopilot: dialect::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode: base,
            system_status,
            mavlink_version: 3,
        })
    }

    fn sys_status(&self) -> MavMessage {
        use dialect::MavSysStatusSensor as Sensor;
        let mut present = Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO
            | Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL
            | Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG
            | Sensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
            | Sensor::MAV_SYS_STATUS_SENSOR_GPS
            | Sensor::MAV_SYS_STATUS_AHRS
            | Sensor::MAV_SYS_STATUS_LOGGING
            | Sensor::MAV_SYS_STATUS_SENSOR_BATTERY
            | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
        let mut health = present;
        if self.fence_on {
            present |= Sensor::MAV_SYS_STATUS_GEOFENCE;
            health |= Sensor::MAV_SYS_STATUS_GEOFENCE;
        }
        if !self.ready && !self.armed {
            health.remove(Sensor::MAV_SYS_STATUS_PREARM_CHECK);
        }
        if self.gps.is_none() {
            health.remove(Sensor::MAV_SYS_STATUS_SENSOR_GPS | Sensor::MAV_SYS_STATUS_AHRS);
        }
        MavMessage::SYS_STATUS(dialect::SYS_STATUS_DATA {
            onboard_control_sensors_present: present,
            onboard_control_sensors_enabled: present,
            onboard_control_sensors_health: health,
            load: 200,
            voltage_battery: (self.volts * 1000.0) as u16,
            current_battery: (self.amps * 100.0) as i16,
            battery_remaining: self.percent.clamp(0.0, 100.0) as i8,
            ..Default::default()
        })
    }

    fn gps_raw(&self) -> MavMessage {
        let fix = self.gps.is_some();
        let fix_type = if fix {
            dialect::GpsFixType::GPS_FIX_TYPE_RTK_FIXED
        } else {
            dialect::GpsFixType::GPS_FIX_TYPE_NO_FIX
        };
        let place =
            if fix { self.place } else { Geodetic { lat_deg: 0.0, lon_deg: 0.0, amsl_m: 0.0 } };
        MavMessage::GPS_RAW_INT(dialect::GPS_RAW_INT_DATA {
            time_usec: u64::from(self.boot_ms) * 1000,
            lat: degrees(place.lat_deg),
            lon: degrees(place.lon_deg),
            alt: (place.amsl_m * 1000.0) as i32,
            eph: 121,
            epv: 200,
            vel: (self.velocity_mps.xy().norm() * 100.0) as u16,
            fix_type,
            satellites_visible: if fix { 10 } else { 0 },
            h_acc: 300,
            v_acc: 300,
            vel_acc: 40,
            ..Default::default()
        })
    }

    fn position(&self) -> MavMessage {
        let cms = |mps: f64| (mps * 100.0).clamp(-32767.0, 32767.0) as i16;
        let known = self.gps.is_some();
        let place =
            if known { self.place } else { Geodetic { lat_deg: 0.0, lon_deg: 0.0, amsl_m: 0.0 } };
        MavMessage::GLOBAL_POSITION_INT(dialect::GLOBAL_POSITION_INT_DATA {
            time_boot_ms: self.boot_ms,
            lat: degrees(place.lat_deg),
            lon: degrees(place.lon_deg),
            alt: (place.amsl_m * 1000.0) as i32,
            relative_alt: (self.height_m * 1000.0) as i32,
            vx: cms(self.velocity_mps.x),
            vy: cms(self.velocity_mps.y),
            vz: cms(-self.velocity_mps.z),
            hdg: (self.heading_deg.rem_euclid(360.0) * 100.0) as u16,
        })
    }

    fn outputs(&self) -> MavMessage {
        let [one, two, three, four, five, six, seven, eight] = self.pulses_us;
        MavMessage::SERVO_OUTPUT_RAW(dialect::SERVO_OUTPUT_RAW_DATA {
            // The board's time in us, which begins anew after 71 min.
            time_usec: self.boot_ms.wrapping_mul(1000),
            servo1_raw: one,
            servo2_raw: two,
            servo3_raw: three,
            servo4_raw: four,
            servo5_raw: five,
            servo6_raw: six,
            servo7_raw: seven,
            servo8_raw: eight,
            ..Default::default()
        })
    }

    fn version(&self) -> MavMessage {
        use dialect::MavProtocolCapability as Can;
        // What ArduCopter 4.4 has: ground stations choose their ways by it.
        let mut capabilities = Can::MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
            | Can::from_bits_retain(PARAM_FLOAT)
            | Can::MAV_PROTOCOL_CAPABILITY_MISSION_INT
            | Can::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
            | Can::MAV_PROTOCOL_CAPABILITY_FTP
            | Can::MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
            | Can::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
            | Can::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
            | Can::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
            | Can::MAV_PROTOCOL_CAPABILITY_COMPASS_CALIBRATION
            | Can::MAV_PROTOCOL_CAPABILITY_MAVLINK2
            | Can::MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
            | Can::MAV_PROTOCOL_CAPABILITY_MISSION_RALLY;
        if self.status.is_some() {
            capabilities |= Can::from_bits_retain(show::CAPABILITY);
        }
        MavMessage::AUTOPILOT_VERSION(dialect::AUTOPILOT_VERSION_DATA {
            capabilities,
            // 4.4.4, official.
            flight_sw_version: 0x0404_04FF,
            flight_custom_version: REVISION,
            ..Default::default()
        })
    }
}

fn degrees(value: f64) -> i32 {
    (value * 1e7).round() as i32
}

/// A colour of 16 bits.
pub(super) fn rgb565([red, green, blue]: [u8; 3]) -> u16 {
    u16::from(red >> 3) << 11 | u16::from(green >> 2) << 5 | u16::from(blue >> 3)
}
