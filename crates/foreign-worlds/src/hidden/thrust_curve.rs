//! Curvature of thrust over command; hover is where it was.

use super::{Acting, Kind, Moment, log};

/// A thrust curve.
pub(super) const KIND: Kind = Kind {
    name: "curve",
    what: "thrust is a curve over the command",
    depends_on: &["climb"],
    parameters: &[log("expo", 0.3, 0.7)],
    is_steady: true,
    start: |values| Box::new(ThrustCurve { expo: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct ThrustCurve {
    /// Share of the quadratic part.
    expo: f64,
}

impl Acting for ThrustCurve {
    fn command(&self, given: f64, now: &Moment) -> f64 {
        let curve = |command: f64| (1.0 - self.expo) * command + self.expo * command * command;
        now.hover_command * curve(given) / curve(now.hover_command).max(1e-6)
    }
}
