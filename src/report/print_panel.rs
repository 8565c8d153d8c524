//! Panels in print, where they are small: room for labels of ticks, titles that fit, and a legend below the frame.

use kuva::plot::legend::{LegendEntry, LegendShape};
use kuva::plot::scatter::MarkerShape;
use kuva::render::render::{PathData, Primitive, TextAnchor};

use super::axis::{Axis, decimals_of};
use super::text::{fixed, shortened};

/// Width of a letter, as a share of its size: on average, and in bold.
const LETTER: f64 = 0.53;
const BOLD_LETTER: f64 = 0.53;
/// Size of the labels of ticks and of the legend, and of those of axes, pixels.
pub(super) const SMALL: f64 = 12.0;
const LABEL: f64 = 13.0;
/// Space between two labels of ticks, pixels.
const BETWEEN: f64 = 9.0;
/// Height of a label of a tick and of the space above it, pixels.
const LINE: f64 = 18.0;
/// Height of a row of the legend, its swatch with the space around it, and the space above it, pixels.
const ROW: f64 = 17.0;
const SWATCH: f64 = 34.0;
const ABOVE: f64 = 4.0;
/// Where the frame of a panel begins, pixels.
const FRAME_LEFT: f64 = 66.0;

/// Width of a text, about, pixels.
pub(super) fn width_of(text: &str, size: f64, bold: bool) -> f64 {
    text.chars().count() as f64 * size * if bold { BOLD_LETTER } else { LETTER }
}

/// Fewer ticks where their labels would run into each other in so many pixels.
pub(super) fn with_room_for_labels(axis: &mut Axis, pixels: f64) {
    let label = |value: f64, step: f64| width_of(&fixed(value, decimals_of(step)), SMALL, false);
    for factor in [2.0, 2.5, 2.0, 2.0, 2.5] {
        let ticks = (axis.max - axis.min) / axis.step;
        let widest = label(axis.min, axis.step).max(label(axis.max, axis.step));
        if ticks * (widest + BETWEEN) <= pixels {
            return;
        }
        axis.step *= factor;
    }
}

/// Fewer ticks where their labels would stand closer than lines of text in so many pixels of height.
pub(super) fn with_room_between(axis: &mut Axis, pixels: f64) {
    for factor in [2.0, 2.5, 2.0] {
        if (axis.max - axis.min) / axis.step * LINE <= pixels {
            return;
        }
        axis.step *= factor;
    }
}

/// A label of an axis, cut where it is longer than so many pixels.
pub(super) fn fitting(label: &str, pixels: f64) -> String {
    shortened(label, (pixels / (LABEL * LETTER)) as usize)
}

/// A title that begins above the frame, or left of it where it is long, and is cut where it is longer still; with
/// the place where it begins.
pub(super) fn title(text: &str, frame_left: f64, width: f64, size: f64) -> (String, f64) {
    const EDGE: f64 = 2.0;
    let wide = width_of(text, size, true);
    let left = (width - EDGE - wide).clamp(EDGE, frame_left);
    let letters = ((width - 2.0 * EDGE) / (size * BOLD_LETTER)) as usize;
    (shortened(text, letters), left)
}

/// Columns and rows of a legend below a panel of a width.
fn grid(entries: &[LegendEntry], width: f64) -> (usize, usize, f64) {
    let widest = entries.iter().map(|entry| width_of(&entry.label, SMALL, false));
    let column = (widest.fold(0.0, f64::max) + SWATCH + 6.0).min(width);
    let columns = ((width / column) as usize).clamp(1, entries.len().max(1));
    (columns, entries.len().div_ceil(columns), column)
}

/// Height that a legend below a panel takes, pixels.
pub(super) fn legend_height(entries: &[LegendEntry], width: f64) -> f64 {
    ABOVE + ROW * grid(entries, width).1 as f64
}

/// The legend below a panel of a width, from `top` on: below its frame where it fits there.
pub(super) fn legend_below(entries: &[LegendEntry], top: f64, width: f64) -> Vec<Primitive> {
    let (columns, _, column) = grid(entries, width);
    let left = FRAME_LEFT.min((width - columns as f64 * column) / 2.0).max(0.0);
    let mut drawn = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let x = left + column * (index % columns) as f64;
        let y = top + ABOVE + ROW * ((index / columns) as f64 + 0.5);
        let (d, is_filled) = match &entry.shape {
            LegendShape::Line => (format!("M{x:.1} {y:.1}h24"), false),
            LegendShape::Marker(MarkerShape::Cross) => {
                (format!("M{:.1} {:.1}l8 8m-8 0l8 -8", x + 8.0, y - 4.0), false)
            }
            LegendShape::Rect => (format!("M{x:.1} {:.1}h24v9h-24z", y - 4.5), true),
            _ => (format!("M{:.1} {y:.1}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", x + 8.0), true),
        };
        drawn.push(Primitive::Path(Box::new(PathData {
            d,
            fill: is_filled.then(|| entry.color.as_str().into()),
            stroke: entry.color.as_str().into(),
            stroke_width: if is_filled { 0.0 } else { 1.8 },
            opacity: None,
            stroke_dasharray: entry.dasharray.clone(),
        })));
        drawn.push(Primitive::Text {
            x: x + SWATCH - 4.0,
            y: y + 4.0,
            content: entry.label.clone(),
            size: SMALL as u32,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: false,
            color: None,
        });
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_become_fewer_until_their_labels_fit() {
        let mut axis = Axis { label: String::new(), min: 0.0, max: 600.0, step: 60.0 };
        with_room_for_labels(&mut axis, 600.0);
        assert_eq!(axis.step, 60.0, "there was room");
        with_room_for_labels(&mut axis, 150.0);
        assert_eq!(axis.step, 120.0);
    }

    #[test]
    fn a_long_title_begins_further_left_and_a_longer_one_is_cut() {
        assert_eq!(title("(a) Short", 66.0, 300.0, 14.0), ("(a) Short".to_owned(), 66.0));
        let (text, left) = title("(b) A title of thirty letters.", 66.0, 270.0, 14.0);
        assert!(left < 66.0 && text.ends_with("letters."), "{text} at {left}");
        assert!(title(&"long ".repeat(30), 66.0, 300.0, 14.0).0.ends_with('…'));
    }

    #[test]
    fn a_legend_below_takes_as_many_rows_as_it_needs() {
        let entry = |label: &str| LegendEntry {
            label: label.to_owned(),
            color: "#000000".to_owned(),
            shape: LegendShape::Line,
            dasharray: None,
        };
        let entries: Vec<LegendEntry> = (0..7).map(|_| entry("W = +1.0")).collect();
        let (columns, rows, column) = grid(&entries, 360.0);
        assert!(columns as f64 * column <= 360.0 && columns * rows >= 7, "{columns} x {rows}");
        assert_eq!(legend_below(&entries, 0.0, 360.0).len(), 14);
    }
}
