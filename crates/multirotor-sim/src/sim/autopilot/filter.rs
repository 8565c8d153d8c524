//! First-order low-pass filter.

/// A first-order low-pass filter at a fixed rate.
#[derive(Clone, Copy, Debug)]
pub struct LowPass {
    /// Shares of a sample and of the output before in the output. Two products side by side are
    /// done earlier than one after a difference, and a control step waits for filters in a row.
    usual: (f64, f64),
    /// Shares for the next sample: 1 and 0 if it is to pass unfiltered.
    share: (f64, f64),
    /// Present output of the filter, in the unit of its input.
    pub value: f64,
}

impl LowPass {
    /// A filter with this cut-off frequency, for steps of `dt_s`, starting at 0.
    pub fn new(cutoff_hz: f64, dt_s: f64) -> Self {
        let constant_s = 1.0 / (std::f64::consts::TAU * cutoff_hz);
        let alpha = dt_s / (dt_s + constant_s);
        let usual = (alpha, 1.0 - alpha);
        Self { usual, share: usual, value: 0.0 }
    }

    /// Lets the next sample through as it is.
    pub fn reset(&mut self) {
        self.share = (1.0, 0.0);
    }

    /// Takes one sample and returns the filtered value.
    #[inline]
    pub fn apply(&mut self, sample: f64) -> f64 {
        let (new, old) = self.share;
        self.value = new * sample + old * self.value;
        self.share = self.usual;
        self.value
    }
}
