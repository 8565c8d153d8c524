//! Colours that people with any colour vision can tell apart.

/// Text and axes.
pub(super) const INK: &str = "#1f2933";
/// Secondary text.
pub(super) const MUTED: &str = "#66727f";
/// Grid lines.
pub(super) const RULE: &str = "#e4e8ec";
/// Rejected or missing data.
pub(super) const FAINT: &str = "#b4bcc4";
/// Okabe-Ito blue: going down, first of a pair.
pub(super) const BLUE: &str = "#0072b2";
/// Okabe-Ito vermillion: going up, second of a pair.
pub(super) const VERMILLION: &str = "#d55e00";
/// Okabe-Ito bluish green: measured traces.
pub(super) const GREEN: &str = "#009e73";

/// Viridis at nine equal steps (S. van der Walt and N. Smith, public domain).
const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// Blue (down) through white to red (up): ColorBrewer's RdBu, reversed.
const DIVERGING: [[f64; 3]; 11] = [
    [5.0, 48.0, 97.0],
    [33.0, 102.0, 172.0],
    [67.0, 147.0, 195.0],
    [146.0, 197.0, 222.0],
    [209.0, 229.0, 240.0],
    [247.0, 247.0, 247.0],
    [253.0, 219.0, 199.0],
    [244.0, 165.0, 130.0],
    [214.0, 96.0, 77.0],
    [178.0, 24.0, 43.0],
    [103.0, 0.0, 31.0],
];

/// Sequential colour at `fraction` of 0..1, dark to light. Stops short of the palest yellow, which
/// is hard to see as a thin line on white.
pub(super) fn sequential(fraction: f64) -> String {
    hex(blend(&VIRIDIS, fraction.clamp(0.0, 1.0) * 0.92))
}

/// [`sequential`] as bytes.
pub(super) fn sequential_rgb(fraction: f64) -> [u8; 3] {
    blend(&VIRIDIS, fraction.clamp(0.0, 1.0) * 0.92).map(|c| c.round() as u8)
}

/// Diverging colour at `position` of -1..1: blue, white, red.
pub(super) fn diverging(position: f64) -> String {
    hex(blend(&DIVERGING, f64::midpoint(position, 1.0)))
}

/// Diverging colour at `position` of -1..1 as red, green and blue.
pub(super) fn diverging_rgb(position: f64) -> [u8; 3] {
    blend(&DIVERGING, f64::midpoint(position, 1.0)).map(|c| c.round() as u8)
}

/// Ink that is readable on [`diverging`] at this position.
pub(super) fn ink_on_diverging(position: f64) -> &'static str {
    let [r, g, b] = blend(&DIVERGING, f64::midpoint(position, 1.0));
    if 0.299 * r + 0.587 * g + 0.114 * b > 140.0 { INK } else { "#ffffff" }
}

fn blend(stops: &[[f64; 3]], fraction: f64) -> [f64; 3] {
    let last = stops.len().saturating_sub(1);
    let place = if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 } * last as f64;
    let low = (place.floor() as usize).min(last);
    let (Some(a), Some(b)) = (stops.get(low), stops.get((low + 1).min(last))) else {
        return [0.0; 3];
    };
    let t = place - low as f64;
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

fn hex([r, g, b]: [f64; 3]) -> String {
    format!("#{:02x}{:02x}{:02x}", r.round() as u8, g.round() as u8, b.round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_is_white_and_the_ends_are_blue_and_red() {
        assert_eq!(diverging(0.0), "#f7f7f7");
        assert_eq!(diverging(-1.0), "#053061");
        assert_eq!(diverging(1.0), "#67001f");
        assert_eq!(diverging(7.0), diverging(1.0));
        assert_eq!(ink_on_diverging(0.0), INK);
        assert_eq!(ink_on_diverging(-1.0), "#ffffff");
    }

    #[test]
    fn not_a_number_is_still_a_colour() {
        assert!(sequential(f64::NAN).starts_with('#'));
        assert!(diverging(f64::NAN).starts_with('#'));
    }
}
