//! The table of all drones of a flight.

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::result::FlightAnalysis;

use super::compare::{clock, drone_laws, flags, windows_used};
use super::figures::air::mean_truth;
use super::headline::{bent_cells, bent_heads, held_cell};
use super::law;
use super::notes::shared_flags;
use super::text::{NONE, estimate, fixed, shortened, unit, usable};

/// Headings and rows of the table of drones; columns that no drone fills are left out.
pub(super) fn drone_table(flight: &FlightAnalysis) -> (Vec<Value>, Vec<Value>) {
    let effort = unit(flight.indicator.unit());
    let [bent_u0_head, bent_slope_head] = bent_heads(flight.indicator);
    let heads = [
        ("slot", true),
        ("drone", false),
        ("W* (m/s)", true),
        ("posterior W (m/s)", true),
        ("systematic ± (m/s)", true),
        ("true W (m/s)", true),
        ("mapping", false),
        ("W held (m/s)", true),
        (&*bent_u0_head, true),
        (&*bent_slope_head, true),
        (&*format!("A ({effort}/(m/s)²)"), true),
        (&*format!("u₀ ({effort})"), true),
        (
            if law::vertex_mps(flight).is_some() {
                "vertex, no air (m/s)"
            } else {
                "fitted W* (m/s)"
            },
            true,
        ),
        ("χ²/ν", true),
        (&*format!("A′ ({effort}/(m/s))"), true),
        (&*format!("u₀ linear ({effort})"), true),
        ("χ²/ν linear", true),
        (&*format!("added scatter ({effort})"), true),
        ("windows", true),
        ("clock", false),
    ];
    let shared = shared_flags(flight);
    let rows: Vec<(Vec<String>, String)> = flight
        .drones
        .iter()
        .map(|drone| {
            let laws = drone_laws(drone);
            let air = flight.map.as_ref().and_then(|map| {
                map.drones.iter().find(|air| air.slot == drone.slot && air.name == drone.name)
            });
            let none = || NONE.to_owned();
            let [bent_u0, bent_slope] = bent_cells(flight, drone);
            let cells = vec![
                drone.slot.map_or_else(none, |slot| slot.to_string()),
                shortened(&drone.name, 28),
                air.map_or_else(none, |air| estimate(air.mean)),
                air.and_then(|air| air.posterior_mean).map_or_else(none, estimate),
                air.filter(|air| usable(air.systematic_mps) && air.systematic_mps > 0.0)
                    .map_or_else(none, |air| fixed(air.systematic_mps, 2)),
                air.and_then(mean_truth).map_or_else(none, |truth| fixed(truth, 3)),
                air.map_or_else(none, |air| air.mapping.name().to_owned()),
                held_cell(drone),
                bent_u0,
                bent_slope,
                laws.a,
                laws.u0,
                laws.w,
                laws.chi2,
                laws.slope,
                laws.linear_u0,
                laws.linear_chi2,
                laws.scatter,
                if drone.windows.is_empty() { none() } else { windows_used(drone) },
                clock(drone).to_owned(),
            ];
            let own = flags(drone).into_iter().filter(|flag| !shared.contains(flag));
            (cells, own.collect::<Vec<_>>().join("; "))
        })
        .collect();
    let filled: Vec<bool> = (0..heads.len())
        .map(|column| {
            rows.iter().any(|(cells, _)| {
                cells.get(column).is_some_and(|cell| !cell.is_empty() && cell != NONE)
            })
        })
        .collect();
    let kept = || filled.iter().enumerate().filter(|(_, filled)| **filled).map(|(i, _)| i);
    let head = kept()
        .filter_map(|column| heads.get(column))
        .map(|&(label, number)| context! { label, number })
        .collect();
    let rows = rows
        .iter()
        .map(|(cells, note)| {
            let cells: Vec<Value> = kept()
                .filter_map(|column| Some((cells.get(column)?, heads.get(column)?.1)))
                .map(|(cell, number)| context! { text => cell.clone(), number })
                .collect();
            context! { cells, note => note.clone() }
        })
        .collect();
    (head, rows)
}
