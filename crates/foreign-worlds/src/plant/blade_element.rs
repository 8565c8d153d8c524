//! Four equal rotors by blade element theory with Glauert's inflow, on direct-current motors; a round body.
//!
//! Blades have constant chord and constant pitch (a screw), lift linear in the angle of attack, and are
//! averaged over a turn (Leishman 2006, sections 3.2 and 5.4): with the speed through the disc
//! `w = V_c + v_i` and the angle `theta(r) = atan(p/(2 pi r))`,
//!
//! * `T = 1/2 rho N c a (Omega² I2 + V_x² I0/2 - w Omega R²/2)`, `I_n` the integral of `theta r^n`;
//! * `P = T (V_c + kappa v_i) + 1/8 rho N c c_d Omega³ R⁴ (1 + 4.65 mu²)`;
//! * `H = 1/4 rho N c c_d Omega R² V_x + 1/4 rho N c a w V_x I0`, against the motion across the disc.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::inflow::induced_mps;
use super::motor::Motor;
use super::{Flow, Loads, SEA_LEVEL_KGPM3};

/// Number of rotors.
const ROTORS: f64 = 4.0;
/// Growth of the profile power with the square of the advance ratio (Stepniewski; Leishman 2006, 5.4.2).
const PROFILE_GROWTH: f64 = 4.65;
/// Steps of the search for thrust and inflow.
const STEPS: usize = 40;

/// Geometry and section data of one rotor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotor {
    /// Radius, m.
    pub radius_m: f64,
    /// Number of blades.
    pub blades: f64,
    /// Chord, m.
    pub chord_m: f64,
    /// Geometric pitch: advance in one turn, m.
    pub pitch_m: f64,
    /// Slope of the lift coefficient, 1/rad.
    pub lift_slope: f64,
    /// Drag coefficient of the section.
    pub section_drag: f64,
    /// Induced power over the ideal one (kappa).
    pub induced_factor: f64,
}

/// Thrust, induced velocity and torque of one rotor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorState {
    /// Thrust, N.
    pub thrust_n: f64,
    /// Induced velocity, m/s.
    pub induced_mps: f64,
    /// Torque against the turning, N m.
    pub torque_nm: f64,
    /// Force against the motion across the disc, N.
    pub drag_n: f64,
}

impl Rotor {
    /// Integrals of `theta` and `theta r²` over the blade, m and m³.
    fn integrals(&self) -> (f64, f64) {
        // theta(r) = atan(b/r), b = pitch/(2 pi); both integrals are elementary.
        let (r, b) = (self.radius_m, self.pitch_m / std::f64::consts::TAU);
        let angle = (b / r).atan();
        let log = ((r * r + b * b) / (b * b)).ln();
        let zeroth = r * angle + b / 2.0 * log;
        let second = (r.powi(3) * angle + b * r * r / 2.0 - b.powi(3) / 2.0 * log) / 3.0;
        (zeroth, second)
    }

    /// State of the rotor at a speed (rad/s) in a flow along and across its axis (m/s).
    pub fn state(
        &self,
        speed_radps: f64,
        climb_mps: f64,
        edgewise_mps: f64,
        density: f64,
    ) -> RotorState {
        let (zeroth, second) = self.integrals();
        let lift = 0.5 * density * self.blades * self.chord_m * self.lift_slope;
        let area_m2 = std::f64::consts::PI * self.radius_m * self.radius_m;
        let radius2 = self.radius_m * self.radius_m;
        let free_n = lift * (speed_radps.powi(2) * second + edgewise_mps.powi(2) * zeroth / 2.0);
        let per_flow = lift * speed_radps * radius2 / 2.0;
        // The blades' thrust falls with the inflow and the momentum's rises: one crossing.
        let blades_n = |induced: f64| (free_n - per_flow * (climb_mps + induced)).max(0.0);
        let mut induced =
            induced_mps(blades_n(0.0) / (density * area_m2), climb_mps, edgewise_mps) / 2.0;
        for _ in 0..STEPS {
            let wanted = |at: f64| {
                at - induced_mps(blades_n(at) / (density * area_m2), climb_mps, edgewise_mps)
            };
            let error = wanted(induced);
            let slope = ((wanted(induced + 1e-5) - error) / 1e-5).max(1.0);
            let step = error / slope;
            induced -= step;
            if step.abs() < 1e-11 {
                break;
            }
        }
        let thrust_n = blades_n(induced);
        let through = climb_mps + induced;
        let tip_mps = (speed_radps * self.radius_m).max(1.0);
        let advance = edgewise_mps / tip_mps;
        let profile = density * self.blades * self.chord_m * self.section_drag;
        let profile_w = profile / 8.0
            * speed_radps.powi(3)
            * radius2.powi(2)
            * (1.0 + PROFILE_GROWTH * advance * advance);
        let power_w = thrust_n * (climb_mps + self.induced_factor * induced) + profile_w;
        let drag_n = edgewise_mps
            * (profile / 4.0 * speed_radps * radius2 + lift / 2.0 * through.max(0.0) * zeroth);
        RotorState {
            thrust_n,
            induced_mps: induced,
            torque_nm: power_w / speed_radps.max(1.0),
            drag_n,
        }
    }
}

/// A vehicle of blades and motors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BladeElement {
    /// Mass, kg.
    pub mass_kg: f64,
    /// One rotor.
    pub rotor: Rotor,
    /// One motor.
    pub motor: Motor,
    /// Drag area of the body from the side: drag coefficient times area, m².
    pub side_m2: f64,
    /// Drag area of the body from above, m².
    pub top_m2: f64,
}

impl BladeElement {
    fn rotor_state(&self, speed_radps: f64, flow: &Flow) -> RotorState {
        let [x, y, climb_mps] = flow.relative_mps;
        let density = SEA_LEVEL_KGPM3 * flow.density_ratio;
        self.rotor.state(speed_radps, climb_mps, x.hypot(y), density)
    }

    /// Forces at a rotor speed, rad/s.
    pub fn loads(&self, speed_radps: f64, flow: &Flow) -> Loads {
        let one = self.rotor_state(speed_radps, flow);
        let [x, y, z] = flow.relative_mps;
        let across = x.hypot(y).max(1e-9);
        let in_plane = -ROTORS * one.drag_n / across;
        // Drag along the motion, by the speed and the area that the direction shows.
        let speed = (x * x + y * y + z * z).sqrt();
        let pressure = -0.5 * SEA_LEVEL_KGPM3 * flow.density_ratio * speed;
        Loads {
            rotors_n: [in_plane * x, in_plane * y, ROTORS * one.thrust_n],
            body_n: [
                pressure * self.side_m2 * x,
                pressure * self.side_m2 * y,
                pressure * self.top_m2 * z,
            ],
        }
    }

    /// Angular acceleration of the rotors under a command, rad/s².
    pub fn rate(&self, speed_radps: f64, command: f64, flow: &Flow) -> f64 {
        let torque_nm = self.rotor_state(speed_radps, flow).torque_nm;
        self.motor.acceleration(command, speed_radps, torque_nm)
    }

    /// Command that holds a rotor speed.
    pub fn command_for(&self, speed_radps: f64, flow: &Flow) -> f64 {
        self.motor.command_for(speed_radps, self.rotor_state(speed_radps, flow).torque_nm)
    }

    /// Speed of a motor without load on the full supply, rad/s.
    pub fn largest_radps(&self) -> f64 {
        self.motor.speed_radps_per_v * self.motor.supply_v
    }

    /// Electrical power of all motors, W.
    pub fn power_w(&self, speed_radps: f64, flow: &Flow) -> f64 {
        let torque_nm = self.rotor_state(speed_radps, flow).torque_nm;
        ROTORS * self.motor.power_w(speed_radps, torque_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROTOR: Rotor = Rotor {
        radius_m: 0.0762,
        blades: 2.0,
        chord_m: 0.014,
        pitch_m: 0.0635,
        lift_slope: 5.2,
        section_drag: 0.03,
        induced_factor: 1.15,
    };

    #[test]
    fn integrals_are_those_of_a_sum() {
        let (zeroth, second) = ROTOR.integrals();
        let b = ROTOR.pitch_m / std::f64::consts::TAU;
        let (mut sums, count) = ((0.0, 0.0), 200_000);
        for place in 0..count {
            let r = ROTOR.radius_m * (f64::from(place) + 0.5) / f64::from(count);
            sums.0 += (b / r).atan();
            sums.1 += (b / r).atan() * r * r;
        }
        let step = ROTOR.radius_m / f64::from(count);
        assert!((sums.0 * step / zeroth - 1.0).abs() < 1e-5);
        assert!((sums.1 * step / second - 1.0).abs() < 1e-5);
    }

    #[test]
    fn blades_and_momentum_give_the_same_thrust() {
        for (climb, across) in [(0.0, 0.0), (3.0, 2.0), (-3.0, 1.0), (0.5, 8.0)] {
            let state = ROTOR.state(900.0, climb, across, 1.2);
            let area = std::f64::consts::PI * ROTOR.radius_m.powi(2);
            let through: f64 = climb + state.induced_mps;
            let momentum = 2.0 * 1.2 * area * state.induced_mps * through.hypot(across);
            assert!((momentum - state.thrust_n).abs() < 1e-7, "{climb} {across}");
        }
    }

    #[test]
    fn climbing_takes_thrust_and_forward_flight_gives_it() {
        let at = |climb, across| ROTOR.state(900.0, climb, across, 1.2).thrust_n;
        assert!(at(2.0, 0.0) < at(0.0, 0.0) && at(0.0, 0.0) < at(-2.0, 0.0));
        assert!(at(0.0, 6.0) > 1.03 * at(0.0, 0.0));
        assert!(ROTOR.state(900.0, 0.0, 4.0, 1.2).drag_n > 0.005);
    }

    #[test]
    fn hover_power_is_induced_and_profile_power() {
        let state = ROTOR.state(900.0, 0.0, 0.0, 1.2);
        let area = std::f64::consts::PI * ROTOR.radius_m.powi(2);
        let ideal = state.thrust_n.powf(1.5) / (2.0 * 1.2 * area).sqrt();
        let solidity = 2.0 * ROTOR.chord_m / (std::f64::consts::PI * ROTOR.radius_m);
        let tip: f64 = 900.0 * ROTOR.radius_m;
        let profile = solidity * ROTOR.section_drag / 8.0 * 1.2 * area * tip.powi(3);
        let power = state.torque_nm * 900.0;
        assert!((power - 1.15 * ideal - profile).abs() < 1e-9, "{power}");
        // In forward flight the profile part grows with the square of the advance ratio.
        let ahead = ROTOR.state(900.0, 1.0, 7.0, 1.2);
        let through = 1.0 + 1.15 * ahead.induced_mps;
        let rest = ahead.torque_nm * 900.0 - ahead.thrust_n * through;
        let advance = 7.0 / tip;
        assert!((rest / profile - 1.0 - 4.65 * advance * advance).abs() < 1e-9, "{rest}");
    }
}
