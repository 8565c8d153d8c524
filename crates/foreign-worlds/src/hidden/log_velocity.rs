//! A vertical velocity that is wrong in the log alone: the control loop has the right one.

use super::{Acting, Kind, VelocityError, either, log};

/// Late in the log.
pub(super) const LAG: Kind = Kind {
    name: "log-lag",
    what: "the logged vertical velocity is late; the loop has it in time",
    depends_on: &["climb"],
    parameters: &[log("lag_s", 0.12, 0.4)],
    is_steady: false,
    start: |values| Box::new(LogVelocity { lag_s: values[0], bias_mps: 0.0 }),
};

/// Biased in the log.
pub(super) const BIAS: Kind = Kind {
    name: "log-bias",
    what: "the logged vertical velocity is off; the loop has the right one",
    depends_on: &["climb"],
    parameters: &[either("bias_mps", 0.06, 0.3)],
    is_steady: false,
    start: |values| Box::new(LogVelocity { lag_s: 0.0, bias_mps: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct LogVelocity {
    /// How late, s.
    lag_s: f64,
    /// How much too large, m/s.
    bias_mps: f64,
}

impl Acting for LogVelocity {
    fn velocity(&self) -> VelocityError {
        VelocityError {
            log_lag_s: self.lag_s,
            log_bias_mps: self.bias_mps,
            ..VelocityError::default()
        }
    }
}
