//! One drone's flight from arming to disarming.

use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector3;

use super::air::{Atmosphere, DensityNearby, Surroundings};
use super::autopilot::Autopilot;
use super::autopilot::director::{Stage, takeoff_time_s};
use super::autopilot::motors::Spool;
use super::autopilot::params as p;
use super::error::SimError;
use super::plant::Plant;
use super::recorder::{LogRecorder, Moment, NoLog, Recorder};
use super::sensors::Sensors;
use super::strain::Strain;
use crate::base::file::write_with;
use crate::base::frame::ShowFrame;
use crate::base::time::GpsTime;
use crate::effects::Active;
use crate::show::Trajectory;
use crate::vehicle::Vehicle;

/// Length of a control and physics step, us.
pub(super) const STEP_US: i64 = 2_500;
/// The same, s.
pub(super) const STEP_S: f64 = STEP_US as f64 * 1e-6;
/// Air motion and density are looked up every so many steps (100 Hz).
const STEPS_PER_AIR: u64 = 4;
/// Stop request, progress and sanity are looked at every so many steps (1 s).
const STEPS_PER_LOOK: u64 = 400;
/// SHOW_TAKEOFF_ERR, m.
const TAKEOFF_ERR_M: f64 = 3.0;
/// The log goes on for so long after disarming, s.
const TAIL_S: f64 = 2.0;
/// A flight is given up so long after the time its landing should take, s.
const LANDING_PATIENCE_S: f64 = 120.0;

/// Everything that one drone's simulated flight depends on.
#[derive(Clone, Copy)]
pub struct FlightSetup<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// What it flies, show frame.
    pub trajectory: &'a Trajectory,
    /// Where it stands, show frame, m; its z is the ground there.
    pub home_m: Vector3<f64>,
    /// Where the show is; the origin's altitude is the ground above mean sea level.
    pub frame: ShowFrame,
    /// Motion of the air.
    pub atmosphere: &'a dyn Atmosphere,
    /// Seed of the fleet; drones differ by their slot.
    pub seed: u64,
    /// The drone's slot, from 1; SYSID_THISMAV in the log (modulo 255).
    pub drone: u16,
    /// GPS time of show time 0.
    pub start: GpsTime,
    /// Its light program, as in a `.skyb` file, for the colours in the log; may be empty.
    pub lights: &'a [u8],
    /// Whether the log has the firmware's whole default set.
    pub full_logs: bool,
    /// Progress and stop.
    pub hooks: Hooks<'a>,
}

/// How a flight is watched and stopped. The default does neither.
#[derive(Clone, Copy, Default)]
pub struct Hooks<'a> {
    /// Called about once per simulated second with the share of the flight that is done, 0..1.
    pub progress: Option<&'a (dyn Fn(f64) + Sync)>,
    /// Set to true to end the flight early with [`SimError::Stopped`].
    pub stop: Option<&'a AtomicBool>,
}

/// What became of a flight. Times are show times, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightSummary {
    /// Take-off (stage 3).
    pub takeoff_s: f64,
    /// Start of the show proper (stage 4); absent when it was never reached.
    pub performing_s: Option<f64>,
    /// Start of the landing (stage 7).
    pub landing_s: f64,
    /// Landed and disarmed (stage 8).
    pub landed_s: f64,
    /// Largest horizontal distance from the show's target in stage 4, m.
    pub max_error_xy_m: f64,
    /// Largest vertical distance from the show's target in stage 4, m.
    pub max_error_z_m: f64,
    /// Highest point above home, m.
    pub max_height_m: f64,
    /// Share of the steps of stage 4 in which a rotor was at an end of its range.
    pub saturated_share: f64,
    /// When the battery had given all its charge, to the second; absent when it lasted, or there is
    /// none.
    pub flat_s: Option<f64>,
    /// Steps simulated, of 2.5 ms each.
    pub steps: u64,
    /// Rows written to the log, definitions excluded.
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
    let log_error = |source| SimError::Log { drone: setup.drone, source };
    validate(setup)?;
    let takeoff_s = takeoff_time_s(setup.trajectory, setup.vehicle.autopilot.wpnav_speed_up_mps)
        .ok_or(SimError::NoTakeoff { drone: setup.drone, height_m: p::SHOW_TAKEOFF_ALT })?;
    let mut recorder = LogRecorder::new(out, setup, armed_at_us(takeoff_s)).map_err(log_error)?;
    let mut summary = fly_with(setup, &mut recorder)?;
    summary.log_rows = recorder.finish().map_err(log_error)?;
    Ok(summary)
}

/// Flies one drone and writes its log to a file, which appears only when it is whole.
///
/// # Errors
/// See [`SimError`]; `path` is then as it was before.
pub fn fly_to_file(setup: &FlightSetup<'_>, path: &Path) -> Result<FlightSummary, SimError> {
    // Stands only when the file could not even be opened, and then the file's error is given.
    let mut outcome = Ok(FlightSummary::default());
    let written = write_with(path, |out| {
        outcome = fly(setup, out);
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

/// Flies one drone and shows every step to a recorder.
///
/// # Errors
/// See [`SimError`].
pub fn fly_with<R: Recorder>(
    setup: &FlightSetup<'_>,
    recorder: &mut R,
) -> Result<FlightSummary, SimError> {
    validate(setup)?;
    let drone = setup.drone;
    let home_amsl_m = setup.frame.origin.amsl_m + setup.home_m.z;
    let settings = &setup.vehicle.autopilot;
    let mut pilot = Autopilot::new(setup.trajectory, settings, setup.home_m, home_amsl_m, STEP_S)
        .ok_or(SimError::NoTakeoff { drone, height_m: p::SHOW_TAKEOFF_ALT })?;
    if let Some(frame) = &setup.vehicle.airframe.sitl {
        pilot.motors.set_voltage(frame.battery_voltage_v);
    }
    let (effects, airframe) = Active::start(setup.vehicle, setup.seed, drone, setup.home_m, STEP_S)
        .map_err(|source| SimError::Effect { drone, source })?;
    let mut plant = Plant::with_effects(&airframe, effects, setup.home_m, STEP_S);
    let mut sensors = Sensors::new(setup.seed, drone, STEP_S);

    let takeoff_s = pilot.director.takeoff_s;
    let start_us = armed_at_us(takeoff_s);
    let end_s = pilot.director.end_s;
    let give_up_s = end_s
        + setup.trajectory.end_m().z.max(0.0) / p::LAND_SPEED.min(p::WPNAV_SPEED_DN)
        + LANDING_PATIENCE_S;
    let mut tally = Tally::default();
    let mut around = Surroundings { air_velocity_mps: Vector3::zeros(), density_ratio: 1.0 };
    let mut air = setup.atmosphere.sampler(drone);
    let mut density = DensityNearby::about(home_amsl_m);
    let mut stop_at_s = f64::INFINITY;
    let mut strain = Strain::default();
    let mut step: u64 = 0;
    loop {
        let time_us = start_us + step as i64 * STEP_US;
        let time_s = time_us as f64 * 1e-6;
        if step.is_multiple_of(STEPS_PER_AIR) {
            let place = &plant.motion().position_m;
            around = Surroundings {
                air_velocity_mps: air.air_velocity(place, time_s),
                density_ratio: density.ratio(setup.frame.origin.amsl_m + place.z),
            };
            // Checked here, as the drag's dead band would take NaN for no wind.
            if !around.air_velocity_mps.iter().all(|speed| speed.is_finite()) {
                return Err(SimError::Diverged { drone, time_s });
            }
        }
        if step.is_multiple_of(STEPS_PER_LOOK) {
            if let Some(battery) = plant.battery().filter(|battery| battery.compensated) {
                pilot.motors.set_voltage(battery.resting_v);
            }
            if plant.battery().is_some_and(|battery| battery.charge < 0.0) {
                tally.summary.flat_s.get_or_insert(time_s);
            }
            strain.note(&pilot, &plant, &around);
            look(setup, &plant, time_s, takeoff_s, end_s)?;
            if time_s > give_up_s {
                return Err(SimError::NotLanded { drone, time_s, strain });
            }
        }
        let mut estimate = sensors.sense(plant.motion());
        estimate.acceleration_mps2.z += plant.impact_mps2();
        plant.sense(&mut estimate.velocity_mps.z);
        let pulses = pilot.update(time_s, &estimate);
        tally.note(&pilot, &plant, time_s, setup.home_m.z);
        let moment = Moment {
            step,
            time_us,
            pilot: &pilot,
            estimate: &estimate,
            plant: &plant,
            around: &around,
        };
        recorder.record(&moment).map_err(|source: io::Error| SimError::Log { drone, source })?;
        plant.step(&pulses.map(command), &around);
        step += 1;
        if !pilot.director.armed && stop_at_s.is_infinite() {
            stop_at_s = time_s + TAIL_S;
        }
        if time_s >= stop_at_s {
            break;
        }
    }
    if tally.summary.performing_s.is_none() {
        return Err(SimError::NeverBegun { drone, strain });
    }
    tally.summary.steps = step;
    tally.summary.takeoff_s = takeoff_s;
    Ok(tally.finish())
}

/// AirSim's motor interface: the command is linear in the pulse, 1000..2000 us, whatever the
/// autopilot's own settings are.
#[inline]
pub(super) fn command(pulse_us: u16) -> f64 {
    (f64::from(pulse_us) - 1000.0) * 1e-3
}

/// Arming time on the grid of the steps.
fn armed_at_us(takeoff_s: f64) -> i64 {
    (((takeoff_s - p::ARM_BEFORE_TAKEOFF_S) * 1e6) as i64).div_euclid(STEP_US) * STEP_US
}

fn validate(setup: &FlightSetup<'_>) -> Result<(), SimError> {
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

fn look(
    setup: &FlightSetup<'_>,
    plant: &Plant,
    time_s: f64,
    takeoff_s: f64,
    end_s: f64,
) -> Result<(), SimError> {
    let drone = setup.drone;
    if setup.hooks.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
        return Err(SimError::Stopped { drone, time_s });
    }
    let motion = plant.motion();
    if !(motion.position_m + motion.velocity_mps).norm().is_finite() {
        return Err(SimError::Diverged { drone, time_s });
    }
    if let Some(progress) = setup.hooks.progress {
        let begin_s = takeoff_s - p::ARM_BEFORE_TAKEOFF_S;
        progress(((time_s - begin_s) / (end_s - begin_s).max(1.0)).clamp(0.0, 1.0));
    }
    Ok(())
}

/// Gathers the summary.
#[derive(Default)]
struct Tally {
    summary: FlightSummary,
    stage: Option<Stage>,
    max_square_m2: f64,
    performing_steps: u64,
    saturated_steps: u64,
}

impl Tally {
    fn note(&mut self, pilot: &Autopilot<'_>, plant: &Plant, time_s: f64, ground_m: f64) {
        let stage = pilot.director.stage;
        let summary = &mut self.summary;
        if self.stage != Some(stage) {
            self.stage = Some(stage);
            match stage {
                Stage::Performing => summary.performing_s = Some(time_s),
                Stage::Landing => summary.landing_s = time_s,
                Stage::Landed => summary.landed_s = time_s,
                Stage::Wait | Stage::Takeoff => {}
            }
        }
        let position = &plant.motion().position_m;
        summary.max_height_m = summary.max_height_m.max(position.z - ground_m);
        if stage == Stage::Performing && pilot.motors.spool == Spool::Flying {
            let error = position - pilot.director.target.position;
            self.max_square_m2 = self.max_square_m2.max(error.xy().norm_squared());
            summary.max_error_z_m = summary.max_error_z_m.max(error.z.abs());
            self.performing_steps += 1;
            self.saturated_steps += u64::from(pilot.saturated());
        }
    }

    fn finish(mut self) -> FlightSummary {
        self.summary.max_error_xy_m = self.max_square_m2.sqrt();
        if self.performing_steps > 0 {
            self.summary.saturated_share =
                self.saturated_steps as f64 / self.performing_steps as f64;
        }
        self.summary
    }
}
