//! Whitening by a Kalman filter: series whose covariance is a sum of exponentially correlated
//! processes, constants and white noise become independent unit noise, in time linear in their
//! length.
//!
//! The filter's gains depend on the noise alone, so one pass of them serves every series and every
//! regressor.

/// How one state moves between observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    /// Stationary variance.
    pub variance: f64,
    /// Time scale, s; infinite: constant.
    pub time_s: f64,
}

/// One observation of the states.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Observation {
    /// When, s; not decreasing.
    pub time_s: f64,
    /// (state, factor) pairs.
    pub looks_at: Vec<(usize, f64)>,
    /// Variance of its white noise.
    pub noise: f64,
}

/// The gains of a filter for a fixed pattern of observations.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    dim: usize,
    steps: Vec<Step>,
    /// Sum of ln of the innovations' variances.
    pub log_det: f64,
}

#[derive(Clone, Debug)]
struct Step {
    looks_at: Vec<(usize, f64)>,
    /// Factors on the states since the observation before.
    decay: Vec<f64>,
    /// Gain over the innovation's standard deviation.
    gain: Vec<f64>,
    inverse_sd: f64,
}

impl Filter {
    /// Runs the covariances through the observations.
    pub(super) fn new(states: &[State], observations: &[Observation]) -> Self {
        let dim = states.len();
        let mut covariance = vec![0.0; dim * dim];
        for (index, state) in states.iter().enumerate() {
            covariance[index * dim + index] = state.variance;
        }
        let mut steps = Vec::with_capacity(observations.len());
        let mut log_det = 0.0;
        let mut before_s = observations.first().map_or(0.0, |first| first.time_s);
        let mut cross = vec![0.0; dim];
        for seen in observations {
            let elapsed_s = (seen.time_s - before_s).max(0.0);
            before_s = seen.time_s;
            let decay: Vec<f64> =
                states.iter().map(|state| (-elapsed_s / state.time_s).exp()).collect();
            if elapsed_s > 0.0 {
                for row in 0..dim {
                    for column in 0..dim {
                        covariance[row * dim + column] *= decay[row] * decay[column];
                    }
                    let kick = states[row].variance * (1.0 - decay[row] * decay[row]);
                    covariance[row * dim + row] += kick;
                }
            }
            for (row, value) in cross.iter_mut().enumerate() {
                *value = seen
                    .looks_at
                    .iter()
                    .map(|(state, factor)| covariance[row * dim + state] * factor)
                    .sum();
            }
            let variance = seen.noise
                + seen.looks_at.iter().map(|(state, factor)| cross[*state] * factor).sum::<f64>();
            let variance = variance.max(f64::MIN_POSITIVE);
            log_det += variance.ln();
            for row in 0..dim {
                for column in 0..dim {
                    covariance[row * dim + column] -= cross[row] * cross[column] / variance;
                }
            }
            let sd = variance.sqrt();
            steps.push(Step {
                looks_at: seen.looks_at.clone(),
                decay,
                gain: cross.iter().map(|value| value / sd).collect(),
                inverse_sd: 1.0 / sd,
            });
        }
        Self { dim, steps, log_det }
    }

    /// A series as independent noise of variance 1, if its covariance is the filter's.
    pub(super) fn whiten(&self, series: &[f64]) -> Vec<f64> {
        let mut state = vec![0.0; self.dim];
        self.steps
            .iter()
            .zip(series)
            .map(|(step, value)| {
                for (value, decay) in state.iter_mut().zip(&step.decay) {
                    *value *= decay;
                }
                let expected: f64 =
                    step.looks_at.iter().map(|(index, factor)| state[*index] * factor).sum();
                let innovation = (value - expected) * step.inverse_sd;
                for (value, gain) in state.iter_mut().zip(&step.gain) {
                    *value += gain * innovation;
                }
                innovation
            })
            .collect()
    }

    /// The inverse of the covariance times a series: the whitening and its transpose.
    pub(super) fn weigh(&self, series: &[f64]) -> Vec<f64> {
        let mut weighed = self.whiten(series);
        let mut back = vec![0.0; self.dim];
        for (step, value) in self.steps.iter().zip(&mut weighed).rev() {
            let sum: f64 = step.gain.iter().zip(&back).map(|(gain, back)| gain * back).sum();
            *value = (*value + sum) * step.inverse_sd;
            for (index, factor) in &step.looks_at {
                back[*index] -= factor * *value;
            }
            for (back, decay) in back.iter_mut().zip(&step.decay) {
                *back *= decay;
            }
        }
        weighed
    }

    /// A series with the filter's covariance, from independent noise of variance 1.
    pub(super) fn colour(&self, noise: &[f64]) -> Vec<f64> {
        let mut state = vec![0.0; self.dim];
        self.steps
            .iter()
            .zip(noise)
            .map(|(step, innovation)| {
                for (value, decay) in state.iter_mut().zip(&step.decay) {
                    *value *= decay;
                }
                let expected: f64 =
                    step.looks_at.iter().map(|(index, factor)| state[*index] * factor).sum();
                for (value, gain) in state.iter_mut().zip(&step.gain) {
                    *value += gain * innovation;
                }
                expected + innovation / step.inverse_sd
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn case() -> (Vec<State>, Vec<Observation>) {
        let states = vec![
            State { variance: 4.0, time_s: 30.0 },
            State { variance: 1.0, time_s: 8.0 },
            State { variance: 9.0, time_s: f64::INFINITY },
        ];
        let observations = (0..12)
            .map(|index| Observation {
                time_s: f64::from(index) * 3.0 + f64::from(index % 3),
                looks_at: vec![(0, 1.0 + 0.1 * f64::from(index)), (1, 0.5), (2, 1.0)],
                noise: 0.3,
            })
            .collect();
        (states, observations)
    }

    fn covariance(states: &[State], observations: &[Observation]) -> DMatrix<f64> {
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
        let filter = Filter::new(&states, &observations);
        let dense = covariance(&states, &observations).cholesky().unwrap();
        let log_det: f64 = dense.l().diagonal().iter().map(|value| 2.0 * value.ln()).sum();
        assert!((filter.log_det - log_det).abs() < 1e-9, "{} {log_det}", filter.log_det);
        let series: Vec<f64> = (0..12).map(|index| f64::from(index * index % 7)).collect();
        let white = filter.whiten(&series);
        let ours: f64 = white.iter().map(|value| value * value).sum();
        let vector = DVector::from_vec(series.clone());
        let theirs = vector.dot(&dense.solve(&vector));
        assert!((ours - theirs).abs() < 1e-9 * theirs, "{ours} {theirs}");
        for (weighed, solved) in filter.weigh(&series).iter().zip(dense.solve(&vector).iter()) {
            assert!((weighed - solved).abs() < 1e-9, "{weighed} {solved}");
        }
        for (value, back) in series.iter().zip(filter.colour(&white)) {
            assert!((value - back).abs() < 1e-9);
        }
    }
}
