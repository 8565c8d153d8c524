//! The likelihood of a hover's values with all of them in it: drones that stand still, asked at equal steps of time, are a
//! stationary record of many channels, and its covariance is block Toeplitz.
//!
//! The recursion of Levinson for many channels (P. Whittle, *Biometrika* 50, 129, 1963) predicts all drones at a step from
//! all drones at the steps before. Nearest neighbours ([`super::vecchia`]) are enough to fill a map in, but what a smooth
//! field says about its own mean, and about the errors that all drones share, is spread over the whole record: by 16
//! neighbours the zero of a field of 200 m and 260 s is known to 0.23 m/s, and by all values to 0.17.

use nalgebra::DMatrix;

use super::covariance::{Covariance, Spot};
use super::data::{COMMON, Drone, Rows};
use super::vecchia::{Common, CommonVector, Parts, System};

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

/// A record without gaps.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Index of each channel's drone.
    drones: Vec<usize>,
    places_m: Vec<[f64; 3]>,
    noise_mps: Vec<f64>,
    /// Of each step: a row for each channel, with its value and what the common errors add to it.
    records: Vec<DMatrix<f64>>,
    step_s: f64,
    /// Steps that predict.
    order: usize,
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
        let records: Option<Vec<DMatrix<f64>>> = steps
            .clone()
            .map(|step| {
                let mut record = DMatrix::zeros(channels.len(), 1 + COMMON);
                for (channel, drone) in channels.iter().enumerate() {
                    let row = row(*drone, step)?;
                    record[(channel, 0)] = row.value_mps;
                    for column in 0..COMMON {
                        record[(channel, 1 + column)] = row.common[column];
                    }
                }
                Some(record)
            })
            .collect();
        let noise = |drone: &usize| {
            let squares =
                steps.clone().filter_map(|step| Some(row(*drone, step)?.noise_mps.powi(2)));
            crate::numeric::mean(squares).unwrap_or(0.0).sqrt()
        };
        let cube = (channels.len() as f64).powi(3);
        let order = ((size.operations / (3.0 * cube)).sqrt() as usize).max(1);
        Some(Self {
            places_m: channels.iter().map(place_m).collect(),
            noise_mps: channels.iter().map(noise).collect(),
            drones: channels,
            records: records?,
            step_s: (rows.seconds[1] - rows.seconds[0]) as f64,
            order,
        })
    }

    /// Covariance of all channels with all channels so many steps before, (m/s)².
    fn lagged(&self, covariance: &Covariance, lag: usize) -> DMatrix<f64> {
        let spot = |channel: usize, time_s: f64| Spot {
            place_m: self.places_m[channel],
            time_s,
            drone: Some(self.drones[channel]),
            velocity_mps: [0.0; 3],
        };
        let n = self.drones.len();
        let apart_s = lag as f64 * self.step_s;
        let is_symmetric = lag == 0 || covariance.is_reversible();
        let mut matrix = DMatrix::zeros(n, n);
        for row in 0..n {
            for column in 0..if is_symmetric { row + 1 } else { n } {
                let value = covariance.of(&spot(row, apart_s), &spot(column, 0.0));
                matrix[(row, column)] = value;
                if is_symmetric {
                    matrix[(column, row)] = value;
                }
            }
            if lag == 0 {
                matrix[(row, row)] += self.noise_mps[row].powi(2);
            }
        }
        matrix
    }

    /// The likelihood with everything linear left open; `own_mps` are standard errors of all drones' constants. `None`
    /// where rounding leaves no positive definite covariance.
    pub(super) fn system(&self, covariance: &Covariance, own_mps: &[f64]) -> Option<System> {
        let n = self.drones.len();
        let order = self.order.min(self.records.len() - 1);
        let lagged: Vec<DMatrix<f64>> =
            (0..=order).map(|lag| self.lagged(covariance, lag)).collect();
        let mut predictor = Predictor::new(&lagged[0], covariance.is_reversible());
        let mut parts = Parts::new(n);
        let mut square = DMatrix::zeros(n, n);
        for (step, record) in self.records.iter().enumerate() {
            if step <= order {
                if step > 0 {
                    predictor.extend(&lagged)?;
                }
                let white = predictor.factor()?.solve_lower_triangular(&predictor.of_constants)?;
                square = white.tr_mul(&white);
                predictor.white_constants = white;
            }
            let mut left = record.clone();
            for (back, ahead) in predictor.ahead.iter().enumerate() {
                left.gemm(-1.0, ahead, &self.records[step - 1 - back], 1.0);
            }
            predictor.factor()?.solve_lower_triangular_mut(&mut left);
            let value = left.column(0);
            let common = left.columns(1, COMMON);
            parts.squares += value.norm_squared();
            parts.ln_sd += predictor.ln_sd;
            parts.information +=
                Common::from_fn(|row, column| common.column(row).dot(&common.column(column)));
            parts.score += CommonVector::from_fn(|row, _| common.column(row).dot(&value));
            parts.own += &square;
            parts.own_common += predictor.white_constants.tr_mul(&common);
            parts.own_score += predictor.white_constants.tr_mul(&value);
        }
        let own_mps: Vec<f64> = self.drones.iter().map(|drone| own_mps[*drone]).collect();
        System::integrated(parts, &own_mps)
    }
}

/// The best prediction of a step by those before it, and of a step by those behind it.
struct Predictor {
    /// What is multiplied with the steps before, the last one first.
    ahead: Vec<DMatrix<f64>>,
    /// What is multiplied with the steps behind; the same as `ahead` where time has no direction, and then not kept.
    behind: Option<Vec<DMatrix<f64>>>,
    /// Covariance of what is left.
    left: DMatrix<f64>,
    left_behind: DMatrix<f64>,
    /// Lower triangle of the factor of `left`.
    factor: Option<DMatrix<f64>>,
    /// Sum of the logarithms of its diagonal.
    ln_sd: f64,
    /// What is left of constants of the channels.
    of_constants: DMatrix<f64>,
    white_constants: DMatrix<f64>,
}

impl Predictor {
    fn new(variance: &DMatrix<f64>, is_reversible: bool) -> Self {
        let n = variance.nrows();
        let mut new = Self {
            ahead: Vec::new(),
            behind: (!is_reversible).then(Vec::new),
            left: variance.clone(),
            left_behind: variance.clone(),
            factor: None,
            ln_sd: 0.0,
            of_constants: DMatrix::identity(n, n),
            white_constants: DMatrix::zeros(n, n),
        };
        new.factorise();
        new
    }

    fn factorise(&mut self) {
        self.factor = self.left.clone().cholesky().map(nalgebra::Cholesky::unpack);
        self.ln_sd = self
            .factor
            .as_ref()
            .map_or(0.0, |factor| factor.diagonal().iter().map(|value| value.ln()).sum());
    }

    fn factor(&self) -> Option<&DMatrix<f64>> {
        self.factor.as_ref()
    }

    /// One step more.
    fn extend(&mut self, lagged: &[DMatrix<f64>]) -> Option<()> {
        let order = self.ahead.len();
        let mut unexplained = lagged.get(order + 1)?.clone();
        for (back, ahead) in self.ahead.iter().enumerate() {
            unexplained.gemm(-1.0, ahead, &lagged[order - back], 1.0);
        }
        // The factor of what is left ahead is at hand.
        let by_ahead = |of: &DMatrix<f64>| {
            let mut solved = self.factor.as_ref()?.solve_lower_triangular(of)?;
            self.factor.as_ref()?.tr_solve_lower_triangular_mut(&mut solved);
            Some(solved)
        };
        match &mut self.behind {
            None => {
                // Behind is as ahead: the new coefficient is the same, too.
                let new = by_ahead(&unexplained.transpose())?.transpose();
                self.left.gemm(-1.0, &new, &unexplained.transpose(), 1.0);
                let constants = self.of_constants.clone();
                self.of_constants.gemm(-1.0, &new, &constants, 1.0);
                let before = self.ahead.clone();
                for (back, ahead) in self.ahead.iter_mut().enumerate() {
                    ahead.gemm(-1.0, &new, &before[order - 1 - back], 1.0);
                }
                self.ahead.push(new);
            }
            Some(behind) => {
                let new_behind = by_ahead(&unexplained)?.transpose();
                let solved = self.left_behind.clone().cholesky()?.solve(&unexplained.transpose());
                let new = solved.transpose();
                self.left.gemm(-1.0, &new, &unexplained.transpose(), 1.0);
                self.left_behind.gemm(-1.0, &new_behind, &unexplained, 1.0);
                let before = self.ahead.clone();
                let n = self.left.nrows();
                let mut of_behind = DMatrix::identity(n, n);
                for behind in behind.iter() {
                    of_behind -= behind;
                }
                self.of_constants.gemm(-1.0, &new, &of_behind, 1.0);
                for (back, ahead) in self.ahead.iter_mut().enumerate() {
                    ahead.gemm(-1.0, &new, &behind[order - 1 - back], 1.0);
                }
                for (back, behind) in behind.iter_mut().enumerate() {
                    behind.gemm(-1.0, &new_behind, &before[order - 1 - back], 1.0);
                }
                self.ahead.push(new);
                behind.push(new_behind);
            }
        }
        self.factorise();
        self.factor.is_some().then_some(())
    }
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
    use crate::analysis::corrections::DOUBTS;
    use crate::analysis::kriging::covariance::{Air, Form};
    use crate::analysis::kriging::data::{UNIFORM, Value};
    use crate::analysis::kriging::vecchia::LEAST_OWN_MPS;
    use nalgebra::DVector;

    const SIZE: Size = Size { drones: 100, operations: 1e12 };

    fn fleet(seconds: usize) -> Vec<Drone> {
        (0..6)
            .map(|index| {
                let (x, y) = (f64::from(index % 3), f64::from(index / 3));
                let value = |second: usize| {
                    let wave = (0.05 * second as f64 + 0.4 * x - 0.3 * y).sin();
                    Value {
                        updraft_mps: 0.3 + 0.4 * wave + 0.05 * x,
                        law: std::array::from_fn(|column| 0.02 * (column as f64 + wave)),
                        doubts_mps: [0.01; DOUBTS],
                        own_mps: 0.05,
                        noise_mps: 0.04,
                    }
                };
                Drone {
                    place_m: vec![[12.0 * x, 15.0 * y, 40.0]],
                    values: (0..seconds).map(|second| Some(value(second))).collect(),
                    slope_share: 0.0,
                    own_slope_share: 0.0,
                }
            })
            .collect()
    }

    /// The likelihood by all values at once.
    fn dense(rows: &Rows, covariance: &Covariance, own_mps: f64) -> (f64, f64) {
        let n = rows.list.len();
        let mut matrix = DMatrix::from_fn(n, n, |row, column| {
            let (one, other) = (&rows.list[row], &rows.list[column]);
            let own = if one.spot.drone == other.spot.drone { own_mps * own_mps } else { 0.0 };
            covariance.of(&one.spot, &other.spot) + own
        });
        for row in 0..n {
            matrix[(row, row)] += rows.list[row].noise_mps.powi(2);
        }
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
            let air = Air {
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
            };
            let covariance = Covariance::new(air).shown(0.03);
            let drones = fleet(120);
            let rows = Rows::of(&drones, 5, 10);
            let blocks = Blocks::of(&drones, &rows, SIZE).unwrap();
            let own_mps = 0.05_f64.max(LEAST_OWN_MPS);
            let system = blocks.system(&covariance, &[own_mps; 6]).unwrap();
            let (expected, information) = dense(&rows, &covariance, own_mps);
            let found = system.posterior(&CommonVector::zeros(), &Common::zeros()).unwrap();
            assert!(
                (found.log_likelihood - expected).abs() < 1e-6 * expected.abs(),
                "{form:?} {drift_mps:?}: {} {expected}",
                found.log_likelihood
            );
            // An updraft that is everywhere the same, with a prior of 3 m/s.
            let mut factor = Common::zeros();
            factor[(UNIFORM, UNIFORM)] = 3.0;
            let uniform = system.posterior(&CommonVector::zeros(), &factor).unwrap();
            let variance = 1.0 / (information + 1.0 / 9.0);
            let found = uniform.covariance[(UNIFORM, UNIFORM)];
            assert!((found / variance - 1.0).abs() < 1e-6, "{found} {variance}");
        }
    }

    #[test]
    fn gaps_are_left_out_and_a_record_of_gaps_is_none() {
        let mut drones = fleet(200);
        drones[2].values.iter_mut().for_each(|value| *value = None);
        drones[4].values[103..].iter_mut().for_each(|value| *value = None);
        let rows = Rows::of(&drones, 5, 10);
        let blocks = Blocks::of(&drones, &rows, SIZE).unwrap();
        assert_eq!(blocks.drones, [0, 1, 3, 5], "as long as most of them");
        assert_eq!(blocks.records.len(), rows.seconds.len());
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
