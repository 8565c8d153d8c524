//! The HTML page: what goes where; the words and the look are in `templates/report/`.

use minijinja::value::Value;
use minijinja::{Environment, UndefinedBehavior, context};

use crate::analysis::result::{Analysis, FlightAnalysis};

use super::compare::{
    clock, compared, comparison, drone_laws, drones_of, fit_line, flags, flock_lines, nothing,
    scatter_line, table_heading, windows_used,
};
use super::axis::decimals_of;
use super::colour::diverging;
use super::figures::air::mean_truth;
use super::figures::drone::{Axes, drawable};
use super::figures::{air as figure_air, drone as figure_drone, evolution, laws as figure_laws, map as figure_map};
use super::film::film;
use super::frames::Frames;
use super::notes::{logs_used, partly_used_lines, unused_lines, without_result_lines};
use super::text::{NONE, clean, estimate, fixed, kind, purpose, shortened, signed, slug, usable};
use super::{Figure, Provenance, Report, ReportError, glance, law};

const PAGE: &str = include_str!("../../templates/report/report.html");
const STYLE: &str = include_str!("../../templates/report/style.css");
const SCRIPTS: [&str; 2] = [
    include_str!("../../templates/report/script.js"),
    include_str!("../../templates/report/film.js"),
];

/// Bytes of drawings of single drones that the page carries; further drones are only in files.
const DRONE_FIGURE_BYTES: usize = 2_300_000;
/// Drones that get a drawing at all, in one flight.
const DRONE_FIGURE_LIMIT: usize = 400;
/// Lists that are longer than this start folded.
const OPEN_LIMIT: usize = 6;

/// Makes the page and the figures.
pub(super) fn render(analysis: &Analysis, provenance: &Provenance) -> Result<Report, ReportError> {
    let mut figures = Gallery::default();
    let air: Vec<Value> = analysis
        .flights
        .iter()
        .enumerate()
        .filter_map(|(index, flight)| air_section(analysis, flight, index, &mut figures))
        .collect();
    let laws = figure_laws::figure(analysis).map(|figure| figures.show(figure));
    let flights: Vec<Value> = analysis
        .flights
        .iter()
        .enumerate()
        .map(|(index, flight)| flight_section(analysis, flight, index, &mut figures))
        .collect();
    let warnings: Vec<String> = analysis.warnings.iter().map(|w| clean(w)).collect();
    let inputs: Vec<Value> = provenance
        .inputs
        .iter()
        .map(|input| context! { path => clean(&input.path), sha256 => clean(&input.sha256) })
        .collect();

    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.add_template("report.html", PAGE)?;
    let title = clean(&analysis.title);
    let html = environment.get_template("report.html")?.render(context! {
        title => if title.trim().is_empty() { "Updraft report".to_owned() } else { title },
        style => Value::from_safe_string(STYLE.to_owned()),
        script => Value::from_safe_string(SCRIPTS.concat()),
        made_by => clean(&analysis.made_by),
        schema => clean(&analysis.schema),
        program => clean(&provenance.program),
        command => clean(&provenance.command),
        seed => provenance.seed.map(|seed| seed.to_string()),
        made_at => clean(&provenance.made_at),
        inputs_open => inputs.len() <= OPEN_LIMIT,
        inputs,
        verdict => glance::verdict(analysis),
        tiles => glance::tiles(analysis),
        warnings_open => warnings.len() <= OPEN_LIMIT,
        warnings,
        air,
        laws,
        flights,
        kuva => kuva::VERSION,
    })?;
    Ok(Report { html, figures: figures.files })
}

/// Numbers the figures of the page and collects their files.
#[derive(Default)]
struct Gallery {
    numbered: usize,
    files: Vec<(String, String)>,
}

impl Gallery {
    fn show(&mut self, figure: Figure) -> Value {
        self.numbered += 1;
        let value = context! {
            number => self.numbered,
            name => figure.name.clone(),
            title => figure.title,
            caption => figure.caption,
            svg => Value::from_safe_string(figure.svg.clone()),
        };
        self.files.push((figure.name, figure.svg));
        value
    }
}

/// The maps of a flight, which the page shows first: they are what the fleet was flown for.
fn air_section(
    analysis: &Analysis,
    flight: &FlightAnalysis,
    index: usize,
    figures: &mut Gallery,
) -> Option<Value> {
    let map = flight.map.as_ref()?;
    let key = flight_key(analysis, index);
    let frames = Frames::of(map);
    let mean = figure_map::mean_map(analysis, flight, &key, map).map(|figure| figures.show(figure));
    let shown = frames.as_ref().and_then(|frames| film(map, frames)).map(|film| {
        context! {
            id => format!("film-{key}"),
            json => Value::from_safe_string(film.json),
            step => fixed(film.step_s, usize::from(film.step_s.fract() > 0.05)),
            frames => film.frames,
            truth => frames.as_ref().is_some_and(|frames| frames.truth_known),
            bar => colour_bar(frames.as_ref().map_or(1.0, |frames| frames.limit_mps)),
            difference_bar =>
                colour_bar(frames.as_ref().map_or(1.0, |frames| frames.difference_limit_mps)),
        }
    });
    let more: Vec<Value> = [
        frames.as_ref().and_then(|frames| evolution::figure(flight, &key, frames, None)),
        figure_air::figure(flight, &key, map),
    ]
    .into_iter()
    .flatten()
    .map(|figure| figures.show(figure))
    .collect();
    Some(context! { heading => capitalised(&clean(&flight.name)), law => clean(&map.law), mean, film => shown, more })
}

/// A colour bar of the page: its gradient and the numbers below it.
fn colour_bar(limit: f64) -> Value {
    let colours: Vec<String> =
        (0..=20).map(|i| diverging(f64::from(i) / 10.0 - 1.0)).collect();
    let decimals = decimals_of(limit / 2.0);
    let ticks: Vec<String> =
        [-1.0, -0.5, 0.0, 0.5, 1.0].iter().map(|part| signed(part * limit, decimals)).collect();
    context! { colours => colours.join(","), ticks }
}

fn flight_section(
    analysis: &Analysis,
    flight: &FlightAnalysis,
    index: usize,
    figures: &mut Gallery,
) -> Value {
    let key = flight_key(analysis, index);
    let drones = drone_gallery(flight, &key, figures);
    let map_law = flight.map.as_ref().map(|map| clean(&map.law));
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
        .flat_map(|laws| [&laws.signed_quadratic, &laws.signed_quadratic_held, &laws.linear])
        .flatten()
        .map(fit_line)
        .collect();
    let (head, rows) = drone_table(flight);
    let name = clean(&flight.name);
    context! {
        id => format!("flight-{}", index + 1),
        heading => capitalised(if name.is_empty() { purpose(flight.purpose) } else { &name }),
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
        map_law,
        head,
        rows_open => rows.len() <= 10,
        rows,
        nothing => nothing(flight),
        table_heading => table_heading(flight),
        scatter => law::flight_laws(flight).and_then(scatter_line),
        cautions => flight.warnings.iter().map(|w| clean(w)).collect::<Vec<_>>(),
        leaning => flight.map.as_ref().is_some_and(|map| map.leaning.is_some()),
        logs => logs_used(flight),
        without_result_open => without_result.len() <= 2 * OPEN_LIMIT,
        without_result,
        without_result_count => flight.missing.len() + flight.unmeasured.len(),
        unused => unused_lines(flight),
        partly_used => partly_used_lines(flight),
        compared => compared(flight),
    }
}

/// The flight in file names: its name, numbered when an earlier flight's looks the same.
fn flight_key(analysis: &Analysis, index: usize) -> String {
    let key = |flight: &FlightAnalysis| slug(&flight.name);
    let own = analysis.flights.get(index).map_or_else(|| slug(""), key);
    let twin = analysis.flights.iter().take(index).any(|earlier| key(earlier) == own);
    if twin { format!("{own}-flight{}", index + 1) } else { own }
}

/// Figure 3 for every drone of a calibration, the first with laws shown first.
fn drone_gallery(flight: &FlightAnalysis, key: &str, figures: &mut Gallery) -> Option<Value> {
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
    let mut shown = None;
    let undrawn = flight.drones.len() - wanted.len();
    let mut left_out = 0;
    for index in wanted {
        let (Some(drone), Some(figure)) =
            (flight.drones.get(index), figure_drone::figure(flight, key, index, &axes))
        else {
            continue;
        };
        let label = match drone.slot {
            Some(slot) if clean(&drone.name).contains(&slot.to_string()) => clean(&drone.name),
            Some(slot) => format!("slot {slot}: {}", clean(&drone.name)),
            None => clean(&drone.name),
        };
        let is_first = index == first;
        bytes += figure.svg.len();
        let inside = bytes <= DRONE_FIGURE_BYTES || is_first;
        if inside {
            choices.push(context! {
                label,
                name => figure.name.clone(),
                svg => Value::from_safe_string(figure.svg.clone()),
                first => is_first,
            });
        } else {
            left_out += 1;
        }
        if is_first {
            shown = Some(figures.show(figure));
        } else {
            figures.files.push((figure.name, figure.svg));
        }
    }
    Some(context! { shown => shown?, choices, left_out, undrawn })
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

/// Headings and rows of the table of drones; columns that no drone fills are left out.
fn drone_table(flight: &FlightAnalysis) -> (Vec<Value>, Vec<Value>) {
    let heads = [
        ("slot", true),
        ("drone", false),
        ("W* (m/s)", true),
        ("systematic ± (m/s)", true),
        ("true W (m/s)", true),
        ("mapping", false),
        ("A (µs/(m/s)²)", true),
        ("u₀ (µs)", true),
        ("fitted W* (m/s)", true),
        ("χ²/ν", true),
        ("A′ (µs/(m/s))", true),
        ("u₀ linear (µs)", true),
        ("χ²/ν linear", true),
        ("added scatter (µs)", true),
        ("windows", true),
        ("clock", false),
    ];
    let rows: Vec<(Vec<String>, String)> = flight
        .drones
        .iter()
        .map(|drone| {
            let laws = drone_laws(drone);
            let air = flight.map.as_ref().and_then(|map| {
                map.drones.iter().find(|air| air.slot == drone.slot && air.name == drone.name)
            });
            let none = || NONE.to_owned();
            let cells = vec![
                drone.slot.map_or_else(none, |slot| slot.to_string()),
                shortened(&drone.name, 28),
                air.map_or_else(none, |air| estimate(air.mean)),
                air.filter(|air| usable(air.systematic_mps) && air.systematic_mps > 0.0)
                    .map_or_else(none, |air| fixed(air.systematic_mps, 2)),
                air.and_then(mean_truth).map_or_else(none, |truth| fixed(truth, 3)),
                air.map_or_else(none, |air| clean(&air.mapping)),
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
            (cells, flags(drone).join("; "))
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

/// With a capital first letter.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
