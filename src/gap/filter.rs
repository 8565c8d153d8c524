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
    /// Covariances of the states before each observation, in rows of [`blocks`].
    pub(super) covariances: Vec<Block>,
    /// Covariances of the states with each observation: `dim` for each.
    pub(super) crosses: Vec<f64>,
    /// Variances of the innovations, by observation.
    pub(super) variances: Vec<f64>,
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
            covariances: Vec::with_capacity(count * dim * blocks(dim)),
            crosses: Vec::with_capacity(count * dim),
            variances: Vec::with_capacity(count),
            log_det: 0.0,
        };
        let Self {
            states,
            observations,
            decays,
            gains,
            inverse_sd,
            covariances,
            crosses,
            variances,
            log_det,
            ..
        } = &mut filter;
        run(states, observations, |seen| {
            covariances.extend_from_slice(seen.covariance);
            crosses.extend_from_slice(seen.cross);
            variances.push(seen.variance);
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

    /// Factors on the states from one observation to the next.
    pub(super) fn decay(&self, place: usize) -> &[f64] {
        &self.decays[place * self.dim..][..self.dim]
    }

    /// A series as independent noise of variance 1, if its covariance is the filter's.
    pub(super) fn whiten(&self, series: &[f64]) -> Vec<f64> {
        self.whiten_all(1, |_, place| series[place])
    }

    /// So many series, each as by [`Filter::whiten`], one after another; `value` is that of a series at an observation.
    pub(super) fn whiten_all(&self, count: usize, value: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let mut white = vec![0.0; count * self.observations.len()];
        by_lanes(count, |first, lanes| match lanes {
            Lanes::One => self.whiten_some::<1>(first, &value, &mut white),
            Lanes::Few => self.whiten_some::<FEW>(first, &value, &mut white),
            Lanes::Many => self.whiten_some::<MANY>(first, &value, &mut white),
        });
        white
    }

    /// Whitens series from the `first` on, side by side.
    fn whiten_some<const LANES: usize>(
        &self,
        first: usize,
        value: impl Fn(usize, usize) -> f64,
        white: &mut [f64],
    ) {
        let bins = self.observations.len();
        let count = white.len().checked_div(bins).unwrap_or(0);
        let mut rows = vec![[0.0; LANES]; bins];
        for (lane, series) in (first..count).take(LANES).enumerate() {
            rows.iter_mut().enumerate().for_each(|(place, row)| row[lane] = value(series, place));
        }
        // Each state is carried on to the next observation as soon as this one has told it.
        let mut state = vec![[0.0; LANES]; self.dim];
        let next = self.steps().skip(1).map(|step| step.decay).chain([&[][..]]);
        for ((step, next), row) in self.steps().zip(next).zip(&mut rows) {
            let mut expected = [0.0; LANES];
            for (index, factor) in step.looks_at {
                add(&mut expected, *factor, &state[*index]);
            }
            for (value, expected) in row.iter_mut().zip(expected) {
                *value = (*value - expected) * step.inverse_sd;
            }
            for ((state, gain), decay) in state.iter_mut().zip(step.gain).zip(next) {
                for (value, innovation) in state.iter_mut().zip(&*row) {
                    *value = (*value + gain * innovation) * decay;
                }
            }
        }
        for (lane, white) in white.chunks_exact_mut(bins.max(1)).skip(first).take(LANES).enumerate()
        {
            white.iter_mut().zip(&rows).for_each(|(white, row)| *white = row[lane]);
        }
    }

    /// The inverse of the covariance times a series: the whitening and its transpose.
    pub(super) fn weigh(&self, series: &[f64]) -> Vec<f64> {
        let mut weighed = self.whiten(series);
        self.back(&mut weighed);
        weighed
    }

    /// The transpose of the whitening: makes the weighed series of whitened ones, one after another.
    pub(super) fn back(&self, white: &mut [f64]) {
        let count = white.len().checked_div(self.observations.len()).unwrap_or(0);
        by_lanes(count, |first, lanes| match lanes {
            Lanes::One => self.back_some::<1>(first, white),
            Lanes::Few => self.back_some::<FEW>(first, white),
            Lanes::Many => self.back_some::<MANY>(first, white),
        });
    }

    /// As [`Filter::back`], of some series from the `first` on, side by side.
    fn back_some<const LANES: usize>(&self, first: usize, white: &mut [f64]) {
        let mut rows = side_by_side::<LANES>(white, self.observations.len(), first);
        let mut back = vec![[0.0; LANES]; self.dim];
        for (step, row) in self.steps().zip(&mut rows).rev() {
            let mut sum = [0.0; LANES];
            for (back, gain) in back.iter().zip(step.gain) {
                add(&mut sum, *gain, back);
            }
            for (value, sum) in row.iter_mut().zip(sum) {
                *value = (*value + sum) * step.inverse_sd;
            }
            for (index, factor) in step.looks_at {
                add(&mut back[*index], -factor, row);
            }
            for (back, decay) in back.iter_mut().zip(step.decay) {
                for value in back {
                    *value *= decay;
                }
            }
        }
        let bins = self.observations.len().max(1);
        for (lane, white) in white.chunks_exact_mut(bins).skip(first).take(LANES).enumerate() {
            white.iter_mut().zip(&rows).for_each(|(white, row)| *white = row[lane]);
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

/// Series that are taken side by side: each waits for its own last step, and meanwhile the others go on. As many
/// as fit into registers and cache; numerical.
const MANY: usize = 8;
/// As [`MANY`], where few are left.
const FEW: usize = 4;

/// How many series are taken side by side.
#[derive(Clone, Copy)]
enum Lanes {
    One,
    Few,
    Many,
}

/// Calls with the first of some series each, and how many of them there are at most.
fn by_lanes(count: usize, mut some: impl FnMut(usize, Lanes)) {
    let mut first = 0;
    while first < count {
        let (lanes, taken) = match count - first {
            1 => (Lanes::One, 1),
            2..=FEW => (Lanes::Few, FEW),
            _ => (Lanes::Many, MANY),
        };
        some(first, lanes);
        first += taken;
    }
}

/// Series of so many values, one after another, from the `first` on side by side; zeros where there are no more.
fn side_by_side<const LANES: usize>(
    series: &[f64],
    bins: usize,
    first: usize,
) -> Vec<[f64; LANES]> {
    let mut rows = vec![[0.0; LANES]; bins];
    for (lane, values) in series.chunks_exact(bins.max(1)).skip(first).take(LANES).enumerate() {
        rows.iter_mut().zip(values).for_each(|(row, value)| row[lane] = *value);
    }
    rows
}

/// Adds a multiple, lane by lane.
pub(super) fn add<const LANES: usize>(sum: &mut [f64; LANES], times: f64, other: &[f64; LANES]) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += times * other;
    }
}

/// Values of states side by side: rows of matrices consist of whole blocks, with zeros at the end.
pub(super) const BLOCK: usize = 4;
/// See [`BLOCK`].
pub(super) type Block = [f64; BLOCK];

/// Blocks that hold so many values.
pub(super) fn blocks(dim: usize) -> usize {
    dim.div_ceil(BLOCK).max(1)
}

/// Width of rows of blocks: where it is known beforehand, loops over a row are unrolled.
pub(super) trait Wide: Copy {
    /// Blocks of a row.
    fn blocks(self) -> usize;
}

/// A width that is known.
#[derive(Clone, Copy)]
pub(super) struct Known<const BLOCKS: usize>;

impl<const BLOCKS: usize> Wide for Known<BLOCKS> {
    fn blocks(self) -> usize {
        BLOCKS
    }
}

impl Wide for usize {
    fn blocks(self) -> usize {
        self
    }
}

/// The covariances at one observation.
struct Seen<'a> {
    /// Of the states before it, in rows of [`blocks`].
    covariance: &'a [Block],
    /// Factors on the states since the observation before.
    decay: &'a [f64],
    /// Of the states with it.
    cross: &'a [f64],
    /// Variance of its innovation.
    variance: f64,
}

/// Factors on states over some times. Bins come at regular times, and many states are forgotten equally fast.
struct Decays<'a> {
    states: &'a [State],
    /// The first state that is forgotten as fast as each.
    alike: Vec<usize>,
    known: Vec<(f64, Vec<f64>)>,
}

/// Times of which the factors are kept. Numerical.
const DECAYS_KEPT: usize = 8;

impl<'a> Decays<'a> {
    fn of(states: &'a [State]) -> Self {
        let first = |state: &State| {
            states.iter().position(|other| other.time_s == state.time_s).unwrap_or_default()
        };
        let alike = states.iter().map(first).collect();
        Self { states, alike, known: Vec::with_capacity(DECAYS_KEPT) }
    }

    fn over(&mut self, elapsed_s: f64) -> &[f64] {
        let known = self.known.iter().position(|(of_s, _)| *of_s == elapsed_s);
        let place = known.unwrap_or_else(|| {
            let mut decay = vec![1.0; self.states.len()];
            if elapsed_s > 0.0 {
                for (index, state) in self.states.iter().enumerate() {
                    decay[index] = match self.alike[index] {
                        first if first < index => decay[first],
                        _ => (-elapsed_s / state.time_s).exp(),
                    };
                }
            }
            if self.known.len() == DECAYS_KEPT {
                self.known.remove(0);
            }
            self.known.push((elapsed_s, decay));
            self.known.len() - 1
        });
        &self.known[place].1
    }
}

/// Runs the covariances through the observations.
fn run(states: &[State], observations: &[Observation], tell: impl FnMut(Seen<'_>)) {
    // Those of a drone, and of the means of one group and of two, are known.
    match blocks(states.len()) {
        2 => run_wide(Known::<2>, states, observations, tell),
        3 => run_wide(Known::<3>, states, observations, tell),
        5 => run_wide(Known::<5>, states, observations, tell),
        other => run_wide(other, states, observations, tell),
    }
}

fn run_wide(
    wide: impl Wide,
    states: &[State],
    observations: &[Observation],
    mut tell: impl FnMut(Seen<'_>),
) {
    let (dim, wide) = (states.len(), wide.blocks());
    let mut covariance = vec![[0.0; BLOCK]; dim * wide];
    for (index, state) in states.iter().enumerate() {
        covariance[index * wide + index / BLOCK][index % BLOCK] = state.variance;
    }
    let mut before_s = observations.first().map_or(0.0, |first| first.time_s);
    let mut decays = Decays::of(states);
    // Products of the factors on two states, and what each state is kicked by meanwhile.
    let mut last_s = f64::NAN;
    let mut both = vec![[0.0; BLOCK]; dim * wide];
    let mut kicks = vec![0.0; dim];
    let mut cross = vec![[0.0; BLOCK]; wide];
    let mut gain = vec![[0.0; BLOCK]; wide];
    for seen in observations {
        let elapsed_s = (seen.time_s - before_s).max(0.0);
        before_s = seen.time_s;
        let decay = decays.over(elapsed_s);
        if elapsed_s > 0.0 {
            if elapsed_s != last_s {
                last_s = elapsed_s;
                for (row, (both, by)) in both.chunks_exact_mut(wide).zip(decay).enumerate() {
                    for (both, decay) in both.as_flattened_mut().iter_mut().zip(decay) {
                        *both = by * decay;
                    }
                    kicks[row] = states[row].variance * (1.0 - by * by);
                }
            }
            for (values, both) in covariance.iter_mut().zip(&both) {
                for (value, both) in values.iter_mut().zip(both) {
                    *value *= both;
                }
            }
            for (row, kick) in kicks.iter().enumerate() {
                covariance[row * wide + row / BLOCK][row % BLOCK] += kick;
            }
        }
        cross.fill([0.0; BLOCK]);
        for (state, factor) in &seen.looks_at {
            for (cross, values) in cross.iter_mut().zip(&covariance[state * wide..][..wide]) {
                add(cross, *factor, values);
            }
        }
        let flat = cross.as_flattened();
        let variance = seen.noise
            + seen.looks_at.iter().map(|(state, factor)| flat[*state] * factor).sum::<f64>();
        let variance = variance.max(f64::MIN_POSITIVE);
        tell(Seen { covariance: &covariance, decay, cross: &flat[..dim], variance });
        for (gain, cross) in gain.iter_mut().zip(&cross) {
            for (gain, cross) in gain.iter_mut().zip(cross) {
                *gain = cross / variance;
            }
        }
        for (row, values) in covariance.chunks_exact_mut(wide).enumerate() {
            let (own, place) = (row / BLOCK, row % BLOCK);
            let (own_cross, own_gain) = (cross[own][place], gain[own][place]);
            // Both halves are the same to the last bit: an element is that of its larger index's row.
            for (values, cross) in values[..own].iter_mut().zip(&cross) {
                add(values, -own_gain, cross);
            }
            for (column, value) in values[own].iter_mut().enumerate() {
                *value -= if column <= place {
                    own_gain * cross[own][column]
                } else {
                    gain[own][column] * own_cross
                };
            }
            for (values, gain) in values[own + 1..].iter_mut().zip(&gain[own + 1..]) {
                add(values, -own_cross, gain);
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
