//! Values of the map for one drone, with their errors.

use super::budget::{ErrorBudget, QualityFlag};
use super::corrections::DOUBTS;
use super::kriging::Value;
use super::shape::PARAMETERS;

/// What one drone's hover gave.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    pub(super) first_s: i64,
    pub(super) updraft_mps: Vec<Option<f64>>,
    pub(super) sd_mps: Vec<Option<f64>>,
    pub(super) interval_mps: Vec<Option<[f64; 2]>>,
    /// The values with what they hang on.
    pub(super) modelled: Vec<Option<Value>>,
    /// Standard error of the fleet's slope as a share of it, and of what is the drone's own of its slope.
    pub(super) slope_share: f64,
    pub(super) own_slope_share: f64,
    pub(super) mean_mps: f64,
    pub(super) mean_interval_mps: [f64; 2],
    pub(super) errors: ErrorBudget,
    pub(super) quality: Vec<QualityFlag>,
    pub(super) is_own: bool,
    /// The law's derivatives over its slope, for the fleet's common error.
    pub(super) basis: [f64; PARAMETERS],
    /// Signed standard errors from the doubts, m/s.
    pub(super) doubts_mps: [f64; DOUBTS],
}
