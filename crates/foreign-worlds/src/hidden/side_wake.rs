//! Wake of the neighbour on one side, that falls with the climb.

use super::{Acting, Kind, Moment, log};

/// Climb at which the wake has fallen to exp(-1/2), m/s.
const FADES_MPS: f64 = 2.0;

/// Wake from one side.
pub(super) const KIND: Kind = Kind {
    name: "side-wake",
    what: "drones with a neighbour on their left need more pulse in slow flight",
    depends_on: &["place", "drone"],
    parameters: &[log("rise_us", 8.0, 25.0)],
    is_steady: false,
    start: |values| Box::new(SideWake { rise_us: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct SideWake {
    /// Rise of the pulse in hover, us.
    rise_us: f64,
}

impl Acting for SideWake {
    fn pulse_us(&self, now: &Moment) -> f64 {
        if !now.has_left {
            return 0.0;
        }
        let climb = now.relative_mps[2] / FADES_MPS;
        self.rise_us * (-climb * climb / 2.0).exp()
    }
}
