//! Figures of the comparison of measurement and simulation.

pub(in crate::report) mod drones;
pub(in crate::report) mod ladder;
pub(in crate::report) mod map;
pub(in crate::report) mod step;

use kuva::plot::legend::LegendShape;
use kuva::plot::scatter::MarkerShape;

use crate::gap::verdict::Regime;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, VERMILLION};
use crate::report::shapes::Shape;
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
    for (points, (colour, shape)) in [(before, BEFORE), (after, AFTER)] {
        // Places and drones have no order to follow.
        if chance {
            panel.line(&points, colour, 1.1, "");
        }
        let marks: Vec<Mark> = points.into_iter().map(point).collect();
        panel.marks(&marks, colour, 3.6, shape);
    }
}

/// The legend of [`residuals`].
fn legend(panel: &mut Panel, chance: bool) {
    panel.entry("before", BEFORE.0, LegendShape::Marker(BEFORE.1), "");
    panel.entry("after", AFTER.0, LegendShape::Marker(AFTER.1), "");
    if chance {
        panel.entry("air and noise (95 %)", CHANCE, LegendShape::Rect, "");
    }
}
