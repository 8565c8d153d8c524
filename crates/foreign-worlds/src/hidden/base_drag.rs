//! More drag of the form that the known vehicle has.

use super::{Acting, Kind, Moment, log};
use crate::vector::Vector;

/// Drag of the known form, times a factor.
pub(super) const KIND: Kind = Kind {
    name: "base-drag",
    what: "the drag of the known vehicle is larger, in all directions",
    depends_on: &["climb", "lean"],
    parameters: &[log("share", 0.3, 1.0)],
    is_steady: true,
    start: |values| Box::new(BaseDrag { share: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct BaseDrag {
    /// Further drag over the known one.
    share: f64,
}

impl Acting for BaseDrag {
    fn force_n(&self, now: &Moment) -> Vector {
        now.body_n.map(|part| part * self.share)
    }
}
