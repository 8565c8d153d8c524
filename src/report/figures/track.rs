//! The air along the tracks of drones that moved: value and interval against the way flown.

use kuva::plot::legend::{LegendPosition, LegendShape};

use crate::analysis::result::{DroneUpdraft, FlightAnalysis, UpdraftMap};
use crate::numeric::extent;
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::Panel;
use crate::report::colour::{BLUE, VERMILLION};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, count, usable};

/// Drones that are drawn.
const MOST_DRONES: usize = 4;
/// Size of a panel, pixels.
const WIDTH: f64 = 1040.0;
const HEIGHT: f64 = 250.0;
/// Values further apart than this are not joined by a line, s: a turn lies between them.
const APART_S: f64 = 1.5;

/// One value on its way.
struct WayPoint {
    way_m: f64,
    value_mps: f64,
    interval_mps: Option<[f64; 2]>,
    truth_mps: Option<f64>,
}

/// Whether a drone flew further up and down than along the ground.
fn is_upright(drone: &DroneUpdraft) -> bool {
    let range = |axis: usize| {
        let places = drone.track_m.iter().flatten().map(|place| place[axis]);
        extent(places).map_or(0.0, |(low, high)| high - low)
    };
    range(2) > range(0).max(range(1))
}

/// The values of a drone over the way that it flew; a point that cannot be drawn breaks the line.
fn points(map: &UpdraftMap, drone: &DroneUpdraft) -> Vec<WayPoint> {
    let mut points = Vec::new();
    let mut way_m = 0.0;
    let mut last: Option<[f64; 3]> = None;
    let mut last_s = f64::NEG_INFINITY;
    // Height counts where a drone flew up and down: along the ground its jitter would be a way, too.
    let is_upright = is_upright(drone);
    for (index, time_s) in map.time_s.iter().enumerate() {
        let Some(place) = drone.track_m.get(index).copied().flatten() else { continue };
        if let Some(last) = last {
            let along_m = f64::hypot(place[0] - last[0], place[1] - last[1]);
            way_m += if is_upright { along_m.hypot(place[2] - last[2]) } else { along_m };
        }
        last = Some(place);
        let Some(value_mps) = drone.updraft_mps.get(index).copied().flatten() else { continue };
        if time_s - last_s > APART_S && !points.is_empty() {
            let gap = f64::NAN;
            points.push(WayPoint {
                way_m: gap,
                value_mps: gap,
                interval_mps: None,
                truth_mps: None,
            });
        }
        last_s = *time_s;
        points.push(WayPoint {
            way_m,
            value_mps,
            interval_mps: drone.interval_mps.get(index).copied().flatten(),
            truth_mps: drone.truth_at(index),
        });
    }
    points
}

/// A panel for each of some drones; `None` if none moved.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    map: &UpdraftMap,
    format: Format,
) -> Option<Figure> {
    let tracks: Vec<(&DroneUpdraft, Vec<WayPoint>)> = map
        .drones
        .iter()
        .filter(|drone| !drone.track_m.is_empty())
        .map(|drone| (drone, points(map, drone)))
        .filter(|(_, points)| points.len() > 1)
        .collect();
    // Spread over the fleet: the first and the last of it among them.
    let shown = tracks.len().min(MOST_DRONES);
    let chosen: Vec<&(&DroneUpdraft, Vec<WayPoint>)> = (0..shown)
        .filter_map(|index| tracks.get(index * (tracks.len() - 1) / (shown - 1).max(1)))
        .collect();
    if chosen.is_empty() {
        return None;
    }
    let all = || chosen.iter().flat_map(|(_, points)| points.iter());
    let reach = all()
        .flat_map(|point| {
            let [low, high] = point.interval_mps.unwrap_or([point.value_mps; 2]);
            [low, high, point.truth_mps.unwrap_or(point.value_mps)]
        })
        .filter(|value| usable(*value));
    let y = Axis::around("updraft (m/s)", reach.chain([0.0]), 0.1);
    let ways = all().map(|point| point.way_m).filter(|way| usable(*way));
    let mut x = Axis::around("way flown (m)", ways.chain([0.0]), 10.0);
    x.min = 0.0;
    let known = all().any(|point| point.truth_mps.is_some());
    let mut panels = Vec::new();
    for (row, (drone, points)) in chosen.iter().enumerate() {
        let mut panel = Panel::new(&clean(&drone.name), x.clone(), y.clone());
        panel.legend_at(LegendPosition::InsideTopRight);
        panel.clear_legend();
        let band: Vec<(f64, f64, f64)> = points
            .iter()
            .map(|point| {
                let [low, high] = point.interval_mps.unwrap_or([f64::NAN; 2]);
                (point.way_m, low, high)
            })
            .collect();
        panel.band(&band, BLUE);
        let line: Vec<(f64, f64)> =
            points.iter().map(|point| (point.way_m, point.value_mps)).collect();
        panel.line(&line, BLUE, 1.8, "");
        if row == 0 {
            panel.entry("estimate, 95 % interval", BLUE, LegendShape::Line, "");
        }
        if known {
            let truth: Vec<(f64, f64)> = points
                .iter()
                .map(|point| (point.way_m, point.truth_mps.unwrap_or(f64::NAN)))
                .collect();
            panel.line(&truth, VERMILLION, 1.4, "6 4");
            if row == 0 {
                panel.entry("true air", VERMILLION, LegendShape::Line, "6 4");
            }
        }
        panels.push((panel, [0.0, HEIGHT * row as f64, WIDTH, HEIGHT]));
    }
    let sheet = Sheet::of(format, [WIDTH, HEIGHT * chosen.len() as f64], panels);
    let name = format!("track-{key}");
    let title = format!("Vertical air speed along the track, {}", clean(&flight.name));
    let of = if chosen.len() < tracks.len() {
        format!("{} of {} that moved", chosen.len(), count(tracks.len(), "drone"))
    } else {
        count(tracks.len(), "drone")
    };
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Running 10 s means over the way that {of} flew, with their 95 % intervals, all errors \
             included{}. Breaks are turns, where the speed changed; places are in the fields table.",
            if known { "; dashed: the true air that each met" } else { "" }
        ),
    })
}
