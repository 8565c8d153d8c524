//! Pearson's correlation and the regression line.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::function::beta::checked_beta_reg;

use crate::base::estimate::Estimate;
use crate::numeric::{Line, rms};

/// Least-squares line `y = slope x + intercept` and Pearson's correlation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Regression {
    /// Points.
    pub n: usize,
    /// Pearson's rho.
    pub rho: f64,
    /// Two-sided probability of a |rho| at least this large without a relation (Student's t with
    /// n - 2 degrees of freedom).
    pub p_value: f64,
    /// Slope.
    pub slope: Estimate,
    /// Intercept, unit of y.
    pub intercept: Estimate,
    /// Root mean square of y - x, unit of y.
    pub rms_error: f64,
}

/// Regression of y on x; `None` with fewer than three points or without any spread.
pub fn regression(points: &[(f64, f64)]) -> Option<Regression> {
    let n = points.len() as f64;
    if points.len() < 3 || points.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
        return None;
    }
    let line = Line::through(points.iter().copied())?;
    let rho = line.correlation()?.clamp(-1.0, 1.0);
    let residuals: f64 = points.iter().map(|point| line.residual(*point).powi(2)).sum();
    // From the residuals and not as 1 - rho²: rho is within 1e-5 of 1 here, and p needs the digits.
    let unexplained = (residuals / line.yy).clamp(0.0, 1.0);
    let p_value = checked_beta_reg((n - 2.0) / 2.0, 0.5, unexplained).ok()?;
    let variance = residuals / (n - 2.0);
    Some(Regression {
        n: points.len(),
        rho,
        p_value,
        slope: Estimate::new(line.slope(), (variance / line.xx).sqrt()),
        intercept: Estimate::new(
            line.intercept(),
            (variance * (1.0 / n + line.mean[0] * line.mean[0] / line.xx)).sqrt(),
        ),
        rms_error: rms(points.iter().map(|(x, y)| y - x))?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_anscombe() {
        // Anscombe 1973, first quartet: rho 0.81642, slope 0.50009 (0.11791), intercept 3.00009
        // (1.12475), p 0.00217.
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        let points: Vec<_> = x.into_iter().zip(y).collect();
        let found = regression(&points).unwrap();
        assert!((found.rho - 0.81642).abs() < 1e-5, "{found:?}");
        assert!((found.p_value - 0.00217).abs() < 1e-5, "{found:?}");
        assert!((found.slope.value - 0.50009).abs() < 1e-5, "{found:?}");
        assert!((found.slope.se - 0.11791).abs() < 1e-5, "{found:?}");
        assert!((found.intercept.value - 3.00009).abs() < 1e-5, "{found:?}");
        assert!((found.intercept.se - 1.12475).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn small_p_values_keep_their_digits() {
        // Leading term for n = 11: p = x^4.5 / (4.5 B(4.5, 0.5)), x = 1 - rho², B = 0.859029.
        let points: Vec<_> = (-5..=5)
            .map(f64::from)
            .map(|x| (x, x + if x as i32 % 2 == 0 { 1e-3 } else { -1e-3 }))
            .collect();
        let found = regression(&points).unwrap();
        let x = 1.0 - found.rho * found.rho;
        let expected = x.powf(4.5) / (4.5 * 0.859_029);
        assert!((found.p_value / expected - 1.0).abs() < 1e-4, "{found:?} {expected}");
        assert!(found.p_value < 1e-26 && found.p_value > 0.0);
    }

    #[test]
    fn no_spread_is_no_correlation() {
        assert_eq!(regression(&[(1.0, 2.0), (1.0, 3.0), (1.0, 4.0)]), None);
        assert_eq!(regression(&[(1.0, 2.0), (2.0, 3.0)]), None);
        assert_eq!(regression(&[(1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)]), None);
    }
}
