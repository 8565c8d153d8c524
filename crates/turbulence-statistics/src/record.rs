//! A quantity at even steps of time, with gaps.

/// Values at even steps of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    step_s: f64,
    /// NaN where there is none.
    values: Vec<f64>,
}

impl Record {
    /// A record with this time between its values, s; values that are absent or not finite are gaps.
    ///
    /// # Panics
    ///
    /// If the step is not positive.
    pub fn new(step_s: f64, values: impl IntoIterator<Item = Option<f64>>) -> Self {
        assert!(step_s > 0.0, "a record's step is a time");
        let value =
            |value: Option<f64>| value.filter(|value| value.is_finite()).unwrap_or(f64::NAN);
        Self { step_s, values: values.into_iter().map(value).collect() }
    }

    /// Time between values, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Number of steps, gaps included.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there is no step at all.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Value of each step; NaN in gaps.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Values that are known.
    pub fn known(&self) -> impl Iterator<Item = f64> + Clone {
        self.values.iter().copied().filter(|value| !value.is_nan())
    }

    /// Number of values that are known.
    pub fn count(&self) -> usize {
        self.known().count()
    }

    /// Mean of the known values; `None` of none.
    pub fn mean(&self) -> Option<f64> {
        let count = self.count();
        (count > 0).then(|| self.known().sum::<f64>() / count as f64)
    }

    /// The record less its mean.
    #[must_use]
    pub fn anomalies(&self) -> Self {
        let mean = self.mean().unwrap_or(0.0);
        Self { step_s: self.step_s, values: self.values.iter().map(|value| value - mean).collect() }
    }

    /// Stretches without a gap.
    pub fn stretches(&self) -> impl Iterator<Item = &[f64]> {
        self.values.split(|value| value.is_nan()).filter(|stretch| !stretch.is_empty())
    }
}
