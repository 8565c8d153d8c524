//! Correlations of the air in two flights over each other.

use kuva::plot::legend::{LegendPosition, LegendShape};

use super::{OF_95, OTHER, REFERENCE};
use crate::base::estimate::Estimate;
use crate::compare::result::{DistancePoint, LagPoint, Pair, StructureComparison};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::MUTED;
use crate::report::compare_words::pair;
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::shortened;

/// Size of a panel, pixels.
const PANEL: [f64; 2] = [518.0, 350.0];
/// Columns of a label in a legend.
const LABEL: usize = 30;

/// The correlations; `None` without any.
pub(in crate::report) fn figure(
    of: &StructureComparison,
    key: &str,
    format: Format,
) -> Option<Figure> {
    let mut panels = Vec::new();
    if !of.distance.is_empty() {
        panels.push(over_distance(of));
    }
    if !of.time.is_empty() {
        panels.push(over_time(of));
    }
    if panels.is_empty() {
        return None;
    }
    let panels = panels.into_iter().enumerate();
    let panels =
        panels.map(|(index, panel)| (panel, [index as f64 * 522.0, 0.0, PANEL[0], PANEL[1]]));
    let sheet = Sheet::of(format, [1040.0, PANEL[1] + 4.0], panels.collect());
    let name = format!("compare-correlations-{key}");
    let title = format!("Correlations of the air, {}", pair(&of.pair));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: "(a) Median correlation of the pairs of drones at a distance, with 95 % intervals where flights \
                  simulated in such air tell them. (b) Autocorrelation over time, mean of the drones. Neighbouring \
                  points are not independent."
            .to_owned(),
    })
}

type OfDistance = fn(&DistancePoint) -> Estimate;
type OfLag = fn(&LagPoint) -> f64;

fn axis(label: &str, values: impl Iterator<Item = f64>) -> Axis {
    let mut axis = Axis::around(label, values.chain([0.0, 1.0]), 1.0);
    (axis.min, axis.max) = (axis.min.max(-1.0), axis.max.min(1.0));
    axis
}

fn legend(panel: &mut Panel, pair: &Pair) {
    panel.legend_at(LegendPosition::InsideTopRight);
    panel.clear_legend();
    for ((colour, dash, _), name) in [(REFERENCE, &pair.reference), (OTHER, &pair.other)] {
        panel.entry(&shortened(name, LABEL), colour, LegendShape::Line, dash);
    }
}

fn over_distance(of: &StructureComparison) -> Panel {
    let far = of.distance.iter().map(|point| point.distance_m);
    let mut x = Axis::around("distance between drones (m)", far.chain([0.0]), 1.0);
    x.min = 0.0;
    let reach = of
        .distance
        .iter()
        .flat_map(|point| [point.reference, point.other].map(|of| of.value - OF_95 * of.se));
    let y = axis("correlation", reach);
    let mut panel = Panel::new("(a) Over distance", x.clone(), y);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    let sides: [(OfDistance, _); 2] = [(|of| of.reference, REFERENCE), (|of| of.other, OTHER)];
    for (value, (colour, dash, shape)) in sides {
        let values = of.distance.iter().map(|point| (point.distance_m, value(point)));
        let line: Vec<_> = values.clone().map(|(x, of)| (x, of.value)).collect();
        panel.line(&line, colour, 1.4, dash);
        let marks: Vec<Mark> = values
            .map(|(x, of)| Mark { x, y: of.value, x_error: 0.0, y_error: OF_95 * of.se })
            .collect();
        panel.marks(&marks, colour, 3.6, shape);
    }
    legend(&mut panel, &of.pair);
    panel
}

fn over_time(of: &StructureComparison) -> Panel {
    let mut x = Axis::time(of.time.iter().map(|point| point.lag_s));
    "lag (s)".clone_into(&mut x.label);
    let y = axis("correlation", of.time.iter().flat_map(|point| [point.reference, point.other]));
    let mut panel = Panel::new("(b) Over time", x.clone(), y);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    let sides: [(OfLag, _); 2] = [(|of| of.reference, REFERENCE), (|of| of.other, OTHER)];
    for (value, (colour, dash, _)) in sides {
        let line: Vec<_> = of.time.iter().map(|point| (point.lag_s, value(point))).collect();
        panel.line(&line, colour, 2.0, dash);
    }
    legend(&mut panel, &of.pair);
    panel
}
