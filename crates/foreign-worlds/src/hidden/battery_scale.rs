//! Thrust that follows the battery: a controller that does not compensate the voltage.

use super::{Acting, Kind, Moment, log};

/// Command scaled by the battery's voltage.
pub(super) const KIND: Kind = Kind {
    name: "voltage",
    what: "commands act by a power of the battery's voltage",
    depends_on: &["voltage", "time"],
    parameters: &[log("exponent", 0.5, 1.0)],
    is_steady: true,
    start: |values| Box::new(BatteryScale { exponent: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct BatteryScale {
    /// Power of the voltage over the reference.
    exponent: f64,
}

impl Acting for BatteryScale {
    fn command(&self, given: f64, now: &Moment) -> f64 {
        given * now.supply_ratio.max(0.1).powf(self.exponent)
    }
}
