//! Scales of the air by the likelihood of a map's values: the most probable ones, and a sample of those
//! that the values allow.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::covariance::{Air, Covariance, Form};
use super::data::{Drone, Rows, UNIFORM};
use super::dense::Dense;
use super::levinson::{Blocks, Size};
use super::neighbours::Neighbours;
use super::vecchia::{Common, CommonVector, System};
use crate::numeric::{Inverse, Least, minimise_roughly};

/// Scales that are searched, mostly as logarithms.
pub(super) const SCALES: usize = 10;
pub(super) const LN_SD: usize = 0;
pub(super) const LN_LENGTH: usize = 1;
const STRETCH_ALONG: usize = 2;
const STRETCH_DIAGONAL: usize = 3;
pub(super) const LN_TIME: usize = 4;
/// Drift as a share of the wind, of a family that drifts.
pub(super) const DRIFT: usize = 5;
pub(super) const LN_GUST: usize = 6;
const LN_GUST_TIME: usize = 7;
/// Of slow air besides.
pub(super) const LN_SLOW: usize = 8;
/// Of the error that all drones share, as a share of the wind.
const LN_SHARED: usize = 9;

/// Scales as they are searched.
pub(super) type Point = [f64; SCALES];

/// What is known before the values are seen: mean and standard deviation of each scale. A field day has 0.5 m/s,
/// 145 m and 186 s (docs/physics.md, 4.1); the priors reach from a tenth to ten times that and more, and only
/// matter where the values say nothing. Rolls of the boundary layer are three times as long as wide and more. A field that drifts
/// goes with the wind, roughly.
pub(super) const PRIOR: [(f64, f64); SCALES] = [
    (-1.2, 1.5),
    (4.7, 1.0),
    (0.0, 0.6),
    (0.0, 0.6),
    (5.2, 1.1),
    (0.9, 0.4),
    (-2.3, 1.5),
    (1.4, 0.6),
    (-1.4, 0.9),
    (-3.9, 0.7),
];

/// The updraft that is everywhere the same, before the values are seen: standard deviation, m/s. Slopes, waves and fans; chosen.
pub(super) const UNIFORM_MPS: f64 = 1.5;
/// The mean of all values where scales are looked for, whose likelihood is to know nothing of it: standard deviation, m/s.
const OPEN_MPS: f64 = 3.0;
/// Scales further from the prior than this many standard deviations are not looked at.
const FARTHEST: f64 = 4.0;
/// Step of the second differences. Numerical.
const STEP: f64 = 0.05;
/// Step of the first differences. Numerical.
const SLOPE_STEP: f64 = 1e-4;

/// Wind below which no drift is looked for, m/s: leans do not know it better.
const CALM_MPS: f64 = 0.2;
/// Length of gusts that a search begins with, m: their scale is about their height above the ground.
const GUSTS_M: f64 = 30.0;
/// Length and time of air that differs from drone to drone and lasts, with which a search begins, m and s: shorter than drones
/// are apart, longer than a hover.
const LASTING_M: f64 = 5.0;
/// See [`LASTING_M`].
const LASTING_S: f64 = 3000.0;
/// Slow air that it begins with besides, m/s.
const SLOW_MPS: f64 = 0.5;

/// A form that is less probable than another by so much does not count, nats. One in 150.
const NATS: f64 = 5.0;
/// The same where only some of the values were asked.
const COARSE_NATS: f64 = 12.0;

/// A search ends where two steps gain less than this, nats. Numerical: points are drawn around a top, not from it.
pub(super) const ENOUGH: f64 = 2e-3;
/// The same of one that only finds where another begins.
const COARSE_ENOUGH: f64 = 0.05;

/// See [`Axis::reach`]. Numerical.
const LEAST_REACH: f64 = 0.5;
/// See [`Axis::reach`]. Numerical.
const MOST_REACH: f64 = 3.0;
/// Values that are solved at once.
#[derive(Debug)]
pub(super) enum Whole {
    /// Of drones that stand still, at equal steps of time.
    Blocks(Box<Blocks>),
    /// Of any drones.
    Dense(Dense),
}

/// How much of a record is solved at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) blocks: Size,
    /// Values of a record that is no stationary one.
    pub(super) values: usize,
}

/// What scales and zero are found by. Numerical: of a hover 16 drones, and the 300 s before a value; of others 300 values,
/// which know a length to 15 %.
pub(super) const FINE: Extent =
    Extent { blocks: Size { drones: 16, operations: 12e6 }, values: 300 };
/// What the search begins with: of a hover 9 drones, and the 160 s before a value.
pub(super) const COARSE: Extent =
    Extent { blocks: Size { drones: 9, operations: 6e5 }, values: 100 };

impl Whole {
    /// Of a record of these drones.
    pub(super) fn of(drones: &[Drone], rows: &Rows, extent: Extent) -> Self {
        match Blocks::of(drones, rows, extent.blocks) {
            Some(blocks) => Self::Blocks(Box::new(blocks)),
            None => Self::Dense(Dense::of(rows, extent.values)),
        }
    }

    /// The likelihood with everything linear left open.
    fn system(&self, covariance: &Covariance, own_mps: &[f64]) -> Option<System> {
        match self {
            Self::Blocks(blocks) => blocks.system(covariance, own_mps),
            Self::Dense(dense) => dense.system(covariance, own_mps),
        }
    }
}

/// The likelihood of a record in its scales.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) rows: &'a Rows,
    pub(super) neighbours: &'a Neighbours,
    /// Values that are solved at once; none: each by its neighbours.
    pub(super) whole: Option<&'a Whole>,
    /// Fewer of them, to begin a search with.
    pub(super) coarse: Option<&'a Whole>,
    pub(super) own_mps: &'a [f64],
    /// Standard error of the drones' own slopes as a share of them.
    pub(super) slope_share: f64,
    /// Mean horizontal wind along show x and y, m/s; where it is not known, the field is taken to stay.
    pub(super) wind_mps: Option<[f64; 2]>,
    /// Factor of the prior covariance of the common errors.
    pub(super) factor: Common,
    /// By how much the drones' means over the record lie apart about a plane, m/s, where that is more than their constants
    /// allow; else 0.
    pub(super) lasting_mps: f64,
}

/// Kind of air that a likelihood takes the field for; no scale leads over from one to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Family {
    pub(super) form: Form,
    /// Whether the field goes with the wind; if not, it stays where it is.
    pub(super) drifts: bool,
}

impl Family {
    /// All of a form, where there is a wind or none is known.
    fn all(form: Form, in_wind: bool) -> Vec<Self> {
        let drifts: &[bool] = if in_wind { &[false, true] } else { &[false] };
        drifts.iter().map(|drifts| Self { form, drifts: *drifts }).collect()
    }

    /// Where the search for its scales begins: those of a field day, of gusts that drift over slow air, and of air that lasts
    /// and differs from drone to drone by `lasting_mps`, if it does.
    fn starts(self, lasting_mps: f64) -> Vec<Point> {
        let start = PRIOR.map(|(mean, _)| mean);
        let mut starts = vec![start];
        if self.drifts {
            let mut gusts = start;
            gusts[LN_LENGTH] = GUSTS_M.ln();
            gusts[LN_SLOW] = SLOW_MPS.ln();
            starts.push(gusts);
        } else if lasting_mps > 0.0 {
            // From longer ones the search ends where the drones' constants are stretched and the air is still.
            let mut lasting = start;
            lasting[LN_SD] = lasting_mps.ln();
            lasting[LN_LENGTH] = LASTING_M.ln();
            lasting[LN_TIME] = LASTING_S.ln();
            starts.push(lasting);
        }
        starts
    }
}

/// The most probable scales and their uncertainty.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) family: Family,
    pub(super) best: Point,
    /// Covariance of the scales.
    pub(super) covariance: SMatrix<f64, SCALES, SCALES>,
    /// How far the posterior reaches to both sides of its top.
    pub(super) axes: Vec<Axis>,
}

/// One direction of the posterior of the scales, as far as one standard deviation by the curvature at the top.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub(super) along: SVector<f64, SCALES>,
    /// How much farther it reaches than the curvature says, ahead and behind: a slow strong air cannot be told from a
    /// fast weak one by a short record, and the curvature at the top does not see that.
    pub(super) reach: [f64; 2],
}

#[cfg(test)]
impl Found {
    /// A normal distribution around a point.
    pub(super) fn guess(
        family: Family,
        best: Point,
        covariance: &SMatrix<f64, SCALES, SCALES>,
    ) -> Self {
        let axes = (0..SCALES).map(|axis| {
            let mut along = SVector::zeros();
            along[axis] = covariance[(axis, axis)].sqrt();
            Axis { along, reach: [1.0; 2] }
        });
        Self { family, best, covariance: *covariance, axes: axes.collect() }
    }
}

/// A prior in which the law's constant is not known, nor the updraft that is everywhere the same.
pub(super) fn open_factor(factor: &Common) -> Common {
    let mut open = *factor;
    open[(UNIFORM, UNIFORM)] = OPEN_MPS;
    open
}

/// Where a search for the scales of one family ended.
#[derive(Clone, Copy, Debug)]
struct Top {
    family: Family,
    best: Point,
    /// Logarithm of the posterior there.
    value: f64,
    /// Inverse of the curvature, as the search learned it.
    inverse: Inverse<SCALES>,
}

impl Top {
    fn of<T>(family: Family, Least { at, value, inverse, .. }: Least<SCALES, T>) -> Self {
        Self { family, best: at, value: -value, inverse }
    }
}

impl Search<'_> {
    /// The air of a point.
    pub(super) fn air(&self, family: Family, point: &Point) -> Air {
        air_of(family, point, self.wind_mps)
    }

    pub(super) fn log_posterior(&self, family: Family, point: &Point) -> f64 {
        let Some(system) = self.system(family, point) else { return f64::NEG_INFINITY };
        let likelihood = system
            .posterior(&CommonVector::zeros(), &self.factor)
            .map_or(f64::NEG_INFINITY, |posterior| posterior.log_likelihood);
        likelihood + log_prior(point)
    }

    pub(super) fn system(&self, family: Family, point: &Point) -> Option<System> {
        if outside(point) > 0.0 {
            return None;
        }
        self.system_in(&Covariance::new(self.air(family, point)).shown(self.slope_share))
    }

    /// The likelihood in the air of a covariance.
    pub(super) fn system_in(&self, covariance: &Covariance) -> Option<System> {
        match self.whole {
            Some(whole) => whole.system(covariance, self.own_mps),
            None => System::new(self.rows, self.neighbours, covariance, self.own_mps),
        }
    }

    /// Slopes of the loss, each by a thread of its own.
    fn slopes(&self, family: Family, at: &Point, value: f64) -> Point {
        let slopes: Vec<f64> = (0..SCALES)
            .into_par_iter()
            .map(|index| {
                let mut beside = *at;
                beside[index] += SLOPE_STEP;
                (-self.log_posterior(family, &beside) - value) / SLOPE_STEP
            })
            .collect();
        std::array::from_fn(|index| if slopes[index].is_finite() { slopes[index] } else { 0.0 })
    }

    /// The most probable scales from a start, by some of the values where that is enough to begin with, and with the curvature
    /// that the search for those of another form has learned, if there is one.
    fn climb(&self, family: Family, start: Point, alike: Option<&Top>) -> Top {
        let some = Search { whole: self.coarse.or(self.whole), ..*self };
        let loss = |point: &Point| -some.log_posterior(family, point);
        let slopes = |at: &Point, value| some.slopes(family, at, value);
        let enough = if self.coarse.is_some() { COARSE_ENOUGH } else { ENOUGH };
        let alike = alike.map(|top| &top.inverse);
        Top::of(family, minimise_roughly(start, alike, enough, loss, slopes))
    }

    /// Where searches from all starts end.
    fn climbed(&self, in_wind: bool) -> Vec<Top> {
        let starts: Vec<(Family, Point)> = Family::all(Form::default(), in_wind)
            .into_iter()
            .flat_map(|family| {
                let starts = family.starts(self.lasting_mps);
                starts.into_iter().map(move |start| (family, start))
            })
            .collect();
        let first: Vec<Top> =
            starts.par_iter().map(|(family, start)| self.climb(*family, *start, None)).collect();
        let others: Vec<Form> =
            Form::ALL.into_iter().filter(|form| *form != Form::default()).collect();
        let of_form = |form: Form| {
            let each = starts.par_iter().zip(&first);
            each.map(move |((family, start), alike)| {
                self.climb(Family { form, ..*family }, *start, Some(alike))
            })
        };
        let rest: Vec<Top> = others.into_par_iter().flat_map(of_form).collect();
        first.into_iter().chain(rest).collect()
    }

    /// The most probable scales, over families and starts.
    #[cfg(test)]
    pub(super) fn best(&self) -> Option<Found> {
        self.all().into_iter().next()
    }

    /// The most probable scales of each family that is not much less probable than another, the most probable first.
    pub(super) fn all(&self) -> Vec<Found> {
        let drifts = self.wind_mps.is_some_and(|[u, v]| u.hypot(v) > CALM_MPS);
        let climbed = self.climbed(drifts);
        let families = Form::ALL.into_iter().flat_map(|form| Family::all(form, drifts));
        let mut tops: Vec<Top> = families
            .filter_map(|family| {
                let own =
                    climbed.iter().filter(|top| top.family == family && top.value.is_finite());
                own.max_by(|a, b| a.value.total_cmp(&b.value)).copied()
            })
            .collect();
        keep_probable(&mut tops, if self.coarse.is_some() { COARSE_NATS } else { NATS });
        if self.coarse.is_some() {
            for top in &mut tops {
                let loss = |point: &Point| -self.log_posterior(top.family, point);
                let slopes = |at: &Point, value| self.slopes(top.family, at, value);
                let found = minimise_roughly(top.best, Some(&top.inverse), ENOUGH, loss, slopes);
                *top = Top::of(top.family, found);
            }
            keep_probable(&mut tops, NATS);
        }
        tops.into_iter()
            .map(|Top { family, best, value: log_posterior, .. }| {
                let covariance = self.curvature(family, &best, log_posterior);
                let axes = self.axes(family, &best, log_posterior, &covariance);
                Found { family, best, covariance, axes }
            })
            .collect()
    }

    /// Inverse of the curvature of the posterior at its top.
    fn curvature(&self, family: Family, best: &Point, top: f64) -> SMatrix<f64, SCALES, SCALES> {
        let value = |shifts: &[(usize, f64)]| {
            let mut point = *best;
            for (index, shift) in shifts {
                point[*index] += shift * STEP;
            }
            self.log_posterior(family, &point)
        };
        let ahead: Vec<f64> =
            (0..SCALES).into_par_iter().map(|axis| value(&[(axis, 1.0)])).collect();
        let pairs: Vec<(usize, usize)> =
            (0..SCALES).flat_map(|row| (0..=row).map(move |column| (row, column))).collect();
        let seconds: Vec<f64> = pairs
            .par_iter()
            .map(|(row, column)| {
                let (row, column) = (*row, *column);
                let second = if row == column {
                    ahead[row] + value(&[(row, -1.0)]) - 2.0 * top
                } else {
                    value(&[(row, 1.0), (column, 1.0)]) - ahead[row] - ahead[column] + top
                };
                second / (STEP * STEP)
            })
            .collect();
        let mut information = SMatrix::<f64, SCALES, SCALES>::zeros();
        for ((row, column), second) in pairs.into_iter().zip(seconds) {
            let second = if second.is_finite() { -second } else { 0.0 };
            information[(row, column)] = second;
            information[(column, row)] = second;
        }
        // Where a numerical curvature is less than the prior's, the prior's stands.
        let eigen = information.symmetric_eigen();
        let mut covariance = SMatrix::<f64, SCALES, SCALES>::zeros();
        for (index, value) in eigen.eigenvalues.iter().enumerate() {
            let vector: SVector<f64, SCALES> = eigen.eigenvectors.column(index).into();
            let prior: f64 =
                vector.iter().zip(PRIOR).map(|(part, (_, sd))| part * part / (sd * sd)).sum();
            covariance += vector * vector.transpose() / value.max(prior);
        }
        covariance
    }

    /// Directions of the posterior with how far it reaches to each side (the split normal of Rue, Martino and Chopin
    /// 2009, section 6.5): where it has fallen by as much as a normal one would at the square root of two.
    fn axes(
        &self,
        family: Family,
        best: &Point,
        top: f64,
        covariance: &SMatrix<f64, SCALES, SCALES>,
    ) -> Vec<Axis> {
        let eigen = covariance.symmetric_eigen();
        let sides: Vec<(usize, f64)> =
            (0..SCALES).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).collect();
        let reach: Vec<f64> = sides
            .par_iter()
            .map(|(axis, sign)| {
                let along =
                    eigen.eigenvectors.column(*axis) * eigen.eigenvalues[*axis].max(0.0).sqrt();
                let mut point = *best;
                let by = sign * std::f64::consts::SQRT_2;
                point.iter_mut().zip(along.iter()).for_each(|(own, along)| *own += by * along);
                let fallen = top - self.log_posterior(family, &point);
                if fallen.is_finite() { (1.0 / fallen.max(1e-3)).sqrt() } else { LEAST_REACH }
            })
            .map(|reach: f64| reach.clamp(LEAST_REACH, MOST_REACH))
            .collect();
        reach
            .chunks_exact(2)
            .enumerate()
            .map(|(axis, reach)| Axis {
                along: eigen.eigenvectors.column(axis) * eigen.eigenvalues[axis].max(0.0).sqrt(),
                reach: [reach[0], reach[1]],
            })
            .collect()
    }
}

/// The air of a point.
pub(super) fn air_of(family: Family, point: &Point, wind_mps: Option<[f64; 2]>) -> Air {
    let goes_mps = wind_mps.filter(|_| family.drifts);
    Air {
        form: family.form,
        sd_mps: point[LN_SD].exp(),
        length_m: point[LN_LENGTH].exp(),
        stretch: [point[STRETCH_ALONG], point[STRETCH_DIAGONAL]],
        time_s: point[LN_TIME].exp(),
        drift_mps: goes_mps.map_or([0.0; 2], |wind| wind.map(|part| point[DRIFT] * part)),
        gust_mps: point[LN_GUST].exp(),
        gust_s: point[LN_GUST_TIME].exp(),
        slow_mps: point[LN_SLOW].exp(),
        shared_mps: wind_mps.map_or(0.0, |[u, v]| point[LN_SHARED].exp() * u.hypot(v)),
    }
}

/// Drops families that are much less probable than another, and puts the most probable first.
fn keep_probable(tops: &mut Vec<Top>, nats: f64) {
    tops.retain(|top| top.value.is_finite());
    tops.sort_by(|a, b| b.value.total_cmp(&a.value));
    let most = tops.first().map_or(0.0, |top| top.value);
    tops.retain(|top| top.value > most - nats);
}

/// Logarithm of the prior, but for a constant.
pub(super) fn log_prior(point: &Point) -> f64 {
    let each = point.iter().zip(PRIOR).map(|(value, (mean, sd))| ((value - mean) / sd).powi(2));
    -0.5 * each.sum::<f64>()
}

/// How far a point is outside of what is looked at, standard deviations of the prior.
fn outside(point: &Point) -> f64 {
    let each =
        point.iter().zip(PRIOR).map(|(value, (mean, sd))| ((value - mean) / sd).abs() - FARTHEST);
    each.fold(0.0, f64::max)
}
