//! Signals that closed forms take in each bin, and the pulses of a model for them.

use super::bins::BinValues;
use super::compare::thrust_exponent;
use super::data::Data;
use super::gls::Column;
use super::lean::Wind;
use super::response::Response;
use crate::base::air::density_ratio;
use crate::effects::cell::charge_of_cell;
use crate::effects::select::looks_at;
use crate::effects::{EffectError, Model, Reference, Role, Signal, Signals};
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Open-circuit voltage above which there must be another cell, V: a full lithium polymer cell has 4.20 V.
const FULL_CELL_V: f64 = 4.25;

/// Bins that show what charge a battery started with: the first minute or so. Chosen.
const EARLY_BINS: usize = 12;
/// Pulse without thrust, us: the convention of all controllers (docs/physics.md, 1.1).
pub(super) const IDLE_US: f64 = 1000.0;

/// Steady signals of a comparison: what was flown and what the logs say of wind and battery. None of
/// them follows the pulse: terminal voltage, current and measured acceleration do and are never used
/// (endogenous regressors; docs/physics.md, 3.1).
#[derive(Clone, Debug)]
pub struct Scene {
    /// Signals by group and bin.
    pub signals: Vec<Vec<Signals>>,
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
        Self { signals, charge, cells, resting_v, resistance_ohm, neighbours }
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
                signals.horizontal_mps = (velocity[0] - wind[0]).hypot(velocity[1] - wind[1]);
                signals.tilt_rad = values.lean_rad[0].hypot(values.lean_rad[1]);
            }
        }
        scene.neighbours.iter_mut().flatten().for_each(|count| *count = 0.0);
        scene
    }

    /// Pulses that a vehicle's model asks for, brought to level, us.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub fn pulses(&self, vehicle: &Vehicle) -> Result<Column, EffectError> {
        let model = Model::of(vehicle)?;
        let exponent = thrust_exponent(vehicle);
        let battery = Battery::of(vehicle);
        let hover_ah_per_s = battery.as_ref().map_or(0.0, |battery| battery.hover_ah_per_s);
        let at = |signals: &Signals, charge: Option<f64>, neighbours: f64| {
            let charge_used_ah = match (&battery, charge) {
                (Some(battery), Some(charge)) => (battery.initial - charge) * battery.capacity_ah,
                _ => hover_ah_per_s * signals.time_s.max(0.0),
            };
            let pulse_us = model.pulse_us(&Signals { charge_used_ah, neighbours, ..*signals });
            // As both sides of the comparison are: brought to level by their own lean.
            IDLE_US + (pulse_us - IDLE_US) * signals.tilt_rad.cos().powf(exponent)
        };
        let own =
            (battery.is_some() && self.charge.is_some()) || looks_at(vehicle, Signal::Neighbours);
        if !own {
            let of = |signals: &Vec<Signals>| signals.iter().map(|s| at(s, None, 0.0)).collect();
            return Ok(Column::Shared(self.signals.iter().map(of).collect()));
        }
        let drone = |group: usize, drone: usize| -> Vec<f64> {
            self.signals[group]
                .iter()
                .enumerate()
                .map(|(bin, signals)| {
                    let charge = self.charge.as_ref().map(|charge| charge[group][drone][bin]);
                    at(signals, charge, self.neighbours[group][drone])
                })
                .collect()
        };
        let group = |index: usize| {
            (0..self.neighbours[index].len()).map(|which| drone(index, which)).collect()
        };
        Ok(Column::Own((0..self.signals.len()).map(group).collect()))
    }

    /// Response to vertical air speed of a model by group and bin: by the whole model, so that effects that
    /// build on the rest of it are in it.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub fn response(&self, vehicle: &Vehicle) -> Result<Vec<Vec<Response>>, EffectError> {
        let mut calm = vehicle.clone();
        // What shakes has a scatter of its own, which hides how it answers gusts.
        calm.effects.retain(|name, _| !shakes(name));
        let model = Model::of(&calm)?;
        let of = |signals: &Signals| {
            let at = |climb_mps| model.pulse_us(&Signals { climb_mps, ..*signals });
            Response::of(|shift_mps| at(signals.climb_mps + shift_mps))
        };
        Ok(self.signals.iter().map(|group| group.iter().map(of).collect()).collect())
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
