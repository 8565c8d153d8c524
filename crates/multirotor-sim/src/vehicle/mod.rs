//! Vehicles: flight limits, airframe and autopilot settings, one TOML file each in
//! `templates/vehicles/`.

mod effects;
pub mod library;
mod load;
mod rotor;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
pub use skybrush_show::check::Limits;

pub use effects::EffectTable;
pub use load::VehicleError;
pub use rotor::{MotorLaw, RotorLaw};

/// A vehicle as its TOML file states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Short name, the file's stem: `airsim-generic-quad`.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Where the numbers come from.
    pub source: String,
    /// What the vehicle may be asked to do.
    pub limits: Limits,
    /// Mass, geometry, rotors and drag.
    pub airframe: Airframe,
    /// Autopilot parameters that shape the pulse.
    pub autopilot: Autopilot,
    /// Physics beyond AirSim's that this vehicle has, by name (`updraft effects` lists them).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub effects: BTreeMap<String, EffectTable>,
}

/// Mass, geometry, rotors and drag of AirSim's multirotor model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Airframe {
    /// Total mass, kg.
    pub mass_kg: f64,
    /// Mass of one motor with rotor, kg (for the inertia).
    pub motor_mass_kg: f64,
    /// Body box: length x, width y, height z, m.
    pub body_m: [f64; 3],
    /// Distance of each rotor from the centre, m.
    pub arm_m: f64,
    /// Height of the rotors above the centre, m.
    pub rotor_z_m: f64,
    /// Rotor diameter, m.
    pub rotor_diameter_m: f64,
    /// Height of a rotor's side face, for horizontal drag, m.
    pub rotor_height_m: f64,
    /// Thrust coefficient C_T (thrust = C_T rho n² D⁴, n in rev/s).
    pub thrust_coefficient: f64,
    /// Power coefficient C_P (torque = C_P rho n² D⁵ / 2 pi).
    pub power_coefficient: f64,
    /// Largest rotor speed, rev/min.
    pub max_rpm: f64,
    /// Time constant of the motor's first-order response, s.
    pub motor_time_constant_s: f64,
    /// Linear drag coefficient of the box faces (AirSim: 1.3 / 4).
    pub drag_coefficient: f64,
    /// How a command becomes thrust.
    #[serde(default, skip_serializing_if = "RotorLaw::is_linear")]
    pub rotor: RotorLaw,
    /// Rotors, drag and inertia of ArduPilot's own simulator instead of AirSim's; only the mass is
    /// taken from the above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sitl: Option<SitlFrame>,
}

/// The multicopter of ArduPilot's own simulator (SITL), by the reference test that its frame model
/// is stated with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SitlFrame {
    /// Distance of each rotor from the centre, m (the frame model's diagonal size).
    pub arm_m: f64,
    /// Speed of level flight in the reference test, m/s.
    pub reference_speed_mps: f64,
    /// Lean at that speed, degrees.
    pub reference_lean_deg: f64,
    /// Battery voltage in the reference hover, V.
    pub reference_voltage_v: f64,
    /// Battery current in the reference hover, A.
    pub reference_current_a: f64,
    /// Altitude of the reference test above mean sea level, m.
    pub reference_amsl_m: f64,
    /// Temperature of the air, degrees Celsius, at every altitude.
    pub air_temperature_c: f64,
    /// Throttle in the reference hover, 0..1.
    pub hover_throttle: f64,
    /// Curve of thrust against command, 0 linear, 1 quadratic.
    pub thrust_expo: f64,
    /// Output at which the command is 0, share of the range of 1000..2000 us.
    pub spin_min: f64,
    /// Output at which the command is 1.
    pub spin_max: f64,
    /// Area of all rotor discs, m².
    pub disc_area_m2: f64,
    /// Momentum drag coefficient.
    pub momentum_drag: f64,
    /// Voltage of the full battery, V.
    pub full_voltage_v: f64,
    /// Voltage of the battery, V: constant, as its capacity is unlimited.
    pub battery_voltage_v: f64,
}

/// Autopilot parameters, by their ArduPilot names, that shape the pulse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Autopilot {
    /// MOT_THST_EXPO: curve of thrust against throttle, 0 linear.
    pub mot_thst_expo: f64,
    /// MOT_SPIN_MIN: lowest output in flight, 0..1.
    pub mot_spin_min: f64,
    /// MOT_SPIN_MAX: highest output, 0..1.
    pub mot_spin_max: f64,
    /// MOT_THST_HOVER: hover throttle at the start, 0..1.
    pub mot_thst_hover: f64,
    /// PSC_POSZ_P, 1/s.
    pub psc_posz_p: f64,
    /// PSC_VELZ_P, 1/s.
    pub psc_velz_p: f64,
    /// PSC_ACCZ_P.
    pub psc_accz_p: f64,
    /// PSC_ACCZ_I.
    pub psc_accz_i: f64,
    /// WPNAV_SPEED_UP, m/s (take-off).
    pub wpnav_speed_up_mps: f64,
    /// SHOW_VEL_FF_GAIN.
    pub show_vel_ff_gain: f64,
    /// MOT_BAT_VOLT_MAX, V: full thrust is scaled to this voltage; 0 for no compensation.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mot_bat_volt_max: f64,
    /// Temperature at the ground that the barometer takes for that of the air, degrees Celsius, for
    /// the compensation of density; without it that of the standard atmosphere. On a board that
    /// warms itself it is too high.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baro_ground_temperature_c: Option<f64>,
    /// MOT_BAT_VOLT_MIN, V: below it the compensation grows no more.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mot_bat_volt_min: f64,
    /// Whether the motor controllers report their speed (bidirectional DShot): simulated logs then
    /// have it as ESC rows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub esc_telemetry: bool,
}

/// Left out of files, as serde asks for it: by reference.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
