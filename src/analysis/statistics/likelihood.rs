//! The Gaussian field of maximum likelihood.
//!
//! `sd² exp(-r / lambda) exp(-|dt| / tau)` plus independent noise, seen through a running mean, with
//! an unknown mean of every drone (and, if asked for, an unknown slope, and an unknown common value
//! at every time). The values that are a running mean apart are means of neighbouring blocks. Rotated
//! to the eigenvectors of the covariance in space, each mode is one autoregressive process of first
//! order, averaged over blocks, plus white noise: a Kalman filter with one state gives its
//! likelihood. Means and slopes are integrated out (restricted likelihood), else the time scale would
//! come out short. The variance is found in closed form, time scale and noise by search, and the
//! length on a fixed grid of logarithms with interpolation, so that eigenvectors are computed once.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::field::Field;
use super::search::minimum;
use super::simulate::covariance;

/// Step of the grid of ln(lambda).
const STEP: f64 = 0.25;
/// Lengths from this share of the spacing ...
const SHORTEST: f64 = 0.25;
/// ... to this multiple of the extent are tried.
const LONGEST: f64 = 60.0;
/// Range of the noise's variance over that of the air, logarithms.
const LN_NOISE: (f64, f64) = (-18.0, 4.0);
/// Modes that are filtered side by side. Numerical: each waits for its own division from block to block.
const LANES: usize = 8;
/// A search by steps that has not ended by then will not.
const MOST_STEPS: usize = 200;

/// What is taken for unknown besides each drone's mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Unknown {
    /// A slope over time of each drone.
    pub(super) slope: bool,
    /// A common value of all drones at each time.
    pub(super) common: bool,
}

/// Which (drone, second) the likelihood is of: all combinations of some drones and some seconds.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Drones.
    pub(super) drones: Vec<usize>,
    /// Seconds, one for each block.
    seconds: Vec<usize>,
    /// Blocks from the one before to this one.
    steps: Vec<usize>,
    /// Seconds in a block.
    running: usize,
}

impl Blocks {
    /// Blocks without gaps: drones or blocks are dropped, whichever loses less.
    pub(super) fn of(field: &Field) -> Option<Self> {
        let first = ((field.seconds - 1) % field.running) / 2;
        let mut seconds: Vec<usize> = (first..field.seconds).step_by(field.running).collect();
        let mut drones: Vec<usize> = (0..field.drones()).collect();
        loop {
            let known = |drone: usize, second: usize| {
                let value = field.rows.get(drone).and_then(|row| row.get(second));
                value.is_some_and(|value| value.is_finite())
            };
            let gaps_of_drone =
                |drone: &usize| seconds.iter().filter(|second| !known(*drone, **second)).count();
            let gaps_of_second =
                |second: &usize| drones.iter().filter(|drone| !known(**drone, *second)).count();
            let worst_drone = drones.iter().copied().max_by_key(gaps_of_drone)?;
            let worst_second = seconds.iter().copied().max_by_key(gaps_of_second)?;
            let (of_drone, of_second) =
                (gaps_of_drone(&worst_drone), gaps_of_second(&worst_second));
            if of_drone == 0 {
                break;
            }
            if of_drone * drones.len() > of_second * seconds.len() {
                drones.retain(|drone| *drone != worst_drone);
            } else {
                seconds.retain(|second| *second != worst_second);
            }
        }
        let before = std::iter::once(None).chain(seconds.iter().copied().map(Some));
        let steps = seconds
            .iter()
            .zip(before)
            .map(|(second, before)| before.map_or(1, |before| (second - before) / field.running))
            .collect();
        let enough = drones.len() >= super::field::FEWEST_DRONES && seconds.len() >= 6;
        enough.then_some(Self { drones, seconds, steps, running: field.running })
    }

    /// Blocks of each drone.
    pub(super) fn count(&self) -> usize {
        self.seconds.len()
    }

    /// The values, one row for each drone, from columns of seconds.
    pub(super) fn take(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let at = |list: &[usize], index: usize| list.get(index).copied().unwrap_or(0);
        DMatrix::from_fn(self.drones.len(), self.seconds.len(), |drone, block| {
            let place = (at(&self.seconds, block), at(&self.drones, drone));
            columns.get(place).copied().unwrap_or(0.0)
        })
    }
}

/// Covariance in space at one length, as modes.
struct Modes {
    ln_length: f64,
    variance: Vec<f64>,
    /// Rows: modes.
    vectors: DMatrix<f64>,
}

/// The likelihood of fields at fixed places and times.
pub(super) struct Likelihood {
    blocks: Blocks,
    unknown: Unknown,
    grid: Vec<Modes>,
    length_s: f64,
}

/// A fitted field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted {
    pub(super) sd_mps: f64,
    pub(super) lambda_m: f64,
    pub(super) tau_s: f64,
    pub(super) noise_mps: f64,
    pub(super) log_likelihood: f64,
    /// The length ran to the end of its range.
    pub(super) length_at_end: bool,
    /// The time ran to the end of its range.
    pub(super) time_at_end: bool,
}

/// The best of one length: ln(tau), ln(noise ratio), and what follows from them.
#[derive(Clone, Copy, Debug)]
struct Best {
    at: [f64; 2],
    log_likelihood: f64,
    variance: f64,
}

impl Likelihood {
    pub(super) fn new(field: &Field, blocks: &Blocks, unknown: Unknown) -> Self {
        let places: Vec<[f64; 2]> =
            blocks.drones.iter().filter_map(|drone| field.places.get(*drone).copied()).collect();
        let low = (SHORTEST * field.spacing_m()).ln();
        let high = (LONGEST * field.extent_m()).ln();
        let count = ((high - low) / STEP).ceil() as usize + 1;
        let contrasts = unknown.common.then(|| contrasts(places.len()));
        let grid = (0..count)
            .into_par_iter()
            .map(|index| {
                let ln_length = low + STEP * index as f64;
                let mut kernel = covariance(&places, [ln_length.exp(); 2]);
                if let Some(contrasts) = &contrasts {
                    kernel = contrasts * kernel * contrasts.transpose();
                }
                let modes = kernel.symmetric_eigen();
                let mut vectors = modes.eigenvectors.transpose();
                if let Some(contrasts) = &contrasts {
                    vectors *= contrasts;
                }
                let variance = modes.eigenvalues.iter().map(|value| value.max(1e-12)).collect();
                Modes { ln_length, variance, vectors }
            })
            .collect();
        Self { blocks: blocks.clone(), unknown, grid, length_s: field.seconds as f64 }
    }

    /// The field of maximum likelihood for values of one row per drone, searched from a guess of
    /// length (m) and time (s).
    pub(super) fn fit(&self, values: &DMatrix<f64>, guess: (f64, f64)) -> Option<Fitted> {
        let last = self.grid.len().checked_sub(1)?;
        let first_guess = self.grid.first()?.ln_length;
        let mut index = (((guess.0.ln() - first_guess) / STEP).round().max(0.0) as usize).min(last);
        let mut found: Vec<Option<Best>> = vec![None; self.grid.len()];
        let mut start = [guess.1.ln(), -4.0];
        let mut best = |index: usize, start: [f64; 2]| -> Option<Best> {
            let slot = found.get_mut(index)?;
            if slot.is_none() {
                *slot = self.best(values, self.grid.get(index)?, start);
            }
            *slot
        };
        for _ in 0..MOST_STEPS {
            let here = best(index, start)?;
            start = here.at;
            let below = index.checked_sub(1).and_then(|index| best(index, start));
            let above = if index < last { best(index + 1, start) } else { None };
            let level = |one: Option<Best>| one.map_or(f64::NEG_INFINITY, |one| one.log_likelihood);
            if level(below) > here.log_likelihood && level(below) >= level(above) {
                index -= 1;
            } else if level(above) > here.log_likelihood {
                index += 1;
            } else {
                return Some(self.between(index, below, here, above));
            }
        }
        None
    }

    /// The parabola through three neighbouring lengths at its top.
    fn between(
        &self,
        index: usize,
        below: Option<Best>,
        here: Best,
        above: Option<Best>,
    ) -> Fitted {
        let ln_length = self.grid.get(index).map_or(0.0, |modes| modes.ln_length);
        let (shift, ends) = match (below, above) {
            (Some(below), Some(above)) => {
                let (low, mid, high) =
                    (below.log_likelihood, here.log_likelihood, above.log_likelihood);
                let curvature = low - 2.0 * mid + high;
                let shift = if curvature < 0.0 { 0.5 * (low - high) / curvature } else { 0.0 };
                (shift.clamp(-0.5, 0.5), Some((below, above)))
            }
            _ => (0.0, None),
        };
        let blend = |of: &dyn Fn(&Best) -> f64| {
            let middle = of(&here);
            ends.map_or(middle, |(below, above)| {
                let (low, high) = (of(&below), of(&above));
                middle
                    + 0.5 * (high - low) * shift
                    + 0.5 * (low - 2.0 * middle + high) * shift * shift
            })
        };
        let tau_s = blend(&|best| best.at[0]).exp();
        let variance = blend(&|best| best.variance.ln()).exp();
        let noise = blend(&|best| best.at[1]).min(LN_NOISE.1).exp();
        let (shortest, longest) = self.time_range();
        Fitted {
            sd_mps: variance.sqrt(),
            lambda_m: (ln_length + STEP * shift).exp(),
            tau_s,
            noise_mps: (variance * noise).sqrt(),
            log_likelihood: blend(&|best| best.log_likelihood),
            length_at_end: ends.is_none(),
            time_at_end: tau_s < 1.05 * shortest.exp() || tau_s > 0.95 * longest.exp(),
        }
    }

    /// Range of ln(tau): from a tenth of a block (or a second) to 30 records.
    fn time_range(&self) -> (f64, f64) {
        ((0.1 * self.blocks.running as f64).max(0.5).ln(), (30.0 * self.length_s).ln())
    }

    fn best(&self, values: &DMatrix<f64>, modes: &Modes, start: [f64; 2]) -> Option<Best> {
        let rotated = &modes.vectors * values;
        let (shortest, longest) = self.time_range();
        let inside =
            |at: [f64; 2]| [at[0].clamp(shortest, longest), at[1].clamp(LN_NOISE.0, LN_NOISE.1)];
        let loss = |at: [f64; 2]| {
            let near = inside(at);
            let outside = (at[0] - near[0]).powi(2) + (at[1] - near[1]).powi(2);
            -self.profile(modes, &rotated, near).0 + 10.0 * outside
        };
        let at = inside(minimum(loss, inside(start)));
        let (log_likelihood, variance) = self.profile(modes, &rotated, at);
        let usable = log_likelihood.is_finite() && variance > 0.0;
        usable.then_some(Best { at, log_likelihood, variance })
    }

    /// Restricted log-likelihood at the best variance, and that variance.
    fn profile(&self, modes: &Modes, rotated: &DMatrix<f64>, at: [f64; 2]) -> (f64, f64) {
        let filter = BlockFilter::new(at[0].exp(), self.blocks.running);
        let noise = at[1].exp();
        let count = modes.variance.len();
        let (mut sum, mut ln_determinant) = (0.0, 0.0);
        for first in (0..count).step_by(LANES) {
            let (of_sum, of_ln) = if self.unknown.slope {
                self.some_modes::<true>(&filter, noise, (modes, rotated), first)
            } else {
                self.some_modes::<false>(&filter, noise, (modes, rotated), first)
            };
            sum += of_sum;
            ln_determinant += of_ln;
        }
        let free = count * (self.blocks.count() - 1 - usize::from(self.unknown.slope));
        let variance = sum / free as f64;
        (-0.5 * (free as f64 * (variance.ln() + 1.0) + ln_determinant), variance)
    }

    /// The sum of squares of some modes, [`LANES`] of them from the first on, without what means (and slopes) explain, and the
    /// logarithm of the determinant.
    fn some_modes<const SLOPE: bool>(
        &self,
        filter: &BlockFilter,
        noise: f64,
        (modes, rotated): (&Modes, &DMatrix<f64>),
        first: usize,
    ) -> (f64, f64) {
        let variances = modes.variance.get(first..).unwrap_or_default();
        let lanes = variances.len().min(LANES);
        let mut variance = [1.0; LANES];
        variance[..lanes].copy_from_slice(&variances[..lanes]);
        let mut p = variance;
        let [mut m, mut one, mut time] = [[0.0; LANES]; 3];
        // Sums over time of products of innovations: of the data, of 1 and of time.
        let [mut squares, mut s11, mut s1y, mut s1t, mut stt, mut sty] = [[0.0; LANES]; 6];
        let mut determinant = [1.0; LANES];
        let mut ln_determinant = 0.0;
        let blocks = self.blocks.count();
        let mut elapsed = 0.0;
        let half = self.blocks.steps.iter().sum::<usize>() as f64 / 2.0;
        for (block, (step, column)) in
            self.blocks.steps.iter().zip(rotated.column_iter()).enumerate()
        {
            if *step > 1 {
                let keep = filter.keep.powi(*step as i32 - 1);
                for lane in 0..LANES {
                    p[lane] = keep * keep * p[lane] + (1.0 - keep * keep) * variance[lane];
                    m[lane] *= keep;
                    one[lane] *= keep;
                    time[lane] *= keep;
                }
            }
            elapsed += *step as f64;
            let clock = (elapsed - half) / half;
            let mut data = [0.0; LANES];
            let values = column.as_slice().get(first..first + lanes).unwrap_or_default();
            data[..values.len()].copy_from_slice(values);
            for lane in 0..LANES {
                let (s, prior) = (variance[lane], p[lane]);
                let f = filter.a * filter.a * prior + filter.r * s + noise;
                let weight = 1.0 / f;
                let gain = (filter.keep * filter.a * prior + filter.qr * s) * weight;
                p[lane] = filter.keep * filter.keep * prior + filter.q * s - gain * gain * f;
                let v = data[lane] - filter.a * m[lane];
                m[lane] = filter.keep * m[lane] + gain * v;
                let v1 = 1.0 - filter.a * one[lane];
                one[lane] = filter.keep * one[lane] + gain * v1;
                squares[lane] += v * v * weight;
                s11[lane] += v1 * v1 * weight;
                s1y[lane] += v1 * v * weight;
                determinant[lane] *= f;
                if SLOPE {
                    let vt = clock - filter.a * time[lane];
                    time[lane] = filter.keep * time[lane] + gain * vt;
                    s1t[lane] += v1 * vt * weight;
                    stt[lane] += vt * vt * weight;
                    sty[lane] += vt * v * weight;
                }
            }
            if block % 16 == 15 || block + 1 == blocks {
                for determinant in &mut determinant[..lanes] {
                    ln_determinant += determinant.ln();
                    *determinant = 1.0;
                }
            }
        }
        let mut sum = 0.0;
        for lane in 0..lanes {
            sum += squares[lane] - s1y[lane] * s1y[lane] / s11[lane];
            ln_determinant += s11[lane].ln();
            if SLOPE {
                let rest = stt[lane] - s1t[lane] * s1t[lane] / s11[lane];
                let with = sty[lane] - s1t[lane] * s1y[lane] / s11[lane];
                sum -= with * with / rest;
                ln_determinant += rest.ln();
            }
        }
        (sum, ln_determinant)
    }
}

/// A process of first order averaged over blocks. With x the process at the end of the block before:
/// the next end is `keep x` plus noise of variance `q`, the block's mean `a x` plus noise of variance
/// `r`, and the two noises have the covariance `qr` (all times the variance of the process).
struct BlockFilter {
    keep: f64,
    a: f64,
    q: f64,
    r: f64,
    qr: f64,
}

impl BlockFilter {
    fn new(tau_s: f64, running: usize) -> Self {
        let one = (-1.0 / tau_s).exp();
        let n = running as f64;
        let keep = one.powi(running as i32);
        let sum: f64 = (0..running).map(|lag| one.powi(lag as i32)).sum();
        let mean_variance = (n + 2.0
            * (1..running).map(|lag| (n - lag as f64) * one.powi(lag as i32)).sum::<f64>())
            / (n * n);
        let a = one * sum / n;
        Self { keep, a, q: 1.0 - keep * keep, r: mean_variance - a * a, qr: sum / n - keep * a }
    }
}

/// Orthonormal rows that are orthogonal to a common value (Helmert's).
fn contrasts(count: usize) -> DMatrix<f64> {
    DMatrix::from_fn(count.saturating_sub(1), count, |row, column| {
        let n = (row + 1) as f64;
        match column {
            _ if column <= row => 1.0 / (n * (n + 1.0)).sqrt(),
            _ if column == row + 1 => -(n / (n + 1.0)).sqrt(),
            _ => 0.0,
        }
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{E, PI};

    use nalgebra::DVector;

    use super::*;

    const SECONDS: usize = 44;
    const RUNNING: usize = 4;

    /// Five drones with values that no process has made.
    fn field() -> Field {
        let places = vec![[0.0, 0.0], [20.0, 0.0], [3.0, 22.0], [24.0, 31.0], [50.0, 8.0]];
        let value = |drone: usize, second: usize| {
            ((drone + 1) as f64 * (second as f64 + 2.0) * E).sin() + 0.02 * second as f64
        };
        let row = |drone: usize| (0..SECONDS).map(|second| value(drone, second)).collect();
        let rows = (0..places.len()).map(row).collect();
        Field { places, rows, seconds: SECONDS, running: RUNNING }
    }

    /// The restricted log-likelihood at the best variance by the textbook: with the whole covariance.
    fn dense(field: &Field, blocks: &Blocks, unknown: Unknown, length_m: f64, at: [f64; 2]) -> f64 {
        let places: Vec<[f64; 2]> =
            blocks.drones.iter().map(|drone| field.places[*drone]).collect();
        let mut space = covariance(&places, [length_m; 2]);
        let mut values = blocks.take(&field.columns());
        if unknown.common {
            let contrasts = contrasts(places.len());
            space = &contrasts * space * contrasts.transpose();
            values = contrasts * values;
        }
        let (rows, count) = values.shape();
        let starts: Vec<usize> = blocks
            .steps
            .iter()
            .scan(0, |sum, step| {
                *sum += step;
                Some(*sum)
            })
            .collect();
        let time = DMatrix::from_fn(count, count, |one, other| {
            let seconds = |block: usize| (0..RUNNING).map(move |s| (block * RUNNING + s) as f64);
            let each = seconds(starts[one]).flat_map(|a| {
                seconds(starts[other]).map(move |b| (-(a - b).abs() / at[0].exp()).exp())
            });
            each.sum::<f64>() / (RUNNING * RUNNING) as f64
        });
        let whole =
            space.kronecker(&time) + DMatrix::identity(rows * count, rows * count) * at[1].exp();
        let y = DVector::from_fn(rows * count, |place, _| values[(place / count, place % count)]);
        let half = blocks.steps.iter().sum::<usize>() as f64 / 2.0;
        let powers = 1 + usize::from(unknown.slope);
        let x = DMatrix::from_fn(rows * count, rows * powers, |place, column| {
            let clock = (starts[place % count] as f64 - half) / half;
            let is_own = column / powers == place / count;
            if is_own { clock.powi((column % powers) as i32) } else { 0.0 }
        });
        let factor = whole.cholesky().unwrap();
        let normal = (x.transpose() * factor.solve(&x)).cholesky().unwrap();
        let right = x.transpose() * factor.solve(&y);
        let squares = y.dot(&factor.solve(&y)) - right.dot(&normal.solve(&right));
        let free = (rows * (count - powers)) as f64;
        let ln_det =
            |l: DMatrix<f64>| 2.0 * l.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let dets = ln_det(factor.l()) + ln_det(normal.l());
        -0.5 * (free * ((squares / free).ln() + 1.0) + dets)
    }

    #[test]
    fn it_is_the_restricted_likelihood_of_the_whole_covariance() {
        let mut with_gap = field();
        for row in &mut with_gap.rows {
            row[17..19].fill(f64::NAN);
        }
        // More modes than are filtered side by side, and not a multiple of them.
        let mut more = field();
        let value = |drone: usize, second: usize| {
            ((drone + 1) as f64 * (second as f64 + 2.0) * E).sin() + 0.02 * second as f64
        };
        for drone in more.rows.len()..LANES + 3 {
            more.places.push([11.0 * drone as f64, 7.0 * (drone % 4) as f64]);
            more.rows.push((0..SECONDS).map(|second| value(drone, second)).collect());
        }
        for field in [field(), with_gap, more] {
            let blocks = Blocks::of(&field).unwrap();
            for (slope, common) in [(false, false), (true, false), (false, true), (true, true)] {
                let unknown = Unknown { slope, common };
                let likelihood = Likelihood::new(&field, &blocks, unknown);
                let values = blocks.take(&field.columns());
                for (place, tau_s, noise) in [(4, 3.0_f64, 0.2_f64), (9, 15.0 * PI, 0.01)] {
                    let modes = &likelihood.grid[place];
                    let at = [tau_s.ln(), noise.ln()];
                    let (found, _) = likelihood.profile(modes, &(&modes.vectors * &values), at);
                    let wanted = dense(&field, &blocks, unknown, modes.ln_length.exp(), at);
                    assert!((found - wanted).abs() < 1e-6, "{unknown:?}: {found} {wanted}");
                }
            }
        }
    }

    #[test]
    fn a_gap_is_no_value() {
        let whole = Blocks::of(&field()).unwrap();
        let mut field = field();
        // One drone misses most of the record, all others one block.
        field.rows[3][10..].fill(f64::NAN);
        for row in &mut field.rows {
            row[whole.seconds[5]] = f64::NAN;
        }
        let blocks = Blocks::of(&field).unwrap();
        assert_eq!(blocks.drones, [0, 1, 2, 4]);
        assert_eq!(blocks.count(), whole.count() - 1);
        assert_eq!(blocks.steps.iter().max(), Some(&2));
        let values = blocks.take(&field.columns());
        assert!(values.iter().all(|value| value.is_finite()), "no number stands for a gap");
        assert_eq!(values[(3, 0)], field.rows[4][blocks.seconds[0]]);
    }

    #[test]
    fn between_three_lengths_the_top_of_their_parabola_is_taken() {
        let field = field();
        let blocks = Blocks::of(&field).unwrap();
        let likelihood = Likelihood::new(&field, &blocks, Unknown { slope: false, common: false });
        // What is largest 0.3 steps above the middle; all else goes evenly with the step.
        let best = |step: f64| Best {
            at: [2.0 + 0.1 * step, -1.0],
            log_likelihood: 7.0 - 2.0 * (step - 0.3).powi(2),
            variance: (0.5 + 0.2 * step).exp(),
        };
        let found = likelihood.between(4, Some(best(-1.0)), best(0.0), Some(best(1.0)));
        assert!((found.tau_s.ln() - 2.03).abs() < 1e-9, "{}", found.tau_s);
        let ln_length = likelihood.grid[4].ln_length + 0.3 * STEP;
        assert!((found.lambda_m.ln() - ln_length).abs() < 1e-9, "{}", found.lambda_m);
        assert!((found.sd_mps.ln() - 0.28).abs() < 1e-9, "{}", found.sd_mps);
    }
}
