//! The calibration law of the map: a fit that knows about slow air.
//!
//! The laws of the tables ([`super::calibrate`]) take the scatter of windows for independent. For the
//! map that is not enough: slow air that the whole fleet shared during a calibration moves the zero of
//! all drones together, and no number of drones helps. Here the windows of all drones (legs and
//! hovers) are fitted together:
//!
//! ```text
//! u_ik = law(V_ik) + a_i + b_i V_ik + S [W(t_k) + w_i(t_k)] + noise
//! ```
//!
//! with a law for the fleet, a constant and a slope for each drone, air `W` that the fleet shares and
//! air `w_i` that a drone meets alone ([`super::air_prior`]). The fit splits into the averages over
//! drones, which carry the shared air, and the drones' deviations from them. All errors are those of
//! a linear estimator, so that whatever else is doubted can be sent through the same estimator
//! ([`DroneLaw::answers`]).

use nalgebra::{DMatrix, DVector, Matrix4};

use crate::numeric::{extent, mean};

use super::air_prior::{Air, Gls, Record, Weighed, grid, quantile, weigh};
use super::budget::CalibrationAir;
use super::corrections::{BATTERY, DOUBTS, DRIFT};
use super::local::{Deviations, Own, local_air};
use super::shape::{PARAMETERS, Shape};
use super::split::{Cell, Parts, Split, WindowPoint, noise_us, rough_sensitivity, rough_slope};

/// Time scales of the air that are tried, s: from windows to beyond the flight (docs/errors.md). A grid.
const TAUS_S: [f64; 7] = [8.0, 20.0, 50.0, 100.0, 200.0, 400.0, 800.0];
/// White scatter that is tried, us. A grid.
const WHITES_US: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 8.0];

/// Prior standard deviation of the bend `V²`, us/(m/s)²: rotors have +0.5 to +1.5 (docs/physics.md, 2.3).
const BEND_SD: f64 = 1.5;
/// Prior standard deviation of the bend `V|V|` (drag), us/(m/s)²: bodies have 1.0 to 1.5 (docs/physics.md,
/// 2.4: 12 to 18 us at 3.5 m/s).
const DRAG_SD: f64 = 1.5;

/// The law of one drone.
#[derive(Clone, Debug)]
pub(super) struct DroneLaw {
    /// Parameters.
    pub(super) law: [f64; PARAMETERS],
    /// Covariance of the drone's own part of the parameters.
    pub(super) own: Matrix4<f64>,
    /// What the law's parameters answer to one unit of each doubt.
    pub(super) answers: [[f64; PARAMETERS]; DOUBTS],
}

/// Where and when an average over drones was flown.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellAt {
    /// Middle, show time, s.
    pub(super) time_s: f64,
    /// Length, s.
    pub(super) span_s: f64,
    /// Mean height above home, m.
    pub(super) height_m: f64,
    /// Vertical velocity, m/s, up positive.
    pub(super) climb_mps: f64,
    /// Drones in it.
    pub(super) drones: usize,
}

/// The averages over drones, for fits in other air.
#[derive(Clone, Debug)]
pub(super) struct Windows {
    pub(super) record: Record,
    pub(super) cells: Vec<CellAt>,
    /// Parameters of the fleet's law.
    pub(super) parameters: Vec<f64>,
}

/// The fit.
#[derive(Clone, Debug)]
pub(super) struct Zero {
    pub(super) shape: Shape,
    /// Covariance of the fleet's parameters, which all drones share.
    pub(super) common: DMatrix<f64>,
    /// The drones' laws, by index; `None` where a drone's windows do not give one.
    pub(super) drones: Vec<Option<DroneLaw>>,
    /// The law for drones without one, with the spread between drones in its own covariance.
    pub(super) flock: DroneLaw,
    pub(super) air: CalibrationAir,
    /// Half width of the 95 % interval of the zero over its standard error.
    pub(super) width: f64,
    /// Lowest and highest vertical speed of the windows, m/s.
    pub(super) speeds_mps: [f64; 2],
    /// What it was made of.
    pub(super) windows: Windows,
}

/// The windows of a fleet with one shape of law, and what they say about the air.
pub(super) struct Fleet<'a> {
    shape: Shape,
    points: &'a [WindowPoint],
    split: Split,
    /// Pulses at the mean speed of their cells, us.
    pulses: Vec<f64>,
    parts: Parts,
    doubts: Vec<Parts>,
    rough: f64,
    record: Record,
    weighed: Vec<Weighed<Gls>>,
}

impl<'a> Fleet<'a> {
    /// Weighs the scales of the air. `sigmas` are the standard errors of the doubts
    /// ([`WindowPoint::doubts_us`]). `None` if the windows do not determine a law.
    pub(super) fn new(
        points: &'a [WindowPoint],
        drones: usize,
        shape: Shape,
        sigmas: &[f64; DOUBTS],
    ) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        let split = Split::new(shape, points, drones);
        let rough = rough_slope(&split, points);
        // Members of a cell differ in speed by centimetres per second.
        let aligned = |(index, point): (usize, &WindowPoint)| {
            let cell = &split.cells[split.cell_of[index]];
            point.pulse_us - rough * (split.own[index] - shape.own(cell.velocity_mps))
        };
        let pulses: Vec<f64> = points.iter().enumerate().map(aligned).collect();
        let parts = split.of(points, &pulses);
        let doubts: Vec<Parts> = (0..DOUBTS)
            .map(|doubt| {
                let values: Vec<f64> = points.iter().map(|point| point.doubts_us[doubt]).collect();
                split.of(points, &values)
            })
            .collect();
        let record = fleet_record(shape, points, &split, &parts.cells, (&doubts, sigmas), rough);
        let weighed = weigh(&grid(13, &TAUS_S, &WHITES_US), |air| {
            let fit = record.fit(air)?;
            Some((fit.log_likelihood, fit))
        });
        (!weighed.is_empty()).then_some(Self {
            shape,
            points,
            split,
            pulses,
            parts,
            doubts,
            rough,
            record,
            weighed,
        })
    }

    /// Logarithm of the probability of the fleet's averages with this shape, but for a constant that
    /// all shapes have for the same windows.
    pub(super) fn evidence(&self) -> f64 {
        self.weighed.first().map_or(f64::NEG_INFINITY, |heaviest| {
            heaviest.fit.log_likelihood + heaviest.air.prior().ln() - heaviest.weight.ln()
        })
    }

    /// The laws of the fleet and of its drones.
    pub(super) fn laws(self) -> Zero {
        let Self { shape, points, split, pulses, parts, doubts, rough, record: fleet, weighed } =
            self;
        let p = shape.parameters();
        let mut gain = DMatrix::zeros(p, fleet.pulse_us.len());
        for one in &weighed {
            gain += &one.fit.gain * one.weight;
        }
        let parameters = &gain * &fleet.pulse_us;
        let mut common = DMatrix::zeros(p, p);
        for one in &weighed {
            let off = &one.fit.gain * &fleet.pulse_us - &parameters;
            common += (&one.fit.covariance + &off * off.transpose()) * one.weight;
        }
        let width = zero_width(&weighed, &fleet, &parameters, &common);

        let local = local_air(&Deviations {
            shape,
            points,
            split: &split,
            pulses: &pulses,
            parts: &parts,
            doubts: &doubts,
            rough,
        });
        let answer = |parts: &Parts| -> Vec<f64> {
            let mut column = DVector::zeros(fleet.pulse_us.len());
            column.rows_mut(0, parts.cells.len()).copy_from_slice(&parts.cells);
            (&gain * column).iter().copied().collect()
        };
        let answers_fleet: Vec<Vec<f64>> = doubts.iter().map(answer).collect();
        let whole = |values: &[f64]| {
            let mut all = [0.0; PARAMETERS];
            all.iter_mut().zip(values).for_each(|(all, value)| *all = *value);
            all
        };
        let fleet_law = whole(parameters.as_slice());
        let law_of = |own: &Own| {
            let mut law = fleet_law;
            law.iter_mut().zip(own.value.iter()).for_each(|(law, own)| *law += own);
            let mut answers = [[0.0; PARAMETERS]; DOUBTS];
            for (doubt, answer) in answers.iter_mut().enumerate() {
                *answer = whole(&answers_fleet[doubt]);
                answer.iter_mut().zip(own.answers[doubt]).for_each(|(all, own)| *all += own);
            }
            DroneLaw { law, own: own.covariance, answers }
        };
        let drones = local.drones.iter().map(|own| own.as_ref().map(law_of)).collect();
        let answers = std::array::from_fn(|doubt| whole(&answers_fleet[doubt]));
        let interval = |value: fn(&Air) -> f64| {
            [0.025, 0.975].map(|share| quantile(&weighed, share, |one| value(&one.air)))
        };
        let cell_at = |cell: &Cell| {
            let average = |of: fn(&WindowPoint) -> f64| {
                mean(cell.members.iter().map(|point| of(&points[*point]))).unwrap_or_default()
            };
            CellAt {
                time_s: cell.time_s,
                span_s: average(|point| point.span_s),
                height_m: average(|point| point.height_m),
                climb_mps: average(|point| point.velocity_mps),
                drones: cell.members.len(),
            }
        };
        let cells = split.cells.iter().map(cell_at).collect();
        let windows = Windows { record: fleet, cells, parameters: parameters.as_slice().to_vec() };
        let speeds = extent(points.iter().map(|point| point.velocity_mps));
        let (slowest, fastest) = speeds.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
        Zero {
            shape,
            common,
            drones,
            flock: DroneLaw { law: fleet_law, own: local.spread, answers },
            air: CalibrationAir {
                sd_mps: quantile(&weighed, 0.5, |one| one.air.sd_mps),
                sd_interval_mps: interval(|air| air.sd_mps),
                time_scale_s: quantile(&weighed, 0.5, |one| one.air.tau_s),
                time_scale_interval_s: interval(|air| air.tau_s),
                local_sd_mps: local.sd_mps,
            },
            width,
            speeds_mps: [slowest, fastest],
            windows,
        }
    }
}

/// The averages over drones with the priors of the bends.
fn fleet_record(
    shape: Shape,
    points: &[WindowPoint],
    split: &Split,
    means: &[f64],
    (doubts, sigmas): (&[Parts], &[f64; DOUBTS]),
    rough: f64,
) -> Record {
    let p = shape.parameters();
    let priors: &[(usize, f64)] = match shape {
        Shape::Line => &[(2, BEND_SD), (3, DRAG_SD)],
        Shape::SignedQuadratic => &[],
    };
    let n = means.len() + priors.len();
    let mut design = DMatrix::zeros(n, p);
    let mut pulse_us = DVector::zeros(n);
    let (mut noise, mut sensitivity) = (Vec::new(), Vec::new());
    let mut time_s = Vec::new();
    for (row, (cell, mean)) in split.cells.iter().zip(means).enumerate() {
        for (column, value) in shape.basis(cell.velocity_mps).into_iter().take(p).enumerate() {
            design[(row, column)] = value;
        }
        pulse_us[row] = *mean;
        noise.push(noise_us(points, &cell.members));
        sensitivity.push(rough_sensitivity(shape, rough, cell.velocity_mps));
        time_s.push(cell.time_s);
    }
    for (row, (parameter, sd)) in priors.iter().enumerate() {
        design[(means.len() + row, *parameter)] = 1.0;
        noise.push(*sd);
        sensitivity.push(0.0);
        time_s.push(0.0);
    }
    let windows = means.len();
    let column = |doubt: &Parts, sigma: f64| {
        DVector::from_fn(n, |row, _| sigma * doubt.cells.get(row).copied().unwrap_or(0.0))
    };
    let drifts = [BATTERY, DRIFT].into_iter();
    let doubts_us = drifts.map(|drift| column(&doubts[drift], sigmas[drift])).collect();
    Record { design, pulse_us, noise_us: noise, sensitivity, time_s, doubts_us, windows }
}

/// How many standard errors the 95 % interval of the fleet's constant reaches to each side, with the
/// scales of the air unknown.
fn zero_width(
    weighed: &[Weighed<Gls>],
    fleet: &Record,
    parameters: &DVector<f64>,
    common: &DMatrix<f64>,
) -> f64 {
    let normals: Vec<(f64, f64, f64)> = weighed
        .iter()
        .map(|one| {
            let off = (&one.fit.gain * &fleet.pulse_us - parameters)[0];
            (one.weight, off, one.fit.covariance[(0, 0)].max(0.0).sqrt())
        })
        .collect();
    let sd = common[(0, 0)].max(0.0).sqrt();
    let outside = |half: f64| -> f64 {
        let tail = |z: f64| 0.5 * statrs::function::erf::erfc(z / std::f64::consts::SQRT_2);
        normals
            .iter()
            .map(|(weight, off, sd)| {
                let sd = sd.max(1e-12);
                weight * (tail((half - off) / sd) + tail((half + off) / sd))
            })
            .sum()
    };
    if sd <= 0.0 {
        return 1.96;
    }
    let (mut low, mut high) = (1.0 * sd, 6.0 * sd);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if outside(middle) > 0.05 { low = middle } else { high = middle }
    }
    high / sd
}
