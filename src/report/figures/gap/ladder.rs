//! The speed ladder with the model before and after.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::gap::verdict::Regime;
use crate::gap::{Dependence, Verdict};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{INK, MUTED};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::svg::Drawing;

use super::{AFTER, BEFORE, KEY_HEIGHT, OF_95, key, key_left, of_unknown, residuals};

/// Size of a panel, pixels.
const PANEL: [f64; 2] = [516.0, 400.0];
const CLIMB_LABEL: &str = "commanded climb speed (m/s)";

/// Measured pulses with both models, and what these leave; `None` without a ladder.
pub(in crate::report) fn figure(verdict: &Verdict, format: Format) -> Option<Figure> {
    let rows: Vec<&Regime> =
        verdict.regimes.iter().filter(|row| row.by == Dependence::Climb).collect();
    if rows.is_empty() {
        return None;
    }
    let x = Axis::around(CLIMB_LABEL, rows.iter().map(|row| row.x), 1.0);
    let whole = !verdict.ladder.is_empty();
    let mut panels = Vec::new();
    if whole {
        panels.push((pulses(verdict, &x), [0.0, KEY_HEIGHT, PANEL[0], PANEL[1]]));
    }
    let most = rows
        .iter()
        .flat_map(|row| [row.before_us.0.abs(), row.after_us.abs(), OF_95 * row.before_us.1])
        .filter(|value| value.is_finite())
        .fold(2.0, f64::max);
    let y = Axis::around("measured − model (µs)", [-most, most].into_iter(), 4.0);
    let mut panel = Panel::new(if whole { "(b) What is left" } else { "" }, x.clone(), y);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    let size = if whole { PANEL } else { [1040.0, PANEL[1]] };
    residuals(
        &mut panel,
        &rows,
        (0.3 * size[0].min(format.width()) / rows.len() as f64).clamp(4.0, 22.0),
        true,
    );
    let left = if whole { 522.0 } else { 0.0 };
    panels.push((panel, [left, KEY_HEIGHT, size[0], size[1]]));
    let mut sheet = Sheet::of(format, [1040.0, KEY_HEIGHT + PANEL[1]], panels);
    let mut over = Drawing::overlay(format);
    key(&mut over, [key_left(format, left), 14.0]);
    sheet.lay_over(over);
    let name = "gap-ladder".to_owned();
    let title = "The speed ladder with the model before and after".to_owned();
    let panels = if whole {
        "(a) Mean pulse of all drones at each commanded speed, measured (with 95 % bars for air \
         and noise) and modelled: dashed before, solid with everything found. A constant that \
         differs from drone to drone is not an error of the model and is removed. (b) Measured \
         minus modelled. "
    } else {
        "Measured minus modelled pulse at each commanded speed. "
    };
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "{panels}Grey bars: where 95 of 100 flights of a correct model would lie. The air \
             that all drones share moves every rung, as each was flown at its own time; only what \
             leaves the bars in a pattern is the model's.{}",
            of_unknown(verdict)
        ),
    })
}

fn pulses(verdict: &Verdict, x: &Axis) -> Panel {
    let rungs = &verdict.ladder;
    let all = rungs.iter().flat_map(|rung| {
        let half = OF_95 * rung.se_us;
        [rung.measured_us - half, rung.measured_us + half, rung.before_us, rung.after_us]
    });
    let y = Axis::around("pulse width (µs)", all, 10.0);
    let mut panel = Panel::new("(a) Pulse", x.clone(), y);
    panel.legend_at(LegendPosition::InsideTopLeft);
    panel.clear_legend();
    let before: Vec<(f64, f64)> =
        rungs.iter().map(|rung| (rung.climb_mps, rung.before_us)).collect();
    let after: Vec<(f64, f64)> = rungs.iter().map(|rung| (rung.climb_mps, rung.after_us)).collect();
    // Where both are the same, both are seen: dashes over a line.
    panel.line(&after, AFTER.0, 1.6, "");
    panel.line(&before, BEFORE.0, 1.6, "6 4");
    let marks: Vec<Mark> = rungs
        .iter()
        .map(|rung| Mark {
            x: rung.climb_mps,
            y: rung.measured_us,
            x_error: 0.0,
            y_error: OF_95 * rung.se_us,
        })
        .collect();
    panel.marks(&marks, INK, 3.4, MarkerShape::Circle);
    panel.entry("measured", INK, LegendShape::Circle, "");
    panel.entry("model before", BEFORE.0, LegendShape::Line, "6 4");
    panel.entry("model after", AFTER.0, LegendShape::Line, "");
    panel
}
