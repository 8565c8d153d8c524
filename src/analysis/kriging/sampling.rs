//! Scales of the air that stand for all that the values allow: adaptive importance sampling (J.-M. Cornuet, J.-M. Marin,
//! A. Mira, C. P. Robert, *Scandinavian Journal of Statistics* 39, 798, 2012).
//!
//! The posterior of the scales is no normal distribution: a slow strong air and a fast weak one are the ends of one long
//! ridge, and how much of the zero belongs to the air hangs on where on it the truth is. Points are drawn from what is known
//! of the posterior so far, round by round, and weighed by how much more probable each is than it was to be drawn.

use nalgebra::{Cholesky, Const, SMatrix, SVector};
use rayon::prelude::*;

use super::scales::{Axis, Found, Point, SCALES};
use crate::numeric::log_sum;

/// Points of a round.
const POINTS: usize = 48;
/// By how much wider than the posterior seems points are drawn, round by round: farthest where the first round has just told
/// its shape, which a first guess may miss most of, nearer at last, since of ten scales each that is drawn 1.4 times too wide
/// costs a tenth of the points. Numerical: of those tried it finds a ridge of three times the first guess and still has most
/// points that count where the guess was right.
const WIDER: [f64; 4] = [1.4, 1.6, 1.4, 1.2];
/// A first guess of whose points this share counts has the posterior's shape, or nearly: of a right one a quarter of them count,
/// drawn 1.4 times wider. Numerical.
const FITS: f64 = 0.2;
/// By how much wider points are drawn after that.
const WIDER_OF_FITTING: f64 = 1.2;
/// Rounds then, at least.
const LEAST_ROUNDS: usize = 3;
/// Rounds go on, as the last of them, until so many points count. Numerical: an interval by 40 points is known to a tenth.
const COUNT: f64 = 40.0;
/// At most this many rounds.
const MOST_ROUNDS: usize = 8;
/// Each fifth point is drawn wider still by this, for tails that no round has seen yet.
const FAR: f64 = 2.0;
/// See [`FAR`].
const FAR_SHARE: f64 = 0.2;
/// Fewer points than this do not say how wide the posterior is: weights are flattened until as many count. Numerical.
const ENOUGH: f64 = 24.0;
/// Share of the first guess in what is drawn from. Numerical.
const FIRST_SHARE: f64 = 0.1;

/// A point that was drawn.
#[derive(Clone, Debug)]
pub(super) struct Drawn<T> {
    pub(super) point: Point,
    /// Weights of all add up to one.
    pub(super) weight: f64,
    pub(super) kept: T,
    ln_posterior: f64,
}

/// A normal distribution.
struct Normal {
    mean: SVector<f64, SCALES>,
    factor: Cholesky<f64, Const<SCALES>>,
}

/// What points are drawn from.
enum Shape<'a> {
    /// A normal distribution that reaches as far to each side as the posterior was seen to.
    Split(&'a Found),
    /// A normal distribution, mixed with a wider one.
    Normal(Box<Normal>),
}

/// The same, drawn so many times wider.
struct Proposal<'a> {
    shape: Shape<'a>,
    wider: f64,
}

impl Proposal<'_> {
    fn point(&self, normal: &SVector<f64, SCALES>, index: usize) -> Point {
        let wider = self.wider;
        match &self.shape {
            Shape::Split(found) => {
                let mut point = SVector::from(found.best);
                for (axis, normal) in found.axes.iter().zip(normal.iter()) {
                    point += axis.along * (normal * axis.reach[usize::from(*normal < 0.0)] * wider);
                }
                point.into()
            }
            Shape::Normal(normal_distribution) => {
                let Normal { mean, factor } = normal_distribution.as_ref();
                let every = (1.0 / FAR_SHARE).round() as usize;
                let wide = if index.is_multiple_of(every) { FAR * wider } else { wider };
                (mean + factor.l() * normal * wide).into()
            }
        }
    }

    /// Logarithm of the density, but for a constant that is the same for all.
    fn ln_density(&self, point: &Point) -> f64 {
        let wider = self.wider;
        match &self.shape {
            Shape::Split(found) => {
                let off = SVector::from(*point) - SVector::from(found.best);
                let one = |axis: &Axis| {
                    let sd = axis.along.norm().max(f64::MIN_POSITIVE);
                    let along = off.dot(&axis.along) / (sd * sd);
                    let reach = wider * axis.reach[usize::from(along < 0.0)];
                    let at = along / reach;
                    -0.5 * at * at - (sd * reach).ln()
                };
                found.axes.iter().map(one).sum()
            }
            Shape::Normal(normal_distribution) => {
                let Normal { mean, factor } = normal_distribution.as_ref();
                let off = SVector::from(*point) - mean;
                let mut white = off;
                factor.l_dirty().solve_lower_triangular_mut(&mut white);
                let square = white.norm_squared();
                let ln_sd: f64 = factor.l_dirty().diagonal().iter().map(|sd| sd.ln()).sum();
                let at = |wide: f64| -0.5 * square / (wide * wide) - SCALES as f64 * wide.ln();
                let near = (1.0 - FAR_SHARE).ln() + at(wider);
                let far = FAR_SHARE.ln() + at(FAR * wider);
                log_sum([near, far]) - ln_sd
            }
        }
    }
}

/// Points that stand for the posterior of one family.
pub(super) struct Sampled<T> {
    pub(super) drawn: Vec<Drawn<T>>,
    /// Logarithm of the integral of what points are weighed by, but for a constant that is the same for all families.
    pub(super) ln_evidence: f64,
}

/// Points with their weights; `weigh` gives the logarithm of a point's posterior with whatever is to be kept of it.
pub(super) fn samples<T: Send>(
    found: &Found,
    weigh: impl Fn(&Point) -> Option<(f64, T)> + Sync,
) -> Sampled<T> {
    let mut ln_evidence = f64::NEG_INFINITY;
    let mut drawn: Vec<Drawn<T>> = Vec::new();
    let mut proposals: Vec<Proposal<'_>> = Vec::new();
    let mut fits = false;
    for round in 0..MOST_ROUNDS {
        let least_rounds = if fits { LEAST_ROUNDS } else { WIDER.len() };
        if round >= least_rounds && effective(&weights_of(&drawn)) > COUNT {
            break;
        }
        let wider = if fits { WIDER_OF_FITTING } else { WIDER[round.min(WIDER.len() - 1)] };
        let shape = if round == 0 { Some(Shape::Split(found)) } else { next(&drawn, found) };
        proposals.extend(shape.map(|shape| Proposal { shape, wider }));
        let Some(proposal) = proposals.last() else { break };
        let more: Vec<Drawn<T>> = (0..POINTS)
            .into_par_iter()
            .filter_map(|index| {
                let point = proposal.point(&normals(round * POINTS + index), index);
                let (ln_posterior, kept) = weigh(&point)?;
                ln_posterior.is_finite().then_some(Drawn { point, weight: 0.0, kept, ln_posterior })
            })
            .collect();
        drawn.extend(more);
        let sum = reweigh(&mut drawn, &proposals);
        if round == 0 && !drawn.is_empty() {
            fits = effective(&weights_of(&drawn)) > FITS * POINTS as f64;
        }
        ln_evidence = sum - ((proposals.len() * POINTS) as f64).ln();
    }
    Sampled { drawn, ln_evidence }
}

/// Weighs all points by the mixture of all that they were drawn from, none of them too much; the logarithm of the sum of their
/// weights before these were cut and made to add up to one.
fn reweigh<T>(drawn: &mut [Drawn<T>], proposals: &[Proposal<'_>]) -> f64 {
    for one in drawn.iter_mut() {
        let densities: Vec<f64> =
            proposals.iter().map(|proposal| proposal.ln_density(&one.point)).collect();
        one.weight = one.ln_posterior - log_sum(densities) + (proposals.len() as f64).ln();
    }
    let most = drawn.iter().map(|one| one.weight).fold(f64::NEG_INFINITY, f64::max);
    for one in drawn.iter_mut() {
        one.weight = (one.weight - most).exp();
    }
    let sum: f64 = drawn.iter().map(|one| one.weight).sum();
    // No single point stands for more than it can (E. L. Ionides, J. Comput. Graph. Stat. 17, 295, 2008).
    let at_most = sum / (drawn.len() as f64).sqrt();
    for one in drawn.iter_mut() {
        one.weight = one.weight.min(at_most);
    }
    let kept: f64 = drawn.iter().map(|one| one.weight).sum();
    for one in drawn.iter_mut() {
        one.weight /= kept;
    }
    most + sum.ln()
}

/// What the points so far say about the posterior.
fn next<'a, T>(drawn: &[Drawn<T>], found: &Found) -> Option<Shape<'a>> {
    if drawn.is_empty() {
        return None;
    }
    let flat = |power: f64| -> Vec<f64> {
        let weights: Vec<f64> = drawn.iter().map(|one| one.weight.powf(power)).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect()
    };
    let mut power = 1.0;
    let mut weights = flat(power);
    while effective(&weights) < ENOUGH.min(0.5 * drawn.len() as f64) && power > 0.01 {
        power *= 0.8;
        weights = flat(power);
    }
    let points = || drawn.iter().map(|one| SVector::<f64, SCALES>::from(one.point)).zip(&weights);
    let mean: SVector<f64, SCALES> = points().map(|(point, weight)| point * *weight).sum();
    let spread: SMatrix<f64, SCALES, SCALES> =
        points().map(|(point, weight)| (point - mean) * (point - mean).transpose() * *weight).sum();
    let covariance = spread * (1.0 - FIRST_SHARE) + found.covariance * FIRST_SHARE;
    Some(Shape::Normal(Box::new(Normal { mean, factor: covariance.cholesky()? })))
}

fn weights_of<T>(drawn: &[Drawn<T>]) -> Vec<f64> {
    drawn.iter().map(|one| one.weight).collect()
}

/// How many independent points weights are worth.
fn effective(weights: &[f64]) -> f64 {
    1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Normal deviates that fill the space evenly: Halton's sequence, mirrored, so that they have no mean.
fn normals(index: usize) -> SVector<f64, SCALES> {
    const BASES: [usize; SCALES] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29];
    let (half, sign) = (index / 2 + 11, if index.is_multiple_of(2) { 1.0 } else { -1.0 });
    SVector::from_fn(|row, _| sign * quantile(halton(half, BASES[row])))
}

fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut share) = (0.0, 1.0);
    while index > 0 {
        share /= base as f64;
        value += share * (index % base) as f64;
        index /= base;
    }
    value
}

/// Quantile of the standard normal distribution.
fn quantile(share: f64) -> f64 {
    -std::f64::consts::SQRT_2 * statrs::function::erf::erfc_inv(2.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::Form;
    use crate::analysis::kriging::scales::Family;

    const FAMILY: Family = Family { form: Form::Exponential, drifts: false };

    /// A guess that is off, and a posterior with a long ridge.
    #[test]
    fn points_find_a_ridge_that_the_first_guess_does_not_see() {
        let mut point = [0.0; SCALES];
        point[0] = 0.3;
        let found = Found::guess(FAMILY, point, &(SMatrix::identity() * 0.09));
        // The first two scales lie on a line, with a standard deviation of 1.0 along and 0.25 across it.
        let ln_posterior = |point: &Point| {
            let (along, across) =
                (0.6 * point[0] + 0.8 * point[1], 0.8 * point[0] - 0.6 * point[1]);
            let rest: f64 = point[2..].iter().map(|value| value * value / 0.18).sum();
            -0.5 * ((along - 0.5) / 1.0_f64).powi(2) - 0.5 * (across / 0.25_f64).powi(2) - rest
        };
        let drawn = samples(&found, |point| Some((ln_posterior(point), ()))).drawn;
        let weights = weights_of(&drawn);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        assert!(effective(&weights) > 25.0, "{}", effective(&weights));
        let along = |one: &Drawn<()>| 0.6 * one.point[0] + 0.8 * one.point[1];
        let mean: f64 = drawn.iter().map(|one| one.weight * along(one)).sum();
        let variance: f64 = drawn.iter().map(|one| one.weight * (along(one) - mean).powi(2)).sum();
        assert!((mean - 0.5).abs() < 0.3, "{mean}");
        assert!((variance.sqrt() - 1.0).abs() < 0.25, "{}", variance.sqrt());
    }

    #[test]
    fn rounds_go_on_until_enough_points_count_and_none_counts_for_too_much() {
        let found = Found::guess(FAMILY, [0.0; SCALES], &SMatrix::identity());
        let drawn = |sd: f64| {
            let ln_posterior =
                |point: &Point| -0.5 * SVector::from(*point).norm_squared() / (sd * sd);
            samples(&found, |point| Some((ln_posterior(point), ()))).drawn
        };
        // A guess that is right, and one that is four times too wide in each of ten directions.
        let (right, wide) = (drawn(1.0), drawn(0.25));
        assert!(effective(&weights_of(&right)) > COUNT);
        assert!(wide.len() > right.len(), "{} and {}", wide.len(), right.len());
        assert!(wide.len() <= MOST_ROUNDS * POINTS);
        let one =
            |ln_posterior| Drawn { point: [0.0; SCALES], weight: 0.0, kept: (), ln_posterior };
        let mut drawn = vec![one(-5.0); 100];
        drawn[0] = one(0.0);
        reweigh(&mut drawn, &[Proposal { shape: Shape::Split(&found), wider: 1.0 }]);
        // It would have 0.6 of the weight; a tenth of what there was is left of it, of 0.83.
        assert!((drawn[0].weight - 0.2).abs() < 0.01, "{}", drawn[0].weight);
        assert!((weights_of(&drawn).iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
