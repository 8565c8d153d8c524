//! A flight that is simulated step by step.

use std::io;
use std::sync::atomic::Ordering;

use nalgebra::Vector3;

use super::air::{AirSampler, DensityNearby, Surroundings};
use super::autopilot::Autopilot;
use super::autopilot::director::{Abort, Stage};
use super::autopilot::motors::Spool;
use super::autopilot::params as p;
use super::error::SimError;
use super::flight::{
    Beyond, FlightSetup, FlightSummary, STEP_S, STEP_US, armed_at_us, command, validate,
};
use super::plant::rotor::ROTORS;
use super::plant::{Motion, Plant};
use super::recorder::{Moment, Recorder};
use super::sensors::Sensors;
use super::strain::Strain;
use crate::effects::{Active, Reading};

/// Air motion and density are looked up every so many steps (100 Hz).
const STEPS_PER_AIR: u64 = 4;
/// Stop request, progress and sanity are looked at every so many steps (1 s).
const STEPS_PER_LOOK: u64 = 400;
/// The log goes on for so long after disarming, s.
const TAIL_S: f64 = 2.0;
/// A flight is given up so long after the time its landing should take, s.
const LANDING_PATIENCE_S: f64 = 120.0;

/// One drone's flight, from arming until a moment after disarming, as far as it has been flown.
pub struct OngoingFlight<'a> {
    setup: FlightSetup<'a>,
    plant_steps: u16,
    impact_mps2: f64,
    pilot: Autopilot<'a>,
    plant: Plant,
    sensors: Sensors,
    air: Box<dyn AirSampler + Send + 'a>,
    around: Surroundings,
    density: DensityNearby,
    tally: Tally,
    strain: Strain,
    start_us: i64,
    end_s: f64,
    give_up_s: f64,
    stop_at_s: f64,
    step: u64,
    is_over: bool,
}

impl<'a> OngoingFlight<'a> {
    /// Prepares a drone that arms when the firmware does so by itself, before its take-off time.
    ///
    /// # Errors
    /// See [`SimError`].
    pub fn new(setup: &FlightSetup<'a>) -> Result<Self, SimError> {
        Self::armed(setup, None)
    }

    /// Prepares a drone that arms at this show time (s), if that is later than the firmware's own
    /// time.
    ///
    /// # Errors
    /// See [`SimError`].
    pub fn armed(setup: &FlightSetup<'a>, armed_s: Option<f64>) -> Result<Self, SimError> {
        Self::of_show(setup, armed_s, Beyond::default())
    }

    /// A drone that arms by itself, in a flight that goes beyond what the simulator's users ask for.
    ///
    /// # Errors
    /// See [`SimError`].
    pub(super) fn beyond(setup: &FlightSetup<'a>, beyond: Beyond<'_>) -> Result<Self, SimError> {
        Self::of_show(setup, None, beyond)
    }

    fn of_show(
        setup: &FlightSetup<'a>,
        armed_s: Option<f64>,
        beyond: Beyond<'_>,
    ) -> Result<Self, SimError> {
        validate(setup)?;
        let FlightSetup { trajectory, home_m, vehicle, drone, .. } = setup;
        let pilot =
            Autopilot::new(trajectory, &vehicle.autopilot, *home_m, home_amsl_m(setup), STEP_S);
        let none = SimError::NoTakeoff { drone: *drone, height_m: p::SHOW_TAKEOFF_ALT };
        Self::begin(setup, armed_s, beyond, pilot.ok_or(none)?)
    }

    /// Prepares a drone that arms now, at show time 0, in GUIDED: it follows orders, not the
    /// trajectory.
    ///
    /// # Errors
    /// See [`SimError`].
    pub fn guided(setup: &FlightSetup<'a>) -> Result<Self, SimError> {
        validate(setup)?;
        let FlightSetup { trajectory, home_m, vehicle, .. } = setup;
        let pilot =
            Autopilot::guided(trajectory, &vehicle.autopilot, *home_m, home_amsl_m(setup), STEP_S);
        Self::begin(setup, Some(0.0), Beyond::default(), pilot)
    }

    fn begin(
        setup: &FlightSetup<'a>,
        armed_s: Option<f64>,
        beyond: Beyond<'_>,
        mut pilot: Autopilot<'a>,
    ) -> Result<Self, SimError> {
        let drone = setup.drone;
        if let Some(frame) = &setup.vehicle.airframe.sitl {
            pilot.motors.set_voltage(frame.battery_voltage_v);
        }
        let plant_steps = beyond.plant_steps.max(1);
        let plant_s = STEP_S / f64::from(plant_steps);
        let (effects, airframe) = Active::start_with(
            setup.vehicle,
            beyond.effects,
            setup.seed,
            drone,
            setup.home_m,
            plant_s,
        )
        .map_err(|source| SimError::Effect { drone, source })?;
        let plant = Plant::with_effects(&airframe, effects, setup.home_m, plant_s);
        let sensors = Sensors::new(setup.seed, drone, STEP_S);
        let takeoff_s = pilot.director.takeoff_s;
        let end_s = pilot.director.end_s;
        let give_up_s = end_s
            + setup.trajectory.end_m().z.max(0.0) / p::LAND_SPEED.min(p::WPNAV_SPEED_DN)
            + LANDING_PATIENCE_S;
        let late_us = armed_s
            .map_or(i64::MIN, |armed_s| ((armed_s * 1e6) as i64).div_euclid(STEP_US) * STEP_US);
        Ok(Self {
            setup: *setup,
            plant_steps,
            impact_mps2: 0.0,
            pilot,
            plant,
            sensors,
            air: setup.atmosphere.sampler(drone),
            around: Surroundings { air_velocity_mps: Vector3::zeros(), density_ratio: 1.0 },
            density: DensityNearby::about(home_amsl_m(setup)),
            tally: Tally::default(),
            strain: Strain::default(),
            start_us: armed_at_us(takeoff_s).max(late_us),
            end_s,
            give_up_s,
            stop_at_s: f64::INFINITY,
            step: 0,
            is_over: false,
        })
    }

    /// Flies all steps before this show time, s. Returns whether the flight is over: the drone has
    /// landed, and its log has ended.
    ///
    /// # Errors
    /// See [`SimError`]; the flight cannot go on then.
    pub fn step_until<R: Recorder>(
        &mut self,
        time_s: f64,
        recorder: &mut R,
    ) -> Result<bool, SimError> {
        while !self.is_over && self.now_s() < time_s {
            self.step(recorder)?;
        }
        Ok(self.is_over)
    }

    #[inline]
    fn step<R: Recorder>(&mut self, recorder: &mut R) -> Result<(), SimError> {
        let drone = self.setup.drone;
        let step = self.step;
        let time_us = self.start_us + step as i64 * STEP_US;
        let time_s = time_us as f64 * 1e-6;
        if step.is_multiple_of(STEPS_PER_AIR) {
            let place = &self.plant.motion().position_m;
            self.around = Surroundings {
                air_velocity_mps: self.air.air_velocity(place, time_s),
                density_ratio: self.density.ratio(self.setup.frame.origin.amsl_m + place.z),
            };
            // Checked here, as the drag's dead band would take NaN for no wind.
            if !self.around.air_velocity_mps.iter().all(|speed| speed.is_finite()) {
                return Err(SimError::Diverged { drone, time_s });
            }
        }
        if step.is_multiple_of(STEPS_PER_LOOK) {
            self.look(time_s)?;
        }
        let mut estimate = self.sensors.sense(self.plant.motion());
        estimate.acceleration_mps2.z += self.impact_mps2;
        self.plant.sense(STEP_S, &mut estimate.velocity_mps.z);
        let pulses = self.pilot.update(time_s, &estimate);
        self.plant.log(STEP_S, &mut estimate.velocity_mps.z);
        self.tally.note(&self.pilot, &self.plant, time_s, self.setup.home_m.z);
        let moment = Moment {
            step,
            time_us,
            pilot: &self.pilot,
            estimate: &estimate,
            plant: &self.plant,
            around: &self.around,
        };
        recorder.record(&moment).map_err(|source: io::Error| SimError::Log { drone, source })?;
        let commands = pulses.map(command);
        self.plant.step(&commands, &self.around);
        self.impact_mps2 = self.plant.impact_mps2();
        if self.plant_steps > 1 {
            self.step_plant_further(&commands);
        }
        self.step += 1;
        if !self.pilot.director.armed && self.stop_at_s.is_infinite() {
            self.stop_at_s = time_s + TAIL_S;
        }
        self.is_over = time_s >= self.stop_at_s;
        Ok(())
    }

    /// The plant's further steps within a control step.
    #[inline(never)]
    fn step_plant_further(&mut self, commands: &[f64; ROTORS]) {
        for _ in 1..self.plant_steps {
            self.plant.step(commands, &self.around);
            self.impact_mps2 += self.plant.impact_mps2();
        }
        self.impact_mps2 /= f64::from(self.plant_steps);
    }

    /// What is looked at once per second.
    #[inline(never)]
    fn look(&mut self, time_s: f64) -> Result<(), SimError> {
        if let Some(battery) = self.plant.battery().filter(|battery| battery.compensated) {
            self.pilot.motors.set_voltage(battery.resting_v);
        }
        if self.plant.battery().is_some_and(|battery| battery.charge < 0.0) {
            self.tally.summary.flat_s.get_or_insert(time_s);
        }
        self.strain.note(&self.pilot, &self.plant, &self.around);
        let drone = self.setup.drone;
        if self.setup.hooks.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            return Err(SimError::Stopped { drone, time_s });
        }
        let motion = self.plant.motion();
        if !(motion.position_m + motion.velocity_mps).norm().is_finite() {
            return Err(SimError::Diverged { drone, time_s });
        }
        if let Some(progress) = self.setup.hooks.progress {
            let begin_s = self.pilot.director.takeoff_s - p::ARM_BEFORE_TAKEOFF_S;
            progress(((time_s - begin_s) / (self.end_s - begin_s).max(1.0)).clamp(0.0, 1.0));
        }
        if time_s > self.give_up_s {
            return Err(SimError::NotLanded { drone, time_s, strain: self.strain });
        }
        Ok(())
    }

    /// Leaves the show for good, as another mode of the autopilot takes over. On the ground the
    /// drone disarms.
    pub fn abort(&mut self, how: Abort) {
        // What comes now takes its own time.
        self.give_up_s = self.give_up_s.max(self.now_s() + 10.0 * LANDING_PATIENCE_S);
        self.pilot.director.abort(how, self.plant.motion().position_m);
    }

    /// Orders a guided vehicle to take off to this height above home, m; returns whether it accepts
    /// the order.
    pub fn take_off(&mut self, above_home_m: f64) -> bool {
        self.pilot.director.take_off(above_home_m)
    }

    /// Gives a guided vehicle its next target: position in m and velocity in m/s, show frame.
    pub fn give_target(&mut self, position_m: Vector3<f64>, velocity_mps: Vector3<f64>) {
        self.pilot.director.give_target(position_m, velocity_mps);
    }

    /// Whether a ground station guides the vehicle, rather than the show.
    pub fn is_guided(&self) -> bool {
        self.pilot.director.guided.is_some()
    }

    /// Show time of the next step, s.
    pub fn now_s(&self) -> f64 {
        (self.start_us + self.step as i64 * STEP_US) as f64 * 1e-6
    }

    /// Show time of arming, us.
    pub(super) fn armed_us(&self) -> i64 {
        self.start_us
    }

    /// Whether the flight and its log have ended.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Whether the motors are armed.
    pub fn is_armed(&self) -> bool {
        self.pilot.director.armed
    }

    /// Stage of the show.
    pub fn stage(&self) -> Stage {
        self.pilot.director.stage
    }

    /// Way in which the show was left before its end, if it was.
    pub fn aborted(&self) -> Option<Abort> {
        self.pilot.director.aborted
    }

    /// True motion, show frame.
    pub fn motion(&self) -> &Motion {
        self.plant.motion()
    }

    /// Pulse widths of the rotors, us.
    pub fn pulses_us(&self) -> &[u16] {
        &self.pilot.motors.pulses_us
    }

    /// State of the battery, if the vehicle's effects have one.
    pub fn battery(&self) -> Option<Reading> {
        self.plant.battery()
    }

    /// Distance from the show's target, m; in stage 4 only.
    pub fn miss_m(&self) -> Option<f64> {
        (self.stage() == Stage::Performing)
            .then(|| (self.plant.motion().position_m - self.pilot.director.target.position).norm())
    }

    /// What became of it, now that it is over.
    ///
    /// # Errors
    /// [`SimError::NeverBegun`] when it never reached the show proper.
    pub(super) fn finish(&self) -> Result<FlightSummary, SimError> {
        let summary = self.summary();
        if summary.performing_s.is_none() {
            return Err(SimError::NeverBegun { drone: self.setup.drone, strain: self.strain });
        }
        Ok(summary)
    }

    /// Outcome of the flight so far.
    pub fn summary(&self) -> FlightSummary {
        let mut summary = self.tally.finish();
        summary.steps = self.step;
        summary.takeoff_s = self.pilot.director.takeoff_s;
        summary
    }
}

/// Altitude of the ground at home above mean sea level, m.
fn home_amsl_m(setup: &FlightSetup<'_>) -> f64 {
    setup.frame.origin.amsl_m + setup.home_m.z
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
                Stage::Wait | Stage::Takeoff | Stage::Returning => {}
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

    fn finish(&self) -> FlightSummary {
        let mut summary = self.summary;
        summary.max_error_xy_m = self.max_square_m2.sqrt();
        if self.performing_steps > 0 {
            summary.saturated_share = self.saturated_steps as f64 / self.performing_steps as f64;
        }
        summary
    }
}
