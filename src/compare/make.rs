//! The comparison of campaigns, each against the first.

use thiserror::Error;

use super::chance::{LEVEL, chi2_above, f_above, holm};
use super::fleet_laws::{FleetLaws, LawChoice};
use super::laws::{self, Series};
use super::maps::{self, Calibrations};
use super::result::{AllEqual, COMPARE_SCHEMA, Comparison, LawComparison, Quantity};
use super::side::{Couple, FlightOf, Side, couples};
use super::structure;
use crate::analysis::LawKind;
use crate::analysis::turbulence::SHAPE_SE;
use crate::base::estimate::Estimate;
use crate::flight::Indicator;
use crate::mission::plan::Purpose;
use crate::numeric::median;

/// Names that a sentence has at most.
const MOST_NAMED: usize = 12;

/// Error of a comparison: there is nothing to compare.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Fewer than two campaigns.
    #[error("a comparison needs two campaigns or more")]
    One,
    /// Two sides are the same analysis.
    #[error("{first} and {second} are the same analysis: give two that differ")]
    Same {
        /// Path of one.
        first: String,
        /// Path of the other.
        second: String,
    },
    /// No campaign has a flight in common with the reference.
    #[error(
        "{reference} has no flight in common with {others}: flights belong together by their names, or as the only \
         ones for their purpose"
    )]
    NothingInCommon {
        /// Path of the reference.
        reference: String,
        /// Paths of the others.
        others: String,
    },
    /// There are flights in common, but nothing of them can be compared.
    #[error("nothing can be compared:\n{reasons}")]
    Nothing {
        /// Reasons, a line each.
        reasons: String,
    },
}

/// Compares campaigns, each against the first. `made_by`: program and version.
///
/// # Errors
///
/// If two are the same, or there is nothing to compare.
pub fn compare(
    sides: &[Side],
    choice: LawChoice,
    made_by: &str,
) -> Result<Comparison, CompareError> {
    let [reference, others @ ..] = sides else { return Err(CompareError::One) };
    if others.is_empty() {
        return Err(CompareError::One);
    }
    for (index, side) in sides.iter().enumerate() {
        if let Some(same) = sides.iter().take(index).find(|one| one.analysis == side.analysis) {
            let (first, second) = (same.path.clone(), side.path.clone());
            return Err(CompareError::Same { first, second });
        }
    }
    let mut found = Comparison {
        schema: COMPARE_SCHEMA.to_owned(),
        made_by: made_by.to_owned(),
        campaigns: sides.iter().map(Side::told).collect(),
        level: LEVEL,
        laws: Vec::new(),
        maps: Vec::new(),
        structures: Vec::new(),
        all_equal: Vec::new(),
        not_compared: Vec::new(),
        notes: Vec::new(),
    };
    let paired: Vec<Vec<Couple<'_>>> =
        others.iter().map(|other| couples(reference, other)).collect();
    if paired.iter().all(Vec::is_empty) {
        let others: Vec<&str> = others.iter().map(|side| side.path.as_str()).collect();
        let (reference, others) = (reference.path.clone(), others.join(", "));
        return Err(CompareError::NothingInCommon { reference, others });
    }
    for (other, couples) in others.iter().zip(&paired) {
        note_vehicles(&mut found, reference, other);
        note_alone(&mut found, reference, other, couples);
        pair_of(&mut found, couples, choice);
    }
    if sides.len() > 2 {
        add_all_equal(&mut found, &paired, choice);
    }
    if found.laws.is_empty() && found.maps.is_empty() {
        let reasons: Vec<&str> =
            found.not_compared.iter().chain(&found.notes).map(String::as_str).collect();
        return Err(CompareError::Nothing { reasons: reasons.join("\n") });
    }
    Ok(found)
}

/// Relative standard error of the slope of a calibration's line, that of a line that bends within its ladder included.
fn slope_share(couple: &Couple<'_>) -> Option<f64> {
    let line = couple.reference.flight.flock.as_ref()?.linear.as_ref()?;
    let slope = line.parameters.first()?.estimate;
    let share = slope.se / slope.value.abs();
    share.is_finite().then(|| share.hypot(SHAPE_SE))
}

/// Everything of two campaigns.
fn pair_of(found: &mut Comparison, couples: &[Couple<'_>], choice: LawChoice) {
    let calibration = |one: &&Couple<'_>| one.reference.flight.purpose == Purpose::Calibration;
    let (calibrations, measurements): (Vec<&Couple<'_>>, Vec<&Couple<'_>>) =
        couples.iter().partition(calibration);
    let sides = couples.first().map(|couple| [couple.reference.side, couple.other.side]);
    let held = |side: &Side| side.analysis.laws_from.as_ref().map(|from| from.sha256.clone());
    let same_laws = sides.is_none_or(|[reference, other]| held(reference) == held(other));
    for side in sides.into_iter().flatten() {
        if let Some(from) = &side.analysis.laws_from {
            found.notes.push(format!(
                "{}: its map is by laws that are held from another analysis ({})",
                side.id, from.path
            ));
        }
    }
    let same_calibration = same_laws
        && !calibrations.is_empty()
        && calibrations.iter().all(|couple| couple.is_one_flight());
    let slope_share =
        calibrations.iter().filter_map(|couple| slope_share(couple)).fold(0.0, f64::max);
    let mut scatters = Vec::new();
    for couple in calibrations {
        let words = words_of(couple);
        if couple.is_one_flight() {
            found.notes.push(format!("{words} are one flight: its laws are the same"));
            continue;
        }
        match laws_of(couple, choice) {
            Ok(laws) => {
                note_drones(found, couple, &laws);
                note_law(found, couple, choice);
                let hover = laws.fleet.iter().find(|change| change.quantity == Quantity::Hover);
                scatters.extend(hover.and_then(|change| change.scatter));
                found.laws.push(laws);
            }
            Err(reason) => {
                found.not_compared.push(format!("The laws of {words} are not compared: {reason}."));
            }
        }
    }
    let scatter = scatters.into_iter().fold(1.0, f64::max);
    for couple in measurements {
        measurement(
            found,
            couple,
            Calibrations { are_one: same_calibration, slope_share, scatter },
        );
    }
}

/// Names in a sentence; of many, the first.
fn listed(names: &[String]) -> String {
    match names.len().checked_sub(MOST_NAMED) {
        Some(more) if more > 0 => format!("{} and {more} more", names[..MOST_NAMED].join(", ")),
        _ => names.join(", "),
    }
}

fn words_of(couple: &Couple<'_>) -> String {
    format!("{} and {}", couple.reference.id(), couple.other.id())
}

/// Laws of two flights. `Err`: why not.
fn laws_of(couple: &Couple<'_>, choice: LawChoice) -> Result<LawComparison, String> {
    let of = |flight: FlightOf<'_>| {
        FleetLaws::of(flight, choice).ok_or_else(|| format!("{} has none", flight.id()))
    };
    let (a, b) = (of(couple.reference)?, of(couple.other)?);
    let indicators = [couple.reference, couple.other].map(|flight| flight.flight.indicator);
    if indicators[0] != indicators[1] {
        let [one, other] = indicators.map(Indicator::words);
        return Err(format!("one is of {one}, the other of {other}"));
    }
    if a.form != b.form {
        let (one, other) = (a.form.name(), b.form.name());
        return Err(format!(
            "they are of different kinds ({one}, {other}); --law linear or --law signed-quadratic compares the \
             paper's laws, which both have"
        ));
    }
    laws::compare(couple, &a, &b).ok_or_else(|| "no drone has a law in both".to_owned())
}

fn measurement(found: &mut Comparison, couple: &Couple<'_>, calibrations: Calibrations) {
    let words = words_of(couple);
    let [a, b] = [couple.reference.flight, couple.other.flight];
    let (Some(of_a), Some(of_b)) = (&a.map, &b.map) else {
        let lacking = if a.map.is_none() { couple.reference } else { couple.other };
        let lacking = lacking.id();
        found
            .not_compared
            .push(format!("The maps of {words} are not compared: {lacking} has none."));
        return;
    };
    if couple.is_one_flight() {
        found.notes.push(format!(
            "{words} are one flight that was analysed twice: what differs is the analysis, not the air, and the \
             errors of the differences are too large"
        ));
    }
    if of_a.law != of_b.law {
        let (one, other) = (of_a.law, of_b.law);
        found
            .notes
            .push(format!("The maps of {words} were inverted by different laws: {one}, {other}"));
    }
    match maps::compare(couple, [of_a, of_b], calibrations) {
        Some((map, reason)) => {
            found.maps.push(map);
            if let Some(reason) = reason {
                found
                    .not_compared
                    .push(format!("The maps of {words} are not compared by place: {reason}."));
            }
        }
        None => found
            .not_compared
            .push(format!("The maps of {words} are not compared: one of them has no values.")),
    }
    if let (Some(of_a), Some(of_b)) = (&a.statistics, &b.statistics) {
        found.structures.extend(structure::compare(couple, [of_a, of_b]));
    }
}

fn note_vehicles(found: &mut Comparison, reference: &Side, other: &Side) {
    if let (Some(one), Some(another)) = (reference.vehicle(), other.vehicle())
        && one != another
    {
        found.notes.push(format!(
            "{} flew the vehicle {one}, {} the vehicle {another}: their laws differ for that reason, too",
            reference.id, other.id
        ));
    }
}

fn note_alone(found: &mut Comparison, reference: &Side, other: &Side, couples: &[Couple<'_>]) {
    let lone = |side: &Side, is_there: &dyn Fn(usize) -> bool| -> Vec<String> {
        side.flights().filter(|one| !is_there(one.index)).map(|one| one.id()).collect()
    };
    let mut alone = lone(reference, &|at| couples.iter().any(|one| one.reference.index == at));
    alone.extend(lone(other, &|at| couples.iter().any(|one| one.other.index == at)));
    if !alone.is_empty() {
        let verb = if alone.len() == 1 { "has" } else { "have" };
        found
            .not_compared
            .push(format!("{} {verb} no counterpart in the other campaign.", listed(&alone)));
    }
}

/// Flights whose windows prefer another law than the one that was asked for.
fn note_law(found: &mut Comparison, couple: &Couple<'_>, choice: LawChoice) {
    let asked = match choice {
        LawChoice::Preferred => return,
        LawChoice::Linear => LawKind::Linear,
        LawChoice::SignedQuadratic => LawKind::SignedQuadratic,
    };
    for flight in [couple.reference, couple.other] {
        let headline = flight.flight.headline.as_ref();
        if let Some(preferred) = headline.map(|headline| headline.law).filter(|law| *law != asked) {
            found.notes.push(format!(
                "The windows of {} prefer the {preferred} law: what the {asked} law says of single drones may be chance",
                flight.id()
            ));
        }
    }
}

/// Drones that only one has, and simulated ones that share no more than their slot.
fn note_drones(found: &mut Comparison, couple: &Couple<'_>, laws: &LawComparison) {
    let seeds =
        [couple.reference, couple.other].map(|one| one.facts().and_then(|facts| facts.seed));
    if let [Some(one), Some(other)] = seeds
        && one != other
    {
        found.notes.push(format!(
            "{} were simulated with the seeds {one} and {other}: drones of one slot are different drones, unless the \
             vehicle has no spread between drones",
            words_of(couple)
        ));
    }
    for (labels, flight) in
        [(&laws.only_reference, couple.reference), (&laws.only_other, couple.other)]
    {
        if !labels.is_empty() {
            found.notes.push(format!("Only {} has a law of {}", flight.id(), listed(labels)));
        }
    }
}

/// Tests that all campaigns have the same laws and the same mean of the air.
fn add_all_equal(found: &mut Comparison, paired: &[Vec<Couple<'_>>], choice: LawChoice) {
    let Some((first, rest)) = paired.split_first() else { return };
    for couple in first {
        let index = couple.reference.index;
        let others: Option<Vec<&Couple<'_>>> = rest
            .iter()
            .map(|couples| couples.iter().find(|one| one.reference.index == index))
            .collect();
        let Some(others) = others else { continue };
        let flights: Vec<FlightOf<'_>> = [couple.reference, couple.other]
            .into_iter()
            .chain(others.iter().map(|couple| couple.other))
            .collect();
        let ids: Vec<String> = flights.iter().map(FlightOf::id).collect();
        if couple.reference.flight.purpose == Purpose::Calibration {
            let laws: Option<Vec<FleetLaws>> =
                flights.iter().map(|flight| FleetLaws::of(*flight, choice)).collect();
            let Some(laws) = laws.filter(|laws| laws.iter().all(|one| one.form == laws[0].form))
            else {
                continue;
            };
            let scatters: Vec<f64> = (found.laws.iter())
                .filter(|pair| pair.pair.reference == ids[0])
                .flat_map(|pair| &pair.fleet)
                .filter(|change| change.quantity == Quantity::Hover)
                .filter_map(|change| change.scatter)
                .collect();
            let with: Vec<_> = laws.iter().zip(flights.iter().copied()).collect();
            let series = laws::over_all(&with, median(scatters));
            found.all_equal.extend(equal(&ids, "effort in hover", &series));
        } else {
            let of_pair = |other: &String| {
                let map = found
                    .maps
                    .iter()
                    .find(|map| map.pair.reference == ids[0] && map.pair.other == *other)?;
                (!map.same_calibration).then_some(map.mean)
            };
            let Some(means) = ids.iter().skip(1).map(of_pair).collect::<Option<Vec<_>>>() else {
                continue;
            };
            let Some(of_first) = means.first().map(|mean| mean.reference) else { continue };
            let values: Vec<Estimate> =
                std::iter::once(of_first).chain(means.iter().map(|mean| mean.other)).collect();
            let series = [Series { drone: None, values, dof: None }];
            found.all_equal.extend(equal(&ids, "mean vertical air speed", &series));
        }
    }
}

fn equal(flights: &[String], name: &str, series: &[Series]) -> Vec<AllEqual> {
    let mut rows: Vec<AllEqual> =
        series.iter().filter_map(|one| equal_of(flights, name, one)).collect();
    let p_values: Vec<f64> =
        rows.iter().map(|row| if row.drone.is_some() { row.p_value } else { f64::NAN }).collect();
    for (row, p) in rows.iter_mut().zip(holm(&p_values)) {
        row.p_holm = (!p.is_nan()).then_some(p);
    }
    rows
}

fn equal_of(flights: &[String], name: &str, series: &Series) -> Option<AllEqual> {
    let values = &series.values;
    let weight = |of: &Estimate| of.se.powi(-2);
    if !values.iter().all(|of| of.se > 0.0 && of.se.is_finite() && of.value.is_finite()) {
        return None;
    }
    let total: f64 = values.iter().map(weight).sum();
    let center = values.iter().map(|of| of.value * weight(of)).sum::<f64>() / total;
    let chi2: f64 = values.iter().map(|of| (of.value - center).powi(2) * weight(of)).sum();
    let dof = values.len().checked_sub(1).filter(|dof| *dof > 0)?;
    let p_value = match series.dof {
        Some(of_errors) => f_above(chi2 / dof as f64, dof as f64, of_errors),
        None => chi2_above(chi2, dof),
    };
    Some(AllEqual {
        flights: flights.to_vec(),
        name: name.to_owned(),
        drone: series.drone.clone(),
        chi2,
        dof,
        p_value,
        p_holm: None,
    })
}
