//! Share of the ladder that a drone flew: a law of a few slow rungs is no equal of a law of all.
//!
//! A log that ends halfway gives a law as well, with small errors of its own, but it is the law of
//! the slow rungs: it may be far from those of the fleet, for the two laws are only the first terms of
//! a rotor's curve. Such a drone keeps its law, is marked, and is left out of what speaks for the
//! fleet.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::calibrate::{FitOptions, is_used};
use super::window::WindowStats;
use crate::base::sentence::Sentence;

/// A drone with less than this share of the fleet's ladder has a part of it: less than a third may be
/// lost to gusts, gaps or motors at their limit, and a log cut in the middle has half.
const WHOLE_SHARE: f64 = 2.0 / 3.0;
/// Spans are compared to within this, m/s: commands are whole mm/s.
const ROUNDING_MPS: f64 = 1e-3;

/// That a drone's usable legs are fewer than two thirds of the fleet's, or span less than two thirds
/// of its speeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PartialLadder {
    /// Usable legs of the drone.
    pub usable: Ladder,
    /// Usable legs of the fleet's middle drone.
    pub fleet: Ladder,
}

impl PartialLadder {
    /// The part of the ladder in words: `6 of 14 legs, -1.5 to +1.5 m/s`.
    pub fn short(&self) -> String {
        self.sentence().to_string()
    }

    /// The part of the ladder in words as by [`PartialLadder::short`], with its speeds as numbers.
    pub fn sentence(&self) -> Sentence {
        let Ladder { legs, lowest_mps, highest_mps } = self.usable;
        Sentence::from(format!("{legs} of {} legs, ", self.fleet.legs))
            .number(lowest_mps, &format!("{lowest_mps:+}"))
            .words(" to ")
            .number(highest_mps, &format!("{highest_mps:+}"))
            .words(" m/s")
    }
}

/// Legs of vertical motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ladder {
    /// How many.
    pub legs: usize,
    /// Lowest commanded vertical velocity, m/s, up positive.
    pub lowest_mps: f64,
    /// Highest commanded vertical velocity, m/s, up positive.
    pub highest_mps: f64,
}

impl Ladder {
    /// The legs among a drone's windows that are `used`.
    fn of(windows: &[WindowStats], used: impl Fn(&WindowStats) -> bool) -> Self {
        let mut ladder = Self::default();
        for window in windows.iter().filter(|window| window.kind.is_leg() && used(window)) {
            let speed_mps = window.commanded_mps;
            ladder = if ladder.legs == 0 {
                Self { legs: 1, lowest_mps: speed_mps, highest_mps: speed_mps }
            } else {
                Self {
                    legs: ladder.legs + 1,
                    lowest_mps: ladder.lowest_mps.min(speed_mps),
                    highest_mps: ladder.highest_mps.max(speed_mps),
                }
            };
        }
        ladder
    }

    fn usable(windows: &[WindowStats], options: &FitOptions) -> Self {
        Self::of(windows, |window| is_used(window, options))
    }

    fn span_mps(&self) -> f64 {
        self.highest_mps - self.lowest_mps
    }

    /// Whether this is clearly less than `whole`.
    fn is_part_of(&self, whole: &Self) -> bool {
        (self.legs as f64) < WHOLE_SHARE * whole.legs as f64
            || self.span_mps() < WHOLE_SHARE * whole.span_mps() - ROUNDING_MPS
    }
}

/// Climbs at fewer speeds, or descents at fewer, are no ladder: take-off and landing have one or two.
pub(super) const FEWEST_RUNGS: usize = 3;
/// Speeds closer than this are one rung, m/s.
const SAME_RUNG_MPS: f64 = 0.15;

/// At how many speeds a drone has usable climbs, and at how many descents.
pub(super) fn rungs(windows: &[WindowStats], options: &FitOptions) -> (usize, usize) {
    let distinct = |sign: f64| {
        let legs = windows.iter().filter(|w| w.kind.is_leg() && is_used(w, options));
        let mut speeds: Vec<f64> =
            legs.map(|window| sign * window.commanded_mps).filter(|speed| *speed > 0.0).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup_by(|next, kept| *next - *kept < SAME_RUNG_MPS);
        speeds.len()
    };
    (distinct(1.0), distinct(-1.0))
}

/// Whether a flight without a plan is a calibration: climbs at three speeds or more, and descents.
pub(super) fn is_ladder((up, down): (usize, usize)) -> bool {
    up >= FEWEST_RUNGS && down >= FEWEST_RUNGS
}

/// The ladder of most of the drones: the middle one in legs and in span (the greater of two).
fn of_fleet(mut ladders: Vec<Ladder>) -> Option<Ladder> {
    let middle = ladders.len() / 2;
    ladders.sort_by(|left, right| left.span_mps().total_cmp(&right.span_mps()));
    let by_span = *ladders.get(middle)?;
    ladders.sort_by_key(|ladder| ladder.legs);
    Some(Ladder { legs: ladders.get(middle)?.legs, ..by_span })
}

/// The ladders of a calibration's fleet.
pub(super) struct FleetLadders {
    /// What the middle drone flew.
    pub(super) flown: Ladder,
    /// What of it is usable.
    pub(super) usable: Ladder,
}

impl FleetLadders {
    /// From the windows of each drone that has laws; `None` without any.
    ///
    /// The fleet's ladder is that of its middle drone, not the plan's: a rung that no drone could fly is
    /// nobody's loss.
    pub(super) fn of(drones: &[&[WindowStats]], options: &FitOptions) -> Option<Self> {
        let flown = drones.iter().map(|windows| Ladder::of(windows, |_| true));
        let usable = drones.iter().map(|windows| Ladder::usable(windows, options));
        Some(Self { flown: of_fleet(flown.collect())?, usable: of_fleet(usable.collect())? })
    }

    /// Whether most drones have less than two thirds of what they flew.
    pub(super) fn is_partial(&self) -> bool {
        self.usable.is_part_of(&self.flown)
    }

    /// That a drone's usable legs are fewer than two thirds of the fleet's, or span less than two thirds
    /// of its speeds; `None` if they do not.
    pub(super) fn partial(
        &self,
        windows: &[WindowStats],
        options: &FitOptions,
    ) -> Option<PartialLadder> {
        let usable = Ladder::usable(windows, options);
        let is_part = usable.legs > 0 && usable.is_part_of(&self.usable);
        is_part.then_some(PartialLadder { usable, fleet: self.usable })
    }
}
