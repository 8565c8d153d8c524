//! Drift of the pulse as motors warm up.

use super::{Acting, Kind, Moment, either, log};

/// Warming of the motors.
pub(super) const KIND: Kind = Kind {
    name: "warming",
    what: "the pulse drifts to another value as the motors warm up",
    depends_on: &["time"],
    parameters: &[either("drift_us", 6.0, 20.0), log("time_s", 60.0, 200.0)],
    is_steady: true,
    start: |values| Box::new(Warming { drift_us: values[0], time_s: values[1] }),
};

#[derive(Clone, Copy, Debug)]
struct Warming {
    /// Rise of the pulse once warm, us.
    drift_us: f64,
    /// Time constant, s.
    time_s: f64,
}

impl Acting for Warming {
    fn pulse_us(&self, now: &Moment) -> f64 {
        -self.drift_us * (-now.time_s.max(0.0) / self.time_s).exp_m1()
    }
}
