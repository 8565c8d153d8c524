//! Windows from the measured velocity, for tables that have no commands.

use super::windows::Target;
use crate::flight::table::Steps;
use crate::flight::{Flight, Series};
use crate::mission::plan::SegmentKind;
use crate::numeric::{mean, median};

/// Running mean before steps are told apart, s: rotor and position control jitter faster.
const SMOOTH_S: f64 = 1.0;
/// Grid on which steps are looked for, s.
const STEP_S: f64 = 0.1;
/// Slower is a hover, m/s.
const HOVER_MPS: f64 = 0.3;
/// Cut at the end of every window, s.
const END_CUT_S: f64 = 0.5;
/// A hover goes on behind a hole of the table where its height is the same to this, m: heights by air pressure wander.
/// Chosen.
const SAME_HEIGHT_M: f64 = 2.0;
/// Time at both sides of a hole over which heights are compared, s.
const BESIDE_S: f64 = 5.0;
/// Longest table, s.
const LONGEST_S: f64 = 1e6;

/// Finds the stretches over which the velocity, averaged over 1 s, stays near its mean: each is a
/// window, less the controller's transient.
pub fn steady(flight: &Flight, steps: &Steps) -> Vec<Target> {
    let runs = runs(flight, steps);
    runs.iter().filter_map(|run| target(&run.points, steps)).collect()
}

/// As [`steady`], but a hover goes on behind a hole of the table: what is before and behind the hole is air over the same
/// place, and only the seconds that the hole touches have no value. A window of a calibration must not have a hole.
pub(super) fn steady_across_holes(flight: &Flight, steps: &Steps) -> Vec<Target> {
    let mut joined: Vec<Run> = Vec::new();
    for run in runs(flight, steps) {
        match joined.last_mut().filter(|before| run.goes_on(before, flight)) {
            Some(before) => before.points.extend(run.points),
            None => joined.push(run),
        }
    }
    joined.iter().filter_map(|run| target(&run.points, steps)).collect()
}

/// Times and velocities that stay near their mean.
struct Run {
    points: Vec<(f64, f64)>,
    /// Whether a hole of the table is before it, and not another velocity.
    is_behind_hole: bool,
}

impl Run {
    fn is_hover(&self) -> bool {
        mean(self.points.iter().map(|(_, value)| value)).is_some_and(|v| v.abs() < HOVER_MPS)
    }

    /// Whether it is the same hover as the run before it.
    fn goes_on(&self, before: &Self, flight: &Flight) -> bool {
        let (Some((end_s, _)), Some((start_s, _))) = (before.points.last(), self.points.first())
        else {
            return false;
        };
        let height_m =
            |from_s: f64, to_s: f64| median(flight.height_m.between(from_s, to_s).to_vec());
        let heights =
            height_m(end_s - BESIDE_S, *end_s).zip(height_m(*start_s, start_s + BESIDE_S));
        self.is_behind_hole
            && before.is_hover()
            && self.is_hover()
            && heights.is_none_or(|(before, after)| (before - after).abs() <= SAME_HEIGHT_M)
    }
}

fn runs(flight: &Flight, steps: &Steps) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut run = Run { points: Vec::new(), is_behind_hole: false };
    for (time_s, velocity_mps) in smoothed(&flight.velocity_up_mps) {
        let average = mean(run.points.iter().map(|(_, value)| value)).unwrap_or_default();
        let follows = run.points.last().is_some_and(|(last, _)| time_s - last < 2.0 * STEP_S);
        let goes_on = follows && (velocity_mps - average).abs() <= steps.wobble_mps;
        if !run.points.is_empty() && !goes_on {
            let next = Run { points: Vec::new(), is_behind_hole: !follows };
            runs.push(std::mem::replace(&mut run, next));
        }
        run.points.push((time_s, velocity_mps));
    }
    runs.push(run);
    runs
}

/// Means over 1 s, each tenth of a second; none where there are no samples.
fn smoothed(velocity: &Series) -> Vec<(f64, f64)> {
    let Some((start, end)) = velocity.span() else { return Vec::new() };
    let count = ((end - start).min(LONGEST_S) / STEP_S) as usize;
    let value = |index: usize| {
        let time_s = start + index as f64 * STEP_S;
        let near = velocity.between(time_s - SMOOTH_S / 2.0, time_s + SMOOTH_S / 2.0);
        mean(near).map(|average| (time_s, average))
    };
    (0..=count).filter_map(value).collect()
}

fn target(run: &[(f64, f64)], steps: &Steps) -> Option<Target> {
    let (start_s, end_s) = (run.first()?.0 + steps.settle_s, run.last()?.0 - END_CUT_S);
    if end_s - start_s < steps.shortest_s {
        return None;
    }
    let settled = run.iter().filter(|(time_s, _)| *time_s >= start_s);
    let mean = mean(settled.map(|(_, value)| value)).unwrap_or_default();
    let (kind, label, commanded_mps) = if mean.abs() < HOVER_MPS {
        (SegmentKind::Hover, "hover".to_owned(), 0.0)
    } else {
        let rounded = (mean * 10.0).round() / 10.0;
        let (kind, word) =
            if mean > 0.0 { (SegmentKind::LegUp, "up") } else { (SegmentKind::LegDown, "down") };
        (kind, format!("{word} {:.1} m/s", rounded.abs()), rounded)
    };
    Some(Target { kind, label, start_s, end_s, commanded_mps })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn climbs_hovers_and_descents_are_told_apart() {
        // 10 s of hover, 8 s up at 3 m/s, 4 s of hover, 8 s down, each change within 1 s.
        let velocity = |time: f64| match time {
            t if t < 10.0 => 0.02 * (t * 7.0).sin(),
            t if t < 18.0 => (3.0 * (t - 10.0)).min(3.05),
            t if t < 22.0 => 0.0,
            t if t < 30.0 => -2.98,
            _ => 0.0,
        };
        let time_s: Vec<f64> = (0..340).map(|step| f64::from(step) * 0.1).collect();
        let value = time_s.iter().map(|time| velocity(*time)).collect();
        let flight = Flight { velocity_up_mps: Series { time_s, value }, ..Flight::default() };
        let steps = Steps { settle_s: 1.0, shortest_s: 2.0, ..Steps::default() };
        let found = steady(&flight, &steps);
        let labels: Vec<&str> = found.iter().map(|target| target.label.as_str()).collect();
        assert_eq!(labels, ["hover", "up 3.0 m/s", "down 3.0 m/s"]);
        let up = &found[1];
        assert!(up.start_s > 11.5 && up.end_s < 18.0, "{up:?}");
        assert_eq!(steady(&Flight::default(), &steps), []);
    }

    /// A flight of 10 samples a second that is at 20 m, and in one part elsewhere.
    fn holed(velocity: impl Fn(f64) -> f64, height: impl Fn(f64) -> f64) -> Flight {
        let kept = |time: &f64| !(40.0..60.0).contains(time);
        let time_s: Vec<f64> = (0..1000).map(|step| f64::from(step) * 0.1).filter(kept).collect();
        let series = |of: &dyn Fn(f64) -> f64| Series {
            time_s: time_s.clone(),
            value: time_s.iter().map(|time| of(*time)).collect(),
        };
        let (velocity_up_mps, height_m) = (series(&velocity), series(&height));
        Flight { velocity_up_mps, height_m, ..Flight::default() }
    }

    #[test]
    fn a_hover_goes_on_behind_a_hole_of_the_table() {
        let steps = Steps::default();
        let flight = holed(|_| 0.0, |_| 20.0);
        let times = |targets: &[Target]| -> Vec<[i64; 2]> {
            targets.iter().map(|one| [one.start_s as i64, one.end_s as i64]).collect()
        };
        assert_eq!(times(&steady(&flight, &steps)), [[3, 39], [62, 99]]);
        assert_eq!(times(&steady_across_holes(&flight, &steps)), [[3, 99]]);
        // At another height it is another hover, and so it is after a climb that the table shows.
        let higher = holed(|_| 0.0, |time| if time < 50.0 { 20.0 } else { 30.0 });
        assert_eq!(steady_across_holes(&higher, &steps).len(), 2);
        let climbed = holed(|time| if time > 70.0 && time < 75.0 { 1.0 } else { 0.0 }, |_| 20.0);
        let found = steady_across_holes(&climbed, &steps);
        let hovers: Vec<&Target> = found.iter().filter(|one| one.label == "hover").collect();
        assert_eq!(hovers.len(), 2, "{found:?}");
        assert!(hovers[0].start_s < 4.0 && hovers[0].end_s > 69.0, "{found:?}");
    }

    #[test]
    fn the_shortest_window_is_still_used() {
        let run: Vec<(f64, f64)> = (0..=20).map(|half| (0.5 * f64::from(half), 0.0)).collect();
        let of =
            |shortest_s| target(&run, &Steps { settle_s: 3.0, shortest_s, ..Steps::default() });
        let window = of(6.5).unwrap();
        assert_eq!((window.start_s, window.end_s), (3.0, 9.5));
        assert!(of(6.6).is_none());
    }
}
