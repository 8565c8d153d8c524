//! A slow swinging of the pulse: a controller that hunts.

use std::f64::consts::TAU;

use super::{Acting, Kind, Moment, log, uniform};

/// Oscillation.
pub(super) const KIND: Kind = Kind {
    name: "oscillation",
    what: "the pulse swings with one period during the whole flight",
    depends_on: &["time"],
    parameters: &[
        log("amplitude_us", 5.0, 18.0),
        log("period_s", 40.0, 150.0),
        uniform("phase_rad", 0.0, TAU),
    ],
    is_steady: true,
    start: |values| {
        Box::new(Oscillation { amplitude_us: values[0], period_s: values[1], phase_rad: values[2] })
    },
};

#[derive(Clone, Copy, Debug)]
struct Oscillation {
    /// Amplitude, us.
    amplitude_us: f64,
    /// Period, s.
    period_s: f64,
    /// Phase at the start, rad.
    phase_rad: f64,
}

impl Acting for Oscillation {
    fn pulse_us(&self, now: &Moment) -> f64 {
        let turns = now.time_s / self.period_s;
        self.amplitude_us * (TAU * turns + self.phase_rad).sin()
    }
}
