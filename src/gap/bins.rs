//! Steady bins: stretches of constant commanded velocity, cut into pieces of about three seconds.
//!
//! Measured and simulated pulses are compared in these (docs/physics.md, 3.1): long enough for
//! noise to average, short enough that the air's own time scale shows.

use crate::mission::plan::{Segment, SegmentKind};

/// Nothing is compared for this long after a change of the command, s. The overshoot of the autopilot's
/// integral term lasts 2 to 3 s after a step of 3.5 m/s (docs/physics.md, 5.1); the rest is margin, chosen.
const SETTLE_S: f64 = 5.0;
/// The settling time in hovers, s: shorter than [`SETTLE_S`], because the paper's hovers last only 10 s and
/// would otherwise leave a single bin. Chosen.
const SETTLE_HOVER_S: f64 = 4.0;
/// Cut at the end of a stretch, s: clocks and commands agree to some tenths of a second. Chosen; the paper
/// cuts 1 s.
const TRIM_S: f64 = 0.5;
/// Shortest bin, s; bins are shorter than twice this. Bins of about 3 s keep gusts (8 s) resolved and leave
/// each bin some 25 samples at 10 Hz. Chosen, not measured: the noise model takes care of what bins share.
const SHORTEST_S: f64 = 2.5;

/// One bin of a command group.
#[derive(Clone, Debug, PartialEq)]
pub struct Bin {
    /// Kind of segment that is flown in the bin.
    pub kind: SegmentKind,
    /// Start, show time, s.
    pub start_s: f64,
    /// End, show time, s; excluded.
    pub end_s: f64,
    /// Commanded velocity, show frame, m/s, z up positive.
    pub velocity_mps: [f64; 3],
    /// Index of the segment in the group; bins of one segment are held out together.
    pub segment: usize,
}

impl Bin {
    /// Middle of the bin, show time, s.
    pub fn middle_s(&self) -> f64 {
        f64::midpoint(self.start_s, self.end_s)
    }

    /// Length of the bin, s.
    pub fn length_s(&self) -> f64 {
        self.end_s - self.start_s
    }

    /// Commanded vertical velocity, m/s, up positive.
    pub fn climb_mps(&self) -> f64 {
        self.velocity_mps[2]
    }

    /// Whether the command has a horizontal part.
    pub fn is_horizontal(&self) -> bool {
        self.velocity_mps[0].hypot(self.velocity_mps[1]) > 0.1
    }
}

/// The bins of what a group flies.
pub(super) fn of_segments(segments: &[Segment]) -> Vec<Bin> {
    let steady = |segment: &&Segment| {
        let flown = !matches!(
            segment.kind,
            SegmentKind::Wait | SegmentKind::Takeoff | SegmentKind::Ramp | SegmentKind::Landing
        );
        flown && segment.from_velocity_mps.is_none_or(|from| from == segment.velocity_mps)
    };
    let mut bins = Vec::new();
    for (index, segment) in segments.iter().enumerate().filter(|(_, segment)| steady(segment)) {
        let settle_s = if segment.kind.is_hover() { SETTLE_HOVER_S } else { SETTLE_S };
        let start_s = segment.start_ms as f64 / 1000.0 + settle_s;
        let end_s = segment.end_ms as f64 / 1000.0 - TRIM_S;
        bins.extend(cut(segment.kind, start_s, end_s, segment.velocity_mps, index));
    }
    bins
}

/// Cuts a steady stretch into bins.
pub(super) fn cut(
    kind: SegmentKind,
    start_s: f64,
    end_s: f64,
    velocity_mps: [f64; 3],
    segment: usize,
) -> impl Iterator<Item = Bin> {
    let count = ((end_s - start_s) / SHORTEST_S).floor().max(0.0) as usize;
    let length_s = (end_s - start_s) / count.max(1) as f64;
    (0..count).map(move |index| Bin {
        kind,
        start_s: start_s + index as f64 * length_s,
        end_s: start_s + (index + 1) as f64 * length_s,
        velocity_mps,
        segment,
    })
}

/// Cosine of the angle by which two headings differ at least. Chosen: 45 degrees.
const HEADINGS_APART: f64 = 0.7;

/// Whether legs with these velocities, m/s, are flown in two headings: one alone tells no law apart from a wind.
pub(super) fn have_two_headings(legs_mps: impl Iterator<Item = [f64; 3]>) -> bool {
    let mut first: Option<[f64; 2]> = None;
    legs_mps.map(|[x, y, _]| [x / x.hypot(y), y / x.hypot(y)]).any(|[x, y]| {
        let [first_x, first_y] = *first.get_or_insert([x, y]);
        x * first_x + y * first_y < HEADINGS_APART
    })
}

/// Measured values of one drone in one bin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BinValues {
    /// Mean pulse of all rotors, brought to level flight, us.
    pub pulse_us: f64,
    /// Mean vertical velocity, m/s, up positive.
    pub climb_mps: f64,
    /// Mean height above home, m.
    pub height_m: f64,
    /// Mean lean: the horizontal part of the thrust axis (the sine of the lean), show frame x and y, rad where it is small.
    pub lean_rad: [f64; 2],
    /// Battery voltage at rest, V; NaN if it was not logged.
    pub resting_v: f64,
    /// Battery voltage under load, V; NaN if it was not logged.
    pub loaded_v: f64,
    /// Electrical power, W; NaN if it was not logged.
    pub power_w: f64,
    /// Whether a model's drone did not hold its course there, or leaned as far as its autopilot lets it: its pulse and lean are not
    /// those of steady flight. Measured drones that the wind carries away are left out.
    pub carried_away: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::resolve::resolve;

    #[test]
    fn legs_out_and_back_are_two_headings_and_one_leg_is_none() {
        let two = |legs_mps: &[[f64; 3]]| have_two_headings(legs_mps.iter().copied());
        assert!(two(&[[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]]));
        assert!(two(&[[3.0, 0.0, 0.0], [6.0, 0.0, 0.0], [0.0, 3.0, 0.0]]));
        assert!(!two(&[[3.0, 0.0, 0.0], [6.0, 1.0, 0.0]]));
        assert!(!two(&[]));
    }

    #[test]
    fn the_paper_ladder_has_its_bins_after_the_transients() {
        let plan = resolve("calibration", &[]).unwrap().flights.remove(0).plan;
        let bins = of_segments(&plan.groups[0].segments);
        let legs = bins.iter().filter(|bin| bin.kind.is_leg()).count();
        assert_eq!(legs, 14 * 5, "14.5 s of each leg");
        let hovers = bins.iter().filter(|bin| bin.kind.is_hover()).count();
        assert_eq!(hovers, 15 * 2);
        for bin in &bins {
            let segment = &plan.groups[0].segments[bin.segment];
            assert!(bin.start_s >= segment.start_ms as f64 / 1000.0 + 4.0);
            assert!(bin.end_s < segment.end_ms as f64 / 1000.0);
            assert!((SHORTEST_S..2.0 * SHORTEST_S).contains(&bin.length_s()), "{bin:?}");
        }
    }
}
