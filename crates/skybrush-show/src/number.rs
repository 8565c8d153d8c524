//! Numbers as short decimals.

use std::fmt::Write as _;

/// Appends milliseconds as seconds, exactly.
pub(crate) fn push_ms(text: &mut String, ms: u64) {
    push_scaled(text, false, ms, 3);
}

/// Appends a length in metres: to the millimetre if it is a whole number of them (within 1 nm), else
/// to 0.1 µm. The caller has checked that it is finite and below 1e9.
pub(crate) fn push_m(text: &mut String, value_m: f64) {
    let magnitude = value_m.abs();
    let mm = (magnitude * 1e3).round();
    if (mm / 1e3 - magnitude).abs() < 1e-9 {
        push_scaled(text, value_m < 0.0, mm as u64, 3);
    } else {
        push_scaled(text, value_m < 0.0, (magnitude * 1e7).round() as u64, 7);
    }
}

/// Appends `units` divided by 10 to the power of `decimals`, without trailing zeros.
fn push_scaled(text: &mut String, negative: bool, units: u64, decimals: u32) {
    if negative && units != 0 {
        text.push('-');
    }
    let one = 10_u64.pow(decimals);
    // Writing to a String does not fail.
    let _ = write!(text, "{}", units / one);
    let mut rest = units % one;
    if rest == 0 {
        return;
    }
    let mut width = decimals as usize;
    while rest.is_multiple_of(10) {
        rest /= 10;
        width -= 1;
    }
    let _ = write!(text, ".{rest:0width$}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn m(value: f64) -> String {
        let mut text = String::new();
        push_m(&mut text, value);
        text
    }

    #[test]
    fn are_short_and_exact() {
        assert_eq!(m(0.0), "0");
        assert_eq!(m(-0.0), "0");
        assert_eq!(m(12.5), "12.5");
        assert_eq!(m(-0.007), "-0.007");
        assert_eq!(m(0.1 + 0.2), "0.3");
        assert_eq!(m(1.0 / 3.0), "0.3333333");
        assert_eq!(m(-1e-9), "0");
        let mut text = String::new();
        push_ms(&mut text, 10_020);
        assert_eq!(text, "10.02");
    }

    proptest! {
        #[test]
        fn read_back_within_a_micrometre(value in -1e5..1e5_f64) {
            prop_assert!((m(value).parse::<f64>().unwrap() - value).abs() <= 1e-7);
        }
    }
}
