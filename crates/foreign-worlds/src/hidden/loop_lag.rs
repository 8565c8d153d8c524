//! A vertical velocity that comes late to the control loop.

use super::{Acting, Kind, VelocityError, log};

/// Late velocity in the loop.
pub(super) const KIND: Kind = Kind {
    name: "loop-lag",
    what: "the control loop gets its vertical velocity late",
    depends_on: &["climb"],
    parameters: &[log("lag_s", 0.08, 0.2)],
    is_steady: false,
    start: |values| Box::new(LoopLag { lag_s: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct LoopLag {
    /// How late, s.
    lag_s: f64,
}

impl Acting for LoopLag {
    fn velocity(&self) -> VelocityError {
        VelocityError { loop_lag_s: self.lag_s, ..VelocityError::default() }
    }
}
