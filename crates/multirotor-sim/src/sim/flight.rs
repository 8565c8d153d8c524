//! One drone's flight from arming to disarming.

use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector3;

use super::air::Atmosphere;
use super::autopilot::director::takeoff_time_s;
use super::autopilot::params as p;
use super::error::SimError;
use super::flying::OngoingFlight;
use super::recorder::{LogRecorder, NoLog, Recorder};
use crate::effects::Extra;
use crate::vehicle::Vehicle;
use dataflash::time::GpsTime;
use skybrush_show::Trajectory;
use skybrush_show::frame::ShowFrame;
use untrusted_io::file::write_with;

/// Length of a control and physics step, us.
pub(super) const STEP_US: i64 = 2_500;
/// Length of a control and physics step, s.
pub(super) const STEP_S: f64 = STEP_US as f64 * 1e-6;
/// SHOW_TAKEOFF_ERR, m.
const TAKEOFF_ERR_M: f64 = 3.0;

/// Everything that one drone's simulated flight depends on.
#[derive(Clone, Copy)]
pub struct FlightSetup<'a> {
    /// Vehicle to fly.
    pub vehicle: &'a Vehicle,
    /// Trajectory to fly, show frame.
    pub trajectory: &'a Trajectory,
    /// Place where the vehicle stands, show frame, m; its z is the ground there.
    pub home_m: Vector3<f64>,
    /// Position and orientation of the show frame; the origin's altitude is the ground above mean
    /// sea level.
    pub frame: ShowFrame,
    /// Motion of the air.
    pub atmosphere: &'a dyn Atmosphere,
    /// Seed of the fleet; drones differ by their slot.
    pub seed: u64,
    /// The drone's slot, from 1; SYSID_THISMAV in the log (modulo 255).
    pub drone: u16,
    /// GPS time of show time 0.
    pub start: GpsTime,
    /// Light program, as in a `.skyb` file, for the colours in the log; may be empty.
    pub lights: &'a [u8],
    /// Whether the log has the firmware's whole default set.
    pub full_logs: bool,
    /// Progress display and stop.
    pub hooks: Hooks<'a>,
}

/// Hooks for watching and stopping a flight. The default does neither.
#[derive(Clone, Copy, Default)]
pub struct Hooks<'a> {
    /// Called about once per simulated second with the share of the flight that is done, 0 to 1.
    pub progress: Option<&'a (dyn Fn(f64) + Sync)>,
    /// Flag that ends the flight early with [`SimError::Stopped`] when it is set to true.
    pub stop: Option<&'a AtomicBool>,
}

/// Extension of a flight beyond its setup, for physics that the rest of the program is not to know.
/// The default adds nothing and changes no byte.
#[derive(Clone, Copy, Default)]
pub struct Beyond<'a> {
    /// Effects that need not be in [`crate::effects::LIBRARY`]; they act after the vehicle's own.
    pub effects: &'a [Extra],
    /// Number of plant steps (with effects) in one control step of 2.5 ms; 0 is taken as 1.
    pub plant_steps: u16,
}

/// Outcome of a flight. Times are show times, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightSummary {
    /// Take-off (stage 3), show time, s.
    pub takeoff_s: f64,
    /// Start of the show proper (stage 4); absent when it was never reached.
    pub performing_s: Option<f64>,
    /// Start of the landing (stage 7), show time, s.
    pub landing_s: f64,
    /// Landed and disarmed (stage 8), show time, s.
    pub landed_s: f64,
    /// Largest horizontal distance from the show's target in stage 4, m.
    pub max_error_xy_m: f64,
    /// Largest vertical distance from the show's target in stage 4, m.
    pub max_error_z_m: f64,
    /// Highest point above home, m.
    pub max_height_m: f64,
    /// Share of the steps of stage 4 in which a rotor was at an end of its range.
    pub saturated_share: f64,
    /// Time at which the battery had given all its charge, to the second; absent when it lasted, or
    /// there is none.
    pub flat_s: Option<f64>,
    /// Number of simulated steps, of 2.5 ms each.
    pub steps: u64,
    /// Number of rows written to the log, without definitions.
    pub log_rows: u64,
}

/// Flies one drone and writes its DataFlash log to `out`.
///
/// The bytes depend on the setup alone. On an error the log is incomplete: do not publish it
/// ([`fly_to_file`] does not).
///
/// # Errors
/// See [`SimError`].
pub fn fly<W: Write>(setup: &FlightSetup<'_>, out: W) -> Result<FlightSummary, SimError> {
    fly_beyond(setup, Beyond::default(), out)
}

/// Flies one drone and writes its DataFlash log as [`fly`] does, with an extension of the flight.
///
/// # Errors
/// See [`SimError`].
pub fn fly_beyond<W: Write>(
    setup: &FlightSetup<'_>,
    beyond: Beyond<'_>,
    out: W,
) -> Result<FlightSummary, SimError> {
    let log_error = |source| SimError::Log { drone: setup.drone, source };
    validate(setup)?;
    let takeoff_s = takeoff_time_s(setup.trajectory, setup.vehicle.autopilot.wpnav_speed_up_mps)
        .ok_or(SimError::NoTakeoff { drone: setup.drone, height_m: p::SHOW_TAKEOFF_ALT })?;
    let mut recorder =
        LogRecorder::new(out, setup, armed_at_us(takeoff_s), false, None).map_err(log_error)?;
    let mut flight = OngoingFlight::beyond(setup, beyond)?;
    flight.step_until(f64::INFINITY, &mut recorder)?;
    let mut summary = flight.finish()?;
    summary.log_rows = recorder.finish().map_err(log_error)?;
    Ok(summary)
}

/// Flies one drone and writes its log to a file, which appears only when it is whole.
///
/// # Errors
/// See [`SimError`]; `path` is then as it was before.
pub fn fly_to_file(setup: &FlightSetup<'_>, path: &Path) -> Result<FlightSummary, SimError> {
    fly_beyond_to_file(setup, Beyond::default(), path)
}

/// Flies one drone and writes its log to a file as [`fly_to_file`] does, with an extension of the
/// flight.
///
/// # Errors
/// As [`fly_to_file`].
pub fn fly_beyond_to_file(
    setup: &FlightSetup<'_>,
    beyond: Beyond<'_>,
    path: &Path,
) -> Result<FlightSummary, SimError> {
    // Stands only when the file could not even be opened, and then the file's error is given.
    let mut outcome = Ok(FlightSummary::default());
    let written = write_with(path, |out| {
        outcome = fly_beyond(setup, beyond, out);
        match &mut outcome {
            Ok(_) => Ok(()),
            // The file's error says more than ours: which path.
            Err(SimError::Log { source, .. }) => {
                Err(std::mem::replace(source, io::ErrorKind::Other.into()))
            }
            Err(_) => Err(io::Error::other("the flight ended early")),
        }
    });
    match (outcome, written) {
        (Ok(_) | Err(SimError::Log { .. }), Err(source)) => {
            Err(SimError::File { drone: setup.drone, source })
        }
        (outcome, _) => outcome,
    }
}

/// Flies one drone without a log.
///
/// # Errors
/// See [`SimError`].
pub fn fly_without_log(setup: &FlightSetup<'_>) -> Result<FlightSummary, SimError> {
    fly_with(setup, &mut NoLog)
}

/// Flies one drone and passes every control step to a recorder.
///
/// # Errors
/// See [`SimError`].
pub fn fly_with<R: Recorder>(
    setup: &FlightSetup<'_>,
    recorder: &mut R,
) -> Result<FlightSummary, SimError> {
    let mut flight = OngoingFlight::new(setup)?;
    flight.step_until(f64::INFINITY, recorder)?;
    flight.finish()
}

/// AirSim's motor interface: the command is linear in the pulse, 1000..2000 us, whatever the
/// autopilot's own settings are.
#[inline]
pub(super) fn command(pulse_us: u16) -> f64 {
    (f64::from(pulse_us) - 1000.0) * 1e-3
}

/// Arming time on the grid of the steps.
pub(super) fn armed_at_us(takeoff_s: f64) -> i64 {
    (((takeoff_s - p::ARM_BEFORE_TAKEOFF_S) * 1e6) as i64).div_euclid(STEP_US) * STEP_US
}

pub(super) fn validate(setup: &FlightSetup<'_>) -> Result<(), SimError> {
    let drone = setup.drone;
    let finite = |vector: &Vector3<f64>| vector.iter().all(|value| value.is_finite());
    if !finite(&setup.home_m) {
        return Err(SimError::NotFinite { drone, what: "the home position" });
    }
    if !setup.trajectory.pieces().all(|piece| finite(&piece.end_m())) {
        return Err(SimError::NotFinite { drone, what: "a point of the trajectory" });
    }
    let origin = &setup.frame.origin;
    let place = [origin.lat_deg, origin.lon_deg, origin.amsl_m, setup.frame.orientation_deg];
    if !place.iter().all(|value| value.is_finite()) {
        return Err(SimError::NotFinite { drone, what: "the show's place" });
    }
    let distance_m = (setup.trajectory.start_m.xy() - setup.home_m.xy()).norm();
    if distance_m > TAKEOFF_ERR_M {
        return Err(SimError::NotAtStart { drone, distance_m, limit_m: TAKEOFF_ERR_M });
    }
    Ok(())
}
