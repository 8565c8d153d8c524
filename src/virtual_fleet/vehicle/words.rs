//! State of a vehicle in the words of its messages.

use nalgebra::Vector3;

use super::VirtualVehicle;
use super::airborne::Airborne;
use super::telemetry::{Telling, rgb565};
use crate::base::time::GpsTime;
use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, dialect};
use crate::protocol::show::{Stage, Status, flag};
use crate::show::lights;

impl VirtualVehicle<'_> {
    pub(super) fn telling(&self, now: Micros) -> Telling {
        let frame = &self.world.frame;
        let position_m = self.position_m();
        let (velocity_mps, battery) = match &self.airborne {
            Some(airborne) => (airborne.velocity_mps(), airborne.battery()),
            None => (Vector3::zeros(), None),
        };
        let percent = self.battery_percent();
        Telling {
            boot_ms: (self.age(now) / 1000) as u32,
            gps: self.gps(now),
            mode: self.mode,
            armed: self.is_armed(),
            booting: !self.has_files,
            ready: self.has_files && self.obstacle(now).is_none(),
            place: frame.to_geodetic(position_m),
            height_m: position_m.z - self.stands_m.z,
            velocity_mps: frame.to_neu(velocity_mps),
            heading_deg: frame.orientation_deg,
            lean_rad: self.airborne.as_ref().map_or([0.0; 2], Airborne::lean_rad),
            pulses_us: self.airborne.as_ref().map_or([0; 8], Airborne::pulses_us),
            volts: battery.map_or(10.5 + 0.02 * percent, |battery| battery.volts),
            amps: battery.map_or(0.5, |battery| battery.amps),
            percent,
            fence_on: self.params.whole("FENCE_ENABLE") != 0,
            status: (!self.setup.stock).then(|| self.status(now)),
        }
    }

    /// The show's status packet.
    fn status(&self, now: Micros) -> Status {
        let gps_us = self.world.gps_us(now);
        let gps = self.gps(now);
        let mut flags = 0;
        for (bit, is_set) in [
            (flag::LOADED, self.show.loaded.is_some()),
            (flag::START_SET, self.show.start_us.is_some()),
            (flag::ORIGIN_SET, self.show.origin.is_some()),
            (flag::ORIENTATION_SET, self.show.orientation_deg.is_some()),
            (flag::FENCE_ON, self.params.whole("FENCE_ENABLE") != 0),
            (flag::AUTHORIZED, self.show.authorized),
            (flag::NO_GPS_TIME, gps.is_none()),
            (flag::FENCE_BREACHED, self.breached),
        ] {
            if is_set {
                flags |= bit;
            }
        }
        let stage = self.stage();
        let colour = match (stage, self.show.loaded, self.show.show_time_s(gps_us)) {
            (Stage::Takeoff | Stage::Performing, Some(show), Some(time_s)) => {
                lights::color_at(&show.lights, (time_s.max(0.0) * 1000.0) as u64)
            }
            (Stage::Landing | Stage::Off, ..) if self.is_armed() => [255, 128, 0],
            (Stage::WaitForStart, ..) if self.show.preflight == 0 => [0, 127, 0],
            (Stage::Error, ..) => [255, 0, 0],
            _ => [0; 3],
        };
        let miss_m = self.airborne.as_ref().and_then(Airborne::miss_m);
        let start = GpsTime::from_total_ms(self.show.start_us.unwrap_or(-1).div_euclid(1000));
        Status {
            start_tow_s: start.map_or(-1, |start| (start.tow_ms / 1000) as i32),
            colour: rgb565(colour),
            flags,
            preflight: if stage == Stage::WaitForStart { self.show.preflight } else { 0 },
            stage: if self.has_files { stage } else { Stage::Off },
            gps_fix: if gps.is_some() { 6 } else { 1 },
            satellites: if gps.is_some() { 10 } else { 0 },
            boot_count: self.boots & 3,
            is_far: miss_m.is_some_and(|miss| miss > f64::from(self.params.get("SHOW_MAX_XY_ERR"))),
            elapsed_s: self.show.elapsed_s(gps_us).filter(|_| gps.is_some()),
        }
    }
}

pub(super) fn text(severity: dialect::MavSeverity, text: &str) -> MavMessage {
    MavMessage::STATUSTEXT(dialect::STATUSTEXT_DATA {
        severity,
        text: text.into(),
        ..Default::default()
    })
}

pub(super) fn warning(message: &str) -> MavMessage {
    text(dialect::MavSeverity::MAV_SEVERITY_WARNING, message)
}

pub(super) fn error(message: &str) -> MavMessage {
    text(dialect::MavSeverity::MAV_SEVERITY_CRITICAL, message)
}
