//! Queries of one channel.

use super::Series;

impl Series {
    /// Number of samples in the series.
    pub fn len(&self) -> usize {
        self.time_s.len().min(self.value.len())
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Indices of the samples with `start_s <= time < end_s`.
    pub fn range(&self, start_s: f64, end_s: f64) -> std::ops::Range<usize> {
        let times = self.time_s.get(..self.len()).unwrap_or_default();
        let from = times.partition_point(|time| *time < start_s);
        let to = times.partition_point(|time| *time < end_s);
        from..to.max(from)
    }

    /// Values with `start_s <= time < end_s`.
    pub fn between(&self, start_s: f64, end_s: f64) -> &[f64] {
        self.value.get(self.range(start_s, end_s)).unwrap_or_default()
    }

    /// Times of the samples with `start_s <= time < end_s`.
    pub fn times_between(&self, start_s: f64, end_s: f64) -> &[f64] {
        self.time_s.get(self.range(start_s, end_s)).unwrap_or_default()
    }

    /// First and last time, s.
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((*self.time_s.first()?, *self.time_s.last()?))
    }

    /// Value at a time by linear interpolation; `None` outside the samples or across a gap longer
    /// than `max_gap_s`.
    pub fn at(&self, time_s: f64, max_gap_s: f64) -> Option<f64> {
        let after = self.time_s.partition_point(|time| *time < time_s);
        let (right, right_value) = (*self.time_s.get(after)?, *self.value.get(after)?);
        if right == time_s {
            return Some(right_value);
        }
        let before = after.checked_sub(1)?;
        let (left, left_value) = (*self.time_s.get(before)?, *self.value.get(before)?);
        if right - left > max_gap_s {
            return None;
        }
        Some(left_value + (right_value - left_value) * (time_s - left) / (right - left))
    }

    /// Value in force at a time: that of the last sample not after it, unless older than
    /// `max_age_s`.
    pub fn latest(&self, time_s: f64, max_age_s: f64) -> Option<f64> {
        let before = self.time_s.partition_point(|time| *time <= time_s).checked_sub(1)?;
        (time_s - *self.time_s.get(before)? <= max_age_s)
            .then(|| self.value.get(before).copied())?
    }

    /// Longest time without a sample between two times, s, the ends included.
    pub fn longest_gap_s(&self, start_s: f64, end_s: f64) -> f64 {
        let mut last = start_s;
        let mut longest: f64 = 0.0;
        for time in self.times_between(start_s, end_s) {
            longest = longest.max(time - last);
            last = *time;
        }
        longest.max(end_s - last)
    }
}

#[cfg(test)]
mod tests {
    use super::Series;

    fn ramp() -> Series {
        Series { time_s: vec![0.0, 1.0, 2.0, 5.0], value: vec![0.0, 10.0, 20.0, 50.0] }
    }

    #[test]
    fn windows_include_their_start_and_exclude_their_end() {
        assert_eq!(ramp().between(1.0, 2.0), &[10.0]);
        assert_eq!(ramp().between(1.0, 2.1), &[10.0, 20.0]);
        assert_eq!(ramp().between(6.0, 1.0), &[] as &[f64]);
    }

    #[test]
    fn interpolates_inside_and_not_across_gaps() {
        assert_eq!(ramp().at(0.5, 1.0), Some(5.0));
        assert_eq!(ramp().at(5.0, 1.0), Some(50.0));
        assert_eq!(ramp().at(3.0, 1.0), None);
        assert_eq!(ramp().at(3.0, 10.0), Some(30.0));
        assert_eq!(ramp().at(-1.0, 10.0), None);
        assert_eq!(ramp().at(5.1, 10.0), None);
    }

    #[test]
    fn gaps_count_from_the_ends() {
        assert_eq!(ramp().longest_gap_s(0.0, 2.5), 1.0);
        assert_eq!(ramp().longest_gap_s(0.0, 5.5), 3.0);
        assert_eq!(ramp().longest_gap_s(-4.0, 1.0), 4.0);
    }
}
