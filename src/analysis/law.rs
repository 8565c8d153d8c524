//! The two laws of the paper, their inverses, and how they are fitted to windows.
//!
//! * **signed quadratic** (eqs. 3-4): `u = A f(V - W) + u0`, `f(x) = x|x|`. Given W it is linear in A
//!   and u0, so chi² is profiled over W on a grid: the profile has several minima when the data do
//!   not have this shape, and a local optimiser's answer depends on its start.
//! * **linear** (the paper's f*): `u = A' V + u0`. W and u0 are exactly collinear here: the vertical
//!   air speed is defined by the convention of eq. 5 (it vanishes on average), not fitted.
//!
//! Errors of the velocities count by the effective variance `sigma_u² + (du/dV)² sigma_V²`
//! (York et al. 2004), with the slope of the fit before.

use nalgebra::DMatrix;

use super::fit::{FitError, Solution, minimize, minimize_with, p_value};
use super::fit_warning::{FitWarning, OTHER_MINIMA_CHI2, W_LIMIT_MPS};
use super::fitted::{Fit, Parameter};
use crate::base::estimate::Estimate;
use crate::flight::Indicator;

pub use super::kind::{LawKind, LawOf, Symbol};
use crate::numeric::Line;

/// Step of the profile over W, m/s (docs/physics.md, 5.2). Chosen.
const W_STEP_MPS: f64 = 0.05;
/// Rounds of the effective variance (York; docs/physics.md, 5.2). Numerical.
const VARIANCE_ROUNDS: usize = 3;

/// Squared spread of a regressor below which all its values are equal: (1e-6)². Numerical.
const LEAST_SPREAD: f64 = 1e-12;

/// A law from fewer windows is warned about: two more than a line has parameters.
const FEWEST_WINDOWS: usize = 4;

/// One window as a point of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawPoint {
    /// Vertical velocity over ground, up positive, m/s.
    pub velocity_mps: f64,
    /// Tilt-corrected pulse width, us.
    pub pulse_us: f64,
    /// Standard error of the pulse, us. Must be above 0.
    pub sigma_us: f64,
    /// Standard error of the velocity, m/s; 0 to ignore it.
    pub velocity_sigma_mps: f64,
}

/// Scale of the errors that a fit reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorScale {
    /// `(JᵀJ)⁻¹`: the sigmas are the errors of the points.
    Unscaled,
    /// `(JᵀJ)⁻¹ chi²/dof`: only the ratios of the sigmas are known.
    Scaled,
}

/// A law with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// The signed quadratic `u = a f(V - w) + u0`.
    SignedQuadratic {
        /// Coefficient A, us/(m/s)².
        a: f64,
        /// Pulse in hover in still air, u0, us.
        u0_us: f64,
        /// Vertical air speed during the calibration, m/s, up positive.
        w_mps: f64,
    },
    /// The straight line `u = slope V + u0`.
    Linear {
        /// Slope A', us/(m/s).
        slope: f64,
        /// Pulse in hover, u0, us.
        u0_us: f64,
    },
}

/// The signed square `f(x) = x|x|`, eq. 3.
pub fn signed_square(x: f64) -> f64 {
    x * x.abs()
}

impl Law {
    /// Form of the law.
    pub fn kind(&self) -> LawKind {
        match self {
            Self::SignedQuadratic { .. } => LawKind::SignedQuadratic,
            Self::Linear { .. } => LawKind::Linear,
        }
    }

    /// Pulse width at a velocity over ground, in the air of the calibration, us.
    pub fn pulse_us(&self, velocity_mps: f64) -> f64 {
        match *self {
            Self::SignedQuadratic { a, u0_us, w_mps } => {
                a * signed_square(velocity_mps - w_mps) + u0_us
            }
            Self::Linear { slope, u0_us } => slope * velocity_mps + u0_us,
        }
    }

    /// Slope du/dV at a velocity over ground, in the air of the calibration, us/(m/s).
    pub fn slope(&self, velocity_mps: f64) -> f64 {
        match *self {
            Self::SignedQuadratic { a, w_mps, .. } => 2.0 * a * (velocity_mps - w_mps).abs(),
            Self::Linear { slope, .. } => slope,
        }
    }

    /// Vertical velocity relative to the air, m/s, that belongs to a pulse width (eq. 6). The
    /// signed-quadratic inverse has an infinite slope at hover: 5 us of noise there are 0.8 m/s.
    /// Not finite when the law's slope is 0.
    pub fn air_velocity_mps(&self, pulse_us: f64) -> f64 {
        match *self {
            Self::SignedQuadratic { a, u0_us, .. } => {
                let square = (pulse_us - u0_us) / a;
                square.signum() * square.abs().sqrt()
            }
            Self::Linear { slope, u0_us } => (pulse_us - u0_us) / slope,
        }
    }

    /// The law with a fit's parameters; `None` if they are not those of a law.
    pub fn from_fit(fit: &Fit) -> Option<Self> {
        let u0_us = fit.value(Symbol::U0)?;
        match (fit.value(Symbol::A), fit.value(Symbol::Slope)) {
            (Some(a), _) => Some(Self::SignedQuadratic { a, u0_us, w_mps: fit.value(Symbol::W)? }),
            (None, Some(slope)) => Some(Self::Linear { slope, u0_us }),
            (None, None) => None,
        }
    }
}

/// Fits the straight line `u = A' V + u0`.
pub fn linear(points: &[LawPoint], scale: ErrorScale) -> Result<Fit, FitError> {
    check(points, 2)?;
    let (fit, sigmas) = with_effective_variance(points, |sigmas| {
        let regressor = |point: &LawPoint| point.velocity_mps;
        let (slope, u0_us) = weighted_line(points, sigmas, regressor).ok_or(FitError::Singular)?;
        let solution = minimize(
            |p| {
                let law = Law::Linear { slope: p[0], u0_us: p[1] };
                residuals(points, sigmas, law)
            },
            &[slope, u0_us],
        )?;
        let law = Law::Linear { slope: solution.parameters[0], u0_us: solution.parameters[1] };
        Ok((solution, law))
    })?;
    let (solution, law) = fit;
    Ok(describe(points, &sigmas, law, &solution, &[true, true], scale))
}

/// Fits the signed quadratic `u = A f(V - W) + u0` with all three parameters free.
///
/// The answer is the deepest minimum inside |W| < 8 m/s; other minima within a chi² of 4 of it are
/// listed. A chi² that falls below the answer's at the edge of the range (or no minimum inside) is
/// what a line looks like to this law, and is a warning.
pub fn signed_quadratic(points: &[LawPoint], scale: ErrorScale) -> Result<Fit, FitError> {
    check(points, 3)?;
    let ((found, _), sigmas) = with_effective_variance(points, |sigmas| {
        let found = all_minima(points, sigmas)?;
        let law = law_of(&found.best);
        Ok((found, law))
    })?;
    let law = law_of(&found.best);
    let mut fit = describe(points, &sigmas, law, &found.best, &[true, true, true], scale);
    fit.other_minima = found
        .others
        .iter()
        .filter(|other| other.chi2 - found.best.chi2 < OTHER_MINIMA_CHI2)
        .map(|other| other.parameters.clone())
        .collect();
    if !fit.other_minima.is_empty() {
        fit.warnings.push(FitWarning::OtherMinima { count: fit.other_minima.len() });
    }
    if matches!(found.warning, Some(FitWarning::NoMinimum)) {
        fit.w_beyond_mps = found.best.parameters.get(2).copied();
    }
    fit.warnings.extend(found.warning);
    Ok(fit)
}

/// Fits only W, with A (us/(m/s)²) and u0 (us) held from a reference calibration.
pub fn signed_quadratic_held(
    points: &[LawPoint],
    a: f64,
    u0_us: f64,
    scale: ErrorScale,
) -> Result<Fit, FitError> {
    check(points, 1)?;
    if !(a.is_finite() && a != 0.0 && u0_us.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let held = |w_mps: f64| Law::SignedQuadratic { a, u0_us, w_mps };
    let ((found, law), sigmas) = with_effective_variance(points, |sigmas| {
        let profile: Vec<f64> = grid().map(|w| chi2(points, sigmas, held(w))).collect();
        let mut minima: Vec<Solution> = minima_of(&profile)
            .filter_map(|start| minimize(|p| residuals(points, sigmas, held(p[0])), &[start]).ok())
            .collect();
        minima.sort_by(|left, right| left.chi2.total_cmp(&right.chi2));
        minima.dedup_by(|later, earlier| {
            (later.parameters[0] - earlier.parameters[0]).abs() < W_STEP_MPS / 2.0
        });
        let law = held(minima.first().ok_or(FitError::Singular)?.parameters[0]);
        Ok((minima, law))
    })?;
    let best = found.first().ok_or(FitError::Singular)?;
    let mut fit = describe(points, &sigmas, law, best, &[false, false, true], scale);
    fit.other_minima = found
        .iter()
        .skip(1)
        .filter(|other| other.chi2 - best.chi2 < OTHER_MINIMA_CHI2)
        .map(|other| vec![a, u0_us, other.parameters[0]])
        .collect();
    if best.parameters[0].abs() >= W_LIMIT_MPS {
        fit.warnings.push(FitWarning::WAtEdge);
        fit.w_beyond_mps = Some(W_LIMIT_MPS.copysign(best.parameters[0]));
    }
    Ok(fit)
}

/// Standard errors of a W that must lie within the searched range for it to be a number.
const W_ERRORS: f64 = 2.0;

/// A fit whose W is marked as beyond the searched range if its error reaches there: the search cut off what the windows
/// leave open.
pub(super) fn bounded(fit: Fit) -> Fit {
    let reached = fit.parameter(Symbol::W).and_then(|w| {
        let Estimate { value, se } = w.estimate;
        let reaches = value.abs() + W_ERRORS * se > W_LIMIT_MPS;
        reaches.then_some(W_LIMIT_MPS.copysign(value))
    });
    Fit { w_beyond_mps: fit.w_beyond_mps.or(reached), ..fit }
}

fn check(points: &[LawPoint], parameters: usize) -> Result<(), FitError> {
    if points.len() < parameters {
        return Err(FitError::TooFewPoints { points: points.len(), parameters });
    }
    let fine = points.iter().all(|point| {
        point.velocity_mps.is_finite()
            && point.pulse_us.is_finite()
            && point.sigma_us > 0.0
            && point.sigma_us.is_finite()
            && point.velocity_sigma_mps >= 0.0
            && point.velocity_sigma_mps.is_finite()
    });
    if fine { Ok(()) } else { Err(FitError::NotFinite) }
}

/// Repeats a fit with sigmas that include the velocities' errors at the slope found before.
fn with_effective_variance<T>(
    points: &[LawPoint],
    fit: impl Fn(&[f64]) -> Result<(T, Law), FitError>,
) -> Result<((T, Law), Vec<f64>), FitError> {
    let mut sigmas: Vec<f64> = points.iter().map(|point| point.sigma_us).collect();
    let mut result = fit(&sigmas)?;
    if points.iter().any(|point| point.velocity_sigma_mps > 0.0) {
        for _ in 0..VARIANCE_ROUNDS {
            for (sigma, point) in sigmas.iter_mut().zip(points) {
                let from_velocity = result.1.slope(point.velocity_mps) * point.velocity_sigma_mps;
                *sigma = point.sigma_us.hypot(from_velocity);
            }
            result = fit(&sigmas)?;
        }
    }
    Ok((result, sigmas))
}

fn each_residual<'a>(
    points: &'a [LawPoint],
    sigmas: &'a [f64],
    law: Law,
) -> impl Iterator<Item = f64> + 'a {
    let residual = move |(point, sigma): (&LawPoint, &f64)| {
        (point.pulse_us - law.pulse_us(point.velocity_mps)) / sigma
    };
    points.iter().zip(sigmas).map(residual)
}

fn residuals(points: &[LawPoint], sigmas: &[f64], law: Law) -> Vec<f64> {
    each_residual(points, sigmas, law).collect()
}

fn chi2(points: &[LawPoint], sigmas: &[f64], law: Law) -> f64 {
    each_residual(points, sigmas, law).map(|residual| residual * residual).sum()
}

/// Weighted straight line `u = slope x + constant` in closed form, centred for precision.
fn weighted_line(
    points: &[LawPoint],
    sigmas: &[f64],
    x: impl Fn(&LawPoint) -> f64,
) -> Option<(f64, f64)> {
    let weighed = points.iter().zip(sigmas);
    let line = Line::weighted(
        weighed.map(|(point, sigma)| (x(point), point.pulse_us, 1.0 / (sigma * sigma))),
    )?;
    (line.xx > line.weight * LEAST_SPREAD).then(|| (line.slope(), line.intercept()))
}

fn grid() -> impl Iterator<Item = f64> {
    let half = (W_LIMIT_MPS / W_STEP_MPS).round() as i32;
    (-half..=half).map(|step| f64::from(step) * W_STEP_MPS)
}

/// Grid values of W at the local minima inside the profile, edges excluded.
fn minima_of(profile: &[f64]) -> impl Iterator<Item = f64> + '_ {
    let values: Vec<f64> = grid().collect();
    let inside = |(index, triple): (usize, &[f64])| {
        let [left, middle, right] = *triple else { return None };
        (middle <= left && middle < right).then(|| values.get(index + 1).copied())?
    };
    profile.windows(3).enumerate().filter_map(inside).collect::<Vec<_>>().into_iter()
}

struct Minima {
    best: Solution,
    others: Vec<Solution>,
    warning: Option<FitWarning>,
}

fn law_of(solution: &Solution) -> Law {
    let p = &solution.parameters;
    Law::SignedQuadratic { a: p[0], u0_us: p[1], w_mps: p[2] }
}

/// Points for a search over W, in which A and u0 follow in closed form.
struct Profile {
    /// Velocity, m/s, weight, and pulse from the mean on, us, of each point.
    points: Vec<[f64; 3]>,
    weight: f64,
    mean_mps: f64,
    mean_us: f64,
    /// Sum of the squares of the pulses.
    yy: f64,
}

impl Profile {
    fn of(points: &[LawPoint], sigmas: &[f64]) -> Self {
        let weighted = || points.iter().zip(sigmas.iter().map(|sigma| 1.0 / (sigma * sigma)));
        let weight: f64 = weighted().map(|(_, weight)| weight).sum();
        let mean = |of: fn(&LawPoint) -> f64| {
            weighted().map(|(point, own)| own * of(point)).sum::<f64>() / weight
        };
        let (mean_mps, mean_us) = (mean(|point| point.velocity_mps), mean(|point| point.pulse_us));
        let points: Vec<[f64; 3]> = weighted()
            .map(|(point, weight)| [point.velocity_mps, weight, point.pulse_us - mean_us])
            .collect();
        let yy = points.iter().map(|[_, weight, y]| weight * y * y).sum();
        Self { points, weight, mean_mps, mean_us, yy }
    }

    /// The least chi² at a W with A, u0 and W; `None` where all points have one speed through the air.
    fn at(&self, w_mps: f64) -> Option<(f64, [f64; 3])> {
        let (mut sum, mut square, mut xy) = (0.0, 0.0, 0.0);
        // From about the middle on: nothing cancels then.
        let middle = signed_square(self.mean_mps - w_mps);
        for [velocity_mps, weight, y] in &self.points {
            let x = signed_square(velocity_mps - w_mps) - middle;
            let weighted = weight * x;
            sum += weighted;
            square += weighted * x;
            xy += weighted * y;
        }
        let mean = sum / self.weight;
        let xx = square - sum * mean;
        let slope = xy / xx;
        let chi2 = (self.yy - slope * xy).max(0.0);
        let u0_us = self.mean_us - slope * (middle + mean);
        (xx > self.weight * LEAST_SPREAD).then_some((chi2, [slope, u0_us, w_mps]))
    }
}

/// Where the parabola through a minimum of the grid and its neighbours is least: a start from which few steps are left.
fn bottom(w_mps: f64, at: impl Fn(f64) -> Option<(f64, [f64; 3])>) -> f64 {
    let chi2 = [-W_STEP_MPS, 0.0, W_STEP_MPS].map(|step| at(w_mps + step).map(|(chi2, _)| chi2));
    let [Some(below), Some(here), Some(above)] = chi2 else { return w_mps };
    let curvature = below - 2.0 * here + above;
    let shift = 0.5 * (below - above) / curvature;
    if shift.abs() <= 1.0 { w_mps + W_STEP_MPS * shift } else { w_mps }
}

/// Profiles chi² over W and polishes every local minimum with a positive A.
fn all_minima(points: &[LawPoint], sigmas: &[f64]) -> Result<Minima, FitError> {
    let profile = Profile::of(points, sigmas);
    let at = |w_mps: f64| profile.at(w_mps);
    let profiled: Vec<_> = grid().map(at).collect();
    let chi2: Vec<f64> =
        profiled.iter().map(|entry| entry.map_or(f64::INFINITY, |(chi2, _)| chi2)).collect();
    let law = |p: &[f64]| Law::SignedQuadratic { a: p[0], u0_us: p[1], w_mps: p[2] };
    let derivatives = |p: &[f64]| {
        DMatrix::from_fn(points.len(), 3, |row, column| {
            let air = points[row].velocity_mps - p[2];
            let derivative = [signed_square(air), 1.0, -2.0 * p[0] * air.abs()][column];
            -derivative / sigmas[row]
        })
    };
    let polish = |start: [f64; 3]| {
        minimize_with(|p| residuals(points, sigmas, law(p)), Some(&derivatives), &start)
    };
    let mut minima: Vec<Solution> = minima_of(&chi2)
        .map(|w_mps| bottom(w_mps, at))
        .filter_map(at)
        .filter(|(_, start)| start[0] > 0.0)
        .filter_map(|(_, start)| polish(start).ok())
        .filter(|solution| {
            solution.parameters[0] > 0.0 && solution.parameters[2].abs() <= W_LIMIT_MPS
        })
        .collect();
    minima.sort_by(|left, right| left.chi2.total_cmp(&right.chi2));
    minima.dedup_by(|later, earlier| {
        (later.parameters[2] - earlier.parameters[2]).abs() < W_STEP_MPS / 2.0
    });
    let edge = [profiled.first(), profiled.last()]
        .into_iter()
        .filter_map(|entry| entry.copied().flatten())
        .min_by(|left, right| left.0.total_cmp(&right.0));
    if minima.is_empty() {
        let (_, start) = edge.ok_or(FitError::Singular)?;
        let best = held_at(points, sigmas, start)?;
        return Ok(Minima { best, others: Vec::new(), warning: Some(FitWarning::NoMinimum) });
    }
    let best = minima.remove(0);
    let better_beyond = edge.is_some_and(|(chi2, _)| chi2 < best.chi2);
    let warning = better_beyond.then_some(FitWarning::BetterBeyond);
    Ok(Minima { best, others: minima, warning })
}

/// The point of the profile itself, with the covariance of all three parameters there.
fn held_at(points: &[LawPoint], sigmas: &[f64], start: [f64; 3]) -> Result<Solution, FitError> {
    let [_, _, w_mps] = start;
    let two = minimize(
        |p| residuals(points, sigmas, Law::SignedQuadratic { a: p[0], u0_us: p[1], w_mps }),
        &start[..2],
    )?;
    let covariance = two.covariance.resize(3, 3, 0.0);
    let parameters = vec![two.parameters[0], two.parameters[1], w_mps];
    Ok(Solution { parameters, covariance, dof: points.len().saturating_sub(3), ..two })
}

/// Packs a solution of the free parameters into the result type.
fn describe(
    points: &[LawPoint],
    sigmas: &[f64],
    law: Law,
    solution: &Solution,
    free: &[bool],
    scale: ErrorScale,
) -> Fit {
    let (symbols, values): (&[Symbol], _) = match law {
        Law::SignedQuadratic { a, u0_us, w_mps } => {
            (&Symbol::SIGNED_QUADRATIC, vec![a, u0_us, w_mps])
        }
        Law::Linear { slope, u0_us } => (&Symbol::LINEAR, vec![slope, u0_us]),
    };
    let factor = match scale {
        ErrorScale::Unscaled => 1.0,
        ErrorScale::Scaled => solution.chi2_reduced().unwrap_or(1.0),
    };
    let n = values.len();
    let mut covariance = vec![0.0; n * n];
    let places: Vec<usize> = (0..n).filter(|index| free[*index]).collect();
    for (i, row) in places.iter().enumerate() {
        for (j, column) in places.iter().enumerate() {
            covariance[row * n + column] = solution.covariance[(i, j)] * factor;
        }
    }
    let parameters = symbols
        .iter()
        .zip(values)
        .enumerate()
        .map(|(index, (symbol, value))| Parameter {
            name: *symbol,
            unit: symbol.unit(Indicator::Pulse),
            // With as many parameters as points the fit says nothing about its own errors.
            estimate: Estimate::new(
                value,
                if solution.dof == 0 { 0.0 } else { covariance[index * n + index].max(0.0).sqrt() },
            ),
            held: !free[index],
        })
        .collect();
    let mut warnings = Vec::new();
    if !solution.converged {
        warnings.push(FitWarning::NotConverged);
    }
    if points.len() < FEWEST_WINDOWS {
        let (windows, dof) = (points.len(), solution.dof);
        warnings.push(if dof == 0 {
            FitWarning::NoErrors { windows }
        } else {
            FitWarning::FewWindows { windows, dof }
        });
    }
    let squares: f64 =
        points.iter().map(|p| (p.pulse_us - law.pulse_us(p.velocity_mps)).powi(2)).sum();
    let chi2 = chi2(points, sigmas, law);
    Fit {
        parameters,
        covariance,
        points: points.len(),
        chi2,
        chi2_reduced: (solution.dof > 0).then(|| chi2 / solution.dof as f64),
        p_value: p_value(chi2, solution.dof),
        dof: solution.dof,
        rms_us: (squares / points.len() as f64).sqrt(),
        other_minima: Vec::new(),
        warnings,
        w_beyond_mps: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_derivative_of_the_pulse() {
        let laws = [
            Law::SignedQuadratic { a: 3.0, u0_us: 1500.0, w_mps: 0.4 },
            Law::Linear { slope: 25.0, u0_us: 1540.0 },
        ];
        for law in laws {
            for velocity in [-3.0, -0.5, 0.9, 2.0] {
                let step = 1e-6;
                let rise = law.pulse_us(velocity + step) - law.pulse_us(velocity - step);
                let slope = law.slope(velocity);
                assert!((slope - rise / (2.0 * step)).abs() < 1e-4, "{law:?} at {velocity}");
            }
        }
    }

    #[test]
    fn a_w_is_a_number_if_its_error_lies_within_the_search() {
        let fit = |w_mps: f64, se: f64| {
            let points: Vec<LawPoint> = (-3..=3)
                .map(|rung| LawPoint {
                    velocity_mps: f64::from(rung),
                    pulse_us: 1546.0 + 8.0 * signed_square(f64::from(rung)),
                    sigma_us: 1.0,
                    velocity_sigma_mps: 0.0,
                })
                .collect();
            let mut fit = signed_quadratic(&points, ErrorScale::Unscaled).unwrap();
            fit.parameters[2].estimate = Estimate::new(w_mps, se);
            bounded(fit).w_beyond_mps
        };
        assert_eq!((fit(-0.4, 0.2), fit(-5.3, 1.3)), (None, None));
        // Near the bound, and without any knowledge.
        assert_eq!((fit(-7.975, 4.2), fit(3.0, 600.0)), (Some(-8.0), Some(8.0)));
        assert_eq!(fit(-6.3, 2.2), Some(-8.0));
    }

    #[test]
    fn every_valley_of_a_profile_is_a_start_and_its_ends_are_none() {
        let starts = |chi2: fn(f64) -> f64| {
            minima_of(&grid().map(chi2).collect::<Vec<_>>()).collect::<Vec<_>>()
        };
        let [low, high] = starts(|w| (w * w - 9.0).powi(2))[..] else { panic!("two valleys") };
        assert!((low + 3.0).abs() < W_STEP_MPS && (high - 3.0).abs() < W_STEP_MPS, "{low} {high}");
        assert_eq!(starts(|w| -w), [] as [f64; 0], "a slope has its lowest point at its end");
    }
}
