//! Reader of a vehicle's TOML, which refuses numbers that no vehicle can have.

use thiserror::Error;

use super::{RotorLaw, SitlFrame, Vehicle};
use untrusted_io::parse;
use untrusted_io::plain::plain;

/// Error of reading a vehicle's file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VehicleError {
    /// The text is not TOML, a key is unknown or missing, or a type is wrong; the source shows the
    /// line.
    #[error("the vehicle file {} is not valid", plain(name))]
    Toml {
        /// Path of the file, or built-in name.
        name: String,
        /// Error of the TOML reader, with line and column.
        #[source]
        source: Box<toml::de::Error>,
    },
    /// A number is outside the range of sensible values.
    #[error("the vehicle file {}: {key} = {} is not allowed; it must be {allowed}", plain(name), untrusted_io::number::plain(*value))]
    Value {
        /// Path of the file, or built-in name.
        name: String,
        /// Table and key of the number.
        key: &'static str,
        /// Value in the file.
        value: f64,
        /// Range of values that is allowed, in words.
        allowed: &'static str,
    },
    /// The file could not be read.
    #[error(transparent)]
    File(#[from] untrusted_io::file::FileError),
    /// There is no built-in vehicle of this name.
    #[error("there is no built-in vehicle {}; the built-in ones are: {known}", plain(name))]
    Unknown {
        /// Name as asked for.
        name: String,
        /// Names of the built-in vehicles, for the message.
        known: String,
    },
}

/// Rules for numbers: text for people and the test.
type Rule = (&'static str, fn(f64) -> bool);

const POSITIVE: Rule = ("a finite number above 0", |x| x.is_finite() && x > 0.0);
const NOT_NEGATIVE: Rule = ("a finite number, 0 or above", |x| x.is_finite() && x >= 0.0);
const CELSIUS: Rule = ("-100 to 100", |x| x.abs() <= 100.0);
const SHARE: Rule = ("between 0 and 1", |x| (0.0..=1.0).contains(&x));

impl Vehicle {
    /// Reads a vehicle from its TOML text; `name` is the file or built-in name for messages.
    ///
    /// # Errors
    /// Bad TOML, unknown or missing keys, and numbers outside their range.
    pub fn from_toml(text: &str, name: &str) -> Result<Self, VehicleError> {
        let vehicle: Self = parse::toml(text).map_err(|source| VehicleError::Toml {
            name: name.to_owned(),
            source: Box::new(source),
        })?;
        vehicle.validate(name)?;
        Ok(vehicle)
    }

    fn validate(&self, name: &str) -> Result<(), VehicleError> {
        let fail = |key, value, allowed| VehicleError::Value {
            name: name.to_owned(),
            key,
            value,
            allowed,
        };
        let sitl = self.airframe.sitl.iter().flat_map(sitl_numbers);
        for (key, value, (allowed, holds)) in self.numbers().into_iter().chain(sitl) {
            if !holds(value) {
                return Err(fail(key, value, allowed));
            }
        }
        if let Some(celsius) = self.autopilot.baro_ground_temperature_c
            && !CELSIUS.1(celsius)
        {
            return Err(fail("autopilot.baro_ground_temperature_c", celsius, CELSIUS.0));
        }
        if let RotorLaw::Motor(motor) = &self.airframe.rotor {
            for (key, value, (allowed, holds)) in [
                ("airframe.rotor.supply_v", motor.supply_v, POSITIVE),
                ("airframe.rotor.kv_rpm_per_v", motor.kv_rpm_per_v, POSITIVE),
                ("airframe.rotor.resistance_ohm", motor.resistance_ohm, POSITIVE),
                ("airframe.rotor.no_load_a", motor.no_load_a, NOT_NEGATIVE),
            ] {
                if !holds(value) {
                    return Err(fail(key, value, allowed));
                }
            }
        }
        let (low, high) = (self.autopilot.mot_spin_min, self.autopilot.mot_spin_max);
        if low >= high {
            return Err(fail("autopilot.mot_spin_max", high, "above mot_spin_min"));
        }
        if let Some(frame) = &self.airframe.sitl
            && frame.spin_min >= frame.spin_max
        {
            return Err(fail("airframe.sitl.spin_max", frame.spin_max, "above spin_min"));
        }
        let motors_kg = 4.0 * self.airframe.motor_mass_kg;
        if motors_kg >= self.airframe.mass_kg {
            return Err(fail("airframe.mass_kg", self.airframe.mass_kg, "above that of 4 motors"));
        }
        Ok(())
    }

    fn numbers(&self) -> [(&'static str, f64, Rule); 35] {
        let (limits, frame, pilot) = (&self.limits, &self.airframe, &self.autopilot);
        [
            ("limits.max_speed_xy_mps", limits.max_speed_xy_mps, POSITIVE),
            ("limits.max_speed_up_mps", limits.max_speed_up_mps, POSITIVE),
            ("limits.max_speed_down_mps", limits.max_speed_down_mps, POSITIVE),
            ("limits.max_acceleration_mps2", limits.max_acceleration_mps2, POSITIVE),
            ("limits.max_velocity_step_mps", limits.max_velocity_step_mps, NOT_NEGATIVE),
            ("limits.max_altitude_m", limits.max_altitude_m, POSITIVE),
            ("limits.min_distance_m", limits.min_distance_m, NOT_NEGATIVE),
            ("limits.endurance_s", limits.endurance_s, POSITIVE),
            ("limits.endurance_reserve", limits.endurance_reserve, SHARE),
            ("airframe.mass_kg", frame.mass_kg, POSITIVE),
            ("airframe.motor_mass_kg", frame.motor_mass_kg, NOT_NEGATIVE),
            ("airframe.body_m[0]", frame.body_m[0], POSITIVE),
            ("airframe.body_m[1]", frame.body_m[1], POSITIVE),
            ("airframe.body_m[2]", frame.body_m[2], POSITIVE),
            ("airframe.arm_m", frame.arm_m, POSITIVE),
            ("airframe.rotor_z_m", frame.rotor_z_m, ("a finite number", f64::is_finite)),
            ("airframe.rotor_diameter_m", frame.rotor_diameter_m, POSITIVE),
            ("airframe.rotor_height_m", frame.rotor_height_m, NOT_NEGATIVE),
            ("airframe.thrust_coefficient", frame.thrust_coefficient, POSITIVE),
            ("airframe.power_coefficient", frame.power_coefficient, POSITIVE),
            ("airframe.max_rpm", frame.max_rpm, POSITIVE),
            ("airframe.motor_time_constant_s", frame.motor_time_constant_s, NOT_NEGATIVE),
            ("airframe.drag_coefficient", frame.drag_coefficient, NOT_NEGATIVE),
            ("autopilot.mot_thst_expo", pilot.mot_thst_expo, ("-1 to 1", |x| x.abs() <= 1.0)),
            ("autopilot.mot_spin_min", pilot.mot_spin_min, SHARE),
            ("autopilot.mot_spin_max", pilot.mot_spin_max, SHARE),
            ("autopilot.mot_thst_hover", pilot.mot_thst_hover, SHARE),
            ("autopilot.psc_posz_p", pilot.psc_posz_p, POSITIVE),
            ("autopilot.psc_velz_p", pilot.psc_velz_p, POSITIVE),
            ("autopilot.psc_accz_p", pilot.psc_accz_p, POSITIVE),
            ("autopilot.psc_accz_i", pilot.psc_accz_i, NOT_NEGATIVE),
            ("autopilot.wpnav_speed_up_mps", pilot.wpnav_speed_up_mps, POSITIVE),
            ("autopilot.show_vel_ff_gain", pilot.show_vel_ff_gain, NOT_NEGATIVE),
            ("autopilot.mot_bat_volt_max", pilot.mot_bat_volt_max, NOT_NEGATIVE),
            ("autopilot.mot_bat_volt_min", pilot.mot_bat_volt_min, NOT_NEGATIVE),
        ]
    }
}

fn sitl_numbers(frame: &SitlFrame) -> [(&'static str, f64, Rule); 15] {
    const LEAN: Rule = ("above 0 and below 90", |x| x > 0.0 && x < 90.0);
    const ALTITUDE: Rule = ("-1000 to 11000", |x| (-1_000.0..=11_000.0).contains(&x));
    const OPEN_SHARE: Rule = ("above 0 and at most 1", |x| x > 0.0 && x <= 1.0);
    [
        ("airframe.sitl.arm_m", frame.arm_m, POSITIVE),
        ("airframe.sitl.reference_speed_mps", frame.reference_speed_mps, POSITIVE),
        ("airframe.sitl.reference_lean_deg", frame.reference_lean_deg, LEAN),
        ("airframe.sitl.reference_voltage_v", frame.reference_voltage_v, POSITIVE),
        ("airframe.sitl.reference_current_a", frame.reference_current_a, POSITIVE),
        ("airframe.sitl.reference_amsl_m", frame.reference_amsl_m, ALTITUDE),
        ("airframe.sitl.air_temperature_c", frame.air_temperature_c, CELSIUS),
        ("airframe.sitl.hover_throttle", frame.hover_throttle, OPEN_SHARE),
        ("airframe.sitl.thrust_expo", frame.thrust_expo, SHARE),
        ("airframe.sitl.spin_min", frame.spin_min, SHARE),
        ("airframe.sitl.spin_max", frame.spin_max, OPEN_SHARE),
        ("airframe.sitl.disc_area_m2", frame.disc_area_m2, POSITIVE),
        ("airframe.sitl.momentum_drag", frame.momentum_drag, NOT_NEGATIVE),
        ("airframe.sitl.full_voltage_v", frame.full_voltage_v, POSITIVE),
        ("airframe.sitl.battery_voltage_v", frame.battery_voltage_v, POSITIVE),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::library::builtin_toml;
    use super::*;

    fn changed(from: &str, to: &str) -> VehicleError {
        let text = builtin_toml("airsim-generic-quad").unwrap();
        assert!(text.contains(from), "the template no longer has {from}");
        Vehicle::from_toml(&text.replace(from, to), "mine.toml").unwrap_err()
    }

    #[test]
    fn refuses_impossible_numbers_and_says_what_is_allowed() {
        for (from, to, key) in [
            ("mass_kg = 1.0", "mass_kg = -1.0", "airframe.mass_kg"),
            ("mass_kg = 1.0", "mass_kg = 0.2", "airframe.mass_kg"),
            ("mass_kg = 1.0", "mass_kg = nan", "airframe.mass_kg"),
            ("mot_spin_max = 0.95", "mot_spin_max = 0.1", "autopilot.mot_spin_max"),
            ("endurance_reserve = 0.2", "endurance_reserve = 20.0", "limits.endurance_reserve"),
        ] {
            let error = changed(from, to).to_string();
            assert!(error.contains(key) && error.contains("mine.toml"), "{to}: {error}");
        }
    }

    #[test]
    fn points_at_the_line_of_an_unknown_key() {
        let error = changed("arm_m = 0.2275", "arm = 0.2275");
        let VehicleError::Toml { source, .. } = &error else { panic!("{error}") };
        assert!(source.to_string().contains("unknown field `arm`"), "{source}");
        assert!(source.span().is_some());
    }
}
