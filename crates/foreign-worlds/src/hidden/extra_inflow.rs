//! Flow through the rotors that takes thrust: linear in the speed along their axis.

use super::{Acting, Kind, Moment, log};

/// Inflow beyond that of the known vehicle.
pub(super) const KIND: Kind = Kind {
    name: "inflow",
    what: "the pulse rises with the air speed along the rotors",
    depends_on: &["climb"],
    parameters: &[log("slope_us", 12.0, 28.0)],
    is_steady: true,
    start: |values| Box::new(ExtraInflow { slope_us: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct ExtraInflow {
    /// Rise of the pulse with the speed along the axis, us/(m/s).
    slope_us: f64,
}

impl Acting for ExtraInflow {
    fn pulse_us(&self, now: &Moment) -> f64 {
        self.slope_us * now.body_mps[2]
    }
}
