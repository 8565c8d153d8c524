//! Rotors and drag of ArduPilot's own simulator (SITL's multicopter frame).
//!
//! Thrust of a rotor is that of an ideal fan, `0.5 rho A (v_out² - v_in²)`: `v_out` follows the
//! command, `v_in` is the air's speed into the rotor in a climb. Momentum drag is linear in the
//! speed of the air in all axes, drag of the body quadratic. There is no lag. The constants follow
//! from a reference test: a hover, and level flight at a known lean.

use nalgebra::Vector3;

use super::rotor::{LAYOUT, ROTORS};
use super::{GRAVITY, Loads};
use crate::sim::air::density_ratio;
use crate::vehicle::SitlFrame;

/// Torque about the rotor's axis over arm, thrust and command.
const YAW_SCALE: f64 = 0.05;
/// Damping of turns, 1/s: 400 degrees/s² at 120 rad/s.
const TURN_DAMPING_PER_S: f64 = 400.0 * std::f64::consts::PI / 180.0 / 120.0;
const SEA_LEVEL_PA: f64 = 101_325.0;
/// ArduPilot's own, J/(kg K).
const GAS_CONSTANT: f64 = 287.26;
/// Pressure of the standard atmosphere as a power of its density.
const PRESSURE_OF_DENSITY: f64 = 5.255_877 / 4.255_877;

/// Rotors and drag, with the density of the last call.
#[derive(Clone, Copy, Debug)]
pub struct Sitl {
    /// Thrust of one rotor at full command over density, N / (kg/m³).
    full_thrust: f64,
    /// Half the fan area of one rotor, m².
    half_area_m2: f64,
    /// Half of the body's drag coefficient times its area, m².
    half_drag_m2: f64,
    /// Momentum drag of one rotor over speed and the roots of density and thrust.
    momentum: f64,
    expo: f64,
    spin_min: f64,
    per_spin: f64,
    arm_m: f64,
    inertia: Vector3<f64>,
    per_kelvin: f64,
    asked_ratio: f64,
    density: f64,
    root_density: f64,
}

impl Sitl {
    /// Rotors and drag of a SITL frame, from the reference flight that describes it, with this
    /// mass, kg.
    pub fn new(frame: &SitlFrame, mass_kg: f64) -> Self {
        let per_kelvin = SEA_LEVEL_PA / (GAS_CONSTANT * (273.15 + frame.air_temperature_c));
        let density = per_kelvin * pressure_ratio(density_ratio(frame.reference_amsl_m));
        let weight_n = mass_kg * GRAVITY;
        let rotors = ROTORS as f64;

        // Power is thrust times the mean of the speeds before and behind the fan.
        let outflow_mps = 2.0 * frame.reference_current_a * frame.reference_voltage_v / weight_n;
        let fan_area_m2 = weight_n / (0.5 * density * outflow_mps * outflow_mps);
        let full_outflow_mps = outflow_mps / frame.hover_throttle.sqrt();
        let voltage = frame.battery_voltage_v / frame.full_voltage_v;
        let half_area_m2 = 0.5 * fan_area_m2 / rotors;

        // What momentum drag does not explain of the drag at the reference lean is the body's.
        let (sin, cos) = frame.reference_lean_deg.to_radians().sin_cos();
        let drag_n = weight_n * sin / cos;
        let root = (weight_n / cos * density * frame.disc_area_m2).sqrt();
        let momentum_n = cos * frame.momentum_drag * frame.reference_speed_mps * cos * root;
        let share = if momentum_n > drag_n { drag_n / momentum_n } else { 1.0 };
        let pressure_pa = 0.5 * density * frame.reference_speed_mps * frame.reference_speed_mps;
        Self {
            full_thrust: half_area_m2 * (full_outflow_mps * voltage).powi(2),
            half_area_m2,
            half_drag_m2: 0.5 * (drag_n - share * momentum_n) / pressure_pa,
            momentum: share * frame.momentum_drag * (frame.disc_area_m2 / rotors).sqrt(),
            expo: frame.thrust_expo,
            spin_min: frame.spin_min,
            per_spin: 1.0 / (frame.spin_max - frame.spin_min),
            arm_m: frame.arm_m,
            // Half of the mass on a ring of half the arm.
            inertia: Vector3::new(0.25, 0.25, 0.5) * mass_kg * (frame.arm_m / 2.0).powi(2),
            per_kelvin,
            asked_ratio: f64::NAN,
            density: 0.0,
            root_density: 0.0,
        }
    }

    /// Moments of inertia about forward, left and up, kg m².
    pub fn inertia_kgm2(&self) -> Vector3<f64> {
        self.inertia
    }

    /// Drag coefficient of the body times its area, the same from every side, m².
    pub fn drag_area_m2(&self) -> f64 {
        2.0 * self.half_drag_m2
    }

    /// Adds the loads of commands (share of 1000..2000 us) at a velocity relative to the air and
    /// turn rates, both in body axes; `density_ratio` is that of the standard atmosphere, and
    /// `drag_share` what effects make of the body's drag along forward, left and up.
    #[inline(never)]
    pub fn add_loads(
        &mut self,
        command: &[f64; ROTORS],
        relative_mps: &Vector3<f64>,
        rate_radps: &Vector3<f64>,
        density_ratio: f64,
        drag_share: &Vector3<f64>,
        loads: &mut Loads,
    ) {
        if density_ratio != self.asked_ratio {
            self.asked_ratio = density_ratio;
            self.density = self.per_kelvin * pressure_ratio(density_ratio);
            self.root_density = self.density.sqrt();
        }
        let into_mps = relative_mps.z.max(0.0);
        let inflow = self.half_area_m2 * into_mps * into_mps;
        let [mut thrust, mut root, mut roll, mut pitch, mut yaw] = [0.0; 5];
        for ((forward, left, turn), output) in LAYOUT.into_iter().zip(command) {
            let share = ((output - self.spin_min) * self.per_spin).clamp(0.0, 1.0);
            let curve = share * (1.0 - self.expo + self.expo * share);
            let force = self.density * (self.full_thrust * curve - inflow);
            thrust += force;
            root += force.abs().sqrt();
            roll += left * force;
            pitch -= forward * force;
            yaw += turn * force * share;
        }
        // The frame is a plus: two of its rotors, at the full arm, turn it as four at half do.
        let lever = self.arm_m / 2.0;
        loads.force_n.z += thrust;
        loads.force_n -= relative_mps * (self.momentum * self.root_density * root);
        let drag = self.half_drag_m2 * self.density;
        let drag_n = relative_mps.map(|speed| drag * speed * speed.abs());
        loads.force_n -= drag_n.component_mul(drag_share);
        loads.torque_nm += Vector3::new(roll * lever, pitch * lever, yaw * YAW_SCALE * self.arm_m);
        loads.torque_nm -= rate_radps.component_mul(&self.inertia) * TURN_DAMPING_PER_S;
    }
}

fn pressure_ratio(density_ratio: f64) -> f64 {
    density_ratio.powf(PRESSURE_OF_DENSITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    /// Home of the firmware's flights, m above mean sea level.
    const HOME_AMSL_M: f64 = 584.0;

    fn sitl() -> Sitl {
        let airframe = builtin("arducopter-sitl").unwrap().airframe;
        Sitl::new(&airframe.sitl.unwrap(), airframe.mass_kg)
    }

    /// Pulse that holds a vertical speed relative to the air at a height above home.
    fn trim_us(up_mps: f64, height_m: f64) -> f64 {
        let mut sitl = sitl();
        let (mut low, mut high) = (1000.0, 2000.0);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            let mut loads = Loads::default();
            let velocity = Vector3::new(0.0, 0.0, up_mps);
            sitl.add_loads(
                &[(middle - 1000.0) / 1000.0; ROTORS],
                &velocity,
                &Vector3::zeros(),
                density_ratio(HOME_AMSL_M + height_m),
                &Vector3::repeat(1.0),
                &mut loads,
            );
            if loads.force_n.z < 3.0 * GRAVITY { low = middle } else { high = middle }
        }
        f64::midpoint(low, high)
    }

    #[test]
    fn follows_the_law_of_the_firmwares_still_air_ladder() {
        // Measured in the firmware's simulator: 1591.04 + 7.05 v + 0.281 v² + 1.237 v|v|, rms
        // 0.06 us.
        for tenths in -7..=7 {
            let v = f64::from(tenths) * 0.5;
            let law = 1591.04 + 7.05 * v + 0.281 * v * v + 1.237 * v * v.abs();
            let trim = trim_us(v, 20.0);
            println!("{v} {trim:.3} {law:.3}");
            assert!((trim - law).abs() < 0.15, "{v} m/s: {trim:.3} instead of {law:.3}");
        }
        let slope = (trim_us(0.0, 90.0) - trim_us(0.0, 20.0)) / 70.0;
        assert!((slope - 0.036).abs() < 0.002, "{slope} us/m");
    }

    #[test]
    fn constants_are_those_that_were_measured() {
        let sitl = sitl();
        assert!((2.0 * sitl.half_drag_m2 - 0.1842).abs() < 1e-4, "{}", 2.0 * sitl.half_drag_m2);
        let speed = (sitl.full_thrust / sitl.half_area_m2).sqrt();
        assert!((speed - 38.56).abs() < 0.01, "{speed}");
    }
}
