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

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::air_prior::{Air, Gls, Record, Weighed, grid, quantile, weigh};
use super::corrections::{BATTERY, DOUBTS, DRIFT};
use super::result::CalibrationAir;

/// Parameters of the fleet's law at most: constant, slope, bends.
pub(super) const PARAMETERS: usize = 4;
/// Prior standard deviation of the bend `V²`, us/(m/s)²: rotors have +0.5 to +1.5.
const BEND_SD: f64 = 1.5;
/// Prior standard deviation of the bend `V|V|` (drag), us/(m/s)².
const DRAG_SD: f64 = 1.5;
/// Spread of both bends between the drones of a fleet, us/(m/s)².
const OWN_BEND_SD: f64 = 0.2;
/// Windows whose times differ by more belong to groups that fly apart, s.
const SAME_TIME_S: f64 = 5.0;
/// No mean of a window is known better, us.
const LEAST_NOISE_US: f64 = 0.1;
/// Most drones that the scales of local air are estimated from.
const SCALE_DRONES: usize = 25;
/// Rounds of the separation into fleet and drones.
const ROUNDS: usize = 12;

/// Shape of the law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// `u0 + A' V`, with bends `V²` and `V|V|` as far as the windows ask for them.
    Line,
    /// `u0 + A V|V|`.
    SignedQuadratic,
}

impl Shape {
    /// Derivatives of the pulse by the fleet's parameters.
    pub(super) fn basis(self, air_mps: f64) -> [f64; PARAMETERS] {
        let square = air_mps * air_mps.abs();
        match self {
            Self::Line => [1.0, air_mps, air_mps * air_mps, square],
            Self::SignedQuadratic => [1.0, square, 0.0, 0.0],
        }
    }

    fn parameters(self) -> usize {
        match self {
            Self::Line => 4,
            Self::SignedQuadratic => 2,
        }
    }

    /// What a drone's own second parameter is multiplied with.
    fn own(self, air_mps: f64) -> f64 {
        self.basis(air_mps)[1]
    }

    /// Pulse of a law, us.
    pub(super) fn pulse_us(self, law: &[f64; PARAMETERS], air_mps: f64) -> f64 {
        law.iter().zip(self.basis(air_mps)).map(|(value, basis)| value * basis).sum()
    }

    /// Pulse per air speed, us/(m/s).
    pub(super) fn slope(self, law: &[f64; PARAMETERS], air_mps: f64) -> f64 {
        match self {
            Self::Line => law[1] + 2.0 * law[2] * air_mps + 2.0 * law[3] * air_mps.abs(),
            Self::SignedQuadratic => 2.0 * law[1] * air_mps.abs(),
        }
    }
}

/// One usable window of one drone, referred.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// Index of the drone.
    pub(super) drone: usize,
    /// What was commanded, and its count among equals: the same for all drones of the fleet.
    pub(super) key: (String, usize),
    pub(super) time_s: f64,
    pub(super) velocity_mps: f64,
    pub(super) pulse_us: f64,
    /// Standard error of pulse and velocity together, us.
    pub(super) noise_us: f64,
    pub(super) doubts_us: [f64; DOUBTS],
}

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
    /// Logarithm of the probability of the fleet's averages with this shape, but for a constant that
    /// all shapes have for the same windows.
    pub(super) evidence: f64,
    /// Lowest and highest vertical speed of the windows, m/s.
    pub(super) speeds_mps: [f64; 2],
}

/// Averages over drones of what was flown at the same time.
struct Cell {
    time_s: f64,
    velocity_mps: f64,
    members: Vec<usize>,
}

fn cells(points: &[Point]) -> (Vec<Cell>, Vec<usize>) {
    let mut found: BTreeMap<&(String, usize), Vec<usize>> = BTreeMap::new();
    let mut cells: Vec<Cell> = Vec::new();
    let mut cell_of = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let same = found.entry(&point.key).or_default();
        let near = |cell: &&usize| (cells[**cell].time_s - point.time_s).abs() < SAME_TIME_S;
        let cell = same.iter().find(near).copied().unwrap_or_else(|| {
            same.push(cells.len());
            cells.push(Cell { time_s: point.time_s, velocity_mps: 0.0, members: Vec::new() });
            cells.len() - 1
        });
        cells[cell].members.push(index);
        cell_of.push(cell);
    }
    for cell in &mut cells {
        let n = cell.members.len() as f64;
        let mean = |value: fn(&Point) -> f64| {
            cell.members.iter().map(|index| value(&points[*index])).sum::<f64>() / n
        };
        cell.velocity_mps = mean(|point| point.velocity_mps);
    }
    (cells, cell_of)
}

/// Splits values of the points into averages of cells and a constant and slope for each drone.
struct Split {
    drones: usize,
    cells: Vec<Cell>,
    cell_of: Vec<usize>,
    /// What a drone's slope is multiplied with, less its mean over the drone's points.
    own: Vec<f64>,
}

struct Parts {
    cells: Vec<f64>,
    /// Constant (at the mean of the drone's speeds) and slope.
    drones: Vec<[f64; 2]>,
}

impl Split {
    fn new(shape: Shape, points: &[Point], drones: usize) -> Self {
        let (cells, cell_of) = cells(points);
        let own = points.iter().map(|point| shape.own(point.velocity_mps)).collect();
        Self { drones, cells, cell_of, own }
    }

    /// Alternating least squares; deviations of the drones have the mean zero.
    fn of(&self, points: &[Point], values: &[f64]) -> Parts {
        let mut parts =
            Parts { cells: vec![0.0; self.cells.len()], drones: vec![[0.0; 2]; self.drones] };
        for _ in 0..ROUNDS {
            for (cell, mean) in self.cells.iter().zip(&mut parts.cells) {
                let rest = |index: &usize| {
                    let [constant, slope] = parts.drones[points[*index].drone];
                    values[*index] - constant - slope * self.own[*index]
                };
                *mean = cell.members.iter().map(rest).sum::<f64>() / cell.members.len() as f64;
            }
            let mut sums = vec![[0.0; 5]; self.drones];
            for (index, point) in points.iter().enumerate() {
                let rest = values[index] - parts.cells[self.cell_of[index]];
                let x = self.own[index];
                let sum = &mut sums[point.drone];
                for (sum, term) in sum.iter_mut().zip([1.0, x, x * x, rest, x * rest]) {
                    *sum += term;
                }
            }
            let mut flown: Vec<usize> = Vec::new();
            for (drone, [n, x, xx, y, xy]) in sums.iter().enumerate() {
                let determinant = n * xx - x * x;
                parts.drones[drone] = if determinant > 1e-9 {
                    let slope = (n * xy - x * y) / determinant;
                    [(y - slope * x) / n, slope]
                } else {
                    [if *n > 0.0 { y / n } else { 0.0 }, 0.0]
                };
                if *n > 0.0 {
                    flown.push(drone);
                }
            }
            for part in 0..2 {
                let mean = flown.iter().map(|drone| parts.drones[*drone][part]).sum::<f64>()
                    / flown.len().max(1) as f64;
                flown.iter().for_each(|drone| parts.drones[*drone][part] -= mean);
            }
        }
        parts
    }
}

/// Slope of an unweighted line through the points, us per unit of the shape's second term.
fn rough_slope(split: &Split, points: &[Point]) -> f64 {
    let n = points.len() as f64;
    let mean_x = split.own.iter().sum::<f64>() / n;
    let mean_y = points.iter().map(|point| point.pulse_us).sum::<f64>() / n;
    let (mut xx, mut xy) = (0.0, 0.0);
    for (point, x) in points.iter().zip(&split.own) {
        xx += (x - mean_x).powi(2);
        xy += (x - mean_x) * (point.pulse_us - mean_y);
    }
    if xx > 1e-9 { xy / xx } else { 0.0 }
}

/// Fits the fleet. `None` if the windows do not determine a law.
///
/// `sigmas` are the standard errors of the doubts ([`Point::doubts_us`]).
pub(super) fn fit(
    points: &[Point],
    drones: usize,
    shape: Shape,
    sigmas: &[f64; DOUBTS],
) -> Option<Zero> {
    if points.is_empty() {
        return None;
    }
    let split = Split::new(shape, points, drones);
    let rough = rough_slope(&split, points);
    // Members of a cell differ in speed by centimetres per second: brought to the cell's mean.
    let aligned = |index: usize, value: f64| {
        let cell = &split.cells[split.cell_of[index]];
        value - rough * (split.own[index] - shape.own(cell.velocity_mps))
    };
    let pulses: Vec<f64> =
        points.iter().enumerate().map(|(index, p)| aligned(index, p.pulse_us)).collect();
    let parts = split.of(points, &pulses);

    let doubts: Vec<Parts> = (0..DOUBTS)
        .map(|doubt| {
            let values: Vec<f64> = points.iter().map(|point| point.doubts_us[doubt]).collect();
            split.of(points, &values)
        })
        .collect();
    let fleet = fleet_record(shape, points, &split, &parts.cells, (&doubts, sigmas), rough);
    let taus_s = [8.0, 20.0, 50.0, 100.0, 200.0, 400.0, 800.0];
    let fits = grid(13, &taus_s, &[0.1, 0.3, 1.0, 3.0, 8.0]).into_iter().filter_map(|air| {
        let fit = fleet.fit(&air)?;
        Some((air, fit.log_likelihood, fit))
    });
    let weighed: Vec<Weighed<Gls>> = weigh(fits);
    let heaviest = weighed.first()?;
    let evidence = heaviest.fit.log_likelihood - heaviest.weight.ln();
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

    let local = local_air(shape, points, &split, &pulses, &parts, &doubts, rough);
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
    let mut laws = Vec::new();
    for drone in 0..drones {
        laws.push(local.as_ref().and_then(|local| {
            let own = local.drones.get(drone)?.as_ref()?;
            let mut law = fleet_law;
            law.iter_mut().zip(own.value.iter()).for_each(|(law, own)| *law += own);
            let mut answers = [[0.0; PARAMETERS]; DOUBTS];
            for (doubt, answer) in answers.iter_mut().enumerate() {
                *answer = whole(&answers_fleet[doubt]);
                answer.iter_mut().zip(own.answers[doubt]).for_each(|(all, own)| *all += own);
            }
            Some(DroneLaw { law, own: own.covariance, answers })
        }));
    }
    let answers = std::array::from_fn(|doubt| whole(&answers_fleet[doubt]));
    let spread = local.as_ref().map_or_else(Matrix4::zeros, |local| local.spread);
    let interval = |value: fn(&Air) -> f64| {
        [0.025, 0.975].map(|share| quantile(&weighed, share, |one| value(&one.air)))
    };
    let speeds = points.iter().map(|point| point.velocity_mps);
    Some(Zero {
        shape,
        common,
        drones: laws,
        flock: DroneLaw { law: fleet_law, own: spread, answers },
        air: CalibrationAir {
            sd_mps: quantile(&weighed, 0.5, |one| one.air.sd_mps),
            sd_interval_mps: interval(|air| air.sd_mps),
            time_scale_s: quantile(&weighed, 0.5, |one| one.air.tau_s),
            time_scale_interval_s: interval(|air| air.tau_s),
            local_sd_mps: local.as_ref().map_or(0.0, |local| local.sd_mps),
        },
        width,
        evidence,
        speeds_mps: [
            speeds.clone().fold(f64::INFINITY, f64::min),
            speeds.fold(f64::NEG_INFINITY, f64::max),
        ],
    })
}

fn noise_us(points: &[Point], members: &[usize]) -> f64 {
    let squares: f64 =
        members.iter().map(|i| points[*i].noise_us.max(LEAST_NOISE_US).powi(2)).sum();
    squares.sqrt() / members.len() as f64
}

/// The averages over drones with the priors of the bends.
fn fleet_record(
    shape: Shape,
    points: &[Point],
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

fn rough_sensitivity(shape: Shape, rough: f64, air_mps: f64) -> f64 {
    match shape {
        Shape::Line => rough,
        Shape::SignedQuadratic => 2.0 * rough * air_mps.abs(),
    }
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

/// One drone's own part of the parameters.
struct Own {
    value: Vector4<f64>,
    covariance: Matrix4<f64>,
    answers: [[f64; PARAMETERS]; DOUBTS],
}

struct Local {
    drones: Vec<Option<Own>>,
    spread: Matrix4<f64>,
    sd_mps: f64,
}

/// The drones' deviations from the fleet, with the air that each met alone.
fn local_air(
    shape: Shape,
    points: &[Point],
    split: &Split,
    pulses: &[f64],
    parts: &Parts,
    doubts: &[Parts],
    rough: f64,
) -> Option<Local> {
    let mut of_drone: Vec<Vec<usize>> = vec![Vec::new(); split.drones];
    points.iter().enumerate().for_each(|(index, point)| of_drone[point.drone].push(index));
    let flown = of_drone.iter().filter(|own| !own.is_empty()).count();
    if flown < 2 {
        let none = || Own {
            value: Vector4::zeros(),
            covariance: Matrix4::zeros(),
            answers: [[0.0; PARAMETERS]; DOUBTS],
        };
        return Some(Local {
            drones: of_drone.iter().map(|own| (!own.is_empty()).then(none)).collect(),
            spread: Matrix4::zeros(),
            sd_mps: 0.0,
        });
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
    let fits = grid(10, &[10.0, 40.0, 120.0, 360.0], &[0.1, 0.4, 1.5, 6.0]).into_iter().filter_map(
        |air| {
            let mut sum = 0.0;
            for record in records.iter().step_by(step).flatten() {
                sum += record.fit(&air)?.log_likelihood;
            }
            Some((air, sum, ()))
        },
    );
    let weighed = weigh(fits);
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
    Some(Local { drones, spread, sd_mps: quantile(&weighed, 0.5, |one| one.air.sd_mps) })
}
