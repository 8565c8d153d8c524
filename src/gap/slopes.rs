//! How the likelihood of a filter changes with its states and observations: reverse differentiation of the
//! covariances for the determinant, and recursions in the order of time for the squares.

use super::filter::{Filter, Observation, run};

/// Derivatives of something by what a filter was made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Slopes {
    /// By the variance of each state.
    pub variance: Vec<f64>,
    /// By the logarithm of each state's time scale.
    pub log_time: Vec<f64>,
    /// By the variance of each observation's noise.
    pub noise: Vec<f64>,
    /// By the factors of each observation, in the order in which it has them.
    pub factors: Vec<Vec<f64>>,
}

impl Slopes {
    /// None, in the shape of a filter.
    pub(super) fn zero(filter: &Filter) -> Self {
        let looks = |seen: &Observation| vec![0.0; seen.looks_at.len()];
        Self {
            variance: vec![0.0; filter.states.len()],
            log_time: vec![0.0; filter.states.len()],
            noise: vec![0.0; filter.observations.len()],
            factors: filter.observations.iter().map(looks).collect(),
        }
    }

    /// Adds those of `times` the logarithm of the covariance's determinant.
    pub(super) fn add_log_det(&mut self, filter: &Filter, times: f64) {
        let dim = filter.states.len();
        let mut covariances = Vec::with_capacity(filter.observations.len() * dim * dim);
        let mut crosses = Vec::with_capacity(filter.observations.len() * dim);
        let mut decays = Vec::with_capacity(filter.observations.len() * dim);
        let mut variances = Vec::with_capacity(filter.observations.len());
        run(&filter.states, &filter.observations, |seen| {
            covariances.extend_from_slice(seen.covariance);
            crosses.extend_from_slice(seen.cross);
            decays.extend_from_slice(seen.decay);
            variances.push(seen.variance);
        });
        // By each element of the covariance, both halves; first after an observation, then before it.
        let mut by = vec![0.0; dim * dim];
        let mut by_cross = vec![0.0; dim];
        for (place, seen) in filter.observations.iter().enumerate().rev() {
            let cross = &crosses[place * dim..][..dim];
            let variance = variances[place];
            for (row, by_cross) in by_cross.iter_mut().enumerate() {
                let product = by[row * dim..][..dim].iter().zip(cross).map(|(a, b)| a * b);
                *by_cross = -product.sum::<f64>() / variance;
            }
            let twice: f64 = -by_cross.iter().zip(cross).map(|(a, b)| a * b).sum::<f64>();
            let by_variance = (times + twice) / variance;
            for by in &mut by_cross {
                *by *= 2.0;
            }
            self.noise[place] += by_variance;
            for (index, (state, factor)) in seen.looks_at.iter().enumerate() {
                self.factors[place][index] += by_variance * cross[*state];
                by_cross[*state] += by_variance * factor;
            }
            let covariance = &covariances[place * dim * dim..][..dim * dim];
            let at = |a: usize, b: usize| covariance[a.max(b) * dim + a.min(b)];
            for (index, (state, factor)) in seen.looks_at.iter().enumerate() {
                let product = by_cross.iter().enumerate().map(|(row, by)| by * at(row, *state));
                self.factors[place][index] += product.sum::<f64>();
                // Half to either side: the matrix stays symmetric.
                for (row, by_cross) in by_cross.iter().enumerate() {
                    by[row * dim + state] += 0.5 * by_cross * factor;
                    by[state * dim + row] += 0.5 * by_cross * factor;
                }
            }
            let Some(before) = place.checked_sub(1) else { break };
            let elapsed_s = seen.time_s - filter.observations[before].time_s;
            if elapsed_s <= 0.0 {
                continue;
            }
            let decay = &decays[place * dim..][..dim];
            for (row, state) in filter.states.iter().enumerate() {
                let kept = decay[row] * decay[row];
                let by_row = &by[row * dim..][..dim];
                let mut slope: f64 =
                    by_row.iter().enumerate().map(|(column, by)| by * at(row, column)).sum();
                // What is kicked comes the less, the more is kept.
                slope -= by_row[row] * state.variance;
                self.log_time[row] += 2.0 * slope * elapsed_s / state.time_s;
                self.variance[row] += by_row[row] * (1.0 - kept);
            }
            for row in 0..dim {
                for column in 0..dim {
                    by[row * dim + column] *= decay[row] * decay[column];
                }
            }
        }
        // What the states begin with.
        for (row, slope) in self.variance.iter_mut().enumerate() {
            *slope += by[row * dim + row];
        }
    }

    /// Adds those of `times` w' C w, C being the covariance and w a weighed series that stays as it is.
    pub(super) fn add_square(&mut self, filter: &Filter, weighed: &[f64], times: f64) {
        let seen = &filter.observations;
        for ((slope, weighed), _) in self.noise.iter_mut().zip(weighed).zip(seen) {
            *slope += times * weighed * weighed;
        }
        // Of each state: what was heard before, and that times how long ago.
        let dim = filter.states.len();
        let (mut heard, mut ago) = (vec![0.0; dim], vec![0.0; dim]);
        for forward in [true, false] {
            heard.fill(0.0);
            ago.fill(0.0);
            let mut before_s = None;
            let (mut last_s, mut decay) = (f64::NAN, vec![1.0; dim]);
            for step in 0..seen.len() {
                let place = if forward { step } else { seen.len() - 1 - step };
                let time_s = seen[place].time_s;
                let apart_s = before_s.map_or(0.0, |before_s: f64| (time_s - before_s).abs());
                before_s = Some(time_s);
                if apart_s != last_s {
                    last_s = apart_s;
                    for (decay, state) in decay.iter_mut().zip(&filter.states) {
                        *decay = (-apart_s / state.time_s).exp();
                    }
                }
                if apart_s > 0.0 {
                    for state in 0..dim {
                        ago[state] = decay[state] * (ago[state] + apart_s * heard[state]);
                        heard[state] *= decay[state];
                    }
                }
                for (index, (state, factor)) in seen[place].looks_at.iter().enumerate() {
                    let variance = filter.states[*state].variance;
                    let own = factor * weighed[place];
                    self.factors[place][index] +=
                        2.0 * times * variance * weighed[place] * heard[*state];
                    if forward {
                        self.factors[place][index] += 2.0 * times * variance * weighed[place] * own;
                        self.variance[*state] += times * own * (2.0 * heard[*state] + own);
                        self.log_time[*state] += 2.0 * times * variance * own * ago[*state]
                            / filter.states[*state].time_s;
                    }
                }
                for (state, factor) in &seen[place].looks_at {
                    heard[*state] += factor * weighed[place];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::filter::tests::{case, covariance};
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn they_are_those_of_the_dense_covariance() {
        let weighed: Vec<f64> = (0..12).map(|index| f64::from(index * index % 7) - 2.5).collect();
        let (times, square_times) = (0.7, -0.3);
        let (states, observations) = case();
        let filter = Filter::new(states.clone(), observations.clone());
        let mut slopes = Slopes::zero(&filter);
        slopes.add_log_det(&filter, times);
        slopes.add_square(&filter, &weighed, square_times);
        let vector = DVector::from_vec(weighed);
        let value = |states: &[_], observations: &[_]| -> f64 {
            let dense = covariance(states, observations);
            let square = vector.dot(&(&dense * &vector));
            let factor = dense.cholesky().unwrap();
            let log_det: f64 = factor.l().diagonal().iter().map(|value| 2.0 * value.ln()).sum();
            times * log_det + square_times * square
        };
        let step = 1e-5;
        let quotient = |change: &dyn Fn(&mut Vec<_>, &mut Vec<_>, f64)| {
            let at = |by: f64| {
                let (mut states, mut observations) = (states.clone(), observations.clone());
                change(&mut states, &mut observations, by);
                value(&states, &observations)
            };
            (at(step) - at(-step)) / (2.0 * step)
        };
        let near = |slope: f64, quotient: f64, what: &str| {
            let allowed = 1e-6 * (1.0 + quotient.abs());
            assert!((slope - quotient).abs() < allowed, "{what}: {slope} {quotient}");
        };
        for state in 0..states.len() {
            let by = quotient(&|states, _, by| states[state].variance += by);
            near(slopes.variance[state], by, "variance");
            let by = quotient(&|states, _, by| states[state].time_s *= by.exp());
            near(slopes.log_time[state], by, "time");
        }
        for place in 0..observations.len() {
            let by = quotient(&|_, seen, by| seen[place].noise += by);
            near(slopes.noise[place], by, "noise");
            for look in 0..observations[place].looks_at.len() {
                let by = quotient(&|_, seen, by| seen[place].looks_at[look].1 += by);
                near(slopes.factors[place][look], by, "factor");
            }
        }
    }
}
