//! A limit of the command a little above hover.

use super::{Acting, Kind, log};

/// A limit of the command.
pub(super) const KIND: Kind = Kind {
    name: "ceiling",
    what: "controllers take no command beyond a limit",
    depends_on: &["climb"],
    parameters: &[log("above_us", 70.0, 150.0)],
    is_steady: false,
    start: |values| Box::new(Ceiling { above_us: values[0] }),
};

#[derive(Clone, Copy, Debug)]
struct Ceiling {
    /// Limit over the pulse of hover, us.
    above_us: f64,
}

impl Acting for Ceiling {
    fn ceiling(&self, hover_command: f64) -> f64 {
        hover_command + self.above_us * 1e-3
    }
}
