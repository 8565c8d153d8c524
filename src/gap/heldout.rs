//! The gap before and after, on data that was not used for fitting.

use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use super::compare::{Comparison, Simulated};
use super::data::Data;
use super::error::GapError;
use super::explain::Found;
use super::gls::{Column, Problem, Pulses, Split};
use super::noise::{GroupPattern, Hyper};
use super::refine::{doubts, refine};
use super::refly::mean_drone;
use super::response::Response;
use super::verdict::{Gap, Interval, Shrink};
use crate::base::rng::{Purpose, stream};
use crate::mission::plan::Plan;
use crate::numeric::{Moments, Sorted, mean};
use crate::vehicle::Vehicle;

/// Draws of the bootstrap, usual for intervals of 95 %.
const DRAWS: usize = 1000;
/// Simulated flights for the floor. Chosen for time; that the floor is an estimate is why a share of the gap
/// can be above 100 %.
const FLOORS: usize = 40;

/// What the shrink is made from: residuals before and after, by group, drone and bin, of which the
/// air that the fitted drones saw is taken away.
struct Residuals<'a> {
    before: Pulses,
    after: Pulses,
    air: &'a [Vec<f64>],
    response: &'a [Vec<Response>],
    gusts_mps: f64,
    segments: &'a [Vec<usize>],
}

/// A search and what was held against the logs.
#[derive(Clone, Copy)]
pub(super) struct Case<'a> {
    /// Model before the search.
    pub original: &'a Vehicle,
    /// Simulation that the logs are compared with.
    pub simulated: &'a Simulated<'a>,
    /// The plan, if there is one.
    pub plan: Option<&'a Plan>,
    /// Findings of the search.
    pub found: &'a Found,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Case<'_> {
    /// The gaps: on the drones that were held out, and on rungs of the fitted ones.
    ///
    /// # Errors
    /// See [`GapError`].
    pub(super) fn gap(&self, train: &Data, held: &Data) -> Result<Gap, GapError> {
        let fitted = Fitted::of(self.found)?;
        let drones = (held.drones() > 0).then(|| self.of_drones(held, &fitted)).transpose()?;
        Ok(Gap { drones, rungs: self.of_rungs(train, &fitted)? })
    }

    /// Whether the model is as it was: then the gap is, too. A wind that is read once more would make another.
    fn leaves_the_model(&self) -> bool {
        let Found { vehicle, extras, comparison, .. } = self.found;
        extras.is_empty() && *vehicle == comparison.vehicle && *vehicle == mean_drone(self.original)
    }

    fn against(
        &self,
        data: &Data,
        vehicle: &Vehicle,
        near: Option<&Comparison>,
    ) -> Result<Comparison, GapError> {
        let Self { simulated, plan, found, .. } = *self;
        let comparison = Comparison::of(data, vehicle, simulated, plan, found.updraft_mps, near)?;
        Ok(same_bins(&comparison, &self.found.comparison))
    }

    fn of_drones(&self, held: &Data, fitted: &Fitted) -> Result<Shrink, GapError> {
        let (vehicle, gusts_mps) = (&self.found.vehicle, self.found.gusts_mps);
        let before = self.against(held, self.original, None)?;
        let after = if self.leaves_the_model() {
            before.clone()
        } else {
            self.against(held, vehicle, Some(&before))?
        };
        let mut end = after.residual(vehicle, gusts_mps)?;
        // Free shapes were fitted on the others' bins, which are the same.
        subtract(&mut end, &fitted.shapes);
        let mut own = fitted.residual.clone();
        subtract(&mut own, &fitted.shapes);
        let residuals = Residuals {
            before: before.residual(&before.vehicle, gusts_mps)?,
            after: end,
            air: &fitted.air(&own, self.found),
            response: &after.scene_of(vehicle).response(vehicle)?,
            gusts_mps,
            segments: &fitted.segments,
        };
        Ok(self.shrink(&residuals, fitted))
    }

    fn shrink(&self, residuals: &Residuals<'_>, fitted: &Fitted) -> Shrink {
        let counts: Vec<usize> = residuals.after.iter().map(Vec::len).collect();
        let Fitted { patterns, doubts, .. } = fitted;
        let floor_us = floor(patterns, doubts, &counts, &self.found.noise.hyper, self.seed);
        shrink(residuals, floor_us, self.seed)
    }

    /// Rungs held out in rotation: sizes are fitted on the other rungs, the gap is taken on this one.
    fn of_rungs(&self, train: &Data, fitted: &Fitted) -> Result<Option<Shrink>, GapError> {
        let Found { comparison, vehicle, gusts_mps, .. } = self.found;
        let speed = |group: usize, bin: usize| {
            (comparison.data.groups[group].bins[bin].climb_mps().abs() * 1000.0).round() as i64
        };
        let groups = comparison.data.groups.iter().enumerate();
        let mut speeds: Vec<i64> = groups
            .flat_map(|(group, of)| (0..of.bins.len()).map(move |bin| (group, bin)))
            .map(|(group, bin)| speed(group, bin))
            .filter(|speed| *speed > 0)
            .collect();
        speeds.sort_unstable();
        speeds.dedup();
        if speeds.len() < 3 {
            return Ok(None);
        }
        let before = if self.leaves_the_model() {
            comparison.clone()
        } else {
            self.against(train, self.original, Some(comparison))?
        };
        let mut end = fitted.residual.clone();
        if !self.found.parameters.is_empty() {
            let without: Result<Vec<Pulses>, GapError> =
                speeds.par_iter().map(|held| self.refit_without(*held, &speed)).collect();
            for (held, there) in speeds.iter().zip(without?) {
                take(&mut end, &there, |group, bin| speed(group, bin) == *held);
            }
        }
        subtract(&mut end, &fitted.shapes);
        let air = fitted.air(&end, self.found);
        let residuals = Residuals {
            before: before.residual(&before.vehicle, *gusts_mps)?,
            after: end,
            air: &air,
            response: &comparison.scene_of(vehicle).response(vehicle)?,
            gusts_mps: *gusts_mps,
            segments: &fitted.segments,
        };
        Ok(Some(self.shrink(&residuals, fitted)))
    }

    /// Residuals by sizes that were fitted without one rung.
    fn refit_without(
        &self,
        held: i64,
        speed: &(impl Fn(usize, usize) -> i64 + Sync),
    ) -> Result<Pulses, GapError> {
        let Found { comparison, vehicle, parameters, extras, noise, gusts_mps, .. } = self.found;
        let keep = |group, bin| speed(group, bin) != held;
        let extras: Vec<Column> = extras.iter().map(|extra| extra.only(keep)).collect();
        let others = comparison.only(keep);
        let fit = refine(&others, vehicle, parameters, &extras, noise, *gusts_mps, false)?;
        Ok(comparison.residual(&fit.vehicle, *gusts_mps)?)
    }
}

/// Takes over some bins.
fn take(into: &mut Pulses, from: &Pulses, is_wanted: impl Fn(usize, usize) -> bool) {
    for (group, (drones, from)) in into.iter_mut().zip(from).enumerate() {
        for (values, from) in drones.iter_mut().zip(from) {
            for (bin, (value, from)) in values.iter_mut().zip(from).enumerate() {
                if is_wanted(group, bin) {
                    *value = *from;
                }
            }
        }
    }
}

/// The fitted drones with everything found in the model.
struct Fitted {
    patterns: Vec<GroupPattern>,
    residual: Pulses,
    /// What the free shapes say in each bin.
    shapes: Vec<Vec<f64>>,
    segments: Vec<Vec<usize>>,
    /// What is not known of the air and of the forms of drag and lift; none of it is missing physics.
    doubts: Vec<Column>,
}

impl Fitted {
    fn of(found: &Found) -> Result<Self, GapError> {
        let comparison = &found.comparison;
        let patterns = comparison.patterns(&found.vehicle, found.gusts_mps)?;
        let residual = comparison.residual(&found.vehicle, found.gusts_mps)?;
        let split = Split::of(&residual);
        let solution = Problem::new(&patterns, &split).with(&found.extras).at(&found.noise.hyper);
        let means: Vec<Vec<Vec<f64>>> = found.extras.iter().map(Column::means).collect();
        let value = |group: usize, bin: usize| {
            let parts = means.iter().zip(solution.beta.iter().skip(1));
            parts.map(|(mean, beta)| beta * mean[group][bin]).sum::<f64>()
        };
        let bins = |(group, pattern): (usize, &GroupPattern)| {
            (0..pattern.time_s.len()).map(|bin| value(group, bin)).collect()
        };
        let shapes = patterns.iter().enumerate().map(bins).collect();
        let of = |group: &super::data::Group| group.bins.iter().map(|bin| bin.segment).collect();
        let segments = comparison.data.groups.iter().map(of).collect();
        let doubts = doubts(comparison, &found.vehicle, &found.parameters)?;
        Ok(Self { patterns, residual, shapes, segments, doubts })
    }

    /// What the shared air does to the pulse, by these residuals of the fitted drones.
    fn air(&self, residual: &Pulses, found: &Found) -> Vec<Vec<f64>> {
        shared_us(&self.patterns, residual, &self.doubts, &found.noise.hyper)
    }
}

/// What the air that these drones share does to the pulse, by group and bin, us: its updraft, and its wind as far as that and the
/// forms of drag and lift are in doubt.
fn shared_us(
    patterns: &[GroupPattern],
    residual: &Pulses,
    doubts: &[Column],
    hyper: &Hyper,
) -> Vec<Vec<f64>> {
    let split = Split::of(residual);
    let problem = Problem::new(patterns, &split).doubting(doubts);
    let solution = problem.at(hyper);
    let shared = problem.shared_mps(&solution);
    let of = |(pattern, shared): (&GroupPattern, Vec<f64>)| {
        let responses = pattern.responses(hyper);
        shared.iter().zip(responses).map(|(mps, response)| mps * response).collect()
    };
    let mut air: Vec<Vec<f64>> = patterns.iter().zip(shared).map(of).collect();
    for (doubt, beta) in doubts.iter().zip(solution.beta.iter().skip(1)) {
        for (air, means) in air.iter_mut().zip(doubt.means()) {
            air.iter_mut().zip(means).for_each(|(air, mean)| *air += beta * mean);
        }
    }
    air
}

/// A comparison with only the bins of another.
pub(super) fn same_bins(comparison: &Comparison, other: &Comparison) -> Comparison {
    comparison.only(|group, bin| {
        let start_s = comparison.data.groups[group].bins[bin].start_s;
        let name = &comparison.data.groups[group].name;
        let same = other.data.groups.iter().find(|other| other.name == *name);
        same.is_some_and(|same| same.bins.iter().any(|bin| bin.start_s == start_s))
    })
}

fn subtract(pulses: &mut Pulses, shapes: &[Vec<f64>]) {
    for (drones, shape) in pulses.iter_mut().zip(shapes) {
        for drone in drones {
            drone.iter_mut().zip(shape).for_each(|(value, shape)| *value -= shape);
        }
    }
}

/// Sums for one block of a drone and a segment: count, squares of four residuals.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    count: f64,
    raw: [f64; 2],
    clean: [f64; 2],
    mps: [f64; 2],
}

fn shrink(residuals: &Residuals<'_>, floor_us: f64, seed: u64) -> Shrink {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut mean_square, mut means) = ([0.0; 2], 0.0);
    for (group, drones) in residuals.after.iter().enumerate() {
        let mut sums = vec![[0.0; 2]; residuals.air[group].len()];
        for (drone, after) in drones.iter().enumerate() {
            let before = &residuals.before[group][drone];
            let air = &residuals.air[group];
            let without = |values: &[f64], air: &[f64]| -> Vec<f64> {
                let rest: Vec<f64> = values.iter().zip(air).map(|(v, a)| v - a).collect();
                let centre = mean(&rest).unwrap_or_default();
                rest.into_iter().map(|value| value - centre).collect()
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
                let response =
                    residuals.response[group][bin].over(residuals.gusts_mps).abs().max(1.0);
                if let Some(block) = blocks.last_mut() {
                    block.count += 1.0;
                    for side in 0..2 {
                        sums[bin][side] += raw[side][bin];
                        block.raw[side] += raw[side][bin].powi(2);
                        block.clean[side] += clean[side][bin].powi(2);
                        block.mps[side] += (raw[side][bin] / response).powi(2);
                    }
                }
            }
        }
        let count = drones.len().max(1) as f64;
        for sum in sums {
            means += 1.0;
            for side in 0..2 {
                mean_square[side] += (sum[side] / count).powi(2);
            }
        }
    }
    let summed = |blocks: &mut dyn Iterator<Item = &Block>| {
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
    let whole = summed(&mut blocks.iter());
    let mut rng = stream(seed, 0, Purpose::Resampling);
    let draws: Vec<(f64, f64, f64)> = (0..DRAWS)
        .map(|_| {
            let mut chosen =
                (0..blocks.len()).filter_map(|_| blocks.get(rng.random_range(0..blocks.len())));
            let sum = summed(&mut chosen);
            (rms(sum.raw[0], sum.count), rms(sum.raw[1], sum.count), excess(&sum))
        })
        .collect();
    let interval = |of: fn(&(f64, f64, f64)) -> f64, value: f64| {
        let mut values: Vec<f64> = draws.iter().map(of).collect();
        let sorted = Sorted::of(&mut values);
        let at = |share: f64| sorted.lower_quantile(share).unwrap_or(value);
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
        mean_us: (rms(mean_square[0], means), rms(mean_square[1], means)),
    }
}

/// What noise and the air that is not known leave of held-out drones, us: the same sums on simulated
/// flights.
fn floor(
    patterns: &[GroupPattern],
    doubts: &[Column],
    held: &[usize],
    hyper: &Hyper,
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
        let air = shared_us(patterns, &fitted, doubts, hyper);
        for ((drones, group), air) in pulses.iter().zip(patterns).zip(&air) {
            for drone in drones.iter().skip(group.drones) {
                let rest: Vec<f64> = drone.iter().zip(air).map(|(v, a)| v - a).collect();
                if let Some(rest) = Moments::of(&rest) {
                    squares += rest.squares;
                    count += rest.count as f64;
                }
            }
        }
    }
    if count > 0.0 { (squares / count).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::gls::Start;
    use super::super::noise::WHITE;
    use super::super::refine::Parameter;
    use super::super::trial;
    use super::super::verdict::Rest;
    use super::*;
    use crate::gap::bins::Bin;

    const INFLOW: &str = "rotor-inflow";
    /// The rung that is held out, m/s and as it is keyed.
    const RUNG_MPS: f64 = 2.0;
    const RUNG: i64 = 2000;

    /// A fleet whose inflow was found, against which its size is fitted.
    fn found(data: &Data) -> Found {
        let mut vehicle = trial::vehicle();
        super::super::candidates::set(&mut vehicle, INFLOW, "inflow_share", 0.1);
        let comparison = Comparison::new(data, &vehicle, &Simulated::Closed, None).unwrap();
        let parameter = Parameter {
            effect: INFLOW,
            name: "inflow_share",
            unit: "",
            bounds: (0.0, 1.0),
            before: None,
        };
        Found {
            vehicle: comparison.vehicle.clone(),
            comparison,
            extras: Vec::new(),
            felt: Vec::new(),
            parameters: vec![parameter],
            values: vec![(0.1, 0.01)],
            noise: Start::default(),
            gusts_mps: 0.2,
            updraft_mps: 0.0,
            was_in_updraft: false,
            steps: Vec::new(),
            rest: Rest::default(),
        }
    }

    fn speed(bin: &Bin) -> i64 {
        (bin.climb_mps().abs() * 1000.0).round() as i64
    }

    /// Residuals of the first drone off the rung, with sizes that were fitted without the rung `held`.
    fn off_the_rung(data: &Data, held: i64) -> Vec<f64> {
        let found = found(data);
        let vehicle = trial::vehicle();
        let simulated = Simulated::Closed;
        let case =
            Case { original: &vehicle, simulated: &simulated, plan: None, found: &found, seed: 1 };
        let bins = &data.groups[0].bins;
        let left = case.refit_without(held, &|_, bin| speed(&bins[bin])).unwrap();
        let others = left[0][0].iter().zip(bins).filter(|(_, bin)| speed(bin) != RUNG);
        others.map(|(value, _)| *value).collect()
    }

    #[test]
    fn a_rung_that_is_held_out_is_not_fitted() {
        let bend = |_: usize, bin: &Bin| 2.0 * bin.climb_mps() * bin.climb_mps().abs();
        let clean = trial::data(4, bend);
        let poisoned = trial::data(4, |drone, bin| {
            bend(drone, bin) + if speed(bin) == RUNG { 30.0 * bin.climb_mps() } else { 0.0 }
        });
        assert_eq!(speed(&poisoned.groups[0].bins[8]), (RUNG_MPS * 1000.0) as i64);
        assert_eq!(off_the_rung(&clean, RUNG), off_the_rung(&poisoned, RUNG));
        // Where another rung is held out, what is on this one moves the fit.
        assert_ne!(off_the_rung(&clean, 1000), off_the_rung(&poisoned, 1000));
    }

    /// Two drones in two segments of two bins.
    fn shrunk(before: [[f64; 4]; 2], after: [[f64; 4]; 2], air: [f64; 4], floor_us: f64) -> Shrink {
        let residuals = Residuals {
            before: vec![before.map(|drone| drone.to_vec()).to_vec()],
            after: vec![after.map(|drone| drone.to_vec()).to_vec()],
            air: &[air.to_vec()],
            response: &[vec![Response::straight(20.0); 4]],
            gusts_mps: 0.2,
            segments: &[vec![0, 0, 1, 1]],
        };
        shrink(&residuals, floor_us, 1)
    }

    #[test]
    fn the_gap_is_that_of_residuals_about_each_drones_mean() {
        let before = [[14.0, 6.0, 14.0, 6.0], [-6.0, -14.0, -6.0, -14.0]];
        let after = [[2.0, 0.0, 2.0, 0.0], [9.0, 7.0, 9.0, 7.0]];
        let found = shrunk(before, after, [0.0; 4], 0.0);
        assert!(
            (found.before_us.value - 4.0).abs() < 1e-12
                && (found.after_us.value - 1.0).abs() < 1e-12
        );
        assert!((found.before_mps - 0.2).abs() < 1e-12 && (found.after_mps - 0.05).abs() < 1e-12);
        assert!((found.mean_us.0 - 4.0).abs() < 1e-12 && (found.mean_us.1 - 1.0).abs() < 1e-12);
        // Of squares: 16 before, 1 after.
        assert!((found.excess_shrink.value - 15.0 / 16.0).abs() < 1e-12);
        assert!((found.excess_shrink.low - 15.0 / 16.0).abs() < 1e-12, "all blocks are alike");
        // A floor of 1 us is what nobody can do better than.
        let found = shrunk(before, after, [0.0; 4], 1.0);
        assert!((found.excess_shrink.value - 1.0).abs() < 1e-12, "{:?}", found.excess_shrink);
        assert!((found.chi2.0 - 16.0).abs() < 1e-12 && (found.chi2.1 - 1.0).abs() < 1e-12);
        // Where the gap before is the floor there is nothing to shrink.
        assert_eq!(shrunk(before, after, [0.0; 4], 4.0).excess_shrink.value, 0.0);
    }

    #[test]
    fn the_air_that_the_fitted_drones_saw_is_taken_away() {
        let air = [3.0, -1.0, -3.0, 1.0];
        let found = shrunk([air; 2], [air; 2], air, 0.5);
        assert!(found.before_without_air_us < 1e-12 && found.after_without_air_us < 1e-12);
        assert!((found.before_us.value - 5_f64.sqrt()).abs() < 1e-12, "it is in the gap itself");
    }

    /// White noise of 2 us alone.
    fn white() -> Hyper {
        let mut hyper = Hyper(Hyper::default().0.map(|_| f64::ln(1e-6)));
        hyper.0[super::super::noise::SHARED_TIME] = f64::ln(60.0);
        hyper.0[super::super::noise::GUST_TIME] = f64::ln(8.0);
        hyper.0[WHITE] = f64::ln(2.0);
        hyper
    }

    #[test]
    fn what_is_doubted_of_the_air_is_no_gap() {
        // Twice what a form of the drag is doubted by, as legs into the wind and with it show it.
        let patterns = trial::patterns();
        let form: Vec<Vec<f64>> = patterns
            .iter()
            .map(|group| (0..group.time_s.len()).map(|bin| [12.0, -12.0][bin % 2]).collect())
            .collect();
        let pulses: Pulses = patterns
            .iter()
            .zip(&form)
            .map(|(group, form)| vec![form.iter().map(|us| 2.0 * us).collect(); group.drones])
            .collect();
        let left = |doubts: &[Column]| {
            let air = shared_us(&patterns, &pulses, doubts, &white());
            let bins = air.iter().zip(&form).flat_map(|(air, form)| air.iter().zip(form));
            bins.map(|(air, form)| (2.0 * form - air).abs()).fold(0.0, f64::max)
        };
        assert!(left(&[]) > 20.0, "{}", left(&[]));
        let known = left(&[Column::Shared(form.clone())]);
        assert!(known < 2.0, "{known}");
    }

    #[test]
    fn the_floor_is_the_noise_that_is_left_about_a_mean() {
        // Of n bins about their mean, (n - 1) / n of the variance.
        let hyper = white();
        let patterns = trial::patterns();
        let found = floor(&patterns, &[], &[2, 1], &hyper, 1);
        assert!((found - 2.0 * (5.0_f64 / 6.0).sqrt()).abs() < 0.15, "{found}");
        assert_eq!(floor(&patterns, &[], &[0, 0], &hyper, 1), 0.0, "nobody is held out");
    }
}
