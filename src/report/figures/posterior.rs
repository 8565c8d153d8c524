//! The posterior map over the whole flight: its mean between the drones, and how well it is known there.

use super::evolution::{marks, pixels, rings};
use super::plan_view::{Projection, axes, narrow_bar};
use crate::analysis::result::FlightAnalysis;
use crate::report::Figure;
use crate::report::axis::{decimals_of, scale_end};
use crate::report::colour::{INK, diverging, sequential};
use crate::report::format::Format;
use crate::report::frames::Frames;
use crate::report::posterior_grid::{Cells, GridField};
use crate::report::print_panel::title;
use crate::report::raster::{image, image_of_sizes};
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, fixed, signed};

/// Largest sides of a panel, pixels.
const ROOM: [f64; 2] = [380.0, 380.0];
const TOP: f64 = 40.0;
const LEFT: f64 = 70.0;
/// From one panel's right edge to the next one's left: the bar with its numbers.
const GAP: f64 = 150.0;
/// The same in print, and the room right of the last map.
const PRINT_LEFT: f64 = 56.0;
const PRINT_GAP: f64 = 92.0;
const PRINT_RIGHT: f64 = 72.0;

/// Mean and standard deviation beside each other; `None` where nothing is known.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    frames: &Frames<'_>,
    field: &GridField<'_>,
    means_limit: f64,
    format: Format,
) -> Option<Figure> {
    let (mean, sd) = (field.mean(), field.sd());
    // The scale of the means at the drones, so that one colour is one speed on both.
    let mean_limit = limit(&mean)?.max(means_limit);
    let sd_limit = limit(&sd)?;
    let places: Vec<[f64; 2]> = frames.places.iter().flatten().copied().collect();
    let lost = frames.lost();
    let ground: Vec<[f64; 2]> = field.corners().into_iter().chain(places.clone()).collect();
    let room = room(format);
    let [width, height] = Projection::new(&ground, [0.0; 2], room, 0.0)?.size();
    let is_stacked = format.is_narrow();
    let first = format.choose(LEFT, PRINT_LEFT);
    let corners = if is_stacked {
        [[first, TOP], [first, TOP + height + 90.0]]
    } else {
        [[first, TOP], [first + width + format.choose(GAP, PRINT_GAP), TOP]]
    };
    let lowest = corners[1][1] + height;
    let drawn_size = [format.choose(corners[1][0] + width + 90.0, format.width()), lowest + 58.0];
    let mut drawing = Drawing::new(format, drawn_size);
    for (index, [left, top]) in corners.into_iter().enumerate() {
        let projection = Projection::new(&ground, [left, top], room, 0.0)?;
        let place = [left, top, width, height];
        let is_mean = index == 0;
        let (cells, limit) = if is_mean { (&mean, mean_limit) } else { (&sd, sd_limit) };
        let (pixels, size) = pixels(&projection, field, cells, limit);
        drawing.raw(&if is_mean {
            image(&pixels, size, place, true)
        } else {
            image_of_sizes(&pixels, size, place)
        });
        marks(&mut drawing, &projection, &places);
        rings(&mut drawing, &projection, &lost);
        if is_mean || is_stacked {
            axes(&mut drawing, &projection);
        }
        let words = if is_mean {
            "(a) Mean over the flight (m/s)"
        } else {
            "(b) Standard deviation at one time (m/s)"
        };
        let style = TextStyle { size: 14.0, bold: true, colour: INK, anchor: Anchor::Start };
        let edge = if format.is_print() { title(words, left, drawn_size[0], 14.0).1 } else { left };
        drawing.text([edge, top - 12.0], words, style, 0.0);
        let bar = [left + width + 14.0, top, 14.0, height.min(320.0)];
        if is_mean {
            let decimals = decimals_of(limit / 2.0);
            let ticks = [0.0, 0.25, 0.5, 0.75, 1.0]
                .map(|place| (place, signed((2.0 * place - 1.0) * limit, decimals)));
            narrow_bar(&mut drawing, bar, |place| diverging(2.0 * place - 1.0), &ticks);
        } else {
            let ticks = [0.0, 1.0].map(|place| (place, fixed(place * limit, decimals_of(limit))));
            narrow_bar(&mut drawing, bar, sequential, &ticks);
        }
    }
    let name = format!("posterior-field-{key}");
    let title = format!("Posterior map between the drones, {}", clean(&flight.name));
    let rings = if lost.is_empty() { "" } else { ", rings those without values of their own" };
    Some(Figure {
        svg: drawing.finish(&title),
        name,
        title,
        caption: format!(
            "(a) Mean of the posterior over the flight, from above, forward is up; red is rising air, on the scale of the means at the drones. (b) Its standard \
             deviation for the mean of 10 s at one time, root mean square over the flight: all origins of error are in \
             it, also those that all places share. Crosses are drones{rings}; hatched: not known."
        ),
    })
}

/// A round number around all sizes; `None` without any.
/// Room for each of the two maps, pixels.
fn room(format: Format) -> [f64; 2] {
    let wide = format.width() - PRINT_LEFT - PRINT_RIGHT;
    let side = if format.is_narrow() { wide } else { (wide - PRINT_GAP) / 2.0 };
    format.choose(ROOM, [side, side])
}

fn limit(cells: &Cells) -> Option<f64> {
    let largest = cells.iter().flatten().flatten().map(|w| w.abs()).reduce(f64::max)?.max(0.01);
    Some(scale_end(largest))
}
