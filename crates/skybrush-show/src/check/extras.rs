//! Findings on parts of a file that are not read or not checked, so that nobody takes them for
//! checked.

use super::CheckInput;
use super::report::{Collector, Finding, Severity};
use super::track::name_of;
use crate::ShowDrone;

pub(super) fn check(input: &CheckInput<'_>, collector: &mut Collector) {
    for doubt in &input.show.doubts {
        let remedy = "correct it in the program that made the show";
        collector.add(0, Finding::new(Severity::Warning, "file", doubt.clone(), remedy));
    }
    let with = |has: fn(&ShowDrone) -> bool| -> Vec<String> {
        let drones = input.show.drones.iter().enumerate();
        drones.filter(|(_, drone)| has(drone)).map(|(index, drone)| name_of(drone, index)).collect()
    };
    let spare = with(|drone| drone.extras.spare_coordinates > 0);
    if !spare.is_empty() {
        let message = "has points with more than three coordinates: only x, y and z are used, and \
            other readers may refuse them"
            .to_owned();
        let remedy = "write points as [x, y, z]";
        let finding = Finding::new(Severity::Warning, "file", message, remedy);
        collector.add(0, Finding { drones: spare, ..finding });
    }
    let pyro = with(|drone| drone.extras.pyro_events > 0);
    if !pyro.is_empty() {
        let events: usize = input.show.drones.iter().map(|drone| drone.extras.pyro_events).sum();
        collector.note(format!(
            "pyro: {events} events of {}; they are not checked (reach, fall-out, who stands below), and \
             updraft uploads shows without them",
            drones(&pyro)
        ));
    }
    let return_plan = with(|drone| drone.extras.has_rth_plan);
    if !return_plan.is_empty() {
        collector.note(format!(
            "return-to-home plan of {}: the ways on which drones come home when the show is stopped \
             early are not checked against each other, and updraft uploads shows without it",
            drones(&return_plan)
        ));
    }
}

/// `Drone 3`, `12 drones (Drone 1 ...)`.
fn drones(names: &[String]) -> String {
    match names {
        [one] => one.clone(),
        [first, ..] => format!("{} drones (first {first})", names.len()),
        [] => String::new(),
    }
}
