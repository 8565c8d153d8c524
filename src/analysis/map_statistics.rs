//! The statistics of a flight's map: what its logs showed, as the input of the pure functions.

use super::beside::Beside;
use super::result::{Fit, Laws, UpdraftMap};
use super::running::RUNNING_S;
use super::statistics::averaging::{Seconds, averaging};
use super::statistics::baseline::baseline;
use super::statistics::result::{FieldStatistics, TiltWind};
use super::statistics::tilt_wind::{LeanDrag, MeanLean, tilt_wind};
use super::statistics::{FieldInput, StatisticsOptions, field_statistics};
use super::turbulence::Records;
use super::updraft;
use super::windows::{Corrected, Target};
use crate::flight::{Flight, Series};
use crate::numeric::mean;

/// Fewest samples in a second.
const FEWEST_PER_SECOND: usize = 3;
/// No hover is longer, whatever times a damaged log claims, s.
const LONGEST_S: usize = 200_000;

/// What a log showed of its hover, besides the running means of the map.
#[derive(Clone, Debug, Default)]
pub(super) struct HoverSeen {
    /// Show time of the first second, s.
    start_s: f64,
    /// Means over each second of the tilt-corrected pulse, us, and of the vertical velocity, m/s.
    seconds: Vec<Option<(f64, f64)>>,
    /// Tangents of the mean lean forward and to the right.
    forward_right: [f64; 2],
    /// Mean heading, degrees clockwise from north.
    heading_deg: Option<f64>,
    /// What its log tells beside the vertical air speed.
    pub(super) beside: Beside,
    /// Its air in fractions of seconds; absent: its log does not tell.
    pub(super) records: Option<Records>,
}

impl HoverSeen {
    /// Of the longest hover.
    pub(super) fn of(flight: &Flight, corrected: &Corrected, targets: &[Target]) -> Self {
        let Some(hover) = updraft::hover(targets) else { return Self::default() };
        let length = (hover.end_s - hover.start_s).floor().max(0.0) as usize;
        let seconds = (0..length.min(LONGEST_S))
            .map(|second| {
                let from = hover.start_s + second as f64;
                let over = |series: &Series| {
                    let values = series.between(from, from + 1.0);
                    mean(values).filter(|_| values.len() >= FEWEST_PER_SECOND)
                };
                over(&corrected.effort).zip(over(&flight.velocity_up_mps))
            })
            .collect();
        Self {
            start_s: hover.start_s,
            seconds,
            forward_right: forward_right(flight, hover),
            heading_deg: heading_deg(flight, hover),
            beside: Beside::default(),
            records: None,
        }
    }

    /// Vertical air speeds of single seconds by one slope of the pulse, m/s, but for a constant. With `corrected` they move
    /// as the map's values do over running means: what wind that comes and goes does to a leaning drone is no air.
    fn values_mps(
        &self,
        slope_us_per_mps: f64,
        time_s: &[f64],
        mapped_mps: &[Option<f64>],
        corrected: bool,
    ) -> Vec<Option<f64>> {
        let one = |(pulse_us, up_mps): (f64, f64)| up_mps - pulse_us / slope_us_per_mps;
        let mut values: Vec<Option<f64>> =
            self.seconds.iter().map(|second| second.map(one)).collect();
        let Some(first_s) = time_s.first().filter(|_| corrected) else { return values };
        let half = (RUNNING_S / 2.0) as usize;
        let apart = |second: usize| -> Option<f64> {
            let index = (self.start_s + second as f64 - first_s).round();
            let mapped = (*mapped_mps.get((index >= 0.0).then_some(index as usize)?)?)?;
            let around = values.get(second.checked_sub(half)?..second + half)?;
            Some(mapped - mean(around.iter().flatten())?)
        };
        let mut moved: Vec<Option<f64>> = (0..values.len()).map(apart).collect();
        // The first and the last seconds have no running mean: the nearest one's is theirs.
        if let Some(first) = moved.iter().position(Option::is_some) {
            let at = moved[first];
            moved[..first].fill(at);
        }
        if let Some(last) = moved.iter().rposition(Option::is_some) {
            let at = moved[last];
            moved[last..].fill(at);
        }
        for (value, moved) in values.iter_mut().zip(moved) {
            *value = value.zip(moved).map(|(value, moved)| value + moved);
        }
        values
    }
}

/// Tangents of the mean attitude: forward with the nose down, right with the right side down.
fn forward_right(flight: &Flight, hover: &Target) -> [f64; 2] {
    let over =
        |series: &Series| mean(series.between(hover.start_s, hover.end_s)).unwrap_or_default();
    let (roll, pitch) = (over(&flight.roll_rad), over(&flight.pitch_rad));
    MeanLean::forward_right_of(roll, pitch)
}

/// Mean heading, which jumps at north; `None` without headings.
fn heading_deg(flight: &Flight, hover: &Target) -> Option<f64> {
    let headings = flight.yaw_deg.between(hover.start_s, hover.end_s);
    let (mut north, mut east) = (0.0, 0.0);
    for heading in headings {
        let (sin, cos) = heading.to_radians().sin_cos();
        north += cos;
        east += sin;
    }
    let known = !headings.is_empty() && f64::hypot(north, east) > 0.0;
    known.then(|| f64::atan2(east, north).to_degrees().rem_euclid(360.0))
}

/// The wind by the leans of a map's drones, of which `seen` is in the same order.
pub(super) fn wind_of(
    map: &UpdraftMap,
    seen: &[HoverSeen],
    drag: LeanDrag<'_>,
) -> Option<TiltWind> {
    let drones = map.drones.iter().zip(seen);
    let leans: Vec<MeanLean> = drones
        .map(|(drone, seen)| MeanLean {
            slot: drone.slot,
            name: drone.name.clone(),
            lean_deg: drone.tilt_deg,
            forward_right: seen.forward_right,
            heading_deg: seen.heading_deg,
        })
        .collect();
    tilt_wind(&leans, drag)
}

/// Values of a map and of its logs from which its statistics are made.
pub(super) struct Observed {
    field: FieldInput,
    /// Single seconds of each drone; `None` without a law of the flock.
    seconds: Option<Vec<Seconds>>,
}

impl Observed {
    /// `seen` is in the order of the map's drones.
    pub(super) fn of(map: &UpdraftMap, seen: &[HoverSeen]) -> Self {
        let drones = || map.drones.iter();
        let levelled = map.levelled.as_ref().and_then(|levelled| levelled.drones.first());
        let slope = levelled
            .map(|drone| drone.slope)
            .or_else(|| map.flock.as_ref().and_then(slope_us_per_mps));
        let corrected = map.common.is_some() && map.wind.is_some();
        let seconds = |slope: f64| -> Vec<Seconds> {
            drones()
                .zip(seen)
                .map(|(drone, seen)| Seconds {
                    slot: drone.slot,
                    name: drone.name.clone(),
                    values_mps: seen.values_mps(slope, &map.time_s, &drone.updraft_mps, corrected),
                })
                .collect()
        };
        Self {
            field: FieldInput {
                places_m: drones().map(|one| one.position_m.unwrap_or([f64::NAN; 2])).collect(),
                values_mps: drones().map(|one| one.updraft_mps.clone()).collect(),
                running_s: RUNNING_S as usize,
            },
            seconds: slope.map(seconds),
        }
    }

    /// Statistics of the air.
    pub(super) fn statistics(
        &self,
        options: &StatisticsOptions,
        wind: Option<TiltWind>,
    ) -> FieldStatistics {
        let mut statistics = field_statistics(&self.field, options);
        match &self.seconds {
            Some(fleet) => {
                statistics.baseline = baseline(fleet);
                match averaging(fleet) {
                    Ok(found) => statistics.averaging = Some(found),
                    Err(reason) => statistics.absent.push(reason),
                }
            }
            None => statistics.absent.push(
                "no averaging times: there is no law of the flock to turn pulses into speeds"
                    .to_owned(),
            ),
        }
        statistics.wind = wind;
        statistics
    }
}

/// Pulse per speed of the flock: of its line, else of its signed square up to 1 m/s, as the slope of
/// the square itself is 0 in still air.
fn slope_us_per_mps(laws: &Laws) -> Option<f64> {
    let first = |fit: &Fit| Some(fit.parameters.first()?.estimate.value);
    let slope = laws
        .linear
        .as_ref()
        .and_then(first)
        .or_else(|| laws.signed_quadratic.as_ref().and_then(first))?;
    (slope.is_finite() && slope > 0.0).then_some(slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::plan::SegmentKind;

    fn mean_heading_deg(headings: &[f64]) -> Option<f64> {
        let time_s = (0..headings.len()).map(|second| second as f64).collect();
        let yaw_deg = Series { time_s, value: headings.to_vec() };
        let (kind, label) = (SegmentKind::Hover, String::new());
        let hover = Target { kind, label, start_s: 0.0, end_s: 10.0, commanded_mps: 0.0 };
        heading_deg(&Flight { yaw_deg, ..Flight::default() }, &hover)
    }

    #[test]
    fn what_wind_does_to_the_pulse_is_no_air_of_single_seconds() {
        // Gusts of the air that change every second, and a wind that comes and goes in a minute.
        let air = |second: usize| if second.is_multiple_of(2) { 0.3 } else { -0.3 };
        let wind = |second: f64| (second / 60.0 * std::f64::consts::TAU).sin();
        let (slope, start_s) = (20.0, 7.0);
        let seconds: Vec<Option<(f64, f64)>> = (0..120)
            .map(|second| Some((1500.0 - slope * (air(second) + wind(second as f64)), 0.0)))
            .collect();
        let seen = HoverSeen { start_s, seconds, ..HoverSeen::default() };
        let time_s: Vec<f64> = (12..122).map(f64::from).collect();
        // The map has neither the gusts, over ten seconds, nor the wind.
        let mapped = vec![Some(0.1); time_s.len()];
        let found = seen.values_mps(slope, &time_s, &mapped, true);
        assert_eq!(found.len(), 120);
        for (second, value) in found.iter().enumerate().take(110).skip(10) {
            let value = value.unwrap();
            assert!((value - 0.1 - air(second)).abs() < 0.07, "{second}: {value}");
        }
        assert!(found.iter().all(Option::is_some), "the ends have the nearest one's correction");
        let as_seen = seen.values_mps(slope, &time_s, &mapped, false);
        let level = -1500.0 / slope;
        assert!((as_seen[15].unwrap() - level - air(15) - wind(15.0)).abs() < 1e-9);
    }

    #[test]
    fn headings_on_both_sides_of_north_have_a_mean_between_them() {
        for (headings, expected) in
            [([350.0, 20.0], 5.0), ([340.0, 10.0], 355.0), ([80.0, 120.0], 100.0)]
        {
            let mean = mean_heading_deg(&headings).unwrap();
            assert!((mean - expected).abs() < 1e-9, "{headings:?}: {mean}");
        }
        assert_eq!(mean_heading_deg(&[]), None);
    }
}
