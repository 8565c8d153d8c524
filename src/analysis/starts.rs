//! Detection of drones whose show began at another time than that of most: their logs are of
//! another flight of the same plan, however well they fit it.

use super::drone::One;
use crate::flight::Alignment;
use crate::numeric::upper_median;

/// Shows that began within this of each other are one flight, s. A start is told to the drones in
/// whole seconds, and clocks without a show's own rows are known to some tenths.
const APART_S: f64 = 5.0;

/// For each drone, how much later its show began than that of most drones, s; `None`: with them, or
/// its start is not known.
pub(super) fn apart(ones: &[One]) -> Vec<Option<f64>> {
    let starts_s: Vec<Option<f64>> = ones.iter().map(start_s).collect();
    later_than_most(&starts_s)
}

/// GPS time of show time 0 by a drone's own log, s.
fn start_s(one: &One) -> Option<f64> {
    let clock = &one.drone.clock;
    // Times from take-off say nothing about the show's start.
    let known = clock.start.filter(|_| clock.method != Alignment::Takeoff);
    known.map(|start| start.total_ms() as f64 / 1000.0)
}

fn later_than_most(starts_s: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut sorted: Vec<f64> = starts_s.iter().copied().flatten().collect();
    sorted.sort_by(f64::total_cmp);
    // The first start of the largest group; of groups of one size the later, which is the repeat.
    let group =
        |from: f64| sorted.iter().filter(|start| (from..=from + APART_S).contains(*start)).count();
    let Some(first) = sorted.iter().copied().max_by_key(|start| group(*start)) else {
        return vec![None; starts_s.len()];
    };
    let members =
        sorted.iter().copied().filter(|start| (first..=first + APART_S).contains(start)).collect();
    let middle = upper_median(members).unwrap_or(first);
    let later = |start: &Option<f64>| {
        start.map(|start| start - middle).filter(|later| later.abs() > APART_S)
    };
    starts_s.iter().map(later).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_drones_say_when_the_flight_was() {
        let of = |starts: &[Option<f64>]| later_than_most(starts);
        assert_eq!(of(&[]), []);
        assert_eq!(of(&[None, None]), [None, None]);
        assert_eq!(of(&[Some(7.0), None]), [None, None]);
        let hour = of(&[Some(100.0), Some(100.4), Some(3700.0), None, Some(101.0)]);
        assert_eq!(hour, [None, None, Some(3599.6), None, None]);
        // One and one: the later one is the repeat.
        assert_eq!(of(&[Some(0.0), Some(60.0)]), [Some(-60.0), None]);
    }
}
