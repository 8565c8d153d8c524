//! Which values a value is conditioned on: its nearest ones in space and time (Vecchia's
//! approximation), so that the cost grows in proportion to the number of values.
//!
//! In a hover the same constellation of neighbours comes again in each 10 s: what follows from it is
//! computed once for each pattern.

use std::collections::BTreeMap;

use super::covariance::Spot;
use super::data::{Drone, Rows};

/// How many neighbours are looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Other drones at the same time.
    pub(super) beside: usize,
    /// Drones one step before (and, for kriging, after), the drone itself among them.
    pub(super) step: usize,
    /// Further steps of the drone itself.
    pub(super) own: usize,
}

/// What one constellation has in common.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// The value, or the place that is asked for.
    pub(super) target: Spot,
    pub(super) neighbours: Vec<Spot>,
    /// Noise of the target and of its neighbours, m/s.
    pub(super) target_noise_mps: f64,
    pub(super) noise_mps: Vec<f64>,
}

/// Neighbours of each target.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbours {
    pub(super) patterns: Vec<Pattern>,
    /// Pattern of each target.
    pub(super) of: Vec<usize>,
    /// Rows of its neighbours, in the pattern's order.
    pub(super) rows: Vec<Vec<u32>>,
}

/// Noise in steps of a quarter: what differs by less is one pattern.
fn noise_step(noise_mps: f64) -> i32 {
    (4.0 * noise_mps.log2()).round() as i32
}

/// Noise of a step.
fn of_step(step: i32) -> f64 {
    (f64::from(step) / 4.0).exp2()
}

/// A constellation by what decides it: the drone and block of each neighbour relative to the target's, and noise.
type Key = (usize, i32, Vec<(usize, i64, i32)>);

/// Collects targets with their neighbours.
struct Collector<'a> {
    rows: &'a Rows,
    found: Neighbours,
    known: BTreeMap<Key, usize>,
    moves: bool,
}

impl Collector<'_> {
    fn add(&mut self, target: Spot, site: usize, target_noise_mps: f64, near: &[usize]) {
        let Self { rows, found, known, moves } = self;
        let make = |near: &[usize]| {
            let of = |row: &usize| rows.list[*row];
            Pattern {
                target,
                neighbours: near.iter().map(|row| of(row).spot).collect(),
                target_noise_mps: of_step(noise_step(target_noise_mps)),
                noise_mps: near.iter().map(|row| of_step(noise_step(of(row).noise_mps))).collect(),
            }
        };
        let pattern = if *moves {
            found.patterns.push(make(near));
            found.patterns.len() - 1
        } else {
            let relative = |row: &usize| {
                let row = &rows.list[*row];
                let lag = (row.spot.time_s - target.time_s).round() as i64;
                (row.spot.drone.unwrap_or(usize::MAX), lag, noise_step(row.noise_mps))
            };
            let key = (site, noise_step(target_noise_mps), near.iter().map(relative).collect());
            *known.entry(key).or_insert_with(|| {
                found.patterns.push(make(near));
                found.patterns.len() - 1
            })
        };
        found.of.push(pattern);
        found.rows.push(near.iter().map(|row| *row as u32).collect());
    }
}

/// Drones by their distance from a place, nearest first, at most `count`.
fn nearest(drones: &[Drone], place_m: [f64; 3], second: usize, count: usize) -> Vec<usize> {
    let mut found: Vec<(f64, usize)> = drones
        .iter()
        .enumerate()
        .filter_map(|(index, drone)| {
            let other = drone.place_at(second)?;
            let square: f64 = (0..3).map(|axis| (other[axis] - place_m[axis]).powi(2)).sum();
            Some((square, index))
        })
        .collect();
    if found.len() > count {
        found.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(count);
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found.into_iter().map(|(_, index)| index).collect()
}

/// More drones than this around a place are not looked through.
const AROUND: usize = 48;
/// Blocks back in which the last value of a drone is looked for.
const BACK: usize = 4;

/// Each row with rows before it: the likelihood is the product of their conditional densities.
pub(super) fn before(drones: &[Drone], rows: &Rows, reach: Reach) -> Neighbours {
    let moves = drones.iter().any(|drone| !drone.hovers());
    let mut collector =
        Collector { rows, found: Neighbours::default(), known: BTreeMap::new(), moves };
    let around = (!moves).then(|| all_around(drones));
    for (block, second) in rows.seconds.iter().enumerate() {
        for (index, drone) in drones.iter().enumerate() {
            let Some(row) = rows.place[index][block] else { continue };
            let by_distance = match &around {
                Some(around) => around[index].clone(),
                None => {
                    nearest(drones, drone.place_at(*second).unwrap_or_default(), *second, AROUND)
                }
            };
            let mut near = Vec::new();
            let at =
                |drone: usize, block: usize| rows.place.get(drone)?.get(block).copied().flatten();
            let beside = by_distance.iter().filter(|other| **other < index);
            near.extend(beside.filter_map(|other| at(*other, block)).take(reach.beside));
            if block > 0 {
                near.extend(
                    by_distance.iter().filter_map(|other| at(*other, block - 1)).take(reach.step),
                );
            }
            let own = (0..block.saturating_sub(1)).rev().take(BACK);
            near.extend(own.filter_map(|block| at(index, block)).take(reach.own));
            let seen = &rows.list[row];
            collector.add(seen.spot, index, seen.noise_mps, &near);
        }
    }
    collector.found
}

/// Drones around each drone, itself first.
fn all_around(drones: &[Drone]) -> Vec<Vec<usize>> {
    let around = |drone: &Drone| nearest(drones, drone.place_at(0).unwrap_or_default(), 0, AROUND);
    drones.iter().map(around).collect()
}

/// Places with the rows around them, before and after: for kriging. Each site is asked for at all blocks of the rows,
/// block by block.
pub(super) fn around(
    drones: &[Drone],
    rows: &Rows,
    sites: &[(Option<usize>, [f64; 3])],
    reach: Reach,
) -> Neighbours {
    let moves = drones.iter().any(|drone| !drone.hovers());
    let mut collector =
        Collector { rows, found: Neighbours::default(), known: BTreeMap::new(), moves };
    let fixed: Option<Vec<Vec<usize>>> = (!moves)
        .then(|| sites.iter().map(|(_, place_m)| nearest(drones, *place_m, 0, AROUND)).collect());
    for (block, second) in rows.seconds.iter().enumerate() {
        for (site, (drone, place_m)) in sites.iter().enumerate() {
            let place_m =
                drone.and_then(|drone| drones[drone].place_at(*second)).unwrap_or(*place_m);
            let by_distance = match &fixed {
                Some(fixed) => fixed[site].clone(),
                None => nearest(drones, place_m, *second, AROUND),
            };
            let at =
                |drone: usize, block: usize| rows.place.get(drone)?.get(block).copied().flatten();
            let mut near: Vec<usize> = by_distance
                .iter()
                .filter_map(|other| at(*other, block))
                .take(reach.beside)
                .collect();
            for beside in [block.checked_sub(1), Some(block + 1)].into_iter().flatten() {
                near.extend(
                    by_distance.iter().filter_map(|other| at(*other, beside)).take(reach.step),
                );
            }
            if let Some(own) = drone.or(by_distance.first().copied()) {
                let before = (0..block.saturating_sub(1)).rev().take(BACK);
                near.extend(before.filter_map(|block| at(own, block)).take(reach.own));
                let after = (block + 2..rows.seconds.len()).take(BACK);
                near.extend(after.filter_map(|block| at(own, block)).take(reach.own));
            }
            let velocity_mps = drone.map_or([0.0; 3], |drone| drones[drone].velocity_at(*second));
            let spot = Spot { place_m, time_s: *second as f64, drone: *drone, velocity_mps };
            collector.add(spot, drones.len() + site, 1.0, &near);
        }
    }
    collector.found
}
