//! Force of the rotors across their axis, proportional to thrust and speed.

use super::{Acting, Kind, Moment, log};
use crate::vector::Vector;

/// Force in the plane of the rotors.
pub(super) const KIND: Kind = Kind {
    name: "hub-force",
    what: "the rotors drag in their plane, with thrust and speed",
    depends_on: &["lean", "wind"],
    parameters: &[log("drag_per_weight", 0.0175, 0.035)],
    is_steady: true,
    start: |values| Box::new(HubForce { drag_per_weight: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct HubForce {
    /// Force over thrust and speed, s/m.
    drag_per_weight: f64,
}

impl Acting for HubForce {
    fn force_n(&self, now: &Moment) -> Vector {
        let [x, y, _] = now.body_mps;
        let factor = -self.drag_per_weight * now.thrust_n;
        [factor * x, factor * y, 0.0]
    }
}
