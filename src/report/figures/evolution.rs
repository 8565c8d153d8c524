//! Figure 5: the vertical air speed over the grid at moments 60 s and 10 s apart, beside the true
//! air where it is known.

use super::plan_view::{Projection, colour_bar, cross};
use crate::analysis::result::FlightAnalysis;
use crate::report::Figure;
use crate::report::colour::{FAINT, INK, MUTED, diverging};
use crate::report::format::Format;
use crate::report::frames::Frames;
use crate::report::posterior_grid::{Cells, GridField};
use crate::report::raster::{Pixel, image};
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, fixed};

/// Panels in a row.
const COLUMNS: usize = 6;
/// Seconds between panels of the first and the second row: the first pair that the flight has room
/// for. The paper's is the first.
const STEPS_S: [(f64, f64); 5] = [(60.0, 10.0), (30.0, 5.0), (20.0, 4.0), (10.0, 2.0), (5.0, 1.0)];
/// Size of a panel and the distance to the next, pixels.
const PANEL: f64 = 142.0;
const PITCH: f64 = 150.0;
/// Left of the panels: the rows' names.
const LEFT: f64 = 26.0;
/// Right of the panels in print.
const PRINT_RIGHT: f64 = 96.0;
/// Pixels of the field along a panel's longer side.
const RASTER: f64 = 72.0;
/// Every so many pixels of what is not known are grey, along diagonals.
const HATCH: usize = 6;

/// What a row shows.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    Estimate,
    Posterior,
    Truth,
}

impl Of {
    fn words(self) -> &'static str {
        match self {
            Self::Estimate => "estimated W*",
            Self::Posterior => "posterior W",
            Self::Truth => "true W",
        }
    }
}

/// The panels; `None` without places, times, or room for two rows. `wind_mps` is [forward, left]; with `field` they show
/// the posterior instead of each drone alone.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    frames: &Frames<'_>,
    wind_mps: Option<[f64; 2]>,
    field: Option<&GridField<'_>>,
    format: Format,
) -> Option<Figure> {
    let (name, title) = titles(flight, key, field.is_some());
    if format.is_narrow() {
        return Some(Figure::too_wide(name, title));
    }
    let (first, last) = (*frames.times.first()?, *frames.times.last()?);
    let span_s = frames.seconds(last) - frames.seconds(first);
    let count = COLUMNS as f64;
    let (coarse_s, fine_s) =
        STEPS_S.into_iter().find(|(coarse, _)| (count - 1.0) * coarse <= span_s)?;
    // The middle of the flight, from a round time on.
    let spare = span_s - (count - 1.0) * coarse_s;
    let start_s = ((frames.seconds(first) + spare / 2.0) / fine_s).round() * fine_s;
    // The second row goes on from the first row's middle.
    let middle_s = start_s + 2.0 * coarse_s;
    let of = if field.is_some() { Of::Posterior } else { Of::Estimate };
    let mut rows = vec![(start_s, coarse_s, of), (middle_s, fine_s, of)];
    if frames.truth_known {
        rows.insert(1, (start_s, coarse_s, Of::Truth));
        rows.push((middle_s, fine_s, Of::Truth));
    }
    let places: Vec<[f64; 2]> = frames.places.iter().flatten().copied().collect();
    let lost = frames.lost();
    // The posterior reaches half a distance beyond the outermost drones.
    let (ground, margin) = match field {
        Some(field) => (field.corners().into_iter().chain(places.iter().copied()).collect(), 0.0),
        None => (places.clone(), 0.3),
    };
    let pitch = format.choose(PITCH, (format.width() - LEFT - PRINT_RIGHT) / count);
    let side = pitch - (PITCH - PANEL);
    let projection = |origin| Projection::new(&ground, origin, [side, side], margin);
    let tall = projection([0.0, 0.0])?.size()[1];
    let row_pitch = tall + 30.0;
    let above = format.choose(26.0, 46.0);
    let height = above + row_pitch * rows.len() as f64;
    let mut drawing = Drawing::new(format, [format.width(), height.max(220.0)]);
    for (row, (from_s, step_s, of)) in rows.iter().enumerate() {
        let top = above + row as f64 * row_pitch;
        let style = TextStyle { size: 13.0, bold: false, colour: MUTED, anchor: Anchor::Middle };
        drawing.text([16.0, top + tall / 2.0], of.words(), style, -90.0);
        for column in 0..COLUMNS {
            let origin = [LEFT + column as f64 * pitch, top];
            let projection = projection(origin)?;
            let time = frames.closest(from_s + column as f64 * step_s)?;
            match field.filter(|_| *of == Of::Posterior) {
                Some(field) => posterior_panel(
                    &mut drawing,
                    &projection,
                    field,
                    &field.at(frames.seconds(time)),
                    frames.limit_mps,
                ),
                None => panel(&mut drawing, &projection, frames, time, *of),
            }
            let style = TextStyle { size: 12.5, bold: true, colour: INK, anchor: Anchor::End };
            let words = format!("{} s", fixed(frames.seconds(time), 0));
            let right = origin[0] + projection.size()[0];
            drawing.text([right, top - 6.0], &words, style, 0.0);
            if row == 0 && column == 0 {
                marks(&mut drawing, &projection, &places);
                if field.is_some() {
                    rings(&mut drawing, &projection, &lost);
                }
                if let Some(wind) = wind_mps {
                    let y = format.choose(top - 10.0, 14.0);
                    arrow(&mut drawing, [origin[0], y], wind);
                }
            }
        }
    }
    let right = LEFT + count * pitch + 8.0;
    let bar = [right, above, format.choose(16.0, 12.0), (height - 60.0).clamp(140.0, 320.0)];
    colour_bar(&mut drawing, bar, frames.limit_mps, "W (m/s, up positive)");
    scale_bar(&mut drawing, &projection([0.0; 2])?, [right, height - 12.0]);
    let truth = if frames.truth_known {
        " Below each row: the true air at the same drones and times."
    } else {
        ""
    };
    let (what, others) = match field {
        Some(_) => (
            "The air's 10 s means as all drones, seconds and the calibration together tell it; where \
             it is not known, it is hatched.",
            if lost.is_empty() { "" } else { ", rings those without values of their own" },
        ),
        None => (
            "Running 10 s estimates, linear between the drones (Delaunay triangles), nothing outside \
             their hull.",
            "; grey ones have no value",
        ),
    };
    let wind = if wind_mps.is_some() { " The arrow shows where the wind blows to." } else { "" };
    Some(Figure {
        svg: drawing.finish(&title),
        name,
        title,
        caption: format!(
            "The grid from above (forward is up), at the show times above the panels: {} s apart \
             in the first row, {} s in the second, which goes on from the third panel of the \
             first. {what} One scale for all panels, white is still air. Crosses in \
             the first panel are the drones{others}.{truth}{wind}",
            fixed(coarse_s, 0),
            fixed(fine_s, 0),
        ),
    })
}

/// Name and title of the figure of a flight, of its posterior or of each drone's own estimates.
fn titles(flight: &FlightAnalysis, key: &str, of_posterior: bool) -> (String, String) {
    let flight = clean(&flight.name);
    if of_posterior {
        let title = format!("Posterior map over time, {flight} (as the paper's Fig. 5)");
        (format!("fig5-posterior-{key}"), title)
    } else {
        let title = format!("Evolution of the vertical air speed, {flight} (paper's Fig. 5)");
        (format!("fig5-{key}"), title)
    }
}

fn panel(drawing: &mut Drawing, projection: &Projection, frames: &Frames<'_>, time: usize, of: Of) {
    let value = |drone: usize| match of {
        Of::Estimate | Of::Posterior => frames.estimate(drone, time),
        Of::Truth => frames.truth(drone, time),
    };
    let [w, h] = projection.size();
    let [x, y] = projection.origin();
    drawing.rect([x, y, w, h], "#ffffff", &format!("stroke=\"{FAINT}\""));
    if frames.surface.triangles().is_empty() {
        for (drone, place) in frames.places.iter().enumerate() {
            let (Some(place), Some(w)) = (place, value(drone)) else { continue };
            drawing.rect(projection.cell(*place), &diverging(w / frames.limit_mps), "");
        }
    } else {
        let long = w.max(h);
        let size = |side: f64| ((side / long * RASTER).round() as usize).max(1);
        let (columns, rows) = (size(w), size(h));
        let (forward, left) = projection.ranges();
        let field = frames.surface.raster(value, (columns, rows), (forward, left));
        let pixels: Vec<Pixel> = field
            .into_iter()
            .map(|w| w.map_or(Pixel::Empty, |w| Pixel::At(w / frames.limit_mps)))
            .collect();
        drawing.raw(&image(&pixels, (columns, rows), [x, y, w, h], true));
    }
    for (drone, place) in frames.places.iter().enumerate() {
        if let (Some(place), None) = (place, value(drone)) {
            cross(drawing, projection.cell(*place));
        }
    }
}

/// The field between the drones, hatched where it is not known.
fn posterior_panel(
    drawing: &mut Drawing,
    projection: &Projection,
    field: &GridField<'_>,
    cells: &Cells,
    limit_mps: f64,
) {
    let [w, h] = projection.size();
    let [x, y] = projection.origin();
    drawing.rect([x, y, w, h], "#ffffff", &format!("stroke=\"{FAINT}\""));
    let (pixels, size) = pixels(projection, field, cells, limit_mps);
    drawing.raw(&image(&pixels, size, [x, y, w, h], true));
}

/// A field as pixels of its share of `limit_mps`, with their columns and rows.
pub(super) fn pixels(
    projection: &Projection,
    field: &GridField<'_>,
    cells: &Cells,
    limit_mps: f64,
) -> (Vec<Pixel>, (usize, usize)) {
    let [w, h] = projection.size();
    let side = |side: f64| ((side / w.max(h) * RASTER).round() as usize).max(1);
    let size = (side(w), side(h));
    let raster = field.raster(cells, size, projection.ranges());
    let pixels = raster.into_iter().enumerate().map(|(index, value)| match value {
        Some(w) => Pixel::At(w / limit_mps),
        None if (index / size.0 + index % size.0).is_multiple_of(HATCH) => Pixel::Hatch,
        None => Pixel::Empty,
    });
    (pixels.collect(), size)
}

/// Rings where drones would be that have no log.
pub(super) fn rings(drawing: &mut Drawing, projection: &Projection, places: &[[f64; 2]]) {
    for place in places {
        let [x, y, side, _] = projection.cell(*place);
        let r = (side * 0.14).clamp(1.0, 3.5);
        drawing.disc([x + side / 2.0, y + side / 2.0], r, "none", INK);
    }
}

/// Small crosses where the drones are.
pub(super) fn marks(drawing: &mut Drawing, projection: &Projection, places: &[[f64; 2]]) {
    for place in places {
        let [x, y, side, _] = projection.cell(*place);
        let (x, y, r) = (x + side / 2.0, y + side / 2.0, (side * 0.14).clamp(0.8, 3.0));
        drawing.line([x - r, y - r, x + r, y + r], INK);
        drawing.line([x - r, y + r, x + r, y - r], INK);
    }
}

/// Where the wind blows to, with its speed.
fn arrow(drawing: &mut Drawing, [x, y]: [f64; 2], [forward, left]: [f64; 2]) {
    let speed = forward.hypot(left);
    if speed.is_nan() || speed < 0.05 {
        return;
    }
    let (dx, dy) = (-left / speed, -forward / speed);
    let (cx, cy) = (x + 10.0, y);
    let tip = [cx + 9.0 * dx, cy + 9.0 * dy];
    drawing.line([cx - 9.0 * dx, cy - 9.0 * dy, tip[0], tip[1]], INK);
    for turn in [2.6_f64, -2.6] {
        let (sin, cos) = turn.sin_cos();
        let barb = [dx * cos - dy * sin, dx * sin + dy * cos];
        drawing.line([tip[0], tip[1], tip[0] + 6.0 * barb[0], tip[1] + 6.0 * barb[1]], INK);
    }
    let style = TextStyle { size: 11.5, bold: false, colour: INK, anchor: Anchor::Start };
    drawing.text([x + 24.0, y + 4.0], &format!("wind {} m/s", fixed(speed, 1)), style, 0.0);
}

/// How long some metres are in the panels, at the right bottom.
fn scale_bar(drawing: &mut Drawing, projection: &Projection, [x, y]: [f64; 2]) {
    let ([high, low], _) = projection.ranges();
    let length_m = crate::report::axis::nice_step((high - low) / 4.0);
    let pixels = length_m * projection.scale();
    drawing.line([x, y, x + pixels, y], INK);
    drawing.line([x, y - 4.0, x, y + 4.0], INK);
    drawing.line([x + pixels, y - 4.0, x + pixels, y + 4.0], INK);
    let style = TextStyle { size: 12.0, bold: false, colour: INK, anchor: Anchor::Start };
    drawing.text([x + pixels + 7.0, y + 4.0], &format!("{} m", fixed(length_m, 0)), style, 0.0);
}
