//! A wake of the body on its rotors that goes with the direction of the wind to the nose.

use std::f64::consts::TAU;

use super::{Acting, Kind, Moment, either, uniform};

/// Wake by heading.
pub(super) const KIND: Kind = Kind {
    name: "heading-wake",
    what: "the pulse goes with the direction of the air against the nose",
    depends_on: &["heading"],
    parameters: &[either("pulse_us", 8.0, 25.0), uniform("phase_rad", 0.0, TAU)],
    is_steady: true,
    start: |values| Box::new(HeadingWake { rise_us: values[0], phase_rad: values[1] }),
};

#[derive(Clone, Copy, Debug)]
struct HeadingWake {
    /// Rise of the pulse in fast air, us.
    rise_us: f64,
    /// Direction of the largest rise against the nose, rad.
    phase_rad: f64,
}

impl Acting for HeadingWake {
    fn pulse_us(&self, now: &Moment) -> f64 {
        let [x, y, _] = now.relative_mps;
        let speed = x.hypot(y);
        let share = speed * speed / (1.0 + speed * speed);
        self.rise_us * share * (y.atan2(x) - self.phase_rad).cos()
    }
}
