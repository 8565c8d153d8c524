//! Share of a plan that a flight flew.

use super::Flight;
use super::align::planned_up_mps;
use crate::mission::plan::Segment;

/// Samples that are compared.
const SAMPLES: u32 = 600;
/// A vertical velocity this near to the plan's is as planned, m/s.
const SAME_MPS: f64 = 0.4;
/// A height this near to the plan's is as planned, m: the autopilot holds its own height to less.
const SAME_M: f64 = 5.0;
/// A vehicle above this is in the air, m.
const ALOFT_M: f64 = 1.0;
/// The landing after the plan's end is no part of it, s.
const LANDING_S: f64 = 20.0;

/// The share of the plan's time in which the flight was at the plan's height with the plan's vertical
/// velocity, 0..1. Time in the air beyond the plan's end counts against it, so that a flight of a
/// longer plan does not fit a shorter one as well as its own.
pub fn share_flown(flight: &Flight, segments: &[Segment]) -> f64 {
    let Some(end) = segments.last() else { return 0.0 };
    let planned_s = end.end_ms as f64 / 1000.0;
    let aloft = flight.height_m.time_s.iter().zip(&flight.height_m.value);
    let landed_s =
        aloft.rev().find(|(_, height)| **height > ALOFT_M).map_or(0.0, |(time, _)| *time);
    let span_s = planned_s.max(landed_s - LANDING_S);
    if span_s.is_nan() || span_s <= 0.0 {
        return 0.0;
    }
    let told = flight.desired_up_mps.as_ref().unwrap_or(&flight.velocity_up_mps);
    let is_as_planned = |time_s: f64| {
        // Nothing is told to a vehicle that stands and waits.
        let up_mps = told.at(time_s, 1.0).unwrap_or(0.0);
        (up_mps - planned_up_mps(segments, time_s)).abs() < SAME_MPS
            && (flight.height_m.at(time_s, 1.0))
                .is_some_and(|height_m| (height_m - planned_m(segments, time_s)).abs() < SAME_M)
    };
    let times = (0..SAMPLES).map(|index| (f64::from(index) + 0.5) / f64::from(SAMPLES) * span_s);
    let count = times.filter(|time_s| *time_s < planned_s && is_as_planned(*time_s)).count();
    count as f64 / f64::from(SAMPLES)
}

/// Planned height above home at a show time, m.
fn planned_m(segments: &[Segment], time_s: f64) -> f64 {
    let time_ms = time_s * 1000.0;
    let index = segments.partition_point(|segment| segment.end_ms as f64 <= time_ms);
    let Some(segment) = segments.get(index) else {
        return segments.last().map_or(0.0, |last| last.to_m[2]);
    };
    let whole_s = segment.end_ms.saturating_sub(segment.start_ms) as f64 / 1000.0;
    let since_s = (time_ms - segment.start_ms as f64) / 1000.0;
    let mean_mps = match segment.from_velocity_mps {
        Some(from) => from[2] + (segment.velocity_mps[2] - from[2]) * since_s / whole_s / 2.0,
        None => segment.velocity_mps[2],
    };
    segment.from_m[2] + mean_mps * since_s
}
