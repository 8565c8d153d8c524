//! The most probable thermal in air of given scales, and how well it is known.

use nalgebra::{DMatrix, SMatrix, SVector};
use rayon::prelude::*;

use super::shape::{
    DRIFT, DRIFT_MPS, LN_EDGE, LN_RADIUS, NUMBERS, Numbers, PLACE, PLACE_M, SINK, Shape,
};
use super::whiten::{White, Whitening};
use crate::analysis::kriging::data::Rows;
use crate::analysis::kriging::scales::ENOUGH;
use crate::numeric::{LOGARITHM_STEP, Least, differences_at_once, minimise_roughly};

/// A peak before the values are seen: standard deviation, m/s. Thermals that small drones fly in; chosen.
const PEAK_MPS: f64 = 2.0;
/// Logarithm of R in m before the values are seen, mean and standard deviation: 30 m, within 5 and 180 m. Thermals near
/// the ground are narrow (Lenschow and Stephens 1980); chosen.
const LN_RADIUS_PRIOR: (f64, f64) = (3.4, 0.9);
/// The same of the part that sinks around the core, between a Gaussian and a ring.
const SINK_PRIOR: (f64, f64) = (0.3, 0.4);
/// The same of the logarithm of the edge's exponent.
const LN_EDGE_PRIOR: (f64, f64) = (0.2, 0.3);
/// A drift differs from the wind, or from none, by so much, m/s.
const DRIFT_FREE_MPS: f64 = 0.3;
/// Where the wind is not known, a drift has this standard deviation, m/s.
const DRIFT_OPEN_MPS: f64 = 1.5;
/// A core may be outside of the places by this share of their extent, m or share.
const BEYOND: f64 = 0.25;
/// And by this at least, m.
const BEYOND_M: f64 = 10.0;
/// Beyond that its probability falls within this, m.
const BEYOND_FALLS_M: f64 = 10.0;
/// Places along each axis at which the search starts.
const PLACES: usize = 6;
/// Radii at which it starts, m.
const RADII_M: [f64; 3] = [10.0, 20.0, 40.0];
/// Parts of the record in which a drifting core may come by.
const PARTS: usize = 5;
/// Starts that are followed to their top.
const FOLLOWED: usize = 4;
/// Starts that are looked at together. Numerical: records of a few thousand values then stay close to the processor.
const AT_ONCE: usize = 8;
/// Starts closer than this are one, units of the search.
const ONE_START: f64 = 1.5;
/// Step of differences, units of the search. Numerical.
const STEP: f64 = 1e-3;

/// Number of unknowns with the peak.
pub(super) const UNKNOWNS: usize = NUMBERS + 1;
/// Place of the peak among them.
pub(super) const PEAK: usize = NUMBERS;
/// Covariance of a thermal's numbers and its peak.
pub(super) type Covariance = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Where and when thermals are looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    low_m: [f64; 2],
    high_m: [f64; 2],
    from_s: f64,
    to_s: f64,
    wind_mps: Option<[f64; 2]>,
}

/// A thermal as it was found.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) numbers: Numbers,
    /// When the core is at its place.
    pub(super) at_s: f64,
    pub(super) peak_mps: f64,
    pub(super) covariance: Covariance,
    /// Logarithm of the evidence for it over that for none, in air of these scales.
    pub(super) log_odds: f64,
}

impl Region {
    pub(super) fn of(rows: &Rows, wind_mps: Option<[f64; 2]>) -> Option<Self> {
        let spots = || rows.list.iter().map(|row| row.spot);
        let least =
            |axis: usize| spots().map(|spot| spot.place_m[axis]).fold(f64::INFINITY, f64::min);
        let most =
            |axis: usize| spots().map(|spot| spot.place_m[axis]).fold(f64::NEG_INFINITY, f64::max);
        let (first, last) = (rows.list.first()?, rows.list.last()?);
        let (low, high) = ([least(0), least(1)], [most(0), most(1)]);
        let beyond = [0, 1].map(|axis| (BEYOND * (high[axis] - low[axis])).max(BEYOND_M));
        Some(Self {
            low_m: [0, 1].map(|axis| low[axis] - beyond[axis]),
            high_m: [0, 1].map(|axis| high[axis] + beyond[axis]),
            from_s: first.spot.time_s,
            to_s: last.spot.time_s,
            wind_mps,
        })
    }

    /// A time within the record.
    pub(super) fn within_s(&self, time_s: f64) -> f64 {
        time_s.clamp(self.from_s, self.to_s)
    }

    /// Drift before the values are seen: mean and standard deviation along each axis, m/s. With the wind, or none.
    fn drift(&self) -> [(f64, f64); 2] {
        self.wind_mps.map_or([(0.0, DRIFT_OPEN_MPS); 2], |wind| {
            wind.map(|part| (0.5 * part, (0.5 * part).hypot(DRIFT_FREE_MPS)))
        })
    }

    /// Logarithm of the density of a thermal's numbers before the values are seen.
    fn log_prior(&self, numbers: &Numbers) -> f64 {
        let normal = |index: usize, (mean, sd): (f64, f64)| {
            -0.5 * ((numbers[index] - mean) / sd).powi(2) - ln_root(sd)
        };
        let mut sum = normal(LN_RADIUS, LN_RADIUS_PRIOR)
            + normal(SINK, SINK_PRIOR)
            + normal(LN_EDGE, LN_EDGE_PRIOR);
        for (axis, (mean, sd)) in self.drift().into_iter().enumerate() {
            sum += normal(DRIFT[axis], (mean / DRIFT_MPS, sd / DRIFT_MPS));
            let at_m = PLACE_M * numbers[PLACE[axis]];
            let outside_m = (self.low_m[axis] - at_m).max(at_m - self.high_m[axis]).max(0.0);
            sum -= 0.5 * (outside_m / BEYOND_FALLS_M).powi(2)
                + ((self.high_m[axis] - self.low_m[axis]) / PLACE_M).ln();
        }
        sum
    }

    /// Curvature of [`Self::log_prior`] but for the places'.
    fn precision(&self) -> Covariance {
        let mut precision = Covariance::zeros();
        let mut set = |index: usize, sd: f64| precision[(index, index)] = 1.0 / (sd * sd);
        set(LN_RADIUS, LN_RADIUS_PRIOR.1);
        set(SINK, SINK_PRIOR.1);
        set(LN_EDGE, LN_EDGE_PRIOR.1);
        for (axis, (_, sd)) in self.drift().into_iter().enumerate() {
            set(DRIFT[axis], sd / DRIFT_MPS);
            set(PLACE[axis], (self.high_m[axis] - self.low_m[axis]) / PLACE_M);
        }
        set(PEAK, PEAK_MPS);
        precision
    }

    /// Thermals from which the search starts, with the times at which their cores are at their places.
    fn starts(&self) -> Vec<(Numbers, f64)> {
        let open = 1.5 * DRIFT_OPEN_MPS / 2.0_f64.sqrt();
        let drifts: Vec<[f64; 2]> = match self.wind_mps {
            Some(wind) if wind[0].hypot(wind[1]) > DRIFT_FREE_MPS => vec![[0.0; 2], wind],
            Some(_) => vec![[0.0; 2]],
            None => vec![[0.0; 2], [open, 0.0], [-open, 0.0], [0.0, open], [0.0, -open]],
        };
        let mut starts = Vec::new();
        for drift in drifts {
            let parts = if drift == [0.0; 2] { 1 } else { PARTS };
            for part in 0..parts {
                let share = (part as f64 + 0.5) / parts as f64;
                let at_s = self.from_s + share * (self.to_s - self.from_s);
                for place in 0..PLACES * PLACES {
                    for radius_m in RADII_M {
                        let mut numbers = [0.0; NUMBERS];
                        for (axis, step) in [place % PLACES, place / PLACES].into_iter().enumerate()
                        {
                            let share = (step as f64 + 0.5) / PLACES as f64;
                            let at_m =
                                self.low_m[axis] + share * (self.high_m[axis] - self.low_m[axis]);
                            numbers[PLACE[axis]] = at_m / PLACE_M;
                            numbers[DRIFT[axis]] = drift[axis] / DRIFT_MPS;
                        }
                        numbers[LN_RADIUS] = radius_m.ln();
                        numbers[SINK] = SINK_PRIOR.0;
                        numbers[LN_EDGE] = LN_EDGE_PRIOR.0;
                        starts.push((numbers, at_s));
                    }
                }
            }
        }
        starts
    }
}

/// Logarithm of the root of the area under a normal curve.
fn ln_root(sd: f64) -> f64 {
    (sd * std::f64::consts::TAU.sqrt()).ln()
}

/// What a thermal of peak 1 m/s adds to each value.
pub(super) fn record(rows: &Rows, numbers: &Numbers, at_s: f64) -> Vec<f64> {
    let shape = Shape::new(numbers, at_s);
    rows.list
        .iter()
        .map(|row| shape.mean(row.spot.place_m, row.spot.time_s, row.spot.velocity_mps))
        .collect()
}

/// One record in air of given scales.
pub(super) struct Fit<'a> {
    pub(super) rows: &'a Rows,
    pub(super) region: &'a Region,
    pub(super) whitening: &'a Whitening<'a>,
    /// The values.
    pub(super) values: White,
}

impl Fit<'_> {
    fn white(&self, numbers: &Numbers, at_s: f64) -> White {
        self.whitening.white(&record(self.rows, numbers, at_s))
    }

    /// Logarithm of the density of the values with a thermal of these numbers and any peak, over that without.
    fn log_density(&self, numbers: &Numbers, at_s: f64) -> f64 {
        self.of_shape(numbers, &self.white(numbers, at_s))
    }

    /// The same of several thermals.
    fn log_densities(&self, thermals: &[(Numbers, f64)]) -> Vec<f64> {
        let records = thermals.iter().map(|(numbers, at_s)| record(self.rows, numbers, *at_s));
        let columns: Vec<f64> = records.flatten().collect();
        let records = DMatrix::from_vec(self.rows.list.len(), thermals.len(), columns);
        let shapes = self.whitening.all_white(records);
        let each = thermals.iter().zip(&shapes);
        each.map(|((numbers, _), shape)| self.of_shape(numbers, shape)).collect()
    }

    /// The same of a thermal whose record was made white.
    fn of_shape(&self, numbers: &Numbers, shape: &White) -> f64 {
        let precision = shape.dot(shape) + 1.0 / (PEAK_MPS * PEAK_MPS);
        let score = shape.dot(&self.values);
        // A peak that sinks is no thermal: half of the prior says so.
        let gain = if score > 0.0 { 0.5 * score * score / precision } else { 0.0 };
        gain - (PEAK_MPS * precision.sqrt()).ln()
            + std::f64::consts::LN_2
            + self.region.log_prior(numbers)
    }

    /// The most probable thermal.
    pub(super) fn best(&self) -> Option<Candidate> {
        let valued = |starts: &[(Numbers, f64)]| -> Vec<(Numbers, f64, f64)> {
            let values = self.log_densities(starts).into_iter();
            starts
                .iter()
                .zip(values)
                .map(|((numbers, at_s), value)| (*numbers, *at_s, value))
                .collect()
        };
        let starts = self.region.starts();
        let mut starts: Vec<(Numbers, f64, f64)> =
            starts.par_chunks(AT_ONCE).flat_map_iter(valued).collect();
        starts.retain(|(_, _, value)| value.is_finite());
        starts.sort_by(|a, b| b.2.total_cmp(&a.2));
        let mut followed: Vec<(Numbers, f64)> = Vec::new();
        for (numbers, at_s, _) in starts {
            let near = |(known, known_s): &(Numbers, f64)| {
                *known_s == at_s
                    && (0..NUMBERS).all(|index| (known[index] - numbers[index]).abs() < ONE_START)
            };
            if followed.len() < FOLLOWED && !followed.iter().any(near) {
                followed.push((numbers, at_s));
            }
        }
        self.from(&followed)
    }

    /// The most probable thermal from some starts.
    pub(super) fn from(&self, starts: &[(Numbers, f64)]) -> Option<Candidate> {
        let tops: Vec<(Numbers, f64, f64)> = starts
            .par_iter()
            .map(|(start, at_s)| {
                let loss = |numbers: &Numbers| -self.log_density(numbers, *at_s);
                let losses = |places: &[Numbers; NUMBERS]| -> Numbers {
                    let values = self.log_densities(&places.map(|numbers| (numbers, *at_s)));
                    std::array::from_fn(|index| -values[index])
                };
                let slopes =
                    |at: &Numbers, value| differences_at_once(losses, at, value, LOGARITHM_STEP);
                let Least { at, value: least, .. } =
                    minimise_roughly(*start, None, ENOUGH, loss, slopes);
                (at, *at_s, -least)
            })
            .filter(|top| top.2.is_finite())
            .collect();
        let (numbers, at_s, top) = tops.into_iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
        self.candidate(numbers, at_s, top)
    }

    fn candidate(&self, numbers: Numbers, at_s: f64, top: f64) -> Option<Candidate> {
        let shape = self.white(&numbers, at_s);
        let precision = shape.dot(&shape) + 1.0 / (PEAK_MPS * PEAK_MPS);
        let peak_mps = shape.dot(&self.values) / precision;
        if peak_mps <= 0.0 {
            return None;
        }
        let mut slopes: Vec<White> = (0..NUMBERS)
            .map(|index| {
                let shifted = |by: f64| {
                    let mut numbers = numbers;
                    numbers[index] += by;
                    record(self.rows, &numbers, at_s)
                };
                let (more, less) = (shifted(STEP), shifted(-STEP));
                let slope: Vec<f64> = more
                    .iter()
                    .zip(&less)
                    .map(|(more, less)| peak_mps * (more - less) / (2.0 * STEP))
                    .collect();
                self.whitening.white(&slope)
            })
            .collect();
        slopes.push(shape);
        let information = Covariance::from_fn(|row, column| slopes[row].dot(&slopes[column]))
            + self.region.precision();
        let covariance = information.try_inverse()?;
        // The peak's part of the area is in `top` already.
        let shape_only = covariance.fixed_view::<NUMBERS, NUMBERS>(0, 0).into_owned();
        let ln_area = 0.5 * NUMBERS as f64 * std::f64::consts::TAU.ln()
            + 0.5 * shape_only.determinant().max(f64::MIN_POSITIVE).ln();
        let log_odds = top + ln_area;
        (log_odds.is_finite() && covariance.diagonal().iter().all(|value| *value > 0.0))
            .then_some(Candidate { numbers, at_s, peak_mps, covariance, log_odds })
    }
}

impl Candidate {
    /// The same thermal, with the time at which its place is known best.
    pub(super) fn at_its_best(mut self, region: &Region) -> Self {
        let own = |row: usize, column: usize| self.covariance[(row, column)];
        let mixed: f64 = [0, 1].into_iter().map(|axis| own(PLACE[axis], DRIFT[axis])).sum();
        let drifts: f64 = [0, 1].into_iter().map(|axis| own(DRIFT[axis], DRIFT[axis])).sum();
        let ratio = PLACE_M / DRIFT_MPS;
        let at_s = region.within_s(self.at_s - ratio * mixed / drifts);
        let by = (at_s - self.at_s) / ratio;
        let mut turned = Covariance::identity();
        for axis in [0, 1] {
            self.numbers[PLACE[axis]] += by * self.numbers[DRIFT[axis]];
            turned[(PLACE[axis], DRIFT[axis])] = by;
        }
        self.covariance = turned * self.covariance * turned.transpose();
        self.at_s = at_s;
        self
    }

    /// The same thermal off by one standard error in each independent direction.
    pub(super) fn asides(&self) -> Vec<Self> {
        let eigen = self.covariance.symmetric_eigen();
        let sds = eigen.eigenvalues.iter().map(|value| value.max(0.0).sqrt());
        let aside = |(sd, way): (f64, SVector<f64, UNKNOWNS>)| {
            let mut aside = self.clone();
            aside.numbers.iter_mut().zip(way.iter()).for_each(|(number, by)| *number += sd * by);
            aside.peak_mps += sd * way[PEAK];
            aside
        };
        sds.zip(eigen.eigenvectors.column_iter().map(nalgebra::Matrix::into_owned))
            .filter(|(sd, _)| *sd > 0.0)
            .map(aside)
            .collect()
    }

    /// Something that follows from the numbers and the peak, with its standard error.
    pub(super) fn derived(&self, of: impl Fn(&Numbers, f64) -> f64) -> (f64, f64) {
        let value = of(&self.numbers, self.peak_mps);
        let slope = SVector::<f64, UNKNOWNS>::from_fn(|index, _| {
            let shifted = |by: f64| {
                let (mut numbers, mut peak_mps) = (self.numbers, self.peak_mps);
                match numbers.get_mut(index) {
                    Some(number) => *number += by,
                    None => peak_mps += by,
                }
                of(&numbers, peak_mps)
            };
            (shifted(STEP) - shifted(-STEP)) / (2.0 * STEP)
        });
        (value, slope.dot(&(self.covariance * slope)).max(0.0).sqrt())
    }
}
