//! How long a drone held its hover: one that is ordered down, returns or falls holds it only until then.

use super::budget::{Quality, QualityFlag};
use super::windows::Target;
use crate::flight::Flight;
use crate::numeric::median;

/// Who is lower than this below its hover has come down, m.
const CAME_DOWN_M: f64 = 3.0;
/// Who is no lower than this holds it, m.
const HELD_M: f64 = 0.5;
/// The height of a hover is that of its beginning, s.
const BEGINNING_S: f64 = 10.0;
/// Hovers that are held for less stand as they were planned, s.
const SHORTEST_S: f64 = 20.0;

/// Ends the hovers from which a drone came down where it did, and says so: one flag for each.
pub(super) fn end_where_left(flight: &Flight, targets: &mut [Target]) -> Vec<QualityFlag> {
    let hovers = targets.iter_mut().filter(|target| target.kind.is_hover());
    hovers
        .filter_map(|hover| {
            let left_s = left_s(flight, hover)?;
            let end_s = std::mem::replace(&mut hover.end_s, left_s);
            let reason = format!("it came down early: no values from {left_s:.0} to {end_s:.0} s");
            Some(QualityFlag { flag: Quality::Incomplete, start_s: left_s, end_s, reason })
        })
        .collect()
}

/// When a drone began to come down from a hover, s; `None`: it held it to its end, or to that of its log.
fn left_s(flight: &Flight, hover: &Target) -> Option<f64> {
    let height = &flight.height_m;
    let begun = height.between(hover.start_s, hover.start_s + BEGINNING_S);
    let held_m = median(begun.to_vec())?;
    let inside = || {
        let ends_s = hover.start_s..=hover.end_s;
        let pairs = height.time_s.iter().zip(&height.value);
        pairs.filter(move |(time_s, _)| ends_s.contains(time_s)).map(|(time_s, m)| (*time_s, *m))
    };
    let (_, last_m) = inside().next_back()?;
    if held_m - last_m <= CAME_DOWN_M {
        return None;
    }
    let (left_s, _) = inside().rfind(|(_, m)| held_m - m <= HELD_M)?;
    (left_s - hover.start_s >= SHORTEST_S).then(|| left_s.floor())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Series;
    use crate::mission::plan::SegmentKind;

    /// Hover of 300 s at 100 m, and a flight that leaves it at 130 s.
    fn flown(below_m: impl Fn(f64) -> f64) -> (Flight, Vec<Target>) {
        let time_s: Vec<f64> = (0..3000).map(|index| f64::from(index) / 10.0).collect();
        let value = time_s.iter().map(|time_s| 100.0 - below_m(*time_s)).collect();
        let flight = Flight { height_m: Series { time_s, value }, ..Flight::default() };
        let (kind, label) = (SegmentKind::Hover, String::new());
        let hover = Target { kind, label, start_s: 0.0, end_s: 300.0, commanded_mps: 0.0 };
        (flight, vec![hover])
    }

    #[test]
    fn a_hover_ends_where_the_drone_came_down() {
        let (flight, mut targets) = flown(|time_s| ((time_s - 130.0) * 5.0).clamp(0.0, 100.0));
        let flags = end_where_left(&flight, &mut targets);
        assert_eq!(targets[0].end_s, 130.0);
        assert_eq!(flags[0].reason, "it came down early: no values from 130 to 300 s");
        assert_eq!((flags[0].start_s, flags[0].end_s), (130.0, 300.0));
    }

    #[test]
    fn a_hover_that_was_held_or_left_at_once_stands() {
        let shaken = |time_s: f64| if (80.0..90.0).contains(&time_s) { 5.0 } else { 0.1 };
        let fallen = |time_s: f64| time_s.min(50.0);
        for below_m in [&shaken as &dyn Fn(f64) -> f64, &fallen] {
            let (flight, mut targets) = flown(below_m);
            assert_eq!(end_where_left(&flight, &mut targets), []);
            assert_eq!(targets[0].end_s, 300.0);
        }
    }
}
