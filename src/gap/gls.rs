//! Generalised least squares with the noise's covariance: what regressors explain, with the shared
//! air, drones' offsets and scatter partialled out exactly.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::numeric::{extent, mean};

use super::memory::{Digest, Memory};
use super::noise::{COUNT, GroupPattern, Hyper, Whitener};
use super::response::Response;
use crate::numeric::{Inverse, Least, minimise_known};

/// Values of all drones, by group, drone and bin.
pub(super) type Pulses = Vec<Vec<Vec<f64>>>;

/// A regressor, by group, drone and bin.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// One series for all drones of a group: by group and bin.
    Shared(Vec<Vec<f64>>),
    /// Values by group, drone and bin.
    Own(Pulses),
}

impl Column {
    /// Means over each group's drones, by group and bin.
    pub(super) fn means(&self) -> Vec<Vec<f64>> {
        match self {
            Self::Shared(values) => values.clone(),
            Self::Own(values) => means_of(values),
        }
    }

    /// Other values in the same places: by group, drone (0 where all drones share them) and bin.
    #[must_use]
    pub(super) fn each(&self, value: impl Fn(usize, usize, usize) -> f64) -> Self {
        let bins = |group: usize, drone: usize, bins: &[f64]| -> Vec<f64> {
            (0..bins.len()).map(|bin| value(group, drone, bin)).collect()
        };
        match self {
            Self::Shared(values) => {
                let groups = values.iter().enumerate();
                Self::Shared(groups.map(|(group, values)| bins(group, 0, values)).collect())
            }
            Self::Own(values) => {
                let drones = |(group, drones): (usize, &Vec<Vec<f64>>)| {
                    let each = drones.iter().enumerate();
                    each.map(|(drone, values)| bins(group, drone, values)).collect()
                };
                Self::Own(values.iter().enumerate().map(drones).collect())
            }
        }
    }

    /// This column less another.
    #[must_use]
    pub(super) fn less(&self, other: &Self) -> Self {
        let own = if matches!(self, Self::Own(_)) { self } else { other };
        own.each(|group, drone, bin| self.at(group, drone, bin) - other.at(group, drone, bin))
    }

    /// Only some bins, chosen by the places of group and bin.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize, usize) -> bool) -> Self {
        let bins = |group: usize, bins: &Vec<f64>| -> Vec<f64> {
            let kept = bins.iter().enumerate().filter(|(bin, _)| keep(group, *bin));
            kept.map(|(_, value)| *value).collect()
        };
        match self {
            Self::Shared(values) => {
                Self::Shared(values.iter().enumerate().map(|(g, values)| bins(g, values)).collect())
            }
            Self::Own(values) => {
                let drones = |(g, drones): (usize, &Vec<Vec<f64>>)| {
                    drones.iter().map(|values| bins(g, values)).collect()
                };
                Self::Own(values.iter().enumerate().map(drones).collect())
            }
        }
    }

    /// Value for one drone and bin.
    pub fn at(&self, group: usize, drone: usize, bin: usize) -> f64 {
        match self {
            Self::Shared(values) => values[group][bin],
            Self::Own(values) => values[group][drone][bin],
        }
    }

    /// Difference between the largest and the smallest value.
    pub fn range(&self) -> f64 {
        let extent = match self {
            Self::Shared(values) => extent(values.iter().flatten()),
            Self::Own(values) => extent(values.iter().flatten().flatten()),
        };
        extent.map_or(0.0, |(low, high)| high - low)
    }

    /// Standard deviation over all bins and drones.
    pub fn spread(&self, drones: &[usize]) -> f64 {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let mut add = |value: f64, weight: f64| {
            count += weight;
            sum += weight * value;
            squares += weight * value * value;
        };
        match self {
            Self::Shared(values) => {
                for (bins, drones) in values.iter().zip(drones) {
                    for value in bins {
                        add(*value, *drones as f64);
                    }
                }
            }
            Self::Own(values) => {
                for value in values.iter().flatten().flatten() {
                    add(*value, 1.0);
                }
            }
        }
        (squares / count - (sum / count).powi(2)).max(0.0).sqrt()
    }
}

/// Means over each group's drones, by group and bin.
pub(super) fn means_of(pulses: &Pulses) -> Vec<Vec<f64>> {
    let of_group = |drones: &Vec<Vec<f64>>| -> Vec<f64> {
        let bins = drones.first().map_or(0, Vec::len);
        (0..bins).filter_map(|bin| mean(drones.iter().map(|drone| drone[bin]))).collect()
    };
    pulses.iter().map(of_group).collect()
}

/// Pulses split into groups' means and drones' deviations.
#[derive(Clone, Debug)]
pub(super) struct Split {
    means: Vec<Vec<f64>>,
    deviations: Pulses,
    /// Whether its coefficient is known to be 0 within 1.
    is_doubt: bool,
}

impl Split {
    /// Of pulses by group, drone and bin.
    pub(super) fn of(pulses: &Pulses) -> Self {
        let means = means_of(pulses);
        let deviations = pulses
            .iter()
            .zip(&means)
            .map(|(drones, mean)| {
                let from_mean =
                    |drone: &Vec<f64>| drone.iter().zip(mean).map(|(a, b)| a - b).collect();
                drones.iter().map(from_mean).collect()
            })
            .collect();
        Self { means, deviations, is_doubt: false }
    }

    /// Each drone's deviations from the mean of its group.
    pub(super) fn deviations(&self, group: usize) -> &[Vec<f64>] {
        self.deviations.get(group).map_or(&[], Vec::as_slice)
    }

    fn of_column(column: &Column) -> Self {
        match column {
            Column::Shared(_) => {
                Self { means: column.means(), deviations: Vec::new(), is_doubt: false }
            }
            Column::Own(values) => Self::of(values),
        }
    }
}

/// Something whitened.
#[derive(Clone, Debug, Default)]
pub(super) struct White {
    means: Vec<f64>,
    deviations: Vec<f64>,
    /// What is known of coefficients, as observations of their own: the place is the regressor's.
    known: Vec<f64>,
}

impl White {
    /// Of several at once.
    fn of<'s>(whitener: &Whitener, splits: impl IntoIterator<Item = &'s Split>) -> Vec<Self> {
        let splits: Vec<&Split> = splits.into_iter().collect();
        let of_means =
            || whitener.means(splits.len(), |split, group, bin| splits[split].means[group][bin]);
        let own = |split: &&Split| {
            let mut deviations = Vec::new();
            for (group, drones) in split.deviations.iter().enumerate() {
                deviations.extend(whitener.deviations(group, drones));
            }
            deviations
        };
        let (means, own) =
            rayon::join(of_means, || splits.iter().map(own).collect::<Vec<Vec<f64>>>());
        let means = means.chunks_exact(whitener.bins().max(1)).map(<[f64]>::to_vec);
        let white = |(means, deviations)| Self { means, deviations, known: Vec::new() };
        means.zip(own).map(white).collect()
    }

    fn dot(&self, other: &Self) -> f64 {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        product(&self.means, &other.means)
            + product(&self.deviations, &other.deviations)
            + product(&self.known, &other.known)
    }
}

/// Noise that was fitted: of several flights' searches.
static FITTED: Memory<Start> = Memory::of(20_000);

/// The place at which a fit of the noise begins.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Start {
    /// Parameters of the noise.
    pub hyper: Hyper,
    /// How the likelihood bends there, by a problem that is much like the one to be fitted.
    inverse: Option<Arc<Inverse<COUNT>>>,
}

impl Start {
    /// All that a fit follows from it.
    pub(super) fn add_to(&self, digest: &mut Digest) {
        digest.add_all(&self.hyper.0);
        digest.add_all(self.inverse.iter().flat_map(|inverse| inverse.iter().flatten()));
    }
}

impl From<Hyper> for Start {
    fn from(hyper: Hyper) -> Self {
        Self { hyper, inverse: None }
    }
}

impl From<&Self> for Start {
    fn from(start: &Self) -> Self {
        start.clone()
    }
}

impl From<&Solution> for Start {
    fn from(solution: &Solution) -> Self {
        Self { hyper: solution.hyper, inverse: solution.inverse.clone() }
    }
}

/// A problem: measured against the model, and the regressors that are in the model already.
#[derive(Clone, Debug)]
pub(super) struct Problem<'a> {
    /// Patterns of the groups.
    pub groups: &'a [GroupPattern],
    /// Pulses to explain.
    pub pulses: &'a Split,
    /// Regressors that are free: the common offset first.
    pub columns: Vec<Split>,
}

impl<'a> Problem<'a> {
    /// With a common offset.
    pub(super) fn new(groups: &'a [GroupPattern], pulses: &'a Split) -> Self {
        let ones = groups.iter().map(|group| vec![1.0; group.time_s.len()]).collect();
        Self { groups, pulses, columns: vec![Split::of_column(&Column::Shared(ones))] }
    }

    /// This problem with other patterns of the groups.
    pub(super) fn among<'b>(&self, groups: &'b [GroupPattern]) -> Problem<'b>
    where
        'a: 'b,
    {
        Problem { groups, pulses: self.pulses, columns: self.columns.clone() }
    }

    /// With further regressors.
    #[must_use]
    pub(super) fn with<'c>(&self, columns: impl IntoIterator<Item = &'c Column>) -> Self {
        let mut more = self.clone();
        more.columns.extend(columns.into_iter().map(Split::of_column));
        more
    }

    /// With what is not known exactly: regressors of one standard deviation each.
    #[must_use]
    pub(super) fn doubting<'c>(&self, columns: impl IntoIterator<Item = &'c Column>) -> Self {
        let mut more = self.clone();
        let doubts = columns.into_iter().map(Split::of_column);
        more.columns.extend(doubts.map(|column| Split { is_doubt: true, ..column }));
        more
    }

    /// The first of the doubts by a solution, in its standard deviations.
    pub(super) fn first_doubt(&self, solution: &Solution) -> Option<f64> {
        let place = self.columns.iter().position(|column| column.is_doubt)?;
        solution.beta.get(place).copied()
    }

    /// What a solution leaves of the groups' means, by group and bin, us.
    pub(super) fn rest(&self, solution: &Solution) -> Vec<Vec<f64>> {
        let mut rest = self.pulses.means.clone();
        for (column, beta) in self.columns.iter().zip(&solution.beta) {
            for (rest, value) in rest.iter_mut().flatten().zip(column.means.iter().flatten()) {
                *rest -= beta * value;
            }
        }
        rest
    }

    /// The updraft that all drones share by a solution, by group and bin, m/s.
    pub(super) fn shared_mps(&self, solution: &Solution) -> Vec<Vec<f64>> {
        let rest = self.rest(solution);
        solution.whitener.shared_mps(&rest, self.groups, &solution.hyper)
    }

    /// At fixed noise.
    pub(super) fn at(&self, hyper: &Hyper) -> Solution {
        let whitener = Whitener::new(self.groups, hyper);
        let mut columns = White::of(&whitener, self.columns.iter().chain([self.pulses]));
        let y = columns.pop().unwrap_or_default();
        for (place, (white, column)) in columns.iter_mut().zip(&self.columns).enumerate() {
            if column.is_doubt {
                white.known = vec![0.0; place];
                white.known.push(1.0);
            }
        }
        Solution::new(whitener, y, columns, *hyper)
    }

    /// At the noise of a start, bent as there.
    pub(super) fn as_fitted(&self, start: &Start) -> Solution {
        Solution { inverse: start.inverse.clone(), ..self.at(&start.hyper) }
    }

    /// Most probable noise from a start, with everything linear at its best.
    pub(super) fn fit(&self, start: impl Into<Start>, likelihood: Likelihood) -> Solution {
        let start = start.into();
        let mut digest = self.digest();
        start.add_to(&mut digest);
        digest.add(u64::from(likelihood == Likelihood::Restricted));
        if let Some(known) = FITTED.get(digest) {
            return self.as_fitted(&known);
        }
        let fitted = self.fitted(&start, likelihood);
        FITTED.keep(digest, Start::from(&fitted));
        fitted
    }

    /// All that a fit follows from but its start.
    fn digest(&self) -> Digest {
        let mut digest = Digest::new();
        digest.add(self.groups.len() as u64);
        // All fields by name: a new one must be taken in, too.
        for group in self.groups {
            let GroupPattern {
                drones,
                time_s,
                height_m,
                response,
                shift_mps,
                bent_us,
                side_response,
                offset,
                slope_us,
                unsteady_us,
            } = group;
            digest.add(*drones as u64);
            for values in [time_s, height_m, shift_mps, bent_us, offset, slope_us, unsteady_us] {
                digest.add_all(values);
            }
            digest.add_all(response.iter().flat_map(Response::values));
            digest.add_all(side_response.iter().flatten());
        }
        for split in [self.pulses].into_iter().chain(&self.columns) {
            let Split { means, deviations, is_doubt } = split;
            digest.add(u64::from(*is_doubt));
            for values in means.iter().chain(deviations.iter().flatten()) {
                digest.add_all(values);
            }
        }
        digest
    }

    fn fitted(&self, start: &Start, likelihood: Likelihood) -> Solution {
        let objective = |at: &[f64; COUNT]| {
            let solution = self.at(&Hyper(*at));
            let likely = solution.log_likelihood(likelihood) + solution.hyper.log_prior();
            (-likely, solution)
        };
        let slopes = |_: &[f64; COUNT], solution: &Solution| {
            let mut slopes = solution.slopes(self.groups, likelihood);
            for (slope, prior) in slopes.iter_mut().zip(solution.hyper.prior_slopes()) {
                *slope -= prior;
            }
            slopes
        };
        let Least { known, inverse, .. } =
            minimise_known(start.hyper.0, start.inverse.as_deref(), objective, slopes);
        Solution { inverse: Some(Arc::new(inverse)), ..known }
    }
}

/// Which likelihood the noise is fitted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Likelihood {
    /// Maximum likelihood: gains of regressors can be compared.
    Profile,
    /// Restricted: knows that regressors were fitted; for intervals.
    Restricted,
}

/// A problem solved at one noise.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// Parameters of the noise.
    pub hyper: Hyper,
    whitener: Whitener,
    y: White,
    columns: Vec<White>,
    factor: Option<Cholesky<f64, Dyn>>,
    /// Coefficients of the regressors.
    pub beta: Vec<f64>,
    /// Weighted sum of squares that is left.
    pub chi2: f64,
    /// Degrees of freedom: number of observations less that of regressors.
    pub freedom: f64,
    /// How the likelihood bends by the noise, if that was fitted.
    inverse: Option<Arc<Inverse<COUNT>>>,
}

/// What a regressor would gain at fixed noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gain {
    /// Coefficient of the regressor.
    pub beta: f64,
    /// Standard error of the coefficient.
    pub se: f64,
    /// Gain of log-likelihood, nats.
    pub nats: f64,
}

impl Solution {
    fn new(whitener: Whitener, y: White, columns: Vec<White>, hyper: Hyper) -> Self {
        let count = columns.len();
        let all: Vec<&White> = columns.iter().chain([&y]).collect();
        let products = products(&all);
        let normal = products.view((0, 0), (count, count)).into_owned();
        let right = DVector::from_fn(count, |row, _| products[(row, count)]);
        let factor = normal.cholesky();
        let beta = factor.as_ref().map_or_else(
            || vec![0.0; count],
            |factor| factor.solve(&right).iter().copied().collect(),
        );
        let explained: f64 = beta.iter().zip(right.iter()).map(|(beta, right)| beta * right).sum();
        let total = products[(count, count)];
        let freedom = (y.means.len() + y.deviations.len()) as f64 - count as f64;
        let chi2 = total - explained;
        Self { hyper, whitener, y, columns, factor, beta, chi2, freedom, inverse: None }
    }

    /// Logarithm of the likelihood, without its constant; −∞ where regressors are collinear.
    pub(super) fn log_likelihood(&self, likelihood: Likelihood) -> f64 {
        let Some(factor) = &self.factor else { return f64::NEG_INFINITY };
        let mut twice = self.whitener.log_det + self.chi2;
        if likelihood == Likelihood::Restricted {
            twice += 2.0 * factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum::<f64>();
        }
        -0.5 * twice
    }

    /// How minus the log-likelihood changes with each parameter of the noise of these groups. (The coefficients are
    /// the best, so their own change counts for nothing.)
    fn slopes(&self, groups: &[GroupPattern], likelihood: Likelihood) -> [f64; COUNT] {
        let mut rests = vec![self.rest()];
        if let (Some(factor), Likelihood::Restricted) = (&self.factor, likelihood) {
            // What the determinant of the information changes by is the squares of independent regressors.
            let own = DMatrix::identity(self.columns.len(), self.columns.len());
            if let Some(shares) = factor.l().solve_lower_triangular(&own) {
                rests.extend(shares.row_iter().map(|row| {
                    let shares: Vec<f64> = row.iter().copied().collect();
                    combined(White::default(), &self.columns, &shares)
                }));
            }
        }
        let series: Vec<(&[f64], &[f64])> =
            rests.iter().map(|rest| (&rest.means[..], &rest.deviations[..])).collect();
        self.whitener.slopes(groups, &self.hyper, &series)
    }

    /// Log-likelihood with the prior of the noise.
    pub(super) fn log_posterior(&self) -> f64 {
        self.log_likelihood(Likelihood::Profile) + self.hyper.log_prior()
    }

    /// Covariance of the coefficients.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let count = self.columns.len();
        self.factor.as_ref().map_or_else(|| DMatrix::zeros(count, count), Cholesky::inverse)
    }

    /// What one more regressor would gain, with all others free, at this noise.
    pub(super) fn gain(&self, column: &Column) -> Gain {
        let white = self.white(column);
        let Some((information, score)) = self.partial(&white) else { return Gain::default() };
        let beta = score / information;
        Gain { beta, se: information.recip().sqrt(), nats: 0.5 * score * beta }
    }

    /// What several more regressors would gain together: coefficients and nats.
    pub(super) fn gain_of_all(&self, columns: &[Column]) -> (Vec<f64>, f64) {
        let splits: Vec<Split> = columns.iter().map(Split::of_column).collect();
        let whites = White::of(&self.whitener, &splits);
        let count = whites.len();
        let residual = self.rest();
        let parts: Vec<White> = whites.iter().map(|white| self.residual_of(white)).collect();
        let normal = DMatrix::from_fn(count, count, |row, column| {
            parts[row].dot(&parts[column]) + if row == column { 1e-9 } else { 0.0 }
        });
        let right = DVector::from_fn(count, |row, _| parts[row].dot(&residual));
        let Some(factor) = normal.cholesky() else { return (vec![0.0; count], 0.0) };
        let beta = factor.solve(&right);
        (beta.iter().copied().collect(), 0.5 * beta.dot(&right))
    }

    /// A regressor whitened.
    pub(super) fn white(&self, column: &Column) -> White {
        White::of(&self.whitener, [&Split::of_column(column)]).pop().unwrap_or_default()
    }

    /// Correlation of two regressors with everything in the model partialled out.
    pub(super) fn likeness(&self, one: &White, other: &White) -> f64 {
        let (one, other) = (self.residual_of(one), self.residual_of(other));
        one.dot(&other) / (one.dot(&one) * other.dot(&other)).sqrt().max(f64::MIN_POSITIVE)
    }

    /// Information on a coefficient: over its square root, a size becomes a Fisher z.
    pub(super) fn information(&self, white: &White) -> f64 {
        let part = self.residual_of(white);
        part.dot(&part)
    }

    fn partial(&self, white: &White) -> Option<(f64, f64)> {
        let part = self.residual_of(white);
        let information = part.dot(&part);
        (information > 1e-9 * white.dot(white).max(1e-12)).then(|| (information, part.dot(&self.y)))
    }

    /// What the model's regressors leave of the pulses.
    fn rest(&self) -> White {
        if self.factor.is_none() {
            return self.y.clone();
        }
        let less: Vec<f64> = self.beta.iter().map(|beta| -beta).collect();
        combined(self.y.clone(), &self.columns, &less)
    }

    /// What the model's regressors leave of something.
    fn residual_of(&self, white: &White) -> White {
        let Some(factor) = &self.factor else { return white.clone() };
        let right = DVector::from_fn(self.columns.len(), |row, _| self.columns[row].dot(white));
        let less: Vec<f64> = factor.solve(&right).iter().map(|beta| -beta).collect();
        combined(white.clone(), &self.columns, &less)
    }

    /// Pulses of all drones that this noise makes.
    pub(super) fn simulate(&self, draw: impl FnMut() -> f64) -> Pulses {
        self.whitener.simulate(draw)
    }
}

/// Products of all pairs: those of means, deviations and what is known of each added up, which are observations of its own.
fn products(all: &[&White]) -> DMatrix<f64> {
    let of =
        |part: fn(&White) -> &[f64]| pairs(&all.iter().map(|one| part(one)).collect::<Vec<_>>());
    let mut products = of(|white| &white.means) + of(|white| &white.deviations);
    for (place, white) in all.iter().enumerate() {
        products[(place, place)] += white.known.iter().map(|known| known * known).sum::<f64>();
    }
    products
}

/// Series whose products are summed side by side. Numerical: as many pairs as there are registers for.
const TILE: usize = 4;
/// Places that are taken at a time. Numerical: the series of a flight's model then stay in the nearest cache.
const STRIP: usize = 32;

/// Products of all pairs of series, each summed from the first to the last place that both have.
fn pairs(series: &[&[f64]]) -> DMatrix<f64> {
    let count = series.len();
    let mut products = DMatrix::zeros(count, count);
    let long: Vec<usize> = (0..count).filter(|index| !series[*index].is_empty()).collect();
    let Some(bins) = long.first().map(|index| series[*index].len()) else { return products };
    if long.iter().any(|index| series[*index].len() != bins) {
        return DMatrix::from_fn(count, count, |row, column| {
            series[row].iter().zip(series[column]).map(|(a, b)| a * b).sum()
        });
    }
    let tiles = long.len().div_ceil(TILE);
    let mut sums = vec![[[0.0; TILE]; TILE]; tiles * (tiles + 1) / 2];
    let mut strip = vec![[0.0; TILE]; STRIP * tiles];
    for first in (0..bins).step_by(STRIP) {
        let last = bins.min(first + STRIP);
        for (lane, index) in long.iter().enumerate() {
            for (row, value) in strip.chunks_exact_mut(tiles).zip(&series[*index][first..last]) {
                row[lane / TILE][lane % TILE] = *value;
            }
        }
        let rows = &strip[..(last - first) * tiles];
        let mut sums = sums.iter_mut();
        for one in 0..tiles {
            for (other, sum) in (0..=one).zip(&mut sums) {
                let mut tile = *sum;
                for row in rows.chunks_exact(tiles) {
                    let others = &row[other];
                    for (sums, value) in tile.iter_mut().zip(&row[one]) {
                        for (sum, other) in sums.iter_mut().zip(others) {
                            *sum += value * other;
                        }
                    }
                }
                *sum = tile;
            }
        }
    }
    for (one, row) in long.iter().enumerate() {
        for (other, column) in long[..=one].iter().enumerate() {
            let (upper, left) = (one / TILE, other / TILE);
            let sum = sums[upper * (upper + 1) / 2 + left][one % TILE][other % TILE];
            products[(*row, *column)] = sum;
            products[(*column, *row)] = sum;
        }
    }
    products
}

/// A whitened series with shares of others added.
fn combined(mut sum: White, others: &[White], shares: &[f64]) -> White {
    let add = |sum: &mut Vec<f64>, other: &[f64], share: f64| {
        if sum.len() < other.len() {
            sum.resize(other.len(), 0.0);
        }
        sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += share * other);
    };
    for (other, share) in others.iter().zip(shares) {
        add(&mut sum.means, &other.means, *share);
        add(&mut sum.deviations, &other.deviations, *share);
        add(&mut sum.known, &other.known, *share);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::noise::{
        GRADIENT, GUST_TIME, GUSTS, LEAST, OFFSETS, OWN, PULSE_NOISE, SHARED, SHARED_TIME, SLOPES,
        WHITE,
    };
    use super::super::trial::{patterns, pulses};
    use super::*;

    /// How the gradient of the updraft changes with height, as the data model has it.
    const CURVED: f64 = 0.3;

    /// The data model of the noise, term by term, for each pair of observations; with what is doubted.
    struct Dense {
        factor: Cholesky<f64, Dyn>,
        y: DVector<f64>,
        places: Vec<(usize, usize, usize)>,
    }

    impl Dense {
        fn new(groups: &[GroupPattern], pulses: &Pulses, hyper: &Hyper, doubts: &[Column]) -> Self {
            let places: Vec<(usize, usize, usize)> = pulses
                .iter()
                .enumerate()
                .flat_map(|(g, drones)| {
                    drones
                        .iter()
                        .enumerate()
                        .flat_map(move |(d, bins)| (0..bins.len()).map(move |bin| (g, d, bin)))
                })
                .collect();
            let y = places.iter().map(|(g, d, bin)| pulses[*g][*d][*bin]);
            let y = DVector::from_iterator(places.len(), y);
            let square = |place: usize| hyper.get(place).powi(2);
            let covariance = DMatrix::from_fn(places.len(), places.len(), |one, other| {
                let ((g, d, k), (h, e, l)) = (places[one], places[other]);
                let (a, b) = (&groups[g], &groups[h]);
                let answer = |of: &GroupPattern, bin: usize| {
                    of.response[bin].over(0.0).abs() + hyper.get(LEAST)
                };
                let answers = answer(a, k) * answer(b, l);
                let apart_s = (a.time_s[k] - b.time_s[l]).abs();
                let slowly = (-apart_s / hyper.get(SHARED_TIME)).exp();
                let aloft = (a.height_m[k] - 45.0) / 50.0 * (b.height_m[l] - 45.0) / 50.0;
                let gradient = square(GRADIENT) * (aloft + (CURVED * aloft).powi(2));
                let mut sum = answers * slowly * (square(SHARED) + gradient);
                if (g, d) == (h, e) {
                    let quickly = (-apart_s / hyper.get(GUST_TIME)).exp();
                    sum += answers * (square(OWN) * slowly + square(GUSTS) * quickly);
                    sum += square(OFFSETS) * a.offset_at(k) * b.offset_at(l);
                    sum += square(SLOPES) * a.slope_us[k] * b.slope_us[l];
                    sum += square(PULSE_NOISE) * (-apart_s / 5.0).exp();
                }
                if one == other {
                    sum += square(WHITE);
                }
                let doubted = |doubt: &Column| doubt.at(g, d, k) * doubt.at(h, e, l);
                sum + doubts.iter().map(doubted).sum::<f64>()
            });
            Self { factor: covariance.cholesky().unwrap(), y, places }
        }

        fn ln_det(of: &Cholesky<f64, Dyn>) -> f64 {
            2.0 * of.l().diagonal().iter().map(|value| value.ln()).sum::<f64>()
        }

        /// Log-likelihood without its constant, coefficients, and their covariance.
        fn solve(
            &self,
            columns: &[Column],
            likelihood: Likelihood,
        ) -> (f64, DVector<f64>, DMatrix<f64>) {
            let x = DMatrix::from_fn(self.y.len(), columns.len() + 1, |row, column| {
                let (g, d, bin) = self.places[row];
                column.checked_sub(1).map_or(1.0, |column| columns[column].at(g, d, bin))
            });
            let normal = (x.transpose() * self.factor.solve(&x)).cholesky().unwrap();
            let right = x.transpose() * self.factor.solve(&self.y);
            let beta = normal.solve(&right);
            let mut twice = Self::ln_det(&self.factor) + self.y.dot(&self.factor.solve(&self.y))
                - right.dot(&beta);
            if likelihood == Likelihood::Restricted {
                twice += Self::ln_det(&normal);
            }
            (-0.5 * twice, beta, normal.inverse())
        }
    }

    /// The noise of the prior, and one in which every term is another.
    fn noises() -> [Hyper; 2] {
        let mut other = Hyper::default();
        for (place, ln) in other.0.iter_mut().enumerate() {
            *ln += 0.25 * (place as f64 - 4.3);
        }
        [Hyper::default(), other]
    }

    fn regressors(groups: &[GroupPattern]) -> [Column; 2] {
        let shared = |group: &GroupPattern| -> Vec<f64> {
            (0..6).map(|bin| f64::from(bin * bin) - group.time_s[0]).collect()
        };
        let own = |(g, group): (usize, &GroupPattern)| {
            let value = |d: usize, bin: i32| ((d + 2 * g) as f64 + 0.3 * f64::from(bin)).cos();
            let drone = |d: usize| (0..6).map(|bin| value(d, bin)).collect();
            (0..group.drones).map(drone).collect()
        };
        [
            Column::Shared(groups.iter().map(shared).collect()),
            Column::Own(groups.iter().enumerate().map(own).collect()),
        ]
    }

    #[test]
    fn slopes_are_those_of_the_likelihood() {
        let groups = patterns();
        let pulses = Split::of(&pulses(&groups));
        let doubt = Column::Shared(
            groups.iter().map(|group| group.time_s.iter().map(|t| t.cos()).collect()).collect(),
        );
        let own = Column::Own(pulses.deviations.clone());
        let own = own.each(|group, drone, bin| {
            own.at(group, drone, bin).signum() + f64::from(u8::from(bin % 3 == 0))
        });
        let mut problem = Problem::new(&groups, &pulses).with([&own]).doubting([&doubt]);
        let mut curved = groups.clone();
        for group in &mut curved {
            group.shift_mps = group.time_s.iter().map(|time_s| 0.3 * time_s.sin()).collect();
            for response in &mut group.response {
                *response = Response::of(|shift_mps| 20.0 * shift_mps + 9.0 * shift_mps.powi(2));
            }
        }
        for group in &mut curved {
            group.offset = group.time_s.iter().map(|time_s| 1.0 + 0.1 * time_s.cos()).collect();
            group.unsteady_us = group.time_s.iter().map(|time_s| 20.0 * time_s.sin()).collect();
        }
        problem.groups = &curved;
        let mut hyper = Hyper::default();
        hyper.0[SHARED] += 2.6;
        // Where bins hardly scatter, drones differ by more than that.
        let mut quiet = hyper;
        quiet.0[WHITE] = f64::ln(0.1);
        let each = [Likelihood::Profile, Likelihood::Restricted];
        for (hyper, likelihood) in
            each.map(|one| (hyper, one)).into_iter().chain([(quiet, each[0])])
        {
            let slopes = problem.at(&hyper).slopes(&curved, likelihood);
            let prior = hyper.prior_slopes();
            for (place, (slope, prior)) in slopes.iter().zip(prior).enumerate() {
                let at = |by: f64| {
                    let mut moved = hyper;
                    moved.0[place] += by;
                    (-problem.at(&moved).log_likelihood(likelihood), moved.log_prior())
                };
                let (ahead, behind) = (at(1e-4), at(-1e-4));
                let by = (ahead.0 - behind.0) / 2e-4;
                assert!((slope - by).abs() < 1e-4 * (1.0 + by.abs()), "{place}: {slope} {by}");
                let by = (ahead.1 - behind.1) / 2e-4;
                assert!((prior - by).abs() < 1e-6 * (1.0 + by.abs()), "{place}: {prior} {by}");
            }
        }
    }

    #[test]
    fn likelihoods_are_those_of_the_whole_covariance() {
        let groups = patterns();
        let pulses = pulses(&groups);
        let split = Split::of(&pulses);
        let columns = regressors(&groups);
        let doubts = [columns[0].each(|group, _, bin| 0.4 * (group + bin) as f64)];
        for likelihood in [Likelihood::Profile, Likelihood::Restricted] {
            for doubts in [&doubts[..0], &doubts[..]] {
                // That a doubt was fitted only the restricted likelihood knows.
                if likelihood == Likelihood::Profile && !doubts.is_empty() {
                    continue;
                }
                // What depends on the number of drones alone is left out of both.
                let apart = noises().map(|hyper| {
                    let dense = Dense::new(&groups, &pulses, &hyper, doubts);
                    let solution =
                        Problem::new(&groups, &split).doubting(doubts).with(&columns).at(&hyper);
                    let (wanted, beta, covariance) = dense.solve(&columns, likelihood);
                    let skipped = doubts.len();
                    for (place, beta) in beta.iter().enumerate() {
                        let own = if place == 0 { 0 } else { place + skipped };
                        assert!((solution.beta[own] - beta).abs() < 1e-8, "{:?}", solution.beta);
                        let variance = solution.covariance()[(own, own)];
                        assert!((variance - covariance[(place, place)]).abs() < 1e-8);
                    }
                    solution.log_likelihood(likelihood) - wanted
                });
                assert!((apart[0] - apart[1]).abs() < 1e-7, "{likelihood:?}: {apart:?}");
            }
        }
    }

    #[test]
    fn the_restricted_likelihood_falls_by_what_the_regressors_know() {
        // By itself: log |X' V⁻¹ X| of one regressor is the logarithm of its information.
        let groups = patterns();
        let split = Split::of(&pulses(&groups));
        let solution = Problem::new(&groups, &split).at(&Hyper::default());
        let information = solution.covariance()[(0, 0)].recip();
        let less = solution.log_likelihood(Likelihood::Profile)
            - solution.log_likelihood(Likelihood::Restricted);
        assert!((less - 0.5 * information.ln()).abs() < 1e-9, "{less} {information}");
        assert!(less.abs() > 0.1, "else its sign does not show: {less}");
    }

    #[test]
    fn the_gain_of_a_regressor_is_what_the_likelihood_gains_with_it() {
        let groups = patterns();
        let split = Split::of(&pulses(&groups));
        let [shared, own] = regressors(&groups);
        let problem = Problem::new(&groups, &split).with([&shared]);
        let (hyper, without) = (Hyper::default(), problem.at(&Hyper::default()));
        let with = problem.with([&own]).at(&hyper);
        let gain = without.gain(&own);
        let wanted =
            with.log_likelihood(Likelihood::Profile) - without.log_likelihood(Likelihood::Profile);
        assert!((gain.nats - wanted).abs() < 1e-8 && wanted > 1e-3, "{gain:?} {wanted}");
        assert!((gain.beta - with.beta[2]).abs() < 1e-8);
        assert!((gain.se - with.covariance()[(2, 2)].sqrt()).abs() < 1e-8);
        let (beta, nats) = without.gain_of_all(std::slice::from_ref(&own));
        assert!((beta[0] - gain.beta).abs() < 1e-5 && (nats - gain.nats).abs() < 1e-5);
        // A regressor that is in the model has nothing more to say.
        assert_eq!(without.gain(&shared), Gain::default());
        let white = without.white(&own);
        assert!((without.likeness(&white, &white) - 1.0).abs() < 1e-9);
        assert!((without.information(&white).recip().sqrt() - gain.se).abs() < 1e-9);
    }
}
