//! A number with its standard error.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An estimated value and its standard error, in the same unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Standard error (one sigma); 0 for a value that was held, not estimated.
    pub se: f64,
}

impl Estimate {
    /// An estimate from its value and standard error.
    pub fn new(value: f64, se: f64) -> Self {
        Self { value, se }
    }

    /// Decimals that the error supports (two significant digits of it); `None` without an error.
    pub fn decimals(&self) -> Option<usize> {
        (self.se > 0.0 && self.se.is_finite())
            .then(|| (1 - self.se.log10().floor() as i32).clamp(0, 9) as usize)
    }
}

/// Prints the value to the digit that its error supports (two significant digits of the error).
impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // What rounds to zero has no sign.
        let rounded = |decimals: usize| {
            let text = format!("{:.decimals$}", self.value);
            let is_zero = text.bytes().all(|byte| matches!(byte, b'-' | b'0' | b'.'));
            if is_zero { text.replacen('-', "", 1) } else { text }
        };
        match self.decimals() {
            Some(decimals) => write!(f, "{} ± {:.decimals$}", rounded(decimals), self.se),
            None => write!(f, "{}", rounded(3)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Estimate;

    #[test]
    fn prints_as_many_digits_as_the_error_supports() {
        assert_eq!(Estimate::new(8.2071, 0.0203).to_string(), "8.207 ± 0.020");
        assert_eq!(Estimate::new(1546.46, 7.81).to_string(), "1546.5 ± 7.8");
        assert_eq!(Estimate::new(1546.46, 42.0).to_string(), "1546 ± 42");
        assert_eq!(Estimate::new(0.5, 0.0).to_string(), "0.500");
        assert_eq!(Estimate::new(-0.003, 0.21).to_string(), "0.00 ± 0.21");
    }
}
