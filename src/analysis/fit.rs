//! Nonlinear least squares with standard errors: Levenberg-Marquardt (MINPACK's algorithm in the
//! `levenberg-marquardt` crate) and the covariance from its Jacobian.
//!
//! Residuals are already divided by their sigma, so that the sum of their squares is chi². Two
//! covariances are in use, and they are not the same thing:
//!
//! * **unscaled**, `(JᵀJ)⁻¹`: right when the sigmas are the errors of the points. A bad fit does not
//!   widen it; chi² says that the fit is bad.
//! * **scaled**, `(JᵀJ)⁻¹ chi²/dof`: right when only the ratios of the sigmas are known (all equal,
//!   say). This is what most fitting programs print, and what NIST certifies.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use thiserror::Error;

use crate::numeric::least;

/// Error of a fit.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// There are fewer points than free parameters.
    #[error("{points} points cannot determine {parameters} parameters")]
    TooFewPoints {
        /// Number of points.
        points: usize,
        /// Number of free parameters.
        parameters: usize,
    },
    /// A start value or a residual at the start is not a number.
    #[error("a value, sigma or start is not finite (check the points for NaN and zero sigmas)")]
    NotFinite,
    /// The data leave a combination of parameters undetermined.
    #[error("the data do not determine all parameters (are all velocities or all pulses equal?)")]
    Singular,
}

/// A fit: a local minimum of chi².
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Parameters at the minimum.
    pub parameters: Vec<f64>,
    /// Unscaled covariance of the parameters, `(JᵀJ)⁻¹`.
    pub covariance: DMatrix<f64>,
    /// Sum of squared residuals.
    pub chi2: f64,
    /// Degrees of freedom: number of residuals minus number of parameters.
    pub dof: usize,
    /// Whether the iteration ended at a minimum rather than by running out of patience.
    pub converged: bool,
}

impl Solution {
    /// chi² over the degrees of freedom; `None` without any.
    pub fn chi2_reduced(&self) -> Option<f64> {
        (self.dof > 0).then(|| self.chi2 / self.dof as f64)
    }

    /// Standard errors from the unscaled covariance.
    pub fn errors(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect()
    }

    /// Standard errors from the scaled covariance; `None` without degrees of freedom.
    pub fn scaled_errors(&self) -> Option<Vec<f64>> {
        let scale = self.chi2_reduced()?.sqrt();
        Some(self.errors().into_iter().map(|error| error * scale).collect())
    }

    /// Probability of a chi² at least this large when the model and the sigmas are right; `None`
    /// without degrees of freedom.
    pub fn p_value(&self) -> Option<f64> {
        p_value(self.chi2, self.dof)
    }
}

/// Probability of a chi² at least as large as `chi2` with `dof` degrees of freedom.
pub fn p_value(chi2: f64, dof: usize) -> Option<f64> {
    let distribution = ChiSquared::new(dof as f64).ok()?;
    chi2.is_finite().then(|| distribution.sf(chi2.max(0.0)))
}

/// Finds the minimum of the sum of squares near `start`.
///
/// `residuals` gets the parameters and gives the residuals, always equally many. Derivatives are
/// central differences; a parameter that starts at 0 is taken to be of order 1.
///
/// # Errors
///
/// [`FitError`] when there are too few residuals, when something is not finite at the start, or when
/// the minimum does not determine all parameters.
pub fn minimize<F>(residuals: F, start: &[f64]) -> Result<Solution, FitError>
where
    F: Fn(&[f64]) -> Vec<f64>,
{
    minimize_with(residuals, None, start)
}

/// Function that gives the derivatives of the residuals (rows) by the parameters (columns).
pub type Jacobian<'a> = &'a dyn Fn(&[f64]) -> DMatrix<f64>;

/// [`minimize`] with exact derivatives, of as many rows as there are residuals.
pub fn minimize_with<F>(
    residuals: F,
    jacobian: Option<Jacobian<'_>>,
    start: &[f64],
) -> Result<Solution, FitError>
where
    F: Fn(&[f64]) -> Vec<f64>,
{
    let first = residuals(start);
    if first.len() < start.len() || start.is_empty() {
        return Err(FitError::TooFewPoints { points: first.len(), parameters: start.len() });
    }
    if !start.iter().chain(&first).all(|value| value.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let problem = Problem {
        residuals,
        jacobian,
        at: DVector::from_column_slice(start),
        start: start.to_vec(),
        count: first.len(),
    };
    let (problem, report) = LevenbergMarquardt::new().with_patience(1000).minimize(problem);
    // `NoImprovementPossible` is a minimum found to the last bit, with tolerances out of reach.
    let converged = report.termination.was_successful()
        || matches!(report.termination, TerminationReason::NoImprovementPossible(_));
    let jacobian = problem.derivatives();
    let found = (problem.residuals)(problem.at.as_slice());
    if !problem.at.iter().chain(&found).all(|value| value.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let covariance = inverse_gram(&jacobian).ok_or(FitError::Singular)?;
    Ok(Solution {
        parameters: problem.at.as_slice().to_vec(),
        covariance,
        chi2: found.iter().map(|residual| residual * residual).sum(),
        dof: found.len() - start.len(),
        converged,
    })
}

/// `(JᵀJ)⁻¹` by QR of J with its columns scaled to length 1 (parameters differ by many decades).
fn inverse_gram(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = jacobian.ncols();
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    if !lengths.iter().all(|length| *length > 0.0 && length.is_finite()) {
        return None;
    }
    let mut scaled = jacobian.clone();
    for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let r = scaled.qr().r();
    let smallest = least((0..n).map(|i| r[(i, i)].abs())).unwrap_or(f64::INFINITY);
    if smallest < 1e-13 {
        return None;
    }
    let inverse = r.solve_upper_triangular(&DMatrix::identity(n, n))?;
    let gram = &inverse * inverse.transpose();
    Some(DMatrix::from_fn(n, n, |i, j| gram[(i, j)] / (lengths[i] * lengths[j])))
}

/// The crate's view of a problem: owned parameters, dynamic sizes.
struct Problem<'a, F> {
    residuals: F,
    jacobian: Option<Jacobian<'a>>,
    at: DVector<f64>,
    start: Vec<f64>,
    count: usize,
}

impl<F: Fn(&[f64]) -> Vec<f64>> Problem<'_, F> {
    fn derivatives(&self) -> DMatrix<f64> {
        match self.jacobian {
            Some(jacobian) => jacobian(self.at.as_slice()),
            None => self.differences(),
        }
    }

    fn differences(&self) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.count, self.at.len());
        let mut at = self.at.clone();
        for column in 0..self.at.len() {
            let centre = self.at[column];
            // The size of the start keeps the step from vanishing with a parameter that goes to 0.
            let size = match self.start.get(column) {
                Some(start) if *start != 0.0 => centre.abs().max(start.abs() * 1e-3),
                _ => centre.abs().max(1.0),
            };
            // The cube root of the machine's precision balances truncation and rounding.
            let step = f64::EPSILON.cbrt() * size;
            at[column] = centre + step;
            let above = (self.residuals)(at.as_slice());
            at[column] = centre - step;
            let below = (self.residuals)(at.as_slice());
            at[column] = centre;
            for (row, (above, below)) in above.iter().zip(&below).enumerate().take(self.count) {
                jacobian[(row, column)] = (above - below) / (2.0 * step);
            }
        }
        jacobian
    }
}

impl<F: Fn(&[f64]) -> Vec<f64>> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_, F> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.at.copy_from(parameters);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let residuals = (self.residuals)(self.at.as_slice());
        (residuals.len() == self.count).then(|| DVector::from_vec(residuals))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.derivatives())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_exact_points_is_found_with_its_errors() {
        let x = [0.0, 1.0, 2.0, 3.0];
        let sigma = 0.5;
        let fit = minimize(
            |p| x.iter().map(|x| (p[0] * x + p[1] - (2.0 * x + 1.0)) / sigma).collect(),
            &[0.0, 0.0],
        )
        .unwrap();
        assert!((fit.parameters[0] - 2.0).abs() < 1e-12 && (fit.parameters[1] - 1.0).abs() < 1e-12);
        // sigma² / sum (x - mean)² = 0.25 / 5
        assert!((fit.errors()[0] - 0.05_f64.sqrt()).abs() < 1e-9, "{:?}", fit.errors());
        assert_eq!(fit.dof, 2);
        assert!(fit.p_value().unwrap() > 0.999);
    }

    #[test]
    fn chi_squared_is_the_sum_of_squared_residuals() {
        let fit = minimize(|p| vec![p[0] - 1.0, p[0] - 4.0, p[0] - 4.0], &[0.0]).unwrap();
        // At the mean, 3: 4 + 1 + 1.
        assert!((fit.chi2 - 6.0).abs() < 1e-9 && fit.dof == 2, "{fit:?}");
    }

    #[test]
    fn a_parameter_that_vanishes_is_still_determined() {
        // Ends within 1e-14 of 0, where a purely relative step would see no change at all.
        let fit = minimize(|p| vec![p[0] + p[1] - 1.0, p[0] - p[1] - 1.0, p[1]], &[3.0, 0.0]);
        let fit = fit.unwrap();
        assert!(fit.parameters[1].abs() < 1e-12, "{fit:?}");
        assert!((fit.errors()[1] - 1.0 / 3.0_f64.sqrt()).abs() < 1e-6, "{fit:?}");
    }

    #[test]
    fn says_what_is_wrong_with_the_data() {
        let two = |p: &[f64]| vec![p[0] - 1.0, p[0] + p[1] + p[2]];
        assert_eq!(
            minimize(two, &[0.0; 3]).unwrap_err(),
            FitError::TooFewPoints { points: 2, parameters: 3 }
        );
        let same = |p: &[f64]| vec![p[0] + p[1] - 1.0, p[0] + p[1] - 2.0, p[0] + p[1]];
        assert_eq!(minimize(same, &[0.0; 2]).unwrap_err(), FitError::Singular);
        assert_eq!(minimize(|_| vec![f64::NAN; 3], &[0.0]).unwrap_err(), FitError::NotFinite);
    }

    #[test]
    fn p_values_are_those_of_the_tables() {
        // 95 % points of chi² (any table): 3.841 at 1, 18.307 at 10.
        assert!((p_value(3.841_459, 1).unwrap() - 0.05).abs() < 1e-6);
        assert!((p_value(18.307_038, 10).unwrap() - 0.05).abs() < 1e-6);
        assert_eq!(p_value(1.0, 0), None);
    }
}
