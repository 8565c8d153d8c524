//! Battery voltage: what a fall of it does to the pulse, taken away with what the log says.
//!
//! A motor controller passes on a share of the battery's voltage, so that the same thrust needs
//! `u - 1000` in proportion to `1/V`. A full and a half empty pack differ by ten percent, which reads
//! as two metres per second. ArduCopter's own compensation raises the pulse before it is logged: it
//! hides nothing of this.
//!
//! The voltage at the terminals falls with the current, and the current rises with the pulse: taking
//! it as the cause of the pulse would be circular. Pulses are therefore referred to the voltage that
//! the pack would have at rest less the drop of one constant power (that of the drone's hovers in its
//! calibration). What remains, the drop by more or less power than that, belongs to the slope of the
//! law.

use super::budget::{BatteryCorrection, Supply};
use super::stats::mean_sd;
use super::window::WindowStats;
use crate::flight::{Flight, Series};
use crate::numeric::mean;

/// Pulse at which the rotors make no thrust, us.
const NO_THRUST_US: f64 = 1000.0;
/// Samples of the voltage are not joined over longer silences than this, s. Chosen.
const GAP_S: f64 = 5.0;
/// The voltage falls slowly: values are means over this time to each side, s.
const SMOOTH_S: f64 = 10.0;
/// Least loaded voltage as a share of that at rest: below it the resistance in the log is wrong. Chosen.
const LEAST: f64 = 0.5;
/// A pack that falls below this share of its calibration's voltage is nearly empty: 3.4 V of a cell that had
/// 3.85. Chosen.
pub(super) const LOW_SHARE: f64 = 0.88;
/// Least difference between the packs of a fleet, as a share of the voltage: they are not charged alike. One
/// per cent, 5.5 us on a show drone (docs/physics.md, 5.4). Chosen.
const LEAST_UNKNOWN: f64 = 0.01;

/// What warming does to the pulse: standard error, us. Magnets lose a little flux (-10 to -20 us), windings
/// gain resistance (+4 us); how much of it a flight still sees depends on how warm the motors take off.
/// Chosen between.
const WARM_UP_US: f64 = 3.0;

/// Effect of a fall of voltage on the pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sag {
    /// Power of the voltage, negated, with which `u - 1000` goes.
    pub exponent: f64,
    /// Standard error of the exponent, common to the fleet.
    pub exponent_se: f64,
    /// Standard error of the pulse by motors that warm up, us.
    pub warm_up_us: f64,
}

impl Sag {
    /// No correction: all that the voltage may have done is error.
    pub const UNCORRECTED: Self = Self { exponent: 0.0, exponent_se: 1.0, warm_up_us: WARM_UP_US };
    /// Correction for logs of an unknown vehicle, which may be simulated with a battery that acts
    /// on nothing.
    pub const UNKNOWN: Self = Self { exponent: 0.5, exponent_se: 0.5, warm_up_us: WARM_UP_US };
    /// Correction for ArduPilot's own simulator, whose motors stay as they are.
    pub const SIMULATOR: Self = Self { exponent: 1.0, exponent_se: 0.05, warm_up_us: 0.0 };
}

impl Default for Sag {
    /// A controller that passes on a share of the voltage.
    fn default() -> Self {
        Self { exponent: 1.0, exponent_se: 0.05, warm_up_us: WARM_UP_US }
    }
}

/// The battery between two times; `None` where its voltage at rest cannot be told.
pub(super) fn supply(flight: &Flight, start_s: f64, end_s: f64) -> Option<Supply> {
    let mean = |series: &Series| {
        let values = series.between(start_s, end_s);
        (!values.is_empty()).then(|| mean_sd(values).0)
    };
    let resting_v = mean(&resting(flight)?)?;
    let power_w = match (&flight.voltage_v, &flight.current_a) {
        (Some(volts), Some(amps)) => mean(volts).zip(mean(amps)).map_or(0.0, |(v, i)| v * i),
        _ => 0.0,
    };
    Some(Supply { resting_v, power_w, resistance_ohm: flight.resistance_ohm.unwrap_or(0.0) })
}

/// Voltage at rest over a flight: as logged, else `V + R I`.
fn resting(flight: &Flight) -> Option<Series> {
    if let Some(resting) = &flight.resting_v {
        return Some(resting.clone());
    }
    let (volts, amps) = (flight.voltage_v.as_ref()?, flight.current_a.as_ref()?);
    let ohm = flight.resistance_ohm?;
    let (time_s, value) = volts
        .time_s
        .iter()
        .zip(&volts.value)
        .filter_map(|(time, volts)| Some((*time, volts + ohm * amps.at(*time, GAP_S)?)))
        .unzip();
    Some(Series { time_s, value })
}

/// Voltage of a pack that gives `power_w`, V.
fn loaded_v(resting_v: f64, resistance_ohm: f64, power_w: f64) -> f64 {
    let root = resting_v * resting_v - 4.0 * resistance_ohm * power_w;
    f64::midpoint(resting_v, root.max(0.0).sqrt()).max(LEAST * resting_v)
}

/// One drone's pack under the constant power of its calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pack {
    power_w: f64,
    resistance_ohm: f64,
    pub(super) correction: BatteryCorrection,
}

impl Pack {
    /// The correction for the drone of these calibration windows; `None` where voltages are missing.
    pub(super) fn of(supplies: &[Supply], correction: BatteryCorrection) -> Option<Self> {
        Some(Self {
            power_w: mean(supplies.iter().map(|supply| supply.power_w))?,
            resistance_ohm: mean(supplies.iter().map(|supply| supply.resistance_ohm))?,
            correction,
        })
    }

    /// Voltage that the motors see, V.
    pub(super) fn volts(&self, resting_v: f64) -> f64 {
        loaded_v(resting_v, self.resistance_ohm, self.power_w)
    }

    /// A pulse referred to the reference voltage, us, and how it would change per unit of the
    /// exponent.
    pub(super) fn refer(&self, pulse_us: f64, resting_v: f64) -> (f64, f64) {
        let fall = (self.volts(resting_v) / self.correction.reference_v).ln();
        let excess = (pulse_us - NO_THRUST_US) * (fall * self.correction.exponent).exp();
        (NO_THRUST_US + excess, excess * fall)
    }
}

/// Voltage at rest over a hover, smoothed: it falls slowly, and its estimate is noisy.
pub(super) struct Slow(Series);

impl Slow {
    pub(super) fn of(flight: &Flight) -> Option<Self> {
        resting(flight).filter(|series| !series.is_empty()).map(Self)
    }

    /// Mean around a time, V; at the ends of the log, of what there is.
    pub(super) fn at(&self, time_s: f64) -> Option<f64> {
        let values = self.0.between(time_s - SMOOTH_S, time_s + SMOOTH_S);
        (!values.is_empty()).then(|| mean_sd(values).0)
    }
}

/// The supplies in a drone's usable hovers, else in all of its windows.
pub(super) fn of_hovers(windows: &[WindowStats]) -> Vec<Supply> {
    let hovers: Vec<Supply> =
        windows.iter().filter(|w| w.kind.is_hover()).filter_map(|w| w.supply).collect();
    if hovers.is_empty() { windows.iter().filter_map(|w| w.supply).collect() } else { hovers }
}

/// The correction that the voltages of a calibration's drones (windows of each) give: referred to the mean of the fleet's hovers.
pub(super) fn correction<'a>(
    drones: impl Iterator<Item = &'a [WindowStats]>,
    sag: Sag,
) -> Option<BatteryCorrection> {
    let reference = BatteryCorrection {
        reference_v: 1.0,
        exponent: sag.exponent,
        exponent_se: sag.exponent_se,
    };
    let volts: Vec<f64> = drones
        .flat_map(|windows| {
            let supplies = of_hovers(windows);
            let pack = Pack::of(&supplies, reference);
            supplies.into_iter().filter_map(move |s| Some(pack?.volts(s.resting_v)))
        })
        .collect();
    (!volts.is_empty()).then(|| BatteryCorrection { reference_v: mean_sd(&volts).0, ..reference })
}

/// Share of `u - 1000` that a pack of unknown voltage may have changed against the reference voltage:
/// a standard error. Nothing is known of it but that it is one of the fleet's, anywhere between the
/// fullest and the emptiest that the calibration saw; the error is the farther of these two from the
/// reference, and never less than [`LEAST_UNKNOWN`].
pub(super) fn unknown_share<'a>(
    drones: impl Iterator<Item = &'a [WindowStats]>,
    correction: BatteryCorrection,
) -> f64 {
    let farthest = drones
        .flat_map(|windows| {
            let pack = Pack::of(&of_hovers(windows), correction);
            let supplies = windows.iter().filter_map(|window| window.supply);
            supplies.filter_map(move |supply| Some(pack?.volts(supply.resting_v)))
        })
        .map(|volts| (volts / correction.reference_v).ln().abs())
        .filter(|fall| fall.is_finite())
        .fold(LEAST_UNKNOWN, f64::max);
    farthest * correction.exponent.hypot(correction.exponent_se)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_of_one_thrust_become_equal_at_all_charges() {
        // 60 W through 0.05 ohm; the controller passes on a share of what is left at the terminals.
        let supply = |resting_v| Supply { resting_v, power_w: 60.0, resistance_ohm: 0.05 };
        let correction = BatteryCorrection { reference_v: 7.7, exponent: 1.0, exponent_se: 0.05 };
        let pack = Pack::of(&[supply(8.2), supply(7.6)], correction).unwrap();
        for resting_v in [8.3, 7.9, 7.4] {
            let volts = pack.volts(resting_v);
            assert!((volts + 0.05 * 60.0 / volts - resting_v).abs() < 1e-9, "{volts}");
            let pulse_us = 1000.0 + 540.0 * 7.7 / volts;
            let (referred, per_exponent) = pack.refer(pulse_us, resting_v);
            assert!((referred - 1540.0).abs() < 1e-9, "{referred}");
            assert!((per_exponent - 540.0 * (volts / 7.7).ln()).abs() < 1e-9);
        }
    }

    #[test]
    fn without_a_logged_rest_voltage_the_drop_is_added() {
        let flat = |value: f64| {
            Some(Series { time_s: (0..30).map(f64::from).collect(), value: vec![value; 30] })
        };
        let mut flight = Flight { voltage_v: flat(7.5), current_a: flat(8.0), ..Flight::default() };
        assert_eq!(supply(&flight, 0.0, 10.0), None, "the drop is not known");
        flight.resistance_ohm = Some(0.05);
        let found = supply(&flight, 0.0, 10.0).unwrap();
        assert!((found.resting_v - 7.9).abs() < 1e-12 && found.power_w == 60.0);
        flight.resting_v = flat(8.0);
        assert_eq!(supply(&flight, 0.0, 10.0).unwrap().resting_v, 8.0);
    }
}
