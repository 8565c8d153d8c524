//! Places on the ground: doubled ones, and take-offs that are almost, but not quite, together.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::report::{Collector, Finding, Margin, Severity};
use super::track::Track;

/// Places nearer than this are the same, m.
const SAME_M: f64 = 0.01;
/// Take-offs farther apart than this are meant to be apart, ms.
const TOGETHER_MS: u64 = 1000;

pub(super) fn check(tracks: &[Track<'_>], collector: &mut Collector) {
    let starts = |track: &Track<'_>| Some(track.start_m);
    doubled(tracks, starts, "same-start", "starts at the same point as", collector);
    let homes = |track: &Track<'_>| track.drone.home_m;
    doubled(tracks, homes, "same-home", "has the same home as", collector);
    mixed_starts(tracks, collector);
}

fn doubled(
    tracks: &[Track<'_>],
    place: impl Fn(&Track<'_>) -> Option<Vector3<f64>>,
    check: &'static str,
    relation: &str,
    collector: &mut Collector,
) {
    let cell = |point: &Vector3<f64>| [0, 1, 2].map(|axis| (point[axis] / SAME_M).floor() as i64);
    let mut seen: BTreeMap<[i64; 3], Vec<(Vector3<f64>, &Track<'_>)>> = BTreeMap::new();
    for track in tracks {
        let Some(point) = place(track) else { continue };
        let [x, y, z] = cell(&point);
        let near = (-1..=1).flat_map(|dx| {
            (-1..=1).flat_map(move |dy| (-1..=1).map(move |dz| [x + dx, y + dy, z + dz]))
        });
        let other = near
            .filter_map(|cell| seen.get(&cell))
            .flatten()
            .find(|(other, _)| (other - point).norm() < SAME_M);
        if let Some((other, first)) = other {
            collector.add(
                first.index,
                Finding {
                    severity: Severity::Error,
                    check,
                    drones: vec![first.name(), track.name()],
                    time_s: Some(0.0),
                    end_s: None,
                    value: Some((other - point).norm()),
                    limit: Some(SAME_M),
                    unit: "m",
                    message: format!(
                        "{} {relation} {}: ({:.2}, {:.2}, {:.2}) m",
                        track.name(),
                        first.name(),
                        point.x,
                        point.y,
                        point.z,
                    ),
                    remedy: "give every drone a place of its own",
                },
            );
        } else {
            seen.entry([x, y, z]).or_default().push((point, track));
        }
    }
}

/// Start of the first piece that moves, ms; none for a drone that never moves.
pub(super) fn first_motion_ms(track: &Track<'_>) -> Option<u64> {
    let moves = |piece: &&crate::trajectory::Piece<'_>| {
        super::track::curve_of(piece).points().iter().any(|point| *point != piece.from_m)
    };
    track.pieces.iter().find(moves).map(|piece| piece.start_ms)
}

/// Groups may take off apart, but a difference of less than a second is hardly meant.
fn mixed_starts(tracks: &[Track<'_>], collector: &mut Collector) {
    let mut starts: BTreeMap<u64, &Track<'_>> = BTreeMap::new();
    for track in tracks {
        if let Some(start_ms) = first_motion_ms(track) {
            starts.entry(start_ms).or_insert(track);
        }
    }
    let pairs = starts.iter().zip(starts.iter().skip(1));
    let closest = pairs.min_by_key(|((a, _), (b, _))| **b - **a);
    if let Some(((first_ms, first), (second_ms, second))) = closest
        && second_ms - first_ms < TOGETHER_MS
    {
        let apart_s = (second_ms - first_ms) as f64 / 1000.0;
        collector.add(
            first.index,
            Finding {
                severity: Severity::Warning,
                check: "mixed-starts",
                drones: vec![first.name(), second.name()],
                time_s: Some(*first_ms as f64 / 1000.0),
                end_s: Some(*second_ms as f64 / 1000.0),
                value: Some(apart_s),
                limit: Some(TOGETHER_MS as f64 / 1000.0),
                unit: "s",
                message: format!(
                    "start to move {apart_s:.3} s after each other ({} different starts in the show)",
                    starts.len()
                ),
                remedy: "start them together, or a second or more apart",
            },
        );
    }
    if let (Some((first_ms, _)), Some((last_ms, last))) =
        (starts.first_key_value(), starts.last_key_value())
    {
        collector.margin(Margin {
            check: "mixed-starts",
            quantity: "last drone to start, after the first",
            value: (last_ms - first_ms) as f64 / 1000.0,
            limit: None,
            unit: "s",
            drones: vec![last.name()],
            time_s: Some(*last_ms as f64 / 1000.0),
        });
    }
}
