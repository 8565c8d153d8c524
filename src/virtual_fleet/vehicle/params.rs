//! Parameters: the ones that a show crew touches or checks, with the firmware's names.
//!
//! On the wire every value is a float32. The vehicle keeps whole degrees of latitude and longitude
//! elsewhere: a parameter cannot hold them.

use std::collections::{BTreeMap, VecDeque};

use crate::link::frame::{MavMessage, dialect};
use crate::vehicle::Vehicle;

/// Answers to a request for all that are sent in one go.
const AT_ONCE: usize = 20;

/// Kind of number that a parameter is said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NumberKind {
    Int8,
    Int16,
    Int32,
    Real,
}

use NumberKind::{Int8, Int16, Int32, Real};

/// Name, kind, value after the swarm launcher's settings.
#[rustfmt::skip]
const COMMON: &[(&str, NumberKind, f32)] = &[
    ("ANGLE_MAX", Int16, 3000.0), ("ARMING_CHECK", Int32, 1.0), ("AUTO_OPTIONS", Int32, 0.0),
    ("ATC_ANGLE_BOOST", Int8, 1.0), ("ATC_INPUT_TC", Real, 0.15),
    ("BATT_CAPACITY", Int32, 3300.0), ("BATT_CRT_MAH", Real, 0.0), ("BATT_CRT_VOLT", Real, 0.0),
    ("BATT_FS_CRT_ACT", Int8, 0.0), ("BATT_FS_LOW_ACT", Int8, 0.0), ("BATT_LOW_MAH", Real, 0.0),
    ("BATT_LOW_VOLT", Real, 10.5), ("BATT_MONITOR", Int8, 4.0),
    ("EK3_ENABLE", Int8, 1.0), ("EK3_SRC1_POSZ", Int8, 3.0),
    ("FENCE_ACTION", Int8, 1.0), ("FENCE_ALT_MAX", Real, 100.0), ("FENCE_ALT_MIN", Real, -10.0),
    ("FENCE_ENABLE", Int8, 0.0), ("FENCE_MARGIN", Real, 2.0), ("FENCE_RADIUS", Real, 150.0),
    ("FENCE_TOTAL", Int8, 0.0), ("FENCE_TYPE", Int8, 7.0),
    ("FLTMODE1", Int8, 7.0), ("FLTMODE3", Int8, 127.0), ("FRAME_CLASS", Int8, 1.0),
    ("FRAME_TYPE", Int8, 1.0), ("FS_CRASH_CHECK", Int8, 1.0), ("FS_EKF_ACTION", Int8, 1.0),
    ("FS_EKF_THRESH", Real, 0.8), ("FS_GCS_ENABLE", Int8, 0.0), ("FS_OPTIONS", Int32, 4.0),
    ("FS_THR_ENABLE", Int8, 0.0), ("FS_VIBE_ENABLE", Int8, 1.0), ("GUID_TIMEOUT", Real, 3.0),
    ("INS_LOG_BAT_MASK", Int8, 0.0), ("LAND_ALT_LOW", Int16, 1000.0), ("LAND_SPEED", Int16, 50.0),
    ("LAND_SPEED_HIGH", Int16, 0.0), ("LOG_BACKEND_TYPE", Int8, 1.0), ("LOG_BITMASK", Int32, 176_126.0),
    ("LOG_DISARMED", Int8, 0.0), ("LOG_FILE_BUFSIZE", Int16, 200.0), ("LOG_FILE_DSRMROT", Int8, 0.0),
    ("LOG_FILE_MB_FREE", Int16, 500.0), ("LOG_FILE_RATEMAX", Real, 0.0), ("LOG_FILE_TIMEOUT", Int16, 5.0),
    ("LOG_MAX_FILES", Int16, 500.0), ("LOG_REPLAY", Int8, 0.0),
    ("MOT_HOVER_LEARN", Int8, 2.0), ("MOT_PWM_MAX", Int16, 2000.0), ("MOT_PWM_MIN", Int16, 1000.0),
    ("MOT_SPIN_ARM", Real, 0.1), ("MOT_SPOOL_TIME", Real, 0.5),
    ("PSC_JERK_XY", Real, 30.0), ("PSC_JERK_Z", Real, 30.0),
    ("RC7_OPTION", Int16, 248.0), ("RTL_ALT", Int32, 1500.0), ("RTL_ALT_FINAL", Int16, 0.0),
    ("RTL_CLIMB_MIN", Int16, 0.0), ("RTL_LOIT_TIME", Int32, 5000.0), ("RTL_SPEED", Int16, 0.0),
    ("SCHED_LOOP_RATE", Int16, 400.0), ("SERIAL0_PROTOCOL", Int8, 2.0), ("SR0_EXTRA1", Int16, 0.0),
    ("SR0_POSITION", Int16, 0.0), ("STAT_BOOTCNT", Int16, 1.0), ("SYSID_MYGCS", Int16, 255.0),
    ("SYSID_THISMAV", Int16, 1.0), ("WPNAV_ACCEL", Real, 800.0), ("WPNAV_ACCEL_Z", Real, 500.0),
    ("WPNAV_SPEED", Real, 1000.0), ("WPNAV_SPEED_DN", Real, 450.0), ("WP_YAW_BEHAVIOR", Int8, 0.0),
];

/// Only firmware with a show mode has these.
#[rustfmt::skip]
const SHOW: &[(&str, NumberKind, f32)] = &[
    ("SHOW_CTRL_MODE", Int8, 1.0), ("SHOW_CTRL_RATE", Int8, 10.0), ("SHOW_GROUP", Int8, 0.0),
    ("SHOW_HFENCE_DIST", Real, 25.0), ("SHOW_HFENCE_EN", Int8, 0.0), ("SHOW_HFENCE_TO", Real, 5.0),
    ("SHOW_LED0_CHAN", Int8, 0.0), ("SHOW_LED0_COUNT", Int8, 16.0), ("SHOW_LED0_GAMMA", Real, 1.0),
    ("SHOW_LED0_TYPE", Int8, 6.0), ("SHOW_LED0_WTEMP", Int16, 0.0), ("SHOW_MAX_XY_ERR", Real, 3.0),
    ("SHOW_MAX_Z_ERR", Real, 3.0), ("SHOW_MODE_BOOT", Int16, 1.0), ("SHOW_ORIENTATION", Real, -1.0),
    ("SHOW_ORIGIN_AMSL", Int32, -10_000_000.0), ("SHOW_ORIGIN_LAT", Int32, 0.0),
    ("SHOW_ORIGIN_LNG", Int32, 0.0), ("SHOW_PRE_LIGHTS", Int8, 2.0), ("SHOW_START_AUTH", Int8, 0.0),
    ("SHOW_START_TIME", Int32, -1.0), ("SHOW_SYNC_MODE", Int8, 1.0), ("SHOW_TAKEOFF_ALT", Real, 2.5),
    ("SHOW_TAKEOFF_ERR", Real, 3.0), ("SHOW_VEL_FF_GAIN", Real, 1.0),
];

/// Parameters of one vehicle.
#[derive(Clone, Debug)]
pub struct Params {
    /// In the order of their names, as indices count.
    values: BTreeMap<&'static str, (NumberKind, f32)>,
    /// Indices that are still to be sent.
    asked: VecDeque<u16>,
}

impl Params {
    pub(super) fn new(vehicle: &Vehicle, system: u8, stock: bool) -> Self {
        let rest = if stock { &[][..] } else { SHOW };
        let mut values: BTreeMap<_, _> =
            COMMON.iter().chain(rest).map(|&(name, kind, value)| (name, (kind, value))).collect();
        let pilot = &vehicle.autopilot;
        for (name, value) in [
            ("MOT_BAT_VOLT_MAX", pilot.mot_bat_volt_max),
            ("MOT_BAT_VOLT_MIN", pilot.mot_bat_volt_min),
            ("MOT_SPIN_MAX", pilot.mot_spin_max),
            ("MOT_SPIN_MIN", pilot.mot_spin_min),
            ("MOT_THST_EXPO", pilot.mot_thst_expo),
            ("MOT_THST_HOVER", pilot.mot_thst_hover),
            ("PSC_ACCZ_I", pilot.psc_accz_i),
            ("PSC_ACCZ_P", pilot.psc_accz_p),
            ("PSC_POSZ_P", pilot.psc_posz_p),
            ("PSC_VELZ_P", pilot.psc_velz_p),
            ("WPNAV_SPEED_UP", pilot.wpnav_speed_up_mps * 100.0),
        ] {
            values.insert(name, (Real, value as f32));
        }
        let mut params = Self { values, asked: VecDeque::new() };
        params.put("SYSID_THISMAV", system.into());
        params
    }

    /// Value of a parameter; 0 if the vehicle does not have it.
    pub fn get(&self, name: &str) -> f32 {
        self.values.get(name).map_or(0.0, |(_, value)| *value)
    }

    /// A value as a whole number.
    pub(super) fn whole(&self, name: &str) -> i64 {
        self.get(name) as i64
    }

    /// Sets a parameter, if the vehicle has it.
    pub fn put(&mut self, name: &str, value: f32) {
        if let Some((_, old)) = self.values.get_mut(name) {
            *old = value;
        }
    }

    /// Takes requests and settings; returns the name of what was set.
    pub(super) fn on_message(
        &mut self,
        message: &MavMessage,
        out: &mut Vec<MavMessage>,
    ) -> Option<&'static str> {
        match message {
            MavMessage::PARAM_REQUEST_LIST(_) => {
                self.asked = (0..self.values.len() as u16).collect();
            }
            MavMessage::PARAM_REQUEST_READ(wanted) => {
                let name = text(&wanted.param_id[..]);
                // A negative index asks by name.
                let index = u16::try_from(wanted.param_index).ok().or_else(|| {
                    self.values.keys().position(|key| *key == name).map(|index| index as u16)
                });
                out.extend(index.and_then(|index| self.answer(index)));
            }
            MavMessage::PARAM_SET(wanted) => {
                let name = text(&wanted.param_id[..]);
                let found = self.values.iter_mut().enumerate().find(|(_, (key, _))| **key == name);
                let (index, (name, (kind, value))) = found?;
                if wanted.param_value.is_finite() {
                    *value = match kind {
                        Real => wanted.param_value,
                        _ => wanted.param_value.round(),
                    };
                }
                let name = *name;
                out.extend(self.answer(index as u16));
                return Some(name);
            }
            _ => {}
        }
        None
    }

    /// Goes on sending all; whether more are to come.
    pub(super) fn poll(&mut self, out: &mut Vec<MavMessage>) -> bool {
        for _ in 0..AT_ONCE.min(self.asked.len()) {
            if let Some(index) = self.asked.pop_front() {
                out.extend(self.answer(index));
            }
        }
        !self.asked.is_empty()
    }

    fn answer(&self, index: u16) -> Option<MavMessage> {
        let (name, (kind, value)) = self.values.iter().nth(index.into())?;
        Some(MavMessage::PARAM_VALUE(dialect::PARAM_VALUE_DATA {
            param_value: *value,
            param_count: self.values.len() as u16,
            param_index: index,
            param_id: (*name).into(),
            param_type: match kind {
                Int8 => dialect::MavParamType::MAV_PARAM_TYPE_INT8,
                Int16 => dialect::MavParamType::MAV_PARAM_TYPE_INT16,
                Int32 => dialect::MavParamType::MAV_PARAM_TYPE_INT32,
                Real => dialect::MavParamType::MAV_PARAM_TYPE_REAL32,
            },
        }))
    }
}

fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}
