//! A response to vertical speed that changes with height.

use super::{Acting, Kind, Moment, either};

/// Height at which the response is the known one, m.
const LEVEL_M: f64 = 40.0;

/// Response by height.
pub(super) const KIND: Kind = Kind {
    name: "height-response",
    what: "the response to vertical speed changes with height",
    depends_on: &["climb-height", "height", "climb"],
    parameters: &[either("slope_us", 4.0, 14.0)],
    is_steady: true,
    start: |values| Box::new(HeightResponse { slope_us: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct HeightResponse {
    /// Change of the response in 30 m of height, us/(m/s).
    slope_us: f64,
}

impl Acting for HeightResponse {
    fn pulse_us(&self, now: &Moment) -> f64 {
        self.slope_us * now.relative_mps[2] * (now.height_m - LEVEL_M) / 30.0
    }
}
