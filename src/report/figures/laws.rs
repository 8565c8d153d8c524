//! Figure 2: pulse width against vertical velocity in all moving windows, with the fitted laws.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::analysis::law::{LawKind, Symbol};
use crate::analysis::result::{Analysis, BentLine, FlightAnalysis};
use crate::base::estimate::Estimate;
use crate::numeric::extent;

use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, GREEN, INK, MUTED, VERMILLION, sequential};
use crate::report::format::Format;
use crate::report::law;
use crate::report::page::capitalised;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, count, effort_label, effort_name, shortened, signed, usable};

/// Label of the pulse-width axis.
pub(in crate::report) const PULSE_LABEL: &str = "tilt-corrected pulse width uφ (µs)";
/// Label of the velocity axis.
pub(in crate::report) const VELOCITY_LABEL: &str = "vertical velocity (m/s, up positive)";

/// Longest legend; more flights are drawn without an entry.
const LEGEND_LIMIT: usize = 12;

/// The figure over all flights that have moving windows; `None` without any.
pub(in crate::report) fn figure(analysis: &Analysis, format: Format) -> Option<Figure> {
    let flights: Vec<&FlightAnalysis> = analysis
        .flights
        .iter()
        .filter(|flight| {
            flight.drones.iter().flat_map(law::moving).any(|window| law::mark(window).usable())
        })
        .collect();
    let windows = || flights.iter().flat_map(|flight| flight.drones.iter().flat_map(law::moving));
    let total = windows().count();
    if total == 0 {
        return None;
    }
    let v = Axis::around(VELOCITY_LABEL, windows().map(|window| law::mark(window).x), 1.0);
    let effort = flights.first().map_or_else(String::new, |flight| effort_label(flight.indicator));
    // With the error bars: none is cut at the frame.
    let reach = windows().map(law::mark).flat_map(|m| [m.y - m.y_error, m.y + m.y_error]);
    let u = Axis::around(&effort, reach, 10.0);
    let mut panel = Panel::new("(a) Windows and fitted laws", v.clone(), u);

    let colours = flight_colours(&flights);
    if let [flight] = flights.as_slice() {
        one_flight(&mut panel, flight, &v);
    } else {
        if flights.len() > 5 {
            panel.legend_outside(110.0);
        }
        for (index, (flight, colour)) in flights.iter().zip(&colours).enumerate() {
            several_flights(&mut panel, flight, colour, &v, index < LEGEND_LIMIT);
        }
    }

    let (side, side_caption) = side_panel(&flights, &colours);
    let wide = if side.is_some() { 620.0 } else { 1040.0 };
    let panels = std::iter::once((panel, [0.0, 0.0, wide, 460.0]))
        .chain(side.map(|side| (side, [630.0, 0.0, 410.0, 460.0])));
    let sheet = Sheet::of(format, [1040.0, 460.0], panels.collect());
    let drones: usize = flights.iter().map(|flight| flight.drones.len()).sum();
    let colouring = if let [flight] = flights.as_slice() {
        let whose = if drones == 1 { "its windows" } else { "the flock" };
        let bent = match bent(flight) {
            Some(_) => {
                " The dotted line may bend and makes the maps of this calibration: all drones' \
                 average, brought to level flight, the air's density at the ground and one battery \
                 voltage where these are known, so that it may pass beside the points."
            }
            None => "",
        };
        format!(
            "The solid line is the signed-quadratic law, the dashed line the linear law, both fitted \
             to {whose}.{bent}"
        )
    } else {
        "Colour tells the flights apart; dashed lines are the signed-quadratic law of each."
            .to_owned()
    };
    let name = "fig2-laws".to_owned();
    let effort = flights.first().map_or("pulse width", |flight| effort_name(flight.indicator));
    let title = format!("{} against vertical velocity", capitalised(effort));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "(a) Each point is one of {} of {}: the median of the {effort} against the median \
             of the vertical velocity; bars are one standard deviation of the samples. {colouring} \
             {side_caption}",
            count(total, "moving window"),
            count(drones, "drone"),
        ),
    })
}

/// One colour for each flight, by true updraft where all are known.
fn flight_colours(flights: &[&FlightAnalysis]) -> Vec<String> {
    let order: Vec<f64> = flights
        .iter()
        .enumerate()
        .map(|(index, flight)| flight.true_updraft_mps.unwrap_or(index as f64))
        .collect();
    let known = flights.iter().all(|flight| flight.true_updraft_mps.is_some_and(usable));
    let keys = if known { order } else { (0..flights.len()).map(|i| i as f64).collect() };
    let (low, high) = extent(&keys).unwrap_or_default();
    let span = if high > low { high - low } else { 1.0 };
    keys.iter().map(|key| sequential((key - low) / span)).collect()
}

fn one_flight(panel: &mut Panel, flight: &FlightAnalysis, v: &Axis) {
    let (mut up, mut down) = (Vec::new(), Vec::new());
    for window in flight.drones.iter().flat_map(law::moving) {
        if window.commanded_mps > 0.0 { &mut up } else { &mut down }.push(law::mark(window));
    }
    let size = if up.len() + down.len() > 200 { 2.6 } else { 4.0 };
    panel.marks(&up, VERMILLION, size, MarkerShape::Circle);
    panel.marks(&down, BLUE, size, MarkerShape::Circle);
    panel.entry("climbing", VERMILLION, LegendShape::Circle, "");
    panel.entry("descending", BLUE, LegendShape::Circle, "");
    if let Some(laws) = law::flight_laws(flight) {
        if let Some(fit) = law::signed_quadratic(laws) {
            panel.line(&law::signed_quadratic_curve(fit, v), INK, 1.8, "");
            panel.entry(LawKind::SignedQuadratic.name(), INK, LegendShape::Line, "");
        }
        if let Some(fit) = &laws.linear {
            panel.line(&law::linear_curve(fit, v), MUTED, 1.6, "7 4");
            panel.entry(LawKind::Linear.name(), MUTED, LegendShape::Line, "7 4");
        }
    }
    if let Some(line) = bent(flight) {
        panel.line(&law::bent_curve(line), GREEN, 2.2, "2 3");
        panel.entry("line that may bend", GREEN, LegendShape::Line, "2 3");
    }
}

/// The line by which maps are made, where it differs from the straight one by more than chance.
fn bent(flight: &FlightAnalysis) -> Option<&BentLine> {
    flight.headline.as_ref()?.line.as_ref().filter(|line| line.is_bent())
}

fn several_flights(
    panel: &mut Panel,
    flight: &FlightAnalysis,
    colour: &str,
    v: &Axis,
    in_legend: bool,
) {
    let marks: Vec<Mark> = flight.drones.iter().flat_map(law::moving).map(law::mark).collect();
    panel.marks(&marks, colour, if marks.len() > 200 { 2.4 } else { 3.6 }, MarkerShape::Circle);
    if let Some(fit) = law::flight_laws(flight).and_then(law::signed_quadratic) {
        panel.line(&law::signed_quadratic_curve(fit, v), colour, 1.5, "4 3");
    }
    if in_legend {
        let label = match flight.true_updraft_mps {
            Some(updraft) => format!("W = {} m/s", signed(updraft, 2)),
            None => shortened(&flight.name, 22),
        };
        panel.entry(&label, colour, LegendShape::Circle, "");
    }
}

/// Estimated against true updraft; or, where the truth does not vary, W* of each drone.
fn side_panel(flights: &[&FlightAnalysis], colours: &[String]) -> (Option<Panel>, String) {
    let mut truths: Vec<f64> = flights
        .iter()
        .filter_map(|flight| flight.true_updraft_mps)
        .filter(|&w| usable(w))
        .collect();
    truths.sort_by(f64::total_cmp);
    truths.dedup();
    if truths.len() > 1 { against_truth(flights, colours) } else { by_drone(flights) }
}

fn against_truth(flights: &[&FlightAnalysis], colours: &[String]) -> (Option<Panel>, String) {
    let groups: Vec<(Vec<Mark>, &String)> = flights
        .iter()
        .zip(colours)
        .map(|(flight, colour)| {
            let truth = flight.true_updraft_mps.unwrap_or(f64::NAN);
            let marks = updrafts(flight)
                .map(|(_, _, w)| Mark { x: w.value, y: truth, x_error: w.se, y_error: 0.0 })
                .collect();
            (marks, colour)
        })
        .collect();
    let all = || groups.iter().flat_map(|(marks, _)| marks.iter().filter(|mark| mark.usable()));
    if all().next().is_none() {
        return (None, String::new());
    }
    let values = || all().flat_map(|mark| [mark.x, mark.y]);
    let x = Axis::around("estimated updraft W* (m/s)", values(), 1.0);
    let y = Axis::around("true updraft W (m/s)", values(), 1.0);
    let mut panel = Panel::new("(b) Estimated and true updraft", x.clone(), y);
    panel.line(&[(x.min, x.min), (x.max, x.max)], VERMILLION, 1.4, "6 4");
    panel.entry("W* = W", VERMILLION, LegendShape::Line, "6 4");
    for (marks, colour) in &groups {
        panel.marks(marks, colour, 4.2, MarkerShape::Circle);
    }
    let caption =
        "(b) The fitted updraft W* of each drone against the true one; on the dashed line \
                   they agree."
            .to_owned();
    (Some(panel), caption)
}

fn by_drone(flights: &[&FlightAnalysis]) -> (Option<Panel>, String) {
    let [flight] = flights else {
        return (None, String::new());
    };
    if law::vertex_mps(flight).is_some() {
        // W* is the vertex of a parabola there, and no updraft.
        return (None, String::new());
    }
    let marks: Vec<Mark> = updrafts(flight)
        .map(|(index, slot, w)| Mark {
            x: slot.map_or(index as f64 + 1.0, f64::from),
            y: w.value,
            x_error: 0.0,
            y_error: w.se,
        })
        .collect();
    if marks.iter().filter(|mark| mark.usable()).count() < 2 {
        return (None, String::new());
    }
    let truth = flight.true_updraft_mps.filter(|&truth| usable(truth));
    let mut x = Axis::around("slot", marks.iter().map(|mark| mark.x), 4.0);
    let last = marks.iter().map(|mark| mark.x).filter(|&x| usable(x)).fold(1.0, f64::max);
    (x.min, x.max) = (0.0, last + 1.0);
    let reach = marks.iter().flat_map(|mark| [mark.y - mark.y_error, mark.y + mark.y_error]);
    let y = Axis::around("fitted updraft W* (m/s)", reach.chain(truth), 0.02);
    let mut panel = Panel::new("(b) Updraft that each drone's fit implies", x.clone(), y);
    panel.legend_at(LegendPosition::InsideTopRight);
    if let Some(truth) = truth {
        panel.line(&[(x.min, truth), (x.max, truth)], VERMILLION, 1.4, "6 4");
        panel.entry("true updraft", VERMILLION, LegendShape::Line, "6 4");
    }
    panel.marks(&marks, BLUE, 3.4, MarkerShape::Circle);
    let caption = format!(
        "(b) The updraft W* that the signed-quadratic fit of each drone of {} implies, with its \
         standard error.",
        clean(&flight.name),
    );
    (Some(panel), caption)
}

/// W* of each drone: (index, slot, estimate).
fn updrafts(flight: &FlightAnalysis) -> impl Iterator<Item = (usize, Option<u16>, Estimate)> {
    flight.drones.iter().enumerate().filter_map(|(index, drone)| {
        let fit = law::signed_quadratic(drone.laws.as_ref()?);
        let fit = fit.filter(|fit| fit.w_beyond_mps.is_none())?;
        Some((index, drone.slot, fit.parameter(Symbol::W)?.estimate))
    })
}
