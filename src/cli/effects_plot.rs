//! Plots of one curve: in text for the terminal, and as SVG.

use std::fmt::Write as _;

/// Rows of the plot in text.
const ROWS: usize = 15;
/// Size and margins of the SVG, pixels.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 55.0;

/// Smallest and largest value with 0 inside and some width.
fn extent(points: &[(f64, f64)]) -> (f64, f64) {
    let (low, high) =
        points.iter().fold((0.0_f64, 0.0_f64), |(low, high), (_, y)| (low.min(*y), high.max(*y)));
    if high - low < 1e-9 { (-1.0, 1.0) } else { (low, high) }
}

/// A curve in text: one column per point, us upwards, the zero line dotted.
pub(super) fn text_plot(points: &[(f64, f64)], low: f64, high: f64) -> String {
    let (bottom, top) = extent(points);
    let row_of = |y: f64| {
        let share = (top - y) / (top - bottom);
        ((share * (ROWS - 1) as f64).round() as usize).min(ROWS - 1)
    };
    let zero = row_of(0.0);
    let mut text = String::new();
    for row in 0..ROWS {
        let label = if row == 0 {
            format!("{top:+8.1}")
        } else if row == ROWS - 1 {
            format!("{bottom:+8.1}")
        } else if row == zero {
            format!("{:>8}", "0")
        } else {
            " ".repeat(8)
        };
        let line: String = points
            .iter()
            .map(|(_, y)| match row_of(*y) {
                at if at == row => '*',
                _ if row == zero => '.',
                _ => ' ',
            })
            .collect();
        let _ = writeln!(text, "{label} |{}", line.trim_end());
    }
    let (left, right) = (format!("{low}"), format!("{high}"));
    let gap = points.len().saturating_sub(left.len() + right.len());
    let _ = writeln!(text, "{}+{}", " ".repeat(9), "-".repeat(points.len()));
    let _ = writeln!(text, "{}{left}{}{right}", " ".repeat(10), " ".repeat(gap));
    text
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The nearest of 1, 2, 5 times a power of ten that gives about six ticks.
fn step(span: f64) -> f64 {
    let raw = span / 6.0;
    let power = 10_f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= raw)
        .unwrap_or(10.0 * power)
}

fn ticks(low: f64, high: f64) -> Vec<f64> {
    let step = step(high - low);
    let first = (low / step).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|index| index as f64 * step).collect()
}

/// A curve as SVG.
pub(super) fn svg(title: &str, x_label: &str, points: &[(f64, f64)]) -> String {
    let (x_low, x_high) = match (points.first(), points.last()) {
        (Some(first), Some(last)) if last.0 > first.0 => (first.0, last.0),
        _ => (0.0, 1.0),
    };
    let (low, high) = extent(points);
    let pad = 0.05 * (high - low);
    let (y_low, y_high) = (low - pad, high + pad);
    let px = |x: f64| LEFT + (x - x_low) / (x_high - x_low) * (WIDTH - LEFT - RIGHT);
    let py = |y: f64| TOP + (y_high - y) / (y_high - y_low) * (HEIGHT - TOP - BOTTOM);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         width=\"{WIDTH}\" height=\"{HEIGHT}\" role=\"img\" font-family=\"sans-serif\" \
         font-size=\"12\" fill=\"#222\"><title>{0}</title>\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\
         <text x=\"{LEFT}\" y=\"24\" font-size=\"15\" font-weight=\"600\">{0}</text>",
        escape(title),
    );
    let (left, right, top, bottom) = (LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM);
    for x in ticks(x_low, x_high) {
        let at = px(x);
        let _ = write!(
            svg,
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top}\" y2=\"{bottom}\" stroke=\"#e4e4e4\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            bottom + 18.0,
            crate::effects::doc::number(x),
        );
    }
    for y in ticks(y_low, y_high) {
        let at = py(y);
        let stroke = if y == 0.0 { "#888" } else { "#e4e4e4" };
        let _ = write!(
            svg,
            "<line x1=\"{left}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"{stroke}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            left - 8.0,
            at + 4.0,
            crate::effects::doc::number(y),
        );
    }
    let line: Vec<String> =
        points.iter().map(|(x, y)| format!("{:.1},{:.1}", px(*x), py(*y))).collect();
    let middle_y = f64::midpoint(top, bottom);
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#0b62a4\" stroke-width=\"2\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
         <text x=\"18\" y=\"{middle_y:.1}\" text-anchor=\"middle\" \
         transform=\"rotate(-90 18 {middle_y:.1})\">change of the pulse (us)</text></svg>",
        line.join(" "),
        f64::midpoint(left, right),
        HEIGHT - 14.0,
        escape(x_label),
    );
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_from_corner_to_corner() {
        let points: Vec<_> = (0..31).map(|i| (f64::from(i), f64::from(i) - 15.0)).collect();
        let text = text_plot(&points, 0.0, 30.0);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), ROWS + 2);
        assert!(lines[0].ends_with('*') && lines[ROWS - 1].contains("|*"), "{text}");
        let drawn = svg("a < b", "x", &points);
        assert!(drawn.contains("a &lt; b") && drawn.contains("polyline"));
    }

    #[test]
    fn nothing_still_makes_a_plot() {
        assert!(text_plot(&[], 0.0, 1.0).contains('0'));
        assert!(svg("t", "x", &[(0.0, 0.0)]).ends_with("</svg>\n"));
    }
}
