//! Deviations of the drones from the fleet: their own constants, slopes and bends, and the air that
//! each met alone.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::air_prior::{Record, Weighed, grid, quantile, weigh};
use super::corrections::DOUBTS;
use super::shape::{PARAMETERS, Shape};
use super::split::{LEAST_NOISE_US, Parts, Split, WindowPoint, rough_sensitivity};

/// Time scales of local air that are tried, s: gusts to minutes. A grid.
const TAUS_S: [f64; 4] = [10.0, 40.0, 120.0, 360.0];
/// White scatter that is tried, us. A grid.
const WHITES_US: [f64; 4] = [0.1, 0.4, 1.5, 6.0];
/// Most drones that the scales of local air are estimated from. Chosen for time.
const SCALE_DRONES: usize = 25;
/// Spread of both bends between the drones of a fleet, us/(m/s)²: a fifth of the fleet's own
/// (docs/physics.md, 2.3). Chosen.
const OWN_BEND_SD: f64 = 0.2;
/// Spread of the drones' constants, us: that of the nine in the paper's Table II.
const CONSTANT_SD_US: f64 = 7.8;
/// Spread of their slopes as a share of them, likewise.
const SLOPE_SHARE_SD: f64 = 0.1;

/// One drone's own part of the parameters.
pub(super) struct Own {
    pub(super) value: Vector4<f64>,
    pub(super) covariance: Matrix4<f64>,
    pub(super) answers: [[f64; PARAMETERS]; DOUBTS],
}

pub(super) struct Local {
    pub(super) drones: Vec<Option<Own>>,
    pub(super) spread: Matrix4<f64>,
    pub(super) sd_mps: f64,
}

/// The windows of a fleet with their averages over drones taken out.
pub(super) struct Deviations<'a> {
    pub(super) shape: Shape,
    pub(super) points: &'a [WindowPoint],
    pub(super) split: &'a Split,
    /// Pulses at the mean speed of their cells, us.
    pub(super) pulses: &'a [f64],
    pub(super) parts: &'a Parts,
    pub(super) doubts: &'a [Parts],
    /// Slope of an unweighted line through the points.
    pub(super) rough: f64,
}

/// The drones' deviations from the fleet, with the air that each met alone.
pub(super) fn local_air(of: &Deviations<'_>) -> Local {
    let mut of_drone: Vec<Vec<usize>> = vec![Vec::new(); of.split.drones];
    of.points.iter().enumerate().for_each(|(index, point)| of_drone[point.drone].push(index));
    let flown = of_drone.iter().filter(|own| !own.is_empty()).count();
    if flown < 2 {
        return undivided(&of_drone, of.rough);
    }
    // Averages were taken from the same points: deviations are too small by this.
    let grow = (flown as f64 / (flown as f64 - 1.0)).sqrt();
    let records: Vec<Option<Record>> =
        of_drone.iter().map(|own| (own.len() > 2).then(|| of.record(own, grow))).collect();
    let weighed = scales(&records);
    let drones: Vec<Option<Own>> = of_drone
        .iter()
        .zip(&records)
        .map(|(own, record)| of.own(own, record.as_ref()?, &weighed, grow))
        .collect();
    let spread = spread(&drones, of.rough);
    Local { drones, spread, sd_mps: quantile(&weighed, 0.5, |one| one.air.sd_mps) }
}

/// A single drone is the fleet: it has no deviation.
fn undivided(of_drone: &[Vec<usize>], rough: f64) -> Local {
    let none = || Own {
        value: Vector4::zeros(),
        covariance: Matrix4::zeros(),
        answers: [[0.0; PARAMETERS]; DOUBTS],
    };
    let drones: Vec<Option<Own>> =
        of_drone.iter().map(|own| (!own.is_empty()).then(none)).collect();
    Local { spread: spread(&drones, rough), drones, sd_mps: 0.0 }
}

/// Weighs the scales of local air. A few dozen drones tell them as well as a thousand.
fn scales(records: &[Option<Record>]) -> Vec<Weighed<()>> {
    let step = records.len().div_ceil(SCALE_DRONES).max(1);
    weigh(&grid(10, &TAUS_S, &WHITES_US), |air| {
        let mut sum = 0.0;
        for record in records.iter().step_by(step).flatten() {
            sum += record.fit(air)?.log_likelihood;
        }
        Some((sum, ()))
    })
}

/// Covariance of the deviation of a drone that is not known, from those that are, and from what drones of one make differ by:
/// of one that is known nothing else tells it, of many it hardly counts.
fn spread(drones: &[Option<Own>], rough: f64) -> Matrix4<f64> {
    let known: Vec<Vector4<f64>> = drones.iter().flatten().map(|own| own.value).collect();
    let n = known.len().max(1) as f64;
    let usual = [CONSTANT_SD_US, SLOPE_SHARE_SD * rough, OWN_BEND_SD, OWN_BEND_SD];
    let mut spread = Matrix4::from_diagonal(&Vector4::from(usual.map(|sd| sd * sd / n)));
    for value in &known {
        spread += value * value.transpose();
    }
    // The usual spread weighs as one n-th of a degree of freedom: with 21 drones known, a whole one would still have doubled the
    // variance of slopes which differ by 2 %. The fleet's mean took one of the n.
    spread * ((1.0 + 1.0 / n) / (n - 1.0 + 1.0 / n))
}

impl Deviations<'_> {
    /// One drone's windows (by their indices) with the priors of its bends: they differ little from the
    /// fleet's; its constant and slope are free.
    fn record(&self, own: &[usize], grow: f64) -> Record {
        let Self { shape, points, split, pulses, parts, rough, .. } = *self;
        let p = shape.parameters();
        let priors: &[usize] = if p > 2 { &[2, 3] } else { &[] };
        let (n, rows) = (own.len(), own.len() + priors.len());
        let padded = |value: &dyn Fn(&WindowPoint) -> f64| -> Vec<f64> {
            let windows = own.iter().map(|index| value(&points[*index]));
            windows.chain(priors.iter().map(|_| 0.0)).collect()
        };
        let mut noise_us = padded(&|point| point.noise_us.max(LEAST_NOISE_US));
        noise_us[n..].fill(OWN_BEND_SD);
        Record {
            design: DMatrix::from_fn(rows, p, |row, column| match own.get(row) {
                Some(index) => shape.basis(points[*index].velocity_mps)[column],
                None => f64::from(u8::from(priors[row - n] == column)),
            }),
            pulse_us: DVector::from_fn(rows, |row, _| {
                let rest = |index: &usize| pulses[*index] - parts.cells[split.cell_of[*index]];
                own.get(row).map_or(0.0, |index| grow * rest(index))
            }),
            noise_us,
            sensitivity: padded(&|point| rough_sensitivity(shape, rough, point.velocity_mps)),
            time_s: padded(&|point| point.time_s),
            doubts_us: Vec::new(),
            windows: n,
        }
    }

    /// One drone's part of the parameters, averaged over the scales of the air; `None` where its windows
    /// do not give one.
    fn own(
        &self,
        own: &[usize],
        record: &Record,
        weighed: &[Weighed<()>],
        grow: f64,
    ) -> Option<Own> {
        let Self { shape, points, split, doubts, .. } = *self;
        let p = shape.parameters();
        let mut gain = DMatrix::zeros(p, record.pulse_us.len());
        let mut covariance = Matrix4::zeros();
        for one in weighed {
            let fit = record.fit(&one.air)?;
            gain += &fit.gain * one.weight;
            for (row, column) in (0..p).flat_map(|row| (0..p).map(move |column| (row, column))) {
                covariance[(row, column)] += fit.covariance[(row, column)] * one.weight;
            }
        }
        let apply = |values: &DVector<f64>| {
            let found = &gain * values;
            Vector4::from_fn(|row, _| found.get(row).copied().unwrap_or(0.0))
        };
        let answers = std::array::from_fn(|doubt| {
            let cells = &doubts[doubt].cells;
            let rest =
                |index: &usize| points[*index].doubts_us[doubt] - cells[split.cell_of[*index]];
            let column = |row: usize, _: usize| own.get(row).map_or(0.0, rest);
            apply(&DVector::from_fn(record.pulse_us.len(), column)).into()
        });
        Some(Own { value: apply(&record.pulse_us) / grow, covariance, answers })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_one_drone_the_spread_is_that_of_its_make_and_of_many_their_own() {
        let of = |values_us: &[f64]| {
            let own = |value_us: &f64| {
                Some(Own {
                    value: Vector4::new(*value_us, 0.0, 0.0, 0.0),
                    covariance: Matrix4::zeros(),
                    answers: [[0.0; PARAMETERS]; DOUBTS],
                })
            };
            let drones: Vec<Option<Own>> = values_us.iter().map(own).collect();
            spread(&drones, 26.0)[(0, 0)].sqrt()
        };
        let apart = std::f64::consts::SQRT_2 * CONSTANT_SD_US;
        assert!((of(&[0.0]) - apart).abs() < 1e-9, "one drone against another");
        let many: Vec<f64> =
            (0..400).map(|index| if index % 2 == 0 { 2.0 } else { -2.0 }).collect();
        assert!((of(&many) - 2.0).abs() < 0.05, "{}", of(&many));
        assert!(of(&[0.5, -0.5]) > 4.0, "two that are alike by chance");
    }
}
