//! Ice on the blades from one moment on: less thrust, and a steeper response.

use super::{Acting, Kind, Moment, log, moment};

/// Icing.
pub(super) const KIND: Kind = Kind {
    name: "icing",
    what: "from one moment on the rotors give less and answer more steeply",
    depends_on: &["step", "climb-time", "time"],
    parameters: &[log("rise_us", 8.0, 30.0), log("slope_us", 3.0, 10.0), moment("at_s", 0.3, 0.7)],
    is_steady: true,
    start: |values| Box::new(Icing { rise_us: values[0], slope_us: values[1], at_s: values[2] }),
};

#[derive(Clone, Copy, Debug)]
struct Icing {
    /// Rise of the pulse in hover, us.
    rise_us: f64,
    /// Rise of the response, us/(m/s).
    slope_us: f64,
    /// When, since the motors started, s.
    at_s: f64,
}

impl Acting for Icing {
    fn pulse_us(&self, now: &Moment) -> f64 {
        if now.time_s < self.at_s {
            return 0.0;
        }
        self.rise_us + self.slope_us * now.body_mps[2]
    }
}
