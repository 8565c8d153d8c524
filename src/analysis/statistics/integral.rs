//! Integral time of the vertical air speed: how slowly the mean over a record settles.
//!
//! The mean over a time `t` that is long against the integral time T of the air is off by
//! `sigma sqrt(2 T / t)` (Lenschow, Mann and Kristensen 1994). Sums over an autocorrelation read T too short, because
//! the record's own mean is taken out of it. Here T is that of the likeliest process whose mean is not known
//! (restricted likelihood): slow air with an exponential correlation, seen through means over blocks, with what is
//! quicker than a block as white noise.

use rayon::prelude::*;

use crate::numeric::Moments;

/// Length of a block, s: gusts of a second or two are noise in it. Chosen.
const BLOCK_S: usize = 5;
/// Most blocks of a record; longer records have longer blocks.
const MOST_BLOCKS: usize = 2_000;
/// Fewest blocks of a drone.
const FEWEST_BLOCKS: usize = 10;
/// Most drones that are looked at, evenly over the fleet: more see the same air.
const MOST_DRONES: usize = 64;
/// Shortest integral time that is tried, as a share of a block.
const SHORTEST_SHARE: f64 = 0.2;
/// Integral times that are tried, in equal factors. Numerical: a factor of 1.2 over a record of 600 s.
const TIMES: usize = 36;
/// Shares of white noise in the variance that are tried.
const NOISES: [f64; 9] = [0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9];
/// An interval whose upper end is this near to the longest time that was tried is open: the record does not bound it.
const OPEN_SHARE: f64 = 0.8;

/// A quantity with its posterior median and 95 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// Median of the posterior.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// How slowly the means of some records settle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settling {
    /// Standard deviation of the slow air, m/s.
    pub sd_mps: Known,
    /// Integral time of the slow air, s.
    pub time_s: Known,
    /// Variance of a mean times its length, (m/s)² s: `2 sigma² T` and what the noise adds.
    pub density: Known,
    /// Whether the record does not bound the integral time from above.
    pub is_open: bool,
}

impl Settling {
    /// Standard error of a mean over `length_s`, m/s.
    pub fn error_mps(&self, length_s: f64) -> f64 {
        (self.density.value / length_s.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// How long a mean must be for a standard error, s.
    pub fn length_s(&self, error_mps: f64) -> Known {
        let length = |density: f64| density / (error_mps * error_mps);
        Known { value: length(self.density.value), interval: self.density.interval.map(length) }
    }
}

/// What one process makes of all records.
struct Tried {
    time_s: f64,
    noise: f64,
    log_likelihood: f64,
    /// Variance scale that fits best.
    scale: f64,
}

/// How slowly means settle, from values each second (`None` in gaps) of one or more drones; `None` where the records
/// are too short or do not move.
pub fn settling(records: &[&[Option<f64>]]) -> Option<Settling> {
    let longest = records.iter().map(|record| record.len()).max()?;
    let block = BLOCK_S.max(longest.div_ceil(MOST_BLOCKS));
    let step = records.len().div_ceil(MOST_DRONES).max(1);
    let blocks: Vec<Vec<Option<f64>>> = records
        .iter()
        .step_by(step)
        .map(|record| record.chunks_exact(block).map(mean_of_block).collect())
        .filter(|blocks: &Vec<Option<f64>>| blocks.iter().flatten().count() >= FEWEST_BLOCKS)
        .collect();
    let block_s = block as f64;
    let freedom: usize = blocks.iter().map(|one| one.iter().flatten().count() - 1).sum();
    if blocks.is_empty() {
        return None;
    }
    let (first_s, last_s) = (SHORTEST_SHARE * block_s, longest as f64);
    let tried: Vec<Tried> = (0..TIMES * NOISES.len())
        .into_par_iter()
        .filter_map(|index| {
            let share = (index / NOISES.len()) as f64 / (TIMES - 1) as f64;
            let time_s = first_s * (last_s / first_s).powf(share);
            let noise = NOISES[index % NOISES.len()];
            let (log_likelihood, scale) =
                Process::new(time_s, noise, block_s).likelihood(&blocks, freedom)?;
            Some(Tried { time_s, noise, log_likelihood, scale })
        })
        .collect();
    let best =
        tried.iter().max_by(|one, other| one.log_likelihood.total_cmp(&other.log_likelihood))?;
    // Drones in the same air are fewer than they are.
    let counted = independent(&blocks, (-block_s / best.time_s).exp()) / blocks.len() as f64;
    let weights: Vec<f64> = tried
        .iter()
        .map(|one| ((one.log_likelihood - best.log_likelihood) * counted).exp())
        .collect();
    let of_scale = (2.0 / (freedom as f64 * counted).max(1.0)).sqrt();
    let of_grid = 0.5 * (last_s / first_s).ln() / (TIMES - 1) as f64;
    let known = |value: &dyn Fn(&Tried) -> f64, spread: f64| {
        let parts: Vec<(f64, f64)> =
            tried.iter().zip(&weights).map(|(one, weight)| (value(one).ln(), *weight)).collect();
        let at = |share| quantile(&parts, spread, share).exp();
        Known { value: at(0.5), interval: [at(0.025), at(0.975)] }
    };
    let time_s = known(&|one| one.time_s, of_grid);
    Some(Settling {
        sd_mps: known(&|one| (one.scale * (1.0 - one.noise)).sqrt(), 0.5 * of_scale),
        time_s,
        density: known(
            &|one| one.scale * ((1.0 - one.noise) * 2.0 * one.time_s + one.noise * block_s),
            of_scale.hypot(of_grid),
        ),
        is_open: time_s.interval[1] > OPEN_SHARE * last_s,
    })
}

fn mean_of_block(seconds: &[Option<f64>]) -> Option<f64> {
    let known: Option<Vec<f64>> =
        seconds.iter().map(|value| value.filter(|value| value.is_finite())).collect();
    crate::numeric::mean(&known?)
}

/// The drones that would tell as much if no two saw the same air.
fn independent(blocks: &[Vec<Option<f64>>], one_block: f64) -> f64 {
    let drones = blocks.len();
    let moments = |values: &[Option<f64>]| {
        let moments = Moments::of(values.iter().flatten().copied())?;
        let mean = crate::numeric::mean(values.iter().flatten())?;
        Some((mean, moments.deviation()?))
    };
    let known: Vec<Option<(f64, f64)>> = blocks.iter().map(|one| moments(one)).collect();
    let (mut squares, mut pairs, mut length) = (0.0, 0.0, 0.0);
    for (one, of_one) in blocks.iter().zip(&known) {
        for (other, of_other) in blocks.iter().zip(&known) {
            let (Some((mean, sd)), Some((other_mean, other_sd))) = (of_one, of_other) else {
                continue;
            };
            if std::ptr::eq(one, other) || *sd <= 0.0 || *other_sd <= 0.0 {
                continue;
            }
            let both = one.iter().zip(other).filter_map(|(left, right)| left.zip(*right));
            let products: Vec<f64> =
                both.map(|(left, right)| (left - mean) * (right - other_mean)).collect();
            let correlation = crate::numeric::mean(&products).unwrap_or_default() / (sd * other_sd);
            squares += correlation * correlation;
            pairs += 1.0;
            length += products.len() as f64;
        }
    }
    if pairs == 0.0 {
        return drones as f64;
    }
    // Slow records that have nothing in common correlate by chance.
    let square = one_block * one_block;
    let by_chance = (pairs / length * (1.0 + square) / (1.0 - square)).min(0.9);
    let shared = ((squares / pairs - by_chance) / (1.0 - by_chance)).clamp(0.0, 1.0);
    drones as f64 / (1.0 + (drones as f64 - 1.0) * shared)
}

/// The value below which a share of a mixture of normal distributions of one spread lies.
fn quantile(parts: &[(f64, f64)], spread: f64, share: f64) -> f64 {
    let all: f64 = parts.iter().map(|(_, weight)| weight).sum();
    let spread = spread.max(1e-9);
    let below = |at: f64| -> f64 {
        let one = |(value, weight): &(f64, f64)| {
            let z = (at - value) / spread;
            weight * 0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)
        };
        parts.iter().map(one).sum::<f64>() / all
    };
    let ends = parts.iter().map(|(value, _)| *value);
    let (mut low, mut high) = (
        ends.clone().fold(f64::INFINITY, f64::min) - 6.0 * spread,
        ends.fold(f64::NEG_INFINITY, f64::max) + 6.0 * spread,
    );
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if below(middle) < share { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

/// Slow air of unit variance and white noise, seen through means over blocks.
struct Process {
    /// Correlation over a block.
    decay: f64,
    /// Change of a block's mean with the air at its start.
    lead: f64,
    /// Variance of a block's mean that the air at its start leaves.
    left: f64,
    /// Covariance of a block's mean and the air at its end that the air at its start leaves.
    left_with_end: f64,
    air: f64,
    noise: f64,
}

impl Process {
    fn new(time_s: f64, noise: f64, block_s: f64) -> Self {
        let ratio = time_s / block_s;
        let decay = (-1.0 / ratio).exp();
        let lead = ratio * (1.0 - decay);
        Self {
            decay,
            lead,
            left: (2.0 * ratio * (1.0 - lead) - lead * lead).max(0.0),
            left_with_end: lead * (1.0 - decay),
            air: 1.0 - noise,
            noise,
        }
    }

    /// Restricted log likelihood of all records, each with a mean of its own, and the scale of the variance that
    /// fits best; `None` where nothing moves.
    fn likelihood(&self, records: &[Vec<Option<f64>>], freedom: usize) -> Option<(f64, f64)> {
        let (mut squares, mut determinants) = (0.0, 0.0);
        for record in records {
            let (mut mean, mut variance) = ([0.0; 2], self.air);
            let (mut ones, mut both, mut values) = (0.0, 0.0, 0.0);
            for value in record {
                let end = mean.map(|one| self.decay * one);
                let end_variance =
                    self.decay * self.decay * variance + self.air * (1.0 - self.decay * self.decay);
                let Some(value) = value else {
                    (mean, variance) = (end, end_variance);
                    continue;
                };
                let seen = self.lead * self.lead * variance + self.air * self.left + self.noise;
                let with_end = self.decay * self.lead * variance + self.air * self.left_with_end;
                let new = [value - self.lead * mean[0], 1.0 - self.lead * mean[1]];
                values += new[0] * new[0] / seen;
                both += new[0] * new[1] / seen;
                ones += new[1] * new[1] / seen;
                determinants += seen.ln();
                mean = [0, 1].map(|index| end[index] + with_end / seen * new[index]);
                variance = (end_variance - with_end * with_end / seen).max(0.0);
            }
            squares += values - both * both / ones;
            determinants += ones.ln();
        }
        let scale = squares / freedom as f64;
        let known = scale > 0.0 && scale.is_finite() && determinants.is_finite();
        known.then(|| (-0.5 * (determinants + freedom as f64 * scale.ln()), scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::{Purpose, stream};
    use rand_distr::{Distribution as _, StandardNormal};

    /// A record of slow air and noise, each second.
    fn record(
        seed: u64,
        sd_mps: f64,
        time_s: f64,
        noise_mps: f64,
        seconds: usize,
    ) -> Vec<Option<f64>> {
        let mut rng = stream(31, seed, Purpose::Sensors);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        // Ten steps in a second: means over seconds, as logs give them.
        let decay = (-0.1 / time_s).exp();
        let mut air = sd_mps * normal();
        (0..seconds)
            .map(|_| {
                let mut sum = 0.0;
                for _ in 0..10 {
                    air = decay * air + sd_mps * (1.0 - decay * decay).sqrt() * normal();
                    sum += air / 10.0;
                }
                Some(0.7 + sum + noise_mps * normal())
            })
            .collect()
    }

    fn of(records: &[Vec<Option<f64>>]) -> Settling {
        settling(&records.iter().map(Vec::as_slice).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn records_of_a_known_time_are_read_with_intervals_that_hold() {
        const SEEDS: u64 = 120;
        // Standard deviation and time of the air, noise of a second, drones, length.
        let cases = [
            (0.5, 5.0, 0.0, 1, 300),
            (0.5, 20.0, 0.2, 1, 600),
            (0.3, 40.0, 0.1, 4, 600),
            (0.4, 10.0, 0.5, 1, 900),
        ];
        for (case, (sd, time_s, noise, drones, seconds)) in cases.into_iter().enumerate() {
            let density = 2.0 * sd * sd * time_s + noise * noise;
            let (mut inside, mut times_inside, mut logs) = (0, 0, 0.0);
            for seed in 0..SEEDS {
                let records: Vec<_> = (0..drones)
                    .map(|drone| {
                        let stream = 1000 * case as u64 + 10 * seed + drone;
                        record(stream, sd, time_s, noise, seconds)
                    })
                    .collect();
                let found = of(&records);
                let holds = |known: Known, truth: f64| {
                    usize::from((known.interval[0]..=known.interval[1]).contains(&truth))
                };
                inside += holds(found.density, density);
                times_inside += holds(found.time_s, time_s);
                logs += (found.density.value / density).ln() / SEEDS as f64;
            }
            let share = |count: usize| count as f64 / SEEDS as f64;
            // 95 % of 120 draws are 109 to 118 with a probability of 95 %.
            let told = format!(
                "case {case}: {:.3} {:.3} inside, ratio {:.3}",
                share(inside),
                share(times_inside),
                logs.exp()
            );
            assert!((0.9..=0.995).contains(&share(inside)), "{told}");
            assert!(share(times_inside) >= 0.9, "{told}");
            assert!((0.7..1.4).contains(&logs.exp()), "{told}");
        }
    }

    #[test]
    fn means_of_such_records_scatter_as_foretold() {
        // 200 records of 600 s: their means scatter by sigma sqrt(2 T / t).
        let means: Vec<f64> = (0..200)
            .map(|seed| {
                let values = record(9000 + seed, 0.5, 10.0, 0.0, 600);
                crate::numeric::mean(values.iter().flatten()).unwrap()
            })
            .collect();
        let scatter = Moments::of(means).unwrap().deviation().unwrap();
        let expected = 0.5 * (2.0_f64 * 10.0 / 600.0).sqrt();
        assert!((scatter / expected - 1.0).abs() < 0.15, "{scatter} {expected}");
        let density = Known { value: 5.0, interval: [4.0, 8.0] };
        let settling = Settling { density, ..Settling::default() };
        assert!((settling.error_mps(600.0) - expected).abs() < 1e-12);
        assert_eq!(settling.length_s(0.5), Known { value: 20.0, interval: [16.0, 32.0] });
    }

    #[test]
    fn drones_in_the_same_air_are_one() {
        let one = record(7, 0.5, 10.0, 0.0, 600);
        let alone = of(std::slice::from_ref(&one));
        let same = of(&vec![one; 9]);
        for (left, right) in alone.time_s.interval.into_iter().zip(same.time_s.interval) {
            assert!((left / right - 1.0).abs() < 0.1, "{alone:?} {same:?}");
        }
        let others =
            of(&(0..9).map(|seed| record(70 + seed, 0.5, 10.0, 0.0, 600)).collect::<Vec<_>>());
        let width = |found: Settling| found.time_s.interval[1] / found.time_s.interval[0];
        assert!(width(others) < 0.8 * width(alone), "{others:?} {alone:?}");
    }

    #[test]
    fn a_drift_is_open_and_what_cannot_be_told_is_not() {
        let drift: Vec<Option<f64>> =
            (0..300).map(|second| Some(f64::from(second) * 0.01)).collect();
        assert!(settling(&[&drift]).unwrap().is_open);
        assert_eq!(settling(&[]), None);
        assert_eq!(settling(&[&drift[..49]]), None, "too short");
        assert_eq!(settling(&[&vec![Some(0.0); 300][..]]), None, "it does not move");
        let mut gappy = record(3, 0.5, 10.0, 0.0, 600);
        gappy.iter_mut().step_by(50).for_each(|value| *value = None);
        let found = of(&[gappy]);
        assert!((2.0..40.0).contains(&found.time_s.value), "{found:?}");
    }
}
