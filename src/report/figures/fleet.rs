//! Figure 4: every drone at its place in the grid, with its slow offset over time and height; each
//! cell opens the drone's Figure 3.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::analysis::result::{Analysis, DroneAnalysis, FlightAnalysis};
use crate::report::Figure;
use crate::report::axis::{Axis, decimals_of};
use crate::report::colour::{FAINT, INK, MUTED, RULE};
use crate::report::explorer::pick;
use crate::report::format::Format;
use crate::report::offset_field::OffsetScale;
use crate::report::raster::{Pixel, image};
use crate::report::svg::{Anchor, Drawing, TextStyle, escape};
use crate::report::text::{clean, count, fixed, signed, unit, usable};

use super::plan_view::{colour_bar, places_of_slots};

/// Room for the grid, pixels.
const ROOM: f64 = 840.0;
/// Left of the grid: the axis of heights.
const LEFT: f64 = 58.0;
/// Right of the grid in print.
const PRINT_RIGHT: f64 = 96.0;
/// Height above the grid, pixels.
const TOP: f64 = 28.0;
/// Widest cell, pixels; its height is 0.72 of its width.
const WIDEST: f64 = 150.0;
const ASPECT: f64 = 0.72;
/// Picture elements across the whole fleet.
const ELEMENTS: usize = 520;

/// Row from the top, column from the left, slot, index of the drone if there is one.
type Cell = (usize, usize, Option<u16>, Option<usize>);

/// Slot, index of the drone if there is one, and place.
type Placed = (Option<u16>, Option<usize>, Option<[f64; 2]>);

/// The grid's shape and each place's row and column.
struct Places {
    rows: usize,
    columns: usize,
    cells: Vec<Cell>,
    /// Whether rows and columns are those of the ground.
    on_ground: bool,
}

/// The fleet; `None` with fewer than two drones. `names` holds each drone's Figure 3, if it has one.
pub(in crate::report) fn figure(
    analysis: &Analysis,
    flight: &FlightAnalysis,
    key: &str,
    names: &[Option<String>],
    format: Format,
) -> Option<Figure> {
    if flight.drones.len() + flight.missing.len() < 2 {
        return None;
    }
    let scale = OffsetScale::of(flight);
    let places = places(analysis, flight);
    let room = format.choose(ROOM, format.width() - LEFT - PRINT_RIGHT);
    let cell_w = (room / places.columns as f64).min(WIDEST);
    let gap = (0.07 * cell_w).clamp(1.0, 8.0);
    let pitch = [cell_w, ASPECT * cell_w];
    let size = [pitch[0] * places.columns as f64, pitch[1] * places.rows as f64];
    let mut drawing = Drawing::new(
        format,
        [format.width(), TOP + size[1].max(format.choose(200.0, 150.0)) + 50.0],
    );
    let corner =
        |row: usize, column: usize| [LEFT + column as f64 * pitch[0], TOP + row as f64 * pitch[1]];
    if let Some(scale) = &scale {
        drawing.raw(&mosaic(flight, &places, scale, gap / cell_w, size));
    }
    for (row, column, slot, drone) in &places.cells {
        let [x, y] = corner(*row, *column);
        let inside = [x, y, pitch[0] - gap, pitch[1] - gap];
        let drone = drone.and_then(|index| Some((index, flight.drones.get(index)?)));
        cell(&mut drawing, inside, *slot, drone, names, scale.as_ref());
    }
    if let Some(scale) = &scale {
        let [x, y] = corner(places.rows - 1, 0);
        axes(&mut drawing, scale, [x, y, pitch[0] - gap, pitch[1] - gap]);
        let (beside, thick) = format.choose((22.0, 16.0), (10.0, 12.0));
        let (above, least) = format.choose((70.0, 110.0), (44.0, 96.0));
        let tall = (size[1] - above - 20.0).clamp(least, 320.0);
        let bar = [LEFT + size[0] + beside, TOP + above, thick, tall];
        colour_bar(
            &mut drawing,
            bar,
            scale.limit_us,
            &format!("offset of uφ ({})", unit(scale.unit)),
        );
    }
    if places.on_ground {
        compass(&mut drawing, [LEFT + size[0] + 30.0, TOP + 26.0]);
    }
    let name = format!("fig4-{key}");
    let title = format!("The fleet, {}", clean(&flight.name));
    let heat = if scale.is_some() {
        "Each cell is one drone at its place in the grid: the slow offset of its rotor effort over time \
         (to the right) and height (up), on the axes of the lower left cell; red: the drone worked \
         harder than in its mean hover, blue: less. Hatched: not between hovers, the nearest \
         hover's offset stands in."
    } else {
        "Each cell is one drone at its place in the grid. No offset was subtracted in this flight."
    };
    let missing = match flight.missing.len() {
        0 => String::new(),
        n => format!(
            " Dashed cells have no log: {n} of {}.",
            count(flight.drones.len() + n, "drone")
        ),
    };
    Some(Figure {
        // A picture holds nothing to be focused; this one has links.
        svg: drawing.finish(&title).replacen("role=\"img\"", "role=\"group\"", 1),
        name,
        title,
        caption: format!(
            "The paper's Fig. 4. {heat}{missing} Click a cell, or press Enter on it, to open that \
             drone's calibration.",
        ),
    })
}

/// Rows and columns from the homes; in reading order where these form no grid.
fn places(analysis: &Analysis, flight: &FlightAnalysis) -> Places {
    let known = places_of_slots(analysis);
    let place = |slot: Option<u16>, home: Option<[f64; 2]>| {
        home.or_else(|| known.get(&slot?).copied()).filter(|p| usable(p[0]) && usable(p[1]))
    };
    let mut all: Vec<Placed> = flight
        .drones
        .iter()
        .enumerate()
        .map(|(index, drone)| (drone.slot, Some(index), place(drone.slot, drone.home_m)))
        .collect();
    for one in &flight.missing {
        all.push((Some(one.slot), None, place(Some(one.slot), one.home_m)));
    }
    // A missing drone whose place nobody knows is named elsewhere: it has no cell.
    let drones_placed = all.iter().filter(|one| one.1.is_some()).all(|one| one.2.is_some());
    if drones_placed {
        all.retain(|one| one.2.is_some());
    }
    // Half metres: surveyed homes are not exactly on the grid.
    let half_metres = |v: f64| (v * 2.0).round() as i64;
    let ranks = |axis: usize| -> BTreeMap<i64, usize> {
        let keys: BTreeSet<i64> =
            all.iter().filter_map(|one| Some(half_metres(one.2?[axis]))).collect();
        // Forward is up and left is left: the largest comes first on both.
        keys.into_iter().rev().enumerate().map(|(rank, key)| (key, rank)).collect()
    };
    let (forward, left) = (ranks(0), ranks(1));
    let on_ground =
        drones_placed && !forward.is_empty() && forward.len() * left.len() <= 3 * all.len().max(3);
    let columns = if on_ground { left.len() } else { (all.len() as f64).sqrt().ceil() as usize };
    let columns = columns.max(1);
    all.sort_by_key(|one| (one.0.unwrap_or(u16::MAX), one.1));
    let mut cells: Vec<Cell> = all
        .iter()
        .enumerate()
        .map(|(index, (slot, drone, place))| {
            let ranked = place.filter(|_| on_ground).and_then(|[x, y]| {
                Some((*forward.get(&half_metres(x))?, *left.get(&half_metres(y))?))
            });
            let (row, column) = ranked.unwrap_or((index / columns, index % columns));
            (row, column, *slot, *drone)
        })
        .collect();
    let rows = if on_ground { forward.len() } else { all.len().div_ceil(columns).max(1) };
    // Holes of the grid are drones that nobody knows the place of.
    if on_ground && rows * columns <= 2 * all.len() {
        let taken: BTreeSet<(usize, usize)> = cells.iter().map(|cell| (cell.0, cell.1)).collect();
        let every = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let holes = every.filter(|place| !taken.contains(place));
        cells.extend(holes.map(|(row, column)| (row, column, None, None)));
    }
    Places { rows, columns, cells, on_ground }
}

/// One picture for the whole fleet: a picture for each of a thousand drones would be mostly headers.
fn mosaic(
    flight: &FlightAnalysis,
    places: &Places,
    scale: &OffsetScale,
    gap_share: f64,
    size: [f64; 2],
) -> String {
    let wide = (ELEMENTS / places.columns).clamp(12, 60);
    let tall = ((wide as f64 * ASPECT).round() as usize).max(8);
    let gap = ((wide as f64 * gap_share).round() as usize).max(1);
    let (columns, rows) = (wide * places.columns, tall * places.rows);
    let mut pixels = vec![Pixel::Empty; columns * rows];
    for (row, column, _, drone) in &places.cells {
        let offset = drone.and_then(|index| flight.drones.get(index)?.offset.as_ref());
        let Some(offset) = offset else { continue };
        let (w, h) = (wide - gap, tall - gap);
        let cell = scale.pixels(offset, w, h);
        for (y, line) in cell.chunks(w).enumerate() {
            let start = (row * tall + y) * columns + column * wide;
            if let Some(target) = pixels.get_mut(start..start + w) {
                target.copy_from_slice(line);
            }
        }
    }
    image(&pixels, (columns, rows), [LEFT, TOP, size[0], size[1]], false)
}

fn cell(
    drawing: &mut Drawing,
    [x, y, w, h]: [f64; 4],
    slot: Option<u16>,
    drone: Option<(usize, &DroneAnalysis)>,
    names: &[Option<String>],
    scale: Option<&OffsetScale>,
) {
    let label = slot.map_or_else(
        || drone.map_or_else(String::new, |(_, drone)| clean(&drone.name)),
        |slot| slot.to_string(),
    );
    let small = TextStyle {
        size: drawing.format().text((0.13 * w).clamp(6.0, 11.0)),
        bold: false,
        colour: MUTED,
        anchor: Anchor::Start,
    };
    let Some((index, drone)) = drone else {
        drawing.open(format!("{label} no log").trim_start());
        let dashed = format!("stroke=\"{FAINT}\" stroke-dasharray=\"4 3\"");
        drawing.rect([x, y, w, h], "#fafbfc", &dashed);
        if w > 60.0 {
            let middle = TextStyle { anchor: Anchor::Middle, ..small };
            drawing.text([x + w / 2.0, y + h * 0.58], "no log", middle, 0.0);
        }
        if w > 24.0 {
            drawing.text([x + 4.0, y + small.size + 2.0], &label, small, 0.0);
        }
        drawing.close();
        return;
    };
    let figure = names.get(index).cloned().flatten();
    let mut tooltip = clean(&drone.name);
    if let Some(offset) = &drone.offset {
        let ends = offset.points.iter().map(|point| point.offset_us).filter(|us| usable(*us));
        let (low, high) = ends.fold((0.0_f64, 0.0_f64), |(l, h), us| (l.min(us), h.max(us)));
        let unit = scale.map_or_else(String::new, |scale| unit(scale.unit));
        let _ = write!(tooltip, ": offset {} to {} {unit}", signed(low, 1), signed(high, 1));
    }
    if let Some(name) = &figure {
        drawing.raw(&format!(
            "<a href=\"{}.svg\" data-drone=\"{}\" data-pick=\"{}\" aria-label=\"{}: open its calibration\">",
            escape(name),
            escape(name),
            escape(&pick(drone.slot, &drone.name)),
            escape(&clean(&drone.name)),
        ));
    }
    drawing.open(&tooltip);
    let fill = if drone.offset.is_some() && scale.is_some() { "transparent" } else { "#f4f6f8" };
    drawing.rect([x, y, w, h], fill, &format!("stroke=\"{FAINT}\" class=\"cell\""));
    if w > 24.0 {
        let style = TextStyle { colour: INK, ..small };
        drawing.text([x + 4.0, y + small.size + 2.0], &label, style, 0.0);
    }
    drawing.close();
    if figure.is_some() {
        drawing.raw("</a>");
    }
}

/// Ticks of the shared axes at the lower left cell.
fn axes(drawing: &mut Drawing, scale: &OffsetScale, [x, y, w, h]: [f64; 4]) {
    let ends = |axis: &Axis| [axis.min, axis.max];
    let style = |anchor| TextStyle { size: 11.0, bold: false, colour: INK, anchor };
    let decimals = |axis: &Axis| decimals_of(axis.step);
    let [from, to] = ends(&scale.time);
    drawing.line([x, y + h, x, y + h + 4.0], RULE);
    drawing.text([x, y + h + 16.0], &fixed(from, 0), style(Anchor::Middle), 0.0);
    drawing.text([x + w, y + h + 16.0], &fixed(to, 0), style(Anchor::Middle), 0.0);
    drawing.text([x + w / 2.0, y + h + 34.0], "show time (s)", style(Anchor::Middle), 0.0);
    let [low, high] = ends(&scale.height);
    let digits = decimals(&scale.height);
    drawing.text([x - 5.0, y + h], &fixed(low, digits), style(Anchor::End), 0.0);
    drawing.text([x - 5.0, y + 9.0], &fixed(high, digits), style(Anchor::End), 0.0);
    drawing.text([x - 34.0, y + h / 2.0], "height (m)", style(Anchor::Middle), -90.0);
}

/// Which way the grid looks.
fn compass(drawing: &mut Drawing, [x, y]: [f64; 2]) {
    let style = TextStyle { size: 12.0, bold: false, colour: INK, anchor: Anchor::Start };
    drawing.line([x, y, x, y - 26.0], INK);
    drawing.line([x, y - 26.0, x - 4.0, y - 20.0], INK);
    drawing.line([x, y - 26.0, x + 4.0, y - 20.0], INK);
    drawing.text([x + 8.0, y - 14.0], "forward", style, 0.0);
}
