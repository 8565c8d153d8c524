//! How the likelihood of a filter changes with its states and observations: reverse differentiation of the
//! covariances for the determinant, and recursions in the order of time for the squares.

use super::filter::{BLOCK, Filter, Known, Observation, State, Wide, add, blocks};

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
        match blocks(filter.states.len()) {
            2 => self.add_log_det_wide(Known::<2>, filter, times),
            3 => self.add_log_det_wide(Known::<3>, filter, times),
            5 => self.add_log_det_wide(Known::<5>, filter, times),
            other => self.add_log_det_wide(other, filter, times),
        }
    }

    fn add_log_det_wide(&mut self, wide: impl Wide, filter: &Filter, times: f64) {
        let (dim, wide) = (filter.states.len(), wide.blocks());
        let Filter { covariances, crosses, variances, .. } = filter;
        // By each element of the covariance, both halves; first after an observation, then before it.
        let mut by = vec![[0.0; BLOCK]; dim * wide];
        let mut sums = vec![[0.0; BLOCK]; wide];
        let mut by_cross = vec![0.0; dim];
        for (place, seen) in filter.observations.iter().enumerate().rev() {
            let cross = &crosses[place * dim..][..dim];
            let variance = variances[place];
            // Rows are columns: sums over either are taken side by side.
            sums.fill([0.0; BLOCK]);
            for (by, cross) in by.chunks_exact(wide).zip(cross) {
                for (sums, by) in sums.iter_mut().zip(by) {
                    add(sums, *cross, by);
                }
            }
            for (by_cross, sum) in by_cross.iter_mut().zip(sums.as_flattened()) {
                *by_cross = -sum / variance;
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
            let covariance = &covariances[place * dim * wide..][..dim * wide];
            sums.fill([0.0; BLOCK]);
            for (values, by) in covariance.chunks_exact(wide).zip(&by_cross) {
                for (sums, values) in sums.iter_mut().zip(values) {
                    add(sums, *by, values);
                }
            }
            for (index, (state, factor)) in seen.looks_at.iter().enumerate() {
                self.factors[place][index] += sums.as_flattened()[*state];
                // Half to either side: the matrix stays symmetric.
                let row = by[state * wide..][..wide].as_flattened_mut();
                for (value, by_cross) in row.iter_mut().zip(&by_cross) {
                    *value += 0.5 * by_cross * factor;
                }
                let (column, part) = (state / BLOCK, state % BLOCK);
                for (row, by_cross) in by.chunks_exact_mut(wide).zip(&by_cross) {
                    row[column][part] += 0.5 * by_cross * factor;
                }
            }
            let Some(before) = place.checked_sub(1) else { break };
            let elapsed_s = seen.time_s - filter.observations[before].time_s;
            if elapsed_s <= 0.0 {
                continue;
            }
            let decay = filter.decay(place);
            sums.fill([0.0; BLOCK]);
            for (by, values) in by.chunks_exact(wide).zip(covariance.chunks_exact(wide)) {
                for ((sums, by), values) in sums.iter_mut().zip(by).zip(values) {
                    for ((sum, by), value) in sums.iter_mut().zip(by).zip(values) {
                        *sum += by * value;
                    }
                }
            }
            for (row, state) in filter.states.iter().enumerate() {
                let kept = decay[row] * decay[row];
                let own = by[row * wide + row / BLOCK][row % BLOCK];
                // What is kicked comes the less, the more is kept.
                let slope = sums.as_flattened()[row] - own * state.variance;
                self.log_time[row] += 2.0 * slope * elapsed_s / state.time_s;
                self.variance[row] += own * (1.0 - kept);
            }
            for (values, by) in by.chunks_exact_mut(wide).zip(decay) {
                for (value, decay) in values.as_flattened_mut().iter_mut().zip(decay) {
                    *value *= by * decay;
                }
            }
        }
        // What the states begin with.
        for (row, slope) in self.variance.iter_mut().enumerate() {
            *slope += by[row * wide + row / BLOCK][row % BLOCK];
        }
    }

    /// Adds those of `times` w' C w, C being the covariance and w weighed series, one after another, that stay as they
    /// are.
    pub(super) fn add_squares(&mut self, filter: &Filter, weighed: &[f64], times: f64) {
        let bins = filter.observations.len().max(1);
        let in_order = |seen: &Observation| {
            seen.looks_at.len() == filter.states.len()
                && seen.looks_at.iter().enumerate().all(|(index, (state, _))| index == *state)
        };
        let side_by_side = filter.states.len() <= MOST && filter.observations.iter().all(in_order);
        for series in weighed.chunks_exact(bins) {
            for (slope, weighed) in self.noise.iter_mut().zip(series) {
                *slope += times * weighed * weighed;
            }
            if !side_by_side {
                self.add_square(filter, series, times);
            }
        }
        if side_by_side {
            self.add_side_by_side(filter, weighed, times);
        }
    }

    /// What noise has no part in, of one series.
    fn add_square(&mut self, filter: &Filter, weighed: &[f64], times: f64) {
        let seen = &filter.observations;
        // Of each state: what was heard before, and that times how long ago.
        let dim = filter.states.len();
        let (mut heard, mut ago) = (vec![0.0; dim], vec![0.0; dim]);
        for forward in [true, false] {
            heard.fill(0.0);
            for step in 0..seen.len() {
                let place = if forward { step } else { seen.len() - 1 - step };
                let later = if forward { place } else { place + 1 };
                if step > 0 {
                    let apart_s = seen[later].time_s - seen[later - 1].time_s;
                    let decay = filter.decay(later);
                    for ((heard, ago), decay) in heard.iter_mut().zip(&mut ago).zip(decay) {
                        *ago = decay * (*ago + apart_s * *heard);
                        *heard *= decay;
                    }
                }
                let looks = seen[place].looks_at.iter().zip(&mut self.factors[place]);
                for ((state, factor), slope) in looks {
                    let State { variance, time_s } = filter.states[*state];
                    let own = factor * weighed[place];
                    let twice = 2.0 * times * variance;
                    *slope += twice * weighed[place] * heard[*state];
                    if forward {
                        *slope += twice * weighed[place] * own;
                        self.variance[*state] += times * own * (2.0 * heard[*state] + own);
                        self.log_time[*state] += twice * own * ago[*state] / time_s;
                    }
                }
                for (state, factor) in &seen[place].looks_at {
                    heard[*state] += factor * weighed[place];
                }
            }
        }
    }

    /// As [`Slopes::add_square`] of many series, where each observation looks at all states in their order: the states
    /// side by side.
    fn add_side_by_side(&mut self, filter: &Filter, weighed: &[f64], times: f64) {
        let each = |of: &dyn Fn(&State) -> f64| {
            let mut values = [0.0; MOST];
            values.iter_mut().zip(&filter.states).for_each(|(value, state)| *value = of(state));
            values
        };
        let twice = each(&|state| 2.0 * times * state.variance);
        let mut time_s = each(&|state| state.time_s);
        time_s[filter.states.len()..].fill(f64::INFINITY);
        let mut before_s = None;
        let mut looks: Vec<Look> = Vec::with_capacity(filter.observations.len());
        for (place, seen) in filter.observations.iter().enumerate() {
            let apart_s = before_s.map_or(0.0, |before_s| seen.time_s - before_s);
            let mut look = Look { apart_s, ..Look::default() };
            before_s = Some(seen.time_s);
            let each = look.factors.iter_mut().zip(&mut look.slopes);
            let known = seen.looks_at.iter().zip(&self.factors[place]);
            for ((own, sum), ((_, factor), slope)) in each.zip(known) {
                (*own, *sum) = (*factor, *slope);
            }
            look.decay.iter_mut().zip(filter.decay(place)).for_each(|(own, decay)| *own = *decay);
            looks.push(look);
        }
        let mut variance = [0.0; MOST];
        let mut log_time = [0.0; MOST];
        variance.iter_mut().zip(&self.variance).for_each(|(own, slope)| *own = *slope);
        log_time.iter_mut().zip(&self.log_time).for_each(|(own, slope)| *own = *slope);
        for series in weighed.chunks_exact(filter.observations.len().max(1)) {
            let (mut heard, mut ago) = ([0.0; MOST], [0.0; MOST]);
            for (look, weighed) in looks.iter_mut().zip(series) {
                let Look { apart_s, decay, factors, slopes } = look;
                for state in 0..MOST {
                    ago[state] = decay[state] * (ago[state] + *apart_s * heard[state]);
                    heard[state] *= decay[state];
                    let own = factors[state] * weighed;
                    slopes[state] += twice[state] * weighed * heard[state];
                    slopes[state] += twice[state] * weighed * own;
                    variance[state] += times * own * (2.0 * heard[state] + own);
                    log_time[state] += twice[state] * own * ago[state] / time_s[state];
                    heard[state] += own;
                }
            }
            heard.fill(0.0);
            let mut decay = [1.0; MOST];
            for (look, weighed) in looks.iter_mut().zip(series).rev() {
                for state in 0..MOST {
                    heard[state] *= decay[state];
                    look.slopes[state] += twice[state] * weighed * heard[state];
                    heard[state] += look.factors[state] * weighed;
                }
                decay = look.decay;
            }
        }
        self.variance.iter_mut().zip(variance).for_each(|(slope, own)| *slope = own);
        self.log_time.iter_mut().zip(log_time).for_each(|(slope, own)| *slope = own);
        for (slopes, look) in self.factors.iter_mut().zip(looks) {
            slopes.iter_mut().zip(look.slopes).for_each(|(slope, own)| *slope = own);
        }
    }
}

/// States that are taken side by side, at most: those of a drone, and one for even halves.
const MOST: usize = 6;

/// One observation that looks at all states.
#[derive(Clone, Copy, Default)]
struct Look {
    /// Time since the one before, s.
    apart_s: f64,
    decay: [f64; MOST],
    factors: [f64; MOST],
    /// Derivatives by the factors.
    slopes: [f64; MOST],
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
        slopes.add_squares(&filter, &weighed, square_times);
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
