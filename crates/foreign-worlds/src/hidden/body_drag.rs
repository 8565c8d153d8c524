//! Drag of a round body: along the motion, with the square of the speed.

use super::{Acting, Kind, Moment, log};
use crate::plant::SEA_LEVEL_KGPM3;
use crate::vector::{Vector, norm};

/// Drag of another form than the known vehicle's.
pub(super) const KIND: Kind = Kind {
    name: "body-drag",
    what: "a round body adds drag along the motion",
    depends_on: &["climb", "lean", "wind"],
    parameters: &[log("area_m2", 0.02, 0.08)],
    is_steady: true,
    start: |values| Box::new(BodyDrag { area_m2: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct BodyDrag {
    /// Drag coefficient times area, m².
    area_m2: f64,
}

impl Acting for BodyDrag {
    fn force_n(&self, now: &Moment) -> Vector {
        let speed_mps = norm(now.body_mps);
        let density = SEA_LEVEL_KGPM3 * now.density_ratio;
        now.body_mps.map(|part| -0.5 * density * self.area_m2 * speed_mps * part)
    }
}
