//! Figure 6: correlations of the vertical air speed over distance and over time.

use kuva::plot::legend::{LegendPosition, LegendShape};

use crate::analysis::result::FlightAnalysis;
use crate::analysis::statistics::result::{
    DistanceClass, DistanceCorrelation, FieldStatistics, Scale, TimeCorrelation,
};
use crate::numeric::Moments;
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::Panel;
use crate::report::colour::{BLUE, INK, MUTED, VERMILLION};
use crate::report::format::Format;
use crate::report::scales::{interval, not_determined, paper_form};
use crate::report::shapes::Shape;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, estimate, usable};

/// Size of a panel, pixels.
const PANEL: [f64; 2] = [518.0, 350.0];
/// Samples of a violin's outline, on each side.
const OUTLINE: u32 = 40;
/// Fewest pairs that make a shape.
const FEWEST_PAIRS: usize = 5;
/// With more distances than this, violins would be thinner than their lines: a band stands for them.
const MOST_VIOLINS: usize = 60;
/// Samples of a fitted curve.
const CURVE: u32 = 80;

/// The panels; `None` where there is neither a correlation over distance nor one over time. Where the scales of the air
/// are a posterior's (`of_posterior`), curves are drawn without their numbers.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    statistics: &FieldStatistics,
    (format, of_posterior): (Format, bool),
) -> Option<Figure> {
    let space = statistics.space.as_ref();
    let y = correlation_axis(statistics);
    let mut panels = Vec::new();
    if let Some(space) = space {
        panels.push(distance_panel("(a) All pairs", &space.all, &y, ("λ", format, of_posterior)));
    }
    if let Some(time) = &statistics.time {
        panels.push(time_panel(time, &y, of_posterior));
    }
    if let Some(space) = space {
        for (name, symbol, one) in [
            ("(c) Pairs along x (forward)", "λx", &space.along_x),
            ("(d) Pairs along y (left)", "λy", &space.along_y),
        ] {
            if let Some(one) = one {
                panels.push(distance_panel(name, one, &y, (symbol, format, of_posterior)));
            }
        }
    }
    if panels.is_empty() {
        return None;
    }
    let rows = panels.len().div_ceil(2);
    let place = |index: usize| {
        let (column, row) = ((index % 2) as f64, (index / 2) as f64);
        [column * 522.0, row * PANEL[1], PANEL[0], PANEL[1]]
    };
    let panels = panels.into_iter().enumerate().map(|(index, panel)| (panel, place(index)));
    let sheet = Sheet::of(format, [1040.0, rows as f64 * PANEL[1] + 4.0], panels.collect());
    let name = format!("fig6-{key}");
    let title =
        format!("Correlations of the vertical air speed, {} (paper's Fig. 6)", clean(&flight.name));
    let errors = if of_posterior {
        "The curves describe values of single drones: the scales of the air are told beside the map, \
         and the numbers of these fits are in analysis.json."
    } else {
        "The ± in the legend is the error of the curve fit, as \
         in the paper; the interval below it is the one that holds the truth in 95 of 100 \
         flights in such air."
    };
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "(a), (c), (d) Correlation of every pair of drones, gathered by \
                  nominal distance: the shape is their distribution, lines are the lowest, the \
                  highest and (wide) the median, the short dark bar is the mean; dashed red: exp(−r/λ) fitted \
                  to the medians; dotted grey: the paper's. (b) Autocorrelation, mean of the drones \
                  with a band of one standard deviation between them; dashed red: A (Δt − t₀), \
                  fitted up to the first zero. {errors}"
        ),
    })
}

/// One axis for all panels: what is drawn lies within -1..1.
fn correlation_axis(statistics: &FieldStatistics) -> Axis {
    let space = statistics.space.iter().flat_map(|space| {
        [Some(&space.all), space.along_x.as_ref(), space.along_y.as_ref()].into_iter().flatten()
    });
    let of_pairs = space.flat_map(|one| &one.classes).flat_map(|class| {
        [class.correlations.first().copied(), class.correlations.last().copied()]
    });
    let of_time = statistics.time.iter().flat_map(|time| {
        time.mean.iter().zip(&time.sd_between_drones).flat_map(|(c, sd)| [c - sd, c + sd])
    });
    let low = of_pairs.flatten().chain(of_time).filter(|c| usable(*c)).fold(0.0, f64::min);
    // Always with room below zero, where the legends are: near drones correlate, so that nothing is
    // drawn there.
    let min = if low < -0.5 { -1.0 } else { -0.5 };
    let step = if min < -0.5 { 0.5 } else { 0.25 };
    Axis { label: "correlation".to_owned(), min, max: 1.0, step }
}

fn distance_panel(
    title: &str,
    of: &DistanceCorrelation,
    y: &Axis,
    (symbol, format, of_posterior): (&str, Format, bool),
) -> Panel {
    let farthest = of.classes.iter().map(|class| class.distance_m);
    let mut x = Axis::around("distance between drones (m)", farthest.chain([0.0]), 1.0);
    x.min = 0.0;
    // No empty half: the axis need not end on a tick.
    let last = of.classes.iter().map(|class| class.distance_m).filter(|r| usable(*r));
    x.max = x.max.min(1.06 * last.fold(1.0, f64::max));
    let mut panel = Panel::new(title, x.clone(), y.clone());
    panel.legend_at(LegendPosition::InsideBottomLeft);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 0.8, "");
    if of.classes.len() > MOST_VIOLINS {
        band(&mut panel, &of.classes);
    } else {
        violins(&mut panel, &of.classes, &x);
    }
    if format.is_print() {
        for class in &of.classes {
            let ends = class.correlations.first().zip(class.correlations.last());
            let reach =
                ends.map(|(low, high)| [(class.distance_m, *low), (class.distance_m, *high)]);
            panel.keep_clear(reach.as_ref().map_or(&[], |reach| reach.as_slice()));
        }
    }
    let curve = |lambda: f64| -> Vec<(f64, f64)> {
        (0..=CURVE)
            .map(|i| x.max * f64::from(i) / f64::from(CURVE))
            .map(|r| (r, (-r / lambda).exp()))
            .collect()
    };
    let fitted = |scale: &&Scale| usable(scale.value) && scale.value > 0.0;
    if let Some(lambda) = of.lambda_m.as_ref().filter(fitted) {
        if let Some(paper) = lambda.paper {
            panel.line(&curve(paper.value), MUTED, 1.3, "2 3");
        }
        panel.line(&curve(lambda.value), VERMILLION, 1.8, "6 4");
        scale_entries(&mut panel, symbol, lambda, ("m", of_posterior));
    }
    panel
}

/// The legend of a scale: the paper's form, the honest interval, the paper's value; of a curve beside a posterior's scales
/// that it is a fit.
fn scale_entries(
    panel: &mut Panel,
    symbol: &str,
    scale: &Scale,
    (unit, of_posterior): (&str, bool),
) {
    let text = match not_determined(scale, unit) {
        _ if of_posterior => format!("curve fit for {symbol}"),
        Some(words) => format!("{symbol} {words}"),
        None => format!("{symbol} = {} {unit} (curve fit)", paper_form(scale)),
    };
    panel.entry(&text, VERMILLION, LegendShape::Line, "6 4");
    if let Some(honest) =
        scale.interval_95.filter(|_| scale.undetermined.is_none() && !of_posterior)
    {
        let text = format!("95 %: {} {unit}", interval(honest));
        panel.entry(&text, "#ffffff", LegendShape::Line, "");
    }
    if let Some(paper) = scale.paper {
        let text = format!("paper {} {unit}", estimate(paper));
        panel.entry(&text, MUTED, LegendShape::Line, "2 3");
    }
}

/// Lowest to highest, and medians, where there is no room for violins.
fn band(panel: &mut Panel, classes: &[DistanceClass]) {
    let ends: Vec<(f64, f64, f64)> = classes
        .iter()
        .filter_map(|class| {
            let (low, high) = (class.correlations.first()?, class.correlations.last()?);
            Some((class.distance_m, *low, *high))
        })
        .collect();
    panel.band(&ends, BLUE);
    let medians: Vec<(f64, f64)> = classes.iter().map(|c| (c.distance_m, c.median)).collect();
    panel.line(&medians, BLUE, 1.8, "");
}

fn violins(panel: &mut Panel, classes: &[DistanceClass], x: &Axis) {
    let mut at: Vec<f64> = classes.iter().map(|class| class.distance_m).collect();
    at.sort_by(f64::total_cmp);
    let gap = at.windows(2).map(|pair| pair[1] - pair[0]).fold(x.max, f64::min);
    // Half as wide as the closest distances are apart, but never a hairline.
    let half = (0.45 * gap).clamp(0.011 * x.max, 0.03 * x.max);
    let (mut medians, mut ends, mut means) = (Vec::new(), Vec::new(), Vec::new());
    for class in classes {
        let r = class.distance_m;
        if let Some(outline) = outline(class, half) {
            panel.shape(Shape::Area { outline, fill: BLUE.to_owned(), opacity: 0.28 });
        }
        let (Some(low), Some(high)) = (class.correlations.first(), class.correlations.last())
        else {
            continue;
        };
        ends.push([(r - 0.6 * half, *low), (r + 0.6 * half, *low)]);
        ends.push([(r - 0.6 * half, *high), (r + 0.6 * half, *high)]);
        ends.push([(r, *low), (r, *high)]);
        medians.push([(r - half, class.median), (r + half, class.median)]);
        means.push([(r - 0.35 * half, class.mean), (r + 0.35 * half, class.mean)]);
    }
    let stroke = |lines, colour: &str, width| Shape::Strokes {
        lines,
        colour: colour.to_owned(),
        width,
        dash: "",
    };
    panel.shape(stroke(ends, BLUE, 0.8));
    panel.shape(stroke(medians, BLUE, 2.2));
    panel.shape(stroke(means, INK, 3.0));
}

/// A violin: kernel density of the pairs' correlations, mirrored, cut at the extremes.
fn outline(class: &DistanceClass, half: f64) -> Option<Vec<(f64, f64)>> {
    let values: Vec<f64> = class.correlations.iter().copied().filter(|c| usable(*c)).collect();
    let (low, high) = (*values.first()?, *values.last()?);
    if values.len() < FEWEST_PAIRS || high - low < 1e-6 {
        return None;
    }
    let n = values.len() as f64;
    let sd = Moments::of(&values)?.deviation()?;
    // Scott's rule.
    let width = (sd * n.powf(-0.2)).max(1e-9);
    let levels: Vec<(f64, f64)> = (0..=OUTLINE)
        .map(|i| low + (high - low) * f64::from(i) / f64::from(OUTLINE))
        .map(|c| (c, values.iter().map(|v| (-0.5 * ((c - v) / width).powi(2)).exp()).sum()))
        .collect();
    let peak = levels.iter().map(|level| level.1).fold(0.0, f64::max);
    let side = |sign: f64| {
        levels.iter().map(move |(c, density)| (class.distance_m + sign * half * density / peak, *c))
    };
    Some(side(1.0).chain(side(-1.0).rev()).collect())
}

fn time_panel(time: &TimeCorrelation, y: &Axis, of_posterior: bool) -> Panel {
    let reach = time.lag_s.iter().copied().chain([0.0]);
    let mut x = Axis::around("lag Δt (s)", reach, 10.0);
    x.min = 0.0;
    x.max = time.lag_s.iter().copied().filter(|s| usable(*s)).fold(10.0, f64::max);
    let mut panel = Panel::new("(b) Over time", x.clone(), y.clone());
    panel.legend_at(LegendPosition::InsideTopRight);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 0.8, "");
    let lags = || time.lag_s.iter().copied().zip(time.mean.iter().copied());
    let band: Vec<(f64, f64, f64)> = lags()
        .zip(&time.sd_between_drones)
        .map(|((lag, mean), sd)| (lag, (mean - sd).max(y.min), (mean + sd).min(y.max)))
        .collect();
    panel.band(&band, BLUE);
    panel.line(&lags().collect::<Vec<_>>(), INK, 1.8, "");
    panel.entry("mean of the drones, 1σ band", INK, LegendShape::Line, "");
    let line = time.line.as_ref().filter(|line| {
        usable(line.t0_s.value) && usable(line.slope_per_s.value) && line.slope_per_s.value < 0.0
    });
    if let Some(line) = line {
        let (t0, slope) = (line.t0_s.value, line.slope_per_s.value);
        let start = (t0 + y.max / slope).max(0.0);
        panel.line(&[(start, slope * (start - t0)), (t0, 0.0)], VERMILLION, 1.8, "6 4");
        scale_entries(&mut panel, "t₀", &line.t0_s, ("s", of_posterior));
    }
    panel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_violin_is_widest_where_most_pairs_are() {
        let correlations = vec![0.1, 0.5, 0.51, 0.52, 0.53, 0.9];
        let class = DistanceClass { distance_m: 7.0, correlations, ..DistanceClass::default() };
        let outline = outline(&class, 1.0).unwrap();
        let widest = outline.iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert!((widest.1 - 0.515).abs() < 0.03, "{widest:?}");
        assert!((widest.0 - 8.0).abs() < 1e-9, "as wide as it may be");
        assert!(outline.iter().all(|(_, c)| (0.1..=0.9).contains(c)), "cut at the extremes");
        let few = DistanceClass { correlations: vec![0.1, 0.2], ..DistanceClass::default() };
        assert!(super::outline(&few, 1.0).is_none());
    }
}
