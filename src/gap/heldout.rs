//! The gap before and after on data that was not used for fitting.

use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::compare::{Comparison, Simulated};
use super::data::Data;
use super::error::GapError;
use super::explain::Found;
use super::gls::{Column, Problem, Pulses, Split};
use super::noise::{GroupPattern, Hyper};
use super::posterior::SharedAir;
use super::refine::refine;
use super::verdict::{Gap, Interval, Shrink};
use crate::base::rng::{Purpose, stream};
use crate::mission::plan::Plan;
use crate::vehicle::Vehicle;

/// Draws of the bootstrap.
const DRAWS: usize = 1000;
/// Simulated flights for the floor.
const FLOORS: usize = 40;

/// What the shrink is made from: residuals of the drones that were held out, before and after, and
/// those of the fitted ones after.
struct Residuals {
    before: Pulses,
    after: Pulses,
    air: Vec<Vec<f64>>,
    response: Vec<Vec<f64>>,
    segments: Vec<Vec<usize>>,
}

/// Gaps of a search.
///
/// # Errors
/// See [`GapError`].
pub(super) fn gap(
    train: &Data,
    held: &Data,
    original: &Vehicle,
    simulated: &Simulated<'_>,
    plan: Option<&Plan>,
    found: &Found,
    seed: u64,
) -> Result<Gap, GapError> {
    let drones = if held.drones() == 0 {
        None
    } else {
        Some(of_drones(held, original, simulated, plan, found, seed)?)
    };
    let rungs = of_rungs(train, original, simulated, plan, found, seed)?;
    Ok(Gap { drones, rungs })
}

fn of_drones(
    held: &Data,
    original: &Vehicle,
    simulated: &Simulated<'_>,
    plan: Option<&Plan>,
    found: &Found,
    seed: u64,
) -> Result<Shrink, GapError> {
    let comparison = &found.comparison;
    let before = same_bins(&Comparison::new(held, original, simulated, plan)?, comparison);
    let after = same_bins(&Comparison::new(held, &found.vehicle, simulated, plan)?, comparison);
    let start = before.residual(&before.vehicle, found.gusts_mps)?;
    let mut end = after.residual(&found.vehicle, found.gusts_mps)?;
    // Free shapes were fitted on the others' bins, which are the same.
    let shapes = shapes(comparison, found)?;
    subtract(&mut end, &shapes);
    let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
    let mut fitted = comparison.residual(&found.vehicle, found.gusts_mps)?;
    subtract(&mut fitted, &shapes);
    let shared = SharedAir::new(&patterns, &found.hyper);
    let air = shared.pulses(&means(&fitted), &patterns, &found.hyper);
    let residuals = Residuals {
        before: start,
        after: end,
        air,
        response: after.scene.response(&found.vehicle)?,
        segments: segments(comparison),
    };
    let counts: Vec<usize> = residuals.after.iter().map(Vec::len).collect();
    let floor_us = floor(&patterns, &counts, &found.hyper, &shared, seed);
    Ok(shrink(&residuals, floor_us, seed))
}

/// A comparison with only the bins of another.
fn same_bins(comparison: &Comparison, other: &Comparison) -> Comparison {
    comparison.only(|group, bin| {
        let start_s = comparison.data.groups[group].bins[bin].start_s;
        let name = &comparison.data.groups[group].name;
        let same = other.data.groups.iter().find(|other| other.name == *name);
        same.is_some_and(|same| same.bins.iter().any(|bin| bin.start_s == start_s))
    })
}

fn segments(comparison: &Comparison) -> Vec<Vec<usize>> {
    let of = |group: &super::data::Group| group.bins.iter().map(|bin| bin.segment).collect();
    comparison.data.groups.iter().map(of).collect()
}

/// What the free shapes of a search say in each bin.
fn shapes(comparison: &Comparison, found: &Found) -> Result<Vec<Vec<f64>>, GapError> {
    let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
    let split = Split::of(&comparison.residual(&found.vehicle, found.gusts_mps)?);
    let solution = Problem::new(&patterns, &split).with(&found.extras).at(&found.hyper);
    let value = |group: usize, bin: usize| {
        let parts = found.extras.iter().zip(solution.beta.iter().skip(1));
        parts
            .map(|(column, beta)| match column {
                Column::Shared(values) => beta * values[group][bin],
                Column::Own(values) => {
                    let count = values[group].len().max(1) as f64;
                    beta * values[group].iter().map(|drone| drone[bin]).sum::<f64>() / count
                }
            })
            .sum::<f64>()
    };
    let bins = |(group, pattern): (usize, &GroupPattern)| {
        (0..pattern.time_s.len()).map(|bin| value(group, bin)).collect()
    };
    Ok(patterns.iter().enumerate().map(bins).collect())
}

fn subtract(pulses: &mut Pulses, shapes: &[Vec<f64>]) {
    for (drones, shape) in pulses.iter_mut().zip(shapes) {
        for drone in drones {
            drone.iter_mut().zip(shape).for_each(|(value, shape)| *value -= shape);
        }
    }
}

fn means(pulses: &Pulses) -> Vec<Vec<f64>> {
    let mean = |drones: &Vec<Vec<f64>>| -> Vec<f64> {
        let bins = drones.first().map_or(0, Vec::len);
        let count = drones.len().max(1) as f64;
        (0..bins).map(|bin| drones.iter().map(|drone| drone[bin]).sum::<f64>() / count).collect()
    };
    pulses.iter().map(mean).collect()
}

/// Sums for one block of a drone and a segment: count, squares of four residuals.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    count: f64,
    raw: [f64; 2],
    clean: [f64; 2],
    mps: [f64; 2],
}

fn shrink(residuals: &Residuals, floor_us: f64, seed: u64) -> Shrink {
    let mut blocks: Vec<Block> = Vec::new();
    for (group, drones) in residuals.after.iter().enumerate() {
        for (drone, after) in drones.iter().enumerate() {
            let before = &residuals.before[group][drone];
            let air = &residuals.air[group];
            let without = |values: &[f64], air: &[f64]| -> Vec<f64> {
                let rest: Vec<f64> = values.iter().zip(air).map(|(v, a)| v - a).collect();
                let mean = rest.iter().sum::<f64>() / rest.len().max(1) as f64;
                rest.into_iter().map(|value| value - mean).collect()
            };
            let nothing = vec![0.0; air.len()];
            let raw = [without(before, &nothing), without(after, &nothing)];
            let clean = [without(before, air), without(after, air)];
            let segments = &residuals.segments[group];
            let mut last = None;
            for bin in 0..after.len() {
                let segment = segments.get(bin).copied();
                if segment != last || blocks.is_empty() {
                    blocks.push(Block::default());
                    last = segment;
                }
                let response = residuals.response[group][bin].abs().max(1.0);
                if let Some(block) = blocks.last_mut() {
                    block.count += 1.0;
                    for side in 0..2 {
                        block.raw[side] += raw[side][bin].powi(2);
                        block.clean[side] += clean[side][bin].powi(2);
                        block.mps[side] += (raw[side][bin] / response).powi(2);
                    }
                }
            }
        }
    }
    let sums = |blocks: &mut dyn Iterator<Item = &Block>| {
        let mut sum = Block::default();
        for block in blocks {
            sum.count += block.count;
            for side in 0..2 {
                sum.raw[side] += block.raw[side];
                sum.clean[side] += block.clean[side];
                sum.mps[side] += block.mps[side];
            }
        }
        sum
    };
    let rms = |square: f64, count: f64| (square / count.max(1.0)).sqrt();
    let excess = |sum: &Block| {
        let floor = floor_us * floor_us;
        let [before, after] = sum.clean.map(|square| square / sum.count.max(1.0));
        if before <= floor { 0.0 } else { (before - after) / (before - floor) }
    };
    let whole = sums(&mut blocks.iter());
    let mut rng = stream(seed, 0, Purpose::Resampling);
    let draws: Vec<(f64, f64, f64)> = (0..DRAWS)
        .map(|_| {
            let mut chosen =
                (0..blocks.len()).filter_map(|_| blocks.get(rng.random_range(0..blocks.len())));
            let sum = sums(&mut chosen);
            (rms(sum.raw[0], sum.count), rms(sum.raw[1], sum.count), excess(&sum))
        })
        .collect();
    let interval = |of: fn(&(f64, f64, f64)) -> f64, value: f64| {
        let mut values: Vec<f64> = draws.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
        Interval { value, low: at(0.025), high: at(0.975) }
    };
    let floor = (floor_us * floor_us).max(1e-12);
    Shrink {
        before_us: interval(|draw| draw.0, rms(whole.raw[0], whole.count)),
        after_us: interval(|draw| draw.1, rms(whole.raw[1], whole.count)),
        before_without_air_us: rms(whole.clean[0], whole.count),
        after_without_air_us: rms(whole.clean[1], whole.count),
        floor_us,
        before_mps: rms(whole.mps[0], whole.count),
        after_mps: rms(whole.mps[1], whole.count),
        chi2: (
            whole.clean[0] / whole.count.max(1.0) / floor,
            whole.clean[1] / whole.count.max(1.0) / floor,
        ),
        excess_shrink: interval(|draw| draw.2, excess(&whole)),
    }
}

/// What noise and the air that is not known leave of held-out drones, us: the same sums on simulated
/// flights.
fn floor(
    patterns: &[GroupPattern],
    held: &[usize],
    hyper: &Hyper,
    shared: &SharedAir,
    seed: u64,
) -> f64 {
    // Fitted and held-out drones together, so that they share the air.
    let both: Vec<GroupPattern> = patterns
        .iter()
        .zip(held)
        .map(|(group, held)| GroupPattern { drones: group.drones + held, ..group.clone() })
        .collect();
    let whitener = super::noise::Whitener::new(&both, hyper);
    let (mut squares, mut count) = (0.0, 0.0);
    for index in 0..FLOORS {
        let mut rng = stream(seed, index as u64, Purpose::Resampling);
        let pulses = whitener.simulate(|| StandardNormal.sample(&mut rng));
        let fitted: Pulses = pulses
            .iter()
            .zip(patterns)
            .map(|(drones, group)| drones.iter().take(group.drones).cloned().collect())
            .collect();
        let air = shared.pulses(&means(&fitted), patterns, hyper);
        for ((drones, group), air) in pulses.iter().zip(patterns).zip(&air) {
            for drone in drones.iter().skip(group.drones) {
                let rest: Vec<f64> = drone.iter().zip(air).map(|(v, a)| v - a).collect();
                let mean = rest.iter().sum::<f64>() / rest.len().max(1) as f64;
                squares += rest.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
                count += rest.len() as f64;
            }
        }
    }
    if count > 0.0 { (squares / count).sqrt() } else { 0.0 }
}

/// Rungs held out in rotation: sizes are fitted on the other rungs, the gap is taken on this one.
fn of_rungs(
    train: &Data,
    original: &Vehicle,
    simulated: &Simulated<'_>,
    plan: Option<&Plan>,
    found: &Found,
    seed: u64,
) -> Result<Option<Shrink>, GapError> {
    let comparison = &found.comparison;
    let speed = |group: usize, bin: usize| {
        (comparison.data.groups[group].bins[bin].climb_mps().abs() * 1000.0).round() as i64
    };
    let mut speeds: Vec<i64> = comparison
        .data
        .groups
        .iter()
        .enumerate()
        .flat_map(|(group, of)| (0..of.bins.len()).map(move |bin| (group, bin)))
        .map(|(group, bin)| speed(group, bin))
        .filter(|speed| *speed > 0)
        .collect();
    speeds.sort_unstable();
    speeds.dedup();
    if speeds.len() < 3 {
        return Ok(None);
    }
    let before = same_bins(&Comparison::new(train, original, simulated, plan)?, comparison);
    let start = before.residual(&before.vehicle, found.gusts_mps)?;
    let shapes = shapes(comparison, found)?;
    let mut end = comparison.residual(&found.vehicle, found.gusts_mps)?;
    if !found.parameters.is_empty() {
        for held in &speeds {
            let others = comparison.only(|group, bin| speed(group, bin) != *held);
            let keep = |group, bin| speed(group, bin) != *held;
            let extras: Vec<Column> = found.extras.iter().map(|extra| extra.only(keep)).collect();
            let fit = refine(
                &others,
                &found.vehicle,
                &found.parameters,
                &extras,
                found.hyper,
                found.gusts_mps,
                false,
            )?;
            let there = comparison.residual(&fit.vehicle, found.gusts_mps)?;
            for (group, drones) in end.iter_mut().enumerate() {
                for (drone, values) in drones.iter_mut().enumerate() {
                    for (bin, value) in values.iter_mut().enumerate() {
                        if speed(group, bin) == *held {
                            *value = there[group][drone][bin];
                        }
                    }
                }
            }
        }
    }
    subtract(&mut end, &shapes);
    let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
    let shared = SharedAir::new(&patterns, &found.hyper);
    let air = shared.pulses(&means(&end), &patterns, &found.hyper);
    let counts: Vec<usize> = patterns.iter().map(|group| group.drones).collect();
    let residuals = Residuals {
        before: start,
        after: end,
        air,
        response: comparison.scene.response(&found.vehicle)?,
        segments: segments(comparison),
    };
    let floor_us = floor(&patterns, &counts, &found.hyper, &shared, seed);
    Ok(Some(shrink(&residuals, floor_us, seed)))
}
