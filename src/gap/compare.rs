//! One comparison: the measured side, the simulated side, and the residual for any vehicle.

use std::borrow::Cow;
use std::f64::consts::PI;
use std::ops::RangeInclusive;
use std::sync::OnceLock;

use super::bins::BinValues;
use super::data::{Data, Group};
use super::error::GapError;
use super::generic::climb_shapes;
use super::gls::{Column, Pulses};
use super::lean::{self, Wind, mean_wind, mean_wind_by, wind, wind_by};
use super::lean_fit::Body;
use super::lean_law::LeanLaw;
use super::noise::GroupPattern;
use super::refly::mean_drone;
use super::response::{self, Response};
use super::scene::Scene;
use super::side::{Side, changed, fly_groups, fly_in_told_wind, lean_steadily};
use super::spreads::{Differences, Spread};
use super::stand_in::{as_flown, own_wind};
use crate::base::air::{SEA_LEVEL_DENSITY, density_ratio};
use crate::effects::{EffectError, Reference, Role};
use crate::mission::plan::Plan;
use crate::numeric::{Moments, mean, most};
use crate::vehicle::Vehicle;

/// The simulated side of a comparison.
#[derive(Clone, Debug)]
pub enum Simulated<'a> {
    /// A simulation of the plan by the embedded simulator.
    Refly(&'a Plan),
    /// Logs of another program's simulation.
    Given {
        /// Simulated values, by group and bin; `None` where the simulation lacks the bin.
        values: Vec<Vec<Option<BinValues>>>,
        /// The model that stands for what it flew. Nobody can fly it again with something added: what is
        /// added is what it does to the model in the embedded simulator, or, without a plan, by the closed
        /// forms.
        flew: &'a Vehicle,
        /// Whether another program flew it: its plant need not be the model's.
        is_foreign: bool,
    },
    /// The model's closed forms at the climb that was flown, as there is no plan to simulate.
    Closed,
}

/// Measurement and simulation, bin by bin, for one state of the model.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Measured values; bins that the simulation lacks are left out.
    pub data: Data,
    /// Simulated values, by group and bin.
    pub side: Vec<Vec<BinValues>>,
    /// Signals that closed forms take.
    pub scene: Scene,
    /// Wind, as the leans of the flight show it.
    pub wind: Wind,
    /// Law of leaning by which the wind was read, where no leg told it.
    read_by: LeanLaw,
    /// Air that the simulated side was flown in, show frame, z up, m/s.
    pub(super) flown_mps: [f64; 3],
    /// Updraft that it was flown for, m/s, in one that is nearly the same.
    of_updraft_mps: f64,
    /// Mean drone that flew it: this one, but for sizes that are nearly the same.
    flew: Vehicle,
    /// What the closed loop does besides the closed form, by group and bin, us.
    closure_us: Vec<Vec<f64>>,
    /// What no effect of the vehicle adds to the response to vertical air speed; empty: nothing.
    felt: Vec<Vec<Response>>,
    amsl_m: f64,
    /// Mean drone of the fleet, by the model.
    pub vehicle: Vehicle,
    /// What makes drones differ by the model.
    pub(super) spreads: Vec<Spread>,
    /// Whether another program simulated the other side.
    is_foreign: bool,
    /// Wind that another program simulated, where the measured drones flew in another, m/s.
    other_wind_mps: Option<[f64; 2]>,
    /// Whether the simulated side was flown for this comparison.
    is_flown: bool,
    /// How unlikely the leans are, nats, once it was asked for.
    lean_misfit_nats: OnceLock<f64>,
}

/// Power of thrust that `u - 1000` goes with at hover.
pub(super) fn thrust_exponent(vehicle: &Vehicle) -> f64 {
    let at = Reference::of(vehicle);
    (at.sensitivity_us() / (at.hover_us() - 1000.0)).clamp(0.2, 1.5)
}

/// Ground height of a comparison, m above mean sea level.
pub(super) fn amsl_m(plan: Option<&Plan>) -> f64 {
    plan.map_or(0.0, |plan| plan.site.ground_amsl_m)
}

/// How a vehicle leans in the air at a height.
pub(super) fn lean_law(vehicle: &Vehicle, amsl_m: f64, updraft_mps: f64) -> LeanLaw {
    LeanLaw::of(vehicle, SEA_LEVEL_DENSITY * density_ratio(amsl_m), updraft_mps)
}

/// The wind, or so much of it that the vehicle can fly every leg in it, m/s.
fn flyable(data: &Data, law: LeanLaw, wind_mps: [f64; 2]) -> [f64; 2] {
    let bins = data.groups.iter().flat_map(|group| &group.bins);
    let legs = bins.filter(|bin| bin.is_horizontal());
    let fastest = most(legs.map(|bin| bin.velocity_mps[0].hypot(bin.velocity_mps[1])));
    let bound_mps = (law.fastest_mps - fastest.unwrap_or(0.0)).max(0.0);
    let speed_mps = wind_mps[0].hypot(wind_mps[1]);
    if speed_mps > bound_mps { wind_mps.map(|part| part * bound_mps / speed_mps) } else { wind_mps }
}

/// Times that the wind is read again after it was flown in, at most. Numerical.
const READINGS: usize = 3;
/// As [`READ_WITHIN_MPS`], without legs: hovers hardly show what wind they were flown in. Chosen.
const HOVERS_READ_WITHIN_MPS: f64 = 0.3;
/// A wind that is read so near to the one that was flown in is the same, m/s. Chosen: legs tell a mean wind with a standard error
/// of 0.1 to 0.2 m/s.
const READ_WITHIN_MPS: f64 = 0.15;

/// The wind to fly in where another was flown in before, m/s: that one, if it is the same.
fn beside([x_mps, y_mps, _]: [f64; 3], read_mps: [f64; 2]) -> [f64; 2] {
    let apart_mps = (read_mps[0] - x_mps).hypot(read_mps[1] - y_mps);
    if apart_mps < READ_WITHIN_MPS { [x_mps, y_mps] } else { read_mps }
}

/// Updrafts in which models are flown are so far apart, m/s; in between the closed form adds what it changes. Chosen: on the paper's
/// ladder AirSim's quad with inflow, flown in an updraft between two, is then met within 0.1 us rms, and 0.3 us in every bin.
const FLOWN_EACH_MPS: f64 = 0.125;
/// Sizes of effects that differ by no more than this share fly the same, but for what the closed form tells of them. Chosen likewise.
const FLOWN_SIZE: f64 = 0.02;

/// The updraft to fly in instead of one, m/s.
fn flown_beside(updraft_mps: f64) -> f64 {
    (updraft_mps / FLOWN_EACH_MPS).round() * FLOWN_EACH_MPS
}

/// Whether two vehicles differ in nothing but sizes that are nearly the same.
fn fly_alike(one: &Vehicle, other: &Vehicle) -> bool {
    let mut moved = one.clone();
    for (name, table) in &mut moved.effects {
        let Some(there) = other.effects.get(name) else { continue };
        for (name, value) in &mut table.parameters {
            let near = there.parameters.get(name);
            if let Some(there) = near.filter(|to| (**to - *value).abs() < FLOWN_SIZE * to.abs()) {
                *value = *there;
            }
        }
    }
    moved == *other
}

impl Comparison {
    /// Flies (or takes) the simulated side of a vehicle.
    ///
    /// # Errors
    /// The vehicle cannot fly the plan, or nothing is common to both sides.
    pub fn new(
        data: &Data,
        vehicle: &Vehicle,
        simulated: &Simulated<'_>,
        plan: Option<&Plan>,
    ) -> Result<Self, GapError> {
        Self::of(data, vehicle, simulated, plan, 0.0, None)
    }

    /// Flies (or takes) the simulated side of a vehicle for a flight that is in an updraft all over, m/s. Another
    /// comparison of the same data with a similar model, if there is one, tells the wind to begin with.
    ///
    /// # Errors
    /// As [`Comparison::new`].
    pub(super) fn of(
        data: &Data,
        vehicle: &Vehicle,
        simulated: &Simulated<'_>,
        plan: Option<&Plan>,
        updraft_mps: f64,
        near: Option<&Self>,
    ) -> Result<Self, GapError> {
        let spreads = Spread::all_of(vehicle);
        let vehicle = mean_drone(vehicle);
        let amsl_m = amsl_m(plan);
        let law = lean_law(&vehicle, amsl_m, updraft_mps);
        // Logs of another simulation, and closed forms, are in still air.
        let flown_updraft_mps =
            if matches!(simulated, Simulated::Refly(_)) { flown_beside(updraft_mps) } else { 0.0 };
        let air = |[x_mps, y_mps]: [f64; 2]| [x_mps, y_mps, flown_updraft_mps];
        let first = air(match simulated {
            Simulated::Given { values, flew, is_foreign: true } => {
                own_wind(data, values, flew, amsl_m)
            }
            _ => flyable(data, law, mean_wind(data, law, None)),
        });
        let as_flown = match simulated {
            Simulated::Given { values, flew, is_foreign: true } => {
                as_flown(data, values, &mean_drone(flew), (law, first, amsl_m))?
            }
            _ => None,
        };
        let moves = data.has_legs();
        let fly = |air_mps: [f64; 3]| -> Result<([f64; 3], Side), GapError> {
            let values = match simulated {
                Simulated::Given { values, flew, .. } => {
                    let flew = mean_drone(flew);
                    match plan.filter(|_| flew != vehicle && as_flown.is_none()) {
                        Some(plan) => {
                            let without = fly_groups(data, &flew, plan, air_mps)?;
                            let with = fly_groups(data, &vehicle, plan, air_mps)?;
                            changed(values, &without, &with)
                        }
                        None => values.clone(),
                    }
                }
                Simulated::Refly(plan) => {
                    let (air_mps, mut values) = if moves {
                        fly_in_told_wind(data, &vehicle, plan, air_mps)?
                    } else {
                        (air_mps, fly_groups(data, &vehicle, plan, air_mps)?)
                    };
                    lean_steadily(data, &mut values, law, air_mps);
                    return Ok((air_mps, values));
                }
                Simulated::Closed => data.as_flown(),
            };
            Ok((air_mps, values))
        };
        // What the legs say of the wind is better than what hovers say by the model's law alone.
        let mut flown_mps = match near.filter(|_| moves) {
            _ if !moves || !matches!(simulated, Simulated::Refly(_)) => first,
            Some(near) => {
                // Where the law is the same, so is the wind.
                let read_mps = if lean_law(&near.vehicle, amsl_m, near.scene.updraft_mps) == law {
                    near.wind.mean_mps
                } else {
                    // What its side lacks of its steady leans it lacks by the law that it was flown with.
                    let flown_law = lean_law(&near.vehicle, amsl_m, near.flown_mps[2]);
                    let flown = Some((near.side.as_slice(), near.flown_mps));
                    flyable(data, law, mean_wind_by(&near.data, law, flown_law, flown))
                };
                air(beside(near.flown_mps, read_mps))
            }
            None => {
                let (first, values) = fly(first)?;
                let whole = data.keep(|group, bin| values[group][bin].is_some());
                let read_mps = mean_wind(&whole, law, Some((&flat(&values), first)));
                air(beside(first, flyable(data, law, read_mps)))
            }
        };
        let mut alike = near.filter(|near| near.flew_alike(data, &vehicle, flown_mps));
        let mut values: Side;
        if let Some(near) = alike {
            flown_mps = near.flown_mps;
            let some = |group: &Vec<BinValues>| group.iter().copied().map(Some).collect();
            values = near.side.iter().map(some).collect();
        } else {
            (flown_mps, values) = fly(flown_mps)?;
        }
        // What legs lack of their steady lean depends on the wind that they were flown in, and so does what hovers lack of
        // it after a climb or a descent at the end of what the vehicle can lean.
        let rounds = if matches!(simulated, Simulated::Refly(_)) { READINGS } else { 0 };
        let within_mps = if moves { READ_WITHIN_MPS } else { HOVERS_READ_WITHIN_MPS };
        // A reading can run away from what was flown: then what is flown next is halfway to it from where both were nearest.
        let mut nearest: Option<Reading> = None;
        for round in 0..=rounds {
            let whole = data.keep(|group, bin| values[group][bin].is_some());
            let read = mean_wind(&whole, law, Some((&flat(&values), flown_mps)));
            let read = air(flyable(data, law, read));
            let apart_mps = (read[0] - flown_mps[0]).hypot(read[1] - flown_mps[1]);
            if rounds == 0 || apart_mps < within_mps {
                nearest = None;
                break;
            }
            let next_mps = match &mut nearest {
                Some(best) if best.apart_mps <= apart_mps => best.halfway(),
                _ => {
                    let values = std::mem::take(&mut values);
                    nearest = Some(Reading { apart_mps, flown_mps, values, towards_mps: read });
                    read
                }
            };
            if round == rounds {
                break;
            }
            match fly(next_mps) {
                // What was flown before is the nearest that it can.
                Err(error) if moves && error.is_not_flown() => break,
                flown => (flown_mps, values) = flown?,
            }
        }
        if let Some(best) = nearest {
            (flown_mps, values) = (best.flown_mps, best.values);
        }
        // The other flight was in another wind than this one is read to have been in.
        alike = alike.filter(|near| near.flown_mps == flown_mps);
        let has = |group: usize, bin: usize| values[group][bin].is_some();
        let data = data.keep(has);
        let mut side = flat(&values);
        if data.groups.iter().map(|group| group.bins.len()).sum::<usize>() < FEWEST_BINS {
            return Err(GapError::NothingCommon);
        }
        let blown = wind(&data, law, Some((&side, flown_mps)));
        let scene = Scene::measured(&data, &side, &blown, amsl_m).answering(as_flown.as_ref());
        let simulated_scene =
            scene.in_updraft(flown_updraft_mps).simulated(&data, &side, flown_mps);
        let scene = scene.in_updraft(updraft_mps);
        let closed = match simulated {
            Simulated::Given { flew, .. } if plan.is_none() || as_flown.is_some() => {
                simulated_scene.pulses(&mean_drone(flew))?
            }
            _ => simulated_scene.pulses(&vehicle)?,
        };
        let is_closed = matches!(simulated, Simulated::Closed);
        for (group, bins) in side.iter_mut().enumerate() {
            for (bin, values) in bins.iter_mut().enumerate() {
                if is_closed || values.carried_away {
                    values.pulse_us = closed.at(group, 0, bin);
                }
            }
        }
        let apart = |(group, bins): (usize, &Vec<BinValues>)| {
            let apart =
                |(bin, values): (usize, &BinValues)| values.pulse_us - closed.at(group, 0, bin);
            bins.iter().enumerate().map(apart).collect()
        };
        let closure_us = match alike {
            Some(near) => near.closure_us.clone(),
            None => side.iter().enumerate().map(apart).collect(),
        };
        let is_foreign = matches!(simulated, Simulated::Given { is_foreign: true, .. });
        let mut comparison = Self {
            data,
            side,
            scene,
            wind: blown,
            read_by: law,
            flown_mps,
            of_updraft_mps: updraft_mps,
            flew: alike.map_or_else(|| vehicle.clone(), |near| near.flew.clone()),
            closure_us,
            felt: Vec::new(),
            amsl_m,
            vehicle,
            spreads,
            is_foreign,
            other_wind_mps: None,
            is_flown: matches!(simulated, Simulated::Refly(_)),
            lean_misfit_nats: OnceLock::new(),
        };
        if is_foreign && comparison.apart_rad() > OTHER_WIND_DEG.to_radians() {
            comparison.other_wind_mps = Some([flown_mps[0], flown_mps[1]]);
        }
        Ok(comparison)
    }

    /// Whether this was flown for the same logs by nearly the same vehicle, in the air that another is to fly in, show frame, m/s.
    fn flew_alike(&self, data: &Data, vehicle: &Vehicle, air_mps: [f64; 3]) -> bool {
        let [x_mps, y_mps, updraft_mps] = air_mps;
        let is_same_fleet = || {
            let (own, others) = (&self.data.groups, &data.groups);
            own.len() == others.len()
                && own.iter().zip(others).all(|(own, other)| {
                    own.slots == other.slots && own.bins.len() == other.bins.len()
                })
        };
        self.is_flown
            && self.flown_mps[2] == updraft_mps
            && beside(self.flown_mps, [x_mps, y_mps]) == self.flown_mps[..2]
            && is_same_fleet()
            && fly_alike(vehicle, &self.flew)
    }

    /// This comparison in a flight that is in an updraft all over, m/s, with the wind that the leans tell there.
    #[must_use]
    pub(super) fn in_updraft(mut self, updraft_mps: f64) -> Self {
        self.scene = self.scene.in_updraft(updraft_mps);
        if !self.reads_wind(&self.vehicle) {
            return self;
        }
        let law = lean_law(&self.vehicle, self.amsl_m, updraft_mps);
        if !law.reads_as(self.read_by) {
            self.wind = self.wind_by(law);
            self.scene = self.scene.blown(&self.wind);
            self.read_by = law;
        }
        self
    }

    /// This comparison with an additional response to vertical air speed, by group and bin, that no effect
    /// of the vehicle has.
    #[must_use]
    pub(super) fn feeling(self, felt: &[Vec<Response>]) -> Self {
        Self { felt: felt.to_vec(), ..self }
    }

    /// Measured less simulated pulses of all drones for a vehicle whose closed form is near the
    /// model's; with the mean effect of gusts of this strength on a curved response, m/s.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub fn residual(&self, vehicle: &Vehicle, gusts_mps: f64) -> Result<Pulses, EffectError> {
        let scene = self.scene_of(vehicle);
        let closed = scene.pulses(vehicle)?;
        let bent = rectified(&scene, vehicle, gusts_mps)?;
        Ok(self
            .data
            .groups
            .iter()
            .enumerate()
            .map(|(group, of)| {
                let drone = |(drone, values): (usize, &Vec<BinValues>)| {
                    values
                        .iter()
                        .enumerate()
                        .map(|(bin, values)| {
                            let model = closed.at(group, drone, bin)
                                + self.closure_us[group][bin]
                                + bent[group][bin];
                            values.pulse_us - model
                        })
                        .collect()
                };
                of.measured.iter().enumerate().map(drone).collect()
            })
            .collect())
    }

    /// Root mean square of what the model leaves about each drone's mean, us.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn raw_gap_us(&self) -> Result<f64, EffectError> {
        let residual = self.residual(&self.vehicle, 0.0)?;
        let variances = residual.iter().flatten().filter_map(Moments::of);
        Ok(mean(variances.map(|moments| moments.population_variance())).unwrap_or_default().sqrt())
    }

    /// Patterns of the groups that the noise model takes, for a vehicle.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub fn patterns(
        &self,
        vehicle: &Vehicle,
        gusts_mps: f64,
    ) -> Result<Vec<GroupPattern>, EffectError> {
        let scene = self.scene_of(vehicle);
        let bent = rectified(&scene, vehicle, gusts_mps)?;
        let mut response = scene.response(vehicle)?;
        response::add(&mut response, 1.0, &self.felt);
        let closed = scene.pulses(vehicle)?;
        let side = |axis| Ok(self.by_wind(vehicle, &closed, axis, SIDE_STEP_MPS)?.means());
        let sides: [Vec<Vec<f64>>; 2] = [side(0)?, side(1)?];
        let differences = self.drones_differ(vehicle, self.beside_hover_of(&closed))?;
        Ok(self
            .data
            .groups
            .iter()
            .enumerate()
            .zip(differences)
            .map(|((group, of), Differences { offset, slope_us })| {
                let after_s = FLIGHTS_APART_S * of.flight as f64;
                GroupPattern {
                    drones: of.slots.len(),
                    time_s: of.bins.iter().map(|bin| after_s + bin.middle_s()).collect(),
                    height_m: self.scene.signals[group].iter().map(|s| s.height_m).collect(),
                    response: response[group].clone(),
                    shift_mps: Vec::new(),
                    bent_us: bent[group].clone(),
                    side_response: (0..of.bins.len())
                        .map(|bin| {
                            [0, 1].map(|axis: usize| sides[axis][group][bin] / SIDE_STEP_MPS)
                        })
                        .collect(),
                    offset,
                    slope_us,
                    unsteady_us: if self.is_flown {
                        self.closure_us[group].clone()
                    } else {
                        Vec::new()
                    },
                }
            })
            .collect())
    }

    /// Pulse of a vehicle beside that in hover, by group and bin, us: what a relative error of the whole response does.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn beside_hover_us(&self, vehicle: &Vehicle) -> Result<Vec<Vec<f64>>, EffectError> {
        Ok(self.beside_hover_of(&self.scene_of(vehicle).pulses(vehicle)?))
    }

    /// Pulse beside that in hover, by group and bin, us.
    fn beside_hover_of(&self, closed: &Column) -> Vec<Vec<f64>> {
        let beside = |(group, of): (usize, &Group)| {
            let pulse = |bin: usize| {
                let drones = 0..of.slots.len().max(1);
                mean(drones.map(|drone| closed.at(group, drone, bin))).unwrap_or_default()
            };
            let pulses: Vec<f64> = (0..of.bins.len()).map(pulse).collect();
            let hover_us = of.in_hover(&pulses);
            pulses.iter().map(|pulse| pulse - hover_us).collect()
        };
        self.data.groups.iter().enumerate().map(beside).collect()
    }

    /// Only some bins, chosen by the places of group and bin.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize, usize) -> bool) -> Self {
        fn pick<T: Clone>(values: &[Vec<T>], keep: &impl Fn(usize, usize) -> bool) -> Vec<Vec<T>> {
            let bins = |(group, bins): (usize, &Vec<T>)| {
                let kept = bins.iter().enumerate().filter(|(bin, _)| keep(group, *bin));
                kept.map(|(_, value)| value.clone()).collect()
            };
            values.iter().enumerate().map(bins).collect()
        }
        let wind = Wind { air_mps: pick(&self.wind.air_mps, &keep), ..self.wind.clone() };
        Self {
            data: self.data.keep(&keep),
            side: pick(&self.side, &keep),
            scene: self.scene.only(&keep),
            wind,
            read_by: self.read_by,
            flown_mps: self.flown_mps,
            of_updraft_mps: self.of_updraft_mps,
            flew: self.flew.clone(),
            closure_us: pick(&self.closure_us, &keep),
            felt: pick(&self.felt, &keep),
            amsl_m: self.amsl_m,
            vehicle: self.vehicle.clone(),
            spreads: self.spreads.clone(),
            is_foreign: self.is_foreign,
            other_wind_mps: self.other_wind_mps,
            is_flown: self.is_flown,
            lean_misfit_nats: OnceLock::new(),
        }
    }

    /// Direction of the air over ground-fixed axes by group and bin, rad from the nose.
    pub fn headings(&self) -> Vec<Vec<f64>> {
        // Show drones keep their nose along show x.
        let angle = |air: &[f64; 2]| air[1].atan2(air[0]).clamp(-PI, PI);
        self.wind.air_mps.iter().map(|group| group.iter().map(angle).collect()).collect()
    }

    /// Pulses of a vehicle in the wind that its own law reads from the leans, where no leg tells more.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub fn pulses_by_lean(&self, vehicle: &Vehicle) -> Result<Column, EffectError> {
        self.scene_of(vehicle).pulses(vehicle)
    }

    /// Whether the leans tell another wind if it was this vehicle that flew.
    pub(super) fn leans_otherwise(&self, vehicle: &Vehicle) -> bool {
        self.other_law(vehicle).is_some()
    }

    /// Whether the wind is read from the leans of a vehicle.
    fn reads_wind(&self, vehicle: &Vehicle) -> bool {
        // Not that of ArduPilot's own frame: one comparison took more than five minutes with it.
        let is_sitl = vehicle.airframe.sitl.is_some();
        self.wind.mean_se_mps > 0.0 && !is_sitl && !self.is_in_other_wind()
    }

    /// The law by which a vehicle leans, where the wind is read by it and another law reads another wind.
    fn other_law(&self, vehicle: &Vehicle) -> Option<LeanLaw> {
        // What legs tell of leans no vehicle has to tell.
        if self.wind.measured.is_some() || !self.reads_wind(vehicle) {
            return None;
        }
        let law = lean_law(vehicle, self.amsl_m, self.scene.updraft_mps);
        (!law.reads_as(self.read_by)).then_some(law)
    }

    /// A round body that the model lacks, by the leans of horizontal legs, and by how much its drag area (m²) leans the
    /// vehicle, rad/(m/s)²; `None`: there are no legs.
    pub(super) fn body_told(&self) -> Option<(Body, f64)> {
        let measured = self.wind.measured.as_ref()?;
        let told = lean::body(&self.data, self.read_by, (&self.side, self.flown_mps), measured)?;
        let mut larger = self.vehicle.clone();
        let sides_m2 = Role::BodyDragSide.value(&larger).unwrap_or_default();
        Role::BodyDragSide.set(&mut larger, sides_m2 + 1.0);
        let updraft_mps = self.read_by.updraft_mps;
        let [without, with] =
            [&self.vehicle, &larger].map(|one| lean_law(one, self.amsl_m, updraft_mps).square);
        Some((told, with - without))
    }

    /// How unlikely the leans of the flight are if it was the vehicle that flew, in the updraft that it was flown in, nats, but
    /// for a constant; 0: they tell nothing of it.
    pub(super) fn lean_misfit_nats(&self) -> f64 {
        *self.lean_misfit_nats.get_or_init(|| {
            if !self.is_flown || !self.reads_wind(&self.vehicle) {
                return 0.0;
            }
            let law = lean_law(&self.vehicle, self.amsl_m, self.of_updraft_mps);
            lean::misfit_nats(&self.data, law, (&self.side, self.flown_mps))
        })
    }

    fn wind_by(&self, law: LeanLaw) -> Wind {
        let flown_law = lean_law(&self.vehicle, self.amsl_m, self.flown_mps[2]);
        wind_by(&self.data, law, flown_law, Some((&self.side, self.flown_mps)))
    }

    /// The flight as a vehicle saw it: where no leg told how drones lean, who leans otherwise in the wind leant as the
    /// logs say in another wind.
    pub(super) fn scene_of(&self, vehicle: &Vehicle) -> Cow<'_, Scene> {
        match self.other_law(vehicle) {
            None => Cow::Borrowed(&self.scene),
            Some(law) => Cow::Owned(self.scene.clone().blown(&self.wind_by(law))),
        }
    }

    /// Change of the pulse by one standard error of the wind, along either axis of the show, and by what leans in climb
    /// and descent may misread of it.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub fn wind_doubts(&self, vehicle: &Vehicle) -> Result<Vec<Column>, EffectError> {
        let closed = self.scene_of(vehicle).pulses(vehicle)?;
        let Wind { mean_se_mps, mean_mps, .. } = self.wind;
        // As surely as each flight's own wind is known.
        let own_se_mps =
            |group: usize| self.wind.of_groups_se_mps.get(group).copied().unwrap_or(mean_se_mps);
        let by_axis = |axis| -> Result<Column, EffectError> {
            let by = self.by_wind(vehicle, &closed, axis, mean_se_mps)?;
            if self.wind.of_groups_se_mps.is_empty() {
                return Ok(by);
            }
            Ok(by.each(|group, drone, bin| {
                own_se_mps(group) / mean_se_mps * by.at(group, drone, bin)
            }))
        };
        let (forward, left) = (by_axis(0)?, by_axis(1)?);
        // What a wind does that is misread by so much, along the wind.
        let share = |group: usize, axis: usize| {
            let own_mps = self.wind.of_groups_mps.get(group).unwrap_or(&mean_mps);
            LEAN_FORM_SHARE * own_mps[axis] / own_se_mps(group)
        };
        let misread = |group, drone, bin| {
            share(group, 0) * forward.at(group, drone, bin)
                + share(group, 1) * left.at(group, drone, bin)
        };
        let with_climb = if mean_se_mps > 0.0 {
            climb_shapes(&self.scene, LEAN_FORM_ORDERS)
                .iter()
                .map(|shape| {
                    shape.each(|group, drone, bin| {
                        misread(group, drone, bin) * shape.at(group, drone, bin)
                    })
                })
                .collect()
        } else {
            Vec::new()
        };
        let mut doubts = [vec![forward.clone(), left.clone()], with_climb].concat();
        // Where the model does not feel wind there is nothing to doubt.
        doubts.retain(|doubt| doubt.spread(&self.data.counts()) > LEAST_DOUBT_US);
        doubts.extend(self.doubt_of_other_wind(vehicle, &closed)?);
        Ok(doubts)
    }

    /// Whether the other side is another program's simulation, which may differ in several things at once.
    pub(super) fn is_foreign(&self) -> bool {
        self.is_foreign
    }

    /// Whether the two sides flew in different wind.
    pub(super) fn is_in_other_wind(&self) -> bool {
        self.other_wind_mps.is_some()
    }

    /// All that the difference in wind between the two sides does to the pulse, by the model: nobody knows how well
    /// the model knows it, and nothing is named that it explains.
    fn doubt_of_other_wind(
        &self,
        vehicle: &Vehicle,
        closed: &Column,
    ) -> Result<Option<Column>, EffectError> {
        let Some(wind_mps) = self.other_wind_mps else { return Ok(None) };
        let mut wind = self.wind.clone();
        let others = wind.air_mps.iter_mut().zip(&self.data.groups);
        for (air, group) in others.filter(|(_, group)| self.is_apart(group.flight)) {
            for (air, bin) in air.iter_mut().zip(&group.bins) {
                *air = [0, 1].map(|axis: usize| bin.velocity_mps[axis] - wind_mps[axis]);
            }
        }
        let doubt = closed.less(&self.scene.clone().blown(&wind).pulses(vehicle)?);
        Ok((doubt.spread(&self.data.counts()) > LEAST_DOUBT_US).then_some(doubt))
    }

    /// Change of the pulse by one standard deviation of the updraft that a whole flight may be in, for each flight: nobody
    /// knows it before, and where the response is curved it changes how the pulse goes with climb.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn updraft_doubts(&self, vehicle: &Vehicle) -> Result<Vec<Column>, EffectError> {
        let scene = self.scene_of(vehicle);
        let at = |by_mps: f64| scene.in_updraft(self.scene.updraft_mps + by_mps).pulses(vehicle);
        let (more, less) = (at(UPDRAFT_STEP_MPS)?, at(-UPDRAFT_STEP_MPS)?);
        let per_doubt = UPDRAFT_DOUBT_MPS / (2.0 * UPDRAFT_STEP_MPS);
        let change = more.less(&less);
        let of_flight = |flight: usize| {
            change.each(|group, drone, bin| {
                let is_own = self.data.groups[group].flight == flight;
                if is_own { per_doubt * change.at(group, drone, bin) } else { 0.0 }
            })
        };
        Ok(self.data.flights().into_iter().map(of_flight).collect())
    }

    /// What more wind along an axis of the show does to the vehicle's closed form, us.
    fn by_wind(
        &self,
        vehicle: &Vehicle,
        closed: &Column,
        axis: usize,
        by_mps: f64,
    ) -> Result<Column, EffectError> {
        let blown = |by_mps: f64| {
            let mut scene = self.scene_of(vehicle).into_owned();
            scene.blow(axis, by_mps);
            scene.pulses(vehicle)
        };
        match blown(by_mps) {
            // At the end of what it can fly in, the other side tells the same.
            Err(EffectError::NotFlown { .. }) => Ok(closed.less(&blown(-by_mps)?)),
            pulses => Ok(pulses?.less(closed)),
        }
    }

    /// Distance of the mean leans of both sides in hover and in vertical flight, rad: of several flights in that which
    /// is farthest.
    pub fn apart_rad(&self) -> f64 {
        let of_flights = self.data.groups.iter().map(|group| self.apart_in_rad(group.flight));
        most(of_flights).unwrap_or_default()
    }

    /// Whether a flight was flown in another wind than the simulated side.
    fn is_apart(&self, flight: usize) -> bool {
        self.apart_in_rad(flight) > OTHER_WIND_DEG.to_radians()
    }

    fn apart_in_rad(&self, flight: usize) -> f64 {
        let (mut sum, mut count) = ([0.0_f64; 2], 0.0);
        let groups = self.data.groups.iter().zip(&self.side);
        for (group, side) in groups.filter(|(group, _)| group.flight == flight) {
            for (bin, values) in side.iter().enumerate() {
                if group.bins[bin].is_horizontal() {
                    continue;
                }
                count += 1.0;
                for (axis, sum) in sum.iter_mut().enumerate() {
                    *sum += group.mean(bin, |one| one.lean_rad[axis]) - values.lean_rad[axis];
                }
            }
        }
        sum[0].hypot(sum[1]) / f64::max(count, 1.0)
    }

    /// Difference between the pulses of two vehicles.
    ///
    /// # Errors
    /// Effects of a vehicle that are not valid.
    pub fn change(&self, from: &Vehicle, to: &Vehicle) -> Result<Column, EffectError> {
        Ok(self.scene_of(to).pulses(to)?.less(&self.scene_of(from).pulses(from)?))
    }
}

/// A wind that was flown in, and what was read from the leans then.
struct Reading {
    /// How far the two are apart, m/s.
    apart_mps: f64,
    flown_mps: [f64; 3],
    values: Side,
    /// Air that is flown in next, m/s.
    towards_mps: [f64; 3],
}

impl Reading {
    /// Half of the way to where it led to, each time less.
    fn halfway(&mut self) -> [f64; 3] {
        let towards = self.flown_mps.iter().zip(&mut self.towards_mps);
        towards.for_each(|(flown, towards)| *towards = f64::midpoint(*flown, *towards));
        self.towards_mps
    }
}

/// The bins that are there.
pub(super) fn flat(values: &[Vec<Option<BinValues>>]) -> Vec<Vec<BinValues>> {
    values.iter().map(|group| group.iter().flatten().copied().collect()).collect()
}

/// Sides whose leans are further apart flew in different wind, degrees. Chosen: several times the error of
/// an attitude, and 0.4 m/s on a drone that leans by 1.2 degrees per m/s.
const OTHER_WIND_DEG: f64 = 0.5;
/// Nuisance regressors with a smaller effect are left out, us. Far below the noise; saves time only.
pub(super) const LEAST_DOUBT_US: f64 = 1e-3;
/// Standard deviation of how much of the wind leans misread in climb or descent, as a share. Two models of the same
/// rotor, fitted to each other over the flown speeds, differ by 3 % (rms) and up to 8 % in how they lean there.
const LEAN_FORM_SHARE: f64 = 0.05;
/// Curves over the climb by which they may.
const LEAN_FORM_ORDERS: RangeInclusive<usize> = 1..=2;
/// Change of the wind for the derivative by it, m/s: the strength of horizontal gusts. Chosen.
const SIDE_STEP_MPS: f64 = 0.25;
/// Standard deviation of the updraft that a whole flight may be in, m/s: thermals that a fleet can fly a
/// calibration in.
pub(super) const UPDRAFT_DOUBT_MPS: f64 = 3.0;
/// Half of the step of the derivative by the updraft, m/s. Numerical.
const UPDRAFT_STEP_MPS: f64 = 0.1;
/// Flights are so far apart for the noise, s: none of the air of one is left in the next, and all else that it takes has no
/// clock. Numerical.
const FLIGHTS_APART_S: f64 = 1e7;
/// Fewest bins of a comparison. Chosen; the noise alone has 11 parameters.
const FEWEST_BINS: usize = 12;

/// Nodes and weights of the mean over a normal distribution: Gauss-Hermite with 7 points, exact for
/// polynomials up to degree 13 (docs/physics.md, 2.5). A test checks its moments.
const NODES: [(f64, f64); 7] = [
    (-3.750_439_717_725_742, 0.000_548_268_855_972_217),
    (-2.366_759_410_734_541, 0.030_757_123_967_586_5),
    (-1.154_405_394_739_968, 0.240_123_178_605_012_9),
    (0.0, 0.457_142_857_142_857_1),
    (1.154_405_394_739_968, 0.240_123_178_605_012_9),
    (2.366_759_410_734_541, 0.030_757_123_967_586_5),
    (3.750_439_717_725_742, 0.000_548_268_855_972_217),
];

/// Place of the node without a gust.
const MIDDLE: usize = NODES.len() / 2;

/// Mean of the pulse in gusts less the pulse in their mean: known physics, computed and never named
/// (docs/physics.md, 2.5).
fn rectified(
    scene: &Scene,
    vehicle: &Vehicle,
    gusts_mps: f64,
) -> Result<Vec<Vec<f64>>, EffectError> {
    if gusts_mps <= 0.0 {
        return Ok(scene.signals.iter().map(|group| vec![0.0; group.len()]).collect());
    }
    let pulses_us = scene.shifted(vehicle, &NODES.map(|(node, _)| -node * gusts_mps))?;
    let bent = |pulses_us: &Vec<f64>| {
        let nodes = NODES.iter().zip(pulses_us);
        nodes.map(|((_, weight), pulse_us)| weight * pulse_us).sum::<f64>() - pulses_us[MIDDLE]
    };
    Ok(pulses_us.iter().map(|group| group.iter().map(bent).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::super::bins::of_segments;
    use super::super::data::PlannedPart;
    use super::super::refly::refly;
    use super::super::trial;
    use super::*;
    use crate::mission::resolve::resolve;

    #[test]
    fn a_flight_of_nearly_the_same_vehicle_in_nearly_the_same_updraft_stands_for_its_own() {
        let plan = resolve("calibration", &[]).unwrap().flights.remove(0).plan;
        let slot = &plan.slots[0];
        let bins = of_segments(&plan.groups[0].segments);
        let vehicle = |inflow_share: f64| {
            let mut vehicle = trial::vehicle();
            Role::InflowShare.set(&mut vehicle, inflow_share);
            vehicle
        };
        let flown = |inflow_share: f64, updraft_mps: f64, near: Option<&Comparison>| {
            let vehicle = vehicle(inflow_share);
            let air_mps = [0.0, 0.0, updraft_mps];
            let values =
                refly(&vehicle, &plan, slot, &bins, air_mps, thrust_exponent(&vehicle)).unwrap();
            let name = plan.groups[0].name.clone();
            let part = PlannedPart { name, slots: vec![slot], bins: &bins, values: &values };
            let (data, simulated) =
                (Data::planned(&plan, &[part], |_, _| f64::NAN), Simulated::Refly(&plan));
            Comparison::of(&data, &vehicle, &simulated, Some(&plan), updraft_mps, near).unwrap()
        };
        let first = flown(0.3, 0.0, None);
        for (inflow_share, updraft_mps, stands) in
            [(0.303, 0.06, true), (0.33, 0.06, false), (0.303, 0.07, false)]
        {
            let there = flown(inflow_share, updraft_mps, Some(&first));
            let by = format!("{inflow_share} in {updraft_mps} m/s");
            assert_eq!(there.closure_us == first.closure_us, stands, "{by}");
            assert_eq!(there.scene.updraft_mps, updraft_mps);
            // What was flown in just this updraft leaves hardly anything.
            let residual = there.residual(&there.vehicle, 0.0).unwrap();
            let most_us = most(residual[0][0].iter().map(|rest_us| rest_us.abs())).unwrap();
            assert!(most_us < 0.3, "{by}: {most_us} us");
            assert!(there.raw_gap_us().unwrap() < 0.1, "{by}: {} us", there.raw_gap_us().unwrap());
        }
    }

    #[test]
    fn who_leans_otherwise_leant_in_another_wind() {
        let mut data = trial::data(2, |_, _| 0.0);
        for values in data.groups.iter_mut().flat_map(|group| &mut group.measured).flatten() {
            values.lean_rad = [0.06, 0.0];
        }
        let comparison = trial::comparison(&data);
        let vehicle = trial::vehicle();
        assert!(!comparison.leans_otherwise(&vehicle));
        assert!(matches!(comparison.scene_of(&vehicle), Cow::Borrowed(_)));
        let by_drag = |role: Role, size: f64| {
            let mut other = vehicle.clone();
            role.set(&mut other, size);
            assert!(comparison.leans_otherwise(&other), "{role:?}");
            comparison.scene_of(&other).signals[0][3].horizontal_mps
        };
        let own_mps = comparison.scene.signals[0][3].horizontal_mps;
        // Rotors that drag lean by 0.02 rad in each m/s, and the body a little more.
        let rotors_mps = by_drag(Role::RotorDrag, 0.02);
        assert!((2.0..3.0).contains(&rotors_mps), "{rotors_mps} for {own_mps} m/s");
        assert!(own_mps > 2.0 * rotors_mps, "{own_mps} m/s by the model's box alone");
        assert!(by_drag(Role::BodyDragSide, 0.05) < own_mps);
    }

    #[test]
    fn nodes_have_the_moments_of_a_normal_distribution() {
        let moment = |power: i32| NODES.iter().map(|(x, w)| w * x.powi(power)).sum::<f64>();
        for (power, wanted) in [(0, 1.0), (2, 1.0), (4, 3.0), (6, 15.0), (8, 105.0)] {
            assert!((moment(power) - wanted).abs() < 1e-9 * wanted, "{power}: {}", moment(power));
        }
    }
}
