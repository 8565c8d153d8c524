//! The likelihood of a hover's values with all of them in it: drones that stand still, asked at equal steps of time, are a
//! stationary record of many channels, and its covariance is block Toeplitz.
//!
//! The recursion of Levinson for many channels (P. Whittle, *Biometrika* 50, 129, 1963) predicts all drones at a step from
//! all drones at the steps before. Nearest neighbours ([`super::vecchia`]) are enough to fill a map in, but what a smooth
//! field says about its own mean, and about the errors that all drones share, is spread over the whole record: by 16
//! neighbours the zero of a field of 200 m and 260 s is known to 0.23 m/s, and by all values to 0.17.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use nalgebra::{DMatrix, DMatrixView};

use super::covariance::{Air, Covariance, slow_by_time};
use super::data::{COMMON, Drone, Rows};
use super::vecchia::{Parts, System};

/// Drones and floating-point operations of one likelihood at most, roughly: the cost grows with the third power of the drones
/// and the square of the steps that predict.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    pub(super) drones: usize,
    pub(super) operations: f64,
}

/// A step counts if this share of the drones has a value at it. Chosen.
const PRESENT_SHARE: f64 = 0.8;
/// A record without this share of the values does not stand for it. Chosen.
const KEPT_SHARE: f64 = 0.5;

/// Fields that are remembered: of several searches one each, and those that its gradient asks for. Numerical.
const MOST_KNOWN: usize = 32;

/// A record without gaps.
#[derive(Debug)]
pub(super) struct Blocks {
    /// Index of each channel's drone.
    drones: Vec<usize>,
    /// Ways from one channel to another, each once, m; and which of them it is from each channel (row) to each other.
    ways_m: Vec<[f64; 3]>,
    way: DMatrix<usize>,
    noise_mps: Vec<f64>,
    /// Of each step, the last one first: a row for each channel, with its value and what those common errors add to it that are
    /// not the same at all steps.
    records: DMatrix<f64>,
    /// Which of the common errors these are.
    varying: Vec<usize>,
    /// What the others add to each channel; zero where they vary.
    steady: DMatrix<f64>,
    steps: usize,
    step_s: f64,
    /// Steps that predict.
    order: usize,
    known: Known,
}

/// Correlations of the last fields that were asked for, with the air of each.
#[derive(Debug, Default)]
struct Known(Mutex<VecDeque<(Air, Arc<Vec<f64>>)>>);

impl Known {
    fn find(&self, air: &Air) -> Option<Arc<Vec<f64>>> {
        let known = self.0.lock().ok()?;
        known.iter().find(|(of, _)| of == air).map(|(_, correlations)| Arc::clone(correlations))
    }

    fn keep(&self, air: Air, correlations: Vec<f64>) -> Arc<Vec<f64>> {
        let correlations = Arc::new(correlations);
        if let Ok(mut known) = self.0.lock() {
            known.push_back((air, Arc::clone(&correlations)));
            if known.len() > MOST_KNOWN {
                known.pop_front();
            }
        }
        correlations
    }
}

impl Blocks {
    /// The drones that have values throughout the longest time in which most have; `None` where they move, or too few are
    /// left.
    pub(super) fn of(drones: &[Drone], rows: &Rows, size: Size) -> Option<Self> {
        if !drones.iter().all(Drone::hovers) || rows.seconds.len() < 3 {
            return None;
        }
        let has = |drone: usize, step: usize| rows.place[drone][step].is_some();
        let present =
            |step: usize| (0..drones.len()).filter(|drone| has(*drone, step)).count() as f64;
        let most = (0..rows.seconds.len()).map(present).fold(0.0, f64::max);
        let mut steps = 0..0;
        let mut start = 0;
        for end in 1..=rows.seconds.len() {
            if present(end - 1) < PRESENT_SHARE * most {
                start = end;
            }
            if end - start > steps.len() {
                steps = start..end;
            }
        }
        let whole: Vec<usize> =
            (0..drones.len()).filter(|drone| steps.clone().all(|step| has(*drone, step))).collect();
        if ((whole.len() * steps.len()) as f64) < KEPT_SHARE * rows.list.len() as f64 {
            return None;
        }
        let place_m = |drone: &usize| drones[*drone].place_at(0).unwrap_or_default();
        let channels = spread(&whole, size.drones, place_m);
        let row = |drone: usize, step: usize| Some(&rows.list[rows.place[drone][step]?]);
        let first = |drone: &usize| row(*drone, steps.start).map(|row| row.common);
        let first: Vec<[f64; COMMON]> = channels.iter().filter_map(first).collect();
        let varies = |column: &usize| {
            let same = |step: usize, (drone, first): (&usize, &[f64; COMMON])| {
                row(*drone, step).is_some_and(|row| row.common[*column] == first[*column])
            };
            !steps.clone().all(|step| channels.iter().zip(&first).all(|each| same(step, each)))
        };
        let varying: Vec<usize> = (0..COMMON).filter(varies).collect();
        let steady = DMatrix::from_fn(channels.len(), COMMON, |channel, column| {
            if varying.contains(&column) { 0.0 } else { first[channel][column] }
        });
        let mut records = DMatrix::zeros(steps.len() * channels.len(), 1 + varying.len());
        for (block, step) in steps.clone().rev().enumerate() {
            for (channel, drone) in channels.iter().enumerate() {
                let row = row(*drone, step)?;
                let place = block * channels.len() + channel;
                records[(place, 0)] = row.value_mps;
                for (index, column) in varying.iter().enumerate() {
                    records[(place, 1 + index)] = row.common[*column];
                }
            }
        }
        let noise = |drone: &usize| {
            let squares =
                steps.clone().filter_map(|step| Some(row(*drone, step)?.noise_mps.powi(2)));
            crate::numeric::mean(squares).unwrap_or(0.0).sqrt()
        };
        let cube = (channels.len() as f64).powi(3);
        let order = ((size.operations / (3.0 * cube)).sqrt() as usize).max(1);
        let (ways_m, way) = ways(&channels.iter().map(place_m).collect::<Vec<_>>());
        Some(Self {
            ways_m,
            way,
            noise_mps: channels.iter().map(noise).collect(),
            drones: channels,
            records,
            varying,
            steady,
            steps: steps.len(),
            step_s: (rows.seconds[1] - rows.seconds[0]) as f64,
            order: order.min(steps.len() - 1),
            known: Known::default(),
        })
    }

    /// Correlations of the field over all ways, for no step, one, and so on. Most of the differences of a gradient are by scales
    /// that they do not hang on.
    fn correlations(&self, covariance: &Covariance) -> Arc<Vec<f64>> {
        let alone = covariance.alone();
        if let Some(known) = self.known.find(alone.air()) {
            return known;
        }
        let by_way: Vec<[f64; 2]> = self.ways_m.iter().map(|way_m| alone.by_way(*way_m)).collect();
        let mut found = Vec::with_capacity((self.order + 1) * by_way.len());
        for lag in 0..=self.order {
            let apart = alone.apart(lag as f64 * self.step_s);
            let each = self.ways_m.iter().zip(&by_way);
            found.extend(each.map(|(way_m, by_way)| apart.field_by(*way_m, *by_way)));
        }
        self.known.keep(*alone.air(), found)
    }

    /// Covariances of all channels with all channels so many steps before, (m/s)²: that of the most steps first.
    fn lagged(&self, covariance: &Covariance) -> DMatrix<f64> {
        let (n, order) = (self.drones.len(), self.order);
        let mut stacked = DMatrix::zeros((order + 1) * n, n);
        let correlations = self.correlations(covariance);
        let variance = covariance.air().sd_mps.powi(2);
        let slow: Vec<f64> = self.ways_m.iter().map(|way_m| covariance.slow(*way_m, 0.0)).collect();
        let mut fields = vec![0.0; self.ways_m.len()];
        for lag in 0..=order {
            let apart_s = lag as f64 * self.step_s;
            let besides = covariance.besides(apart_s);
            let still = slow_by_time(apart_s);
            let at_lag = &correlations[lag * slow.len()..];
            for (field, (correlation, slow)) in fields.iter_mut().zip(at_lag.iter().zip(&slow)) {
                *field = variance * correlation + slow * still;
            }
            let mut block = stacked.rows_mut((order - lag) * n, n);
            for channel in 0..n {
                let ways = self.way.column(channel);
                for (value, way) in block.column_mut(channel).iter_mut().zip(ways.iter()) {
                    *value = besides.with(fields[*way], false);
                }
                let way = ways[channel];
                block[(channel, channel)] = besides.with(fields[way], true);
            }
            if lag == 0 {
                let noise = self.noise_mps.iter().enumerate();
                noise.for_each(|(channel, mps)| block[(channel, channel)] += mps * mps);
            }
        }
        stacked
    }

    /// The likelihood with everything linear left open; `own_mps` are standard errors of all drones' constants. `None`
    /// where rounding leaves no positive definite covariance.
    pub(super) fn system(&self, covariance: &Covariance, own_mps: &[f64]) -> Option<System> {
        let n = self.drones.len();
        let lagged = self.lagged(covariance);
        let mut predictor = Predictor::new(lagged, n, covariance.is_reversible())?;
        let mut parts = Parts::new(n);
        // What is left of the values, and of each common error, white: step below step.
        let mut white = DMatrix::zeros(self.steps * n, 1 + COMMON);
        // Products of the constants with all these.
        let mut own = DMatrix::zeros(n, 1 + COMMON);
        let mut left = DMatrix::zeros(n, self.records.ncols());
        for step in 0..=self.order {
            if step > 0 {
                predictor.extend()?;
            }
            let block = self.steps - 1 - step;
            left.copy_from(&self.records.rows(block * n, n));
            let before = self.records.rows((block + 1) * n, predictor.order * n);
            left.gemm(-1.0, &predictor.ahead(), &before, 1.0);
            let left = &predictor.whitening * &left;
            let constants = &predictor.whitening * &predictor.of_constants;
            let mut here = white.rows_mut(step * n, n);
            here.columns_mut(1, COMMON).gemm(1.0, &constants, &self.steady, 0.0);
            for (column, left) in self.columns().zip(left.column_iter()) {
                here.set_column(column, &left);
            }
            own.gemm(1.0, &constants.transpose(), &here, 1.0);
            parts.own += constants.tr_mul(&constants);
            parts.ln_sd += predictor.ln_sd;
        }
        self.rest(&predictor, &mut white, &mut own, &mut parts);
        let product = |one: usize, other: usize| white.column(one).dot(&white.column(other));
        parts.squares = product(0, 0);
        for row in 0..COMMON {
            parts.score[row] = product(0, 1 + row);
            for column in 0..=row {
                let product = product(1 + row, 1 + column);
                parts.information[(row, column)] = product;
                parts.information[(column, row)] = product;
            }
        }
        parts.own_score.copy_from(&own.column(0));
        parts.own_common.copy_from(&own.columns(1, COMMON));
        let own_mps: Vec<f64> = self.drones.iter().map(|drone| own_mps[*drone]).collect();
        System::integrated(parts, &own_mps)
    }

    /// Where the columns of [`Self::records`] are among those of values and all common errors.
    fn columns(&self) -> impl Iterator<Item = usize> {
        std::iter::once(0).chain(self.varying.iter().map(|column| 1 + column))
    }

    /// All steps at once that have more steps before them than predict any.
    fn rest(
        &self,
        predictor: &Predictor,
        white: &mut DMatrix<f64>,
        own: &mut DMatrix<f64>,
        parts: &mut Parts,
    ) {
        let (n, order) = (self.drones.len(), self.order);
        let rest = self.steps - 1 - order;
        if rest == 0 {
            return;
        }
        let constants = &predictor.whitening * &predictor.of_constants;
        let steady = &constants * &self.steady;
        let place = (order + 1) * n;
        for (column, steady) in steady.column_iter().enumerate() {
            for step in 0..rest {
                white.view_mut((place + step * n, 1 + column), (n, 1)).copy_from(&steady);
            }
        }
        for (column, record) in self.columns().zip(self.records.column_iter()) {
            let record = record.as_slice();
            let mut left = DMatrix::from_column_slice(n, rest, &record[..rest * n]);
            // The steps before each: a column is the next one, shifted by a step.
            let before = DMatrixView::from_slice_with_strides(&record[n..], order * n, rest, 1, n);
            left.gemm(-1.0, &predictor.ahead(), &before, 1.0);
            let left = &predictor.whitening * left;
            white.column_mut(column).rows_mut(place, rest * n).copy_from_slice(left.as_slice());
        }
        let sums = DMatrix::from_fn(n, 1 + COMMON, |channel, column| {
            let steps = white.column(column);
            (0..rest).map(|step| steps[place + step * n + channel]).sum()
        });
        own.gemm(1.0, &constants.transpose(), &sums, 1.0);
        parts.own += constants.tr_mul(&constants) * rest as f64;
        parts.ln_sd += predictor.ln_sd * rest as f64;
    }
}

/// The best prediction of a step by those before it, and of a step by those behind it.
///
/// Coefficients lie side by side, so that sums over the steps are products of long matrices.
struct Predictor {
    /// Covariances, that of the most steps first, one below the other.
    lagged: DMatrix<f64>,
    /// Most steps that predict.
    most: usize,
    /// Steps that predict.
    order: usize,
    /// What is multiplied with the steps before, the last one first.
    ahead: DMatrix<f64>,
    /// What is multiplied with the steps behind, the farthest first; it ends with the matrix. The same as `ahead` where time
    /// has no direction.
    behind: DMatrix<f64>,
    is_reversible: bool,
    /// Covariance of what is left.
    left: DMatrix<f64>,
    left_behind: DMatrix<f64>,
    /// What makes that white: the inverse of the lower triangle of its factor.
    whitening: DMatrix<f64>,
    /// Sum of the logarithms of the factor's diagonal.
    ln_sd: f64,
    /// What is left of constants of the channels, ahead and behind.
    of_constants: DMatrix<f64>,
    of_constants_behind: DMatrix<f64>,
    /// What was `ahead` before the last step.
    before: DMatrix<f64>,
}

impl Predictor {
    /// Of no step yet; `None` where rounding leaves no positive definite covariance.
    fn new(lagged: DMatrix<f64>, n: usize, is_reversible: bool) -> Option<Self> {
        let most = lagged.nrows() / n - 1;
        let variance = lagged.rows(most * n, n).into_owned();
        let coefficients = || DMatrix::zeros(n, most * n);
        let mut new = Self {
            lagged,
            most,
            order: 0,
            ahead: coefficients(),
            behind: coefficients(),
            is_reversible,
            left: variance.clone(),
            left_behind: variance,
            whitening: DMatrix::zeros(n, n),
            ln_sd: 0.0,
            of_constants: DMatrix::identity(n, n),
            of_constants_behind: DMatrix::identity(n, n),
            before: coefficients(),
        };
        new.factorise()?;
        Some(new)
    }

    fn factorise(&mut self) -> Option<()> {
        (self.whitening, self.ln_sd) = whitening(&self.left)?;
        Some(())
    }

    /// Coefficients of the steps before, the last one first.
    fn ahead(&self) -> DMatrixView<'_, f64> {
        self.ahead.columns(0, self.order * self.left.nrows())
    }

    /// One step more.
    fn extend(&mut self) -> Option<()> {
        let (n, order) = (self.left.nrows(), self.order);
        let known = order * n;
        let first = self.most.checked_sub(order + 1)? * n;
        let mut unexplained = self.lagged.rows(first, n).into_owned();
        unexplained.gemm(-1.0, &self.ahead(), &self.lagged.rows(first + n, known), 1.0);
        // The inverse of what is left ahead is at hand, but for one product.
        let by_ahead = |of: &DMatrix<f64>| {
            let white = &self.whitening * of;
            white.transpose() * &self.whitening
        };
        let transposed = unexplained.transpose();
        let new_behind;
        let new;
        if self.is_reversible {
            // Behind is as ahead: the new coefficient is the same, too.
            new = by_ahead(&transposed);
            new_behind = new.clone();
        } else {
            new_behind = by_ahead(&unexplained);
            let (whitening, _) = whitening(&self.left_behind)?;
            new = (&whitening * &transposed).transpose() * whitening;
            self.left_behind.gemm(-1.0, &new_behind, &unexplained, 1.0);
        }
        self.left.gemm(-1.0, &new, &transposed, 1.0);
        let constants = self.of_constants.clone();
        self.of_constants.gemm(-1.0, &new, &self.of_constants_behind, 1.0);
        self.of_constants_behind.gemm(-1.0, &new_behind, &constants, 1.0);
        let end = self.most * n;
        let mut before = self.before.columns_mut(0, known);
        before.copy_from(&self.ahead.columns(0, known));
        let mut ahead = self.ahead.columns_mut(0, known);
        let mut behind = self.behind.columns_mut(end - known, known);
        ahead.gemm(-1.0, &new, &behind, 1.0);
        if self.is_reversible {
            for block in 0..order {
                let same = ahead.columns((order - 1 - block) * n, n);
                behind.columns_mut(block * n, n).copy_from(&same);
            }
        } else {
            behind.gemm(-1.0, &new_behind, &before, 1.0);
        }
        self.ahead.columns_mut(known, n).copy_from(&new);
        self.behind.columns_mut(end - known - n, n).copy_from(&new_behind);
        self.order += 1;
        self.factorise()
    }
}

/// The inverse of the lower triangle of a covariance's factor, with the sum of the logarithms of its diagonal.
fn whitening(covariance: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let factor = covariance.clone().cholesky()?.unpack();
    let ln_sd = factor.diagonal().iter().map(|value| value.ln()).sum();
    let n = factor.nrows();
    let mut inverse = DMatrix::identity(n, n);
    for column in 0..n {
        // Above its one there is nothing.
        let (from, rest) = ((column, column), n - column);
        let factor = factor.view(from, (rest, rest));
        if !factor.solve_lower_triangular_mut(&mut inverse.view_mut(from, (rest, 1))) {
            return None;
        }
    }
    Some((inverse, ln_sd))
}

/// Ways between places, each once, and which of them it is from each place (column) to each other (row). On a grid most are
/// there many times.
fn ways(places_m: &[[f64; 3]]) -> (Vec<[f64; 3]>, DMatrix<usize>) {
    let mut ways_m: Vec<[f64; 3]> = Vec::new();
    let n = places_m.len();
    let way = DMatrix::from_fn(n, n, |row, column| {
        let way_m = [0, 1, 2].map(|axis| places_m[row][axis] - places_m[column][axis]);
        ways_m.iter().position(|known| *known == way_m).unwrap_or_else(|| {
            ways_m.push(way_m);
            ways_m.len() - 1
        })
    });
    (ways_m, way)
}

/// Some of the drones, spread over the places, with their neighbours.
fn spread(drones: &[usize], most: usize, place_m: impl Fn(&usize) -> [f64; 3]) -> Vec<usize> {
    if drones.len() <= most {
        return drones.to_vec();
    }
    let apart = |one: &usize, other: &usize| {
        let (one, other) = (place_m(one), place_m(other));
        (0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum::<f64>()
    };
    let mut chosen = vec![drones[0]];
    let mut nearest: Vec<f64> = drones.iter().map(|drone| apart(drone, &drones[0])).collect();
    while chosen.len() < most.div_ceil(2) {
        let farthest = nearest
            .iter()
            .zip(drones)
            .max_by(|a, b| a.0.total_cmp(b.0).then(b.1.cmp(a.1)))
            .map_or(drones[0], |(_, drone)| *drone);
        chosen.push(farthest);
        for (nearest, drone) in nearest.iter_mut().zip(drones) {
            *nearest = nearest.min(apart(drone, &farthest));
        }
    }
    for index in 0..most - chosen.len() {
        let one = chosen[index];
        let others = drones.iter().filter(|drone| !chosen.contains(drone));
        let near = others.min_by(|a, b| apart(a, &one).total_cmp(&apart(b, &one)).then(a.cmp(b)));
        chosen.extend(near.copied());
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::{Air, Form};
    use crate::analysis::kriging::data::{UNIFORM, Value};
    use crate::analysis::kriging::vecchia::{Common, CommonVector, LEAST_OWN_MPS};
    use nalgebra::DVector;

    const SIZE: Size = Size { drones: 100, operations: 1e12 };

    fn air(form: Form, drift_mps: [f64; 2]) -> Air {
        Air {
            form,
            sd_mps: 0.5,
            length_m: 60.0,
            stretch: [0.2, -0.1],
            time_s: 90.0,
            drift_mps,
            gust_mps: 0.15,
            gust_s: 5.0,
            slow_mps: 0.1,
            shared_mps: 0.03,
        }
    }

    fn fleet(seconds: usize) -> Vec<Drone> {
        (0..6)
            .map(|index| {
                let (x, y) = (f64::from(index % 3), f64::from(index / 3));
                let value = |second: usize| {
                    let wave = (0.05 * second as f64 + 0.4 * x - 0.3 * y).sin();
                    Value {
                        updraft_mps: 0.3 + 0.4 * wave + 0.05 * x,
                        law: std::array::from_fn(|column| 0.02 * (column as f64 + wave)),
                        // One that changes, and others that do not.
                        doubts_mps: std::array::from_fn(|doubt| {
                            0.01 * if doubt == 1 { wave } else { doubt as f64 + x }
                        }),
                        own_mps: 0.05,
                        noise_mps: 0.04,
                    }
                };
                Drone {
                    calibrated_m: Some([12.0 * x, 15.0 * y]),
                    place_m: vec![[12.0 * x, 15.0 * y, 40.0]],
                    values: (0..seconds).map(|second| Some(value(second))).collect(),
                    slope_share: 0.0,
                    own_slope_share: 0.0,
                }
            })
            .collect()
    }

    /// The likelihood by all values at once, with common errors of this factor; and the information about an updraft.
    fn dense(rows: &Rows, covariance: &Covariance, own_mps: f64, errors: &Common) -> (f64, f64) {
        let n = rows.list.len();
        let common = DMatrix::from_fn(n, COMMON, |row, column| rows.list[row].common[column]);
        let spread = common * DMatrix::from_column_slice(COMMON, COMMON, errors.as_slice());
        let mut matrix = DMatrix::from_fn(n, n, |row, column| {
            let (one, other) = (&rows.list[row], &rows.list[column]);
            let own = if one.spot.drone == other.spot.drone { own_mps * own_mps } else { 0.0 };
            covariance.of(&one.spot, &other.spot) + own
        });
        for row in 0..n {
            matrix[(row, row)] += rows.list[row].noise_mps.powi(2);
        }
        matrix += &spread * spread.transpose();
        let factor = matrix.cholesky().unwrap();
        let values = DVector::from_fn(n, |row, _| rows.list[row].value_mps);
        let ones = DVector::from_element(n, 1.0);
        let ln_sd: f64 = factor.l_dirty().diagonal().iter().map(|sd| sd.ln()).sum();
        let log = -ln_sd - 0.5 * values.dot(&factor.solve(&values));
        (log, ones.dot(&factor.solve(&ones)))
    }

    #[test]
    fn it_is_the_likelihood_of_all_values_at_once() {
        for (form, drift_mps) in [
            (Form::Exponential, [0.0; 2]),
            (Form::Gaussian, [0.0; 2]),
            (Form::Gaussian, [1.5, -0.5]),
            (Form::Exponential, [1.5, -0.5]),
        ] {
            let covariance = Covariance::new(air(form, drift_mps)).shown(0.03);
            let drones = fleet(120);
            let rows = Rows::of(&drones, 5, 10);
            let blocks = Blocks::of(&drones, &rows, SIZE).unwrap();
            let own_mps = 0.05_f64.max(LEAST_OWN_MPS);
            let system = blocks.system(&covariance, &[own_mps; 6]).unwrap();
            let (expected, information) = dense(&rows, &covariance, own_mps, &Common::zeros());
            let found = system.posterior(&CommonVector::zeros(), &Common::zeros()).unwrap();
            assert!(
                (found.log_likelihood - expected).abs() < 1e-6 * expected.abs(),
                "{form:?} {drift_mps:?}: {} {expected}",
                found.log_likelihood
            );
            let errors = Common::from_diagonal(&CommonVector::from_fn(|row, _| 0.5 + row as f64));
            let (expected, _) = dense(&rows, &covariance, own_mps, &errors);
            let found = system.posterior(&CommonVector::zeros(), &errors).unwrap().log_likelihood;
            assert!((found - expected).abs() < 1e-6 * expected.abs(), "{found} {expected}");
            // An updraft that is everywhere the same, with a prior of 3 m/s.
            let mut factor = Common::zeros();
            factor[(UNIFORM, UNIFORM)] = 3.0;
            let uniform = system.posterior(&CommonVector::zeros(), &factor).unwrap();
            let variance = 1.0 / (information + 1.0 / 9.0);
            let found = uniform.covariance[(UNIFORM, UNIFORM)];
            assert!((found / variance - 1.0).abs() < 1e-6, "{found} {variance}");
        }
    }

    /// The likelihood where each step is predicted by so many before it, step by step.
    fn stepwise(
        (rows, drones, order): (&Rows, usize, usize),
        covariance: &Covariance,
        own_mps: f64,
        errors: &Common,
    ) -> f64 {
        let all = |of: std::ops::Range<usize>, with: std::ops::Range<usize>| {
            DMatrix::from_fn(of.len(), with.len(), |row, column| {
                let places = (of.start + row, with.start + column);
                let (one, other) = (&rows.list[places.0], &rows.list[places.1]);
                let noise = if places.0 == places.1 { one.noise_mps.powi(2) } else { 0.0 };
                covariance.of(&one.spot, &other.spot) + noise
            })
        };
        // Values, common errors, and each drone's constant.
        let open = DMatrix::from_fn(rows.list.len(), 1 + COMMON + drones, |row, column| {
            let row = &rows.list[row];
            match column {
                0 => row.value_mps,
                common if common <= COMMON => row.common[common - 1],
                drone => f64::from(u8::from(row.spot.drone == Some(drone - 1 - COMMON))),
            }
        });
        let mut white = open.clone();
        let mut ln_sd = 0.0;
        for first in (0..rows.list.len()).step_by(drones) {
            let (here, before) =
                (first..first + drones, first.saturating_sub(order * drones)..first);
            let (mut left, mut variance) =
                (open.rows_range(here.clone()).into_owned(), all(here.clone(), here.clone()));
            if !before.is_empty() {
                let across = all(before.clone(), here.clone());
                let factor = all(before.clone(), before.clone()).cholesky().unwrap();
                let weights = factor.solve(&across).transpose();
                left -= &weights * open.rows_range(before);
                variance -= weights * across;
            }
            let factor = variance.cholesky().unwrap();
            ln_sd += factor.l_dirty().diagonal().iter().map(|sd| sd.ln()).sum::<f64>();
            factor.l_dirty().solve_lower_triangular_mut(&mut left);
            white.rows_range_mut(here).copy_from(&left);
        }
        let errors = DMatrix::from_column_slice(COMMON, COMMON, errors.as_slice());
        let mut spread = DMatrix::zeros(rows.list.len(), COMMON + drones);
        spread.columns_mut(0, COMMON).copy_from(&(white.columns(1, COMMON) * errors));
        spread
            .columns_mut(COMMON, drones)
            .copy_from(&(white.columns(1 + COMMON, drones) * own_mps));
        let values = white.column(0);
        let inner = spread.tr_mul(&spread) + DMatrix::identity(COMMON + drones, COMMON + drones);
        let inner = inner.cholesky().unwrap();
        let explained = spread.tr_mul(&values);
        let square = values.norm_squared() - explained.dot(&inner.solve(&explained));
        -ln_sd - inner.l_dirty().diagonal().iter().map(|sd| sd.ln()).sum::<f64>() - 0.5 * square
    }

    #[test]
    fn steps_beyond_the_order_are_predicted_by_as_many_as_the_order_says() {
        let drones = fleet(120);
        let rows = Rows::of(&drones, 5, 10);
        let steps = rows.seconds.len();
        for drift_mps in [[0.0; 2], [1.5, -0.5]] {
            let covariance = Covariance::new(air(Form::Exponential, drift_mps)).shown(0.03);
            for order in [1, 3, steps - 2, steps - 1] {
                let operations = 3.0 * 6.0_f64.powi(3) * (order as f64).powi(2) + 1.0;
                let blocks = Blocks::of(&drones, &rows, Size { operations, ..SIZE }).unwrap();
                assert_eq!((blocks.order, blocks.steps), (order, steps));
                assert!(!blocks.varying.is_empty() && blocks.varying.len() < COMMON);
                let system = blocks.system(&covariance, &[0.05; 6]).unwrap();
                for factor in [
                    Common::zeros(),
                    Common::from_diagonal(&CommonVector::from_fn(|row, _| 0.5 + row as f64)),
                ] {
                    let expected = stepwise((&rows, 6, order), &covariance, 0.05, &factor);
                    let found = system.posterior(&CommonVector::zeros(), &factor).unwrap();
                    let found = found.log_likelihood;
                    assert!(
                        (found - expected).abs() < 1e-6 * expected.abs(),
                        "{drift_mps:?} {order}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_field_that_is_remembered_is_the_one_that_is_asked_for() {
        let air = air(Form::Exponential, [1.5, -0.5]);
        let drones = fleet(120);
        let rows = Rows::of(&drones, 5, 10);
        let of = |blocks: &Blocks, air: Air| {
            let system = blocks.system(&Covariance::new(air), &[0.05; 6]).unwrap();
            let solved = system.posterior(&CommonVector::zeros(), &Common::zeros());
            solved.unwrap().log_likelihood
        };
        let others = [
            Air { sd_mps: 0.3, ..air },
            Air { gust_mps: 0.3, ..air },
            Air { gust_s: 2.0, ..air },
            Air { slow_mps: 0.3, ..air },
            Air { shared_mps: 0.1, ..air },
            Air { form: Form::Gaussian, ..air },
            Air { length_m: 50.0, ..air },
            Air { stretch: [0.2, 0.1], ..air },
            Air { time_s: 80.0, ..air },
            Air { drift_mps: [1.5, 0.5], ..air },
        ];
        let blocks = Blocks::of(&drones, &rows, SIZE).unwrap();
        let first = of(&blocks, air);
        for other in others {
            let alone = of(&Blocks::of(&drones, &rows, SIZE).unwrap(), other);
            assert_eq!(of(&blocks, other), alone, "{other:?}");
            assert_ne!(alone, first);
        }
        let remembered = blocks.known.0.lock().unwrap().len();
        assert_eq!(remembered, 6, "the first field and the five that are other fields");
    }

    #[test]
    fn gaps_are_left_out_and_a_record_of_gaps_is_none() {
        let mut drones = fleet(200);
        drones[2].values.iter_mut().for_each(|value| *value = None);
        drones[4].values[103..].iter_mut().for_each(|value| *value = None);
        let rows = Rows::of(&drones, 5, 10);
        let blocks = Blocks::of(&drones, &rows, SIZE).unwrap();
        assert_eq!(blocks.drones, [0, 1, 3, 5], "as long as most of them");
        assert_eq!(blocks.steps, rows.seconds.len());
        for (index, drone) in drones.iter_mut().enumerate() {
            let drop = |second: usize| second / 10 % 6 == index;
            drone
                .values
                .iter_mut()
                .enumerate()
                .filter(|(second, _)| drop(*second))
                .for_each(|(_, value)| *value = None);
        }
        let rows = Rows::of(&drones, 5, 10);
        assert!(Blocks::of(&drones, &rows, SIZE).is_none());
    }

    #[test]
    fn a_part_of_a_fleet_is_spread_and_has_neighbours() {
        let place_m =
            |drone: &usize| [10.0 * (*drone % 10) as f64, 10.0 * (*drone / 10) as f64, 0.0];
        let all: Vec<usize> = (0..100).collect();
        let chosen = spread(&all, 16, place_m);
        assert_eq!(chosen.len(), 16);
        let apart = |one: &usize, other: &usize| {
            let (one, other) = (place_m(one), place_m(other));
            (one[0] - other[0]).hypot(one[1] - other[1])
        };
        let distances: Vec<f64> = chosen
            .iter()
            .flat_map(|one| {
                chosen.iter().filter(|other| *other > one).map(|other| apart(one, other))
            })
            .collect();
        assert!(distances.iter().any(|apart| *apart > 100.0));
        assert!(distances.iter().filter(|apart| **apart < 11.0).count() >= 8);
    }
}
