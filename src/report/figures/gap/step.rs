//! One thing that was found: its gain against its rivals' and the threshold, and its shape.

use std::fmt::Write as _;

use crate::gap::Dependence;
use crate::gap::verdict::{Finding, Rival, Shape, Step};
use crate::gap::words::quantity;
use crate::report::Figure;
use crate::report::axis::{Axis, nice_step};
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, FAINT, INK, MUTED, RULE, VERMILLION};
use crate::report::format::Format;
use crate::report::gap_words::minus;
use crate::report::sheet::Sheet;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, shortened, usable};

use super::{AFTER, axis_words};

/// Most rivals that are drawn.
const RIVALS: usize = 10;
/// Longest name, letters.
const LETTERS: usize = 37;
/// The same of both in print.
const PRINT_LEFT: f64 = 190.0;
const PRINT_LETTERS: usize = 25;
/// Where bars begin, how long the longest is, how far apart they are, pixels.
const LEFT: f64 = 256.0;
const LONGEST: f64 = 204.0;
const PITCH: f64 = 24.0;
const TOP: f64 = 44.0;
/// Room for a number, pixels.
const NUMBER: f64 = 40.0;

/// The figure of a step, counted from 1; `None` if there is neither a rival nor a shape.
pub(in crate::report) fn figure(step: &Step, number: usize, format: Format) -> Option<Figure> {
    let shape = step.shape.as_ref().filter(|shape| points(shape).len() > 1);
    if step.rivals.is_empty() && shape.is_none() {
        return None;
    }
    let rivals = step.rivals.len().min(RIVALS);
    let height = (TOP + PITCH * rivals as f64 + 62.0).max(330.0);
    let left = if rivals > 0 { format.across(522.0) } else { 0.0 };
    let bars_height = TOP + PITCH * rivals as f64 + 48.0;
    let wide = format.width();
    // In one column of print the curve is below the bars.
    let (place, whole) = match (format.is_narrow(), rivals > 0) {
        (true, true) => ([0.0, bars_height, wide, 270.0], bars_height + 270.0),
        (true, false) => ([0.0, 0.0, wide, 290.0], 290.0),
        (false, _) => ([left, 0.0, wide - 2.0 - left, height], height),
    };
    let whole = if shape.is_none() && format.is_print() { bars_height } else { whole };
    let mut sheet = Sheet::new(format, [wide, whole]);
    if rivals > 0 {
        let room = if format.is_narrow() { wide } else { left };
        sheet.lay_over(bars(step, number, (room, format)));
    }
    if let Some(shape) = shape {
        let letter = if rivals > 0 { "(b) " } else { "" };
        sheet.place(curve(shape, letter), place);
    }
    let name = format!("gap-step-{number}");
    let title = format!("Step {number}: the rivals and the shape");
    let mut caption = String::new();
    if rivals > 0 {
        caption.push_str(
            "(a) How much better each candidate explains the flight when it is added alone (gain \
             of log-likelihood; bars go with its square root). Blue: found; grey: other effects; \
             hatched: free shapes, minus their penalty. Chance hardly ever reaches beyond the \
             dashed line. ",
        );
        if step.rivals.iter().any(|rival| gain_nats(step, rival) != rival.gain_nats) {
            caption.push_str(
                "What was found is drawn with its gain beside the rest of what was found. ",
            );
        }
    }
    if shape.is_some() {
        let _ = write!(
            caption,
            "{}What it does to the pulse, against the variable it is drawn along.",
            if rivals > 0 { "(b) " } else { "" }
        );
    }
    Some(Figure { svg: sheet.svg(&name, &title), name, title, caption })
}

/// Whether a rival is what was found.
fn is_found(step: &Step, rival: &Rival) -> bool {
    match &step.finding {
        Finding::Unknown { depends_on, .. } => rival.generic && rival.name == depends_on.name(),
        other => !rival.generic && other.effects().contains(&rival.name.as_str()),
    }
}

/// The gain that is drawn of a rival. What the step tells of has the gain that the step tells: effects that were found
/// together gain beside each other, and another amount alone.
fn gain_nats(step: &Step, rival: &Rival) -> f64 {
    let first = step.finding.effects().first().copied();
    let is_told = is_found(step, rival) && first.is_none_or(|name| name == rival.name);
    if is_told { step.gain_nats } else { rival.gain_nats }
}

fn bars(step: &Step, number: usize, (room, format): (f64, Format)) -> Drawing {
    let mut drawing = Drawing::overlay(format);
    // Names, bars, and the number behind the longest.
    let (bars_left, letters) = format.choose((LEFT, LETTERS), (PRINT_LEFT, PRINT_LETTERS));
    let longest = format.choose(LONGEST, room - bars_left - NUMBER - 22.0);
    let text = |size, colour, anchor, bold| TextStyle { size, bold, colour, anchor };
    drawing.text([0.0, 17.0], "(a) Gain", text(14.0, INK, Anchor::Start, true), 0.0);
    drawing.raw(&format!(
        "<defs><pattern id=\"gap-hatch-{number}\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" \
         patternTransform=\"rotate(45)\"><rect width=\"6\" height=\"6\" fill=\"#ffffff\"/><rect \
         width=\"2.4\" height=\"6\" fill=\"{FAINT}\"/></pattern></defs>"
    ));
    let hatch = format!("url(#gap-hatch-{number})");
    let most = step
        .rivals
        .iter()
        .map(|rival| gain_nats(step, rival))
        .chain([step.threshold_nats, 1.0])
        .filter(|gain| usable(*gain))
        .fold(1.0, f64::max);
    let at = |gain: f64| {
        let share = if gain.is_nan() { 0.0 } else { (gain.clamp(0.0, most) / most).sqrt() };
        bars_left + longest * share
    };
    let line = at(step.threshold_nats);
    let rows = step.rivals.len().min(RIVALS) as f64;
    let bottom = TOP + PITCH * rows + 4.0;
    for tick in ticks(most) {
        let x = at(tick);
        drawing.line([x, TOP - 6.0, x, bottom], RULE);
        let style = text(12.0, INK, Anchor::Middle, false);
        drawing.text([x, bottom + 16.0], &short_gain(tick), style, 0.0);
    }
    let label = text(13.0, INK, Anchor::Middle, false);
    drawing.text([bars_left + longest / 2.0, bottom + 38.0], "gain (nats)", label, 0.0);
    for (index, rival) in step.rivals.iter().take(RIVALS).enumerate() {
        let y = TOP + PITCH * index as f64;
        let found = is_found(step, rival);
        let words = if rival.generic {
            let on = Dependence::of(&rival.name).map(quantity);
            format!("any shape in {}", on.map_or_else(|| clean(&rival.name), str::to_owned))
        } else {
            clean(&rival.name)
        };
        let style = text(12.0, INK, Anchor::End, found);
        drawing.text([bars_left - 8.0, y + 13.5], &shortened(&words, letters), style, 0.0);
        let gain = gain_nats(step, rival);
        let end = at(gain);
        let (fill, stroke) = match (found, rival.generic) {
            (true, _) => (BLUE, ""),
            (false, true) => (hatch.as_str(), "stroke=\"#b4bcc4\""),
            (false, false) => ("#93a1ae", ""),
        };
        drawing.rect([bars_left, y + 2.0, (end - bars_left).max(1.0), PITCH - 8.0], fill, stroke);
        // Beside the line of the threshold, not on it.
        let number_at = if end < line + 2.0 && end + NUMBER > line { line } else { end };
        let style = text(12.0, MUTED, Anchor::Start, false);
        let gain = minus(&format!("{gain:.1}"));
        drawing.text([number_at + 6.0, y + 13.5], &gain, style, 0.0);
    }
    drawing.polyline(
        &[(line, TOP - 8.0), (line, bottom)],
        VERMILLION,
        "stroke-width=\"1.6\" stroke-dasharray=\"5 3\"",
    );
    let words = format!("threshold {}", short_gain(step.threshold_nats));
    let is_far = format.is_print() && line + 100.0 > room;
    let (shift, anchor) = if is_far { (-4.0, Anchor::End) } else { (4.0, Anchor::Start) };
    let style = text(12.0, VERMILLION, anchor, false);
    drawing.text([line + shift, TOP - 12.0], &words, style, 0.0);
    drawing
}

fn short_gain(gain: f64) -> String {
    if gain.fract() == 0.0 { format!("{gain:.0}") } else { format!("{gain:.1}") }
}

/// Round gains that are apart on an axis of square roots.
fn ticks(most: f64) -> Vec<f64> {
    let mut ticks = vec![0.0];
    for part in [0.25_f64, 0.5, 0.75, 1.0] {
        let wanted = most * part * part;
        let step = nice_step(wanted / 2.0);
        let tick = (wanted / step).round() * step;
        if tick <= most && ticks.last().is_none_or(|last| tick > *last) {
            ticks.push(tick);
        }
    }
    ticks
}

/// (x, us) of the points that can be drawn.
fn points(shape: &Shape) -> Vec<(f64, f64)> {
    let all = shape.x.iter().copied().zip(shape.us.iter().copied());
    all.filter(|(x, us)| usable(*x) && usable(*us)).collect()
}

fn curve(shape: &Shape, letter: &str) -> Panel {
    let points = points(shape);
    let x = Axis::around(&axis_words(&shape.axis), points.iter().map(|point| point.0), 1e-6);
    let changes = points.iter().map(|point| point.1);
    let y = Axis::around("change of the pulse (µs)", changes.chain([0.0]), 0.5);
    let mut panel = Panel::new(&format!("{letter}Shape"), x.clone(), y);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    panel.line(&points, AFTER.0, 1.2, "");
    let marks: Vec<Mark> = points.into_iter().map(super::point).collect();
    panel.marks(&marks, AFTER.0, 3.0, AFTER.1);
    panel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gain_of_what_was_found_is_drawn_as_it_is_told() {
        let rival = |name: &str, generic: bool, gain_nats: f64| Rival {
            name: name.to_owned(),
            generic,
            gain_nats,
        };
        let effect = "face-drag".to_owned();
        let step = Step {
            finding: Finding::Name { effect, parameters: Vec::new(), was_there: false },
            gain_nats: 36.8,
            threshold_nats: 8.0,
            alpha: 0.005,
            size_us: 3.0,
            rivals: vec![rival("face-drag", false, 10.1), rival("battery", false, 9.0)],
            shape: None,
            in_field: None,
            form: None,
        };
        assert_eq!(gain_nats(&step, &step.rivals[0]), 36.8);
        assert_eq!(gain_nats(&step, &step.rivals[1]), 9.0);
        let figure = figure(&step, 1, Format::default()).unwrap();
        assert!(figure.svg.contains("36.8") && !figure.svg.contains("10.1"));
        assert!(figure.caption.contains("beside the rest of what was found"));
    }

    #[test]
    fn ticks_are_round_and_rise() {
        assert_eq!(ticks(378.0), [0.0, 20.0, 100.0, 200.0]);
        for most in [1.0, 9.0, 33.3, 5000.0] {
            let ticks = ticks(most);
            assert!(ticks.len() > 2 && ticks.windows(2).all(|pair| pair[0] < pair[1]), "{ticks:?}");
        }
    }
}
