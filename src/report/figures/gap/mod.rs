//! Figures of the comparison of measurement and simulation.

pub(in crate::report) mod drones;
pub(in crate::report) mod ladder;
pub(in crate::report) mod map;
pub(in crate::report) mod step;

use kuva::plot::scatter::MarkerShape;

use crate::gap::Verdict;
use crate::gap::verdict::{Finding, Regime, Step};
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, INK, VERMILLION};
use crate::report::format::Format;
use crate::report::shapes::Shape;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::usable;

/// Marks of the model before and after differ in colour and shape.
const BEFORE: (&str, MarkerShape) = (VERMILLION, MarkerShape::Square);
const AFTER: (&str, MarkerShape) = (BLUE, MarkerShape::Circle);
/// What air and noise alone do.
const CHANCE: &str = "#d3dae0";
/// Standard errors that hold 95 of 100.
const OF_95: f64 = 1.96;

/// Words on an axis that come from signals have the unit of the files.
fn axis_words(text: &str) -> String {
    crate::report::gap_words::micro(text)
}

/// A point without bars.
fn point((x, y): (f64, f64)) -> Mark {
    Mark { x, y, x_error: 0.0, y_error: 0.0 }
}

/// The residual in the classes of a regime before and after, and what chance does.
fn residuals(panel: &mut Panel, rows: &[&Regime], bar_width: f64, chance: bool) {
    if chance {
        let ends = |row: &&Regime| {
            let half = OF_95 * row.before_us.1;
            usable(half).then_some([(row.x, -half), (row.x, half)])
        };
        panel.shape(Shape::Strokes {
            lines: rows.iter().filter_map(ends).collect(),
            colour: CHANCE.to_owned(),
            width: bar_width,
            dash: "",
        });
    }
    let before: Vec<(f64, f64)> = rows.iter().map(|row| (row.x, row.before_us.0)).collect();
    let after: Vec<(f64, f64)> = rows.iter().map(|row| (row.x, row.after_us)).collect();
    // Where both are the same, both are seen: dashes over a line, dots on squares.
    // Places and drones have no order to follow.
    if chance {
        panel.line(&after, AFTER.0, 1.3, "");
        panel.line(&before, BEFORE.0, 1.3, "4 4");
    }
    for (points, (colour, shape), size) in [(before, BEFORE, 4.8), (after, AFTER, 3.2)] {
        let marks: Vec<Mark> = points.into_iter().map(point).collect();
        panel.marks(&marks, colour, size, shape);
    }
}

/// Height of a [`key`], pixels.
const KEY_HEIGHT: f64 = 28.0;

/// Width of the key, pixels.
const KEY_WIDTH: f64 = 384.0;

/// Where the key starts above panels that start at `left` on the page, pixels.
fn key_left(format: Format, left: f64) -> f64 {
    let above = format.across(left) + 68.0;
    format.choose(above, above.min(format.width() - KEY_WIDTH))
}

/// The legend of [`residuals`] in a strip above the panels, where no data is.
fn key(drawing: &mut Drawing, [x, y]: [f64; 2]) {
    let entries = [("before", 0.0), ("after", 92.0), ("air and noise alone (95 %)", 172.0)];
    for (words, shift) in entries {
        let style = TextStyle { size: 12.5, bold: false, colour: INK, anchor: Anchor::Start };
        drawing.text([x + shift + 16.0, y + 4.5], words, style, 0.0);
    }
    drawing.rect([x - 1.0, y - 5.0, 10.0, 10.0], BEFORE.0, "");
    drawing.disc([x + 96.0, y], 4.5, AFTER.0, AFTER.0);
    drawing.rect([x + 171.0, y - 8.0, 10.0, 16.0], CHANCE, "");
}

/// What captions say of findings that no vehicle file can hold; empty without any.
fn of_unknown(verdict: &Verdict) -> &'static str {
    let unknown = |step: &Step| matches!(step.finding, Finding::Unknown { .. });
    if verdict.steps.iter().any(unknown) {
        " What is unknown is not in the model, so it remains afterwards."
    } else {
        ""
    }
}
