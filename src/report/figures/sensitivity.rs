//! Figures of a sensitivity study: how much each factor decides, and outcomes against factors.

use kuva::plot::scatter::MarkerShape;

use crate::numeric::{Sorted, median};
use crate::study::sensitivity::{FactorResult, OutcomeResult, SensitivityResult, Uncertain};

use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, FAINT, INK, MUTED, RULE, VERMILLION};
use crate::report::format::Format;
use crate::report::sensitivity_terminal::{capital, in_order};
use crate::report::sheet::Sheet;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{count, fixed, shortened, slug};
use crate::report::{Figure, Points};

/// Width of all figures, pixels.
const WIDTH: f64 = 1040.0;
/// Most outcomes that are drawn.
const MOST_OUTCOMES: usize = 6;
/// Panels in a row of either figure.
const COLUMNS: usize = 3;
/// Height of a factor's row in the figure of bars, pixels.
const ROW: f64 = 30.0;
/// Room for the names of factors, pixels, and letters that fit there.
const NAMES: f64 = 118.0;
const LETTERS: usize = 17;
/// Size of a panel of points, pixels.
const PANEL: [f64; 2] = [346.0, 270.0];
/// Stretches of a factor's range that have a median of their own.
const STRETCHES: usize = 8;
/// Fewest points that a median is drawn from.
const FEWEST: usize = 5;

/// All figures that the study has data for.
pub(in crate::report) fn figures(
    study: &SensitivityResult,
    points: &Points,
    format: Format,
) -> Vec<Figure> {
    let bars = influences(study, format);
    let scatter = study.outcomes.iter().enumerate().take(MOST_OUTCOMES);
    bars.into_iter()
        .chain(
            scatter
                .filter_map(|(index, outcome)| scattered(study, points, (index, outcome), format)),
        )
        .collect()
}

fn style(size: f64, colour: &str, anchor: Anchor, bold: bool) -> TextStyle<'_> {
    TextStyle { size, bold, colour, anchor }
}

/// Bars of indices or coefficients, a panel for each outcome.
fn influences(study: &SensitivityResult, format: Format) -> Option<Figure> {
    let is_sobol = study.design == "sobol";
    let shown: Vec<&OutcomeResult> = study
        .outcomes
        .iter()
        .filter(|outcome| outcome.influences.iter().any(|found| found.main().is_some()))
        .take(MOST_OUTCOMES)
        .collect();
    let rows = study.factors.len();
    if shown.is_empty() || rows == 0 {
        return None;
    }
    let columns = if format.is_narrow() { 1 } else { COLUMNS };
    let size = [format.width() / columns as f64, 74.0 + ROW * rows as f64 + 44.0];
    let sheet_rows = shown.len().div_ceil(columns);
    let mut drawing = Drawing::new(format, [format.width(), sheet_rows as f64 * size[1] + 24.0]);
    for (index, outcome) in shown.iter().enumerate() {
        let corner = [(index % columns) as f64 * size[0], (index / columns) as f64 * size[1]];
        panel(&mut drawing, outcome, corner, size, is_sobol);
    }
    legend(&mut drawing, sheet_rows as f64 * size[1] + 4.0, is_sobol);
    let name = "influences".to_owned();
    let title = if is_sobol {
        "Share of each outcome's variance that comes from each factor"
    } else {
        "Rank coefficients of each factor"
    };
    let caption = if is_sobol {
        "Sobol' indices with 95 % intervals of a bootstrap. Filled: the share of the variance that goes when the \
         factor alone is fixed (first order). Open: the share that stays when all others are fixed (total), which \
         has what the factor does together with others. An interval that reaches 0 tells no influence. “chance” is \
         the seed of air, noise and losses, a factor like the others."
    } else {
        "Standardised coefficients of a regression of ranks with 95 % intervals of a bootstrap, which measure what is \
         monotonic: to the right the outcome grows with the factor, to the left it falls. An interval that holds 0 \
         tells no influence."
    };
    Some(Figure {
        svg: drawing.finish(title),
        name,
        title: title.to_owned(),
        caption: caption.to_owned(),
    })
}

/// Bars of one outcome.
fn panel(
    drawing: &mut Drawing,
    outcome: &OutcomeResult,
    [left, top]: [f64; 2],
    [width, height]: [f64; 2],
    is_sobol: bool,
) {
    let order = in_order(outcome);
    let ends = |of: &Option<Uncertain>| of.map_or([0.0, 0.0], |of| [of.low, of.high]);
    let all =
        || order.iter().flat_map(|f| [f.first, f.total, f.regression]).flat_map(|of| ends(&of));
    let (least, most) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
    let (low, high) = if is_sobol {
        // An interval far below 0 or above 1 says no more than that nothing is known.
        (least.clamp(-0.3, 0.0), most.clamp(1.0, 1.3))
    } else {
        (least.clamp(-1.3, -0.5), most.clamp(0.5, 1.3))
    };
    let (from, to) = (left + NAMES, left + width - 14.0);
    let place = |value: f64| from + (value.clamp(low, high) - low) / (high - low) * (to - from);
    let bottom = top + height - 44.0;
    drawing.text(
        [left + 6.0, top + 20.0],
        &capital(&outcome.title),
        style(14.0, INK, Anchor::Start, true),
        0.0,
    );
    let note = match (outcome.mean, outcome.sd) {
        (Some(mean), Some(sd)) => {
            let decimals = crate::report::sensitivity_terminal::decimals(sd);
            format!("{} ± {} {}", fixed(mean, decimals), fixed(sd, decimals), outcome.unit)
        }
        _ => String::new(),
    };
    drawing.text([left + 6.0, top + 38.0], &note, style(12.0, MUTED, Anchor::Start, false), 0.0);
    let step = if high - low > 1.3 || drawing.format().is_print() { 0.5 } else { 0.25 };
    let first = (low / step).ceil() as i64;
    for tick in (first..).map(|k| k as f64 * step).take_while(|tick| *tick <= high + 1e-9) {
        let x = place(tick);
        drawing.line([x, top + 54.0, x, bottom], if tick == 0.0 { FAINT } else { RULE });
        let label = fixed(tick, if step < 0.5 { 2 } else { 1 });
        drawing.text([x, bottom + 16.0], &label, style(11.0, MUTED, Anchor::Middle, false), 0.0);
    }
    for (row, found) in order.iter().enumerate() {
        let middle = top + 54.0 + ROW * (row as f64 + 0.5);
        let name = shortened(&found.factor, LETTERS);
        drawing.open(&found.factor);
        drawing.text([from - 8.0, middle + 4.0], &name, style(12.5, INK, Anchor::End, false), 0.0);
        drawing.close();
        let bars: Vec<(Option<Uncertain>, bool, f64)> = if is_sobol {
            vec![(found.first, true, -6.0), (found.total, false, 6.0)]
        } else {
            vec![(found.regression, true, 0.0)]
        };
        for (of, is_filled, shift) in bars {
            let Some(of) = of else { continue };
            let (zero, end) = (place(0.0), place(of.value));
            let colour = if of.value < 0.0 && !is_sobol { BLUE } else { VERMILLION };
            let colour = if is_sobol { BLUE } else { colour };
            let (fill, more) = if is_filled {
                (colour, "fill-opacity=\"0.75\"".to_owned())
            } else {
                ("#ffffff", format!("stroke=\"{colour}\" stroke-width=\"1.2\""))
            };
            let y = middle + shift;
            drawing.rect([zero.min(end), y - 4.5, (end - zero).abs(), 9.0], fill, &more);
            drawing.line([place(of.low), y, place(of.high), y], INK);
            for end in [of.low, of.high] {
                drawing.line([place(end), y - 3.0, place(end), y + 3.0], INK);
            }
        }
    }
}

fn legend(drawing: &mut Drawing, y: f64, is_sobol: bool) {
    let entries = if is_sobol {
        vec![(BLUE, true, "alone (first order)"), (BLUE, false, "with others (total)")]
    } else {
        vec![(VERMILLION, true, "grows with the factor"), (BLUE, true, "falls with the factor")]
    };
    let start = if drawing.format().is_narrow() { 8.0 } else { NAMES };
    for (index, (colour, is_filled, words)) in entries.into_iter().enumerate() {
        let x = start + 190.0 * index as f64;
        let (fill, more) = if is_filled {
            (colour, "fill-opacity=\"0.75\"".to_owned())
        } else {
            ("#ffffff", format!("stroke=\"{colour}\" stroke-width=\"1.2\""))
        };
        drawing.rect([x, y, 22.0, 9.0], fill, &more);
        drawing.text([x + 29.0, y + 9.0], words, style(12.0, INK, Anchor::Start, false), 0.0);
    }
}

/// Points of one outcome against each factor.
fn scattered(
    study: &SensitivityResult,
    points: &Points,
    (index, outcome): (usize, &OutcomeResult),
    format: Format,
) -> Option<Figure> {
    let values = points.outcomes.get(index)?;
    let known: Vec<f64> = values.iter().copied().flatten().collect();
    if known.is_empty() || points.factors.is_empty() {
        return None;
    }
    let unit = if outcome.unit.is_empty() { String::new() } else { format!(" ({})", outcome.unit) };
    let label = format!("{}{unit}", outcome.title);
    let spread = outcome.sd.unwrap_or(0.0).max(1e-3);
    let y = Axis::around(&shortened(&label, 34), known.iter().copied(), spread);
    let rows = points.factors.len().div_ceil(COLUMNS);
    let mut panels = Vec::new();
    for (place, (factor, levels)) in study.factors.iter().zip(&points.factors).enumerate() {
        let both: Vec<(f64, f64)> = levels
            .iter()
            .zip(values)
            .filter_map(|(level, value)| Some((*level, (*value)?)))
            .collect();
        let panel = of_factor(factor, &both, &y);
        let (row, column) = (place / COLUMNS, place % COLUMNS);
        let corner = [column as f64 * PANEL[0], row as f64 * PANEL[1]];
        panels.push((panel, [corner[0], corner[1], PANEL[0], PANEL[1]]));
    }
    let sheet = Sheet::of(format, [WIDTH, rows as f64 * PANEL[1]], panels);
    let name = format!("scatter-{}", slug(&outcome.name));
    let title = format!("{} against each factor", capital(&outcome.title));
    let drawn = known.len();
    let some = if drawn < points.of {
        format!(" {drawn} of {} are drawn.", count(points.of, "campaign"))
    } else {
        String::new()
    };
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Each point is a campaign; all other factors differ too. The line joins medians of stretches of the \
             factor with as many campaigns each.{some}"
        ),
    })
}

fn of_factor(factor: &FactorResult, points: &[(f64, f64)], y: &Axis) -> Panel {
    let unit = if factor.unit.is_empty() { String::new() } else { format!(" ({})", factor.unit) };
    let label = if factor.words.is_empty() {
        format!("{}{unit}", factor.name)
    } else {
        let words: Vec<String> = factor
            .words
            .iter()
            .enumerate()
            .map(|(place, word)| format!("{place}: {word}"))
            .collect();
        shortened(&words.join(", "), 48)
    };
    let mut x = Axis::around(&label, points.iter().map(|point| point.0), 1e-3);
    let least = points.iter().map(|point| point.0).fold(f64::INFINITY, f64::min);
    if factor.words.is_empty() {
        // No number below 0 where there is none, and no half drones.
        if least >= 0.0 {
            x.min = x.min.max(0.0);
        }
        if points.iter().all(|point| point.0.fract() == 0.0) {
            x.step = x.step.max(1.0);
        }
    } else {
        x.step = 1.0;
        (x.min, x.max) = (-0.5, factor.words.len() as f64 - 0.5);
    }
    let is_log = factor.log && least > 0.0;
    if is_log {
        let most = points.iter().map(|point| point.0).fold(least, f64::max);
        (x.min, x.max) = (least * 0.9, most * 1.1);
    }
    let mut panel = Panel::new(&factor.name, x, y.clone());
    if is_log {
        panel.logarithmic_x();
    }
    let marks: Vec<Mark> =
        points.iter().map(|(x, y)| Mark { x: *x, y: *y, x_error: 0.0, y_error: 0.0 }).collect();
    panel.marks(&marks, BLUE, if points.len() > 300 { 1.6 } else { 2.6 }, MarkerShape::Circle);
    panel.line(&medians(points), VERMILLION, 2.0, "");
    panel
}

/// Medians of stretches of a factor: of each level where there are few, else of equal numbers of campaigns.
fn medians(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let levels = points.chunk_by(|a, b| a.0 == b.0).count();
    let of = |stretch: &[(f64, f64)]| {
        let mut places: Vec<f64> = stretch.iter().map(|point| point.0).collect();
        let place = Sorted::of(&mut places).median()?;
        Some((place, median(stretch.iter().map(|point| point.1).collect())?))
    };
    if levels <= STRETCHES {
        return points.chunk_by(|a, b| a.0 == b.0).filter_map(of).collect();
    }
    let size = points.len().div_ceil(STRETCHES).max(FEWEST);
    points.chunks(size).filter(|stretch| stretch.len() >= FEWEST).filter_map(of).collect()
}
