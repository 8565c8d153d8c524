//! Flight of a virtual vehicle: arming, stages, landing, and the log of it.

use nalgebra::Vector3;

use super::VirtualVehicle;
use super::words::{error, text};
use crate::base::time::GpsTime;
use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, dialect};
use crate::protocol::show::Stage;
use crate::sim::autopilot::director::{self, Abort};
use crate::sim::autopilot::params::ARM_BEFORE_TAKEOFF_S;
use crate::sim::{BatteryReading, FlightSetup, Hooks, OngoingFlight, RecordedFlight};
use crate::virtual_fleet::world::LoadedShow;

/// An arming that comes by so little too late is on time: the grid of ticks is coarser.
const ON_TIME_S: f64 = 1.0;

/// A flight under way.
pub(super) struct Airborne<'w> {
    flight: RecordedFlight<'w>,
    /// GPS time of its show time 0, us.
    start_us: i64,
    disarmed: bool,
    fence_has_acted: bool,
}

impl<'w> Airborne<'w> {
    pub(super) fn is_armed(&self) -> bool {
        self.flight.flight.is_armed()
    }

    pub(super) fn position_m(&self) -> Vector3<f64> {
        self.flight.flight.motion().position_m
    }

    pub(super) fn velocity_mps(&self) -> Vector3<f64> {
        self.flight.flight.motion().velocity_mps
    }

    /// Roll, right side down, and pitch, nose up, rad.
    pub(super) fn lean_rad(&self) -> [f64; 2] {
        let rotation = &self.flight.flight.motion().rotation;
        let roll = rotation[(2, 1)].atan2(rotation[(2, 2)]);
        [roll, rotation[(2, 0)].clamp(-1.0, 1.0).asin()]
    }

    /// Pulse widths of the first eight motors, us.
    pub(super) fn pulses_us(&self) -> [u16; 8] {
        let pulses = self.flight.flight.pulses_us();
        std::array::from_fn(|motor| pulses.get(motor).copied().unwrap_or(0))
    }

    pub(super) fn battery(&self) -> Option<BatteryReading> {
        self.flight.battery()
    }

    pub(super) fn miss_m(&self) -> Option<f64> {
        self.flight.flight.miss_m()
    }

    /// A flight that arms now, at its show time 0, and waits for orders.
    pub(super) fn guided(flight: RecordedFlight<'w>, start_us: i64) -> Self {
        Self { flight, start_us, disarmed: false, fence_has_acted: false }
    }

    /// The flight, for orders.
    pub(super) fn flight(&mut self) -> &mut OngoingFlight<'w> {
        &mut self.flight.flight
    }

    /// Whether a station's targets are flown now.
    pub(super) fn is_guided(&self) -> bool {
        self.flight.flight.is_guided() && self.flight.flight.aborted().is_none()
    }

    /// Stage of the show; off when another mode flies.
    pub(super) fn stage(&self) -> Stage {
        if self.flight.flight.aborted().is_some() || self.flight.flight.is_guided() {
            return Stage::Off;
        }
        match self.flight.flight.stage() {
            director::Stage::Wait => Stage::WaitForStart,
            director::Stage::Takeoff => Stage::Takeoff,
            director::Stage::Performing => Stage::Performing,
            director::Stage::Returning => Stage::ReturnToLaunch,
            director::Stage::Landing => Stage::Landing,
            director::Stage::Landed => Stage::Landed,
        }
    }
}

impl<'w> VirtualVehicle<'w> {
    /// Arms, and opens the log.
    pub(super) fn arm(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        let (Some(show), Some(start_us)) = (self.show.loaded, self.show.start_us) else { return };
        let Some(start) = GpsTime::from_total_ms(start_us.div_euclid(1000)) else { return };
        let time_s = (self.world.gps_us(now) - start_us) as f64 * 1e-6;
        let late_s = time_s - (show.takeoff_s - ARM_BEFORE_TAKEOFF_S);
        let setup = self.flight_setup(show, start);
        let armed_s = (late_s >= ON_TIME_S).then_some(time_s);
        match RecordedFlight::armed(&setup, armed_s, self.booted_in_log()) {
            Ok(flight) => {
                // A log that is still being written ends here.
                self.logbook.open(self.storage.as_mut());
                self.airborne =
                    Some(Airborne { flight, start_us, disarmed: false, fence_has_acted: false });
                out.push(text(dialect::MavSeverity::MAV_SEVERITY_INFO, "Arming motors"));
            }
            Err(reason) => out.push(error(&format!("Arm: {reason}"))),
        }
    }

    /// A flight from where it stands.
    pub(super) fn flight_setup(&self, show: &'w LoadedShow, start: GpsTime) -> FlightSetup<'w> {
        FlightSetup {
            vehicle: self.world.vehicle,
            trajectory: &show.trajectory,
            home_m: self.stands_m,
            frame: self.world.frame,
            atmosphere: self.world.atmosphere,
            seed: self.world.seed,
            drone: self.setup.drone,
            start,
            lights: &show.lights,
            full_logs: self.world.full_logs,
            hooks: Hooks::default(),
        }
    }

    /// Flies on until time `now`.
    pub(super) fn fly(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        let Some(mut airborne) = self.airborne.take() else { return };
        let time_s = (self.world.gps_us(now) - airborne.start_us) as f64 * 1e-6;
        let outcome = airborne.flight.step_until(time_s);
        let log = airborne.flight.take_log();
        if !airborne.is_armed() && !airborne.disarmed {
            airborne.disarmed = true;
            self.logbook.disarm(now);
            out.push(text(dialect::MavSeverity::MAV_SEVERITY_INFO, "Disarming motors"));
            self.show.stage = match airborne.stage() {
                Stage::Off => Stage::Off,
                _ => Stage::Landed,
            };
        }
        self.logbook.write(&log, self.storage.as_mut());
        let is_over = match outcome {
            Ok(is_over) => is_over,
            Err(reason) => {
                out.push(error(&format!("Crash: {reason}")));
                self.logbook.disarm(now);
                self.show.stage = Stage::Error;
                true
            }
        };
        let lies_m = airborne.position_m();
        let summary = airborne.flight.summary();
        self.airborne = Some(airborne);
        if is_over {
            self.airborne = None;
            self.flown.push(summary);
            if lies_m.iter().all(|value| value.is_finite()) {
                self.stands_m = Vector3::new(lies_m.x, lies_m.y, self.stands_m.z);
            }
            self.breached = false;
        } else {
            self.watch_fence(out);
        }
    }

    fn watch_fence(&mut self, out: &mut Vec<MavMessage>) {
        let outside = self.is_armed() && self.is_outside();
        if outside && !self.breached {
            out.push(error("Fence Breached"));
        }
        self.breached = outside;
        let action = self.params.whole("FENCE_ACTION");
        let Some(airborne) = self.airborne.as_mut().filter(|it| outside && !it.fence_has_acted)
        else {
            return;
        };
        airborne.fence_has_acted = true;
        match action {
            0 => {}
            2 => self.abort(Abort::Land),
            _ => self.abort(Abort::Return),
        }
    }

    /// Leaves the show in flight for another mode.
    pub(super) fn abort(&mut self, how: Abort) {
        if let Some(airborne) = self.airborne.as_mut().filter(|it| it.is_armed()) {
            airborne.flight.flight.abort(how);
            self.mode = how.mode().into();
            self.show.leave();
        }
    }

    /// Stops the motors wherever it is. What its log has not written is lost.
    pub(super) fn kill(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        if let Some(airborne) = self.airborne.take() {
            let lies_m = airborne.position_m();
            self.stands_m = Vector3::new(lies_m.x, lies_m.y, self.stands_m.z);
            self.logbook.disarm(now);
            self.show.stage = Stage::Error;
            out.push(text(dialect::MavSeverity::MAV_SEVERITY_INFO, "Disarming motors"));
        }
    }
}
