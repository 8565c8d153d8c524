//! Response of instruments to oscillations.

use std::f64::consts::{PI, TAU};

/// Instrument, as far as it changes the amplitude of what it measures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Running mean over this time, s; 0: none.
    pub mean_s: f64,
    /// Time constant of a first-order lag, s; 0: none.
    pub lag_s: f64,
    /// Squared gain by frequency, Hz, rising, as it was found by experiment; empty: 1. Held beyond its ends.
    pub gain2: Vec<(f64, f64)>,
}

impl Transfer {
    /// An instrument that follows everything.
    pub const NONE: Self = Self { mean_s: 0.0, lag_s: 0.0, gain2: Vec::new() };

    /// Share of the variance at a frequency (Hz) that is measured.
    pub fn power(&self, frequency_hz: f64) -> f64 {
        let mean = PI * frequency_hz * self.mean_s;
        let mean = if mean == 0.0 { 1.0 } else { (mean.sin() / mean).powi(2) };
        let lag = 1.0 / (1.0 + (TAU * frequency_hz * self.lag_s).powi(2));
        mean * lag * self.measured(frequency_hz)
    }

    fn measured(&self, frequency_hz: f64) -> f64 {
        let above = self.gain2.partition_point(|(at, _)| *at <= frequency_hz);
        match (above.checked_sub(1).and_then(|low| self.gain2.get(low)), self.gain2.get(above)) {
            (None, None) => 1.0,
            (Some((_, gain)), None) | (None, Some((_, gain))) => *gain,
            (Some((from, low)), Some((to, high))) => {
                low + (high - low) * (frequency_hz - from) / (to - from)
            }
        }
    }

    /// Highest frequency below `highest_hz` up to which at least `share` of the variance is measured.
    pub fn limit_hz(&self, share: f64, highest_hz: f64) -> f64 {
        const STEPS: usize = 400;
        let at = |step: usize| highest_hz * step as f64 / STEPS as f64;
        let fails = (1..=STEPS).find(|step| self.power(at(*step)) < share);
        fails.map_or(highest_hz, |step| at(step - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn responses_are_those_of_textbooks() {
        assert_eq!(Transfer::NONE.power(3.0), 1.0);
        let mean = Transfer { mean_s: 10.0, ..Transfer::NONE };
        assert_eq!(mean.power(0.0), 1.0);
        assert!(mean.power(0.1) < 1e-30, "one period");
        assert!((mean.power(0.05) - (2.0 / PI).powi(2)).abs() < 1e-12, "half a period");
        let lag = Transfer { lag_s: 1.0 / TAU, ..Transfer::NONE };
        assert!((lag.power(1.0) - 0.5).abs() < 1e-12, "half of the power at its corner");
        assert!((lag.limit_hz(0.5, 2.0) - 1.0).abs() < 0.01);
        let measured = Transfer { gain2: vec![(0.0, 1.0), (1.0, 0.5)], ..Transfer::NONE };
        assert!((measured.power(0.5) - 0.75).abs() < 1e-12 && measured.power(9.0) == 0.5);
    }
}
