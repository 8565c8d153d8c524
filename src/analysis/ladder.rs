//! Share of the ladder that a drone flew: a law of a few slow rungs is no equal of a law of all.
//!
//! A log that ends halfway gives a law as well, with small errors of its own, but it is the law of
//! the slow rungs: it may be far from those of the fleet, for the two laws are only the first terms of
//! a rotor's curve. Such a drone keeps its law, is marked, and is left out of what speaks for the
//! fleet.

use super::calibrate::{FitOptions, is_used};
use super::result::{DroneAnalysis, Ladder, PartialLadder};

/// A drone with less than this share of the fleet's ladder has a part of it: less than a third may be
/// lost to gusts, gaps or motors at their limit, and a log cut in the middle has half.
const WHOLE_SHARE: f64 = 2.0 / 3.0;
/// Spans are compared to within this, m/s: commands are whole mm/s.
const ROUNDING_MPS: f64 = 1e-3;

impl Ladder {
    /// The legs of a drone for which `counts` says so.
    fn of(drone: &DroneAnalysis, used: impl Fn(usize) -> bool) -> Self {
        let mut ladder = Self::default();
        for (index, window) in drone.windows.iter().enumerate() {
            if !window.kind.is_leg() || !used(index) {
                continue;
            }
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

    fn usable(drone: &DroneAnalysis, options: &FitOptions) -> Self {
        let used = |index: usize| drone.windows.get(index).is_some_and(|w| is_used(w, options));
        Self::of(drone, used)
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
const FEWEST_RUNGS: usize = 3;
/// Speeds closer than this are one rung, m/s.
const SAME_RUNG_MPS: f64 = 0.15;

/// At how many speeds a drone has usable climbs, and at how many descents.
pub(super) fn rungs(drone: &DroneAnalysis, options: &FitOptions) -> (usize, usize) {
    let distinct = |sign: f64| {
        let legs = drone.windows.iter().filter(|w| w.kind.is_leg() && is_used(w, options));
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

/// That a flight with some climbs is not taken for a calibration: the most rungs that a drone has.
pub(super) fn no_ladder((up, down): (usize, usize)) -> String {
    format!(
        "without a plan a flight is a calibration only if it climbs at {FEWEST_RUNGS} speeds or more \
         and sinks at {FEWEST_RUNGS} or more: this one has steady climbs at {up} and descents at \
         {down} (take-off and landing?), and is taken for a measurement. If it is a calibration, give \
         its plan (--plan)"
    )
}

/// The ladder of most of the drones: the middle one in legs and in span (the greater of two).
fn of_fleet(mut ladders: Vec<Ladder>) -> Option<Ladder> {
    let middle = ladders.len() / 2;
    ladders.sort_by(|left, right| left.span_mps().total_cmp(&right.span_mps()));
    let by_span = *ladders.get(middle)?;
    ladders.sort_by_key(|ladder| ladder.legs);
    Some(Ladder { legs: ladders.get(middle)?.legs, ..by_span })
}

/// Marks the drones of a calibration whose usable legs are fewer than two thirds of the fleet's, or
/// span less than two thirds of its speeds. Returns cautions that name them.
///
/// The fleet's ladder is that of its middle drone, not the plan's: a rung that no drone could fly is
/// nobody's loss. That most drones have less than two thirds of the plan is a caution of its own.
pub(super) fn mark_partial(drones: &mut [DroneAnalysis], options: &FitOptions) -> Vec<String> {
    let with_laws = || drones.iter().filter(|drone| drone.laws.is_some());
    let planned = of_fleet(with_laws().map(|drone| Ladder::of(drone, |_| true)).collect());
    let flown = of_fleet(with_laws().map(|drone| Ladder::usable(drone, options)).collect());
    let (Some(planned), Some(whole)) = (planned, flown) else { return Vec::new() };
    let mut named = Vec::new();
    for drone in drones.iter_mut() {
        let usable = Ladder::usable(drone, options);
        if usable.legs > 0 && usable.is_part_of(&whole) {
            let partial = PartialLadder { usable, fleet: whole };
            named.push(format!("{} ({})", drone.name, partial.short()));
            drone.partial_ladder = Some(partial);
        }
    }
    let mut cautions = Vec::new();
    if !named.is_empty() {
        cautions.push(format!(
            "partial ladder: {} of {} drones flew less than two thirds of the fleet's ladder ({} \
             legs from {:+} to {:+} m/s): {}. They keep their own laws, but are left out of the \
             fleet's means and standard deviations and of the average of the drones; a map takes \
             the law of that average for them",
            named.len(),
            drones.len(),
            whole.legs,
            whole.lowest_mps,
            whole.highest_mps,
            named.join(", "),
        ));
    }
    if whole.is_part_of(&planned) {
        cautions.push(format!(
            "most drones have usable windows of a part of the ladder only: {} legs from {:+} to {:+} \
             m/s of {} from {:+} to {:+} m/s. The fleet's numbers are those of that part",
            whole.legs,
            whole.lowest_mps,
            whole.highest_mps,
            planned.legs,
            planned.lowest_mps,
            planned.highest_mps,
        ));
    }
    cautions
}
