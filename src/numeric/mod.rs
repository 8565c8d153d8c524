//! Means, medians, quantiles, straight lines, minima and banded matrices: the arithmetic that every room needs and none owns.
//!
//! * **Nothing** has no mean, median or extent: the answer is `None`, and the caller says what stands for it.
//! * **NaN** spoils means and lines, as in any sum. [`least`], [`most`] and [`extent`] pass over it.
//!   Medians and quantiles order by [`f64::total_cmp`], which puts it behind infinity: filter first where
//!   values can be missing.
//! * **Order.** Sums run from the first value to the last and start anew for the second pass of a variance,
//!   so the same values in the same order give the same bits, on any machine and with any number of threads.
//!   That is why these few lines are not `statrs::statistics`: its means and variances follow a recurrence
//!   that divides at each value, its quantiles interpolate by another convention (R's type 8), and its
//!   minimum turns NaN at the first NaN. Distributions come from `statrs`.
//!
//! ```
//! use updraft::numeric::{Line, mean, median};
//!
//! assert_eq!(mean([1.0, 2.0, 6.0]), Some(3.0));
//! assert_eq!(median(vec![4.0, 1.0, 3.0, 2.0]), Some(2.5));
//! let line = Line::through([(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]).unwrap();
//! assert_eq!((line.slope(), line.intercept()), (2.0, 1.0));
//! ```

mod banded;
mod cholesky;
mod line;
mod minimise;
mod moments;
mod order;

pub(crate) use banded::Banded;
pub(crate) use cholesky::cholesky;
pub use line::Line;
pub(crate) use minimise::{
    Inverse, LOGARITHM_STEP, Least, differences, differences_at_once, minimise, minimise_known,
    minimise_roughly,
};
pub(crate) use moments::log_sum;
pub use moments::{Moments, mean, rms};
pub use order::{Sorted, extent, least, median, most, upper_median};
