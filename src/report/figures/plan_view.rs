//! The grid seen from above: places to pixels, axes, colour bars, drones without data.

use std::collections::{BTreeMap, BTreeSet};

use crate::analysis::result::{Analysis, DroneUpdraft, FlightAnalysis};
use crate::numeric::extent;
use crate::report::axis::{decimals_of, nice_step, scale_end};
use crate::report::colour::{FAINT, INK, MUTED, diverging};
use crate::report::print_panel::width_of;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{fixed, signed, usable};

/// Positions (x forward, y left) to pixels: seen from above, forward is up and left is left.
pub(super) struct Projection {
    forward_m: (f64, f64),
    left_m: (f64, f64),
    cell_m: f64,
    scale: f64,
    origin: [f64; 2],
}

impl Projection {
    /// Fits all positions, with `margin` cells around, in a box of pixels; `None` without positions.
    pub(super) fn new(
        positions: &[[f64; 2]],
        origin: [f64; 2],
        size: [f64; 2],
        margin: f64,
    ) -> Option<Self> {
        let range = |axis: usize| extent(positions.iter().map(|p| p[axis]));
        let (forward, left) = (range(0)?, range(1)?);
        let extent = (forward.1 - forward.0).max(left.1 - left.0);
        let cell_m = closest(positions).unwrap_or(1.0).max(extent / 120.0).max(1e-3);
        let forward_m = (forward.0 - margin * cell_m, forward.1 + margin * cell_m);
        let left_m = (left.0 - margin * cell_m, left.1 + margin * cell_m);
        let scale = (size[0] / (left_m.1 - left_m.0)).min(size[1] / (forward_m.1 - forward_m.0));
        // A lone drone must not fill the page.
        let scale = scale.min(110.0 / cell_m);
        Some(Self { forward_m, left_m, cell_m, scale, origin })
    }

    /// Width and height, pixels.
    pub(super) fn size(&self) -> [f64; 2] {
        [
            (self.left_m.1 - self.left_m.0) * self.scale,
            (self.forward_m.1 - self.forward_m.0) * self.scale,
        ]
    }

    /// Upper left corner, pixels.
    pub(super) fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// Pixels of a metre.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// From the upper to the lower edge (forward, m) and from the left to the right one (left, m).
    pub(super) fn ranges(&self) -> ([f64; 2], [f64; 2]) {
        ([self.forward_m.1, self.forward_m.0], [self.left_m.1, self.left_m.0])
    }

    /// Pixel of a coordinate to the left, m.
    pub(super) fn across(&self, left_m: f64) -> f64 {
        self.origin[0] + (self.left_m.1 - left_m) * self.scale
    }

    /// Pixel of a coordinate forward, m.
    pub(super) fn down(&self, forward_m: f64) -> f64 {
        self.origin[1] + (self.forward_m.1 - forward_m) * self.scale
    }

    /// The square of a drone: x, y, width, height.
    pub(super) fn cell(&self, [forward, left]: [f64; 2]) -> [f64; 4] {
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

pub(super) fn position(drone: &DroneUpdraft) -> Option<[f64; 2]> {
    drone.position_m.filter(|p| usable(p[0]) && usable(p[1]))
}

/// A round number around all values: the scale is symmetric.
pub(super) fn limit(values: impl Iterator<Item = f64>) -> f64 {
    scale_end(values.filter(|&v| usable(v)).map(f64::abs).fold(0.01, f64::max))
}

/// Where each slot stands, as far as any flight of the analysis knows.
pub(super) fn places_of_slots(analysis: &Analysis) -> BTreeMap<u16, [f64; 2]> {
    let drones = analysis.flights.iter().flat_map(|flight| &flight.drones);
    let missing = analysis.flights.iter().flat_map(|flight| &flight.missing);
    missing
        .filter_map(|missing| Some((missing.slot, missing.home_m?)))
        .chain(drones.filter_map(|drone| Some((drone.slot?, drone.home_m?))))
        .filter(|(_, home)| usable(home[0]) && usable(home[1]))
        .collect()
}

/// Slots without data whose place another flight of the analysis knows.
pub(super) fn empty_places(analysis: &Analysis, flight: &FlightAnalysis) -> Vec<(u16, [f64; 2])> {
    let homes = places_of_slots(analysis);
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
pub(super) fn holes(positions: &[[f64; 2]]) -> Vec<[f64; 2]> {
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

pub(super) fn axes(drawing: &mut Drawing, projection: &Projection) {
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
    let edge = drawing.format().choose(24.0, left - 40.0);
    drawing.text([edge, middle], "forward, show x (m) →", label, -90.0);
}

fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let step = nice_step((high - low) / 6.0).max(1.0);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

/// No data: white would look like still air.
pub(super) fn cross(drawing: &mut Drawing, [x, y, w, h]: [f64; 4]) {
    let (left, right, top, bottom) = (x + 0.3 * w, x + 0.7 * w, y + 0.3 * h, y + 0.7 * h);
    drawing.line([left, top, right, bottom], FAINT);
    drawing.line([left, bottom, right, top], FAINT);
}

/// A vertical colour bar with ticks and label.
pub(super) fn colour_bar(drawing: &mut Drawing, [x, y, w, h]: [f64; 4], limit: f64, label: &str) {
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
    let numbers = width_of(&signed(limit / 2.0, decimals), 12.0, false);
    let beside = drawing.format().choose(64.0, 8.0 + numbers + 15.0);
    drawing.text([x + w + beside, y + h / 2.0], label, style, -90.0);
}

/// A narrow colour bar beside a panel: `colour` of 0 (bottom) to 1 (top), ticks at such places.
pub(super) fn narrow_bar(
    drawing: &mut Drawing,
    [x, y, w, h]: [f64; 4],
    colour: impl Fn(f64) -> String,
    ticks: &[(f64, String)],
) {
    const STEPS: u32 = 40;
    let slice = h / f64::from(STEPS);
    for step in 0..STEPS {
        let place = 1.0 - (f64::from(step) + 0.5) / f64::from(STEPS);
        drawing.rect([x, y + f64::from(step) * slice, w, slice + 0.4], &colour(place), "");
    }
    drawing.rect([x, y, w, h], "none", &format!("stroke=\"{FAINT}\""));
    let style = TextStyle { size: 10.5, bold: false, colour: INK, anchor: Anchor::Start };
    for (place, text) in ticks {
        drawing.text([x + w + 3.0, y + h * (1.0 - place) + 3.5], text, style, 0.0);
    }
}
