//! The vehicle in steady hover, as closed forms need it.

use crate::vehicle::{Airframe, MotorLaw, RotorLaw, Vehicle};

/// Standard gravity, m/s².
pub(super) const GRAVITY: f64 = 9.80665;
/// Density at sea level, kg/m³.
pub(super) const DENSITY: f64 = 1.225;
const ROTORS: f64 = 4.0;

/// A vehicle without effects at one air density: how thrust and torque become a pulse.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// Airframe of the drone.
    pub airframe: Airframe,
    /// Air density as a share of sea level's.
    pub density_ratio: f64,
}

impl Reference {
    /// Reference of the fleet's mean drone at sea level.
    pub fn of(vehicle: &Vehicle) -> Self {
        Self { airframe: vehicle.airframe, density_ratio: 1.0 }
    }

    /// Reference in air of another density, as a share of sea level's.
    #[must_use]
    pub fn in_air(self, density_ratio: f64) -> Self {
        Self { density_ratio, ..self }
    }

    /// Weight of the drone, N.
    pub fn weight_n(&self) -> f64 {
        self.airframe.mass_kg * GRAVITY
    }

    /// Rotor speed in hover, rad/s.
    pub fn hover_radps(&self) -> f64 {
        (self.weight_n() / (ROTORS * self.airframe.thrust_factor() * self.density_ratio)).sqrt()
    }

    /// Induced velocity in hover, m/s.
    pub fn hover_induced_mps(&self) -> f64 {
        let flow = 2.0 * DENSITY * self.density_ratio * self.airframe.disc_area_m2();
        (self.weight_n() / flow).sqrt()
    }

    /// Pulse that turns the rotors at `speed` times the hover speed when their torque is `torque`
    /// times what a rotor in still air has at that speed, us.
    pub fn pulse_us(&self, speed: f64, torque: f64) -> f64 {
        let speed_radps = speed * self.hover_radps();
        let frame = &self.airframe;
        let command = match &frame.rotor {
            RotorLaw::Linear => {
                let most = frame.max_rpm * std::f64::consts::TAU / 60.0;
                (speed_radps / most).powi(2)
            }
            RotorLaw::Motor(motor) => {
                let torque_nm =
                    torque * self.density_ratio * frame.torque_factor() * speed_radps.powi(2);
                motor_volts(motor, speed_radps, torque_nm) / motor.supply_v
            }
        };
        1000.0 + 1000.0 * command
    }

    /// Pulse in hover, us.
    pub fn hover_us(&self) -> f64 {
        self.pulse_us(1.0, 1.0)
    }

    /// Change of the pulse when the rotors must make `ratio` times the hover thrust, us.
    pub fn thrust_us(&self, ratio: f64) -> f64 {
        self.pulse_us(ratio.max(0.0).sqrt(), 1.0) - self.hover_us()
    }

    /// Change of the pulse per relative change of thrust at hover (du/dlnT), us.
    pub fn sensitivity_us(&self) -> f64 {
        let step = 1e-4;
        (self.thrust_us(1.0 + step) - self.thrust_us(1.0 - step)) / (2.0 * step)
    }

    /// As [`Reference::sensitivity_us`], of what the simulator flies: ArduPilot's own frame has a curve
    /// of thrust that is not the airframe's, taken here in the hover of its reference test.
    pub fn own_sensitivity_us(&self) -> f64 {
        let Some(frame) = &self.airframe.sitl else { return self.sensitivity_us() };
        let (expo, thrust) = (frame.thrust_expo, frame.hover_throttle);
        // Slope of (1 - expo) c + expo c² where the curve has the thrust of hover.
        let slope = ((1.0 - expo).powi(2) + 4.0 * expo * thrust).sqrt();
        1000.0 * (frame.spin_max - frame.spin_min) * thrust / slope
    }

    /// Electrical power in hover, W.
    pub fn hover_w(&self) -> f64 {
        let speed = self.hover_radps();
        let torque_nm = self.density_ratio * self.airframe.torque_factor() * speed * speed;
        ROTORS * rotor_w(&self.airframe.rotor, speed, torque_nm)
    }
}

/// Voltage at a motor that turns at a speed against a torque, V.
pub(crate) fn motor_volts(motor: &MotorLaw, speed_radps: f64, torque_nm: f64) -> f64 {
    let constant = motor.constant();
    constant * speed_radps + motor.resistance_ohm * (torque_nm / constant + motor.no_load_a)
}

/// Share of the electrical power that AirSim's rotors, which have no motor, give to the shaft.
const LINEAR_EFFICIENCY: f64 = 0.75;

/// Electrical power of one rotor, W.
pub fn rotor_w(law: &RotorLaw, speed_radps: f64, torque_nm: f64) -> f64 {
    match law {
        RotorLaw::Linear => speed_radps * torque_nm / LINEAR_EFFICIENCY,
        RotorLaw::Motor(motor) => {
            let amps = torque_nm / motor.constant() + motor.no_load_a;
            motor_volts(motor, speed_radps, torque_nm) * amps
        }
    }
}
