//! How far a ladder is shifted along the vertical speed against another: the posterior of `W`.
//!
//! Both flights' windows are one Gaussian vector for each `W` and each choice of the scales (smooth rest of the
//! curve, and of each flight its slow air and white scatter). The scales are weighed by the windows. `W` has a
//! flat prior.

use std::cmp::Ordering;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::super::air_prior::Air;
use super::super::corrections::{DOUBTS, DRIFT, WINDS};
use super::curve::{LENGTHS_MPS, RESTS_US, Rest, basis, bent, beyond_us};
use super::points::Point;
use crate::numeric::{extent, log_sum, mean};

/// `W` is searched to this on both sides, m/s: the range of the laws' fits.
pub(super) const FASTEST_MPS: f64 = 8.0;
/// Step of the first search, m/s. Numerical: a quarter of a rung.
const STEP_MPS: f64 = 0.125;
/// Strengths of slow air that are tried, m/s. A grid.
const AIRS_MPS: [f64; 5] = [0.004, 0.02, 0.08, 0.25, 0.7];
/// Its time scales, s. A grid.
const TAUS_S: [f64; 3] = [20.0, 90.0, 400.0];
/// White scatter that is tried, us. A grid.
const WHITES_US: [f64; 4] = [0.05, 0.25, 1.0, 4.0];
/// Choices with less than this share of the heaviest one's weight are dropped. Numerical.
const NEGLIGIBLE: f64 = 0.02;
/// And more than so many of the calibration, or of the ladder's air, the lighter ones. Numerical.
const MOST_CHOICES: usize = 12;
/// Values of `W` whose logarithm of the density is lower than the highest by more are left. Numerical.
const DEEP: f64 = 20.0;
/// Neighbouring values of `W` differ by no more in the logarithm of their density. Numerical.
const SMOOTH: f64 = 0.35;
/// Rounds of refinement. Numerical: 0.125 m/s halved eight times.
const ROUNDS: usize = 8;
/// More probability than this at the ends of the search: `W` may be anything beyond. Chosen.
const OPEN: f64 = 1e-3;

/// Windows of a calibration (`there`) and of a ladder (`here`).
pub(super) struct Flights<'a> {
    pub(super) there: &'a [Point],
    pub(super) here: &'a [Point],
    /// Standard errors of the doubts.
    pub(super) sigmas: &'a [f64; DOUBTS],
    /// How the drone may differ from that of the calibration: constant, us, and slope, us/(m/s).
    pub(super) spread: [f64; 2],
}

/// The shift.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    pub(super) mean_mps: f64,
    pub(super) sd_mps: f64,
    /// 95 %, m/s.
    pub(super) interval_mps: [f64; 2],
    /// The ends of the search are not excluded.
    pub(super) is_open: bool,
    /// Lowest and highest air speed of the calibration, m/s.
    pub(super) speeds_mps: [f64; 2],
    /// Of the ladder at the mean, with all errors, if its air is the calibration's.
    pub(super) chi2_reduced: Option<f64>,
}

/// The shift of `here` against `there`; `None` where they do not determine one.
pub(super) fn shift(flights: &Flights<'_>) -> Option<Shift> {
    let model = Model::new(flights)?;
    let choices = model.choices();
    let heaviest = choices.first()?;
    let every = airs();
    let first = |w_mps: f64| Some((w_mps, model.density(heaviest, &every, w_mps)?));
    let steps = (FASTEST_MPS / STEP_MPS) as i32;
    let coarse: Vec<(f64, f64)> =
        (-steps..=steps).filter_map(|step| first(f64::from(step) * STEP_MPS)).collect();
    let best = highest(&coarse)?;
    let peak = top(&coarse, first)?;
    let airs = model.airs_at(heaviest, every, peak);
    let over_all = |w_mps: f64| {
        let logs = choices
            .iter()
            .filter_map(|choice| Some(choice.weight.ln() + model.density(choice, &airs, w_mps)?));
        some_log_sum(logs.collect())
    };
    let mut nodes: Vec<(f64, f64)> = coarse
        .iter()
        .filter(|(_, log)| *log > best - DEEP)
        .filter_map(|(w_mps, _)| Some((*w_mps, over_all(*w_mps)?)))
        .collect();
    // A peak narrower than a step has its neighbours below all that is kept.
    let around: Vec<f64> = nodes.iter().flat_map(|(w, _)| [w - STEP_MPS, w + STEP_MPS]).collect();
    for w_mps in around.into_iter().filter(|w| w.abs() <= FASTEST_MPS) {
        if nodes.iter().all(|(known, _)| (known - w_mps).abs() > STEP_MPS / 4.0) {
            nodes.extend(over_all(w_mps).map(|log| (w_mps, log)));
        }
    }
    nodes.sort_by(by_place);
    for _ in 0..ROUNDS {
        let best = highest(&nodes)?;
        let between: Vec<f64> = nodes
            .windows(2)
            .filter_map(|pair| {
                let [(left, low), (right, high)] = *pair else { return None };
                // A peak may lie between two nodes of one height.
                let steep = (low - high).abs() > SMOOTH || low.max(high) >= best;
                let counts = low.max(high) > best - DEEP / 2.0 && steep;
                (counts && right - left < 1.5 * STEP_MPS).then(|| f64::midpoint(left, right))
            })
            .collect();
        if between.is_empty() {
            break;
        }
        nodes.extend(between.into_iter().filter_map(|w_mps| Some((w_mps, over_all(w_mps)?))));
        nodes.sort_by(by_place);
    }
    let found = Posterior::of(&nodes)?;
    let (mean_mps, sd_mps) = found.mean_sd();
    let n = flights.here.len() as f64 - 1.0;
    let chi2 = choices.first().and_then(|choice| model.chi2(choice, mean_mps));
    Some(Shift {
        mean_mps,
        sd_mps,
        interval_mps: [found.quantile(0.025), found.quantile(0.975)],
        is_open: found.at_ends() > OPEN,
        speeds_mps: model.speeds_mps,
        chi2_reduced: chi2.filter(|_| n > 0.0).map(|chi2| chi2 / n),
    })
}

/// Where the first search's peak is.
fn top(coarse: &[(f64, f64)], density: impl Fn(f64) -> Option<(f64, f64)>) -> Option<f64> {
    let higher = |one: (f64, f64), other: (f64, f64)| if other.1 > one.1 { other } else { one };
    let mut best = coarse.iter().copied().reduce(higher)?;
    let mut step_mps = STEP_MPS / 2.0;
    for _ in 0..ROUNDS {
        let sides = [best.0 - step_mps, best.0 + step_mps];
        best = sides.into_iter().filter_map(&density).fold(best, higher);
        step_mps /= 2.0;
    }
    Some(best.0)
}

/// `None` of nothing that is possible.
fn some_log_sum(logs: Vec<f64>) -> Option<f64> {
    Some(log_sum(logs)).filter(|log| log.is_finite())
}

fn by_place(left: &(f64, f64), right: &(f64, f64)) -> Ordering {
    left.0.total_cmp(&right.0)
}

fn highest(nodes: &[(f64, f64)]) -> Option<f64> {
    let most = nodes.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    most.is_finite().then_some(most)
}

/// A density over `W`, straight between its nodes.
struct Posterior {
    nodes: Vec<(f64, f64)>,
    /// Probability up to each node.
    up_to: Vec<f64>,
}

impl Posterior {
    fn of(nodes: &[(f64, f64)]) -> Option<Self> {
        let most = highest(nodes)?;
        let nodes: Vec<(f64, f64)> =
            nodes.iter().map(|(w_mps, log)| (*w_mps, (log - most).exp())).collect();
        let mut sum = 0.0;
        let mut up_to = vec![0.0];
        for pair in nodes.windows(2) {
            let [(left, low), (right, high)] = *pair else { return None };
            // Modes that lie apart have nothing between them.
            if right - left < 1.5 * STEP_MPS {
                sum += 0.5 * (low + high) * (right - left);
            }
            up_to.push(sum);
        }
        (sum > 0.0).then(|| Self { nodes, up_to: up_to.iter().map(|part| part / sum).collect() })
    }

    fn mean_sd(&self) -> (f64, f64) {
        let shares = || self.up_to.windows(2).map(|pair| pair[1] - pair[0]);
        let middles = || self.nodes.windows(2).map(|pair| f64::midpoint(pair[0].0, pair[1].0));
        let mean: f64 = shares().zip(middles()).map(|(share, middle)| share * middle).sum();
        let square: f64 =
            shares().zip(middles()).map(|(share, at)| share * (at - mean).powi(2)).sum();
        (mean, square.sqrt())
    }

    fn quantile(&self, share: f64) -> f64 {
        let index = self.up_to.partition_point(|part| *part < share).clamp(1, self.nodes.len() - 1);
        let (low, high) = (self.up_to[index - 1], self.up_to[index]);
        let (left, right) = (self.nodes[index - 1].0, self.nodes[index].0);
        let part = if high > low { (share - low) / (high - low) } else { 0.5 };
        left + part * (right - left)
    }

    /// Probability within a step of the ends of the search.
    fn at_ends(&self) -> f64 {
        let shares = self.up_to.windows(2).map(|pair| pair[1] - pair[0]);
        let far = self.nodes.windows(2).map(|pair| pair[0].0.abs().max(pair[1].0.abs()));
        shares
            .zip(far)
            .filter(|(_, far)| *far > FASTEST_MPS - STEP_MPS)
            .map(|(share, _)| share)
            .sum()
    }
}

/// All choices of a flight's air, with the logarithms of their weights.
fn airs() -> Vec<(Air, f64)> {
    let mut airs = Vec::new();
    for sd_mps in AIRS_MPS {
        for tau_s in TAUS_S {
            for white_us in WHITES_US {
                let air = Air { sd_mps, tau_s, white_us };
                airs.push((air, air.prior().ln()));
            }
        }
    }
    airs
}

/// A choice of the scales of calibration and curve, and the calibration's windows with it.
struct Choice {
    rest: Rest,
    air: Air,
    /// Against the heaviest one.
    weight: f64,
    factor: Cholesky<f64, Dyn>,
    /// The calibration's pulses divided by their covariance.
    solved: DVector<f64>,
}

struct Model<'a> {
    flights: &'a Flights<'a>,
    /// Pulses less the calibration's mean, us.
    pulses: [DVector<f64>; 2],
    basis_there: Vec<[f64; 4]>,
    /// Rough curve: parameters of the line with bends.
    rough: [f64; 4],
    speeds_mps: [f64; 2],
}

impl<'a> Model<'a> {
    fn new(flights: &'a Flights<'a>) -> Option<Self> {
        let level = mean(flights.there.iter().map(|point| point.pulse_us))?;
        let pulses = [flights.there, flights.here].map(|points| {
            DVector::from_iterator(points.len(), points.iter().map(|one| one.pulse_us - level))
        });
        let (slowest, fastest) = extent(flights.there.iter().map(|one| one.velocity_mps))?;
        if flights.here.is_empty() || fastest - slowest < 0.1 {
            return None;
        }
        let basis_there: Vec<[f64; 4]> =
            flights.there.iter().map(|point| basis(point.velocity_mps)).collect();
        let rough = rough(&basis_there, &pulses[0], flights.there)?;
        let speeds_mps = [slowest, fastest];
        Some(Self { flights, pulses, basis_there, rough, speeds_mps })
    }

    /// Pulse per air speed of the rough curve, us/(m/s); beyond the calibration that at its end.
    fn slope(&self, air_mps: f64) -> f64 {
        let [low, high] = self.speeds_mps;
        let air = air_mps.clamp(low, high);
        self.rough[1] + 2.0 * self.rough[2] * air + 2.0 * self.rough[3] * air.abs()
    }

    /// Noise, slow air and what is doubtful in one flight alone.
    fn own(&self, points: &[Point], slopes: &[f64], air: &Air) -> DMatrix<f64> {
        let drift = self.flights.sigmas[DRIFT];
        DMatrix::from_fn(points.len(), points.len(), |row, column| {
            let (left, right) = (&points[row], &points[column]);
            let apart = (left.time_s - right.time_s).abs() / air.tau_s;
            let mut value = air.sd_mps.powi(2) * slopes[row] * slopes[column] * (-apart).exp();
            value += drift * drift * left.doubts_us[DRIFT] * right.doubts_us[DRIFT];
            if row == column {
                let noise = left.noise_us.hypot(slopes[row] * left.velocity_noise_mps);
                value += noise * noise + air.white_us * air.white_us;
            }
            value
        })
    }

    /// What corrections leave open in both flights alike, us². Not the wind's: flow along a leaning rotor axis is
    /// the very shift that is looked for, and no likelihood tells them apart.
    fn doubts(&self, left: &Point, right: &Point) -> f64 {
        let of = |doubt: usize| {
            let sigma = self.flights.sigmas[doubt];
            sigma * sigma * left.doubts_us[doubt] * right.doubts_us[doubt]
        };
        (0..DOUBTS).filter(|doubt| *doubt != DRIFT && !WINDS.contains(doubt)).map(of).sum()
    }

    /// The choices of the scales that count, heaviest first.
    fn choices(&self) -> Vec<Choice> {
        let there = self.flights.there;
        let n = there.len();
        let slopes: Vec<f64> = there.iter().map(|point| self.slope(point.velocity_mps)).collect();
        let smooth = DMatrix::from_fn(n, n, |row, column| {
            bent(&self.basis_there[row], &self.basis_there[column])
                + self.doubts(&there[row], &there[column])
        });
        let mut choices = Vec::new();
        let rests = RESTS_US.iter().flat_map(|sd| LENGTHS_MPS.map(|length| (*sd, length)));
        let rests: Vec<(Rest, DMatrix<f64>)> = rests
            .map(|(sd_us, length_mps)| {
                let rest = Rest { sd_us, length_mps };
                let covariance = DMatrix::from_fn(n, n, |row, column| {
                    rest.covariance(there[row].velocity_mps, there[column].velocity_mps)
                });
                (rest, covariance + &smooth)
            })
            .collect();
        for (air, prior) in airs() {
            let own = self.own(there, &slopes, &air);
            for (rest, covariance) in &rests {
                let Some(factor) = (covariance + &own).cholesky() else { continue };
                let solved = factor.solve(&self.pulses[0]);
                let weight = log_density(&factor, &self.pulses[0], &solved) + prior;
                choices.push(Choice { rest: *rest, air, weight, factor, solved });
            }
        }
        choices.sort_by(|left, right| right.weight.total_cmp(&left.weight));
        let most = choices.first().map_or(0.0, |choice| choice.weight);
        for choice in &mut choices {
            choice.weight = (choice.weight - most).exp();
        }
        choices.retain(|choice| choice.weight > NEGLIGIBLE);
        choices.truncate(MOST_CHOICES);
        choices
    }

    /// The choices of the ladder's air that count at `W`.
    fn airs_at(&self, choice: &Choice, airs: Vec<(Air, f64)>, w_mps: f64) -> Vec<(Air, f64)> {
        let mut weighed: Vec<(f64, (Air, f64))> = airs
            .into_iter()
            .filter_map(|one| Some((self.density(choice, &[one], w_mps)?, one)))
            .collect();
        weighed.sort_by(|left, right| right.0.total_cmp(&left.0));
        let most = weighed.first().map_or(0.0, |one| one.0);
        weighed.retain(|one| one.0 > most + NEGLIGIBLE.ln());
        weighed.truncate(MOST_CHOICES);
        weighed.into_iter().map(|(_, one)| one).collect()
    }

    /// The ladder's windows less what the calibration says of them at `W`, and the covariance of that but for the
    /// ladder's own; the slopes there.
    fn rest(&self, choice: &Choice, w_mps: f64) -> (DVector<f64>, DMatrix<f64>, Vec<f64>) {
        let Flights { there, here, spread, .. } = self.flights;
        let airs: Vec<f64> = here.iter().map(|point| point.velocity_mps - w_mps).collect();
        let bases: Vec<[f64; 4]> = airs.iter().map(|air| basis(*air)).collect();
        let slopes: Vec<f64> = airs.iter().map(|air| self.slope(*air)).collect();
        let across = DMatrix::from_fn(there.len(), here.len(), |row, column| {
            bent(&self.basis_there[row], &bases[column])
                + choice.rest.covariance(there[row].velocity_mps, airs[column])
                + self.doubts(&there[row], &here[column])
        });
        let beyond: Vec<[f64; 2]> =
            airs.iter().map(|air| beyond_us(*air, self.speeds_mps)).collect();
        let mut covariance = DMatrix::zeros(here.len(), here.len());
        for row in 0..here.len() {
            for column in 0..=row {
                let value = bent(&bases[row], &bases[column])
                    + choice.rest.covariance(airs[row], airs[column])
                    + self.doubts(&here[row], &here[column])
                    + spread[0].powi(2)
                    + spread[1].powi(2) * airs[row] * airs[column]
                    + beyond[row][0] * beyond[column][0]
                    + beyond[row][1] * beyond[column][1];
                covariance[(row, column)] = value;
                covariance[(column, row)] = value;
            }
        }
        let residual = &self.pulses[1] - across.tr_mul(&choice.solved);
        let known = choice.factor.l_dirty().solve_lower_triangular(&across);
        if let Some(known) = known {
            covariance -= known.tr_mul(&known);
        }
        (residual, covariance, slopes)
    }

    /// Logarithm of the density of the ladder's windows at `W`, over choices of their air.
    fn density(&self, choice: &Choice, airs: &[(Air, f64)], w_mps: f64) -> Option<f64> {
        let (residual, covariance, slopes) = self.rest(choice, w_mps);
        let one = |(air, prior): &(Air, f64)| {
            let factor = (&covariance + self.own(self.flights.here, &slopes, air)).cholesky()?;
            let log = log_density(&factor, &residual, &factor.solve(&residual)) + prior;
            log.is_finite().then_some(log)
        };
        some_log_sum(airs.iter().filter_map(one).collect())
    }

    /// Chi² of the ladder at `W`, in the calibration's air.
    fn chi2(&self, choice: &Choice, w_mps: f64) -> Option<f64> {
        let (residual, covariance, slopes) = self.rest(choice, w_mps);
        let all = covariance + self.own(self.flights.here, &slopes, &choice.air);
        Some(residual.dot(&all.cholesky()?.solve(&residual)))
    }
}

/// Logarithm of a normal density, but for a constant.
fn log_density(factor: &Cholesky<f64, Dyn>, values: &DVector<f64>, solved: &DVector<f64>) -> f64 {
    let log_determinant: f64 = factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum();
    -log_determinant - 0.5 * values.dot(solved)
}

/// The line with bends through the calibration's windows, by weighted least squares.
fn rough(basis: &[[f64; 4]], pulses: &DVector<f64>, points: &[Point]) -> Option<[f64; 4]> {
    let mut normal = nalgebra::Matrix4::<f64>::zeros();
    let mut right = nalgebra::Vector4::<f64>::zeros();
    for ((basis, pulse), point) in basis.iter().zip(pulses.iter()).zip(points) {
        let row = nalgebra::Vector4::from_column_slice(basis);
        // The floor keeps windows of a quantized log from counting more than the rest together.
        let weight = 1.0 / (point.noise_us.powi(2) + 1.0);
        normal += row * row.transpose() * weight;
        right += row * (*pulse * weight);
    }
    // Few speeds do not tell all bends: a weak prior keeps the rest small.
    for (index, ridge) in [(1, 1e-6), (2, 1e-3), (3, 1e-3)] {
        normal[(index, index)] += ridge;
    }
    let found = normal.cholesky()?.solve(&right);
    Some([found[0], found[1], found[2], found[3]])
}
