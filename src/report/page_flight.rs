//! The part of the page that tells of one flight: its tables, its fleet, its drones.

use std::collections::BTreeMap;
use std::io::{self, Write as _};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use minijinja::context;
use minijinja::value::Value;
use rayon::prelude::*;

use crate::analysis::result::{Analysis, FlightAnalysis, WindCorrection};
use crate::mission::plan::Purpose;

use super::Figure;
use super::compare::{
    compared, comparison, drones_of, fit_line, flock_lines, not_compared_lines, nothing,
    scatter_line, table_heading,
};
use super::drone_table::drone_table;
use super::explorer::{explorer, pick};
use super::figures::drone::{Axes, drawable};
use super::figures::{drone as figure_drone, fleet};
use super::fill::OPEN_LIMIT;
use super::glance;
use super::law;
use super::notes::{
    logs_used, partly_used_lines, shared_notes, unused_lines, without_result_lines,
};
use super::page::{Gallery, capitalised, flight_key};
use super::text::{clean, kind, purpose, signed};
use super::typographic::typographic;

/// Bytes of drawings of single drones that the page carries, before they are compressed to a sixth; further drones are
/// only in files.
const DRONE_FIGURE_BYTES: usize = 6_000_000;
/// Drones that get a drawing at all, in one flight.
const DRONE_FIGURE_LIMIT: usize = 400;

/// The section of a flight.
pub(super) fn flight_section(
    analysis: &Analysis,
    flight: &FlightAnalysis,
    index: usize,
    figures: &mut Gallery,
) -> Value {
    let key = flight_key(analysis, index);
    let gallery = drone_gallery(flight, &key, figures);
    let names: Vec<Option<String>> = (0..flight.drones.len())
        .map(|index| {
            let drone = flight.drones.get(index).filter(|drone| drawable(drone))?;
            let name = figure_drone::name(&key, index, drone);
            let shown = gallery.as_ref().is_some_and(|gallery| gallery.shown.name == name);
            (shown || figures.files.iter().any(|(known, _)| *known == name)).then_some(name)
        })
        .collect();
    let fleet = (flight.purpose == Purpose::Calibration)
        .then(|| fleet::figure(analysis, flight, &key, &names, figures.format))
        .flatten()
        .map(|figure| figures.show_linked(figure));
    // Numbered after the fleet, below which it stands.
    let drones = gallery.map(|gallery| {
        let Gallery3 { shown, choices, packed, left_out, undrawn } = gallery;
        context! { shown => figures.show(shown), choices, packed, left_out, undrawn }
    });
    // Where there is a map, they stand with it.
    let explored = flight.map.is_none().then(|| explorer(flight, &key, None, false)).flatten();
    let explored = figures.explore(explored);
    let map_law = flight.map.as_ref().map(|map| map.law.name());
    let table: Vec<Value> = flight
        .table
        .iter()
        .map(comparison)
        .map(|row| {
            context! {
                law => row.law, parameter => row.parameter, unit => row.unit, fleet => row.fleet,
                mean_se => row.mean_se, n => row.n, paper => row.paper,
                difference => row.difference, in_errors => row.in_errors,
            }
        })
        .collect();
    let without_result = without_result_lines(flight);
    let flock: Vec<Value> =
        flock_lines(flight).into_iter().map(|(law, line)| context! { law, line }).collect();
    let own = match flight.drones.as_slice() {
        [drone] if flight.flock.is_none() => drone.laws.as_ref(),
        _ => None,
    };
    let own: Vec<String> = own
        .into_iter()
        .flat_map(|laws| {
            [laws.signed_quadratic.as_ref(), laws.of_own_vehicle(), laws.linear.as_ref()]
        })
        .flatten()
        .map(fit_line)
        .collect();
    let (head, rows) = drone_table(flight);
    let name = clean(&flight.name);
    context! {
        id => format!("flight-{}", index + 1),
        heading => capitalised(if name.is_empty() { purpose(flight.purpose) } else { &name }),
        summary => glance::summary(flight),
        purpose => purpose(flight.purpose),
        drones => drones_of(flight),
        empty => flight.drones.is_empty(),
        planned => flight.planned,
        truth => flight.true_updraft_mps.map(|w| signed(w, 2)),
        table,
        flock,
        own,
        windows => window_kinds(flight),
        gallery => drones,
        explorer => explored,
        fleet,
        map_law,
        head,
        rows_open => rows.len() <= 10,
        rows,
        nothing => nothing(flight),
        table_heading => table_heading(flight),
        scatter => law::flight_laws(flight).and_then(scatter_line),
        cautions => flight.warnings.iter().map(|w| typographic(&w.to_string())).collect::<Vec<_>>(),
        wind => flight.map.as_ref().and_then(|map| map.wind).map_or("", |wind| match wind {
            WindCorrection::Drag => "drag",
            WindCorrection::Physics => "physics",
        }),
        law_reason => flight.map.as_ref().and_then(|map| map.law_reason.as_deref()).map(clean),
        not_compared => not_compared_lines(flight),
        shared_notes => shared_notes(flight),
        logs => logs_used(flight),
        without_result_open => without_result.len() <= 2 * OPEN_LIMIT,
        without_result,
        without_result_count => flight.missing.len() + flight.unmeasured.len(),
        unused => unused_lines(flight),
        partly_used => partly_used_lines(flight),
        compared => compared(flight),
    }
}

/// The drawings of the paper's Fig. 3, one of which is shown first.
struct Gallery3 {
    shown: Figure,
    choices: Vec<Value>,
    /// The other drawings, compressed; empty: there are none.
    packed: String,
    left_out: usize,
    undrawn: usize,
}

/// Figure 3 for every drone of a calibration, the first with laws shown first; that one is not
/// shown yet.
fn drone_gallery(flight: &FlightAnalysis, key: &str, figures: &mut Gallery) -> Option<Gallery3> {
    let moving = |drone| law::moving(drone).next().is_some();
    let wanted: Vec<usize> = (0..flight.drones.len())
        .filter(|&index| flight.drones.get(index).is_some_and(drawable))
        .take(DRONE_FIGURE_LIMIT)
        .collect();
    if wanted.is_empty() || !flight.drones.iter().any(|drone| drone.laws.is_some() || moving(drone))
    {
        return None;
    }
    let first = wanted
        .iter()
        .copied()
        .find(|&index| flight.drones.get(index).is_some_and(|drone| drone.laws.is_some()))
        .or_else(|| wanted.first().copied())?;
    let axes = Axes::of(flight);
    let mut bytes = 0;
    let mut choices = Vec::new();
    let mut inside_page = BTreeMap::new();
    let mut shown = None;
    let undrawn = flight.drones.len() - wanted.len();
    let mut left_out = 0;
    let format = figures.format;
    let drawn: Vec<(usize, Option<Figure>)> = wanted
        .into_par_iter()
        .map(|index| (index, figure_drone::figure(flight, key, index, &axes, format)))
        .collect();
    for (index, figure) in drawn {
        let (Some(drone), Some(figure)) = (flight.drones.get(index), figure) else { continue };
        let label = match drone.slot {
            Some(slot) if clean(&drone.name).contains(&slot.to_string()) => clean(&drone.name),
            Some(slot) => format!("slot {slot}: {}", clean(&drone.name)),
            None => clean(&drone.name),
        };
        let is_first = index == first;
        bytes += figure.svg.len();
        let inside = bytes <= DRONE_FIGURE_BYTES || is_first || format.is_print();
        if inside {
            choices.push(context! {
                label,
                pick => pick(drone.slot, &drone.name),
                name => figure.name.clone(),
                first => is_first,
            });
            if !is_first && !format.is_print() {
                inside_page.insert(figure.name.clone(), figure.svg.clone());
            }
        } else {
            left_out += 1;
        }
        if is_first {
            shown = Some(figure);
        } else {
            figures.files.push((figure.name, figure.svg));
        }
    }
    Some(Gallery3 { shown: shown?, choices, packed: compressed(&inside_page), left_out, undrawn })
}

/// Drawings by their names, as `templates/report/unpack.js` reads them: JSON, compressed, base64. Together they take a
/// sixth of what they do as they are.
fn compressed(drawings: &BTreeMap<String, String>) -> String {
    if drawings.is_empty() {
        return String::new();
    }
    // The packer clears what it has room for at each write, however short: it gets all at once.
    let whole = serde_json::to_vec(drawings).map_err(io::Error::from);
    let packed = whole.and_then(|whole| {
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
        packer.write_all(&whole)?;
        packer.finish()
    });
    packed.map_or_else(|_| String::new(), |bytes| STANDARD.encode(bytes))
}

/// How many windows of each kind all drones have: `14 up × …` as words.
fn window_kinds(flight: &FlightAnalysis) -> String {
    let mut kinds: Vec<(&str, usize, usize)> = Vec::new();
    for window in flight.drones.iter().flat_map(|drone| &drone.windows) {
        let used = usize::from(window.rejected.is_empty());
        let words = kind(window.kind);
        match kinds.iter_mut().find(|(known, _, _)| *known == words) {
            Some((_, all, accepted)) => {
                *all += 1;
                *accepted += used;
            }
            None => kinds.push((words, 1, used)),
        }
    }
    kinds
        .iter()
        .map(|(words, all, used)| format!("{words} {used} of {all}"))
        .collect::<Vec<_>>()
        .join(", ")
}
