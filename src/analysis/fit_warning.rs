//! Doubts about one fit, and their sentences.

use std::fmt;

use crate::base::said::said_in_files;

/// Range of the profile over W, m/s: more than twice the ladder's fastest rung (docs/physics.md, 5.2).
/// Chosen.
pub(super) const W_LIMIT_MPS: f64 = 8.0;
/// Minima within this chi² of the best are reported: two standard deviations.
pub(super) const OTHER_MINIMA_CHI2: f64 = 4.0;

/// Doubt about a fit. In files it stands as its sentence.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum FitWarning {
    /// The optimiser stopped before a minimum.
    NotConverged,
    /// The fit has as many parameters as windows.
    NoErrors {
        /// Number of windows in the fit.
        windows: usize,
    },
    /// The fit has hardly more windows than parameters.
    FewWindows {
        /// Number of windows in the fit.
        windows: usize,
        /// Degrees of freedom of the fit.
        dof: usize,
    },
    /// Other minima are nearly as good.
    OtherMinima {
        /// Number of such minima.
        count: usize,
    },
    /// W, fitted alone, lies at or beyond the edge of the searched range.
    WAtEdge,
    /// Chi² has no minimum inside the searched range of W.
    NoMinimum,
    /// Chi² is lower still beyond the searched range of W.
    BetterBeyond,
    /// A doubt as it was read from a file.
    Said(String),
}

said_in_files!(FitWarning);

impl fmt::Display for FitWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConverged => {
                f.write_str("the optimiser ran out of patience before it converged")
            }
            Self::NoErrors { windows } => {
                write!(f, "only {windows} windows for as many parameters: no errors can be given")
            }
            Self::FewWindows { windows, dof } => write!(
                f,
                "only {windows} windows ({dof} more than parameters): little speaks for this law"
            ),
            Self::OtherMinima { count } => write!(
                f,
                "{count} more local minimum(s) within a chi2 of {OTHER_MINIMA_CHI2} of this one: W is \
                 not determined"
            ),
            Self::WAtEdge => {
                write!(f, "W is at or beyond the edge of the searched range, ±{W_LIMIT_MPS} m/s")
            }
            Self::NoMinimum => write!(
                f,
                "no minimum inside |W| < {W_LIMIT_MPS} m/s, the parameters are those at the edge: the \
                 points do not have the signed-quadratic shape (compare the linear law)"
            ),
            // Without the numbers, which differ from drone to drone: a fleet is told once.
            Self::BetterBeyond => write!(
                f,
                "the signed quadratic fits better still with a W beyond the searched ±{W_LIMIT_MPS} \
                 m/s, as one flank of a parabola: the windows do not have its shape, and W* is no air \
                 speed"
            ),
            Self::Said(text) => f.write_str(text),
        }
    }
}
