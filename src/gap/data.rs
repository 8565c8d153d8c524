//! Measured values: all drones of a campaign's flight, in steady bins that are common to each
//! group.

use std::collections::BTreeSet;

use super::bins::{Bin, BinValues, have_two_headings, of_segments};
use super::left_out::LeftOut;
use super::measure::measured;
use super::steady::IDLE_US;
use super::unplanned;
use crate::flight::Flight;
use crate::flight::table::Steps;
use crate::mission::plan::{Plan, Slot};
use crate::numeric::{least, mean, upper_median};

/// A bin is kept when this share of the drones has it. Chosen: a missing bin is imputed, and imputed values
/// must stay few.
const BIN_SHARE: f64 = 0.8;
/// A drone is kept when it has this share of the kept bins; the others are imputed. Chosen as [`BIN_SHARE`].
const DRONE_SHARE: f64 = 0.9;
/// Drones are neighbours within this many grid spacings: includes the diagonal (1.41), excludes the next but
/// one (2). Geometry.
const NEXT_SPACINGS: f64 = 1.5;
/// Heights above home that differ by less are the same, m: heights of two programs differ by some metres where their
/// ground does. Chosen.
const SAME_HEIGHT_M: f64 = 5.0;
/// A simulated drone flew as each group did whose bins it has, and at whose heights it was, by this share of its best
/// group: some bins are lost to gaps and limits. Chosen.
const AS_GOOD: f64 = 0.95;

/// A flight of which there are so many times fewer logs than of the largest is none to compare. Chosen: a fleet that flies again has
/// most of its drones.
const FEW_OF: usize = 4;

/// Log of one drone, with its slot.
#[derive(Debug)]
pub struct Flown<'a> {
    /// Slot of the plan; without a plan a running number from 1.
    pub slot: u16,
    /// Flight as its log tells it.
    pub flight: &'a Flight,
}

/// Drones of a proposed flight that are equal in flight and weight.
#[derive(Debug)]
pub struct PlannedPart<'a> {
    /// Name of the group.
    pub name: String,
    /// Slots of the drones.
    pub slots: Vec<&'a Slot>,
    /// Steady bins of the group.
    pub bins: &'a [Bin],
    /// Values of the simulated drone in each bin.
    pub values: &'a [Option<BinValues>],
}

/// All drones of a command group.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Name of the command group.
    pub name: String,
    /// Bins of the group, in the order of time.
    pub bins: Vec<Bin>,
    /// Slots of the drones, in order.
    pub slots: Vec<u16>,
    /// Home of each drone, show x and y, m.
    pub place_m: Vec<[f64; 2]>,
    /// Number of drones next to each drone.
    pub neighbours: Vec<f64>,
    /// Measured values of each drone in each bin.
    pub measured: Vec<Vec<BinValues>>,
    /// Show time at which the motors started, s (earliest of the drones).
    pub armed_s: f64,
    /// Number of the flight that it flew in, counted from 0: groups of one flight share their air and wind.
    pub flight: usize,
}

impl Group {
    /// Mean of something over the group's hovers, or over all bins if it has none.
    pub(super) fn in_hover(&self, values: &[f64]) -> f64 {
        let bins = self.bins.iter().zip(values);
        let hovers = bins.filter(|(bin, _)| bin.kind.is_hover()).map(|(_, value)| value);
        mean(hovers).or_else(|| mean(values)).unwrap_or_default()
    }

    /// Mean over the drones of something in a bin.
    pub fn mean(&self, bin: usize, of: impl Fn(&BinValues) -> f64) -> f64 {
        mean(self.measured.iter().map(|drone| of(&drone[bin]))).unwrap_or_default()
    }

    /// Only some of its drones.
    #[must_use]
    fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        fn pick<T: Clone>(values: &[T], keep: &impl Fn(usize) -> bool) -> Vec<T> {
            let kept = values.iter().enumerate().filter(|(index, _)| keep(*index));
            kept.map(|(_, value)| value.clone()).collect()
        }
        Self {
            name: self.name.clone(),
            bins: self.bins.clone(),
            slots: pick(&self.slots, &keep),
            place_m: pick(&self.place_m, &keep),
            neighbours: pick(&self.neighbours, &keep),
            measured: pick(&self.measured, &keep),
            armed_s: self.armed_s,
            flight: self.flight,
        }
    }
}

/// The measured side of a comparison.
#[derive(Clone, Debug, Default)]
pub struct Data {
    /// Command groups that have drones.
    pub groups: Vec<Group>,
    /// Drones left out, with their reasons.
    pub left_out: Vec<LeftOut>,
    /// Resistance of the batteries, ohm, if the logs have it: median of what the autopilots found.
    pub resistance_ohm: Option<f64>,
    /// Direction of the x axis in which bins have their velocities, degrees clockwise from north: the plan's; 0 without a plan.
    pub orientation_deg: f64,
}

impl Data {
    /// Number of bins of each group.
    pub fn bins_of_groups(&self) -> Vec<usize> {
        self.groups.iter().map(|group| group.bins.len()).collect()
    }

    /// Whether legs over ground are flown in two headings at least.
    pub(super) fn has_legs(&self) -> bool {
        let bins = self.groups.iter().flat_map(|group| &group.bins);
        have_two_headings(bins.filter(|bin| bin.is_horizontal()).map(|bin| bin.velocity_mps))
    }

    /// Drones in steady bins of the plan's groups.
    pub fn of_plan(plan: &Plan, flown: &[Flown<'_>], thrust_exponent: f64) -> Self {
        let orientation_deg = plan.site.orientation_deg;
        let mut data = Self { orientation_deg, ..Self::default() };
        for (index, group) in plan.groups.iter().enumerate() {
            let bins = of_segments(&group.segments);
            let of_group = |slot: &Slot| usize::from(slot.group) == index;
            let drones: Vec<(&Slot, &Flight)> = flown
                .iter()
                .filter_map(|one| Some((plan.slot(one.slot)?, one.flight)))
                .filter(|(slot, _)| of_group(slot))
                .collect();
            let values: Vec<(u16, [f64; 2], Vec<Option<BinValues>>)> = drones
                .iter()
                .map(|(slot, flight)| {
                    let place = [slot.home_m[0], slot.home_m[1]];
                    let values = measured(flight, &bins, orientation_deg, thrust_exponent);
                    (slot.slot, place, values)
                })
                .collect();
            let armed_s = first_armed_s(drones.iter().map(|(_, flight)| *flight));
            data.add(&group.name, &bins, values, armed_s);
        }
        data.resistance_ohm = resistance_ohm(flown);
        let spacing_m = plan.grid.map_or(f64::INFINITY, |grid| grid.spacing_m);
        data.count_neighbours(&plan.slots, spacing_m);
        data
    }

    /// Drones without a plan, in groups that were told the same: bins from the own commands of each group's first log,
    /// or, of a table that has none, from its velocity.
    pub fn of_logs(flown: &[Flown<'_>], steps: Option<&Steps>, thrust_exponent: f64) -> Self {
        let mut data = Self::default();
        let (groups, strays) = without_strays(unplanned::groups(flown, steps));
        data.left_out = strays;
        let flights: BTreeSet<usize> = groups.iter().map(|group| group.flight).collect();
        for (index, group) in groups.iter().enumerate() {
            let unplanned::Group { bins, members, flight } = group;
            let values = members
                .iter()
                .map(|one| (one.slot, [0.0; 2], measured(one.flight, bins, 0.0, thrust_exponent)))
                .collect();
            let armed_s = first_armed_s(members.iter().map(|one| one.flight));
            let of_flight = groups.iter().filter(|other| other.flight == *flight).count();
            let name = match (groups.len(), flights.len(), of_flight) {
                (1, ..) => "all".to_owned(),
                (_, 1, _) => format!("group {}", index + 1),
                (.., 1) => format!("flight {}", flight + 1),
                _ => format!("flight {}, group {}", flight + 1, index + 1),
            };
            let before = data.groups.len();
            data.add(&name, bins, values, armed_s);
            data.groups[before..].iter_mut().for_each(|added| added.flight = *flight);
        }
        data.resistance_ohm = resistance_ohm(flown);
        data
    }

    /// Values of a proposed flight: all drones of a part of a group read equal simulated values,
    /// each with its own voltage at rest (by its place in the plan, and bin).
    pub fn planned(
        plan: &Plan,
        parts: &[PlannedPart<'_>],
        resting_v: impl Fn(&Slot, &Bin) -> f64,
    ) -> Self {
        let mut data = Self::default();
        for part in parts {
            let drone = |slot: &&Slot| {
                let own = |(bin, values): (&Bin, &Option<BinValues>)| {
                    values.map(|values| BinValues { resting_v: resting_v(slot, bin), ..values })
                };
                let place_m = [slot.home_m[0], slot.home_m[1]];
                (slot.slot, place_m, part.bins.iter().zip(part.values).map(own).collect())
            };
            let drones = part.slots.iter().map(drone).collect();
            data.add(&part.name, part.bins, drones, 0.0);
        }
        let spacing_m = plan.grid.map_or(f64::INFINITY, |grid| grid.spacing_m);
        data.count_neighbours(&plan.slots, spacing_m);
        data
    }

    /// These bins in the logs of an external simulation, averaged over its drones that flew as the group did.
    /// `None`: these lack the bin.
    pub fn averaged(
        &self,
        flown: &[Flown<'_>],
        thrust_exponent: f64,
    ) -> Vec<Vec<Option<BinValues>>> {
        let of_drone = |one: &Flown<'_>| -> Vec<Vec<Option<BinValues>>> {
            let own = |group: &Group| {
                measured(one.flight, &group.bins, self.orientation_deg, thrust_exponent)
            };
            self.groups.iter().map(own).collect()
        };
        let drones: Vec<Vec<Vec<Option<BinValues>>>> = flown.iter().map(of_drone).collect();
        let flew: Vec<Vec<bool>> = drones.iter().map(|drone| self.flown_as(drone)).collect();
        let side = |(index, group): (usize, &Group)| {
            let members = || drones.iter().zip(&flew).filter(move |(_, flew)| flew[index]);
            let bin =
                |bin: usize| average(members().filter_map(|(drone, _)| drone[index][bin].as_ref()));
            (0..group.bins.len()).map(bin).collect()
        };
        self.groups.iter().enumerate().map(side).collect()
    }

    /// Whether a simulated drone, by its values in the bins of each group, flew as the group did. Its number need not
    /// be a slot of the measured fleet, so what it flew decides: halves in counter phase hover together, but at other
    /// heights.
    fn flown_as(&self, drone: &[Vec<Option<BinValues>>]) -> Vec<bool> {
        let share = |(group, values): (&Group, &Vec<Option<BinValues>>)| {
            let is_near = |bin: usize, own: &BinValues| {
                (own.height_m - group.mean(bin, |one| one.height_m)).abs() < SAME_HEIGHT_M
            };
            let there = values.iter().enumerate().filter_map(|(bin, own)| Some((bin, (*own)?)));
            let score: f64 =
                there.map(|(bin, own)| if is_near(bin, &own) { 2.0 } else { 1.0 }).sum();
            score / values.len().max(1) as f64
        };
        let shares: Vec<f64> = self.groups.iter().zip(drone).map(share).collect();
        let most = shares.iter().copied().fold(0.0, f64::max);
        shares.iter().map(|share| *share >= AS_GOOD * most && most > 0.0).collect()
    }

    fn add(
        &mut self,
        name: &str,
        bins: &[Bin],
        drones: Vec<(u16, [f64; 2], Vec<Option<BinValues>>)>,
        armed_s: f64,
    ) {
        let has_any =
            |drone: &(u16, [f64; 2], Vec<Option<BinValues>>)| drone.2.iter().any(Option::is_some);
        for (slot, ..) in drones.iter().filter(|drone| !has_any(drone)) {
            self.left_out.push(LeftOut::NoSteadyFlight { slot: *slot });
        }
        let drones: Vec<_> = drones.into_iter().filter(has_any).collect();
        let needed = (drones.len() as f64 * BIN_SHARE).ceil() as usize;
        let kept: Vec<usize> = (0..bins.len())
            .filter(|bin| drones.iter().filter(|drone| drone.2[*bin].is_some()).count() >= needed)
            .collect();
        let mut group = Group {
            name: name.to_owned(),
            bins: kept.iter().map(|bin| bins[*bin].clone()).collect(),
            armed_s: if armed_s.is_finite() { armed_s } else { 0.0 },
            ..Group::default()
        };
        let mut holes = Vec::new();
        for (slot, place_m, values) in drones {
            let there: Vec<Option<BinValues>> = kept.iter().map(|bin| values[*bin]).collect();
            let count = |values: &[Option<BinValues>]| values.iter().flatten().count();
            if (count(&there) as f64) < DRONE_SHARE * kept.len() as f64 || count(&there) == 0 {
                // Where no bin is common to the fleet, each drone's own say how bad it is.
                let of = if kept.is_empty() { &values } else { &there };
                let (usable, bins) = (count(of), of.len());
                self.left_out.push(LeftOut::FewBins { slot, usable, bins });
                continue;
            }
            group.slots.push(slot);
            group.place_m.push(place_m);
            holes.push(there);
        }
        group.measured = fill(&holes);
        group.neighbours = vec![0.0; group.slots.len()];
        if !group.slots.is_empty() && !group.bins.is_empty() {
            self.groups.push(group);
        }
    }

    fn count_neighbours(&mut self, slots: &[Slot], spacing_m: f64) {
        let next = |a: &[f64; 2], b: &[f64; 3]| {
            let apart_m = (a[0] - b[0]).hypot(a[1] - b[1]);
            apart_m > 0.1 && apart_m < NEXT_SPACINGS * spacing_m
        };
        for group in &mut self.groups {
            let count = |place: &[f64; 2]| {
                slots.iter().filter(|slot| next(place, &slot.home_m)).count() as f64
            };
            group.neighbours = group.place_m.iter().map(count).collect();
        }
    }

    /// What the drones did in each bin, in the mean of their group.
    pub(super) fn as_flown(&self) -> Vec<Vec<Option<BinValues>>> {
        let bin =
            |group: &Group, bin: usize| average(group.measured.iter().map(|drone| &drone[bin]));
        let bins = |group: &Group| (0..group.bins.len()).map(|place| bin(group, place)).collect();
        self.groups.iter().map(bins).collect()
    }

    /// Without the drones whose pulse is a constant: these are named, and the constant of the last is given.
    pub(super) fn drop_constant(&mut self, thrust_exponent: f64) -> Option<f64> {
        let mut last = None;
        for group in &mut self.groups {
            let constants: Vec<Option<f64>> = group
                .measured
                .iter()
                .map(|drone| constant_us(drone.iter(), thrust_exponent))
                .collect();
            for (slot, constant) in group.slots.iter().zip(&constants) {
                if let Some(us) = constant {
                    last = Some(*us);
                    self.left_out.push(LeftOut::ConstantPulse { slot: *slot, pulse_us: *us });
                }
            }
            *group = group.only(|index| constants[index].is_none());
        }
        self.groups.retain(|group| !group.slots.is_empty());
        last
    }

    /// The flights that its groups flew in, in order.
    pub(super) fn flights(&self) -> BTreeSet<usize> {
        self.groups.iter().map(|group| group.flight).collect()
    }

    /// Number of drones in all groups.
    pub fn drones(&self) -> usize {
        self.groups.iter().map(|group| group.slots.len()).sum()
    }

    /// Number of drones in each group.
    pub fn counts(&self) -> Vec<usize> {
        self.groups.iter().map(|group| group.slots.len()).collect()
    }

    /// Splits the drones into those that are fitted, and those that are held out: every fourth
    /// drone of each group, if there are eight drones and four in each group. Each part has all
    /// groups.
    pub fn split(&self) -> (Self, Self) {
        let holds = self.drones() >= FEWEST_TO_HOLD
            && self.groups.iter().all(|group| group.slots.len() >= FEWEST_IN_GROUP);
        let is_held = |index: usize| holds && index % 4 == 2;
        let part = |held: bool| Self {
            groups: self
                .groups
                .iter()
                .map(|group| group.only(|index| is_held(index) == held))
                .collect(),
            left_out: self.left_out.clone(),
            resistance_ohm: self.resistance_ohm,
            orientation_deg: self.orientation_deg,
        };
        (part(false), part(true))
    }

    /// Only some bins, chosen by the places of group and bin.
    #[must_use]
    pub fn keep(&self, keep: impl Fn(usize, usize) -> bool) -> Self {
        let mut data = self.clone();
        for (index, group) in data.groups.iter_mut().enumerate() {
            let kept: Vec<bool> = (0..group.bins.len()).map(|bin| keep(index, bin)).collect();
            let pick = |values: &[BinValues]| {
                values.iter().zip(&kept).filter(|(_, keep)| **keep).map(|(v, _)| *v).collect()
            };
            group.measured = group.measured.iter().map(|drone| pick(drone)).collect();
            let bins = group.bins.iter().zip(&kept).filter(|(_, keep)| **keep);
            group.bins = bins.map(|(bin, _)| bin.clone()).collect();
        }
        data
    }
}

/// Fewest drones of a fleet of which some are held out: a quarter of eight is two. Convention.
const FEWEST_TO_HOLD: usize = 8;
/// Fewest drones of a group of which some are held out: a quarter of four is one. Convention.
const FEWEST_IN_GROUP: usize = 4;

/// A pulse that moves less than this is a constant, us: a hundredth of the usual noise of a bin (2 us).
/// Chosen.
const CONSTANT_US: f64 = 0.02;

/// The constant, if a drone's motors always had the same pulse; what was taken off for its lean is put
/// back.
pub(super) fn constant_us<'a>(
    values: impl Iterator<Item = &'a BinValues>,
    thrust_exponent: f64,
) -> Option<f64> {
    let raw = |values: &BinValues| {
        let cos = values.lean_rad[0].hypot(values.lean_rad[1]).cos();
        IDLE_US + (values.pulse_us - IDLE_US) / cos.powf(thrust_exponent)
    };
    let (mut low, mut high, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0);
    for us in values.map(raw) {
        (low, high, count) = (low.min(us), high.max(us), count + 1);
    }
    (count > 2 && high - low < CONSTANT_US).then_some(low)
}

/// Median of the resistances that batteries may have, ohm.
fn resistance_ohm(flown: &[Flown<'_>]) -> Option<f64> {
    let known = flown.iter().filter_map(|one| one.flight.resistance_ohm);
    upper_median(known.filter(|ohm| *ohm > 0.0 && *ohm < 1.0).collect())
}

/// The groups without those of flights that few logs are of: cards that nobody had cleared, not a flight that was repeated.
fn without_strays<'a, 'b>(
    groups: Vec<unplanned::Group<'a, 'b>>,
) -> (Vec<unplanned::Group<'a, 'b>>, Vec<LeftOut>) {
    let logs = |flight: usize| -> usize {
        let own = groups.iter().filter(|group| group.flight == flight);
        own.map(|group| group.members.len()).sum()
    };
    let most = groups.iter().map(|group| logs(group.flight)).max().unwrap_or(0);
    let is_stray: Vec<bool> =
        groups.iter().map(|group| FEW_OF * logs(group.flight) < most).collect();
    let (mut kept, mut strays) = (Vec::new(), Vec::new());
    for (group, is_stray) in groups.into_iter().zip(is_stray) {
        if is_stray {
            let slots = group.members.iter().map(|one| one.slot);
            strays.extend(slots.map(|slot| LeftOut::OtherFlight { slot }));
        } else {
            kept.push(group);
        }
    }
    (kept, strays)
}

/// When the first of the drones armed, show time, s; infinity if none did.
fn first_armed_s<'a>(flights: impl Iterator<Item = &'a Flight>) -> f64 {
    let armed = flights.filter_map(|flight| flight.armed_s.first());
    least(armed.map(|(start, _)| *start)).unwrap_or(f64::INFINITY)
}

/// Fills holes with the group's mean of the bin, moved by the drone's own offset from it.
fn fill(drones: &[Vec<Option<BinValues>>]) -> Vec<Vec<BinValues>> {
    let bins = drones.first().map_or(0, Vec::len);
    let means: Vec<Option<BinValues>> = (0..bins)
        .map(|bin| average(drones.iter().filter_map(|drone| drone[bin].as_ref())))
        .collect();
    drones
        .iter()
        .map(|drone| {
            let apart: Vec<f64> = drone
                .iter()
                .zip(&means)
                .filter_map(|(own, mean)| Some((*own)?.pulse_us - (*mean)?.pulse_us))
                .collect();
            let offset_us = mean(&apart).unwrap_or_default();
            let value = |(own, mean): (&Option<BinValues>, &Option<BinValues>)| {
                own.or_else(|| mean.map(|m| filling(&m, offset_us)))
            };
            drone.iter().zip(&means).filter_map(value).collect()
        })
        .collect()
}

/// What stands in a hole. The others' voltage under load and power do not go with the drone's own pulse.
fn filling(mean: &BinValues, offset_us: f64) -> BinValues {
    let pulse_us = mean.pulse_us + offset_us;
    BinValues { pulse_us, loaded_v: f64::NAN, power_w: f64::NAN, ..*mean }
}

fn average<'a>(values: impl Iterator<Item = &'a BinValues>) -> Option<BinValues> {
    let mut sum = BinValues::default();
    let mut count = 0.0;
    for value in values {
        count += 1.0;
        sum.pulse_us += value.pulse_us;
        sum.climb_mps += value.climb_mps;
        sum.height_m += value.height_m;
        sum.lean_rad[0] += value.lean_rad[0];
        sum.lean_rad[1] += value.lean_rad[1];
        sum.resting_v += value.resting_v;
        sum.loaded_v += value.loaded_v;
        sum.power_w += value.power_w;
    }
    (count > 0.0).then(|| BinValues {
        pulse_us: sum.pulse_us / count,
        climb_mps: sum.climb_mps / count,
        height_m: sum.height_m / count,
        lean_rad: sum.lean_rad.map(|sum| sum / count),
        resting_v: sum.resting_v / count,
        loaded_v: sum.loaded_v / count,
        power_w: sum.power_w / count,
        carried_away: false,
    })
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;
    use crate::mission::resolve::{Override, resolve};

    fn slots(data: &Data) -> Vec<u16> {
        data.groups.iter().flat_map(|group| group.slots.clone()).collect()
    }

    #[test]
    fn a_resistance_that_no_battery_has_is_none() {
        let found_ohm = |known: &[f64]| {
            let flights: Vec<Flight> = known
                .iter()
                .map(|ohm| Flight { resistance_ohm: Some(*ohm), ..Flight::default() })
                .collect();
            let flown: Vec<Flown<'_>> =
                flights.iter().map(|flight| Flown { slot: 1, flight }).collect();
            resistance_ohm(&flown)
        };
        assert_eq!(found_ohm(&[0.02, 1.5, 0.03, 0.0, 0.04]), Some(0.03));
        assert_eq!(found_ohm(&[1.5, 0.0]), None);
        assert_eq!(found_ohm(&[]), None);
    }

    #[test]
    fn a_card_that_nobody_had_cleared_is_no_flight() {
        let flights: Vec<Flight> = (0..11).map(|_| Flight::default()).collect();
        let flown: Vec<Flown<'_>> =
            flights.iter().zip(1..).map(|(flight, slot)| Flown { slot, flight }).collect();
        let kept_of = |counts: [usize; 2]| {
            let mut logs = flown.iter();
            let groups = counts.into_iter().enumerate().map(|(flight, count)| {
                let members = logs.by_ref().take(count).collect();
                unplanned::Group { bins: Vec::new(), members, flight }
            });
            let (kept, strays) = without_strays(groups.collect());
            (kept.len(), strays.iter().map(ToString::to_string).collect::<Vec<_>>())
        };
        assert_eq!(kept_of([1, 1]), (2, Vec::new()), "a flight that was repeated");
        assert_eq!(kept_of([2, 8]), (2, Vec::new()));
        let said = "slot 1: its log is of another flight than nearly all others".to_owned();
        assert_eq!(kept_of([1, 8]), (1, vec![said]));
        assert_eq!(kept_of([0, 0]), (2, Vec::new()));
    }

    #[test]
    fn no_drone_is_fitted_and_held_out() {
        let (train, held) = trial::data(12, |_, _| 0.0).split();
        assert_eq!(slots(&held), [3, 7, 11]);
        assert_eq!(slots(&train), [1, 2, 4, 5, 6, 8, 9, 10, 12]);
        let group = &train.groups[0];
        assert_eq!((group.measured.len(), group.place_m.len()), (9, 9));
        assert_eq!((group.neighbours.len(), group.place_m[2][0]), (9, 30.0));
    }

    #[test]
    fn small_fleets_hold_nobody_out() {
        for (drones, held) in [(7, 0), (8, 2)] {
            let data = trial::data(drones, |_, _| 0.0);
            assert_eq!(data.split().1.drones(), held, "of {drones}");
            assert_eq!(data.split().0.drones(), drones - held);
        }
        // Two groups of which one is too small to miss a drone.
        let mut data = trial::data(8, |_, _| 0.0);
        data.groups.extend(trial::data(3, |_, _| 0.0).groups);
        assert_eq!(data.split().1.drones(), 0);
        data.groups[1] = trial::data(4, |_, _| 0.0).groups.remove(0);
        assert_eq!(data.split().1.counts(), [2, 1]);
    }

    /// Pulse by drone and bin, us; 0 is a hole.
    fn added(pulses: &[[i32; 10]]) -> Data {
        let bins = &trial::ladder()[..10];
        let value = |us: &i32| {
            let pulse_us = f64::from(*us);
            (*us > 0).then(|| BinValues { pulse_us, height_m: pulse_us, ..BinValues::default() })
        };
        let drone = |(index, pulses): (usize, &[i32; 10])| {
            (index as u16 + 1, [0.0; 2], pulses.iter().map(value).collect())
        };
        let mut data = Data::default();
        data.add("all", bins, pulses.iter().enumerate().map(drone).collect(), 0.0);
        data
    }

    #[test]
    fn a_hole_is_filled_by_what_the_others_measured_and_the_drones_own_offset() {
        let mut pulses = [[1500; 10], [1510; 10], [1520; 10], [1530; 10], [1540; 10]];
        // All read 8 us more in bin 3, and drone 5 did not say.
        for drone in &mut pulses {
            drone[3] += 8;
        }
        pulses[4][3] = 0;
        let data = added(&pulses);
        let filled = data.groups[0].measured[4][3];
        // The others' mean is 1523 us, and drone 5 is 20 us above the mean of all.
        assert!((filled.pulse_us - 1543.0).abs() < 1e-9, "{filled:?}");
        assert!((filled.height_m - 1523.0).abs() < 1e-9, "nothing else has an offset: {filled:?}");
        assert!(filled.loaded_v.is_nan() && filled.power_w.is_nan(), "not its own: {filled:?}");
        assert_eq!(data.groups[0].measured[0][3].pulse_us, 1508.0, "what was measured stays");
    }

    #[test]
    fn a_drone_that_is_mostly_holes_is_no_data() {
        let mut pulses = [[1500; 10]; 5];
        pulses[4][3] = 0;
        assert_eq!(slots(&added(&pulses)), [1, 2, 3, 4, 5], "nine of ten bins");
        pulses[4][7] = 0;
        let data = added(&pulses);
        assert_eq!(slots(&data), [1, 2, 3, 4]);
        assert_eq!(
            data.left_out,
            ["slot 5: only 8 of 10 steady bins are usable (gaps in the log, motors at a limit, carried \
              away by the wind, or another flight)"]
            .map(|text| LeftOut::from(text.to_owned()))
        );
        pulses[4] = [0; 10];
        let data = added(&pulses);
        let why = "slot 5: no steady flight of the plan in its log".to_owned();
        assert_eq!(data.left_out, [LeftOut::from(why)]);
    }

    #[test]
    fn a_bin_that_few_have_is_no_data() {
        let mut pulses = [[1500; 10]; 5];
        pulses[4][3] = 0;
        assert_eq!(added(&pulses).groups[0].bins.len(), 10, "four of five");
        pulses[3][3] = 0;
        let data = added(&pulses);
        assert_eq!(data.groups[0].bins.len(), 9, "three of five");
        assert_eq!(data.groups[0].bins[3].start_s, trial::ladder()[4].start_s);
        assert_eq!(slots(&data), [1, 2, 3, 4, 5], "it is nobody's hole then");
    }

    #[test]
    fn a_simulated_drone_stands_for_the_half_that_it_flew_with() {
        let mut data = trial::data(2, |_, _| 0.0);
        let mut other = data.groups[0].clone();
        for bin in &mut other.bins {
            bin.velocity_mps[2] = -bin.velocity_mps[2];
        }
        for value in other.measured.iter_mut().flatten() {
            (value.climb_mps, value.height_m) = (-value.climb_mps, 80.0);
        }
        data.groups.push(other);
        // Both hover at once, at two heights.
        let flew = |of: usize| -> Vec<bool> {
            let own = |group: &Group| -> Vec<Option<BinValues>> {
                let values = group.bins.iter().zip(&data.groups[of].measured[0]);
                let is_flown = |bin: &Bin, value: &BinValues| bin.climb_mps() == value.climb_mps;
                values.map(|(bin, value)| is_flown(bin, value).then_some(*value)).collect()
            };
            let drone: Vec<Vec<Option<BinValues>>> = data.groups.iter().map(own).collect();
            data.flown_as(&drone)
        };
        assert_eq!(flew(0), [true, false]);
        assert_eq!(flew(1), [false, true]);
        // Groups that are told the same share what was simulated.
        data.groups[1] = data.groups[0].clone();
        assert_eq!(data.flown_as(&data.as_flown()), [true, true]);
        assert_eq!(data.flown_as(&[vec![None; 16], vec![None; 16]]), [false, false]);
    }

    #[test]
    fn a_pulse_that_never_moves_is_of_no_rotor() {
        let mut data = trial::data(3, |_, _| 0.0);
        for value in &mut data.groups[0].measured[1] {
            value.pulse_us = 1500.0;
        }
        assert_eq!(data.drop_constant(1.0), Some(1500.0));
        assert_eq!(slots(&data), [1, 3]);
    }

    #[test]
    fn neighbours_stand_beside_or_across_a_corner() {
        let grid = [Override::new("grid.rows", 3), Override::new("grid.columns", 3)];
        let plan = resolve("calibration", &grid).unwrap().flights.remove(0).plan;
        let mut data = trial::data(9, |_, _| 0.0);
        for (place_m, slot) in data.groups[0].place_m.iter_mut().zip(&plan.slots) {
            *place_m = [slot.home_m[0], slot.home_m[1]];
        }
        data.count_neighbours(&plan.slots, plan.grid.unwrap().spacing_m);
        let mut counts = data.groups[0].neighbours.clone();
        counts.sort_by(f64::total_cmp);
        assert_eq!(counts, [3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 5.0, 5.0, 8.0]);
    }
}
