//! Choice of the flight to analyse in a log that holds several: two boots in one file, or two
//! take-offs in one boot. The firmware continues the file when it is armed again.

use std::path::Path;

use super::align::planned_up_mps;
use super::identity::{Belongs, SAME_START_S, identify, later_s};
use super::load::{Held, Wanted, load as load_one, ordinal};
use super::{Alignment, Flight, FlightError, FlightOptions};
use crate::base::time::GpsTime;
use crate::log::Log;
use crate::mission::plan::Segment;

/// More candidates are not looked at: a log of a day of flying.
const MOST_CANDIDATES: usize = 64;
/// Samples of a plan that are compared with a flight.
const SAMPLES: u32 = 400;
/// A velocity difference counts at most this much, m/s.
const CLIP_MPS: f64 = 0.5;
/// A flight whose commands differ by less from the plan's, on the average, flew it, m/s.
const SAME_MPS: f64 = 0.1;

/// A vehicle is armed at most so long before or after its start, s.
const NEAR_S: f64 = 60.0;

/// Reads the flight of a log that is of the given start and flew the plan; without either, or where none
/// did, the last one that performed a show, else the last one.
pub(super) fn load(
    log: &Log,
    source: &Path,
    options: FlightOptions<'_>,
) -> Result<Flight, FlightError> {
    let mut held = Held::default();
    let usual = load_one(log, source, options, Wanted::default(), &mut held);
    let several = held.boots > 1 || held.flights > 1;
    let fits = match (&usual, options.segments) {
        (Ok(flight), Some(segments)) => difference_mps(flight, segments) < SAME_MPS,
        (Ok(_), None) => true,
        (Err(_), _) => false,
    };
    let away_s = |flight: &Flight| options.start.map_or(0.0, |start| away_s(flight, start));
    let is_of_start = usual.as_ref().is_ok_and(|flight| away_s(flight) == 0.0);
    if is_of_start && (fits || !several) {
        return usual;
    }
    if !several {
        return of_start_or_none(log, source, options, usual);
    }
    let mut best: Option<((f64, f64), Flight)> = None;
    let mut which = String::new();
    let mut looked_at = 0;
    for boot in 0..held.boots.max(1) {
        // How many flights a boot holds is known when its first one has been read.
        let mut flights = 1;
        let mut index = 0;
        while index < flights && looked_at < MOST_CANDIDATES {
            let wanted = Wanted { boot: Some(boot), flight: Some(index) };
            let mut here = Held::default();
            let found = load_one(log, source, options, wanted, &mut here);
            flights = here.flights;
            index += 1;
            looked_at += 1;
            let Ok(flight) = found else { continue };
            // Without a plan the later one counts.
            let off_mps =
                options.segments.map_or(0.0, |segments| difference_mps(&flight, segments));
            let off = (away_s(&flight), off_mps);
            if best.as_ref().is_none_or(|(lowest, _)| off <= *lowest) {
                which = if held.boots > 1 {
                    ordinal(boot, held.boots)
                } else {
                    ordinal(index - 1, flights)
                };
                best = Some((off, flight));
            }
        }
    }
    match (best, options.segments) {
        (Some(((away_s, _), mut flight)), _)
            if options.start.is_some() && !is_of_start && is_near(&flight, away_s) =>
        {
            let text = format!(
                "{}; the one that began at the flight's start is analysed: the {which}",
                of(held)
            );
            flight.warnings.push(text.into());
            Ok(flight)
        }
        (_, _) if options.start.is_some() && !is_of_start => {
            of_start_or_none(log, source, options, usual)
        }
        (Some(((_, off), mut flight)), Some(_)) if off < SAME_MPS => {
            let text = format!("{}; the one that flew the plan is analysed: the {which}", of(held));
            flight.warnings.push(text.into());
            Ok(flight)
        }
        (Some((_, mut flight)), _) if usual.is_err() => {
            let text = format!("{}; one that can be read is analysed: the {which}", of(held));
            flight.warnings.push(text.into());
            Ok(flight)
        }
        _ => usual,
    }
}

/// How far what was read is from a start, s; 0: it is of it, or the log does not say when it began.
fn away_s(flight: &Flight, start: GpsTime) -> f64 {
    let Some(began) = flight.clock.start else { return 0.0 };
    let apart_s = later_s(began, start).abs();
    if flight.clock.method == Alignment::Takeoff {
        // It is not known how long after its start it took off.
        return (apart_s - NEAR_S).max(0.0);
    }
    if apart_s > SAME_START_S {
        return apart_s;
    }
    // Its show time was made with this start: then it must have been armed about that time.
    let (from_s, to_s) = flight.effort.values.span().unwrap_or_default();
    (from_s - NEAR_S).max(-to_s).max(0.0)
}

/// Whether what was read can be of a start from which it is so far away: drones may wait for their turn.
fn is_near(flight: &Flight, away_s: f64) -> bool {
    away_s == 0.0 || flight.clock.method == Alignment::GpsTime
}

/// What was read is of another start than the one that is meant. That is said where the log knows of the
/// start: then the drone did not take off for it. Else the start may be wrong, as it always could.
fn of_start_or_none(
    log: &Log,
    source: &Path,
    options: FlightOptions<'_>,
    usual: Result<Flight, FlightError>,
) -> Result<Flight, FlightError> {
    let knows = || options.start.map(|start| identify(log).belongs_to(start)) == Some(Belongs::Yes);
    let is_near =
        |flight: &Flight| options.start.is_none_or(|start| is_near(flight, away_s(flight, start)));
    if usual.as_ref().is_ok_and(|flight| !is_near(flight)) && knows() {
        let reason = "the drone did not take off for this start".to_owned();
        return Err(FlightError::NoFlight { source_path: source.to_owned(), reason });
    }
    usual
}

/// What the log holds.
fn of(held: Held) -> String {
    if held.boots > 1 {
        format!("the log holds {} boots of the autopilot", held.boots)
    } else {
        format!("the log holds {} flights", held.flights)
    }
}

/// Mean difference between the vertical velocity that a flight was told (else had) and the plan's,
/// m/s. Where the log is silent it counts as standing still.
fn difference_mps(flight: &Flight, segments: &[Segment]) -> f64 {
    let told = flight.desired_up_mps.as_ref().unwrap_or(&flight.velocity_up_mps);
    let duration_s = segments.last().map_or(0.0, |segment| segment.end_ms as f64 / 1000.0);
    let sum: f64 = (0..SAMPLES)
        .map(|index| {
            let time_s = (f64::from(index) + 0.5) / f64::from(SAMPLES) * duration_s;
            let flown = told.at(time_s, 1.0).unwrap_or(0.0);
            (flown - planned_up_mps(segments, time_s)).abs().min(CLIP_MPS)
        })
        .sum();
    sum / f64::from(SAMPLES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Series;
    use crate::mission::plan::SegmentKind;

    #[test]
    fn the_difference_from_a_plan_is_a_mean_over_its_time() {
        let segment = |start_ms, end_ms, up_mps| Segment {
            kind: SegmentKind::Climb,
            label: String::new(),
            start_ms,
            end_ms,
            from_m: [0.0; 3],
            to_m: [0.0; 3],
            velocity_mps: [0.0, 0.0, up_mps],
            from_velocity_mps: None,
            window: None,
            calibrates_wind: false,
        };
        let plan = [segment(0, 20_000, 1.0), segment(20_000, 40_000, 0.2)];
        let difference = |up_mps: fn(f64) -> f64| {
            let time_s: Vec<f64> = (0..=400).map(|tick| f64::from(tick) / 10.0).collect();
            let value = time_s.iter().map(|time| up_mps(*time)).collect();
            let velocity_up_mps = Series { time_s, value };
            difference_mps(&Flight { velocity_up_mps, ..Flight::default() }, &plan)
        };
        assert!(difference(|time| if time < 20.0 { 1.0 } else { 0.2 }) < 0.01, "as planned");
        // 0.5 m/s at most for the first half, and 0.2 m/s for the second.
        let standing = difference(|_| 0.0);
        assert!((standing - 0.35).abs() < 1e-9, "{standing}");
    }
}
