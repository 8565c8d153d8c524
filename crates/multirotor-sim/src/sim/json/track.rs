//! The air that a body has met, second by second, as a truth file has it.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::sim::air::truth::{HALF_S, HEADER, RATE, row};
use skybrush_show::frame::ShowFrame;

/// Samples on either side of a row that its mean is taken from.
const HALF: usize = (RATE * HALF_S) as usize;
/// Samples from one row to the next.
const STEP: usize = RATE as usize;
/// No more than this is written down, s: a day.
const LONGEST_S: usize = 86_400;
/// Slack of a sample's time, s: the sum of frames is not exact.
const SLACK_S: f64 = 5e-7;

/// Where the body was, and how the air moved there: show frame, m and m/s.
#[derive(Clone, Copy, Debug)]
struct Sample {
    position_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
}

/// Track of the air along one flight. Of long flights only the last ten seconds are kept as samples.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    samples: VecDeque<Sample>,
    /// Number of the first sample that is kept.
    first: usize,
    /// Rows that are finished, and how many.
    rows: String,
    finished: usize,
}

impl Track {
    /// Takes note of the air at a time since the flight's beginning, s. Times go forward.
    pub(super) fn meet(
        &mut self,
        time_s: f64,
        position_m: Vector3<f64>,
        velocity_mps: Vector3<f64>,
        frame: &ShowFrame,
    ) {
        while self.finished < LONGEST_S
            && (self.first + self.samples.len()) as f64 / RATE as f64 <= time_s + SLACK_S
        {
            self.samples.push_back(Sample { position_m, velocity_mps });
            let centre = self.finished * STEP;
            if self.first + self.samples.len() > centre + HALF {
                let row = self.row(self.finished, frame).unwrap_or_default();
                self.rows.push_str(&row);
                self.finished += 1;
                // What lies before the next row's mean is over.
                let needed = (self.finished * STEP).saturating_sub(HALF);
                while self.first < needed && self.samples.pop_front().is_some() {
                    self.first += 1;
                }
            }
        }
    }

    /// The truth so far as CSV text; `None`: nothing was flown. The mean of the first and last seconds is
    /// that of the part of their ten seconds that was flown.
    pub(super) fn to_csv(&self, frame: &ShowFrame) -> Option<String> {
        if self.finished == 0 && self.samples.is_empty() {
            return None;
        }
        let rest: String =
            (self.finished..LONGEST_S).map_while(|second| self.row(second, frame)).collect();
        Some(format!("{HEADER}\n{}{rest}", self.rows))
    }

    /// The row of a second; `None`: it was not flown.
    fn row(&self, second: usize, frame: &ShowFrame) -> Option<String> {
        let centre = second * STEP;
        let at = |number: usize| self.samples.get(number.checked_sub(self.first)?);
        let here = at(centre)?;
        let last = (self.first + self.samples.len()).checked_sub(1)?.min(centre + HALF);
        let from = centre.saturating_sub(HALF).max(self.first);
        // By the trapezoid rule.
        let (mut sum, mut weight) = (0.0, 0.0);
        for number in from..=last {
            let share = if number == from || number == last { 0.5 } else { 1.0 };
            sum += share * at(number)?.velocity_mps.z;
            weight += share;
        }
        Some(row(second as i64, &here.position_m, here.velocity_mps, sum / weight, frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skybrush_show::frame::Geodetic;

    const FRAME: ShowFrame = ShowFrame {
        origin: Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 100.0 },
        orientation_deg: 0.0,
    };

    fn up(time_s: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, 0.1 * time_s)
    }

    fn rows(frames: u32, step_s: f64) -> Vec<Vec<f64>> {
        let mut track = Track::default();
        for frame in 0..frames {
            let time_s = f64::from(frame) * step_s;
            track.meet(time_s, Vector3::new(1.0, 2.0, time_s), up(time_s), &FRAME);
        }
        let text = track.to_csv(&FRAME).unwrap_or_default();
        let numbers = |line: &str| line.split(',').map(|value| value.parse().unwrap()).collect();
        text.lines().skip(1).map(numbers).collect()
    }

    #[test]
    fn every_second_has_a_row_with_the_mean_of_its_ten() {
        let rows = rows(3001, 0.01);
        assert_eq!(rows.len(), 31);
        for (second, row) in rows.iter().enumerate() {
            let time_s = second as f64;
            assert_eq!(row[..4], [time_s, 1.0, 2.0, time_s]);
            assert!((row[6] - 0.1 * time_s).abs() < 1e-9, "{row:?}");
            // At the ends, of what was flown of it.
            let middle_s = f64::midpoint((time_s - 5.0).max(0.0), (time_s + 5.0).min(30.0));
            assert!((row[7] - 0.1 * middle_s).abs() < 1e-4, "{row:?}");
        }
    }

    #[test]
    fn frames_of_any_length_and_no_frame_at_all_are_taken() {
        assert_eq!(rows(0, 0.01), Vec::<Vec<f64>>::new());
        assert_eq!(rows(1, 0.01).len(), 1);
        assert_eq!(rows(20, 1.0).len(), 20);
        assert_eq!(rows(40_000, 1.0 / 1200.0).len(), 34);
    }

    #[test]
    fn a_long_flight_keeps_ten_seconds_of_samples() {
        let mut track = Track::default();
        for second in 0..1000 {
            track.meet(f64::from(second), Vector3::zeros(), up(1.0), &FRAME);
            assert!(track.samples.len() <= 2 * HALF + STEP, "{}", track.samples.len());
        }
    }
}
