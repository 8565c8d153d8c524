//! GUIDED: flown by a ground station's orders, as stock ArduCopter does.
//!
//! Arming, take-off, then targets with a place and a velocity; others are not followed. When the
//! station that SYSID_MYGCS names falls silent in flight, FS_GCS_ENABLE says what happens.

use nalgebra::Vector3;

use super::VirtualVehicle;
use super::airborne::Airborne;
use super::words::{error, text};
use crate::base::frame::Geodetic;
use crate::base::time::GpsTime;
use crate::link::clock::{Micros, S};
use crate::link::frame::{MavMessage, Sender, dialect};
use crate::sim::RecordedFlight;
use crate::sim::autopilot::director::Abort;
use crate::virtual_fleet::world::LoadedShow;
use dialect::MavFrame::{self, MAV_FRAME_GLOBAL_RELATIVE_ALT, MAV_FRAME_LOCAL_NED};
use dialect::MavResult::{
    self, MAV_RESULT_ACCEPTED as ACCEPTED, MAV_RESULT_DENIED as DENIED, MAV_RESULT_FAILED as FAILED,
};

/// Number of the mode.
pub(super) const GUIDED: u32 = 4;
/// FS_GCS_TIMEOUT: a station that is silent for so long is lost.
const STATION_LOST: Micros = 5 * S;
/// Bits of a target's mask: its place is to be ignored, or its velocity.
const NO_PLACE: u16 = 0b111;
const NO_VELOCITY: u16 = 0b11_1000;

impl VirtualVehicle<'_> {
    /// Arms on a station's command.
    pub(super) fn arm_guided(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> MavResult {
        let start_us = self.world.gps_us(now).div_euclid(1000) * 1000;
        let Some(start) = GpsTime::from_total_ms(start_us / 1000) else { return FAILED };
        let mut nothing = LoadedShow::default();
        nothing.trajectory.start_m = self.stands_m;
        let setup = self.flight_setup(self.world.keep(nothing), start);
        match RecordedFlight::guided(&setup, self.booted_in_log()) {
            Ok(flight) => {
                self.logbook.open(self.storage.as_mut());
                self.airborne = Some(Airborne::guided(flight, start_us));
                out.push(text(dialect::MavSeverity::MAV_SEVERITY_INFO, "Arming motors"));
                ACCEPTED
            }
            Err(reason) => {
                out.push(error(&format!("Arm: {reason}")));
                FAILED
            }
        }
    }

    /// Takes off to a height above home, m.
    pub(super) fn take_off(
        &mut self,
        now: Micros,
        above_home_m: f32,
        out: &mut Vec<MavMessage>,
    ) -> MavResult {
        if !(above_home_m > 0.0 && above_home_m < 1000.0) {
            return DENIED;
        }
        self.fly(now, out);
        let airborne = self.airborne.as_mut().filter(|it| it.is_guided() && it.is_armed());
        let obeys = airborne.is_some_and(|it| it.flight().take_off(above_home_m.into()));
        if obeys { ACCEPTED } else { FAILED }
    }

    /// Takes what a station streams: targets, and its heartbeats.
    pub(super) fn on_stream(
        &mut self,
        now: Micros,
        sender: Sender,
        message: &MavMessage,
        out: &mut Vec<MavMessage>,
    ) {
        match message {
            MavMessage::HEARTBEAT(_)
                if i64::from(sender.system) == self.params.whole("SYSID_MYGCS") =>
            {
                self.station_heard = Some(now);
            }
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(target)
                if is_above_home(target.coordinate_frame) =>
            {
                let place = Geodetic {
                    lat_deg: f64::from(target.lat_int) * 1e-7,
                    lon_deg: f64::from(target.lon_int) * 1e-7,
                    amsl_m: self.world.frame.origin.amsl_m
                        + self.stands_m.z
                        + f64::from(target.alt),
                };
                let place_m = self.world.frame.from_geodetic(place);
                let ned = [target.vx, target.vy, target.vz];
                self.on_target(now, target.type_mask.bits(), place_m, ned, out);
            }
            MavMessage::SET_POSITION_TARGET_LOCAL_NED(target)
                if target.coordinate_frame == MAV_FRAME_LOCAL_NED =>
            {
                // From the EKF's origin, which is home.
                let place_m = self.stands_m + self.show_of([target.x, target.y, target.z]);
                let ned = [target.vx, target.vy, target.vz];
                self.on_target(now, target.type_mask.bits(), place_m, ned, out);
            }
            _ => {}
        }
    }

    fn show_of(&self, [north, east, down]: [f32; 3]) -> Vector3<f64> {
        self.world.frame.from_neu(Vector3::new(north.into(), east.into(), -f64::from(down)))
    }

    fn on_target(
        &mut self,
        now: Micros,
        ignored: u16,
        place_m: Vector3<f64>,
        ned_mps: [f32; 3],
        out: &mut Vec<MavMessage>,
    ) {
        let still = ignored & NO_VELOCITY != 0;
        let velocity = if still { Vector3::zeros() } else { self.show_of(ned_mps) };
        let is_whole = (place_m + velocity).iter().all(|value| value.is_finite());
        if ignored & NO_PLACE != 0 || !is_whole {
            return;
        }
        // It counts from when it came, not from the last tick.
        self.fly(now, out);
        if let Some(airborne) = self.airborne.as_mut().filter(|it| it.is_guided()) {
            airborne.flight().give_target(place_m, velocity);
        }
    }

    /// What is done about a station that is not heard any more.
    pub(super) fn watch_station(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        // Who was never heard is not missed.
        let is_lost = self.station_heard.is_some_and(|at| now >= at + STATION_LOST);
        let is_guided = self.airborne.as_ref().is_some_and(|it| it.is_guided() && it.is_armed());
        let how = match self.params.whole("FS_GCS_ENABLE") {
            0 => return,
            5 => Abort::Land,
            _ => Abort::Return,
        };
        if is_lost && is_guided {
            out.push(error("GCS Failsafe"));
            self.abort(how);
        }
    }
}

#[expect(deprecated, reason = "stations send it, and ArduPilot takes both")]
fn is_above_home(frame: MavFrame) -> bool {
    matches!(frame, MAV_FRAME_GLOBAL_RELATIVE_ALT | MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
}
