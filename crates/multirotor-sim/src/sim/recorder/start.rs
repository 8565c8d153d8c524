//! The first rows of a log: version, texts, parameters, origin, mode.

use std::io::{self, Write};

use crate::sim::autopilot::params as p;
use crate::sim::flight::FlightSetup;
use dataflash::Value::{Float as F, Int as I, Text as T};
use dataflash::{LogWriter, Value, catalog};

use super::view::View;

/// What the log calls the firmware. It begins as the firmware's own logs do, because readers take
/// the vehicle type from it, and says that this was a simulation.
const VERSION: &str = "ArduCopter V4.4.4 (updraft)";
/// Mark of simulated logs in the name of the firmware, which stands in the text messages at their beginning.
pub const FIRMWARE_MARK: &str = "(updraft)";
const FRAME: &str = "Frame: QUAD/X";
/// ModeNum of the show mode, and the reason that the fork gives for entering it by itself.
const SHOW_MODE: (i64, i64) = (127, 32);
/// ModeNum of GUIDED, and the reason for entering it: a command of a ground station.
const GUIDED: (i64, i64) = (4, 2);
/// AP_Arming::Method of the show manager, and of a ground station's command.
const ARMED_BY_SHOW: i64 = 4;
const ARMED_BY_STATION: i64 = 1;

/// Writes everything that comes before the first periodic row; returns the number of rows.
pub(super) fn write<W: Write>(
    log: &mut LogWriter<W>,
    setup: &FlightSetup<'_>,
    view: &View,
    board_us: i64,
    is_guided: bool,
) -> io::Result<u64> {
    let time = I(board_us);
    let vehicle = format!("Vehicle: {}", setup.vehicle.name);
    let mut rows = 0;
    let mut row = |message, values: &[Value<'_>]| {
        rows += 1;
        log.row(message, values)
    };
    row(
        &catalog::VER,
        &[time, I(3), I(65535), I(4), I(4), I(4), I(255), I(0), T(VERSION), I(0), I(2)],
    )?;
    row(&catalog::MSG, &[time, T(VERSION)])?;
    row(&catalog::MSG, &[time, T(FRAME)])?;
    row(&catalog::MSG, &[time, T(&vehicle)])?;
    let known = |name: &str| !(is_guided && name.starts_with("SHOW_"));
    for (name, value, default) in parameters(setup).into_iter().filter(|row| known(row.0)) {
        row(&catalog::PARM, &[time, T(name), F(value), F(default)])?;
    }
    let home = &view.home;
    for kind in [0, 1] {
        let place = [F(home.lat_deg), F(home.lon_deg), F(home.amsl_m)];
        row(&catalog::ORGN, &[time, I(kind), place[0], place[1], place[2]])?;
    }
    let (mode, by) =
        if is_guided { (GUIDED, ARMED_BY_STATION) } else { (SHOW_MODE, ARMED_BY_SHOW) };
    row(&catalog::MODE, &[time, I(mode.0), I(mode.0), I(mode.1)])?;
    row(&catalog::ARM, &[time, I(1), I(1), I(0), I(by)])?;
    Ok(rows)
}

/// MAVLink system id of a slot: 1..255.
pub(super) fn system_id(slot: u16) -> u8 {
    (slot.saturating_sub(1) % 255) as u8 + 1
}

/// Parameters (name, value, firmware default) that describe this flight, sorted by name.
#[rustfmt::skip]
fn parameters(setup: &FlightSetup<'_>) -> Vec<(&'static str, f64, f64)> {
    let pilot = &setup.vehicle.autopilot;
    let origin = &setup.frame.origin;
    let expo = pilot.mot_thst_expo;
    let start_s = f64::from(setup.start.tow_ms / 1000);
    vec![
        ("ANGLE_MAX", p::ANGLE_MAX_DEG * 100.0, 3000.0),
        ("ARMING_CHECK", 1.0, 1.0),
        ("ATC_ACCEL_P_MAX", p::ATC_ACCEL_RP_MAX_DEG * 100.0, 110_000.0),
        ("ATC_ACCEL_R_MAX", p::ATC_ACCEL_RP_MAX_DEG * 100.0, 110_000.0),
        ("ATC_ANGLE_BOOST", 1.0, 1.0),
        ("ATC_ANG_PIT_P", p::ATC_ANG_P, 4.5),
        ("ATC_ANG_RLL_P", p::ATC_ANG_P, 4.5),
        ("ATC_ANG_YAW_P", p::ATC_ANG_YAW_P, 4.5),
        ("ATC_INPUT_TC", p::ATC_INPUT_TC, 0.15),
        ("ATC_RAT_PIT_D", p::ATC_RAT_D, 0.0036),
        ("ATC_RAT_PIT_I", p::ATC_RAT_P, 0.135),
        ("ATC_RAT_PIT_P", p::ATC_RAT_P, 0.135),
        ("ATC_RAT_RLL_D", p::ATC_RAT_D, 0.0036),
        ("ATC_RAT_RLL_I", p::ATC_RAT_P, 0.135),
        ("ATC_RAT_RLL_P", p::ATC_RAT_P, 0.135),
        ("ATC_RAT_YAW_I", p::ATC_RAT_YAW_I, 0.018),
        ("ATC_RAT_YAW_P", p::ATC_RAT_YAW_P, 0.18),
        ("BATT_MONITOR", 4.0, 0.0),
        ("FENCE_ENABLE", 0.0, 0.0),
        ("FRAME_CLASS", 1.0, 0.0),
        ("FRAME_TYPE", 1.0, 1.0),
        ("FS_GCS_ENABLE", 0.0, 0.0),
        ("LAND_ALT_LOW", p::LAND_ALT_LOW * 100.0, 1000.0),
        ("LAND_SPEED", p::LAND_SPEED * 100.0, 50.0),
        ("LOG_BACKEND_TYPE", 1.0, 1.0),
        ("LOG_BITMASK", 176_126.0, 176_126.0),
        ("LOG_DISARMED", 0.0, 0.0),
        ("MOT_BAT_VOLT_MAX", pilot.mot_bat_volt_max, 0.0),
        ("MOT_BAT_VOLT_MIN", pilot.mot_bat_volt_min, 0.0),
        ("MOT_HOVER_LEARN", 2.0, 2.0),
        ("MOT_PWM_MAX", p::MOT_PWM_MAX, 2000.0),
        ("MOT_PWM_MIN", p::MOT_PWM_MIN, 1000.0),
        ("MOT_SPIN_ARM", p::MOT_SPIN_ARM, 0.1),
        ("MOT_SPIN_MAX", pilot.mot_spin_max, 0.95),
        ("MOT_SPIN_MIN", pilot.mot_spin_min, 0.15),
        ("MOT_SPOOL_TIME", p::MOT_SPOOL_TIME, 0.5),
        ("MOT_THST_EXPO", expo, 0.65),
        ("MOT_THST_HOVER", pilot.mot_thst_hover, 0.35),
        ("PSC_ACCZ_FLTE", p::PSC_ACCZ_FLTE, 20.0),
        ("PSC_ACCZ_I", pilot.psc_accz_i, 1.0),
        ("PSC_ACCZ_IMAX", p::PSC_ACCZ_IMAX * 1000.0, 800.0),
        ("PSC_ACCZ_P", pilot.psc_accz_p, 0.5),
        ("PSC_JERK_XY", p::PSC_JERK, 5.0),
        ("PSC_JERK_Z", p::PSC_JERK, 5.0),
        ("PSC_POSXY_P", p::PSC_POSXY_P, 1.0),
        ("PSC_POSZ_P", pilot.psc_posz_p, 1.0),
        ("PSC_VELXY_D", p::PSC_VELXY_D, 0.5),
        ("PSC_VELXY_I", p::PSC_VELXY_I, 1.0),
        ("PSC_VELXY_P", p::PSC_VELXY_P, 2.0),
        ("PSC_VELZ_P", pilot.psc_velz_p, 5.0),
        ("SCHED_LOOP_RATE", 400.0, 400.0),
        ("SHOW_CTRL_MODE", 1.0, 1.0),
        ("SHOW_CTRL_RATE", f64::from(p::SHOW_CTRL_RATE), 10.0),
        ("SHOW_GROUP", 0.0, 0.0),
        ("SHOW_ORIENTATION", setup.frame.orientation_deg, -1.0),
        ("SHOW_ORIGIN_AMSL", -32_768_000.0, -10_000_000.0),
        ("SHOW_ORIGIN_LAT", (origin.lat_deg * 1e7).round(), 0.0),
        ("SHOW_ORIGIN_LNG", (origin.lon_deg * 1e7).round(), 0.0),
        ("SHOW_START_AUTH", 1.0, 0.0),
        ("SHOW_START_TIME", start_s, -1.0),
        ("SHOW_SYNC_MODE", 1.0, 1.0),
        ("SHOW_TAKEOFF_ALT", p::SHOW_TAKEOFF_ALT, 2.5),
        ("SHOW_VEL_FF_GAIN", pilot.show_vel_ff_gain, 1.0),
        ("SYSID_THISMAV", f64::from(system_id(setup.drone)), 1.0),
        ("WPNAV_ACCEL", p::WPNAV_ACCEL * 100.0, 250.0),
        ("WPNAV_ACCEL_Z", p::WPNAV_ACCEL_Z * 100.0, 100.0),
        ("WPNAV_SPEED", p::WPNAV_SPEED * 100.0, 1000.0),
        ("WPNAV_SPEED_DN", p::WPNAV_SPEED_DN * 100.0, 150.0),
        ("WPNAV_SPEED_UP", pilot.wpnav_speed_up_mps * 100.0, 250.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn system_ids_stay_in_mavlinks_range() {
        assert_eq!([1, 49, 255, 256, 0].map(system_id), [1, 49, 255, 1, 1]);
    }

    #[test]
    fn the_version_has_the_mark_by_which_logs_of_this_simulator_are_known() {
        assert!(VERSION.ends_with(FIRMWARE_MARK));
    }
}
