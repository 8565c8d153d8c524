//! Whitening by a Kalman filter: series whose covariance is a sum of exponentially correlated
//! processes, constants and white noise become independent unit noise, in time linear in their
//! length.
//!
//! The filter's gains depend on the noise alone, so one pass of them serves every series and every
//! regressor.

use smallvec::SmallVec;

/// States that an observation sees, each with its factor; as many as there usually are need no memory of their own.
pub(super) type LooksAt = SmallVec<[(usize, f64); 12]>;

/// How one state moves between observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    /// Stationary variance of the state.
    pub variance: f64,
    /// Time scale, s; infinite: constant.
    pub time_s: f64,
}

/// One observation of the states.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Observation {
    /// Time of the observation, s; not decreasing.
    pub time_s: f64,
    /// States that the observation sees, each with its factor.
    pub looks_at: LooksAt,
    /// Variance of its white noise.
    pub noise: f64,
}

/// The gains of a filter for a fixed pattern of observations.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    dim: usize,
    pub(super) states: Vec<State>,
    pub(super) observations: Vec<Observation>,
    /// Factors on the states since the observation before: `dim` for each observation.
    decays: Vec<f64>,
    /// Gains over the innovation's standard deviation: `dim` for each observation.
    gains: Vec<f64>,
    /// Of the innovations, by observation.
    inverse_sd: Vec<f64>,
    /// Sum of ln of the innovations' variances.
    pub log_det: f64,
}

/// One observation of a filter.
#[derive(Clone, Copy)]
struct Step<'a> {
    looks_at: &'a [(usize, f64)],
    decay: &'a [f64],
    gain: &'a [f64],
    inverse_sd: f64,
}

impl Filter {
    /// Runs the covariances through the observations.
    pub(super) fn new(states: Vec<State>, observations: Vec<Observation>) -> Self {
        let (dim, count) = (states.len(), observations.len());
        let mut filter = Self {
            dim,
            states,
            observations,
            decays: Vec::with_capacity(count * dim),
            gains: Vec::with_capacity(count * dim),
            inverse_sd: Vec::with_capacity(count),
            log_det: 0.0,
        };
        let Self { states, observations, decays, gains, inverse_sd, log_det, .. } = &mut filter;
        run(states, observations, |seen| {
            *log_det += seen.variance.ln();
            let sd = seen.variance.sqrt();
            decays.extend_from_slice(seen.decay);
            gains.extend(seen.cross.iter().map(|value| value / sd));
            inverse_sd.push(1.0 / sd);
        });
        filter
    }

    fn steps(&self) -> impl DoubleEndedIterator<Item = Step<'_>> + ExactSizeIterator {
        let by_state = |values| <[f64]>::chunks_exact(values, self.dim.max(1));
        let of_states = by_state(&self.decays).zip(by_state(&self.gains));
        self.observations.iter().zip(of_states).zip(&self.inverse_sd).map(
            |((seen, (decay, gain)), inverse_sd)| Step {
                looks_at: &seen.looks_at,
                decay,
                gain,
                inverse_sd: *inverse_sd,
            },
        )
    }

    /// A series as independent noise of variance 1, if its covariance is the filter's.
    pub(super) fn whiten(&self, series: &[f64]) -> Vec<f64> {
        let mut state = vec![0.0; self.dim];
        self.steps()
            .zip(series)
            .map(|(step, value)| {
                for (value, decay) in state.iter_mut().zip(step.decay) {
                    *value *= decay;
                }
                let expected: f64 =
                    step.looks_at.iter().map(|(index, factor)| state[*index] * factor).sum();
                let innovation = (value - expected) * step.inverse_sd;
                for (value, gain) in state.iter_mut().zip(step.gain) {
                    *value += gain * innovation;
                }
                innovation
            })
            .collect()
    }

    /// The inverse of the covariance times a series: the whitening and its transpose.
    pub(super) fn weigh(&self, series: &[f64]) -> Vec<f64> {
        let mut weighed = self.whiten(series);
        self.back(&mut weighed);
        weighed
    }

    /// The transpose of the whitening: makes the weighed series of a whitened one.
    pub(super) fn back(&self, white: &mut [f64]) {
        let mut back = vec![0.0; self.dim];
        for (step, value) in self.steps().zip(white).rev() {
            let sum: f64 = step.gain.iter().zip(&back).map(|(gain, back)| gain * back).sum();
            *value = (*value + sum) * step.inverse_sd;
            for (index, factor) in step.looks_at {
                back[*index] -= factor * *value;
            }
            for (back, decay) in back.iter_mut().zip(step.decay) {
                *back *= decay;
            }
        }
    }

    /// A series with the filter's covariance, from independent noise of variance 1.
    pub(super) fn colour(&self, noise: &[f64]) -> Vec<f64> {
        let mut state = vec![0.0; self.dim];
        self.steps()
            .zip(noise)
            .map(|(step, innovation)| {
                for (value, decay) in state.iter_mut().zip(step.decay) {
                    *value *= decay;
                }
                let expected: f64 =
                    step.looks_at.iter().map(|(index, factor)| state[*index] * factor).sum();
                for (value, gain) in state.iter_mut().zip(step.gain) {
                    *value += gain * innovation;
                }
                expected + innovation / step.inverse_sd
            })
            .collect()
    }
}

/// Sum of ln of the innovations' variances, and of their squares over them, of one series: the two terms of its
/// likelihood.
pub(super) fn log_det_and_chi2(
    states: &[State],
    observations: &[Observation],
    series: &[f64],
) -> (f64, f64) {
    let mut state = vec![0.0; states.len()];
    let (mut log_det, mut chi2) = (0.0, 0.0);
    let mut each = observations.iter().zip(series);
    run(states, observations, |seen| {
        let Some((observation, value)) = each.next() else { return };
        for (value, decay) in state.iter_mut().zip(seen.decay) {
            *value *= decay;
        }
        let looks_at = observation.looks_at.iter();
        let expected: f64 = looks_at.map(|(index, factor)| state[*index] * factor).sum();
        let innovation = value - expected;
        for (value, cross) in state.iter_mut().zip(seen.cross) {
            *value += cross * innovation / seen.variance;
        }
        log_det += seen.variance.ln();
        chi2 += innovation * innovation / seen.variance;
    });
    (log_det, chi2)
}

/// The covariances at one observation.
pub(super) struct Seen<'a> {
    /// Of the states before it, in rows; only what is not above the diagonal.
    pub covariance: &'a [f64],
    /// Factors on the states since the observation before.
    pub decay: &'a [f64],
    /// Of the states with it.
    pub cross: &'a [f64],
    /// Variance of its innovation.
    pub variance: f64,
}

/// Runs the covariances through the observations.
pub(super) fn run(states: &[State], observations: &[Observation], mut tell: impl FnMut(Seen<'_>)) {
    let dim = states.len();
    // Of a symmetric matrix only what is not above the diagonal.
    let mut covariance = vec![0.0; dim * dim];
    let at = |a: usize, b: usize| a.max(b) * dim + a.min(b);
    for (index, state) in states.iter().enumerate() {
        covariance[at(index, index)] = state.variance;
    }
    let mut before_s = observations.first().map_or(0.0, |first| first.time_s);
    let (mut last_s, mut decay) = (f64::NAN, vec![1.0; dim]);
    let mut cross = vec![0.0; dim];
    for seen in observations {
        let elapsed_s = (seen.time_s - before_s).max(0.0);
        before_s = seen.time_s;
        if elapsed_s != last_s {
            // Bins come at regular times.
            last_s = elapsed_s;
            for (decay, state) in decay.iter_mut().zip(states) {
                *decay = (-elapsed_s / state.time_s).exp();
            }
        }
        if elapsed_s > 0.0 {
            let rows = covariance.chunks_exact_mut(dim.max(1)).zip(states).zip(&decay);
            for (row, ((values, state), by)) in rows.enumerate() {
                for (value, decay) in values.iter_mut().zip(&decay[..=row]) {
                    *value *= by * decay;
                }
                values[row] += state.variance * (1.0 - by * by);
            }
        }
        for (row, value) in cross.iter_mut().enumerate() {
            *value = seen
                .looks_at
                .iter()
                .map(|(state, factor)| covariance[at(row, *state)] * factor)
                .sum();
        }
        let variance = seen.noise
            + seen.looks_at.iter().map(|(state, factor)| cross[*state] * factor).sum::<f64>();
        let variance = variance.max(f64::MIN_POSITIVE);
        tell(Seen { covariance: &covariance, decay: &decay, cross: &cross, variance });
        let rows = covariance.chunks_exact_mut(dim.max(1)).zip(&cross);
        for (row, (values, by)) in rows.enumerate() {
            let by = by / variance;
            for (value, cross) in values.iter_mut().zip(&cross[..=row]) {
                *value -= by * cross;
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    pub(in super::super) fn case() -> (Vec<State>, Vec<Observation>) {
        let states = vec![
            State { variance: 4.0, time_s: 30.0 },
            State { variance: 1.0, time_s: 8.0 },
            State { variance: 9.0, time_s: f64::INFINITY },
        ];
        let observations = (0..12)
            .map(|index| Observation {
                time_s: f64::from(index) * 3.0 + f64::from(index % 3),
                looks_at: LooksAt::from_slice(&[
                    (0, 1.0 + 0.1 * f64::from(index)),
                    (1, 0.5),
                    (2, 1.0),
                ]),
                noise: 0.3,
            })
            .collect();
        (states, observations)
    }

    pub(in super::super) fn covariance(
        states: &[State],
        observations: &[Observation],
    ) -> DMatrix<f64> {
        let count = observations.len();
        DMatrix::from_fn(count, count, |row, column| {
            let (a, b) = (&observations[row], &observations[column]);
            let mut sum = if row == column { a.noise } else { 0.0 };
            for (state, factor) in &a.looks_at {
                for (other, other_factor) in b.looks_at.iter().filter(|(other, _)| other == state) {
                    let State { variance, time_s } = states[*other];
                    let apart_s = (a.time_s - b.time_s).abs();
                    sum += factor * other_factor * variance * (-apart_s / time_s).exp();
                }
            }
            sum
        })
    }

    #[test]
    fn it_is_the_dense_covariance() {
        let (states, observations) = case();
        let dense = covariance(&states, &observations).cholesky().unwrap();
        let filter = Filter::new(states, observations);
        let log_det: f64 = dense.l().diagonal().iter().map(|value| 2.0 * value.ln()).sum();
        assert!((filter.log_det - log_det).abs() < 1e-9, "{} {log_det}", filter.log_det);
        let series: Vec<f64> = (0..12).map(|index| f64::from(index * index % 7)).collect();
        let white = filter.whiten(&series);
        let (states, observations) = case();
        let (alone, chi2) = log_det_and_chi2(&states, &observations, &series);
        assert!((alone - log_det).abs() < 1e-9, "{alone} {log_det}");
        let ours: f64 = white.iter().map(|value| value * value).sum();
        let vector = DVector::from_vec(series.clone());
        let theirs = vector.dot(&dense.solve(&vector));
        assert!((ours - theirs).abs() < 1e-9 * theirs, "{ours} {theirs}");
        assert!((chi2 - theirs).abs() < 1e-9 * theirs, "{chi2} {theirs}");
        for (weighed, solved) in filter.weigh(&series).iter().zip(dense.solve(&vector).iter()) {
            assert!((weighed - solved).abs() < 1e-9, "{weighed} {solved}");
        }
        for (value, back) in series.iter().zip(filter.colour(&white)) {
            assert!((value - back).abs() < 1e-9);
        }
    }
}
