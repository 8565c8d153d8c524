//! The air at drones, and between them, after all values were seen (kriging with estimated constants).

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::covariance::Covariance;
use super::data::{COMMON, Drone, Rows, UNIFORM};
use super::neighbours::{Reach, around};
use super::pairs::Pairs;
use super::vecchia::{Common, CommonVector, Weights, weights};
use crate::analysis::running::RUNNING_S;

/// What is looked at around a place.
const REACH: Reach = Reach { beside: 10, step: 6, own: 1 };

/// Everything linear as the values and the calibration leave it.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    /// Common errors.
    pub(super) mean: CommonVector,
    pub(super) covariance: Common,
    /// Constants of the drones at common errors of zero, m/s.
    pub(super) own: DVector<f64>,
    /// How the constants answer the common errors, negated.
    pub(super) answers: DMatrix<f64>,
    /// Covariance of the constants where the common errors are known.
    pub(super) own_covariance: DMatrix<f64>,
}

/// The air at one place: means over the 10 s around each second with standard deviations, m/s; and over all
/// seconds that have a value.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in super::super) struct Series {
    pub(in super::super) mean_mps: Vec<Option<f64>>,
    pub(in super::super) sd_mps: Vec<Option<f64>>,
    /// Mean over the seconds with a value, with its standard error.
    pub(in super::super) over_all: Option<(f64, f64)>,
}

/// What is known at a place and time, m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    pub(super) mean_mps: f64,
    pub(super) sd_mps: f64,
    /// Variance without what all drones share, (m/s)²: how well the place is known against its surroundings.
    pub(super) local_mps2: f64,
}

/// What is asked for at a place and time: the value, its variance, and what it hangs on.
struct Asked {
    value_mps: f64,
    variance: f64,
    /// The part of it that the values around leave.
    local: f64,
    /// By the common errors, with the drones' constants following them.
    by_common: CommonVector,
    /// By the constants.
    by_own: Vec<(usize, f64)>,
}

/// The model at its best with all values.
pub(super) struct Model<'a> {
    pub(super) drones: &'a [Drone],
    pub(super) covariance: Covariance,
    pub(super) linear: Linear,
}

impl Model<'_> {
    /// The air at sites (a drone, or a fixed place) over the record of so many seconds.
    pub(super) fn at(&self, sites: &[(Option<usize>, [f64; 3])], seconds: usize) -> Vec<Series> {
        let step = RUNNING_S as usize;
        let phases: Vec<Vec<Gathered>> = (0..step.min(seconds))
            .into_par_iter()
            .map(|phase| {
                let mut found = vec![Gathered::default(); sites.len()];
                self.phase(sites, phase, step, |_, second, site, asked| {
                    if let Some(asked) = asked {
                        found[site].add(second, &asked);
                    }
                });
                found
            })
            .collect();
        let mut found = vec![Gathered::default(); sites.len()];
        for phase in phases {
            found.iter_mut().zip(phase).for_each(|(all, part)| all.join(part));
        }
        found.into_par_iter().map(|site| site.series(&self.linear, seconds)).collect()
    }

    /// The air at fixed places: for each `step` seconds from `first` on the second, and mean and standard deviation at
    /// each place, m/s.
    pub(super) fn over(
        &self,
        places_m: &[[f64; 3]],
        first: usize,
        step: usize,
    ) -> Vec<(usize, Vec<Option<Known>>)> {
        let sites: Vec<(Option<usize>, [f64; 3])> =
            places_m.iter().map(|place| (None, *place)).collect();
        let mut found: Vec<(usize, Vec<Option<Known>>)> = Vec::new();
        self.phase(&sites, first, step, |block, second, site, asked| {
            if site == 0 {
                found.push((second, Vec::with_capacity(sites.len())));
            }
            let known = asked.map(|asked| Known {
                mean_mps: asked.value_mps,
                sd_mps: asked.variance.sqrt(),
                local_mps2: asked.local,
            });
            if let Some((_, places)) = found.get_mut(block) {
                places.push(known);
            }
        });
        found
    }

    /// All sites at one second of each step: what is asked for is handed on with the step, its second and the site, all
    /// seconds of one site after another (what is known of its drones' constants is looked up for all of them).
    fn phase(
        &self,
        sites: &[(Option<usize>, [f64; 3])],
        phase: usize,
        step: usize,
        mut take: impl FnMut(usize, usize, usize, Option<Asked>),
    ) {
        let rows = Rows::of(self.drones, phase, step);
        let near = around(self.drones, &rows, sites, REACH);
        let pairs = Pairs::of(&self.covariance, &rows);
        let weights: Vec<Option<Weights>> =
            near.patterns.par_iter().map(|pattern| weights(pattern, &pairs, false)).collect();
        let left: Vec<f64> = rows
            .list
            .iter()
            .map(|row| self.left(row.spot.drone, &row.common, row.value_mps))
            .collect();
        for (site, (drone, _)) in sites.iter().enumerate() {
            for (block, second) in rows.seconds.iter().enumerate() {
                let target = block * sites.len() + site;
                let asked = weights[near.of[target]]
                    .as_ref()
                    .map(|weights| self.asked(*drone, weights, &near.rows[target], &rows, &left));
                take(block, *second, site, asked);
            }
        }
    }

    /// A value less all that is linear: the field and gusts.
    pub(super) fn left(&self, drone: Option<usize>, common: &[f64; COMMON], value_mps: f64) -> f64 {
        let common = CommonVector::from(*common).dot(&self.linear.mean);
        value_mps - common - drone.map_or(0.0, |drone| self.own(drone))
    }

    /// Mean over all rows, with its standard error, m/s.
    pub(super) fn fleet(&self, rows: &Rows) -> Option<(f64, f64)> {
        let n = rows.list.len() as f64;
        if rows.list.is_empty() {
            return None;
        }
        let mut mean = 0.0;
        let mut by_common = CommonVector::zeros();
        let mut by_own = vec![0.0; self.drones.len()];
        let mut noise = 0.0;
        for row in &rows.list {
            mean += self.left(row.spot.drone, &row.common, row.value_mps) / n;
            by_common -= CommonVector::from(row.common) / n;
            noise += (row.noise_mps / n).powi(2);
            let Some(drone) = row.spot.drone else { continue };
            for column in 0..COMMON {
                by_common[column] += self.linear.answers[(drone, column)] / n;
            }
            by_own[drone] -= 1.0 / n;
        }
        // The uniform updraft is air, too.
        by_common[UNIFORM] += 1.0;
        let by_own: Vec<(usize, f64)> = by_own.into_iter().enumerate().collect();
        let variance = self.linear.variance(&by_common, &by_own) + noise;
        Some((mean + self.linear.mean[UNIFORM], variance.sqrt()))
    }

    /// What is not known of the air where no drone is near, without what is everywhere the same, m/s.
    pub(super) fn unknown_mps(&self) -> f64 {
        (self.covariance.field([0.0; 3], 0.0) + self.covariance.gusts(0.0)).sqrt()
    }

    fn own(&self, drone: usize) -> f64 {
        let answer: f64 = (0..COMMON)
            .map(|column| self.linear.answers[(drone, column)] * self.linear.mean[column])
            .sum();
        self.linear.own[drone] - answer
    }

    fn asked(
        &self,
        drone: Option<usize>,
        weights: &Weights,
        near: &[u32],
        rows: &Rows,
        left: &[f64],
    ) -> Asked {
        let mut value_mps = self.linear.mean[UNIFORM];
        let mut by_common = CommonVector::zeros();
        by_common[UNIFORM] = 1.0;
        let mut by_own: Vec<(usize, f64)> = Vec::new();
        for (weight, row) in weights.of.iter().zip(near) {
            let row = *row as usize;
            value_mps += weight * left[row];
            let seen = &rows.list[row];
            for column in 0..COMMON {
                by_common[column] -= weight * seen.common[column];
            }
            let Some(drone) = seen.spot.drone else { continue };
            for column in 0..COMMON {
                by_common[column] += weight * self.linear.answers[(drone, column)];
            }
            match by_own.iter_mut().find(|(known, _)| *known == drone) {
                Some((_, by)) => *by -= weight,
                None => by_own.push((drone, -weight)),
            }
        }
        let linear = self.linear.variance(&by_common, &by_own);
        // Where nobody measured there are gusts, too.
        let gusts = if drone.is_some() { 0.0 } else { self.covariance.gusts(0.0) };
        let local = weights.variance + gusts;
        Asked { value_mps, variance: local + linear, local, by_common, by_own }
    }
}

impl Linear {
    fn variance(&self, by_common: &CommonVector, by_own: &[(usize, f64)]) -> f64 {
        let mut sum = by_common.dot(&(self.covariance * by_common));
        for (one, by) in by_own {
            for (other, other_by) in by_own {
                sum += by * other_by * self.own_covariance[(*one, *other)];
            }
        }
        sum.max(0.0)
    }
}

impl Series {
    /// Widens values by a doubt of the law's slope: it moves them away from their mean.
    pub(super) fn doubt_slope(&mut self, share: f64) {
        let Some((mean, _)) = self.over_all else { return };
        for (value, sd) in self.mean_mps.iter().zip(&mut self.sd_mps) {
            if let Some((value, sd)) = value.zip(sd.as_mut()) {
                *sd = sd.hypot(share * (value - mean));
            }
        }
    }

    /// Adds to the value of each second, m/s.
    pub(super) fn add(&mut self, by_mps: impl Fn(usize) -> f64) {
        let (mut sum, mut count) = (0.0, 0.0);
        for (second, value) in self.mean_mps.iter_mut().enumerate() {
            let Some(value) = value else { continue };
            let more = by_mps(second);
            *value += more;
            sum += more;
            count += 1.0;
        }
        if let (Some((value, _)), true) = (&mut self.over_all, count > 0.0) {
            *value += sum / count;
        }
    }

    /// Widens standard deviations by how far another is off.
    pub(super) fn widen(&mut self, other: &Self) {
        let own = self.mean_mps.iter().zip(&mut self.sd_mps).zip(&other.mean_mps);
        for ((value, sd), there) in own {
            if let (Some(value), Some(sd), Some(there)) = (value, sd, there) {
                *sd = sd.hypot(there - value);
            }
        }
        if let (Some((value, sd)), Some((there, _))) = (&mut self.over_all, other.over_all) {
            *sd = sd.hypot(there - *value);
        }
    }

    /// Drops what lies before the first and behind the last value of a drone that moved: where it would have been nobody knows.
    pub(super) fn keep_near(&mut self, drone: &Drone) {
        if drone.hovers() {
            return;
        }
        let has = |value: &Option<super::data::Value>| value.is_some();
        let first = drone.values.iter().position(has).unwrap_or(usize::MAX);
        let last = drone.values.iter().rposition(has).unwrap_or(0);
        let outside = |index: usize| index < first || index > last;
        for values in [&mut self.mean_mps, &mut self.sd_mps] {
            values
                .iter_mut()
                .enumerate()
                .filter(|(index, _)| outside(*index))
                .for_each(|(_, value)| *value = None);
        }
    }
}

/// What was asked for at one site.
#[derive(Clone, Debug, Default)]
struct Gathered {
    /// Second, value and variance.
    values: Vec<(usize, f64, f64)>,
    by_common: CommonVector,
    by_own: BTreeMap<usize, f64>,
}

impl Gathered {
    fn add(&mut self, second: usize, asked: &Asked) {
        self.values.push((second, asked.value_mps, asked.variance));
        self.by_common += asked.by_common;
        for (drone, by) in &asked.by_own {
            *self.by_own.entry(*drone).or_default() += by;
        }
    }

    fn join(&mut self, other: Self) {
        self.values.extend(other.values);
        self.by_common += other.by_common;
        for (drone, by) in other.by_own {
            *self.by_own.entry(drone).or_default() += by;
        }
    }

    fn series(self, linear: &Linear, seconds: usize) -> Series {
        let mut series =
            Series { mean_mps: vec![None; seconds], sd_mps: vec![None; seconds], over_all: None };
        if self.values.is_empty() {
            return series;
        }
        let n = self.values.len() as f64;
        let (mut sum, mut variances) = (0.0, 0.0);
        for (second, value_mps, variance) in &self.values {
            series.mean_mps[*second] = Some(*value_mps);
            series.sd_mps[*second] = Some(variance.sqrt());
            sum += value_mps;
            variances += variance;
        }
        let by_own: Vec<(usize, f64)> =
            self.by_own.into_iter().map(|(drone, by)| (drone, by / n)).collect();
        let linear = linear.variance(&(self.by_common / n), &by_own);
        // What kriging leaves lasts about as long as its windows.
        let rest = (variances / n - linear).max(0.0) * (RUNNING_S / n).min(1.0);
        series.over_all = Some((sum / n, (linear + rest).sqrt()));
        series
    }
}
