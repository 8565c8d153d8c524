//! First-order low-pass.

/// A first-order low-pass filter at a fixed rate.
#[derive(Clone, Copy, Debug)]
pub struct LowPass {
    alpha: f64,
    /// Present output.
    pub value: f64,
    fresh: bool,
}

impl LowPass {
    /// A filter with this cut-off, for steps of `dt_s`, starting at 0.
    pub fn new(cutoff_hz: f64, dt_s: f64) -> Self {
        let constant_s = 1.0 / (std::f64::consts::TAU * cutoff_hz);
        Self { alpha: dt_s / (dt_s + constant_s), value: 0.0, fresh: false }
    }

    /// Lets the next sample through as it is.
    pub fn reset(&mut self) {
        self.fresh = true;
    }

    /// Takes one sample and gives the filtered value.
    pub fn apply(&mut self, sample: f64) -> f64 {
        let alpha = if self.fresh { 1.0 } else { self.alpha };
        self.fresh = false;
        self.value += alpha * (sample - self.value);
        self.value
    }
}
