//! A drone's estimate with its error bars beside an instrument, and the stretch that set the zero.

use kuva::plot::legend::LegendShape;

use crate::analysis::result::{DroneUpdraft, FlightAnalysis, LevelledMap, UpdraftMap};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::Panel;
use crate::report::colour::{BLUE, GREEN, MUTED, VERMILLION};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, sentence, usable};

/// Most drones that are drawn, one panel each.
const MOST_PANELS: usize = 4;
const WIDTH: f64 = 1040.0;
const HEIGHT: f64 = 340.0;
/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;

/// One panel for each of the first drones; `None` where the map's law is not a fitted level, or no drone has values.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    map: &UpdraftMap,
    format: Format,
) -> Option<Figure> {
    let levelled = map.levelled.as_ref()?;
    let panels: Vec<Panel> = map
        .drones
        .iter()
        .take(MOST_PANELS)
        .enumerate()
        .filter_map(|(index, drone)| panel(map, levelled, index, drone))
        .collect();
    if panels.is_empty() {
        return None;
    }
    let size = [WIDTH, HEIGHT * panels.len() as f64];
    let panels = panels.into_iter().enumerate();
    let panels = panels.map(|(row, panel)| (panel, [0.0, HEIGHT * row as f64, WIDTH, HEIGHT]));
    let sheet = Sheet::of(format, size, panels.collect());
    let mut caption = format!(
        "Running 10 s means by {}. Blue: the estimate with its 95 % interval for the air at the drone",
        clean(&levelled.words())
    );
    if levelled.held_out.is_some() {
        caption.push_str(
            "; the wider band is that of an instrument beside it. Dashed: what the instrument read, of which \
             nothing was used",
        );
    }
    caption.push('.');
    if levelled.zero_s.is_some() {
        caption.push_str(" Shaded green: the stretch that sets the zero.");
    }
    for words in levelled.held_out_words() {
        caption.push(' ');
        caption.push_str(&sentence(&words));
    }
    let name = format!("levelled-{key}");
    let known = map.drones.iter().any(|drone| drone.truth_mps.is_some());
    let what = if known { "The air beside an instrument" } else { "The air at the drones" };
    let title = format!("{what}, {}", clean(&flight.name));
    Some(Figure { svg: sheet.svg(&name, &title), name, title, caption })
}

fn panel(
    map: &UpdraftMap,
    levelled: &LevelledMap,
    index: usize,
    drone: &DroneUpdraft,
) -> Option<Panel> {
    let apart_mps = levelled.drones.get(index).map_or(0.0, |level| level.apart_mps);
    let band = |apart_mps: f64| -> Vec<(f64, f64, f64)> {
        let values = map.time_s.iter().zip(&drone.interval_mps);
        values
            .map(|(time_s, interval)| {
                let [low, high] = interval.unwrap_or([f64::NAN; 2]);
                let half = (0.5 * (high - low)).hypot(NORMAL * apart_mps);
                let middle = f64::midpoint(low, high);
                (*time_s, middle - half, middle + half)
            })
            .collect()
    };
    let value = |value: &Option<f64>| value.unwrap_or(f64::NAN);
    let line: Vec<(f64, f64)> =
        map.time_s.iter().copied().zip(drone.updraft_mps.iter().map(value)).collect();
    let truth: Option<Vec<(f64, f64)>> = drone
        .truth_mps
        .as_ref()
        .map(|truth| map.time_s.iter().copied().zip(truth.iter().map(value)).collect());
    let wide = band(if truth.is_some() { apart_mps } else { 0.0 });
    let reach = wide.iter().flat_map(|(_, low, high)| [*low, *high]);
    let reach = reach.chain(truth.iter().flatten().map(|(_, value)| *value)).filter(|v| usable(*v));
    if line.iter().filter(|(_, value)| usable(*value)).count() < 2 {
        return None;
    }
    let y = Axis::around("vertical air speed (m/s, up positive)", reach.chain([0.0]), 0.1);
    let (low, high) = (y.min, y.max);
    let from_s = levelled.zero_s.map(|[from, _]| from);
    let x = Axis::time(map.time_s.iter().copied().chain(from_s));
    let mut panel = Panel::new(&clean(&drone.name), x, y);
    panel.legend_outside(210.0);
    if let Some([from, to]) = levelled.zero_s {
        panel.band(&[(from, low, high), (to, low, high)], GREEN);
        panel.entry("sets the zero", GREEN, LegendShape::Rect, "");
    }
    if truth.is_some() {
        panel.band(&wide, BLUE);
    }
    panel.band(&band(0.0), BLUE);
    panel.line(&line, BLUE, 1.8, "");
    panel.entry("estimate, 95 %", BLUE, LegendShape::Line, "");
    panel.line(
        &[(map.time_s.first().copied()?, 0.0), (map.time_s.last().copied()?, 0.0)],
        MUTED,
        0.8,
        "2 3",
    );
    if let Some(truth) = truth {
        panel.line(&truth, VERMILLION, 1.5, "6 4");
        panel.entry("instrument", VERMILLION, LegendShape::Line, "6 4");
    }
    Some(panel)
}
