//! Windows from the measured velocity, for tables that have no commands.

use super::windows::Target;
use crate::flight::table::Steps;
use crate::flight::{Flight, Series};
use crate::mission::plan::SegmentKind;
use crate::numeric::mean;

/// Running mean before steps are told apart, s: rotor and position control jitter faster.
const SMOOTH_S: f64 = 1.0;
/// Grid on which steps are looked for, s.
const STEP_S: f64 = 0.1;
/// Slower is a hover, m/s.
const HOVER_MPS: f64 = 0.3;
/// Cut at the end of every window, s.
const END_CUT_S: f64 = 0.5;
/// Longest table, s.
const LONGEST_S: f64 = 1e6;

/// Finds the stretches over which the velocity, averaged over 1 s, stays near its mean: each is a
/// window, less the controller's transient.
pub fn steady(flight: &Flight, steps: &Steps) -> Vec<Target> {
    let mut targets = Vec::new();
    let mut run: Vec<(f64, f64)> = Vec::new();
    for (time_s, velocity_mps) in smoothed(&flight.velocity_up_mps) {
        let average = mean(run.iter().map(|(_, value)| value)).unwrap_or_default();
        let follows = run.last().is_some_and(|(last, _)| time_s - last < 2.0 * STEP_S);
        let goes_on = follows && (velocity_mps - average).abs() <= steps.wobble_mps;
        if !run.is_empty() && !goes_on {
            targets.extend(target(&run, steps));
            run.clear();
        }
        run.push((time_s, velocity_mps));
    }
    targets.extend(target(&run, steps));
    targets
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
