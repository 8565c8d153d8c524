//! A response to vertical speed that drifts during the flight.

use super::{Acting, Kind, Moment, either, moment};

/// Response that drifts.
pub(super) const KIND: Kind = Kind {
    name: "drift",
    what: "the response to vertical speed changes evenly during the flight",
    depends_on: &["climb-time"],
    parameters: &[either("slope_us", 4.0, 14.0), moment("time_s", 0.999, 1.0)],
    is_steady: true,
    start: |values| Box::new(ClimbTime { slope_us: values[0], time_s: values[1] }),
};

#[derive(Clone, Copy, Debug)]
struct ClimbTime {
    /// Change of the response at the end of the flight, us/(m/s).
    slope_us: f64,
    /// Length of the flight, s.
    time_s: f64,
}

impl Acting for ClimbTime {
    fn pulse_us(&self, now: &Moment) -> f64 {
        self.slope_us * now.relative_mps[2] * now.time_s / self.time_s
    }
}
