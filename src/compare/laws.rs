//! Laws of two flights side by side: the fleet, and the drones against it.
//!
//! What all drones of a flight share (slow air during the calibration, the constants of corrections) moves all of
//! their laws alike. It is in the error of the fleet's change, once for each flight, and in no drone's change against
//! the fleet's: there only the drones' own errors count, with the scatter that the fleet itself shows.

use std::collections::BTreeMap;

use super::chance::{
    LEVEL, MEDIAN_OVER_MEAN, holm, qn, qn_freedom, two_sided, two_sided_t, weighted_median,
};
use super::fleet_laws::{FleetLaws, Parameters, variance};
use super::result::{Basis, Change, CurvePoint, DroneChange, FleetChange, LawComparison, Quantity};
use super::side::{Couple, FlightOf};
use crate::base::estimate::Estimate;

/// Fewest drones from which one is told from the fleet.
const FEWEST: usize = 3;
/// Fewest drones whose scatter is used.
const FEWEST_SCATTERED: usize = 4;
/// Fewest drones whose scatter stands for their errors.
const FEWEST_ALONE: usize = 6;
/// Points of the fleet's curves.
const CURVE: u32 = 41;

/// Drones of two flights with a law in both: their key, and where they are in either.
struct Together {
    keys: Vec<String>,
    reference: Vec<usize>,
    other: Vec<usize>,
    only_reference: Vec<String>,
    only_other: Vec<String>,
}

fn together(couple: &Couple<'_>, a: &FleetLaws, b: &FleetLaws) -> Together {
    let identity = couple.identity();
    let key = |flight: &FlightOf<'_>, (slot, name, _): &(Option<u16>, String, Parameters)| {
        flight.key(identity, *slot, name)
    };
    let found: BTreeMap<String, usize> = (b.drones.iter().enumerate())
        .filter_map(|(index, drone)| Some((key(&couple.other, drone)?, index)))
        .collect();
    let mut both = Together {
        keys: Vec::new(),
        reference: Vec::new(),
        other: Vec::new(),
        only_reference: Vec::new(),
        only_other: Vec::new(),
    };
    for (index, drone) in a.drones.iter().enumerate() {
        match key(&couple.reference, drone).and_then(|key| Some((*found.get(&key)?, key))) {
            // Two logs of one airframe cannot both be the one drone.
            Some((at, key)) if !both.other.contains(&at) => {
                both.keys.push(key);
                both.reference.push(index);
                both.other.push(at);
            }
            _ => both.only_reference.push(drone.1.clone()),
        }
    }
    let left = b.drones.iter().enumerate().filter(|(index, _)| !both.other.contains(index));
    both.only_other.extend(left.map(|(_, drone)| drone.1.clone()));
    both
}

/// Changes of one quantity of all drones in both.
struct Spread {
    /// Change of the fleet: their median.
    median: f64,
    /// Variance of that by the drones' own errors.
    median_variance: f64,
    /// The fleet's scatter over the stated errors.
    scatter: Option<f64>,
    /// What the drones' errors are multiplied with.
    factor: f64,
    /// Degrees of freedom of that factor; `None`: nothing was estimated.
    dof: Option<f64>,
}

/// Whether each of these has an error.
fn all_known(changes: &[Estimate]) -> bool {
    changes.iter().all(|change| change.se > 0.0 && change.se.is_finite())
}

/// Weights of a median over drones: by their errors, or alike where one is not known.
fn weights(changes: &[Estimate]) -> impl Iterator<Item = f64> {
    let all_known = all_known(changes);
    changes.iter().map(move |change| if all_known { 1.0 / change.se } else { 1.0 })
}

fn spread(changes: &[Estimate], basis: Basis) -> Option<Spread> {
    let all_known = all_known(changes);
    let weighted: Vec<_> =
        changes.iter().map(|change| change.value).zip(weights(changes)).collect();
    let median = weighted_median(&weighted)?;
    let n = changes.len();
    let standard: Vec<f64> =
        changes.iter().map(|change| (change.value - median) / change.se).collect();
    let scatter = (all_known && n >= FEWEST_SCATTERED).then(|| qn(&standard)).flatten();
    let (factor, dof) = match (scatter, basis) {
        (Some(scatter), Basis::Scatter) => (scatter, Some(qn_freedom(n))),
        (Some(scatter), Basis::Stated) if scatter > 1.0 => (scatter, Some(qn_freedom(n))),
        _ => (1.0, None),
    };
    let precision: f64 = changes.iter().map(|change| change.se.powi(-2)).sum();
    let by_median = if n < FEWEST { 1.0 } else { MEDIAN_OVER_MEAN };
    let median_variance = if all_known { by_median * factor * factor / precision } else { 0.0 };
    Some(Spread { median, median_variance, scatter, factor, dof })
}

/// Quantities that two flights can be compared by, with what parameters are multiplied with.
fn quantities(a: &FleetLaws, b: &FleetLaws) -> Vec<(Quantity, Option<f64>, [f64; 4])> {
    let [low, high] = common_speeds(a, b);
    let is_complete = a.is_complete && b.is_complete;
    let at = |speed: f64, is_there: bool| {
        (is_there && is_complete).then(|| (Some(speed), a.form.basis(speed)))
    };
    let of = |quantity: Quantity| {
        let (speed, gradient) = match quantity {
            Quantity::Hover => (None, [1.0, 0.0, 0.0, 0.0]),
            Quantity::Response => (None, [0.0, 1.0, 0.0, 0.0]),
            Quantity::Climb => at(high, high > 0.0)?,
            Quantity::Descent => at(low, low < 0.0)?,
        };
        Some((quantity, speed, gradient))
    };
    Quantity::ALL.into_iter().filter_map(of).collect()
}

fn common_speeds(a: &FleetLaws, b: &FleetLaws) -> [f64; 2] {
    [a.speeds_mps[0].max(b.speeds_mps[0]), a.speeds_mps[1].min(b.speeds_mps[1])]
}

fn basis_of(is_split: bool, n: usize) -> Basis {
    if is_split || n < FEWEST_ALONE { Basis::Stated } else { Basis::Scatter }
}

/// Compares the laws of two flights of one form; `None` where no drone has a law in both.
pub(super) fn compare(couple: &Couple<'_>, a: &FleetLaws, b: &FleetLaws) -> Option<LawComparison> {
    let both = together(couple, a, b);
    let n = both.keys.len();
    if n == 0 {
        return None;
    }
    let basis = basis_of(a.is_split && b.is_split, n);
    let mut drones: Vec<DroneChange> = (both.keys.iter().zip(&both.reference).zip(&both.other))
        .map(|((key, at), other)| {
            let (slot, name, _) = &a.drones[*at];
            let other_slot = b.drones[*other].0.filter(|other| Some(*other) != *slot);
            DroneChange {
                id: key.clone(),
                slot: *slot,
                other_slot,
                name: name.clone(),
                changes: Vec::new(),
                is_changed: false,
            }
        })
        .collect();
    let mut fleet = Vec::new();
    for (quantity, speed_mps, gradient) in quantities(a, b) {
        let values = |laws: &FleetLaws, places: &[usize]| -> Vec<Estimate> {
            places.iter().map(|at| laws.drones[*at].2.along(gradient)).collect()
        };
        let (before, after) = (values(a, &both.reference), values(b, &both.other));
        let changes: Vec<Estimate> = (before.iter().zip(&after))
            .map(|(a, b)| Estimate::new(b.value - a.value, a.se.hypot(b.se)))
            .collect();
        let spread = spread(&changes, basis)?;
        let common = [a, b].map(|laws| variance(&laws.fleet.covariance, gradient));
        let se = (common.iter().sum::<f64>() + spread.median_variance).sqrt();
        // The paper's fits take the air that all drones shared for noise of each window.
        let is_known = a.is_split && b.is_split && se > 0.0;
        let z = is_known.then(|| spread.median / se);
        let (reference, other) = (a.fleet.along(gradient), b.fleet.along(gradient));
        let level = level_of(&before, &after, &changes);
        let half = spread.median / 2.0;
        let in_both = |side: f64, shared: Estimate| {
            level.map(|level| {
                let se = (shared.se.powi(2) + spread.median_variance / 2.0).sqrt();
                Estimate::new(level + side * half, se)
            })
        };
        fleet.push(FleetChange {
            quantity,
            unit: a.form.unit(quantity, &a.unit),
            speed_mps,
            reference,
            other,
            change: Estimate::new(spread.median, se),
            reference_in_both: in_both(-1.0, reference),
            other_in_both: in_both(1.0, other),
            z,
            p_value: z.map(two_sided),
            scatter: spread.scatter,
        });
        for (index, drone) in drones.iter_mut().enumerate() {
            let se = (spread.factor * changes[index].se).hypot(spread.median_variance.sqrt());
            let beyond = (n >= FEWEST && changes[index].se > 0.0)
                .then(|| Estimate::new(changes[index].value - spread.median, se));
            let t = beyond.filter(|of| of.se > 0.0).map(|of| of.value / of.se);
            drone.changes.push(Change {
                quantity,
                reference: before[index],
                other: after[index],
                beyond_fleet: beyond,
                t,
                dof: spread.dof.filter(|_| t.is_some()),
                p_value: t.map(|t| two_sided_t(t, spread.dof)),
                p_holm: None,
            });
        }
    }
    correct(&mut drones);
    Some(LawComparison {
        pair: couple.pair(),
        law: a.form.name().to_owned(),
        effort_unit: a.unit.clone(),
        identity: couple.identity(),
        drones_in_both: n,
        only_reference: both.only_reference,
        only_other: both.only_other,
        basis,
        fleet,
        drones,
        curve: curve(a, b),
    })
}

/// Where the drones in both are between their two flights: the median, weighted as that of their changes.
fn level_of(before: &[Estimate], after: &[Estimate], changes: &[Estimate]) -> Option<f64> {
    let levels = before.iter().zip(after).map(|(a, b)| f64::midpoint(a.value, b.value));
    weighted_median(&levels.zip(weights(changes)).collect::<Vec<_>>())
}

/// Corrects the tests of all drones of a pair together.
fn correct(drones: &mut [DroneChange]) {
    let tests = || {
        drones.iter().flat_map(|drone| &drone.changes).filter(|change| change.quantity.is_tested())
    };
    let p_values: Vec<f64> = tests().map(|change| change.p_value.unwrap_or(f64::NAN)).collect();
    let mut corrected = holm(&p_values).into_iter();
    for drone in drones {
        for change in drone.changes.iter_mut().filter(|change| change.quantity.is_tested()) {
            change.p_holm = corrected.next().filter(|p| !p.is_nan());
        }
        let below = |change: &Change| change.p_holm.is_some_and(|p| p < LEVEL);
        drone.is_changed = drone.changes.iter().any(below);
    }
}

fn curve(a: &FleetLaws, b: &FleetLaws) -> Vec<CurvePoint> {
    let [low, high] = common_speeds(a, b);
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Vec::new();
    }
    let at = |laws: &FleetLaws, speed: f64| {
        let found = laws.fleet.along(laws.form.basis(speed));
        Estimate::new(found.value, if laws.is_complete { found.se } else { 0.0 })
    };
    (0..CURVE)
        .map(|step| {
            let speed_mps = low + (high - low) * f64::from(step) / f64::from(CURVE - 1);
            CurvePoint { speed_mps, reference: at(a, speed_mps), other: at(b, speed_mps) }
        })
        .collect()
}

/// Efforts in hover of one drone, or changes of one fleet, over several campaigns.
pub(super) struct Series {
    /// Key of the drone; `None`: the fleet.
    pub(super) drone: Option<String>,
    pub(super) values: Vec<Estimate>,
    pub(super) dof: Option<f64>,
}

/// Effort in hover over all campaigns: of the fleet by the drones that all have, and of these drones against it.
/// Empty where fewer than [`FEWEST`] drones are in all.
pub(super) fn over_all(laws: &[(&FleetLaws, FlightOf<'_>)], scatter: Option<f64>) -> Vec<Series> {
    let hover = [1.0, 0.0, 0.0, 0.0];
    let Some(((first, first_flight), others)) = laws.split_first() else { return Vec::new() };
    let mut rows: BTreeMap<usize, (String, Vec<usize>)> = BTreeMap::new();
    for (turn, (other, flight)) in others.iter().enumerate() {
        let couple = Couple { reference: *first_flight, other: *flight };
        let both = together(&couple, first, other);
        for ((key, at), place) in both.keys.into_iter().zip(both.reference).zip(both.other) {
            let row = rows.entry(at).or_insert_with(|| (key, vec![at]));
            if row.1.len() == turn + 1 {
                row.1.push(place);
            }
        }
    }
    rows.retain(|_, (_, places)| places.len() == laws.len());
    let n = rows.len();
    if n < FEWEST {
        return Vec::new();
    }
    let is_split = laws.iter().all(|(laws, _)| laws.is_split);
    let basis = basis_of(is_split, n);
    let factor = match (scatter, basis) {
        (Some(scatter), Basis::Scatter) => scatter,
        (Some(scatter), Basis::Stated) => scatter.max(1.0),
        (None, _) => 1.0,
    };
    let dof = (factor != 1.0).then(|| qn_freedom(n));
    let value = |turn: usize, place: usize| laws[turn].0.drones[place].2.along(hover);
    let mut levels = Vec::new();
    for turn in 0..laws.len() {
        let changes: Vec<Estimate> = (rows.values())
            .map(|(_, places)| {
                let change = value(turn, places[turn]).value - value(0, places[0]).value;
                Estimate::new(change, value(turn, places[turn]).se)
            })
            .collect();
        let Some(spread) = spread(&changes, Basis::Stated) else { return Vec::new() };
        let precision: f64 = changes.iter().map(|change| change.se.powi(-2)).sum();
        let own = if precision.is_finite() {
            MEDIAN_OVER_MEAN * factor * factor / precision
        } else {
            0.0
        };
        let se = (variance(&laws[turn].0.fleet.covariance, hover) + own).sqrt();
        levels.push(Estimate::new(spread.median, se));
    }
    let own = |(key, places): &(String, Vec<usize>)| {
        let values = places.iter().enumerate().map(|(turn, place)| {
            let found = value(turn, *place);
            Estimate::new(found.value - levels[turn].value, factor * found.se)
        });
        Series { drone: Some(key.clone()), values: values.collect(), dof }
    };
    let drones: Vec<Series> = rows.values().map(own).collect();
    let fleet = is_split.then_some(Series { drone: None, values: levels, dof: None });
    fleet.into_iter().chain(drones).collect()
}
