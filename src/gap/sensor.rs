//! The sensor channel: vertical velocity V_U against the rate of change of the height, before any
//! look at the pulse.

use super::data::Flown;
use super::verdict::{Interval, SensorChannel};
use crate::flight::{Flight, Series};
use crate::mission::plan::Segment;
use crate::numeric::Moments;

/// A bias beyond this is named, m/s: 1.3 us on the show drone, half of what is material in the pulse, and
/// more than RTK receivers have (0.02 m/s). Chosen.
const NAMED_BIAS_MPS: f64 = 0.05;
/// A lag beyond this is named, s: half of the 0.2 s that cost 5 us at 1 m/s² (docs/physics.md, 2.4). Chosen.
const NAMED_LAG_S: f64 = 0.1;
/// A drone's own bias beyond this is reported, m/s: what barometers have. Chosen.
const TOLD_BIAS_MPS: f64 = 0.1;
/// Steady stretches shorter than this determine no rate, s. Chosen.
const SHORTEST_S: f64 = 6.0;
/// A silence longer than this breaks a stretch, s. As in the analysis; chosen.
const GAP_S: f64 = 1.0;
/// Standard error that all drones' biases have in common besides, m/s: heights and velocities come from one
/// filter. Simulated flights showed a millimetre per second.
const BIAS_DOUBT_MPS: f64 = 0.001;
/// The common standard error of lags, s: logs at 10 to 25 Hz, and delays of the filter. Chosen.
const LAG_DOUBT_S: f64 = 0.002;
/// Besides, as a share of the lag: a filter is fitted, and what is late may be a delay, in a loop of its own. In foreign
/// worlds with delays of 0.12 to 0.35 s those of 13 flights were off by 2 % (rms; docs/blind.md).
const LAG_DOUBT_SHARE: f64 = 0.02;
/// Lags that are tried, from 0 to 1 s, the range that the effect may have.
const LAGS: usize = 51;
/// Step between lags, s; a parabola goes through the best three.
const LAG_STEP_S: f64 = 0.02;
/// Step of the comparison, s: half a row of a log at 10 Hz.
const STEP_S: f64 = 0.05;

/// What the velocities of a fleet say. `segments` gives what a slot flew.
pub(super) fn sensor<'a>(
    flown: &[Flown<'_>],
    segments: impl Fn(u16) -> Option<&'a [Segment]>,
) -> SensorChannel {
    let mut biases = Vec::new();
    let mut lags = Vec::new();
    for one in flown {
        let Some(segments) = segments(one.slot) else { continue };
        if let Some(bias) = bias(one.flight, segments) {
            biases.push((one.slot, bias));
        }
        lags.extend(lag(one.flight, segments));
    }
    let values: Vec<f64> = biases.iter().map(|(_, bias)| *bias).collect();
    let bias_mps = interval(&values, BIAS_DOUBT_MPS);
    let lag_s = interval(&lags, lag_doubt_s(&lags));
    let beyond = |found: Option<Interval>, limit: f64| {
        found
            .is_some_and(|found| found.value.abs() > limit && (found.low > 0.0 || found.high < 0.0))
    };
    let named = beyond(bias_mps, NAMED_BIAS_MPS) || beyond(lag_s, NAMED_LAG_S);
    let centre = bias_mps.map_or(0.0, |bias| bias.value);
    let biased_drones =
        biases.iter().filter(|(_, bias)| (bias - centre).abs() > TOLD_BIAS_MPS).copied().collect();
    SensorChannel { bias_mps, lag_s, biased_drones, named, in_log: false }
}

/// The standard error that all lags share, s.
fn lag_doubt_s(lags_s: &[f64]) -> f64 {
    let mean_s = crate::numeric::mean(lags_s.iter().copied()).unwrap_or(0.0);
    LAG_DOUBT_S.hypot(LAG_DOUBT_SHARE * mean_s)
}

/// Mean with the interval that the drones' scatter and a doubt they share give.
fn interval(values: &[f64], doubt: f64) -> Option<Interval> {
    let moments = Moments::of(values)?;
    let (mean, se) = (moments.mean, moments.standard_error().filter(|se| se.is_finite()));
    // One drone has no scatter: what a filter's velocity is usually off by.
    let se = se.map_or(0.02, |se| se.hypot(doubt));
    Some(Interval { value: mean, low: mean - 2.1 * se, high: mean + 2.1 * se })
}

/// Mean of V_U less the rise of the height over all steady stretches, m/s.
fn bias(flight: &Flight, segments: &[Segment]) -> Option<f64> {
    let (mut moved_m, mut rose_m, mut lasted_s) = (0.0, 0.0, 0.0);
    for segment in segments {
        let start_s = segment.start_ms as f64 / 1000.0 + 2.0;
        let end_s = segment.end_ms as f64 / 1000.0 - 0.2;
        let flies = segment.kind.is_leg() || segment.kind.is_hover();
        if !flies || end_s - start_s < SHORTEST_S {
            continue;
        }
        let (Some(from_m), Some(to_m)) =
            (flight.height_m.at(start_s, GAP_S), flight.height_m.at(end_s, GAP_S))
        else {
            continue;
        };
        let Some(integral_m) = integral(&flight.velocity_up_mps, start_s, end_s) else { continue };
        moved_m += integral_m;
        rose_m += to_m - from_m;
        lasted_s += end_s - start_s;
    }
    (lasted_s > 4.0 * SHORTEST_S).then(|| (moved_m - rose_m) / lasted_s)
}

/// Integral of a series by trapezoids; `None` with gaps.
fn integral(series: &Series, start_s: f64, end_s: f64) -> Option<f64> {
    if series.longest_gap_s(start_s, end_s) > GAP_S {
        return None;
    }
    let mut points = vec![(start_s, series.at(start_s, GAP_S)?)];
    let times = series.times_between(start_s, end_s);
    points.extend(times.iter().copied().zip(series.between(start_s, end_s).iter().copied()));
    points.push((end_s, series.at(end_s, GAP_S)?));
    let area = |pair: &[(f64, f64)]| (pair[1].0 - pair[0].0) * f64::midpoint(pair[0].1, pair[1].1);
    Some(points.windows(2).map(area).sum())
}

/// The time constant of the first-order filter that makes V_U of the rate of the height where the
/// command changes, s.
fn lag(flight: &Flight, segments: &[Segment]) -> Option<f64> {
    let changes: Vec<f64> = segments
        .windows(2)
        .filter(|pair| (pair[1].velocity_mps[2] - pair[0].velocity_mps[2]).abs() > 0.8)
        .map(|pair| pair[1].start_ms as f64 / 1000.0)
        .filter(|time_s| *time_s > 2.0)
        .collect();
    if changes.len() < 4 {
        return None;
    }
    let tracks: Vec<(Vec<f64>, Vec<f64>)> =
        changes.iter().filter_map(|change| track(flight, *change)).collect();
    if tracks.len() < 4 {
        return None;
    }
    let misfit = |lag_s: f64| {
        let share = STEP_S / (STEP_S + lag_s);
        let mut sum = 0.0;
        for (rates, velocities) in &tracks {
            let mut filtered = rates.first().copied().unwrap_or(0.0);
            for (index, (rate, velocity)) in rates.iter().zip(velocities).enumerate() {
                filtered += share * (rate - filtered);
                // The first second only brings the filter to its state.
                if index > 20 {
                    sum += (velocity - filtered).powi(2);
                }
            }
        }
        sum
    };
    let tried: Vec<f64> = (0..LAGS).map(|index| index as f64 * LAG_STEP_S).collect();
    let misfits: Vec<f64> = tried.iter().map(|lag| misfit(*lag)).collect();
    let best = (0..misfits.len()).min_by(|a, b| misfits[*a].total_cmp(&misfits[*b]))?;
    if best == 0 || best + 1 == misfits.len() {
        return Some(tried[best]);
    }
    // The bottom of the parabola through three points.
    let (left, middle, right) = (misfits[best - 1], misfits[best], misfits[best + 1]);
    let bend = left - 2.0 * middle + right;
    let by = if bend > 0.0 { 0.5 * (left - right) / bend } else { 0.0 };
    Some(tried[best] + by.clamp(-1.0, 1.0) * LAG_STEP_S)
}

/// Rate of the height and V_U around a change of the command, 20 a second, both averaged over the
/// same fifth of a second.
fn track(flight: &Flight, change_s: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let half_s = 0.1;
    let times = (0..140).map(|step| change_s - 2.0 + f64::from(step) * STEP_S);
    let mut rates = Vec::new();
    let mut velocities = Vec::new();
    for time_s in times {
        let height = |at| flight.height_m.at(at, GAP_S);
        let velocity = |at| flight.velocity_up_mps.at(at, GAP_S);
        rates.push((height(time_s + half_s)? - height(time_s - half_s)?) / (2.0 * half_s));
        let ends = velocity(time_s - half_s)? + velocity(time_s + half_s)?;
        velocities.push(0.25 * ends + 0.5 * velocity(time_s)?);
    }
    Some((rates, velocities))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::plan::SegmentKind;

    /// Up and down for ten seconds each, by a drone whose velocity lags behind its height by so much, s.
    fn lag_found_s(lag_s: f64) -> Option<f64> {
        let up_mps = |leg: u64| if leg.is_multiple_of(2) { 1.0 } else { -1.0 };
        let segment = |leg: u64| Segment {
            kind: SegmentKind::LegUp,
            label: String::new(),
            start_ms: 10_000 * leg,
            end_ms: 10_000 * (leg + 1),
            from_m: [0.0; 3],
            to_m: [0.0; 3],
            velocity_mps: [0.0, 0.0, up_mps(leg)],
            from_velocity_mps: None,
            window: None,
            calibrates_wind: false,
        };
        let segments: Vec<Segment> = (0..8).map(segment).collect();
        let mut flight = Flight::default();
        let (mut height_m, mut rate_mps, mut velocity_mps) = (50.0, 0.0, 0.0);
        for tick in 0..8000_u64 {
            let time_s = tick as f64 / 100.0;
            rate_mps += 0.01 / 0.4 * (up_mps(tick / 1000) - rate_mps);
            height_m += 0.01 * rate_mps;
            velocity_mps += 0.01 / (0.01 + lag_s) * (rate_mps - velocity_mps);
            for (series, value) in
                [(&mut flight.height_m, height_m), (&mut flight.velocity_up_mps, velocity_mps)]
            {
                series.time_s.push(time_s);
                series.value.push(value);
            }
        }
        lag(&flight, &segments)
    }

    #[test]
    fn a_long_lag_is_known_less_well_than_a_short_one() {
        let half_s = |lag_s: f64| {
            let lags = [lag_s - 1e-6, lag_s, lag_s + 1e-6];
            let of = interval(&lags, lag_doubt_s(&lags)).unwrap();
            0.5 * (of.high - of.low)
        };
        assert!((half_s(0.0) - 0.0042).abs() < 1e-4, "{}", half_s(0.0));
        assert!((half_s(0.35) - 0.0153).abs() < 1e-4, "{}", half_s(0.35));
    }

    #[test]
    fn the_lag_of_a_velocity_behind_its_height_is_found() {
        for lag_s in [0.1, 0.3, 0.6] {
            let found_s = lag_found_s(lag_s).unwrap();
            assert!((found_s - lag_s).abs() < 0.03, "{found_s} instead of {lag_s} s");
        }
    }
}
