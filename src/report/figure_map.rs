//! The map of the air: the grid seen from above, coloured by the estimated vertical air speed.

use std::collections::{BTreeMap, BTreeSet};

use crate::analysis::result::{Analysis, DroneUpdraft, FlightAnalysis, UpdraftMap};

use super::Figure;
use super::axis::{decimals_of, nice_step};
use super::colour::{FAINT, INK, MUTED, diverging, ink_on_diverging};
use super::svg::{Anchor, Drawing, TextStyle};
use super::text::{clean, count, estimate, fixed, signed, usable};

/// Columns of the small maps over time.
const SLICES: usize = 6;
/// Above so many drones the cells are too small for text.
const TEXT_LIMIT: usize = 400;

/// Positions (x forward, y left) to pixels: seen from above, forward is up and left is left.
struct Projection {
    forward_m: (f64, f64),
    left_m: (f64, f64),
    cell_m: f64,
    scale: f64,
    origin: [f64; 2],
}

impl Projection {
    /// Fits all positions, half a cell around, in a box of pixels; `None` without positions.
    fn new(positions: &[[f64; 2]], origin: [f64; 2], size: [f64; 2]) -> Option<Self> {
        let range = |axis: usize| {
            positions
                .iter()
                .map(|p| p[axis])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(v), r.1.max(v)))
        };
        let (forward, left) = (range(0), range(1));
        if forward.0 > forward.1 {
            return None;
        }
        let extent = (forward.1 - forward.0).max(left.1 - left.0);
        let cell_m = closest(positions).unwrap_or(1.0).max(extent / 120.0).max(1e-3);
        let forward_m = (forward.0 - cell_m / 2.0, forward.1 + cell_m / 2.0);
        let left_m = (left.0 - cell_m / 2.0, left.1 + cell_m / 2.0);
        let scale = (size[0] / (left_m.1 - left_m.0)).min(size[1] / (forward_m.1 - forward_m.0));
        // A lone drone must not fill the page.
        let scale = scale.min(110.0 / cell_m);
        Some(Self { forward_m, left_m, cell_m, scale, origin })
    }

    fn size(&self) -> [f64; 2] {
        [
            (self.left_m.1 - self.left_m.0) * self.scale,
            (self.forward_m.1 - self.forward_m.0) * self.scale,
        ]
    }

    fn across(&self, left_m: f64) -> f64 {
        self.origin[0] + (self.left_m.1 - left_m) * self.scale
    }

    fn down(&self, forward_m: f64) -> f64 {
        self.origin[1] + (self.forward_m.1 - forward_m) * self.scale
    }

    /// The square of a drone: x, y, width, height.
    fn cell(&self, [forward, left]: [f64; 2]) -> [f64; 4] {
        let side = self.cell_m * self.scale;
        [self.across(left) - side / 2.0, self.down(forward) - side / 2.0, side, side]
    }
}

/// Distance of the two closest different positions.
fn closest(positions: &[[f64; 2]]) -> Option<f64> {
    let mut best: Option<f64> = None;
    for (index, a) in positions.iter().enumerate() {
        for b in positions.iter().skip(index + 1) {
            let distance = (a[0] - b[0]).hypot(a[1] - b[1]);
            if distance > 1e-3 && best.is_none_or(|known| distance < known) {
                best = Some(distance);
            }
        }
    }
    best
}

fn position(drone: &DroneUpdraft) -> Option<[f64; 2]> {
    drone.position_m.filter(|p| usable(p[0]) && usable(p[1]))
}

/// The smallest of 1, 2, 2.5, 5 times a power of ten around all values: the scale is symmetric.
fn limit(values: impl Iterator<Item = f64>) -> f64 {
    let largest = values.filter(|&v| usable(v)).map(f64::abs).fold(0.0, f64::max);
    nice_step(largest.max(0.01))
}

/// Slots without data whose place another flight of the analysis knows.
fn empty_places(analysis: &Analysis, flight: &FlightAnalysis) -> Vec<(u16, [f64; 2])> {
    let homes: BTreeMap<u16, [f64; 2]> = analysis
        .flights
        .iter()
        .flat_map(|other| &other.drones)
        .filter_map(|drone| Some((drone.slot?, drone.home_m?)))
        .filter(|(_, home)| usable(home[0]) && usable(home[1]))
        .collect();
    let missing = flight
        .missing
        .iter()
        .filter_map(|missing| homes.get(&missing.slot).map(|&home| (missing.slot, home)));
    let unmeasured = flight.unmeasured.iter().filter_map(|drone| {
        let slot = drone.slot?;
        homes.get(&slot).map(|&home| (slot, home))
    });
    missing.chain(unmeasured).collect()
}

/// Places of a rectangular grid that none of these positions takes; empty where they form no grid.
fn holes(positions: &[[f64; 2]]) -> Vec<[f64; 2]> {
    // Half metres: surveyed homes are not exactly on the grid.
    let key = |v: f64| (v * 2.0).round() as i64;
    let axis = |axis: usize| -> BTreeMap<i64, f64> {
        positions.iter().map(|p| (key(p[axis]), p[axis])).collect()
    };
    let (forward, left) = (axis(0), axis(1));
    if forward.len() * left.len() > 2 * positions.len() {
        return Vec::new();
    }
    let taken: BTreeSet<(i64, i64)> = positions.iter().map(|p| (key(p[0]), key(p[1]))).collect();
    forward
        .iter()
        .flat_map(|(row, x)| left.iter().map(move |(column, y)| ((*row, *column), [*x, *y])))
        .filter(|(cell, _)| !taken.contains(cell))
        .map(|(_, place)| place)
        .collect()
}

/// The map of mean updrafts; `None` if no drone has a position. `key` names the flight in files.
pub(super) fn mean_map(
    analysis: &Analysis,
    flight: &FlightAnalysis,
    key: &str,
    map: &UpdraftMap,
) -> Option<Figure> {
    let mut positions: Vec<[f64; 2]> = map.drones.iter().filter_map(position).collect();
    if positions.is_empty() {
        return None;
    }
    let known = empty_places(analysis, flight);
    positions.extend(known.iter().map(|(_, home)| *home));
    let mut empty: Vec<(Option<u16>, [f64; 2])> =
        known.into_iter().map(|(slot, home)| (Some(slot), home)).collect();
    let unknown = holes(&positions);
    positions.extend(&unknown);
    empty.extend(unknown.into_iter().map(|place| (None, place)));
    let projection = Projection::new(&positions, [70.0, 16.0], [800.0, 620.0])?;
    let [width, height] = projection.size();
    let limit = limit(map.drones.iter().map(|drone| drone.mean.value));
    let sheet_width = (70.0 + width + 130.0).max(380.0);
    let mut drawing = Drawing::new(sheet_width, height.max(220.0) + 74.0);
    let with_text = positions.len() <= TEXT_LIMIT;
    for (slot, home) in &empty {
        empty_cell(&mut drawing, *slot, projection.cell(*home), with_text);
    }
    for drone in &map.drones {
        if let Some(place) = position(drone) {
            let cell = projection.cell(place);
            mean_cell(&mut drawing, drone, cell, limit, with_text);
        }
    }
    axes(&mut drawing, &projection);
    let bar_height = height.clamp(160.0, 420.0);
    let bar = [70.0 + width + 34.0, 16.0, 18.0, bar_height];
    colour_bar(&mut drawing, bar, limit, "mean updraft W* (m/s)");
    let name = format!("map-{key}");
    let title = format!("Mean vertical air speed over the grid, {}", clean(&flight.name));
    let dashed = if empty.is_empty() { "" } else { " Dashed squares are drones without data." };
    Some(Figure {
        svg: drawing.finish(&title),
        name,
        title,
        caption: format!(
            "The grid seen from above, one square for each of {}: the mean vertical air speed \
             over the hover with its standard error below, m/s, up positive. Red is rising air, \
             blue sinking, white none; the small number is the slot.{dashed}",
            count(positions.len() - empty.len(), "drone"),
        ),
    })
}

fn empty_cell(drawing: &mut Drawing, slot: Option<u16>, [x, y, w, h]: [f64; 4], with_text: bool) {
    let label = slot.map(|slot| slot.to_string());
    drawing
        .open(&label.as_ref().map_or("no data".to_owned(), |slot| format!("slot {slot}: no data")));
    drawing.rect(
        [x + 2.0, y + 2.0, w - 4.0, h - 4.0],
        "#fafbfc",
        &format!("stroke=\"{FAINT}\" stroke-dasharray=\"4 3\""),
    );
    if with_text {
        let style = |size, anchor| TextStyle { size, bold: false, colour: MUTED, anchor };
        let middle = [x + w / 2.0, y + h * 0.56];
        drawing.text(middle, "no data", style((w * 0.155).min(13.0), Anchor::Middle), 0.0);
        if let Some(label) = label {
            let corner = [x + w * 0.07, y + h * 0.2];
            drawing.text(corner, &label, style((w * 0.13).min(10.0), Anchor::Start), 0.0);
        }
    }
    drawing.close();
}

fn mean_cell(
    drawing: &mut Drawing,
    drone: &DroneUpdraft,
    [x, y, w, h]: [f64; 4],
    limit: f64,
    with_text: bool,
) {
    let place = drone.mean.value / limit;
    let fill = if usable(drone.mean.value) { diverging(place) } else { "#ffffff".to_owned() };
    drawing.open(&format!(
        "{}: {} m/s, {} mapping",
        clean(&drone.name),
        estimate(drone.mean),
        clean(&drone.mapping),
    ));
    drawing.rect([x + 0.75, y + 0.75, w - 1.5, h - 1.5], &fill, "rx=\"2\"");
    if with_text {
        let colour = if usable(drone.mean.value) { ink_on_diverging(place) } else { MUTED };
        let style = |size: f64, bold| TextStyle { size, bold, colour, anchor: Anchor::Middle };
        let decimals = error_decimals(drone.mean.se);
        let text = if usable(drone.mean.value) {
            signed(drone.mean.value, decimals)
        } else {
            "n/a".to_owned()
        };
        drawing.text([x + w / 2.0, y + h * 0.56], &text, style((w * 0.23).min(20.0), true), 0.0);
        if usable(drone.mean.se) && drone.mean.se > 0.0 {
            let text = format!("±{}", fixed(drone.mean.se, decimals));
            let at = [x + w / 2.0, y + h * 0.79];
            drawing.text(at, &text, style((w * 0.155).min(13.0), false), 0.0);
        }
        if let Some(slot) = drone.slot {
            let small = TextStyle { anchor: Anchor::Start, ..style((w * 0.13).min(10.0), false) };
            drawing.text([x + w * 0.07, y + h * 0.2], &slot.to_string(), small, 0.0);
        }
    }
    drawing.close();
}

/// Decimals for a value with this error in a small cell: two digits of the error, at most three.
fn error_decimals(se: f64) -> usize {
    if usable(se) && se > 0.0 { (1 - se.log10().floor() as i32).clamp(1, 3) as usize } else { 2 }
}

fn axes(drawing: &mut Drawing, projection: &Projection) {
    let [width, height] = projection.size();
    let (left, bottom) = (projection.origin[0], projection.origin[1] + height);
    let style = |size, colour, anchor| TextStyle { size, bold: false, colour, anchor };
    for tick in ticks(projection.left_m) {
        let x = projection.across(tick);
        drawing.line([x, bottom, x, bottom + 5.0], MUTED);
        let text = fixed(tick, 0);
        drawing.text([x, bottom + 19.0], &text, style(12.0, INK, Anchor::Middle), 0.0);
    }
    for tick in ticks(projection.forward_m) {
        let y = projection.down(tick);
        drawing.line([left - 5.0, y, left, y], MUTED);
        drawing.text([left - 9.0, y + 4.0], &fixed(tick, 0), style(12.0, INK, Anchor::End), 0.0);
    }
    let label = style(13.0, INK, Anchor::Middle);
    drawing.text([left + width / 2.0, bottom + 42.0], "← left, show y (m)", label, 0.0);
    let middle = projection.origin[1] + height / 2.0;
    drawing.text([24.0, middle], "forward, show x (m) →", label, -90.0);
}

fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let step = nice_step((high - low) / 6.0).max(1.0);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

/// No data: white would look like still air.
fn cross(drawing: &mut Drawing, [x, y, w, h]: [f64; 4]) {
    let (left, right, top, bottom) = (x + 0.3 * w, x + 0.7 * w, y + 0.3 * h, y + 0.7 * h);
    drawing.line([left, top, right, bottom], FAINT);
    drawing.line([left, bottom, right, top], FAINT);
}

/// A vertical colour bar with ticks and label.
fn colour_bar(drawing: &mut Drawing, [x, y, w, h]: [f64; 4], limit: f64, label: &str) {
    const STEPS: u32 = 80;
    let slice = h / f64::from(STEPS);
    for step in 0..STEPS {
        let place = 1.0 - 2.0 * (f64::from(step) + 0.5) / f64::from(STEPS);
        // Slices overlap a little: no hairlines between them.
        drawing.rect([x, y + f64::from(step) * slice, w, slice + 0.4], &diverging(place), "");
    }
    drawing.rect([x, y, w, h], "none", &format!("stroke=\"{FAINT}\""));
    let decimals = decimals_of(limit / 2.0);
    for part in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let at = y + h * (1.0 - part) / 2.0;
        drawing.line([x + w, at, x + w + 4.0, at], MUTED);
        let style = TextStyle { size: 12.0, bold: false, colour: INK, anchor: Anchor::Start };
        drawing.text([x + w + 8.0, at + 4.0], &signed(part * limit, decimals), style, 0.0);
    }
    let style = TextStyle { size: 13.0, bold: false, colour: INK, anchor: Anchor::Middle };
    drawing.text([x + w + 64.0, y + h / 2.0], label, style, -90.0);
}

/// Small maps at evenly spaced times; `None` without positions or times.
pub(super) fn time_maps(flight: &FlightAnalysis, key: &str, map: &UpdraftMap) -> Option<Figure> {
    let filled: Vec<usize> = (0..map.time_s.len())
        .filter(|&time| {
            let present = map.drones.iter().filter(|drone| at(drone, time).is_some()).count();
            present > 0 && 2 * present >= map.drones.len()
        })
        .collect();
    if filled.len() < SLICES {
        return None;
    }
    let chosen: Vec<usize> = (0..SLICES)
        .filter_map(|i| filled.get((2 * i + 1) * filled.len() / (2 * SLICES)).copied())
        .collect();
    let positions: Vec<[f64; 2]> = map.drones.iter().filter_map(position).collect();
    let limit = limit(chosen.iter().flat_map(|&t| map.drones.iter().filter_map(move |d| at(d, t))));
    let absent = holes(&positions);
    let size = 140.0;
    let tall = Projection::new(&positions, [0.0, 0.0], [size, size])?.size()[1];
    let mut drawing = Drawing::new(1040.0, tall.max(130.0) + 44.0);
    for (column, &time) in chosen.iter().enumerate() {
        let origin = [8.0 + column as f64 * (size + 11.0), 30.0];
        let projection = Projection::new(&positions, origin, [size, size])?;
        let style = TextStyle { size: 13.0, bold: true, colour: INK, anchor: Anchor::Start };
        let seconds = map.time_s.get(time).copied().unwrap_or(f64::NAN);
        drawing.text([origin[0], 20.0], &format!("{} s", fixed(seconds, 0)), style, 0.0);
        for drone in &map.drones {
            let Some(place) = position(drone) else { continue };
            match at(drone, time) {
                Some(w) => {
                    let [x, y, w_px, h_px] = projection.cell(place);
                    drawing.rect([x, y, w_px + 0.3, h_px + 0.3], &diverging(w / limit), "");
                }
                None => cross(&mut drawing, projection.cell(place)),
            }
        }
        for place in &absent {
            cross(&mut drawing, projection.cell(*place));
        }
        let [w, h] = projection.size();
        drawing.rect([origin[0], origin[1], w, h], "none", &format!("stroke=\"{FAINT}\""));
    }
    let bar = [928.0, 30.0, 16.0, tall.max(130.0)];
    colour_bar(&mut drawing, bar, limit, "W* (m/s)");
    let name = format!("map-over-time-{key}");
    let title = format!("Vertical air speed over the grid at six times, {}", clean(&flight.name));
    Some(Figure {
        svg: drawing.finish(&title),
        name,
        title,
        caption: "The same grid at six show times: running 10 s estimates of the vertical air \
                  speed, one common colour scale; crosses where there is no data."
            .to_owned(),
    })
}

fn at(drone: &DroneUpdraft, time: usize) -> Option<f64> {
    drone.updraft_mps.get(time).copied().flatten().filter(|&w| usable(w))
}
