//! Signals that closed forms take in each bin, and the pulses of a model for them.

use super::as_flown::AsFlown;
use super::bins::BinValues;
use super::data::Data;
use super::gls::Column;
use super::lean::Wind;
use super::response::Response;
use super::steady::{Moment, Steady};
use crate::base::air::density_ratio;
use crate::effects::cell::charge_of_cell;
use crate::effects::select::looks_at;
use crate::effects::{EffectError, Reference, Role, Signal, Signals};
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Open-circuit voltage above which there must be another cell, V: a full lithium polymer cell has 4.20 V.
const FULL_CELL_V: f64 = 4.25;

/// Bins that show what charge a battery started with: the first minute or so. Chosen.
const EARLY_BINS: usize = 12;
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
    /// Charge left by the voltage at rest, by group, drone and bin, 0 to 1; `None` if it was not
    /// logged.
    pub charge: Option<Vec<Vec<Vec<f64>>>>,
    /// Number of cells in series, by the voltage at rest.
    pub cells: f64,
    /// Mean voltage at rest, V; 0 if it was not logged.
    pub resting_v: f64,
    /// Resistance of the batteries as the logs have it, ohm.
    pub resistance_ohm: Option<f64>,
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
        let volts: Vec<f64> = data
            .groups
            .iter()
            .flat_map(|group| &group.measured)
            .flatten()
            .map(|v| v.resting_v)
            .collect();
        let logged =
            !volts.is_empty() && volts.iter().all(|volts| volts.is_finite() && *volts > 1.0);
        let most = volts.iter().copied().fold(0.0, f64::max);
        let cells = if logged { (most / FULL_CELL_V).ceil().max(1.0) } else { 1.0 };
        let charge = logged.then(|| {
            let of = |values: &BinValues| charge_of_cell(values.resting_v / cells);
            let drones = |group: &super::data::Group| -> Vec<Vec<f64>> {
                group.measured.iter().map(|drone| drone.iter().map(of).collect()).collect()
            };
            // Who needs more pulse drains the battery faster: a drone's own decline follows its pulse.
            // What it started with, and how its group declined, do not.
            let exogenous = |drones: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
                let bins = drones.first().map_or(0, Vec::len);
                let declined = |bin: usize| mean(drones.iter().map(|d| d[bin] - d[0]));
                let decline: Vec<f64> =
                    (0..bins).map(|bin| declined(bin).unwrap_or_default()).collect();
                // By some bins: the scatter of one voltage is worth some percent of charge.
                let first = |drone: &Vec<f64>| {
                    let early = drone.iter().zip(&decline).take(EARLY_BINS);
                    let (sum, count) =
                        early.fold((0.0, 0.0), |(s, c), (now, less)| (s + now - less, c + 1.0));
                    if count > 0.0 { sum / count } else { 0.0 }
                };
                let from = |first: f64| decline.iter().map(|less| first + less).collect();
                drones.iter().map(|drone| from(first(drone))).collect()
            };
            data.groups.iter().map(drones).map(exogenous).collect()
        });
        let resting_v = mean(&volts).filter(|_| logged).unwrap_or_default();
        let neighbours = data.groups.iter().map(|group| group.neighbours.clone()).collect();
        let resistance_ohm = data.resistance_ohm;
        let relative_mps = wind.air_mps.clone();
        let updraft_mps = 0.0;
        Self {
            signals,
            relative_mps,
            updraft_mps,
            charge,
            cells,
            resting_v,
            resistance_ohm,
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
            let mut bin = 0;
            signals.retain(|_| {
                bin += 1;
                keep(group, bin - 1)
            });
        }
        for (group, air) in scene.relative_mps.iter_mut().enumerate() {
            let mut bin = 0;
            air.retain(|_| {
                bin += 1;
                keep(group, bin - 1)
            });
        }
        for (group, drones) in scene.charge.iter_mut().flatten().enumerate() {
            for charge in drones {
                let mut bin = 0;
                charge.retain(|_| {
                    bin += 1;
                    keep(group, bin - 1)
                });
            }
        }
        scene
    }

    /// The simulator's own flight: its leans in the mean wind.
    #[must_use]
    pub fn simulated(&self, data: &Data, side: &[Vec<BinValues>], wind: [f64; 2]) -> Self {
        let mut scene = Self { charge: None, ..self.clone() };
        for (index, group) in data.groups.iter().enumerate() {
            for (bin, signals) in scene.signals[index].iter_mut().enumerate() {
                let values = side[index][bin];
                let velocity = group.bins[bin].velocity_mps;
                let relative = [velocity[0] - wind[0], velocity[1] - wind[1]];
                signals.horizontal_mps = relative[0].hypot(relative[1]);
                scene.relative_mps[index][bin] = relative;
                signals.tilt_rad = values.lean_rad[0].hypot(values.lean_rad[1]);
            }
        }
        scene.neighbours.iter_mut().flatten().for_each(|count| *count = 0.0);
        scene
    }

    /// The same flight in another updraft, m/s.
    #[must_use]
    pub fn in_updraft(&self, updraft_mps: f64) -> Self {
        let mut scene = self.clone();
        for signals in scene.signals.iter_mut().flatten() {
            signals.climb_mps -= updraft_mps - self.updraft_mps;
        }
        scene.updraft_mps = updraft_mps;
        scene
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
        let mut steady = self.steady(vehicle)?;
        let battery = Battery::of(vehicle);
        let hover_ah_per_s = battery.as_ref().map_or(0.0, |battery| battery.hover_ah_per_s);
        let used_ah = |signals: &Signals, charge: Option<f64>| match (&battery, charge) {
            (Some(battery), Some(charge)) => (battery.initial - charge) * battery.capacity_ah,
            _ => hover_ah_per_s * signals.time_s.max(0.0),
        };
        let near = looks_at(vehicle, Signal::Neighbours);
        let own = (battery.is_some() && self.charge.is_some()) || near;
        let groups = 0..self.signals.len();
        if !own {
            let mut shared = Vec::new();
            for group in groups {
                let pulse = |at: Moment| steady.pulse_us(&at, used_ah(&at.signals, None), 0.0);
                shared.push(self.moments(group).map(pulse).collect::<Result<_, _>>()?);
            }
            return Ok(Column::Shared(shared));
        }
        let mut of_drones = Vec::new();
        for group in groups {
            let mut drones = vec![Vec::new(); self.neighbours[group].len()];
            for (bin, at) in self.moments(group).enumerate() {
                // Batteries differ, and the balance of forces does not know them.
                let mut balance = None;
                for (drone, pulses) in drones.iter_mut().enumerate() {
                    let neighbours = self.neighbours[group][drone];
                    let balance = match balance {
                        Some(balance) if !near => balance,
                        _ => *balance.insert(steady.balance(&at, neighbours)?),
                    };
                    let charge = self.charge.as_ref().map(|charge| charge[group][drone][bin]);
                    let used_ah = used_ah(&at.signals, charge);
                    pulses.push(steady.of_balance(&balance, &at, used_ah, neighbours)?);
                }
            }
            of_drones.push(drones);
        }
        Ok(Column::Own(of_drones))
    }

    /// Response to vertical air speed of a model by group and bin: by the whole model, so that effects that
    /// build on the rest of it are in it.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid, or with which it cannot fly so.
    pub fn response(&self, vehicle: &Vehicle) -> Result<Vec<Vec<Response>>, EffectError> {
        let mut calm = vehicle.clone();
        // What shakes has a scatter of its own, which hides how it answers gusts.
        calm.effects.retain(|name, _| !shakes(name));
        let mut steady = self.steady(&calm)?;
        let groups = 0..self.signals.len();
        groups.map(|group| self.moments(group).map(|at| steady.response(&at)).collect()).collect()
    }

    /// Pulses by group and bin at vertical speeds that differ from the flown one by so much, of the mean drone, us.
    ///
    /// # Errors
    /// As [`Scene::pulses`].
    pub(super) fn shifted<const COUNT: usize>(
        &self,
        vehicle: &Vehicle,
        shifts_mps: [f64; COUNT],
    ) -> Result<Vec<Vec<[f64; COUNT]>>, EffectError> {
        let mut steady = self.steady(vehicle)?;
        let mut of = |at: Moment| -> Result<[f64; COUNT], EffectError> {
            let mut pulses_us = [0.0; COUNT];
            for (pulse_us, shift_mps) in pulses_us.iter_mut().zip(shifts_mps) {
                let shifted = at.climbing(at.signals.climb_mps + shift_mps);
                *pulse_us = steady.pulse_us(&shifted, at.signals.charge_used_ah, 0.0)?;
            }
            Ok(pulses_us)
        };
        let groups = 0..self.signals.len();
        groups.map(|group| self.moments(group).map(&mut of).collect()).collect()
    }
}

/// Whether an effect has a scatter of its own.
fn shakes(effect: &str) -> bool {
    Role::Scatter.is_of(effect)
}

struct Battery {
    initial: f64,
    capacity_ah: f64,
    hover_ah_per_s: f64,
}

impl Battery {
    fn of(vehicle: &Vehicle) -> Option<Self> {
        let initial = Role::BatteryCharge.value(vehicle)?;
        let of = |role: Role| role.value(vehicle).unwrap_or_default();
        let power_w = Reference::of(vehicle).hover_w() + of(Role::BatteryAvionics);
        Some(Self {
            initial,
            capacity_ah: of(Role::BatteryCapacity),
            hover_ah_per_s: power_w / of(Role::BatteryReference).max(0.1) / 3600.0,
        })
    }
}
