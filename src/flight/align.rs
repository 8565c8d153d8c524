//! Conversion of board time to show time.

use super::channels::Messages;
use super::pick::PERFORMING;
use super::{Alignment, Clock, FlightOptions, Series, Warning};
use crate::base::time::GpsTime;
use crate::mission::plan::Segment;
use crate::numeric::{Line, Sorted, mean};

/// ClockMS of a SHOW row while no start time is set.
const NO_CLOCK_MS: f64 = -86_400_000.0;
/// Stage of the show's take-off.
const TAKEOFF: f64 = 3.0;
/// Coarse and fine step of the search for the plan's start, s.
const COARSE_S: f64 = 0.25;
const FINE_S: f64 = 0.01;
/// A velocity difference counts at most this much: a wrong or aborted part costs, but not all, m/s.
const CLIP_MPS: f64 = 0.5;
/// Error of an alignment by velocity alone: the firmware's answer to a step takes about this long, s.
const UNREFINED_S: f64 = 0.3;
/// A match must cost less than this share of not matching at all.
const MATCH_LIMIT: f64 = 0.5;

/// What alignment may look at, over board time, cut to the flight.
pub(super) struct Evidence<'a> {
    pub(super) messages: &'a Messages,
    pub(super) flight: (f64, f64),
    pub(super) desired_up: Option<&'a Series>,
    pub(super) velocity_up: &'a Series,
    pub(super) height: &'a Series,
}

/// Finds the board time of show time 0 by the best evidence there is.
pub(super) fn align(
    evidence: &Evidence<'_>,
    options: FlightOptions<'_>,
    warnings: &mut Vec<Warning>,
) -> Clock {
    let gps = gps_offset_s(evidence);
    let with_start = |mut clock: Clock| {
        clock.start = gps.and_then(|(offset, _)| {
            GpsTime::from_total_ms(((clock.offset_s + offset) * 1000.0).round() as i64)
        });
        clock
    };
    if let Some(clock) = show_rows(evidence) {
        return with_start(clock);
    }
    if let Some(start) = options.start {
        if let Some((offset, residual_s)) = gps {
            let offset_s = start.total_ms() as f64 / 1000.0 - offset;
            let (armed, end) = evidence.flight;
            if (armed - 600.0..=end).contains(&offset_s) {
                let method = Alignment::GpsTime;
                return Clock { method, offset_s, residual_s, start: Some(start) };
            }
            let text = format!(
                "the given start of the show ({start}) is {:.0} s away from this flight and is \
                 not used",
                offset_s - armed
            );
            warnings.push(text.into());
        } else {
            let text = "the log has no GPS time to place the start of the show by".to_owned();
            warnings.push(text.into());
        }
    }
    if let Some(segments) = options.segments {
        match match_plan(evidence, segments) {
            Some(clock) => return with_start(clock),
            None => warnings.push(
                "the log's vertical velocity does not match the plan anywhere: times count from \
                 take-off"
                    .to_owned()
                    .into(),
            ),
        }
    }
    let offset_s = takeoff_s(evidence);
    with_start(Clock { method: Alignment::Takeoff, offset_s, residual_s: 0.0, start: None })
}

/// SHOW rows of the flight: median of board time minus show clock.
fn show_rows(evidence: &Evidence<'_>) -> Option<Clock> {
    let rows = evidence.messages.rows("SHOW")?;
    let clock_ms = rows.column("ClockMS")?;
    let stage = rows.column("Stage")?;
    let (start, end) = evidence.flight;
    let offsets = |in_flight: bool| -> Vec<f64> {
        let in_flight_stages = TAKEOFF..=f64::from(PERFORMING);
        rows.time_s
            .iter()
            .zip(clock_ms)
            .zip(stage)
            .filter(|((time, ms), stage)| {
                (start..=end).contains(*time)
                    && ms.is_finite()
                    && **ms != NO_CLOCK_MS
                    && (!in_flight || in_flight_stages.contains(*stage))
            })
            .map(|((time, ms), _)| time - ms / 1000.0)
            .collect()
    };
    // The clock is set for good once the show flies; before, the start may still be moved.
    let flying = offsets(true);
    let mut chosen = if flying.len() >= 10 { flying } else { offsets(false) };
    let (offset_s, residual_s) = median_and_spread(&mut chosen)?;
    Some(Clock { method: Alignment::ShowRows, offset_s, residual_s, start: None })
}

/// GPS seconds minus board seconds, and the spread of it.
fn gps_offset_s(evidence: &Evidence<'_>) -> Option<(f64, f64)> {
    let (start, end) = evidence.flight;
    let mut offsets: Vec<f64> = evidence
        .messages
        .gps_ms()
        .into_iter()
        .filter(|(time, _)| (start..=end).contains(time))
        .map(|(time, ms)| ms / 1000.0 - time)
        .collect();
    median_and_spread(&mut offsets)
}

/// Median and half the distance between the 5 % and 95 % points.
fn median_and_spread(values: &mut [f64]) -> Option<(f64, f64)> {
    let sorted = Sorted::of(values);
    let (low, high) = (sorted.lower_quantile(0.05)?, sorted.lower_quantile(0.95)?);
    Some((sorted.median()?, (high - low) / 2.0))
}

/// Commanded vertical velocity of a plan at a show time, up positive, m/s.
pub(crate) fn planned_up_mps(segments: &[Segment], time_s: f64) -> f64 {
    let time_ms = time_s * 1000.0;
    let index = segments.partition_point(|segment| segment.end_ms as f64 <= time_ms);
    let Some(segment) = segments.get(index).filter(|s| s.start_ms as f64 <= time_ms) else {
        return 0.0;
    };
    let end = segment.velocity_mps[2];
    match segment.from_velocity_mps {
        Some(from) => {
            let duration = segment.end_ms.saturating_sub(segment.start_ms).max(1) as f64;
            let share = (time_ms - segment.start_ms as f64) / duration;
            from[2] + (end - from[2]) * share
        }
        None => end,
    }
}

/// Slides the plan's velocity profile along the log's: the sum of clipped differences is lowest at
/// the start of the show. Clipping keeps it robust against legs that were not flown as planned.
fn match_plan(evidence: &Evidence<'_>, segments: &[Segment]) -> Option<Clock> {
    let logged = evidence.desired_up.unwrap_or(evidence.velocity_up);
    let (first, last) = logged.span()?;
    let duration = segments.last()?.end_ms as f64 / 1000.0;
    let cost = |offset: f64, step: f64| {
        // Samples of the plan: where the log is silent it is compared with standing still, so
        // that sliding the plan off the log never pays.
        let count = (duration / step) as usize;
        (0..count)
            .map(|index| {
                let time = (index as f64 + 0.5) * step;
                let value = logged.at(offset + time, 1.0).unwrap_or(0.0);
                (value - planned_up_mps(segments, time)).abs().min(CLIP_MPS)
            })
            .sum::<f64>()
            * step
    };
    let best_of = |from: f64, to: f64, step: f64, sampling: f64| {
        let count = ((to - from) / step).ceil().max(0.0) as usize;
        (0..=count)
            .map(|index| from + index as f64 * step)
            .map(|offset| (cost(offset, sampling), offset))
            .min_by(|left, right| left.0.total_cmp(&right.0))
    };
    let earliest = (first - 30.0).max(evidence.flight.0 - 120.0);
    let latest = (last - duration / 2.0).max(earliest);
    // A log of hours would make the search long; shows do not last that long.
    if latest - earliest > 7200.0 || duration > 7200.0 {
        return None;
    }
    // A thousand samples tell where a plan lies; a step of it must not fall between them, though.
    let sampling = (duration / 1000.0).clamp(0.5, 5.0);
    let (_, coarse) = best_of(earliest, latest, COARSE_S, sampling)?;
    let (lowest, offset_s) =
        best_of(coarse - 2.0 * COARSE_S, coarse + 2.0 * COARSE_S, FINE_S, 0.1)?;
    // Standing still all the time is the null match.
    let null: f64 = (0..(duration / 0.1) as usize)
        .map(|index| planned_up_mps(segments, (index as f64 + 0.5) * 0.1).abs().min(CLIP_MPS) * 0.1)
        .sum();
    if !(null > 0.0 && lowest < MATCH_LIMIT * null) {
        return None;
    }
    let (offset_s, residual_s) =
        refine_by_height(evidence.height, segments, offset_s).unwrap_or((offset_s, UNREFINED_S));
    Some(Clock { method: Alignment::Plan, offset_s, residual_s, start: None })
}

/// Sharpens an alignment by heights in the analysis windows. The velocity answers a step of the plan
/// late, but in the windows the vehicle is back on its path: if the log runs `d` seconds late, its
/// height differs from the plan's by `constant - d v` in a window flown at `v`. Gives the better
/// offset and its standard error.
fn refine_by_height(height: &Series, segments: &[Segment], offset_s: f64) -> Option<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for segment in segments {
        let Some(window) = segment.window else { continue };
        if segment.from_velocity_mps.is_some() {
            continue;
        }
        let (start, end) = (window.start_ms as f64 / 1000.0, window.end_ms as f64 / 1000.0);
        let times = height.times_between(offset_s + start, offset_s + end);
        let logged = height.between(offset_s + start, offset_s + end);
        let planned = |time: f64| {
            let since = time - offset_s - segment.start_ms as f64 / 1000.0;
            segment.from_m[2] + segment.velocity_mps[2] * since
        };
        let above = times.iter().zip(logged).map(|(time, height)| height - planned(*time));
        if let Some(above) = mean(above).filter(|_| times.len() >= 5) {
            points.push((segment.velocity_mps[2], above));
        }
    }
    let n = points.len() as f64;
    // A sum of shares, not the share of a sum: stored results have its last digit.
    let centre = points.iter().fold([0.0; 2], |m, (v, d)| [m[0] + v / n, m[1] + d / n]);
    let line = Line::about(centre, points.iter().map(|(v, d)| (*v, *d, 1.0)));
    if points.len() < 4 || line.xx < 0.1 {
        return None;
    }
    let slope = line.slope();
    let squares: f64 = points.iter().map(|point| line.residual(*point).powi(2)).sum();
    let error = (squares / (n - 2.0) / line.xx).sqrt();
    // A large or uncertain shift means that the heights are not those of the plan.
    (slope.abs() < 1.0 && error < UNREFINED_S).then_some((offset_s - slope, error.max(FINE_S)))
}

/// Board time of take-off: the last one before the vehicle is half a metre above where it was armed
/// at which it was still within 5 cm; the arming when it never climbs.
fn takeoff_s(evidence: &Evidence<'_>) -> f64 {
    let (start, end) = evidence.flight;
    let heights = evidence.height.between(start, end);
    let times = evidence.height.times_between(start, end);
    let Some(ground) = heights.first() else { return start };
    let Some(up) = heights.iter().position(|height| height - ground > 0.5) else { return start };
    let low = |height: &f64| height - ground < 0.05;
    let still = heights.get(..up).and_then(|before| before.iter().rposition(low));
    still.and_then(|index| times.get(index).copied()).unwrap_or(start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::catalog::GPS;
    use crate::log::{Log, LogWriter, Value};
    use crate::mission::plan::{SegmentKind, Window};

    /// GPS rows five a second over board time, s, with the time that they tell, ms since the GPS epoch.
    fn gps_rows(gps_ms: impl Fn(f64) -> i64) -> Messages {
        let mut log = LogWriter::new(Vec::new(), &[&GPS]).unwrap();
        for row in 0..2000 {
            let time = GpsTime::from_total_ms(gps_ms(0.2 * f64::from(row))).unwrap();
            let (tow_ms, week) = (i64::from(time.tow_ms), i64::from(time.week));
            let ints = [i64::from(200_000 * row), 0, 3, tow_ms, week, 20, 0, 0, 0];
            let mut values: Vec<Value<'_>> = ints.into_iter().map(Value::Int).collect();
            values.extend([Value::Float(0.0); 5]);
            values.push(Value::Int(1));
            log.row(&GPS, &values).unwrap();
        }
        Messages::read(&Log::from_bytes(log.finish().unwrap()))
    }

    fn found(
        messages: &Messages,
        velocity_up: &Series,
        height: &Series,
        options: FlightOptions<'_>,
    ) -> (Clock, usize) {
        let flight = (100.0, 300.0);
        let evidence = Evidence { messages, flight, desired_up: None, velocity_up, height };
        let mut warnings = Vec::new();
        (align(&evidence, options, &mut warnings), warnings.len())
    }

    #[test]
    fn gps_time_of_the_flight_places_a_start_on_the_board() {
        let on_ms = 1_450_000_000_000;
        let start = GpsTime::from_total_ms(on_ms + 110_000);
        // The board wanders by a tenth of a second to each side; before the flight it had no time yet.
        let messages = gps_rows(|time_s| {
            let off_ms = if time_s < 90.0 { -7_000_000.0 } else { (time_s / 20.0).sin() * 100.0 };
            on_ms + (1000.0 * time_s + off_ms).round() as i64
        });
        let options = FlightOptions { start, ..FlightOptions::default() };
        let (clock, warnings) = found(&messages, &Series::default(), &Series::default(), options);
        assert_eq!((clock.method, clock.start, warnings), (Alignment::GpsTime, start, 0));
        assert!((clock.offset_s - 110.0).abs() < 0.1, "{clock:?}");
        assert!((0.05..0.11).contains(&clock.residual_s), "{clock:?}");
    }

    /// Legs of 20 s at these speeds, m/s, from 20 m on, each with a window.
    fn legs(speeds_mps: &[f64]) -> Vec<Segment> {
        let mut height_m = 20.0;
        let leg = |(start_ms, up_mps): (u64, &f64)| {
            let from_m = [0.0, 0.0, height_m];
            height_m += 20.0 * up_mps;
            Segment {
                kind: SegmentKind::Climb,
                label: String::new(),
                start_ms,
                end_ms: start_ms + 20_000,
                from_m,
                to_m: [0.0, 0.0, height_m],
                velocity_mps: [0.0, 0.0, *up_mps],
                from_velocity_mps: None,
                window: Some(Window { start_ms: start_ms + 10_000, end_ms: start_ms + 19_000 }),
                calibrates_wind: false,
            }
        };
        (0..).step_by(20_000).zip(speeds_mps).map(leg).collect()
    }

    /// A channel over the flight at 10 Hz.
    fn channel(value: impl Fn(f64) -> f64) -> Series {
        let time_s: Vec<f64> = (1000..3000).map(|tick| f64::from(tick) / 10.0).collect();
        let value = time_s.iter().map(|time| value(*time)).collect();
        Series { time_s, value }
    }

    /// The clock by a plan whose first seconds alone were flown, from 130 s on by the board's clock.
    fn flown_until(end_s: f64) -> (Clock, usize) {
        let segments = legs(&[1.0, 0.0, -1.0]);
        let velocity_up = channel(|time_s| {
            let show_s = time_s - 130.0;
            if show_s < end_s { planned_up_mps(&segments, show_s) } else { 0.0 }
        });
        let options = FlightOptions { segments: Some(&segments), ..FlightOptions::default() };
        found(&Messages::default(), &velocity_up, &Series::default(), options)
    }

    #[test]
    fn a_plan_is_matched_if_more_than_half_of_it_was_flown() {
        for end_s in [60.0, 45.0] {
            let (clock, warnings) = flown_until(end_s);
            assert_eq!((clock.method, warnings), (Alignment::Plan, 0), "flown until {end_s} s");
            assert!((clock.offset_s - 130.0).abs() < 0.2, "{clock:?}");
        }
        for end_s in [15.0, 0.0] {
            let (clock, warnings) = flown_until(end_s);
            assert_eq!((clock.method, warnings), (Alignment::Takeoff, 1), "flown until {end_s} s");
        }
    }

    #[test]
    fn heights_sharpen_what_velocities_tell_late() {
        let segments = legs(&[1.0, -1.0, 2.0, -2.0, 0.5, -0.5]);
        let velocity_up = channel(|time_s| planned_up_mps(&segments, time_s - 130.4));
        let height = channel(|time_s| {
            let show_s = time_s - 130.0;
            let leg = segments.iter().rev().find(|leg| leg.start_ms as f64 <= 1000.0 * show_s);
            leg.map_or(20.0, |leg| {
                leg.from_m[2] + leg.velocity_mps[2] * (show_s - leg.start_ms as f64 / 1000.0)
            })
        });
        let options = FlightOptions { segments: Some(&segments), ..FlightOptions::default() };
        let (clock, _) = found(&Messages::default(), &velocity_up, &height, options);
        assert_eq!(clock.method, Alignment::Plan);
        assert!((clock.offset_s - 130.0).abs() < 0.02, "{clock:?}");
        assert!(clock.residual_s < 0.05, "{clock:?}");
    }
}
