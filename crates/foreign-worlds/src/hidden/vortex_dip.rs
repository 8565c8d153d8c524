//! Loss of thrust in descent: a dip around one speed.

use super::{Acting, Kind, Moment, log, uniform};

/// Vortex ring in descent.
pub(super) const KIND: Kind = Kind {
    name: "vortex-dip",
    what: "thrust is lost around one speed of descent",
    depends_on: &["climb"],
    parameters: &[
        log("depth", 0.03, 0.12),
        uniform("centre_mps", -4.5, -2.5),
        uniform("width_mps", 0.9, 1.6),
    ],
    is_steady: true,
    start: |values| {
        Box::new(VortexDip { depth: values[0], centre_mps: values[1], width_mps: values[2] })
    },
};

#[derive(Clone, Copy, Debug)]
struct VortexDip {
    /// Share of the thrust that is lost at the centre.
    depth: f64,
    /// Climb at the centre of the dip, m/s.
    centre_mps: f64,
    /// Width of the dip, m/s.
    width_mps: f64,
}

impl Acting for VortexDip {
    fn thrust(&self, now: &Moment) -> f64 {
        let place = (now.body_mps[2] - self.centre_mps) / self.width_mps;
        1.0 - self.depth * (-place * place / 2.0).exp()
    }
}
