//! Numbers, symbols and foreign text as people read them.

use crate::analysis::law::Symbol;
use crate::analysis::result::Rejection;
use crate::analysis::table::Quantity;
use crate::base::estimate::Estimate;
use crate::base::layout;
use crate::base::plain::plain;
use crate::flight::Indicator;
use crate::mission::plan::{Purpose, SegmentKind};

/// Shown instead of a number that does not exist.
pub(super) const NONE: &str = "–";

/// Largest magnitude that the report draws or prints in full; beyond it a number is nonsense.
const LARGEST: f64 = 1e7;

/// Whether a number can be drawn.
pub(super) fn usable(value: f64) -> bool {
    value.is_finite() && value.abs() < LARGEST
}

/// Text from outside as [`plain`] text: no output may pass on what drives terminals, turns the order
/// of what is read, or is not allowed in XML.
pub(super) fn clean(text: &str) -> String {
    plain(text).into_owned()
}

/// Width of files and pipes, columns: tables are whole there, and prose is as wide as on a terminal.
pub const NO_EDGE: usize = 10_000;
/// Widest line of prose where there is no edge, columns.
const WIDEST_PROSE: usize = 100;

/// Width at which prose is broken.
pub(super) fn prose_width(width: usize) -> usize {
    if width >= NO_EDGE { WIDEST_PROSE } else { width }
}

/// [`clean`] cut to `limit` columns of a terminal with an ellipsis.
pub(super) fn shortened(text: &str, limit: usize) -> String {
    let text = clean(text);
    if layout::columns(&text) <= limit {
        return text;
    }
    format!("{}…", layout::beginning(&text, limit.saturating_sub(1)).trim_end())
}

/// A file name part of lower-case letters, digits and hyphens; never empty, never a path.
pub(super) fn slug(text: &str) -> String {
    let mut slug = String::new();
    for c in text.chars().take(60) {
        if c.is_ascii_alphanumeric() {
            slug.push(c.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() { "unnamed".to_owned() } else { slug.to_owned() }
}

/// A share as per cent with one decimal.
pub(super) fn share(of: Option<f64>) -> String {
    of.map_or_else(|| NONE.to_owned(), |of| fixed(100.0 * of, 1))
}

/// A number with a true minus sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "not a number".to_owned();
    }
    if value.abs() >= LARGEST {
        return minus(&format!("{value:.2e}"));
    }
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.'));
    minus(if zero { text.trim_start_matches('-') } else { &text })
}

/// Like [`fixed`], with a plus sign.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if value > 0.0 && value.is_finite() && text.chars().any(|c| matches!(c, '1'..='9')) {
        format!("+{text}")
    } else {
        text
    }
}

/// Stands for an error that is not known.
const UNKNOWN: &str = "unknown";

/// A value to the digit that its error supports, and the error, if there is one; either says so when it
/// is not a number.
fn value_and_error(of: Estimate) -> (String, Option<String>) {
    if !usable(of.value) {
        return (fixed(of.value, 2), None);
    }
    if !usable(of.se) {
        return (fixed(of.value, 3), Some(UNKNOWN.to_owned()));
    }
    // An error in the last bits of a double is none.
    let negligible = of.se < 1e-9 * of.value.abs();
    match of.decimals().filter(|_| !negligible) {
        Some(decimals) => (fixed(of.value, decimals), Some(format!("{:.decimals$}", of.se))),
        None => (fixed(of.value, 3), None),
    }
}

/// A value with its error; says so when either is not a number.
pub(super) fn estimate(estimate: Estimate) -> String {
    match value_and_error(estimate) {
        (value, Some(error)) => format!("{value} ± {error}"),
        (value, None) => value,
    }
}

/// Decimals that an estimate is told with.
pub(super) fn decimal_places(of: Estimate) -> usize {
    of.decimals().map_or(3, |decimals| decimals.min(4))
}

/// [`estimate`] with a plus sign for what is above zero.
pub(super) fn signed_estimate(of: Estimate) -> String {
    if !usable(of.value) {
        return fixed(of.value, 2);
    }
    let decimals = decimal_places(of);
    let error = if usable(of.se) { fixed(of.se, decimals) } else { UNKNOWN.to_owned() };
    format!("{} ± {error}", signed(of.value, decimals))
}

/// A p-value: never smaller than what is printed of it.
pub(super) fn p_value(p: f64) -> String {
    if p < 0.01 { "p < 0.01".to_owned() } else { format!("p = {}", fixed(p, 2)) }
}

/// A value without its error, to the digit that the error supports.
pub(super) fn value_of(of: Estimate) -> String {
    value_and_error(of).0
}

/// The error of a value alone; `unknown` without one.
pub(super) fn error_of(of: Estimate) -> String {
    value_and_error(of).1.unwrap_or_else(|| UNKNOWN.to_owned())
}

fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// A reduced chi²: decimals only where they mean something.
pub(super) fn reduced(chi2: f64) -> String {
    fixed(chi2, if chi2.abs() < 100.0 { 2 } else { 0 })
}

/// Units with the Greek letter.
pub(super) fn unit(unit: &str) -> String {
    let unit = clean(unit);
    match unit.strip_prefix("us") {
        Some(rest) => format!("µs{rest}"),
        None => unit,
    }
}

/// What stands for rotor effort, in words.
pub(super) fn effort_name(indicator: Indicator) -> &'static str {
    match indicator {
        Indicator::Pulse => "pulse width",
        Indicator::RotorSpeed => "rotor speed",
        Indicator::Power => "electrical power",
    }
}

/// Axis label of rotor effort: `tilt-corrected pulse width uφ (µs)`.
pub(super) fn effort_label(indicator: Indicator) -> String {
    let name = match indicator {
        Indicator::Pulse => "tilt-corrected pulse width",
        Indicator::RotorSpeed => "tilt-corrected rotor speed",
        Indicator::Power => "tilt-corrected power",
    };
    format!("{name} uφ ({})", unit(indicator.unit()))
}

/// The report's symbol of a parameter.
pub(super) fn symbol(symbol: Symbol) -> &'static str {
    match symbol {
        Symbol::A => "A",
        Symbol::Slope => "A′",
        Symbol::U0 => "u₀",
        Symbol::W => "W*",
    }
}

/// The report's symbol of what a row of a table is about.
pub(super) fn quantity(of: Quantity) -> &'static str {
    match of {
        Quantity::Parameter(parameter) => symbol(parameter),
        Quantity::ReducedChi2 => "χ²/ν",
        Quantity::AddedScatter => "scatter",
    }
}

/// What a flight was for, in words.
pub(super) fn purpose(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Calibration => "calibration",
        Purpose::Measurement => "measurement",
    }
}

/// Kind of a window, in words.
pub(super) fn kind(kind: SegmentKind) -> &'static str {
    match kind {
        SegmentKind::Wait => "wait",
        SegmentKind::Takeoff => "take-off",
        SegmentKind::Climb => "climb",
        SegmentKind::Descend => "descend",
        SegmentKind::LegUp => "up",
        SegmentKind::LegDown => "down",
        SegmentKind::Hover => "hover",
        SegmentKind::Horizontal => "horizontal",
        SegmentKind::Ramp => "ramp",
        SegmentKind::Landing => "landing",
    }
}

/// Why a window was rejected, in words.
pub(super) fn rejection(rejection: Rejection) -> &'static str {
    match rejection {
        Rejection::Saturated => "saturated",
        Rejection::NotFollowing => "not following",
        Rejection::Gap => "gap in the log",
        Rejection::Incomplete => "log ends early",
        Rejection::Manoeuvre => "moving up and down",
    }
}

/// Foreign words as a sentence: a capital first letter and a full stop.
pub(super) fn sentence(text: &str) -> String {
    let text = clean(text.trim());
    let mut letters = text.chars();
    let Some(first) = letters.next() else { return text };
    let body: String = first.to_uppercase().chain(letters).collect();
    if body.ends_with(['.', '!', '?']) { body } else { format!("{body}.") }
}

/// Plural by count: `1 drone`, `3 drones`.
pub(super) fn count(n: usize, noun: &str) -> String {
    if n == 1 { format!("1 {noun}") } else { format!("{n} {noun}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slug_is_never_a_path() {
        assert_eq!(slug("../../etc/passwd"), "etc-passwd");
        assert_eq!(slug("<script>"), "script");
        assert_eq!(slug("ő/.."), "unnamed");
        assert_eq!(slug("Drone 07"), "drone-07");
    }

    #[test]
    fn control_characters_do_not_pass() {
        assert_eq!(clean("a\u{1b}[31mb\0"), "a␛[31mb␀");
        assert_eq!(shortened("abcdef", 4), "abc…");
    }

    #[test]
    fn numbers_have_a_true_minus_and_no_negative_zero() {
        assert_eq!(fixed(-0.051, 2), "−0.05");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(signed(0.25, 2), "+0.25");
        assert_eq!(signed(0.001, 2), "0.00");
        assert_eq!(fixed(f64::NAN, 2), "not a number");
        assert_eq!(fixed(1e300, 2), "1.00e300");
    }

    #[test]
    fn a_p_value_is_never_zero() {
        assert_eq!(
            [0.0, 0.004, 0.01, 0.199].map(p_value),
            ["p < 0.01", "p < 0.01", "p = 0.01", "p = 0.20"]
        );
    }

    #[test]
    fn signs_do_not_stand_before_zero() {
        let words = |value, se| signed_estimate(Estimate::new(value, se));
        assert_eq!(words(2.8261, 0.231), "+2.83 ± 0.23");
        assert_eq!(words(-0.0004, 0.23), "0.00 ± 0.23");
        assert_eq!(words(-0.15, f64::NAN), "−0.150 ± unknown");
    }

    #[test]
    fn an_unknown_error_is_called_unknown() {
        assert_eq!(estimate(Estimate::new(8.1, f64::INFINITY)), "8.100 ± unknown");
        assert_eq!(estimate(Estimate::new(f64::NAN, 0.1)), "not a number");
        assert_eq!(estimate(Estimate::new(-0.0589, 0.0031)), "−0.0589 ± 0.0031");
        assert_eq!(value_of(Estimate::new(-0.0589, 0.0031)), "−0.0589");
        assert_eq!(error_of(Estimate::new(-0.0589, 0.0031)), "0.0031");
        assert_eq!(error_of(Estimate::new(8.1, f64::INFINITY)), "unknown");
        assert_eq!(error_of(Estimate::new(8.1, 0.0)), "unknown");
        assert_eq!(estimate(Estimate::new(-8.1, 1e-12)), "−8.100", "the last bits of a double");
    }
}
