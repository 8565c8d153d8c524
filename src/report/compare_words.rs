//! A comparison of campaigns in sentences, for page and terminal.

use crate::base::estimate::Estimate;
use crate::compare::chance::LEVEL;
use crate::compare::result::{
    AllEqual, Basis, Change, ComparedCampaign, Comparison, DroneChange, FleetChange, Identity,
    LawComparison, MapComparison, MeanComparison, Pair, Quantity, ScaleComparison,
};

use super::text::{NONE, clean, count, estimate, fixed, signed, unit, usable};

/// A response that changed by so many errors is told beside a changed hover.
const TOLD: f64 = 2.0;
/// Scatter over stated errors that is not told closer.
const LEAST_SCATTER: f64 = 0.1;
/// Below this a probability is not printed.
const LEAST_P: f64 = 1e-4;

/// A probability: `p = 0.031`, `p < 0.0001`.
pub(super) fn probability(p: Option<f64>) -> String {
    match p.filter(|p| p.is_finite()) {
        Some(p) if p < LEAST_P => "p < 0.0001".to_owned(),
        Some(p) => format!("p = {}", fixed(p, if p < 0.01 { 4 } else { 2 })),
        None => "p not known".to_owned(),
    }
}

/// The same for a table's cell.
pub(super) fn probability_cell(p: Option<f64>) -> String {
    match p.filter(|p| p.is_finite()) {
        Some(p) if p < LEAST_P => "< 0.0001".to_owned(),
        Some(p) => fixed(p, if p < 0.01 { 4 } else { 2 }),
        None => NONE.to_owned(),
    }
}

/// The value of a change with its sign, and its error: `+14.1 ± 3.0`.
pub(super) fn change(of: Estimate) -> String {
    let text = value(of);
    let shown = text.split(' ').next().unwrap_or_default();
    let is_zero = !shown.chars().any(|c| matches!(c, '1'..='9'));
    if of.value > 0.0 && usable(of.value) && !is_zero { format!("+{text}") } else { text }
}

/// A value with its error; without one, with the digits that a reader can use.
pub(super) fn value(of: Estimate) -> String {
    let negligible = of.se < 1e-9 * of.value.abs();
    if usable(of.value) && usable(of.se) && (of.se <= 0.0 || negligible) {
        let decimals = match of.value.abs() {
            size if size >= 100.0 => 1,
            size if size >= 10.0 => 2,
            _ => 3,
        };
        return fixed(of.value, decimals);
    }
    estimate(of)
}

/// The fleet before and now, by the drones in both: the two that the change lies between.
pub(super) fn before_and_now(of: &FleetChange) -> [String; 2] {
    let found = of.reference_in_both.zip(of.other_in_both);
    let (before, now) = found.unwrap_or((of.reference, of.other));
    // Both with the digits of the one that is known better, so that the change is their difference.
    let places = [before, now, of.change].iter().filter_map(Estimate::decimals).max();
    match places.filter(|_| [before, now].iter().all(|one| one.se > 0.0 && usable(one.se))) {
        Some(places) => [before, now]
            .map(|one| format!("{} ± {}", fixed(one.value, places), fixed(one.se, places))),
        None => [before, now].map(value),
    }
}

/// Vehicles of a pair's flights where they differ: `tuesday flew x400, monday x300`.
pub(super) fn other_vehicle(comparison: &Comparison, pair: &Pair) -> Option<String> {
    let of = |flight: &str| {
        let is_there = |one: &&ComparedCampaign| one.flights.iter().any(|id| id == flight);
        comparison.campaigns.iter().find(is_there)
    };
    let (reference, other) = (of(&pair.reference)?, of(&pair.other)?);
    let (was, is) = (reference.vehicle.as_deref()?, other.vehicle.as_deref()?);
    (was != is).then(|| {
        let [other, is, reference, was] = [&other.id, is, &reference.id, was].map(clean);
        format!("{other} flew {is}, {reference} {was}")
    })
}

/// The two flights: `tuesday/calibration against monday/calibration`.
pub(super) fn pair(of: &Pair) -> String {
    format!("{} against {}", clean(&of.other), clean(&of.reference))
}

/// A drone's label, by what it is known.
pub(super) fn drone(of: &DroneChange, identity: Identity) -> String {
    let name = clean(&of.name);
    let moved = match (of.slot, of.other_slot) {
        (Some(from), Some(to)) => format!(", slot {from} before and {to} now"),
        (Some(slot), None) if identity == Identity::Airframe => format!(", slot {slot}"),
        _ => String::new(),
    };
    match identity {
        Identity::Airframe => format!("Drone {}{moved}", clean(&of.id)),
        Identity::Slot => {
            let id = clean(&of.id);
            if id == name { name } else { format!("{name} ({id})") }
        }
    }
}

/// What the quantity is, as an effort or its change.
pub(super) fn quantity(of: &FleetChange) -> String {
    match of.quantity {
        Quantity::Hover => "hover".to_owned(),
        Quantity::Response => "response".to_owned(),
        Quantity::Climb | Quantity::Descent => {
            format!("at {} m/s", of.speed_mps.map_or_else(|| NONE.to_owned(), |v| signed(v, 1)))
        }
    }
}

fn of(drone: &DroneChange, quantity: Quantity) -> Option<&Change> {
    drone.changes.iter().find(|change| change.quantity == quantity)
}

/// What changed of the fleet as a whole. `vehicles`: see [`other_vehicle`].
pub(super) fn fleet_sentences(law: &LawComparison, vehicles: Option<&str>) -> Vec<String> {
    let of = |quantity| law.fleet.iter().find(|change| change.quantity == quantity);
    let Some(hover) = of(Quantity::Hover) else { return Vec::new() };
    let effort = unit(&hover.unit);
    let needs = format!(
        "The fleet as a whole ({} in both) needs {} {effort} in hover",
        count(law.drones_in_both, "drone"),
        change(hover.change)
    );
    if hover.p_value.is_none() {
        return vec![format!(
            "{needs}; this is not tested, as the errors of this law leave out slow air that all drones shared."
        )];
    }
    let is_found = |change: &FleetChange| change.p_value.is_some_and(|p| p < LEVEL);
    let verdict = match vehicles {
        Some(vehicles) if is_found(hover) => format!(
            "more than chance: above all another vehicle ({vehicles}); beside that air density, battery, temperature \
             or load of all drones"
        ),
        None if is_found(hover) => {
            "more than chance: air density, battery, temperature or load of all drones".to_owned()
        }
        _ => "no more than the air during the two calibrations and other errors that all drones share"
            .to_owned(),
    };
    let mut said = vec![format!("{needs} ({}), {verdict}.", probability(hover.p_value))];
    said.extend(of(Quantity::Response).filter(|response| is_found(response)).map(|response| {
        let more = if response.change.value > 0.0 { "more strongly" } else { "more weakly" };
        let size = Estimate::new(response.change.value.abs(), response.change.se);
        let cause = match vehicles {
            Some(vehicles) => format!("above all another vehicle ({vehicles})"),
            None => "air density, battery, or motors and propellers of all drones".to_owned(),
        };
        format!(
            "It responds {more} to vertical speed by {} {} ({}), more than chance: {cause}.",
            value(size),
            unit(&response.unit),
            probability(response.p_value)
        )
    }));
    said
}

/// The drones that changed, a sentence each; one sentence where none did.
pub(super) fn drone_sentences(law: &LawComparison) -> Vec<String> {
    let tested = |drone: &DroneChange| drone.changes.iter().any(|change| change.p_holm.is_some());
    if !law.drones.iter().any(tested) {
        let why =
            if law.drones_in_both < 3 { "there are too few" } else { "their errors are not known" };
        return vec![format!("Single drones are not told from the fleet: {why}.")];
    }
    let changed: Vec<String> = law
        .drones
        .iter()
        .filter(|drone| drone.is_changed)
        .map(|drone| sentence(law, drone))
        .collect();
    if !changed.is_empty() {
        return changed;
    }
    let smallest = law.drones.iter().flat_map(|drone| &drone.changes).filter_map(|one| one.p_holm);
    let smallest = smallest.reduce(f64::min);
    vec![format!(
        "No drone changed by more than the fleet beyond chance (smallest {} among all drones).",
        probability(smallest)
    )]
}

/// A change that is more than chance.
fn significant(change: Option<&Change>) -> Option<&Change> {
    change.filter(|change| change.p_holm.is_some_and(|p| p < LEVEL))
}

fn sentence(law: &LawComparison, one: &DroneChange) -> String {
    let name = drone(one, law.identity);
    let effort = unit(&law.effort_unit);
    let (hover, response) = (of(one, Quantity::Hover), of(one, Quantity::Response));
    let t = |change: Option<&Change>| change.and_then(|change| change.t).unwrap_or_default();
    let size = |of: Estimate| value(Estimate::new(of.value.abs(), of.se));
    if let Some((found, beyond)) = significant(hover).and_then(|of| Some((of, of.beyond_fleet?))) {
        let more = if beyond.value > 0.0 { "more" } else { "less" };
        let cause = match (beyond.value > 0.0, t(response)) {
            (true, t) if t > TOLD => "its response rose, too: a weaker motor or a worn propeller",
            (true, t) if t < -TOLD => "its response fell: look at motors, propellers and weight",
            (true, _) => "a weak motor, a propeller, or weight",
            (false, _) => "less weight, or another motor or propeller than before",
        };
        return format!(
            "{name} needs {} {effort} {more} in hover than the fleet's change explains ({} among all \
             drones): {cause}.",
            size(beyond),
            probability(found.p_holm)
        );
    }
    let Some((found, beyond)) = significant(response).and_then(|of| Some((of, of.beyond_fleet?)))
    else {
        return format!("{name} changed.");
    };
    let more = if beyond.value > 0.0 { "stronger" } else { "weaker" };
    let unit_of = law.fleet.iter().find(|change| change.quantity == Quantity::Response);
    let unit_of = unit_of.map_or_else(String::new, |change| unit(&change.unit));
    format!(
        "{name} responds by {} {unit_of} {more} to vertical speed than the fleet's change explains ({} among \
         all drones), with the same effort in hover: look at motors and propellers.",
        size(beyond),
        probability(found.p_holm)
    )
}

/// Where the errors of the drones come from.
pub(super) fn errors_sentence(law: &LawComparison) -> Option<String> {
    let scatter = law.fleet.iter().find(|change| change.quantity == Quantity::Hover)?.scatter?;
    let times = if scatter < LEAST_SCATTER {
        format!("less than {} times", fixed(LEAST_SCATTER, 1))
    } else {
        format!("{} times", fixed(scatter, usize::from(scatter < 10.0)))
    };
    Some(match law.basis {
        Basis::Stated if scatter > 1.0 => format!(
            "The drones' changes in hover scatter by {times} their stated errors, which are widened by that."
        ),
        Basis::Stated => format!(
            "The drones' changes in hover scatter by {times} their stated errors, which are kept."
        ),
        Basis::Scatter => format!(
            "The errors of this law hold air that all drones shared: the scatter of the fleet stands for them ({times} \
             as large)."
        ),
    })
}

/// The change of a mean of the air in a sentence; `what`: "The mean over the fleet".
fn mean_sentence(what: &str, of: &MeanComparison) -> String {
    let interval = of.change_interval.map_or_else(String::new, |[low, high]| {
        format!(", 95 %: {} to {}", signed(low, 2), signed(high, 2))
    });
    let verdict = match of.p_value {
        Some(p) if p < LEVEL => "they differ",
        Some(_) => "no more than chance",
        None => "the errors are not known",
    };
    format!(
        "{what}: {} m/s against {} m/s, a change of {} m/s ({}{interval}): {verdict}.",
        change(of.other),
        change(of.reference),
        change(of.change),
        probability(of.p_value)
    )
}

/// What maps say.
pub(super) fn map_sentences(map: &MapComparison) -> Vec<String> {
    let mut sentences = vec![mean_sentence("Mean vertical air speed of the fleet", &map.mean)];
    if let Some(posterior) = &map.posterior {
        sentences.push(mean_sentence("Mean of the posterior maps", posterior));
    }
    if map.same_calibration {
        sentences.push(
            if map.errors_cancel {
                "Both maps rest on the same calibration: the error of its zero cancels in their difference."
            } else {
                "Both maps rest on the same calibration by a law that is flat near hover: the error of its zero makes \
                 them too weak or too strong, and does not cancel in their difference."
            }
            .to_owned(),
        );
    }
    if let Some(places) = &map.places {
        let verdict = if places.p_value < LEVEL {
            "the patterns of the two means differ"
        } else {
            "apart from a shift of all places, the two means agree within the errors of the drones"
        };
        sentences.push(format!(
            "By place ({}): χ² = {} with {} degrees of freedom ({}): {verdict}.",
            count(places.places.len(), "place"),
            fixed(places.chi2, 1),
            places.dof,
            probability(Some(places.p_value))
        ));
        if let Some(correlation) = places.correlation {
            let independent = places.effective_places.map_or_else(String::new, |n| {
                format!(", of places that count as {} independent ones", fixed(n, 1))
            });
            let verdict = match places.correlation_p_value {
                Some(p) => probability(Some(p)),
                None => "too few to tell it from chance".to_owned(),
            };
            sentences.push(format!(
                "Correlation of the means over the places: {}{independent} ({verdict}).",
                signed(correlation, 2)
            ));
        }
    }
    let differ: Vec<&ScaleComparison> = map.scales.iter().filter(|row| differs(row)).collect();
    if map.scales.iter().any(|row| row.p_holm.is_some()) {
        sentences.push(if differ.is_empty() {
            "Strength and scales of the air differ by no more than chance.".to_owned()
        } else {
            let labels: Vec<String> = differ.iter().map(|row| clean(&row.name)).collect();
            let verb = if labels.len() == 1 { "differs" } else { "differ" };
            format!(
                "Of the strength and the scales of the air, {} {verb} by more than chance.",
                and_joined(&labels)
            )
        });
    }
    sentences
}

/// `a`, `a and b`, `a, b and c`.
fn and_joined(words: &[String]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => words.concat(),
    }
}

/// Whether a scale differs by more than chance.
pub(super) fn differs(row: &ScaleComparison) -> bool {
    row.p_holm.is_some_and(|p| p < LEVEL)
}

/// A scale with its interval.
pub(super) fn scale(value: f64, interval: Option<[f64; 2]>) -> String {
    let number = |value: f64| fixed(value, if value.abs() < 10.0 { 2 } else { 0 });
    let interval = interval
        .map_or_else(String::new, |[low, high]| format!(" ({} to {})", number(low), number(high)));
    format!("{}{interval}", number(value))
}

/// What is said of all campaigns together.
pub(super) fn equal_sentences(comparison: &Comparison) -> Vec<String> {
    let level = comparison.level;
    let of_fleet = comparison.all_equal.iter().filter(|row| row.drone.is_none()).map(|row| {
        let verdict =
            if row.p_value < level { "they are not all equal" } else { "all may be equal" };
        format!(
            "All {}, {} of the fleet: χ² = {} with {} degrees of freedom ({}): {verdict}.",
            count(row.flights.len(), "flight"),
            clean(&row.name),
            fixed(row.chi2, 1),
            row.dof,
            probability(Some(row.p_value))
        )
    });
    let mut sentences: Vec<String> = of_fleet.collect();
    let drones: Vec<&AllEqual> =
        comparison.all_equal.iter().filter(|row| row.drone.is_some()).collect();
    let differ: Vec<String> = drones
        .iter()
        .filter(|row| row.p_holm.is_some_and(|p| p < level))
        .filter_map(|row| row.drone.as_deref().map(clean))
        .collect();
    if !drones.is_empty() {
        sentences.push(if differ.is_empty() {
            "Against the fleet, no drone's effort in hover differs between the flights beyond chance.".to_owned()
        } else {
            format!(
                "Against the fleet, the effort in hover differs between the flights by more than chance for: {}.",
                differ.join(", ")
            )
        });
    }
    sentences
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(changes: &[(Quantity, f64, f64, f64)]) -> LawComparison {
        let nothing = Estimate::new(1540.0, 2.0);
        let one = |(quantity, value, se, p): &(Quantity, f64, f64, f64)| Change {
            quantity: *quantity,
            reference: nothing,
            other: nothing,
            beyond_fleet: Some(Estimate::new(*value, *se)),
            t: Some(value / se),
            dof: None,
            p_value: Some(*p),
            p_holm: Some(*p),
        };
        let is_changed = changes.iter().any(|(_, _, _, p)| *p < LEVEL);
        let fleet = |quantity, unit: &str| FleetChange {
            quantity,
            unit: unit.to_owned(),
            speed_mps: None,
            reference: nothing,
            other: nothing,
            change: Estimate::new(-4.0, 10.0),
            reference_in_both: None,
            other_in_both: None,
            z: Some(-0.4),
            p_value: Some(0.69),
            scatter: Some(1.3),
        };
        LawComparison {
            pair: Pair { reference: "a/calibration".to_owned(), other: "b/calibration".to_owned() },
            law: "line that may bend".to_owned(),
            effort_unit: "us".to_owned(),
            identity: Identity::Airframe,
            drones_in_both: 25,
            only_reference: Vec::new(),
            only_other: Vec::new(),
            basis: Basis::Stated,
            fleet: vec![fleet(Quantity::Hover, "us"), fleet(Quantity::Response, "us/(m/s)")],
            drones: vec![DroneChange {
                id: "107".to_owned(),
                slot: Some(7),
                other_slot: Some(9),
                name: "Drone 7".to_owned(),
                changes: changes.iter().map(one).collect(),
                is_changed,
            }],
            curve: Vec::new(),
        }
    }

    #[test]
    fn a_drone_that_changed_is_told_with_its_number_and_what_to_look_at() {
        let heavy =
            law(&[(Quantity::Hover, 14.2, 3.1, 0.0004), (Quantity::Response, 0.1, 0.3, 1.0)]);
        assert_eq!(
            drone_sentences(&heavy),
            [
                "Drone 107, slot 7 before and 9 now needs 14.2 ± 3.1 µs more in hover than the fleet's change explains (p = \
              0.0004 among all drones): a weak motor, a propeller, or weight."
            ]
        );
        let weak =
            law(&[(Quantity::Hover, 14.2, 3.1, 0.0004), (Quantity::Response, 1.1, 0.3, 0.2)]);
        assert!(drone_sentences(&weak)[0].contains("its response rose, too"));
        let none = law(&[(Quantity::Hover, 4.2, 3.1, 0.7)]);
        assert!(
            drone_sentences(&none)[0].starts_with("No drone changed"),
            "{:?}",
            drone_sentences(&none)
        );
    }

    #[test]
    fn the_fleet_is_told_with_the_errors_that_all_share() {
        let mut one = law(&[(Quantity::Hover, 4.2, 3.1, 0.7)]);
        let said = fleet_sentences(&one, None);
        assert_eq!(said.len(), 1, "the response is no more than chance");
        assert!(said[0].starts_with("The fleet as a whole (25 drones in both) needs −4 ± 10 µs in hover (p = 0.69), no more"), "{said:?}");
        one.fleet[1].p_value = Some(0.04);
        assert!(fleet_sentences(&one, None)[1].contains("(p = 0.04), more than chance"));
        one.fleet[0].p_value = Some(0.001);
        let said = fleet_sentences(&one, Some("b flew heavy, a light"));
        assert!(said[0].contains("above all another vehicle (b flew heavy, a light)"), "{said:?}");
    }

    #[test]
    fn a_change_has_no_sign_before_zero_and_no_digits_that_nobody_needs() {
        assert_eq!(change(Estimate::new(0.2, 14.0)), "0 ± 14");
        assert_eq!(change(Estimate::new(-0.3, 16.0)), "0 ± 16");
        assert_eq!(change(Estimate::new(-0.02, 1.9)), "0.0 ± 1.9");
        assert_eq!(change(Estimate::new(14.1, 3.0)), "+14.1 ± 3.0");
        assert_eq!(value(Estimate::new(1541.56, 0.0)), "1541.6");
    }

    #[test]
    fn before_and_now_differ_by_the_change() {
        let mut fleet = law(&[]).fleet.remove(0);
        fleet.change = Estimate::new(1.0, 12.0);
        fleet.reference_in_both = Some(Estimate::new(1540.6, 9.0));
        fleet.other_in_both = Some(Estimate::new(1541.6, 9.0));
        assert_eq!(before_and_now(&fleet), ["1540.6 ± 9.0", "1541.6 ± 9.0"]);
    }

    #[test]
    fn probabilities_are_never_zero() {
        assert_eq!(probability(Some(1e-30)), "p < 0.0001");
        assert_eq!(probability(Some(0.25)), "p = 0.25");
        assert_eq!(probability(None), "p not known");
    }
}
