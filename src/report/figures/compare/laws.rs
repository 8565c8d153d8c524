//! The fleet's laws of two flights over each other, and their difference.

use kuva::plot::legend::{LegendPosition, LegendShape};

use super::{OF_95, OTHER, REFERENCE};
use crate::base::estimate::Estimate;
use crate::compare::result::{CurvePoint, LawComparison};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::Panel;
use crate::report::colour::{GREEN, MUTED};
use crate::report::compare_words::pair;
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{shortened, unit};

/// Size of a panel, pixels.
const PANEL: [f64; 2] = [518.0, 380.0];
/// Columns of a label in a legend.
const LABEL: usize = 30;

type Of = fn(&CurvePoint) -> Estimate;

/// The laws; `None` where the ladders have no speeds in common.
pub(in crate::report) fn figure(law: &LawComparison, key: &str, format: Format) -> Option<Figure> {
    if law.curve.is_empty() {
        return None;
    }
    let effort = unit(&law.effort_unit);
    let speeds = || law.curve.iter().map(|point| point.speed_mps);
    let x = Axis::around("vertical speed in still air (m/s)", speeds(), 1.0);
    let ends = |of: Estimate| [of.value - OF_95 * of.se, of.value + OF_95 * of.se];
    let of_both = law.curve.iter().flat_map(|point| [ends(point.reference), ends(point.other)]);
    let y = Axis::around(&format!("effort of the fleet ({effort})"), of_both.flatten(), 10.0);
    let mut panel = Panel::new("(a) The laws", x.clone(), y);
    panel.legend_at(LegendPosition::InsideTopLeft);
    panel.clear_legend();
    let sides: [(Of, _, &str); 2] = [
        (|point| point.reference, REFERENCE, &law.pair.reference),
        (|point| point.other, OTHER, &law.pair.other),
    ];
    for (of, (colour, dash, _), name) in sides {
        let values = law.curve.iter().map(|point| (point.speed_mps, of(point)));
        let band: Vec<_> = values
            .clone()
            .map(|(speed, of)| (speed, of.value - OF_95 * of.se, of.value + OF_95 * of.se))
            .collect();
        panel.band(&band, colour);
        let line: Vec<_> = values.map(|(speed, of)| (speed, of.value)).collect();
        panel.line(&line, colour, 2.0, dash);
        panel.entry(&shortened(name, LABEL), colour, LegendShape::Line, dash);
    }
    let change: Vec<(f64, f64, f64)> = law
        .curve
        .iter()
        .map(|point| {
            let se = point.reference.se.hypot(point.other.se);
            (point.speed_mps, point.other.value - point.reference.value, OF_95 * se)
        })
        .collect();
    let reach = change.iter().flat_map(|(_, value, half)| [value - half, value + half]);
    let y = Axis::around(&format!("other less reference ({effort})"), reach.chain([0.0]), 4.0);
    let mut below = Panel::new("(b) Their difference", x.clone(), y);
    below.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    let band: Vec<_> =
        change.iter().map(|(speed, value, half)| (*speed, value - half, value + half)).collect();
    below.band(&band, GREEN);
    let line: Vec<_> = change.iter().map(|(speed, value, _)| (*speed, *value)).collect();
    below.line(&line, GREEN, 2.0, "");
    let panels =
        [(panel, [0.0, 0.0, PANEL[0], PANEL[1]]), (below, [522.0, 0.0, PANEL[0], PANEL[1]])];
    let sheet = Sheet::of(format, [1040.0, PANEL[1]], panels.into());
    let name = format!("compare-laws-{key}");
    let title = format!("Laws of the fleet, {}", pair(&law.pair));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "(a) The fleet's law ({}) in both flights, over the speeds that both ladders reach. (b) The second less \
             the first. Bands are 95 % intervals; they hold the errors that all drones of a flight share, which a \
             drone's change against the fleet is free of.",
            law.law
        ),
    })
}
