//! The drones' deviations from the fleet: their own constants, slopes and bends, and the air that
//! each met alone.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::air_prior::{Record, grid, quantile, weigh};
use super::corrections::DOUBTS;
use super::shape::{PARAMETERS, Shape};
use super::split::{LEAST_NOISE_US, Parts, Point, Split, rough_sensitivity};

/// Time scales of local air that are tried, s: gusts to minutes. A grid.
const TAUS_S: [f64; 4] = [10.0, 40.0, 120.0, 360.0];
/// White scatter that is tried, us. A grid.
const WHITES_US: [f64; 4] = [0.1, 0.4, 1.5, 6.0];
/// Most drones that the scales of local air are estimated from. Chosen for time.
const SCALE_DRONES: usize = 25;
/// Spread of both bends between the drones of a fleet, us/(m/s)²: a fifth of the fleet's own
/// (docs/physics.md, 2.3). Chosen.
const OWN_BEND_SD: f64 = 0.2;
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

/// The drones' deviations from the fleet, with the air that each met alone.
pub(super) fn local_air(
    shape: Shape,
    points: &[Point],
    split: &Split,
    pulses: &[f64],
    parts: &Parts,
    doubts: &[Parts],
    rough: f64,
) -> Local {
    let mut of_drone: Vec<Vec<usize>> = vec![Vec::new(); split.drones];
    points.iter().enumerate().for_each(|(index, point)| of_drone[point.drone].push(index));
    let flown = of_drone.iter().filter(|own| !own.is_empty()).count();
    if flown < 2 {
        let none = || Own {
            value: Vector4::zeros(),
            covariance: Matrix4::zeros(),
            answers: [[0.0; PARAMETERS]; DOUBTS],
        };
        return Local {
            drones: of_drone.iter().map(|own| (!own.is_empty()).then(none)).collect(),
            spread: Matrix4::zeros(),
            sd_mps: 0.0,
        };
    }
    // Averages were taken from the same points: deviations are too small by this.
    let grow = (flown as f64 / (flown as f64 - 1.0)).sqrt();
    let p = shape.parameters();
    // A drone's bends differ little from the fleet's; its constant and slope are free.
    let priors: &[usize] = if p > 2 { &[2, 3] } else { &[] };
    let record = |own: &[usize]| {
        let (n, rows) = (own.len(), own.len() + priors.len());
        let padded = |value: &dyn Fn(&Point) -> f64| -> Vec<f64> {
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
    };
    let records: Vec<Option<Record>> =
        of_drone.iter().map(|own| (own.len() > 2).then(|| record(own))).collect();
    // A few dozen drones tell the scales as well as a thousand.
    let step = records.len().div_ceil(SCALE_DRONES).max(1);
    let weighed = weigh(&grid(10, &TAUS_S, &WHITES_US), |air| {
        let mut sum = 0.0;
        for record in records.iter().step_by(step).flatten() {
            sum += record.fit(air)?.log_likelihood;
        }
        Some((sum, ()))
    });
    let drones: Vec<Option<Own>> = of_drone
        .iter()
        .zip(&records)
        .map(|(own, record)| {
            let record = record.as_ref()?;
            let mut gain = DMatrix::zeros(p, record.pulse_us.len());
            let mut covariance = Matrix4::zeros();
            for one in &weighed {
                let fit = record.fit(&one.air)?;
                gain += &fit.gain * one.weight;
                for (row, column) in (0..p).flat_map(|row| (0..p).map(move |column| (row, column)))
                {
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
                apply(&DVector::from_fn(record.pulse_us.len(), |row, _| {
                    own.get(row).map_or(0.0, rest)
                }))
                .into()
            });
            Some(Own { value: apply(&record.pulse_us) / grow, covariance, answers })
        })
        .collect();
    let known: Vec<Vector4<f64>> = drones.iter().flatten().map(|own| own.value).collect();
    let n = known.len() as f64;
    let mut spread = Matrix4::zeros();
    for value in &known {
        spread += value * value.transpose() / (n - 1.0).max(1.0);
    }
    spread *= 1.0 + 1.0 / n.max(1.0);
    Local { drones, spread, sd_mps: quantile(&weighed, 0.5, |one| one.air.sd_mps) }
}
