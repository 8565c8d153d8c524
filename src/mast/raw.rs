//! Values of a mast's file, whatever its format.

use super::mapping::Stamp;
use crate::flight::Series;

/// Values as a file has them, in our units.
#[derive(Clone, Debug, Default)]
pub(super) struct Raw {
    /// UTC of time 0 of the series, ms since 1970.
    pub(super) zero_ms: i64,
    /// Vertical air speed, m/s, up positive.
    pub(super) w: Series,
    /// Variance of w within each mean, (m/s)², if the file has it.
    pub(super) w_variance: Option<Series>,
    /// Wind towards east and north, m/s.
    pub(super) wind: Option<[Series; 2]>,
    /// Duration of the mean that a value is, s, if the file says.
    pub(super) mean_s: Option<f64>,
    /// Which time of a mean its time is, if the file says.
    pub(super) stamp: Option<Stamp>,
    /// Whether the file says that values are single samples.
    pub(super) is_point: bool,
    /// Latitude and longitude, degrees.
    pub(super) place_deg: Option<[f64; 2]>,
    /// Height of the instrument above the ground, m.
    pub(super) height_m: Option<f64>,
    /// Doubts about how it was read, a sentence each.
    pub(super) notes: Vec<String>,
}
