//! Allan deviation of the vertical air speed: the averaging time that a measurement needs.

use kuva::plot::legend::{LegendPosition, LegendShape};

use crate::analysis::result::FlightAnalysis;
use crate::analysis::statistics::result::{Averaging, Baseline};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::Panel;
use crate::report::colour::{BLUE, MUTED, VERMILLION};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, fixed, sentence, usable};

/// The fleet's median with its quartiles; `None` with fewer than three lengths of averages.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    averaging: &Averaging,
    baseline: Option<&Baseline>,
    format: Format,
) -> Option<Figure> {
    let points: Vec<(f64, f64)> = averaging
        .averaging_s
        .iter()
        .copied()
        .zip(averaging.median_mps.iter().copied())
        .filter(|(s, mps)| usable(*s) && *s > 0.0 && usable(*mps))
        .collect();
    if points.len() < 3 {
        return None;
    }
    let (first, last) = (points.first()?.0, points.last()?.0);
    let highs = averaging.quartiles_mps.iter().map(|quartiles| quartiles.high);
    let mut y = Axis::around(
        "Allan deviation (m/s)",
        points.iter().map(|point| point.1).chain(highs).chain([0.0]),
        0.05,
    );
    y.min = 0.0;
    let x = Axis {
        label: "length of the average (s)".to_owned(),
        min: first.min(10.0),
        max: last.max(100.0),
        step: 10.0,
    };
    let mut panel = Panel::new("How much averages of one length differ", x, y.clone());
    panel.logarithmic_x();
    panel.legend_at(LegendPosition::InsideBottomRight);
    let band: Vec<(f64, f64, f64)> = averaging
        .averaging_s
        .iter()
        .zip(&averaging.quartiles_mps)
        .map(|(s, quartiles)| (*s, quartiles.low, quartiles.high))
        .collect();
    panel.band(&band, BLUE);
    panel.line(&points, BLUE, 2.0, "");
    panel.entry("median of the drones, quartiles", BLUE, LegendShape::Line, "");
    let smoothed = averaging.smoothed_below_s;
    if smoothed > first {
        panel.line(&[(smoothed, y.min), (smoothed, y.max)], MUTED, 1.0, "2 3");
        panel.entry("left: smoothed by the running mean", MUTED, LegendShape::Line, "2 3");
    }
    if let Some(best) = averaging.best.filter(|best| usable(best.averaging_s)) {
        let at = best.averaging_s;
        panel.line(&[(at, y.min), (at, y.max)], VERMILLION, 1.2, "6 4");
        let text = format!("repeats best: {} s", fixed(at, 0));
        panel.entry(&text, VERMILLION, LegendShape::Line, "6 4");
    }
    let size = [760.0, 340.0];
    let sheet = Sheet::of(format, size, vec![(panel, [0.0, 0.0, size[0], size[1]])]);
    let name = format!("averaging-{key}");
    let title = format!("How much averages differ, {}", clean(&flight.name));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Allan deviation: how much two averages of one length, one right after \
                  the other, differ (over √2). {} {}",
            sentence(&averaging.words),
            baseline.map_or_else(String::new, |baseline| sentence(&baseline.words))
        ),
    })
}
