//! The rotor disc as the effects on its inflow need it.

use super::reference::DENSITY;
use super::role::Role;
use super::{Now, Reference, momentum};
use crate::vehicle::{Airframe, Vehicle};

/// Below this induced velocity a rotor only idles, m/s.
const IDLE_MPS: f64 = 0.5;

/// Share of the geometric thrust that a small low-pitch rotor loses to its own inflow.
pub(super) const USUAL_SHARE: f64 = 0.5;
pub(super) const LEAST_SHARE: f64 = 0.0;
pub(super) const MOST_SHARE: f64 = 0.9;

/// The inflow share that a vehicle's file states, also for a rotor inflow that is off.
pub(super) fn share_of(vehicle: &Vehicle) -> f64 {
    Role::InflowShare.stated(vehicle).unwrap_or(USUAL_SHARE)
}

/// The rotor as the effects on its inflow need it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// Twice density at sea level times area, kg/m.
    pub(super) flow_factor: f64,
    /// Share of the torque in hover that makes the induced flow.
    pub(super) merit: f64,
}

impl Disc {
    pub(super) fn of(airframe: &Airframe) -> Self {
        Self {
            flow_factor: 2.0 * DENSITY * airframe.disc_area_m2(),
            merit: airframe.figure_of_merit().min(1.0),
        }
    }

    /// Axial and edgewise speed over the induced velocity in still air at the present rotor speed;
    /// `None` while the rotors do not carry.
    pub(super) fn speeds(&self, now: &Now) -> Option<(f64, f64)> {
        let square = now.thrust_n / (self.flow_factor * now.density_ratio);
        if square < IDLE_MPS * IDLE_MPS {
            return None;
        }
        let induced_mps = square.sqrt();
        let relative = now.relative_mps / induced_mps;
        Some((relative.z, relative.xy().norm()))
    }
}

/// The pulse that keeps the hover thrust when the flow through the disc is `flow` times the induced
/// velocity in hover, us.
pub(super) fn flow_us(at: &Reference, share: f64, flow: f64) -> f64 {
    let speed = momentum::speed_for_flow(share, flow);
    let merit = at.airframe.figure_of_merit().min(1.0);
    at.pulse_us(speed, momentum::torque_for_flow(merit, flow, speed))
}
