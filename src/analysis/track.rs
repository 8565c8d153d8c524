//! Measurement along a track: a drone that moves at constant speed, along the ground or up and down, or that
//! hovers at several heights one after the other, measures the air along its way.
//!
//! Of vertical legs, the law itself takes out the climb (eq. 6: the air's speed is the drone's less that relative to
//! the air): what was calibrated is the answer to both.
//!
//! In the frame of the air, flying at 4 m/s through still air and standing in a wind of 4 m/s are the
//! same: what drag and translational lift do to the pulse follows from the lean in both, and the
//! corrections for a hover in wind ([`super::corrections`]) hold for a leg, once what rising air does to its lean is
//! taken away ([`super::track_lean`]). What differs besides is that a mean over 10 s is one over 10 s of the way, and
//! that a change of speed leans a drone too: seconds with one have no value.

use nalgebra::Vector3;

use super::budget::{Quality, QualityFlag};
use super::cause::Cause;
use super::hover::Hover;
use super::measured::Measured;
use super::running::RUNNING_S;
use super::stats::mean_sd;
use super::updraft::{self, DroneSeries};
use super::windows::{Target, WindowOptions};
use crate::base::estimate::Estimate;
use crate::base::frame::ShowFrame;
use crate::flight::{Flight, Series};
use crate::mission::plan::{Segment, SegmentKind};

/// A horizontal velocity that differs by more between the halves of a running window is not constant,
/// m/s: it would need a mean acceleration of 0.1 m/s², which leans a drone by 0.6 degrees.
const STEADY_MPS: f64 = 0.5;
/// Positions are not joined over longer silences than this, s. Chosen.
const GAP_S: f64 = 1.0;
/// A log that moved by less than this share of a leg, or by more than its inverse, flew another plan.
/// Chosen.
const LEAST_SHARE: f64 = 0.5;
/// Hovers whose heights are further apart than this make a column, m: a drone holds its height far better. Chosen.
const SEVERAL_M: f64 = 3.0;
/// Shorter legs say nothing about that, m.
const SHORTEST_LEG_M: f64 = 10.0;

/// Where a measurement looks: its longest hover; and if it has horizontal legs, all of them and every
/// hover that is long enough for a value. Vertical legs that last longer than the
/// hovers make a profile: all of both are looked at. So are hovers at several heights (`height_m`), which make a column.
pub(super) fn measuring(
    targets: &[Target],
    height_m: impl Fn(&Target) -> Option<f64>,
) -> Vec<&Target> {
    let long = |target: &&Target| target.end_s - target.start_s >= RUNNING_S;
    let horizontal = |target: &Target| target.kind == SegmentKind::Horizontal;
    let hover = |target: &Target| target.kind.is_hover();
    let any = |is: &dyn Fn(&Target) -> bool| targets.iter().any(|one| is(one) && long(&one));
    let all = |is: &dyn Fn(&Target) -> bool| -> Vec<&Target> {
        targets.iter().filter(|target| is(target) && long(target)).collect()
    };
    if any(&horizontal) {
        return all(&|target| horizontal(target) || hover(target));
    }
    if any(&|target| target.kind.is_leg()) && is_profile(targets) {
        return all(&|target| target.kind.is_leg() || hover(target));
    }
    let longest = updraft::hover(targets);
    let heights: Vec<f64> = all(&hover).into_iter().filter_map(height_m).collect();
    let apart_m = crate::numeric::extent(heights).map_or(0.0, |(low, high)| high - low);
    if apart_m >= SEVERAL_M {
        return all(&hover);
    }
    longest.into_iter().collect()
}

/// Whether vertical legs are a profile, and not a ladder beside a hover: they last longer than the hovers.
fn is_profile(targets: &[Target]) -> bool {
    let lasting = |is: fn(SegmentKind) -> bool| -> f64 {
        let of = targets.iter().filter(|target| is(target.kind));
        of.map(|target| target.end_s - target.start_s).sum()
    };
    lasting(SegmentKind::is_leg) > lasting(SegmentKind::is_hover)
}

/// Height above home in the middle of a target, m.
pub(super) fn height_m(flight: &Flight, target: &Target) -> Option<f64> {
    flight.height_m.at(f64::midpoint(target.start_s, target.end_s), GAP_S)
}

/// Whether what is looked at is more than one hover: then values have a place each.
pub(super) fn is_track(looked: &[&Target]) -> bool {
    looked.len() > 1 || looked.iter().any(|target| !target.kind.is_hover())
}

/// Looks at all legs and hovers of a scan, as at one long hover with nothing between them.
pub(super) fn look(flight: &Flight, looked: &[&Target], options: &WindowOptions) -> Hover {
    let mut all = Hover::default();
    all.moves = true;
    let mut biases = Vec::new();
    for target in looked {
        let mut part = Hover::of(flight, target, options);
        if !target.kind.is_hover() {
            drop_unsteady(flight, &mut part);
        }
        biases.push(part.velocity_bias_mps);
        all.join(part);
    }
    all.velocity_bias_mps = mean_sd(&biases).0;
    all
}

/// Takes the values from the seconds around which the horizontal speed was not constant.
fn drop_unsteady(flight: &Flight, leg: &mut Hover) {
    let quarter = RUNNING_S / 4.0;
    let velocity = |time_s: f64| {
        let speed = |series: &Series| {
            let (from, to) = (time_s - quarter, time_s + quarter);
            Some((series.at(to, GAP_S)? - series.at(from, GAP_S)?) / (2.0 * quarter))
        };
        Some((speed(&flight.north_m)?, speed(&flight.east_m)?))
    };
    let mut lost: Vec<f64> = Vec::new();
    for second in &mut leg.seconds {
        let Some(time_s) = second.map(|second| second.time_s) else { continue };
        let halves = velocity(time_s - quarter).zip(velocity(time_s + quarter));
        // Without positions nothing is known against it.
        let change = halves
            .map_or(0.0, |(before, after)| f64::hypot(after.0 - before.0, after.1 - before.1));
        if change > STEADY_MPS {
            lost.push(time_s);
            *second = None;
        }
    }
    if let (Some(start_s), Some(end_s)) = (lost.first(), lost.last()) {
        leg.quality.push(QualityFlag {
            flag: Quality::Manoeuvre,
            start_s: *start_s,
            end_s: *end_s,
            reason: format!(
                "its horizontal speed changed: {} s from {start_s:.0} to {end_s:.0} s without values",
                lost.len()
            ),
        });
    }
}

/// A scan's values with their errors and places.
pub(super) fn series(
    flight: &Flight,
    looked: &Hover,
    measured: Measured,
    systematic_mps: f64,
) -> DroneSeries {
    let good = || looked.seconds.iter().flatten();
    let mean = |values: Vec<f64>| mean_sd(&values).0;
    let moved_m = (0..looked.seconds.len())
        .map(|index| moved_neu_m(flight, (looked.first_s + index as i64) as f64))
        .collect();
    DroneSeries {
        first_s: measured.first_s,
        updraft_mps: measured.updraft_mps.clone(),
        mean: Estimate::new(measured.mean_mps, measured.errors.total_mps),
        systematic_mps,
        // The mean attitude of legs there and back would be level.
        tilt_deg: mean(good().map(|second| second.lean_deg).collect()),
        height_m: mean(good().map(|second| second.height_m).collect()),
        measured: Some(measured),
        moved_m,
        levelled: None,
    }
}

/// How far the drone is from where it stood at the beginning of its log, m north and east, and its
/// height above home; `None` where the log does not say.
fn moved_neu_m(flight: &Flight, time_s: f64) -> Option<[f64; 3]> {
    let moved = |series: &Series| Some(series.at(time_s, GAP_S)? - series.value.first()?);
    Some([moved(&flight.north_m)?, moved(&flight.east_m)?, flight.height_m.at(time_s, GAP_S)?])
}

/// Such a place in the show frame, for a drone whose home is known.
pub(super) fn place_m(frame: &ShowFrame, home_m: [f64; 2], moved: [f64; 3]) -> [f64; 3] {
    let show = frame.from_neu(Vector3::new(moved[0], moved[1], moved[2]));
    [home_m[0] + show.x, home_m[1] + show.y, moved[2]]
}

/// That a log did not fly the plan's horizontal legs: how far it moved instead.
pub(super) fn contradiction(flight: &Flight, segments: &[Segment]) -> Option<Cause> {
    let way = |segment: &Segment| {
        let (from, to) = (segment.start_ms as f64 / 1000.0, segment.end_ms as f64 / 1000.0);
        let moved = |series: &Series| Some(series.at(to, GAP_S)? - series.at(from, GAP_S)?);
        Some(f64::hypot(moved(&flight.north_m)?, moved(&flight.east_m)?))
    };
    let planned = |segment: &Segment| {
        f64::hypot(segment.to_m[0] - segment.from_m[0], segment.to_m[1] - segment.from_m[1])
    };
    let legs: Vec<(&Segment, f64)> = segments
        .iter()
        .filter(|segment| {
            segment.kind == SegmentKind::Horizontal && planned(segment) >= SHORTEST_LEG_M
        })
        .filter_map(|segment| Some((segment, way(segment)?)))
        .collect();
    let wrong: Vec<&(&Segment, f64)> = legs
        .iter()
        .filter(|(segment, flown)| {
            !(LEAST_SHARE..=1.0 / LEAST_SHARE).contains(&(flown / planned(segment)))
        })
        .collect();
    let (segment, flown) = wrong.first().filter(|_| 2 * wrong.len() > legs.len())?;
    Some(Cause::OtherTrack {
        wrong_of: [wrong.len(), legs.len()],
        label: segment.label.clone(),
        start_s: segment.start_ms as f64 / 1000.0,
        planned_flown_m: [planned(segment), *flown],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frame::Geodetic;

    fn target(kind: SegmentKind, start_s: f64, end_s: f64) -> Target {
        Target { kind, label: String::new(), start_s, end_s, commanded_mps: 0.0 }
    }

    #[test]
    fn a_scan_is_its_legs_and_its_long_hovers() {
        let (leg, hover) = (SegmentKind::Horizontal, SegmentKind::Hover);
        let targets = [
            target(hover, 0.0, 30.0),
            target(leg, 40.0, 70.0),
            target(hover, 72.0, 76.0),
            target(leg, 80.0, 85.0),
            target(SegmentKind::LegUp, 90.0, 120.0),
        ];
        let starts = |found: Vec<&Target>| found.iter().map(|one| one.start_s).collect::<Vec<_>>();
        assert_eq!(starts(measuring(&targets, |_| None)), [0.0, 40.0]);
        assert_eq!(starts(measuring(&targets[..1], |_| None)), [0.0]);
        // A hop of five seconds makes no scan of a hover.
        let hop = [target(hover, 0.0, 30.0), target(leg, 31.0, 36.0), target(hover, 40.0, 90.0)];
        assert_eq!(starts(measuring(&hop, |_| None)), [40.0]);
        assert!(measuring(&[], |_| None).is_empty());
    }

    #[test]
    fn a_profile_is_its_legs_and_a_column_all_of_its_hovers() {
        let (up, hover) = (SegmentKind::LegUp, SegmentKind::Hover);
        let profile = [
            target(hover, 0.0, 20.0),
            target(up, 30.0, 110.0),
            target(SegmentKind::LegDown, 115.0, 200.0),
        ];
        assert_eq!(measuring(&profile, |_| None).len(), 3);
        // Legs beside a long hover are a ladder, which is another flight's business.
        let ladder = [target(up, 0.0, 20.0), target(hover, 30.0, 330.0)];
        assert_eq!(measuring(&ladder, |_| None), [&ladder[1]]);
        let column =
            [target(hover, 0.0, 60.0), target(hover, 80.0, 145.0), target(hover, 150.0, 155.0)];
        let rising = |target: &Target| Some(20.0 + target.start_s / 4.0);
        assert_eq!(
            measuring(&column, rising),
            [&column[0], &column[1]],
            "five seconds have no value"
        );
        assert_eq!(measuring(&column, |_| Some(60.0)), [&column[1]], "the longest of one height");
        assert!(is_track(&measuring(&column, rising)) && !is_track(&[&column[1]]));
    }

    /// East at 4 m/s from 20 s on.
    fn flown() -> Flight {
        let time_s: Vec<f64> = (0..800).map(|index| f64::from(index) / 10.0).collect();
        let series = |value: Vec<f64>| Series { time_s: time_s.clone(), value };
        let flat = |value: f64| series(vec![value; 800]);
        Flight {
            effort: crate::flight::Effort { values: flat(1540.0), ..Default::default() },
            pulse_max_us: flat(1540.0),
            pulse_min_us: flat(1540.0),
            pulse_limits_us: (1150.0, 1950.0),
            velocity_up_mps: flat(0.0),
            height_m: flat(60.0),
            roll_rad: flat(0.0),
            pitch_rad: flat(-0.05),
            north_m: flat(3.0),
            east_m: series(time_s.iter().map(|t| -2.0 + 4.0 * (t - 20.0).max(0.0)).collect()),
            ..Flight::default()
        }
    }

    #[test]
    fn a_change_of_speed_costs_the_seconds_around_it() {
        let flight = flown();
        let leg = target(SegmentKind::Horizontal, 5.0, 70.0);
        let found = look(&flight, &[&leg], &WindowOptions::default());
        let lost: Vec<i64> = (found.first_s..)
            .zip(&found.seconds)
            .filter_map(|(time, second)| second.is_none().then_some(time))
            .collect();
        assert_eq!((lost.first(), lost.last()), (Some(&16), Some(&24)), "{lost:?}");
        assert!(found.quality.iter().any(|one| one.reason.starts_with("its horizontal speed")));
        let steady = target(SegmentKind::Horizontal, 25.0, 70.0);
        let found = look(&flight, &[&steady], &WindowOptions::default());
        assert_eq!(found.seconds.iter().flatten().count(), 36);
    }

    #[test]
    fn places_count_from_home_in_the_show_frame() {
        let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 190.0 };
        let east = ShowFrame { origin, orientation_deg: 90.0 };
        let moved = moved_neu_m(&flown(), 45.0).unwrap();
        assert!((moved[0]).abs() < 1e-9 && (moved[1] - 100.0).abs() < 1e-9, "{moved:?}");
        let place = place_m(&east, [-7.0, 14.0], moved);
        assert!((place[0] - 93.0).abs() < 1e-9 && (place[1] - 14.0).abs() < 1e-9, "{place:?}");
        assert_eq!(place[2], 60.0);
        assert_eq!(moved_neu_m(&flown(), 99.0), None);
    }

    #[test]
    fn legs_that_were_not_flown_are_another_plan() {
        let leg = |start_ms: u64, speed: f64| Segment {
            kind: SegmentKind::Horizontal,
            label: format!("{speed} m/s towards 0°"),
            start_ms,
            end_ms: start_ms + 20_000,
            from_m: [0.0, 0.0, 60.0],
            to_m: [20.0 * speed, 0.0, 60.0],
            velocity_mps: [speed, 0.0, 0.0],
            from_velocity_mps: None,
            window: None,
            calibrates_wind: false,
        };
        assert_eq!(contradiction(&flown(), &[leg(25_000, 4.0), leg(45_000, 4.0)]), None);
        let said = contradiction(&flown(), &[leg(0, 4.0), leg(25_000, 1.0)]).unwrap().to_string();
        assert!(said.contains("2 of 2 horizontal legs were not flown"), "{said}");
        assert!(said.contains("planned 80 m, flown 0 m"), "{said}");
        assert_eq!(contradiction(&flown(), &[]), None);
    }
}
