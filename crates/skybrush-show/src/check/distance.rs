//! Distance of every two drones over continuous time.
//!
//! Time is cut into slabs. In each, every drone gets a box around its way *as seen from one of them*
//! (a fleet that moves together then stands still), a tree of boxes finds the pairs that may come
//! within the limit or nearer than the closest approach known so far, and only those are solved
//! exactly. A slab in which too many boxes overlap is halved.
//!
//! The limit in the air holds while at least one of the two is in the air
//! ([`super::AIRBORNE_ABOVE_M`] above its ground); two drones on the ground keep the smaller ground
//! distance. After its last point a drone hovers or lands, depending on the firmware: until the end
//! of the show it may be anywhere on the vertical line from there to the ground.

use rayon::prelude::*;

use super::curve::Bounds;
use super::pair::{closest, gaps, nearer_than};
use super::report::{Collector, Finding, Margin, Severity};
use super::track::{Track, overlap};
use super::tree::{Item, Tree, Visitor};
use super::{CheckInput, TOLERANCE_M};

const AIR: usize = 0;
const GROUND: usize = 1;
const NAMES: [&str; 2] = ["distance", "ground-distance"];
/// Slabs to begin with; they are worked on in parallel.
const SLABS: usize = 64;
/// Instants at which the closest pair is sought first, to have a bound for the slabs.
const INSTANTS: usize = 16;
/// A slab is not halved below this duration, ms.
const SHORTEST_MS: f64 = 20.0;
/// Box comparisons per drone after which a slab is halved.
const COMPARISONS: usize = 200;
/// Box comparisons per drone in one of the shortest slabs after which the check gives up.
const MOST_COMPARISONS: usize = 10_000;
/// Violations that one slab keeps, and parts into which it is halved, before the check gives up.
const MOST_RECORDS: usize = 10_000;
const MOST_PARTS: usize = 20_000;
/// Pairs nearer by less than this do not count as nearer, m.
const TIE_M: f64 = 1e-7;

#[derive(Clone, Copy, Debug)]
struct Approach {
    distance_m: f64,
    time_ms: f64,
    pair: (usize, usize),
}

#[derive(Clone, Copy, Debug)]
struct Record {
    kind: usize,
    from_ms: f64,
    to_ms: f64,
    worst: Approach,
}

/// Search state of one slab.
struct Search<'t, 'a> {
    tracks: &'t [Track<'a>],
    limits_m: [f64; 2],
    best: [Option<Approach>; 2],
    records: Option<Vec<Record>>,
    from_ms: f64,
    to_ms: f64,
    work: usize,
    work_limit: usize,
    incomplete: bool,
}

impl Search<'_, '_> {
    fn reach_of(&self, kind: usize) -> f64 {
        let best_m = self.best[kind].map_or(f64::INFINITY, |best| best.distance_m - TIE_M);
        if self.records.is_some() { best_m.max(self.limits_m[kind] - TOLERANCE_M) } else { best_m }
    }

    fn full(&self) -> bool {
        self.records.as_ref().is_some_and(|records| records.len() >= MOST_RECORDS)
    }
}

impl Visitor for Search<'_, '_> {
    fn reach_m(&mut self, a: &Item, b: &Item) -> f64 {
        self.work += 1;
        if self.work > self.work_limit || self.full() {
            return 0.0;
        }
        let mut reach_m: f64 = 0.0;
        if a.airborne || b.airborne {
            reach_m = reach_m.max(self.reach_of(AIR));
        }
        if a.grounded && b.grounded {
            reach_m = reach_m.max(self.reach_of(GROUND));
        }
        reach_m
    }

    fn visit(&mut self, i: usize, j: usize) {
        let (a, b) = (&self.tracks[i], &self.tracks[j]);
        let mut violated = false;
        overlap(a, b, self.from_ms, self.to_ms, |first, second, from_ms, to_ms| {
            let kind = if first.airborne || second.airborne { AIR } else { GROUND };
            let at_ms = |u: f64| from_ms + u * (to_ms - from_ms);
            let places = [a.place(first, from_ms, to_ms), b.place(second, from_ms, to_ms)];
            gaps(&places[0], &places[1], |start, end, gap| {
                let Some(found) = closest(gap, self.reach_of(kind)) else { return };
                let approach = |u: f64, distance_m| Approach {
                    distance_m,
                    time_ms: at_ms(start + u * (end - start)),
                    pair: (i, j),
                };
                if self.best[kind].is_none_or(|best| found.distance_m < best.distance_m - TIE_M) {
                    self.best[kind] = Some(approach(found.u, found.distance_m));
                }
                let limit_m = self.limits_m[kind];
                let Some(records) = &mut self.records else { return };
                if found.distance_m >= limit_m - TOLERANCE_M {
                    return;
                }
                violated = true;
                for (low, high) in nearer_than(gap, limit_m) {
                    let part = gap.restrict(low, high);
                    let Some(worst) = closest(&part, f64::INFINITY) else { continue };
                    records.push(Record {
                        kind,
                        from_ms: at_ms(start + low * (end - start)),
                        to_ms: at_ms(start + high * (end - start)),
                        worst: approach(low + worst.u * (high - low), worst.distance_m),
                    });
                }
            });
        });
        // Halving a slab does not make true violations go away.
        self.work = if violated { self.work.saturating_sub(8) } else { self.work + 8 };
    }
}

/// The drone whose way in a slab is nearest to the median of all: the frame for the boxes.
fn typical<'t, 'a>(tracks: &'t [Track<'a>], from_ms: f64, to_ms: f64) -> Option<&'t Track<'a>> {
    let ways: Vec<_> =
        tracks.iter().map(|track| track.position(to_ms) - track.position(from_ms)).collect();
    let mut median = nalgebra::Vector3::zeros();
    for axis in 0..3 {
        let mut values: Vec<f64> = ways.iter().map(|way| way[axis]).collect();
        let middle = values.len() / 2;
        if middle < values.len() {
            median[axis] = *values.select_nth_unstable_by(middle, f64::total_cmp).1;
        }
    }
    let distance = |i: usize| (ways[i] - median).norm_squared();
    (0..tracks.len())
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
        .map(|index| &tracks[index])
}

fn items(tracks: &[Track<'_>], frame: &Track<'_>, from_ms: f64, to_ms: f64) -> Vec<Item> {
    let item = |track: &Track<'_>| {
        let mut item = Item { bounds: Bounds::EMPTY, airborne: false, grounded: false };
        overlap(track, frame, from_ms, to_ms, |span, seen_from, from_ms, to_ms| {
            let ends = track.straight(span, from_ms, to_ms);
            let seen = ends.zip(frame.straight(seen_from, from_ms, to_ms));
            let mut way = if let Some(([a, b], [from, to])) = seen {
                let mut way = Bounds::EMPTY;
                way.include(&(a - from));
                way.include(&(b - to));
                way
            } else {
                let origin = frame.place(seen_from, from_ms, to_ms).curve;
                track.place(span, from_ms, to_ms).curve.minus(&origin).bounds()
            };
            way.low.z -= track.depth_m(span);
            item.bounds.join(&way);
            item.airborne |= span.airborne;
            item.grounded |= !span.airborne;
        });
        item
    };
    tracks.iter().map(item).collect()
}

fn search_slab(search: &mut Search<'_, '_>, slab_ms: (f64, f64)) {
    let tracks = search.tracks;
    let Some(frame) = typical(tracks, slab_ms.0, slab_ms.1) else { return };
    let mut parts = vec![slab_ms];
    let mut done = 0;
    while let Some((from_ms, to_ms)) = parts.pop() {
        done += 1;
        if done > MOST_PARTS {
            search.incomplete = true;
            return;
        }
        let shortest = to_ms - from_ms <= SHORTEST_MS;
        let per_drone = if shortest { MOST_COMPARISONS } else { COMPARISONS };
        (search.from_ms, search.to_ms, search.work) = (from_ms, to_ms, 0);
        search.work_limit = per_drone * tracks.len();
        let kept = search.records.as_ref().map_or(0, Vec::len);
        let items = items(tracks, frame, from_ms, to_ms);
        Tree::new(&items).pairs(search);
        if search.full() {
            search.incomplete = true;
            return;
        }
        if search.work > search.work_limit {
            if shortest {
                search.incomplete = true;
                continue;
            }
            if let Some(records) = &mut search.records {
                records.truncate(kept);
            }
            let middle_ms = from_ms.midpoint(to_ms);
            parts.extend([(middle_ms, to_ms), (from_ms, middle_ms)]);
        }
    }
}

fn nearer(a: &Approach, b: &Approach) -> bool {
    (a.distance_m.total_cmp(&b.distance_m))
        .then(a.time_ms.total_cmp(&b.time_ms))
        .then(a.pair.cmp(&b.pair))
        .is_lt()
}

pub(super) fn check(
    input: &CheckInput<'_>,
    tracks: &[Track<'_>],
    horizon_ms: u64,
    collector: &mut Collector,
) {
    if tracks.len() < 2 {
        return;
    }
    let horizon_ms = horizon_ms as f64;
    let mut first = Search {
        tracks,
        limits_m: [input.limits.min_distance_m, input.options.min_ground_distance_m],
        best: [None; 2],
        records: None,
        from_ms: 0.0,
        to_ms: 0.0,
        work: 0,
        work_limit: usize::MAX,
        incomplete: false,
    };
    for instant in 0..=INSTANTS {
        let at_ms = horizon_ms * instant as f64 / INSTANTS as f64;
        (first.from_ms, first.to_ms) = (at_ms, at_ms);
        if let Some(frame) = tracks.first() {
            Tree::new(&items(tracks, frame, at_ms, at_ms)).pairs(&mut first);
        }
    }
    let slabs: Vec<_> = (0..SLABS)
        .into_par_iter()
        .map(|slab| {
            let edge = |slab: usize| horizon_ms * slab as f64 / SLABS as f64;
            let mut search = Search { records: Some(Vec::new()), ..first };
            search_slab(&mut search, (edge(slab), edge(slab + 1)));
            (search.best, search.records.unwrap_or_default(), search.incomplete)
        })
        .collect();

    let mut best = first.best;
    let mut records = Vec::new();
    let mut incomplete = false;
    for (slab_best, slab_records, slab_incomplete) in slabs {
        for (best, candidate) in best.iter_mut().zip(slab_best) {
            if let Some(candidate) = candidate
                && best.as_ref().is_none_or(|best| nearer(&candidate, best))
            {
                *best = Some(candidate);
            }
        }
        records.extend(slab_records);
        incomplete |= slab_incomplete;
    }
    report(tracks, first.limits_m, &best, join(records), collector);
    if incomplete {
        collector.incomplete(NAMES[AIR]);
        collector.add(0, unfinished());
    }
}

/// Joins what one pair does in neighbouring pieces and slabs.
fn join(mut records: Vec<Record>) -> Vec<Record> {
    records.sort_by(|a, b| {
        (a.kind, a.worst.pair)
            .cmp(&(b.kind, b.worst.pair))
            .then(a.from_ms.total_cmp(&b.from_ms))
            .then(a.to_ms.total_cmp(&b.to_ms))
    });
    let mut joined: Vec<Record> = Vec::new();
    for record in records {
        match joined.last_mut() {
            Some(last)
                if (last.kind, last.worst.pair) == (record.kind, record.worst.pair)
                    && record.from_ms <= last.to_ms + 1e-3 =>
            {
                last.to_ms = last.to_ms.max(record.to_ms);
                if record.worst.distance_m < last.worst.distance_m - TIE_M {
                    last.worst = record.worst;
                }
            }
            _ => joined.push(record),
        }
    }
    joined
}

fn report(
    tracks: &[Track<'_>],
    limits_m: [f64; 2],
    best: &[Option<Approach>; 2],
    records: Vec<Record>,
    collector: &mut Collector,
) {
    let names = |(i, j): (usize, usize)| vec![tracks[i].name(), tracks[j].name()];
    for record in records {
        let Approach { distance_m, time_ms, pair } = record.worst;
        let limit_m = limits_m[record.kind];
        let (place, remedy) = match record.kind {
            AIR => ("", "separate them in space or in time, or plan a wider grid"),
            _ => (" on the ground", "place the drones farther apart"),
        };
        let message = format!(
            "come within {distance_m:.3} m of each other{place} at {:.3} s, limit {limit_m:.3} m",
            time_ms / 1000.0,
        );
        let finding = Finding {
            severity: Severity::Error,
            check: NAMES[record.kind],
            drones: names(pair),
            time_s: Some(record.from_ms / 1000.0),
            end_s: Some(record.to_ms / 1000.0),
            value: Some(distance_m),
            limit: Some(limit_m),
            unit: "m",
            message,
            remedy,
        };
        collector.add(tracks[pair.0].index, finding);
    }
    let quantities = ["closest approach", "closest on the ground"];
    for (kind, approach) in best.iter().enumerate() {
        if let Some(approach) = approach {
            collector.margin(Margin {
                check: NAMES[kind],
                quantity: quantities[kind],
                value: approach.distance_m,
                limit: Some(limits_m[kind]),
                unit: "m",
                drones: names(approach.pair),
                time_s: Some(approach.time_ms / 1000.0),
            });
        }
    }
}

fn unfinished() -> Finding {
    let message =
        "too many drones are too close together to list all; there may be more, and nearer";
    let remedy = "separate the drones that are listed, then check again";
    Finding { unit: "m", ..Finding::new(Severity::Error, NAMES[AIR], message.into(), remedy) }
}
