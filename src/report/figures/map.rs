//! The map of the air: the grid seen from above, coloured by the estimated vertical air speed.

use super::air::{mean, mean_truth};
use super::map_marks::{CELLS, MARKS_HEIGHT, NEXT_ROW, ground, ground_words, marks};
use super::plan_view::{Projection, axes, colour_bar, empty_places, holes, limit, position};
use crate::analysis::result::{Analysis, DroneUpdraft, FilledDrone, FlightAnalysis, UpdraftMap};
use crate::base::estimate::Estimate;
use crate::report::Figure;
use crate::report::basemap::Basemap;
use crate::report::colour::{FAINT, INK, MUTED, diverging, ink_on_diverging};
use crate::report::explorer::pick;
use crate::report::format::Format;
use crate::report::print_panel::width_of;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, count, estimate, fixed, signed, usable};

/// Narrowest cell that holds a readable value, pixels, and one that holds its error and the slot as well.
const VALUE_PX: f64 = 38.0;
const ERROR_PX: f64 = 56.0;
/// The same of the latter in print.
const PRINT_ERROR_PX: f64 = 45.0;
/// Room left of the maps and right of them in print, and between two, pixels.
const PRINT_LEFT: f64 = 56.0;
const PRINT_RIGHT: f64 = 92.0;
const BETWEEN: f64 = 30.0;

/// What the cells are wide enough for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Room {
    /// Decimals of a value; absent: colours alone.
    decimals: Option<usize>,
    /// Whether error and slot stand beside it.
    all: bool,
    /// Whether the ground shows behind it, without a style sheet that says so.
    see_through: bool,
}

impl Room {
    /// What cells of so many pixels have room for, with values of so many decimals.
    fn of(format: Format, cell_px: f64, decimals: usize) -> Self {
        if !format.is_print() {
            let decimals = (cell_px >= VALUE_PX).then_some(decimals);
            return Self { decimals, all: cell_px >= ERROR_PX, see_through: false };
        }
        // A sign, a digit and the point beside them, in the smallest text that is read.
        let fits = |decimals: usize| {
            width_of("+0.", format.text(0.0), true)
                + width_of("0", format.text(0.0), true) * decimals as f64
                <= cell_px
        };
        let decimals = [decimals, decimals.min(2)].into_iter().find(|decimals| fits(*decimals));
        Self { decimals, all: decimals.is_some() && cell_px >= PRINT_ERROR_PX, see_through: false }
    }
}

/// Where the maps lie on their sheet.
struct MapSheet {
    /// Upper edge of the first map, pixels.
    top: f64,
    /// Room for each, width and height, pixels.
    room: [f64; 2],
    /// Room right of the last, pixels.
    beside: f64,
    /// Whether the truth is beside the estimate, or below it; absent: it is not known.
    truth: Option<Truth>,
    /// Height of what is below the axes, pixels.
    marks_height: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Truth {
    Beside,
    Below,
}

impl MapSheet {
    fn of(format: Format, truth_known: bool) -> Self {
        let wide = format.width();
        let truth =
            truth_known.then_some(if format.is_narrow() { Truth::Below } else { Truth::Beside });
        let top = if truth_known { 40.0 } else { 16.0 };
        // Two maps beside each other, or one that fills the sheet.
        let across = wide - PRINT_LEFT - PRINT_RIGHT;
        let room = match truth {
            Some(Truth::Beside) => {
                let half = (across - BETWEEN) / 2.0;
                format.choose([424.0, 424.0], [half, half])
            }
            _ => format.choose([800.0, 620.0], [across, 540.0]),
        };
        let second = if format.is_narrow() { NEXT_ROW } else { 0.0 };
        Self { top, room, beside: PRINT_RIGHT, truth, marks_height: MARKS_HEIGHT + second }
    }

    /// Left edge of a first map of a width: in print the maps are in the middle.
    fn left(&self, format: Format, width: f64) -> f64 {
        let maps = if self.truth == Some(Truth::Beside) { 2.0 * width + BETWEEN } else { width };
        let spare = format.width() - PRINT_LEFT - maps - self.beside;
        format.choose(70.0, PRINT_LEFT + (spare / 2.0).max(0.0))
    }

    /// Upper left corner of the map of the truth.
    fn aside(&self, left: f64, [width, height]: [f64; 2]) -> Option<[f64; 2]> {
        self.truth.map(|truth| match truth {
            Truth::Beside => [left + width + BETWEEN, self.top],
            Truth::Below => [left, self.top + height.max(180.0) + 84.0],
        })
    }
}

/// Whose means the squares show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) enum Means {
    /// Each drone's own.
    Alone,
    /// Those of the posterior.
    Posterior,
}

impl Means {
    fn of(self, drone: &DroneUpdraft) -> Estimate {
        match self {
            Self::Alone => drone.mean,
            Self::Posterior => drone.posterior_mean.unwrap_or(Estimate::new(f64::NAN, f64::NAN)),
        }
    }

    fn symbol(self) -> &'static str {
        match self {
            Self::Alone => "W*",
            Self::Posterior => "posterior W",
        }
    }
}

/// The map of mean updrafts; `None` if no drone has a position. `key` names the flight in files.
pub(in crate::report) fn mean_map(
    analysis: &Analysis,
    (flight, key): (&FlightAnalysis, &str),
    map: &UpdraftMap,
    means: Means,
    basemap: Option<&Basemap>,
    format: Format,
) -> Option<Figure> {
    let mut positions: Vec<[f64; 2]> = map.drones.iter().filter_map(position).collect();
    if positions.is_empty() {
        return None;
    }
    let filled: Vec<(&FilledDrone, Estimate)> = match (&map.posterior, means) {
        (Some(posterior), Means::Posterior) => posterior.filled.iter().filter_map(filled).collect(),
        _ => Vec::new(),
    };
    let known: Vec<(u16, [f64; 2])> = empty_places(analysis, flight)
        .into_iter()
        .filter(|(slot, _)| filled.iter().all(|(drone, _)| drone.slot != *slot))
        .collect();
    positions.extend(filled.iter().map(|(drone, _)| drone.position_m));
    positions.extend(known.iter().map(|(_, home)| *home));
    let mut empty: Vec<(Option<u16>, [f64; 2])> =
        known.into_iter().map(|(slot, home)| (Some(slot), home)).collect();
    let unknown = holes(&positions);
    positions.extend(&unknown);
    empty.extend(unknown.into_iter().map(|place| (None, place)));
    let truths: Vec<Option<f64>> =
        map.drones.iter().map(|drone| mean_truth(drone).filter(|w| usable(*w))).collect();
    let truth_known = truths.iter().any(Option::is_some);
    let sheet = MapSheet::of(format, truth_known);
    let (top, room) = (sheet.top, sheet.room);
    // Over a picture some ground is left around the drones.
    let margin = if basemap.is_some() { 1.5 } else { 0.5 };
    let [width, height] = Projection::new(&positions, [0.0; 2], room, margin)?.size();
    let left = sheet.left(format, width);
    let projection = Projection::new(&positions, [left, top], room, margin)?;
    let limit = scale_of(map, means);
    let aside = sheet.aside(left, [width, height]);
    let right = aside.map_or(left, |[x, _]| x) + width;
    // Below the lower of the maps.
    let bottom = match aside {
        Some([_, y]) if y > top => y + height,
        _ => top + height.max(format.choose(220.0, 180.0)),
    };
    let size = [
        format.choose((right + 130.0).max(380.0), format.width()),
        bottom + 58.0 + sheet.marks_height,
    ];
    let mut drawing = Drawing::new(format, size);
    if let Some(basemap) = basemap {
        ground(&mut drawing, &projection, flight, basemap);
    }
    let cell_px = positions.first().map_or(0.0, |place| projection.cell(*place)[2]);
    // As many decimals as the largest error asks for, the same in all cells.
    let largest = map.drones.iter().map(|drone| means.of(drone).se).filter(|se| usable(*se));
    let text = Room::of(format, cell_px, error_decimals(largest.fold(0.0, f64::max)));
    let text = Room { see_through: basemap.is_some() && format.is_print(), ..text };
    for (slot, home) in &empty {
        empty_cell(&mut drawing, *slot, projection.cell(*home), text);
    }
    for drone in &map.drones {
        if let Some(place) = position(drone) {
            let cell = projection.cell(place);
            mean_cell(&mut drawing, drone, means.of(drone), cell, limit, text);
        }
    }
    for (drone, mean) in &filled {
        filled_cell(&mut drawing, drone, *mean, projection.cell(drone.position_m), limit, text);
    }
    axes(&mut drawing, &projection);
    let below = bottom + 58.0 + MARKS_HEIGHT / 2.0;
    marks(&mut drawing, &projection, flight, [projection.origin()[0], below]);
    if let Some(place) = aside {
        let aside = Projection::new(&positions, place, room, margin)?;
        if place[1] > top {
            axes(&mut drawing, &aside);
        }
        for (slot, home) in &empty {
            empty_cell(&mut drawing, *slot, aside.cell(*home), text);
        }
        for (drone, truth) in map.drones.iter().zip(&truths) {
            if let (Some(place), Some(truth)) = (position(drone), truth) {
                true_cell(&mut drawing, drone, *truth, aside.cell(place), limit, text);
            }
        }
        let estimated = match means {
            Means::Alone => "estimated W*",
            Means::Posterior => means.symbol(),
        };
        for (projection, words) in [(&projection, estimated), (&aside, "true W")] {
            let style = TextStyle { size: 14.0, bold: true, colour: INK, anchor: Anchor::Start };
            let [x, y] = projection.origin();
            drawing.text([x, y - 12.0], words, style, 0.0);
        }
    }
    let bar_height = height.clamp(160.0, 420.0);
    let (beside, thick) = format.choose((34.0, 18.0), (12.0, 12.0));
    let bar = [right + beside, top, thick, bar_height];
    colour_bar(
        &mut drawing,
        bar,
        limit,
        match (truth_known, means) {
            (true, Means::Alone) => "mean W* and W (m/s)",
            (false, Means::Alone) => "mean updraft W* (m/s)",
            (_, Means::Posterior) => "mean W (m/s)",
        },
    );
    let flight_name = clean(&flight.name);
    let (name, title) = match means {
        Means::Alone => {
            (format!("map-{key}"), format!("Mean vertical air speed over the grid, {flight_name}"))
        }
        Means::Posterior => (
            format!("posterior-{key}"),
            format!("Posterior mean of the vertical air speed over the grid, {flight_name}"),
        ),
    };
    let dashed = if empty.is_empty() { "" } else { " Dashed squares are drones without data." };
    let beside = if truth_known {
        " Right: the mean of the true air at the same drones and times, on the same scale."
    } else {
        ""
    };
    let numbers = if text.all {
        " with its standard error below, m/s, up positive, and the slot in the corner"
    } else if text.decimals.is_some() {
        ", m/s, up positive; point at a square for its drone and its standard error"
    } else {
        ", m/s, up positive. There are too many for numbers: point at a square for its drone, its value and its \
         standard error, which the table of all drones holds, too"
    };
    let (what, lost) = match (means, filled.len()) {
        (Means::Alone, _) => ("", ""),
        (Means::Posterior, 0) => {
            (", as all drones, seconds and the calibration together tell it", "")
        }
        (Means::Posterior, _) => (
            ", as all drones, seconds and the calibration together tell it",
            " Dotted frames are drones without values of their own, whose air their neighbours tell; the error below is \
             the mean one of their seconds, which updraft.csv among the fields has.",
        ),
    };
    let more = match filled.len() {
        0 => String::new(),
        n => format!(" and each of {} without a log", count(n, "place")),
    };
    Some(Figure {
        svg: drawing.finish(&title),
        name,
        title,
        caption: format!(
            "The grid seen from above, one square for each of {}{more}: the mean vertical air speed \
             over the hover{what}{numbers}. Red is rising air, blue sinking, white none.{beside}{lost}{dashed}{}",
            count(positions.len() - empty.len() - filled.len(), "drone"),
            ground_words(flight, basemap),
        ),
    })
}

/// End of the symmetric scale of the means, of the truth beside them and of filled places, m/s.
pub(in crate::report) fn scale_of(map: &UpdraftMap, means: Means) -> f64 {
    let posterior = map.posterior.as_ref().filter(|_| means == Means::Posterior);
    let filled =
        posterior.into_iter().flat_map(|posterior| posterior.filled.iter().filter_map(filled));
    limit(
        map.drones
            .iter()
            .map(|drone| means.of(drone).value)
            .chain(filled.map(|(_, mean)| mean.value))
            .chain(map.drones.iter().filter_map(mean_truth)),
    )
}

/// The true mean in a square.
fn true_cell(
    drawing: &mut Drawing,
    drone: &DroneUpdraft,
    truth: f64,
    [x, y, w, h]: [f64; 4],
    limit: f64,
    text: Room,
) {
    drawing.open(&format!("{}: true mean {} m/s", clean(&drone.name), signed(truth, 3)));
    let fill = diverging(truth / limit);
    drawing.rect([x + 0.75, y + 0.75, w - 1.5, h - 1.5], &fill, "rx=\"2\"");
    if let Some(decimals) = text.decimals {
        let colour = ink_on_diverging(truth / limit);
        let size = (w * 0.23).min(20.0);
        let style = TextStyle { size, bold: true, colour, anchor: Anchor::Middle };
        let value = signed(truth, decimals);
        drawing.text([x + w / 2.0, y + h * 0.56], &value, style, 0.0);
    }
    drawing.close();
}

fn empty_cell(drawing: &mut Drawing, slot: Option<u16>, [x, y, w, h]: [f64; 4], text: Room) {
    let label = slot.map(|slot| slot.to_string());
    drawing
        .open(&label.as_ref().map_or("no data".to_owned(), |slot| format!("slot {slot}: no data")));
    drawing.rect(
        [x + 2.0, y + 2.0, w - 4.0, h - 4.0],
        "#fafbfc",
        &format!("stroke=\"{FAINT}\" stroke-dasharray=\"4 3\""),
    );
    if text.all {
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

/// A drone without a log, with the mean of its posterior over time. Its error is the mean one of the seconds: as if
/// all were off alike, which that of the mean does not exceed.
fn filled(drone: &FilledDrone) -> Option<(&FilledDrone, Estimate)> {
    let known = drone.posterior_mps.iter().flatten().copied();
    let se = mean(drone.posterior_sd_mps.iter().flatten().copied()).unwrap_or(f64::NAN);
    let [x, y] = drone.position_m;
    let mean = mean(known).filter(|_| usable(x) && usable(y))?;
    Some((drone, Estimate::new(mean, se)))
}

fn filled_cell(
    drawing: &mut Drawing,
    drone: &FilledDrone,
    mean: Estimate,
    [x, y, w, h]: [f64; 4],
    limit: f64,
    text: Room,
) {
    let place = mean.value / limit;
    let label = drone.slot.to_string();
    drawing.open(&format!("slot {label}: {} m/s, by its neighbours", estimate(mean)));
    let frame = format!("rx=\"2\" stroke=\"{INK}\" stroke-dasharray=\"2 3\"");
    drawing.rect([x + 2.0, y + 2.0, w - 4.0, h - 4.0], &diverging(place), &frame);
    if let Some(decimals) = text.decimals {
        let colour = ink_on_diverging(place);
        let style = |size, bold, anchor| TextStyle { size, bold, colour, anchor };
        let middle = [x + w / 2.0, y + h * 0.56];
        let value = signed(mean.value, decimals);
        drawing.text(middle, &value, style((w * 0.23).min(20.0), true, Anchor::Middle), 0.0);
        if !text.all {
            drawing.close();
            return;
        }
        let below = [x + w / 2.0, y + h * 0.79];
        let error = if usable(mean.se) && mean.se > 0.0 {
            format!("±{}", fixed(mean.se, decimals))
        } else {
            "no log".to_owned()
        };
        drawing.text(below, &error, style((w * 0.155).min(13.0), false, Anchor::Middle), 0.0);
        let corner = [x + w * 0.07, y + h * 0.2];
        drawing.text(corner, &label, style((w * 0.13).min(10.0), false, Anchor::Start), 0.0);
    }
    drawing.close();
}

fn mean_cell(
    drawing: &mut Drawing,
    drone: &DroneUpdraft,
    mean: Estimate,
    [x, y, w, h]: [f64; 4],
    limit: f64,
    text: Room,
) {
    let place = mean.value / limit;
    let fill = if usable(mean.value) { diverging(place) } else { "#ffffff".to_owned() };
    drawing.open_drone(
        &pick(drone.slot, &drone.name),
        &format!(
            "{}: {} m/s, {} mapping",
            clean(&drone.name),
            estimate(mean),
            drone.mapping.name(),
        ),
    );
    let more = if text.see_through {
        format!("rx=\"2\" fill-opacity=\"{CELLS}\"")
    } else {
        "rx=\"2\"".to_owned()
    };
    drawing.rect([x + 0.75, y + 0.75, w - 1.5, h - 1.5], &fill, &more);
    if let Some(decimals) = text.decimals {
        let colour = if usable(mean.value) { ink_on_diverging(place) } else { MUTED };
        let style = |size: f64, bold| TextStyle { size, bold, colour, anchor: Anchor::Middle };
        let value =
            if usable(mean.value) { signed(mean.value, decimals) } else { "n/a".to_owned() };
        drawing.text([x + w / 2.0, y + h * 0.56], &value, style((w * 0.23).min(20.0), true), 0.0);
        if text.all && usable(mean.se) && mean.se > 0.0 {
            let error = format!("±{}", fixed(mean.se, decimals));
            let at = [x + w / 2.0, y + h * 0.79];
            drawing.text(at, &error, style((w * 0.155).min(13.0), false), 0.0);
        }
        if let Some(slot) = drone.slot.filter(|_| text.all) {
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
