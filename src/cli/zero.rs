//! The stretch of a hover that sets the zero of a map, as arguments have it: `0..150s`.

use std::str::FromStr;

use crate::analysis::level::LEAST_ZERO_S;

/// How a stretch is written.
const FORM: &str = "write a stretch of the hover with its unit, for example 0..150s or 1..2.5min";

/// From and to, s of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ZeroStretch(pub [f64; 2]);

impl FromStr for ZeroStretch {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (from, to) = text.split_once("..").ok_or_else(|| FORM.to_owned())?;
        let (to, factor) = with_unit(to)?;
        // `0s..150s` says the same as `0..150s`.
        let (from, from_factor) = with_unit(from).unwrap_or((from, factor));
        let number = |text: &str, factor: f64| {
            let value: f64 = text.trim().parse().ok()?;
            (value.is_finite() && value >= 0.0).then_some(value * factor)
        };
        let (from_s, to_s) = number(from, from_factor)
            .zip(number(to, factor))
            .ok_or_else(|| format!("its ends are no times from 0 on: {FORM}"))?;
        if to_s < from_s {
            return Err(format!("it ends before it begins: turn it round, {to_s}..{from_s}s"));
        }
        if to_s - from_s < LEAST_ZERO_S {
            return Err(format!(
                "it lasts {} s, and the mean of the air over less than {LEAST_ZERO_S} s says nothing: give a longer \
                 stretch",
                to_s - from_s
            ));
        }
        Ok(Self([from_s, to_s]))
    }
}

/// A number's text and the seconds in its unit.
fn with_unit(text: &str) -> Result<(&str, f64), String> {
    let text = text.trim();
    let minutes = text.strip_suffix("min").map(|number| (number, 60.0));
    let found = minutes.or_else(|| text.strip_suffix('s').map(|number| (number, 1.0)));
    found.ok_or_else(|| format!("its unit is missing: {FORM}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_have_units() {
        let zero = |text: &str| text.parse::<ZeroStretch>().map(|zero| zero.0);
        assert_eq!(zero("0..150s"), Ok([0.0, 150.0]));
        assert_eq!(zero("0s..150 s"), Ok([0.0, 150.0]));
        assert_eq!(zero("1..2.5min"), Ok([60.0, 150.0]));
        assert_eq!(zero("30s..2min"), Ok([30.0, 120.0]));
        let told: Vec<String> =
            ["0..150", "150..0s", "0-150s", "0..12s", "a..9s", "-3..90s", "0..infs"]
                .map(|text| format!("{text}: {}", zero(text).unwrap_err()))
                .into();
        insta::assert_snapshot!(told.join("\n"));
    }
}
