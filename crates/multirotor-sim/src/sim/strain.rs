//! Strain of a flight on the vehicle, for the message when it was too much.

use std::fmt;

use super::air::Surroundings;
use super::autopilot::Autopilot;
use super::autopilot::motors::Spool;
use super::autopilot::params::ANGLE_MAX_DEG;
use super::plant::Plant;

/// Strongest air of a flight, and the vehicle's reaction to it; sampled once a second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strain {
    /// Strongest horizontal wind, m/s.
    pub wind_mps: f64,
    /// Strongest vertical air speed, in either direction, m/s, up positive.
    pub updraft_mps: f64,
    /// Largest lean of the vehicle, degrees.
    pub lean_deg: f64,
    looks: u32,
    at_end: u32,
}

impl Strain {
    /// Takes one look at a flight.
    pub(super) fn note(&mut self, pilot: &Autopilot<'_>, plant: &Plant, around: &Surroundings) {
        if pilot.motors.spool != Spool::Flying {
            return;
        }
        let air = &around.air_velocity_mps;
        self.wind_mps = self.wind_mps.max(air.xy().norm());
        if air.z.abs() > self.updraft_mps.abs() {
            self.updraft_mps = air.z;
        }
        let lean_deg = plant.motion().rotation[(2, 2)].clamp(-1.0, 1.0).acos().to_degrees();
        self.lean_deg = self.lean_deg.max(lean_deg);
        self.looks += 1;
        self.at_end += u32::from(pilot.saturated());
    }

    /// Share of the flight with a rotor at an end of its range, 0 to 1.
    pub fn at_end_share(&self) -> f64 {
        f64::from(self.at_end) / f64::from(self.looks.max(1))
    }
}

impl fmt::Display for Strain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "wind up to {:.1} m/s, updraft {:.1} m/s; it leaned {:.0} degrees (the autopilot allows \
             {ANGLE_MAX_DEG:.0}), rotors at their end for {:.0} % of the flight",
            self.wind_mps,
            self.updraft_mps,
            self.lean_deg,
            100.0 * self.at_end_share()
        )
    }
}
