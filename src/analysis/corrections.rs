//! Corrections of pulses for known effects other than the vertical air speed, made before laws are
//! fitted for the map, with the doubt that each correction leaves.
//!
//! A doubt is one number for the whole fleet (how much more or less than assumed a correction should
//! have been). It moves calibration and hover together: what is left of it in the map is the
//! difference between the two, and [`Referred::doubts_us`] holds what is needed to take it.

use super::battery::Pack;
use super::density::Density;
use super::lean_table::{DIRECTIONS, LeanTable};
use super::wind::Leaning;
use super::window::WindowStats;
use crate::flight::Indicator;

/// Doubts in their order: battery, drift, wind, density, and the wind's second direction.
pub(super) const DOUBTS: usize = 5;
/// Place of the battery's doubt.
pub(super) const BATTERY: usize = 0;
/// Place of the doubt about other drift in time.
pub(super) const DRIFT: usize = 1;
/// Place of the wind's doubt.
pub(super) const WIND: usize = 2;
/// Place of the density's doubt.
pub(super) const DENSITY: usize = 3;
/// Places of the wind's doubts: drag and lift are doubted in more than one direction.
pub(super) const WINDS: [usize; DIRECTIONS] = [WIND, 4];

/// Pulse at which the rotors make no thrust, us.
const NO_THRUST_US: f64 = 1000.0;
/// Standard error of the exponent of density for rotor speed: by Reynolds numbers of small blades. Chosen. That of power
/// has motors in it, as the pulse's.
const SPEED_DENSITY_EXPONENT: f64 = 0.03;
/// Time constant of warming motors and controllers, s: 60 to 200 s (docs/physics.md, 5.4).
const WARM_UP_S: f64 = 100.0;
/// Drift where a battery acts on the pulse and its voltage is not known: standard error, us per
/// minute of flight. A small drone's pack falls by half a percent a minute, one percent is 5.5 us.
const UNKNOWN_VOLTAGE_US: f64 = 3.0;
/// Share of a wind correction that may be wrong; see `DOUBTED_SHARE` in `wind.rs`.
const WIND_SHARE: f64 = 0.15;
/// Where wind could not be corrected for, the most that it may have done counts as two standard errors.
const UNKNOWN_WIND_SHARE: f64 = 0.5;
/// Standard error of the exponent of density where the thrust curve is known: motors have 0.35 to 0.45
/// (docs/physics.md, 2.3). Chosen around that.
const DENSITY_EXPONENT: f64 = 0.1;
/// Standard error of that exponent where it is not known: anything from 0 to 1.
const UNKNOWN_DENSITY_EXPONENT: f64 = 0.5;
/// Height over which density falls by 1/e at the ground, m: the standard atmosphere's, 288.15 K over 0.0277
/// K/m.
const DENSITY_SCALE_M: f64 = 10_400.0;
/// Sensitivity of the pulse to thrust where it is not known (du/dlnT), us: a show drone's (docs/physics.md,
/// 2.3).
const THRUST_US: f64 = 300.0;
/// Step of the derivative of the table's values by the vertical air speed, m/s. Numerical.
const CLIMB_STEP_MPS: f64 = 0.5;
/// Most that wind does to an unknown small drone at a lean of one degree, us; it grows with the square of
/// the lean. Translational lift of a show drone: -15 to -45 us at 5 m/s, where it leans by 5 to 7 degrees
/// (docs/physics.md, 2.4).
const UNKNOWN_WIND_US: f64 = 1.5;

/// Which corrections the map of a flight has.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corrections<'a> {
    pub(super) density: Option<Density>,
    pub(super) leaning: Option<Leaning>,
    pub(super) lean_table: Option<&'a LeanTable>,
    /// The same by leans of level flight, for drones that fly along tracks ([`super::track_lean`]).
    pub(super) track_table: Option<&'a LeanTable>,
    /// What motors that warm up do to the pulse, where a battery acts on it: standard error, us.
    pub(super) warm_up_us: Option<f64>,
    /// Share of `u - 1000` that a pack whose voltage is not known may have changed, where the law is
    /// referred to a voltage: standard error ([`super::battery::unknown_share`]).
    pub(super) unknown_share: f64,
    /// Indicator of rotor effort that "pulses" are of.
    pub(super) indicator: Indicator,
    /// Its unit for one us of the pulses that priors and doubts are written for; `None`: it is the pulse.
    pub(super) unit: Option<f64>,
}

/// A stretch of flight as logged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raw {
    pub(super) time_s: f64,
    pub(super) pulse_us: f64,
    pub(super) velocity_mps: f64,
    /// Vertical speed through the air, m/s, as far as it is known: what rotors gain in wind depends
    /// on it.
    pub(super) climb_mps: f64,
    pub(super) lean_deg: f64,
    pub(super) height_m: f64,
    pub(super) resting_v: Option<f64>,
}

impl Raw {
    pub(super) fn of(window: &WindowStats) -> Self {
        Self {
            time_s: f64::midpoint(window.start_s, window.end_s),
            pulse_us: window.effort.mean,
            velocity_mps: window.velocity_mps.mean,
            climb_mps: window.velocity_mps.mean,
            lean_deg: window.lean_deg,
            height_m: window.height_m,
            resting_v: window.supply.map(|supply| supply.resting_v),
        }
    }
}

/// Values of a window referred to level flight, the ground's density and the reference voltage.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Referred {
    /// Vertical speed with what the wind adds along the rotor axis, m/s.
    pub(super) velocity_mps: f64,
    /// Pulse, us.
    pub(super) pulse_us: f64,
    /// Change of the pulse per unit of each doubt, us.
    pub(super) doubts_us: [f64; DOUBTS],
    /// How much steeper than without wind the logged pulse is in the vertical air speed, us/(m/s).
    pub(super) steeper: f64,
}

impl Referred {
    /// The same in other units.
    fn in_units_of(self, unit: f64) -> Self {
        Self {
            velocity_mps: self.velocity_mps,
            pulse_us: self.pulse_us / unit,
            doubts_us: self.doubts_us.map(|doubt| doubt / unit),
            steeper: self.steeper / unit,
        }
    }
}

impl Corrections<'_> {
    /// The indicator's unit for one us.
    pub(super) fn per_us(&self) -> f64 {
        self.unit.unwrap_or(1.0)
    }

    /// Whether the vehicle's drag is known, so that wind is corrected for.
    pub(super) fn knows_wind(&self) -> bool {
        self.leaning.is_some() || self.lean_table.is_some()
    }

    /// Standard errors of the doubts (units of [`Referred::doubts_us`]).
    pub(super) fn sigmas(&self, pack: Option<&Pack>) -> [f64; DOUBTS] {
        let mut sigmas = [0.0; DOUBTS];
        if let Some(pack) = pack {
            sigmas[BATTERY] = pack.correction.exponent_se;
        }
        // Both kinds of drift are scaled to us in `refer`.
        sigmas[DRIFT] = if self.warm_up_us.is_some() { 1.0 } else { 0.0 };
        match (self.leaning, self.lean_table) {
            (Some(_), _) => sigmas[WIND] = WIND_SHARE,
            // The table's own doubts are standard errors.
            (None, Some(_)) => WINDS.iter().for_each(|wind| sigmas[*wind] = 1.0),
            (None, None) => sigmas[WIND] = UNKNOWN_WIND_SHARE,
        }
        sigmas[DENSITY] = match self.density {
            // AirSim's thrust is linear by definition; the weather of the day is not the standard's.
            Some(density) if density.exponent == 1.0 => 0.0,
            Some(_) if self.indicator == Indicator::RotorSpeed => SPEED_DENSITY_EXPONENT,
            Some(_) => DENSITY_EXPONENT,
            None => UNKNOWN_DENSITY_EXPONENT,
        };
        sigmas
    }

    /// The pulse with what is known taken away, as [`Self::refer`] has it.
    pub(super) fn pulse(&self, raw: &Raw, pack: Option<&Pack>) -> f64 {
        let level_us = match (self.leaning, self.lean_table) {
            (Some(leaning), _) => leaning.level_us(raw.pulse_us, raw.lean_deg),
            (None, Some(table)) => raw.pulse_us - table.at(raw.lean_deg, raw.climb_mps),
            (None, None) => raw.pulse_us,
        };
        let pulse_us =
            self.density.map_or(level_us, |density| density.refer_us(level_us, raw.height_m));
        let referred = pack.zip(raw.resting_v).map(|(pack, rest_v)| pack.refer(pulse_us, rest_v));
        referred.map_or(pulse_us, |(referred_us, _)| referred_us) / self.per_us()
    }

    /// Takes away what is known.
    pub(super) fn refer(&self, raw: &Raw, pack: Option<&Pack>, slope: f64) -> Referred {
        let mut pulse_us = raw.pulse_us;
        let mut velocity_mps = raw.velocity_mps;
        let mut doubts_us = [0.0; DOUBTS];
        let mut steeper = 0.0;
        if let Some(leaning) = self.leaning {
            let axial = leaning.axial_mps(raw.lean_deg);
            let level = leaning.level_us(pulse_us, raw.lean_deg);
            doubts_us[WIND] = slope * axial + (level - pulse_us);
            velocity_mps += axial;
            pulse_us = level;
        } else if let Some(table) = self.lean_table {
            let change = table.at(raw.lean_deg, raw.climb_mps);
            let doubts = table.doubts_at(raw.lean_deg, raw.climb_mps);
            let doubts = doubts.unwrap_or_else(|| {
                std::array::from_fn(
                    |direction| if direction == 0 { WIND_SHARE * change } else { 0.0 },
                )
            });
            WINDS.iter().zip(doubts).for_each(|(wind, doubt)| doubts_us[*wind] = doubt);
            let at = |step: f64| table.at(raw.lean_deg, raw.climb_mps + step);
            steeper = (at(CLIMB_STEP_MPS) - at(-CLIMB_STEP_MPS)) / (2.0 * CLIMB_STEP_MPS);
            pulse_us -= change;
        } else {
            // Leaning by drag, the thrust is m g cos(phi); by acceleration, m g / cos(phi). Neither
            // is corrected; translational lift is more than both.
            let cos = raw.lean_deg.to_radians().cos();
            let most_us = UNKNOWN_WIND_US * raw.lean_deg.powi(2) + THRUST_US * (1.0 - cos);
            doubts_us[WIND] = most_us * self.per_us();
        }
        let log_density = match self.density {
            Some(density) => {
                pulse_us = density.refer_us(pulse_us, raw.height_m);
                density.log_ratio(raw.height_m)
            }
            None => -raw.height_m / DENSITY_SCALE_M,
        };
        doubts_us[DENSITY] = (pulse_us - self.indicator.without_thrust()) * log_density;
        let flown_s = raw.time_s.max(0.0);
        let warm = self.warm_up_us.unwrap_or_default() * (1.0 - (-flown_s / WARM_UP_S).exp());
        if let Some((pack, resting_v)) = pack.zip(raw.resting_v) {
            let (referred, per_exponent) = pack.refer(pulse_us, resting_v);
            pulse_us = referred;
            doubts_us[BATTERY] = per_exponent;
            doubts_us[DRIFT] = warm;
        } else {
            let level = (pulse_us - NO_THRUST_US) * self.unknown_share;
            let drift = UNKNOWN_VOLTAGE_US * flown_s / 60.0;
            doubts_us[DRIFT] = warm.hypot(drift).hypot(level);
        }
        Referred { velocity_mps, pulse_us, doubts_us, steeper }.in_units_of(self.per_us())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOPE: f64 = 26.0;

    fn flown() -> Raw {
        Raw {
            time_s: 0.0,
            pulse_us: 1540.0,
            velocity_mps: 0.1,
            climb_mps: 0.1,
            lean_deg: 4.0,
            height_m: 0.0,
            resting_v: None,
        }
    }

    #[test]
    fn wind_that_is_known_is_taken_away_and_doubted() {
        let leaning = Leaning { thrust_exponent: 1.0, drag_speed_mps: 38.0 };
        let corrections = Corrections { leaning: Some(leaning), ..Corrections::default() };
        let referred = corrections.refer(&flown(), None, SLOPE);
        let tan = 4_f64.to_radians().tan();
        let axial_mps = 38.0 * tan.sqrt() * tan;
        let level_us = 1000.0 + 540.0 / 4_f64.to_radians().cos();
        assert!((referred.velocity_mps - (0.1 + axial_mps)).abs() < 1e-9);
        assert!((referred.pulse_us - level_us).abs() < 1e-9);
        let doubt_us = SLOPE * axial_mps + level_us - 1540.0;
        assert!((referred.doubts_us[WIND] - doubt_us).abs() < 1e-9);
        assert_eq!(corrections.sigmas(None)[WIND], WIND_SHARE);
    }

    #[test]
    fn wind_that_is_not_known_is_left_in_and_doubted_by_all_that_it_may_do() {
        let corrections = Corrections::default();
        let referred = corrections.refer(&flown(), None, SLOPE);
        assert_eq!((referred.velocity_mps, referred.pulse_us), (0.1, 1540.0));
        let doubt_us = 1.5 * 16.0 + 300.0 * (1.0 - 4_f64.to_radians().cos());
        assert!((referred.doubts_us[WIND] - doubt_us).abs() < 1e-9);
        assert_eq!(corrections.sigmas(None)[WIND], UNKNOWN_WIND_SHARE);
        let level = Raw { lean_deg: 0.0, ..flown() };
        assert_eq!(corrections.refer(&level, None, SLOPE).doubts_us[WIND], 0.0);
    }

    #[test]
    fn the_doubt_of_the_density_is_by_what_is_known_of_the_thrust_curve() {
        let density = |exponent| {
            Some(Density { ground_amsl_m: 190.0, exponent, indicator: Indicator::Pulse })
        };
        let sigma =
            |density| Corrections { density, ..Corrections::default() }.sigmas(None)[DENSITY];
        assert_eq!(sigma(density(1.0)), 0.0, "by definition");
        assert_eq!(sigma(density(0.4)), DENSITY_EXPONENT);
        assert_eq!(sigma(None), UNKNOWN_DENSITY_EXPONENT);
        let corrections = Corrections { density: density(0.4), ..Corrections::default() };
        let high = corrections.refer(&Raw { height_m: 100.0, ..flown() }, None, SLOPE);
        let log_density = density(0.4).unwrap().log_ratio(100.0);
        assert!(log_density < 0.0);
        assert!((high.pulse_us - (1000.0 + 540.0 * (0.4 * log_density).exp())).abs() < 1e-9);
        assert!((high.doubts_us[DENSITY] - (high.pulse_us - 1000.0) * log_density).abs() < 1e-9);
    }

    #[test]
    fn a_pulse_alone_is_that_which_everything_known_was_taken_from() {
        let leaning = Leaning { thrust_exponent: 1.0, drag_speed_mps: 38.0 };
        let table = LeanTable {
            lean_step_deg: 5.0,
            climb_step_mps: 1.0,
            change_us: vec![vec![0.0; 2], vec![-10.0, -8.0]],
            ..LeanTable::default()
        };
        let density = Density { ground_amsl_m: 190.0, exponent: 0.4, indicator: Indicator::Pulse };
        let raw = Raw { time_s: 200.0, height_m: 60.0, ..flown() };
        for (leaning, lean_table) in [(Some(leaning), None), (None, Some(&table)), (None, None)] {
            for (density, unit) in [(None, None), (Some(density), None), (Some(density), Some(2.5))]
            {
                let corrections =
                    Corrections { density, leaning, lean_table, unit, ..Corrections::default() };
                let referred = corrections.refer(&raw, None, SLOPE);
                assert_eq!(corrections.pulse(&raw, None), referred.pulse_us);
            }
        }
    }

    #[test]
    fn drift_is_doubted_where_a_battery_acts_and_more_without_its_voltage() {
        let late = Raw { time_s: 600.0, ..flown() };
        let corrections = Corrections { warm_up_us: Some(3.0), ..Corrections::default() };
        assert_eq!(corrections.sigmas(None)[DRIFT], 1.0);
        assert_eq!(Corrections::default().sigmas(None)[DRIFT], 0.0);
        let doubt_us = corrections.refer(&late, None, SLOPE).doubts_us[DRIFT];
        // Ten minutes of 3 us each, and motors that are warm.
        assert!((doubt_us - 30_f64.hypot(3.0 * (1.0 - (-6_f64).exp()))).abs() < 1e-9, "{doubt_us}");
    }
}
