//! The paper's scales of the air (section III.B), with the errors that it gives: those of the curve
//! fits.

use crate::base::estimate::Estimate;

/// Length over all pairs, m.
pub(super) const LAMBDA_M: Estimate = Estimate { value: 145.4, se: 3.0 };
/// Length along the rows, m.
pub(super) const LAMBDA_X_M: Estimate = Estimate { value: 121.3, se: 6.8 };
/// Length along the columns, m.
pub(super) const LAMBDA_Y_M: Estimate = Estimate { value: 252.0, se: 18.0 };
/// Time scale, s.
pub(super) const T0_S: Estimate = Estimate { value: 186.0, se: 0.37 };
