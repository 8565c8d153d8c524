//! How the pulse follows the battery's voltage, told by the power that the drones took.
//!
//! Air that rises or sinks changes what the rotors must do, and with it pulse and electrical power alike; what the pulse
//! needs besides to make up for a lower voltage changes the pulse alone. So where voltage and current are logged, pulses
//! at the same power tell the exponent of the voltage, whatever the air does:
//!
//! `ln(u - 1000) = a_drone + h(ln P, climb, lean, height) - gamma ln V`
//!
//! by least squares, each drone with its own constant. The pulse against the voltage alone knows the air no better than
//! all else does, and a drone that was long in sinking air has the emptier battery besides.

use nalgebra::{DMatrix, DVector};

use super::bins::BinValues;
use super::data::Data;
use super::steady::IDLE_US;
use crate::numeric::mean;

/// Fewest drones whose scatter tells an error. Chosen.
const FEWEST_DRONES: usize = 4;
/// Least scatter of the logarithm of the pulse around the fit: pulses that follow the power more closely are what the
/// power was computed from. Chosen: a sixth of what a flight in calm air leaves.
const LEAST_SCATTER: f64 = 3e-4;
/// Range of exponents of the power that a motor's pulse may have: between the cube root (a torque that goes with the
/// square of the speed against no resistance) and the power itself, widened. Chosen.
const POWER_EXPONENTS: [f64; 2] = [0.15, 1.2];
/// What the form is not known by, as a share of the exponent: measured on foreign flights, which were 0.2 to 2 % off.
const FORM_SHARE: f64 = 0.02;
/// An exponent that is known no better than this is not told. Chosen: what a ladder's pulses tell themselves.
const WORST_SE: f64 = 0.1;
/// Most that the other regressors may inflate the variance of the exponent: a voltage that falls with the flight's time
/// alike on all drones is no voltage beside a trend, and what the form lacks would be taken for it. Chosen.
const MOST_INFLATION: f64 = 30.0;
/// Fits with and without a trend of the flight's time that differ by more standard errors than this see something else
/// that drifts, and what the trend leaves is believed. Chosen.
const OTHER_DRIFT: f64 = 3.0;

/// Exponent of the voltage in the pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Told {
    /// The exponent: 0 where something compensates the voltage, 1 where nothing does.
    pub exponent: f64,
    /// Standard error of the exponent, of the scatter between drones and of the form.
    pub se: f64,
}

/// Voltage and power of one drone's bin, and what else its pulse goes with.
struct Row {
    drone: usize,
    pulse: f64,
    volts: f64,
    power: f64,
    with: Vec<f64>,
    time_s: f64,
}

/// Exponent of the voltage in the pulse; `None`: the logs lack the voltage, the current or a reason to believe them.
/// `drifts`: something else is known to change the pulse with time.
pub(super) fn told(data: &Data, drifts: bool) -> Option<Told> {
    let rows = rows(data);
    let drones = rows.last()?.drone + 1;
    if drones < FEWEST_DRONES {
        return None;
    }
    let (plain, trended) = (fitted(&rows, drones, false), fitted(&rows, drones, true));
    let is_sure = |told: &Told| told.se < WORST_SE;
    let (plain, trended) = (plain.filter(is_sure), trended.filter(is_sure));
    let differ = plain.zip(trended).is_some_and(|(plain, trended)| {
        (plain.exponent - trended.exponent).abs() > OTHER_DRIFT * trended.se
    });
    if drifts || differ { trended } else { plain }
}

fn rows(data: &Data) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut drone = 0;
    for group in &data.groups {
        for values in &group.measured {
            let before = rows.len();
            let each = group.bins.iter().zip(values);
            rows.extend(each.filter_map(|(bin, values)| row(drone, bin.middle_s(), values)));
            drone += usize::from(rows.len() > before);
        }
    }
    rows
}

fn row(drone: usize, time_s: f64, values: &BinValues) -> Option<Row> {
    let BinValues { pulse_us, climb_mps, height_m, lean_rad, loaded_v, power_w, .. } = *values;
    let has = |value: f64| value.is_finite() && value > 0.0;
    (has(loaded_v) && has(power_w) && pulse_us > IDLE_US).then(|| Row {
        drone,
        pulse: (pulse_us - IDLE_US).ln(),
        volts: loaded_v.ln(),
        power: power_w.ln(),
        with: vec![
            climb_mps,
            climb_mps.powi(2),
            climb_mps.powi(3),
            lean_rad[0].powi(2) + lean_rad[1].powi(2),
            height_m,
        ],
        time_s,
    })
}

/// Least squares with a constant for each drone, whose errors are those of whole drones.
fn fitted(rows: &[Row], drones: usize, with_trend: bool) -> Option<Told> {
    let (power, time_s) =
        (mean(rows.iter().map(|row| row.power))?, mean(rows.iter().map(|row| row.time_s))?);
    let regressors = |row: &Row| {
        let (power, hours) = (row.power - power, (row.time_s - time_s) / 3600.0);
        let mut all = vec![row.volts, power, power * power];
        all.extend(&row.with);
        if with_trend {
            all.extend([hours, hours * hours]);
        }
        all
    };
    let mut within: Vec<(usize, f64, DVector<f64>)> =
        rows.iter().map(|row| (row.drone, row.pulse, DVector::from_vec(regressors(row)))).collect();
    let width = within.first()?.2.len();
    let mut means = vec![(0.0, 0.0, DVector::zeros(width)); drones];
    for (drone, pulse, regressors) in &within {
        let (count, pulses, sums) = &mut means[*drone];
        *count += 1.0;
        *pulses += pulse;
        *sums += regressors;
    }
    for (drone, pulse, regressors) in &mut within {
        let (count, pulses, sums) = &means[*drone];
        *pulse -= pulses / count;
        *regressors -= sums / *count;
    }
    let mut normal = DMatrix::zeros(width, width);
    let mut right = DVector::zeros(width);
    for (_, pulse, regressors) in &within {
        normal.ger(1.0, regressors, regressors, 1.0);
        right.axpy(*pulse, regressors, 1.0);
    }
    // What never changed in the flight tells nothing.
    let scale = normal.diagonal().map(|square| square.max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_fn(width, width, |row, column| {
        normal[(row, column)] * scale[row] * scale[column]
    });
    let inverse = scaled.pseudo_inverse(SAME).ok()?;
    if inverse[(0, 0)] > MOST_INFLATION {
        return None;
    }
    let inverse = DMatrix::from_fn(width, width, |row, column| {
        inverse[(row, column)] * scale[row] * scale[column]
    });
    let beta = &inverse * right;
    let mut scores = vec![DVector::zeros(width); drones];
    let mut squares = 0.0;
    for (drone, pulse, regressors) in &within {
        let left = pulse - regressors.dot(&beta);
        squares += left * left;
        scores[*drone].axpy(left, regressors, 1.0);
    }
    let scatter = (squares / within.len() as f64).sqrt();
    let [low, high] = POWER_EXPONENTS;
    if scatter < LEAST_SCATTER || !(low..high).contains(&beta[1]) {
        return None;
    }
    let first = inverse.row(0).transpose();
    let variance: f64 = scores.iter().map(|score| score.dot(&first).powi(2)).sum();
    let count = drones as f64;
    let exponent = -beta[0];
    let se = (variance * count / (count - 1.0)).sqrt().hypot(FORM_SHARE * exponent);
    (exponent.is_finite() && se.is_finite()).then_some(Told { exponent, se })
}

/// Directions of the regressors in which a flight has less of its variance than this are none. Numerical.
const SAME: f64 = 1e-9;

#[cfg(test)]
pub(super) mod tests {
    use super::super::trial;
    use super::*;

    /// Drones of different charge in air that wanders: the rotors' effort goes with it and with the climb, the power with
    /// a power of the effort.
    pub(in crate::gap) fn flown(
        exponent: f64,
        drift: f64,
        spread: f64,
        power: impl Fn(f64, f64) -> f64,
    ) -> Data {
        let mut data = trial::data(8, |_, _| 0.0);
        for group in &mut data.groups {
            let all_s = group.bins.last().unwrap().middle_s();
            for (drone, values) in group.measured.iter_mut().enumerate() {
                for (index, (bin, values)) in group.bins.iter().zip(values).enumerate() {
                    let (time_s, own) = (bin.middle_s(), drone as f64);
                    // A shuffled ladder: time does not go with the climb.
                    values.climb_mps = (7 * index % 10) as f64 / 2.0 - 2.0;
                    let air = 0.03 * (time_s / 5.0).sin() + 0.02 * (time_s / 3.0 + own).sin();
                    // The current is measured with an error of 1 in 1,000.
                    let noise = 1e-3 * (1.7 * time_s + 3.1 * own).sin();
                    let effort = 0.55 * (1.0 + 0.05 * values.climb_mps + air);
                    // The emptier, the faster the voltage falls.
                    values.loaded_v = 11.8 - 0.06 * own - (0.6 + spread * own) * time_s / all_s;
                    let command = effort * (1.0 + 0.01 * own) + drift * time_s / all_s;
                    let ratio = values.loaded_v / 11.1;
                    values.pulse_us = 1000.0 + 1000.0 * command / ratio.powf(exponent);
                    let pulse = values.pulse_us - 1000.0;
                    values.power_w = power(effort, pulse) * (1.0 + noise);
                }
            }
        }
        data
    }

    pub(in crate::gap) fn motors(effort: f64, _: f64) -> f64 {
        200.0 * effort.powf(1.6)
    }

    #[test]
    fn the_exponent_is_told_whatever_the_air_does() {
        for exponent in [0.0, 0.4, 0.85, -0.3] {
            let found = told(&flown(exponent, 0.0, 0.1, motors), false).unwrap();
            assert!((found.exponent - exponent).abs() < 0.01, "{found:?} for {exponent}");
            assert!(found.se < 0.03, "{found:?}");
        }
    }

    #[test]
    fn something_else_that_drifts_is_not_taken_for_the_voltage() {
        let data = flown(0.5, 0.02, 0.1, motors);
        for drifts in [false, true] {
            let found = told(&data, drifts).unwrap();
            assert!((found.exponent - 0.5).abs() < 0.03, "{found:?}");
        }
        let rows = rows(&data);
        let plain = fitted(&rows, 8, false).unwrap();
        assert!((plain.exponent - 0.5).abs() > 0.2, "it would have been: {plain:?}");
        // Where all voltages fall alike, they cannot be told from it.
        assert_eq!(told(&flown(0.5, 0.02, 0.0, motors), true), None);
    }

    #[test]
    fn a_power_that_was_computed_from_the_pulse_tells_nothing() {
        let mut data = flown(0.85, 0.0, 0.1, motors);
        for values in data.groups.iter_mut().flat_map(|group| group.measured.iter_mut().flatten()) {
            let amps = 1e-3 * (values.pulse_us - 1000.0).powf(1.5);
            values.power_w = amps * values.loaded_v;
        }
        assert_eq!(told(&data, false), None);
        for values in data.groups.iter_mut().flat_map(|group| group.measured.iter_mut().flatten()) {
            values.power_w = f64::NAN;
        }
        assert_eq!(told(&data, false), None);
        assert_eq!(told(&Data::default(), false), None);
    }
}
