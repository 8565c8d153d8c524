//! Thrust gained in moving air.

use super::{Acting, Kind, Moment, log};

/// Translational lift.
pub(super) const KIND: Kind = Kind {
    name: "lift",
    what: "thrust grows with the square of the horizontal air speed",
    depends_on: &["wind"],
    parameters: &[log("gain", 0.01, 0.06)],
    is_steady: true,
    start: |values| Box::new(TranslationalLift { gain: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct TranslationalLift {
    /// Share of the thrust that is gained at 5 m/s.
    gain: f64,
}

impl Acting for TranslationalLift {
    fn thrust(&self, now: &Moment) -> f64 {
        let [x, y, _] = now.relative_mps;
        1.0 + self.gain * (x * x + y * y) / 25.0
    }
}
