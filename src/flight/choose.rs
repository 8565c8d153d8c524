//! Which flight of a log is analysed, where it holds several: two boots in one file, or two take-offs
//! in one boot.

use std::path::Path;

use super::align::planned_up_mps;
use super::load::{Held, Wanted, load as load_one, ordinal};
use super::{Flight, FlightError, FlightOptions};
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

/// Reads the flight of a log that flew the plan; without a plan, or where none did, the last one that
/// performed a show, else the last one.
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
    if fits || !several {
        return usual;
    }
    let mut best: Option<(f64, Flight)> = None;
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
            let off = options.segments.map_or(0.0, |segments| difference_mps(&flight, segments));
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
        (Some((off, mut flight)), Some(_)) if off < SAME_MPS => {
            flight
                .warnings
                .push(format!("{}; the one that flew the plan is analysed: the {which}", of(held)));
            Ok(flight)
        }
        (Some((_, mut flight)), _) if usual.is_err() => {
            flight
                .warnings
                .push(format!("{}; one that can be read is analysed: the {which}", of(held)));
            Ok(flight)
        }
        _ => usual,
    }
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
