//! A pulse that remembers which way the drone was last accelerated: flow that stays attached or detached.

use super::{Acting, Kind, Moment, log};

/// Accelerations beyond this switch the state, m/s²: starts and stops of legs, not gusts.
const SWITCHES_MPS2: f64 = 0.8;

/// Hysteresis.
pub(super) const KIND: Kind = Kind {
    name: "hysteresis",
    what: "the pulse depends on the sign of the last vertical acceleration",
    depends_on: &["acceleration"],
    parameters: &[log("jump_us", 6.0, 20.0)],
    is_steady: false,
    start: |values| Box::new(Hysteresis { jump_us: values[0], state: 0.0 }),
};

#[derive(Clone, Copy, Debug)]
struct Hysteresis {
    /// Difference of the two states, us.
    jump_us: f64,
    state: f64,
}

impl Acting for Hysteresis {
    fn follow(&mut self, now: &Moment, _step_s: f64) {
        if now.acceleration_mps2.abs() > SWITCHES_MPS2 {
            self.state = now.acceleration_mps2.signum();
        }
    }

    fn pulse_us(&self, _now: &Moment) -> f64 {
        self.jump_us / 2.0 * self.state
    }
}
