//! Signals that closed forms take in each bin, and the pulses of a model for them.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::as_flown::AsFlown;
use super::bins::{Bin, BinValues};
use super::data::Data;
use super::gls::{Column, Pulses};
use super::lean::Wind;
use super::memory::{Digest, Memory};
use super::response::Response;
use super::steady::{Moment, Steady};
use crate::base::air::density_ratio;
use crate::effects::cell::charge_of_cell;
use crate::effects::select::looks_at;
use crate::effects::{Definition, EffectError, Reference, Role, Signal, Signals, Supply};
use crate::numeric::{extent, mean};
use crate::vehicle::Vehicle;

/// Pulses of steady flights that were computed before.
static PULSES: Memory<Column> = Memory::of(KEPT);
/// The same at several vertical speeds.
static SHIFTED: Memory<Vec<Vec<Vec<f64>>>> = Memory::of(KEPT);
/// The same of drones that deviate.
static DEVIATING: Memory<Vec<Vec<f64>>> = Memory::of(KEPT);
/// Responses that were computed before.
static RESPONSES: Memory<Vec<Vec<Response>>> = Memory::of(KEPT);
/// Results that are kept of each kind: 15 MB of pulses of 50 drones in 150 bins.
const KEPT: usize = 256;
/// Pulses of more drones and bins are not kept: those of a thousand drones in 150 would be 300 MB.
const MOST_VALUES: usize = 50_000;

/// Moments that one thread takes at a time. Numerical: some milliseconds.
const CHUNK: usize = 64;
/// Open-circuit voltage above which there must be another cell, V: a full lithium polymer cell has 4.20 V.
const FULL_CELL_V: f64 = 4.25;

/// Steady signals of a comparison: what was flown and what the logs say of wind and battery. None of
/// them follows the pulse: terminal voltage, current and measured acceleration do and are never used
/// (endogenous regressors; docs/physics.md, 3.1).
#[derive(Clone, Debug)]
pub struct Scene {
    /// Signals by group and bin.
    pub signals: Vec<Vec<Signals>>,
    /// Horizontal velocity relative to the air by group and bin, show frame, m/s.
    pub relative_mps: Vec<Vec<[f64; 2]>>,
    /// Updraft that the whole flight is in, m/s; the signals' climb is relative to it.
    pub updraft_mps: f64,
    /// Each battery's voltage at rest, by group, drone and bin, V; `None` if it was not logged. One series for a
    /// group's mean drone.
    pub volts: Option<Pulses>,
    /// Number of cells in series, by the voltage at rest.
    pub cells: f64,
    /// Mean voltage at rest, V; 0 if it was not logged.
    pub resting_v: f64,
    /// Resistance of the batteries, ohm, if the logs have it.
    pub resistance_ohm: Option<f64>,
    /// Mean electrical power of the drones by group and bin, W; NaN where it was not logged.
    pub flown_w: Vec<Vec<f64>>,
    neighbours: Vec<Vec<f64>>,
    /// What the logs of another program's simulation have more than the model that stands for it.
    as_flown: Option<AsFlown>,
}

impl Scene {
    /// Signals of the measured flight: commanded climb as the simulator followed it, heights, air.
    pub fn measured(data: &Data, side: &[Vec<BinValues>], wind: &Wind, amsl_m: f64) -> Self {
        let signals = data
            .groups
            .iter()
            .enumerate()
            .map(|(index, group)| {
                let signal = |bin: usize| {
                    let air = wind.air_mps[index][bin];
                    let lean = |axis: usize| group.mean(bin, |values| values.lean_rad[axis]);
                    let height_m = group.mean(bin, |values| values.height_m);
                    Signals {
                        climb_mps: side[index][bin].climb_mps,
                        horizontal_mps: air[0].hypot(air[1]),
                        tilt_rad: lean(0).hypot(lean(1)),
                        height_m,
                        time_s: group.bins[bin].middle_s() - group.armed_s,
                        density_ratio: density_ratio(amsl_m + height_m),
                        ..Signals::default()
                    }
                };
                (0..group.bins.len()).map(signal).collect()
            })
            .collect();
        let logged = |values: &BinValues| values.resting_v.is_finite() && values.resting_v > 1.0;
        let each = || data.groups.iter().flat_map(|group| &group.measured).flatten();
        let logged = each().next().is_some() && each().all(logged);
        let of_group = |group: &super::data::Group| -> Vec<Vec<f64>> {
            let drones = group.measured.iter();
            drones.map(|drone| settled_volts(&group.bins, drone)).collect()
        };
        let volts: Option<Pulses> = logged.then(|| data.groups.iter().map(of_group).collect());
        let most = each().map(|values| values.resting_v).fold(0.0, f64::max);
        let cells = if logged { (most / FULL_CELL_V).ceil().max(1.0) } else { 1.0 };
        let resting_v =
            mean(each().map(|values| values.resting_v)).filter(|_| logged).unwrap_or_default();
        let neighbours = data.groups.iter().map(|group| group.neighbours.clone()).collect();
        let flown_w = |group: &super::data::Group| -> Vec<f64> {
            let of_drones = |bin: usize| group.measured.iter().map(move |drone| drone[bin].power_w);
            let logged = |bin: usize| of_drones(bin).filter(|power_w| power_w.is_finite());
            (0..group.bins.len()).map(|bin| mean(logged(bin)).unwrap_or(f64::NAN)).collect()
        };
        let flown_w = data.groups.iter().map(flown_w).collect();
        let resistance_ohm = data.resistance_ohm;
        let relative_mps = wind.air_mps.clone();
        let updraft_mps = 0.0;
        Self {
            signals,
            relative_mps,
            updraft_mps,
            volts,
            cells,
            resting_v,
            resistance_ohm,
            flown_w,
            neighbours,
            as_flown: None,
        }
    }

    /// The same flight of vehicles that answer climb as another program's logs do.
    #[must_use]
    pub(super) fn answering(self, as_flown: Option<&AsFlown>) -> Self {
        Self { as_flown: as_flown.cloned(), ..self }
    }

    fn steady(&self, vehicle: &Vehicle) -> Result<Steady, EffectError> {
        Ok(Steady::of(vehicle)?.answering(self.as_flown.as_ref()))
    }

    /// Only some bins, chosen by the places of group and bin.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize, usize) -> bool) -> Self {
        let mut scene = self.clone();
        for (group, signals) in scene.signals.iter_mut().enumerate() {
            keep_bins(signals, |bin| keep(group, bin));
        }
        for (group, air) in scene.relative_mps.iter_mut().enumerate() {
            keep_bins(air, |bin| keep(group, bin));
        }
        for (group, powers) in scene.flown_w.iter_mut().enumerate() {
            keep_bins(powers, |bin| keep(group, bin));
        }
        for (group, drones) in scene.volts.iter_mut().flatten().enumerate() {
            for volts in drones {
                keep_bins(volts, |bin| keep(group, bin));
            }
        }
        scene
    }

    /// The simulator's own flight: its leans in the air (show frame, m/s) that it was flown in.
    #[must_use]
    pub fn simulated(&self, data: &Data, side: &[Vec<BinValues>], air: [f64; 3]) -> Self {
        let logged = side.iter().flatten().all(|values| values.resting_v.is_finite());
        let of_group = |(group, side): (&super::data::Group, &Vec<BinValues>)| {
            vec![settled_volts(&group.bins, side)]
        };
        let volts = logged.then(|| data.groups.iter().zip(side).map(of_group).collect());
        let mut scene = Self { volts, ..self.clone() };
        for (index, group) in data.groups.iter().enumerate() {
            for (bin, signals) in scene.signals[index].iter_mut().enumerate() {
                let values = side[index][bin];
                let velocity = group.bins[bin].velocity_mps;
                let relative = [velocity[0] - air[0], velocity[1] - air[1]];
                signals.horizontal_mps = relative[0].hypot(relative[1]);
                scene.relative_mps[index][bin] = relative;
                signals.tilt_rad = values.lean_rad[0].hypot(values.lean_rad[1]);
            }
        }
        scene.neighbours.iter_mut().flatten().for_each(|count| *count = 0.0);
        scene
    }

    /// This scene as it is when the air rises by so much over the whole flight, m/s.
    #[must_use]
    pub fn in_updraft(&self, updraft_mps: f64) -> Self {
        let mut scene = self.clone();
        for signals in scene.signals.iter_mut().flatten() {
            signals.climb_mps -= updraft_mps - self.updraft_mps;
        }
        scene.updraft_mps = updraft_mps;
        scene
    }

    /// Charge left by the voltage at rest, by group, drone and bin, 0 to 1; `None` if it was not logged.
    pub(super) fn charge(&self) -> Option<Pulses> {
        let of = |volts: &f64| charge_of_cell(volts / self.cells);
        let drones = |group: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            group.iter().map(|volts| volts.iter().map(of).collect()).collect()
        };
        self.volts.as_ref().map(|groups| groups.iter().map(drones).collect())
    }

    /// This flight in another wind.
    #[must_use]
    pub(super) fn blown(mut self, wind: &Wind) -> Self {
        let groups = self.signals.iter_mut().zip(&mut self.relative_mps);
        for ((signals, relative), air) in groups.zip(&wind.air_mps) {
            for ((signals, relative), air) in signals.iter_mut().zip(relative).zip(air) {
                signals.horizontal_mps = air[0].hypot(air[1]);
                *relative = *air;
            }
        }
        self
    }

    /// Makes this flight's wind stronger along an axis of the show, m/s.
    pub(super) fn blow(&mut self, axis: usize, by_mps: f64) {
        let groups = self.signals.iter_mut().zip(&mut self.relative_mps);
        for (signals, relative) in groups.flat_map(|(signals, air)| signals.iter_mut().zip(air)) {
            relative[axis] -= by_mps;
            signals.horizontal_mps = relative[0].hypot(relative[1]);
        }
    }

    /// The moments of a group's bins.
    fn moments(&self, group: usize) -> impl Iterator<Item = Moment> {
        let air = self.relative_mps[group].iter();
        let both = self.signals[group].iter().zip(air);
        both.map(|(signals, relative)| Moment { signals: *signals, relative_mps: *relative })
    }

    /// Pulses that a vehicle's steady flight asks for, brought to level, us.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid, or with which it cannot fly so.
    pub fn pulses(&self, vehicle: &Vehicle) -> Result<Column, EffectError> {
        let values = self.signals.iter().zip(&self.neighbours);
        if values.map(|(bins, drones)| bins.len() * drones.len()).sum::<usize>() > MOST_VALUES {
            return self.pulses_of(vehicle);
        }
        PULSES.or_computed(self.digest(vehicle), || self.pulses_of(vehicle))
    }

    fn pulses_of(&self, vehicle: &Vehicle) -> Result<Column, EffectError> {
        let steady = self.steady(vehicle)?;
        let battery = hover_ah_per_s(vehicle);
        let hover_ah_per_s = battery.unwrap_or_default();
        let supply = |signals: &Signals, volts: Option<f64>| match volts {
            Some(volts) if battery.is_some() => Supply::Resting(volts),
            _ => Supply::Used(hover_ah_per_s * signals.time_s.max(0.0)),
        };
        let near = looks_at(vehicle, Signal::Neighbours);
        let volts = self.volts.as_ref().filter(|_| battery.is_some());
        if volts.is_none() && !near {
            let shared = self.each(&steady, |steady, _, at| {
                steady.pulse_us(at, supply(&at.signals, None), 0.0)
            })?;
            return Ok(Column::Shared(shared));
        }
        let by_bin = self.each(&steady, |steady, (group, bin), at| {
            // Batteries differ, and the balance of forces does not know them.
            let mut balance = None;
            let pulse = |(drone, neighbours): (usize, &f64)| {
                let balance = match balance {
                    Some(balance) if !near => balance,
                    _ => *balance.insert(steady.balance(at, *neighbours)?),
                };
                let volts = volts.map(|volts| {
                    let drones = &volts[group];
                    drones[drone.min(drones.len().saturating_sub(1))][bin]
                });
                steady.of_balance(&balance, at, supply(&at.signals, volts), *neighbours)
            };
            self.neighbours[group].iter().enumerate().map(pulse).collect::<Result<Vec<f64>, _>>()
        })?;
        let by_drone = |(bins, neighbours): (Vec<Vec<f64>>, &Vec<f64>)| -> Vec<Vec<f64>> {
            let drones = 0..neighbours.len();
            drones.map(|drone| bins.iter().map(|pulses| pulses[drone]).collect()).collect()
        };
        let of_drones = by_bin.into_iter().zip(&self.neighbours).map(by_drone).collect();
        Ok(Column::Own(of_drones))
    }

    /// Pulses by group and bin of the mean of as many drones as each group has, when that mean is by one standard
    /// deviation above the fleet's in what an effect of the vehicle lets drones differ, us.
    ///
    /// # Errors
    /// As [`Scene::pulses`].
    pub(super) fn deviating(
        &self,
        vehicle: &Vehicle,
        effect: &str,
    ) -> Result<Vec<Vec<f64>>, EffectError> {
        let mut digest = self.digest(vehicle);
        digest.add_debug(&effect);
        DEVIATING.or_computed(digest, || self.deviating_of(vehicle, effect))
    }

    fn deviating_of(&self, vehicle: &Vehicle, effect: &str) -> Result<Vec<Vec<f64>>, EffectError> {
        let mut of_groups = Vec::new();
        for group in 0..self.signals.len() {
            let drones = self.neighbours[group].len().max(1) as f64;
            let own = |of: &Definition| if of.name == effect { drones.sqrt().recip() } else { 0.0 };
            let deviating = Steady::deviating(vehicle, own)?;
            let mut steady = deviating.answering(self.as_flown.as_ref()).following();
            let supply = |at: &Moment| Supply::Used(at.signals.charge_used_ah);
            let pulse = |at: Moment| steady.pulse_us(&at, supply(&at), 0.0);
            of_groups.push(self.moments(group).map(pulse).collect::<Result<_, _>>()?);
        }
        Ok(of_groups)
    }

    /// Power of a vehicle's motors by group and bin, W.
    ///
    /// # Errors
    /// As [`Scene::pulses`].
    pub(super) fn power_w(&self, vehicle: &Vehicle) -> Result<Vec<Vec<f64>>, EffectError> {
        let steady = self.steady(vehicle)?;
        self.each(&steady, |steady, _, at| Ok(steady.balance(at, 0.0)?.power_w))
    }

    /// Whether [`Scene::response`] has an answer for sure.
    pub(super) fn surely_answers(&self, vehicle: &Vehicle) -> bool {
        let Ok(steady) = self.steady(&calm(vehicle)) else { return false };
        let hovers = self.each(&steady, |steady, _, at| Ok(steady.hovers(at)));
        hovers.is_ok_and(|hovers| hovers.into_iter().flatten().all(|hovers| hovers))
    }

    /// Response to vertical air speed of a model by group and bin: by the whole model, so that effects that
    /// build on the rest of it are in it.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid, or with which it cannot fly so.
    pub fn response(&self, vehicle: &Vehicle) -> Result<Vec<Vec<Response>>, EffectError> {
        RESPONSES.or_computed(self.digest(vehicle), || {
            let steady = self.steady(&calm(vehicle))?;
            self.each(&steady, |steady, _, at| steady.response(at))
        })
    }

    /// All that the pulses of a vehicle's steady flight follow from.
    fn digest(&self, vehicle: &Vehicle) -> Digest {
        // All fields by name: a new one must be taken in, too.
        let Self {
            signals,
            relative_mps,
            updraft_mps: _,
            volts,
            cells: _,
            resting_v: _,
            resistance_ohm: _,
            flown_w: _,
            neighbours,
            as_flown,
        } = self;
        let mut digest = Digest::new();
        for group in signals {
            for at in group {
                // What is left out is not looked at by a steady state (`Moment::condition`).
                let Signals {
                    climb_mps,
                    horizontal_mps: _,
                    tilt_rad: _,
                    height_m,
                    time_s,
                    density_ratio,
                    charge_used_ah,
                    acceleration_mps2,
                    deviation: _,
                    neighbours: _,
                    increment_us: _,
                    sensitivity: _,
                } = at;
                let of_air = [climb_mps, height_m, density_ratio, acceleration_mps2];
                digest.add_all(of_air.into_iter().chain([time_s, charge_used_ah]));
            }
            digest.add(group.len() as u64);
        }
        digest.add_all(relative_mps.iter().flatten().flatten());
        digest.add(u64::from(volts.is_some()));
        for drones in volts.iter().flatten() {
            for bins in drones {
                digest.add_all(bins);
            }
            digest.add(drones.len() as u64);
        }
        for group in neighbours {
            digest.add_all(group);
        }
        digest.add_debug(as_flown);
        digest.add_debug(vehicle);
        digest
    }

    /// Something of each moment, by group and bin.
    fn each<T: Send>(
        &self,
        steady: &Steady,
        of: impl Fn(&mut Steady, (usize, usize), &Moment) -> Result<T, EffectError> + Sync,
    ) -> Result<Vec<Vec<T>>, EffectError> {
        let of_group = |group: usize| {
            let moments: Vec<Moment> = self.moments(group).collect();
            let some = |(chunk, moments): (usize, &[Moment])| -> Result<Vec<T>, EffectError> {
                let mut steady = steady.clone().following();
                let bins = (chunk * CHUNK..).zip(moments);
                bins.map(|(bin, at)| of(&mut steady, (group, bin), at)).collect()
            };
            // The first error, whichever thread is the first.
            let parts: Vec<Result<Vec<T>, EffectError>> =
                moments.par_chunks(CHUNK).enumerate().map(some).collect();
            let parts: Vec<Vec<T>> = parts.into_iter().collect::<Result<_, _>>()?;
            Ok(parts.into_iter().flatten().collect())
        };
        (0..self.signals.len()).map(of_group).collect()
    }

    /// Pulses by group and bin at vertical speeds that differ from the flown one by so much, of the mean drone, us.
    ///
    /// # Errors
    /// As [`Scene::pulses`].
    pub(super) fn shifted(
        &self,
        vehicle: &Vehicle,
        shifts_mps: &[f64],
    ) -> Result<Vec<Vec<Vec<f64>>>, EffectError> {
        let mut digest = self.digest(vehicle);
        digest.add_all(shifts_mps);
        SHIFTED.or_computed(digest, || {
            let steady = self.steady(vehicle)?;
            self.each(&steady, |steady, _, at| {
                let pulse = |shift_mps: &f64| {
                    let shifted = at.climbing(at.signals.climb_mps + shift_mps);
                    steady.pulse_us(&shifted, Supply::Used(at.signals.charge_used_ah), 0.0)
                };
                shifts_mps.iter().map(pulse).collect()
            })
        })
    }
}

/// Only some bins of a series.
fn keep_bins<T>(series: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut bins = 0..;
    series.retain(|_| bins.next().is_some_and(&keep));
}

/// A vehicle without what shakes: that has a scatter of its own, which hides how it answers gusts.
fn calm(vehicle: &Vehicle) -> Vehicle {
    let mut calm = vehicle.clone();
    calm.effects.retain(|name, _| !shakes(name));
    calm
}

/// Whether an effect has a scatter of its own.
fn shakes(effect: &str) -> bool {
    Role::Scatter.is_of(effect)
}

/// Charge that a hover takes out of a vehicle's battery, Ah/s; `None`: it has no battery.
fn hover_ah_per_s(vehicle: &Vehicle) -> Option<f64> {
    Some(hover_a(vehicle)? / 3600.0)
}

/// Current of a vehicle's hover, A; `None`: it has no battery.
fn hover_a(vehicle: &Vehicle) -> Option<f64> {
    Role::BatteryCharge.value(vehicle)?;
    let of = |role: Role| role.value(vehicle).unwrap_or_default();
    let power_w = Reference::of(vehicle).hover_w() + of(Role::BatteryAvionics);
    Some(power_w / of(Role::BatteryReference).max(0.1))
}

/// A battery's voltage at rest in each bin without the scatter of the bins, V: by a cubic of time. What a logger
/// makes of voltage and current follows the pulse from bin to bin, and must not explain it.
fn settled_volts(bins: &[Bin], values: &[BinValues]) -> Vec<f64> {
    let times: Vec<f64> = bins.iter().map(Bin::middle_s).collect();
    let volts = DVector::from_iterator(values.len(), values.iter().map(|one| one.resting_v));
    let Some((first, last)) = extent(&times) else { return Vec::new() };
    let scaled = |time: &f64| (2.0 * time - first - last) / (last - first).max(1.0);
    let powers = DMatrix::from_fn(times.len(), VOLTS_POWERS.min(times.len()), |bin, power| {
        scaled(&times[bin]).powi(power as i32)
    });
    let fitted = powers.clone().svd(true, true).solve(&volts, 1e-12).ok();
    fitted.map_or_else(
        || volts.iter().copied().collect(),
        |of| (powers * of).iter().copied().collect(),
    )
}

/// Powers of time in a battery's voltage: the curve of a cell over a flight is a cubic within hundredths of a
/// volt. Chosen.
const VOLTS_POWERS: usize = 4;
