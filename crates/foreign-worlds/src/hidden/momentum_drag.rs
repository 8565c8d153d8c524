//! Drag of air that is turned into the rotors, in all directions: linear in the speed.

use super::{Acting, Kind, Moment, log};
use crate::vector::Vector;

/// Linear drag in all directions.
pub(super) const KIND: Kind = Kind {
    name: "momentum-drag",
    what: "a drag grows linearly with the air speed, in all directions",
    depends_on: &["climb", "lean", "wind"],
    parameters: &[log("rate_per_s", 0.15, 0.4)],
    is_steady: true,
    start: |values| Box::new(MomentumDrag { rate_per_s: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct MomentumDrag {
    /// Force over mass and speed, 1/s.
    rate_per_s: f64,
}

impl Acting for MomentumDrag {
    fn force_n(&self, now: &Moment) -> Vector {
        now.body_mps.map(|part| -self.rate_per_s * now.mass_kg * part)
    }
}
