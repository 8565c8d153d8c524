//! GPS clock of a vehicle, as seen from the station.
//!
//! SYSTEM_TIME says what the vehicle's clock showed when it was sent; it arrives later. Of
//! several, the one that travelled fastest is nearest to the truth, so that the clock read here
//! is behind by the shortest delay of the link, never ahead. Simulators run faster than real
//! time: the rate is measured, and is exactly 1 for anything that runs in real time.

use std::collections::VecDeque;

use crate::link::clock::Micros;
use dataflash::time::{GPS_EPOCH_UNIX_S, GpsTime};

/// Number of readings that are kept.
const KEEP: usize = 16;
/// A measured rate nearer to 1 than this is 1: link delays move it that much.
const REAL_TIME_WITHIN: f64 = 0.15;
/// The time between the first and the last reading from which a rate is measured, us.
const RATE_FROM: Micros = 2_500_000;
/// A reading that is off by more means that the clock was set; older ones are forgotten.
const JUMP_US: f64 = 60e6;
/// Readings that come faster than this replace each other: a fast simulator's would else span too
/// little time to measure its rate, us.
const APART: Micros = 200_000;

/// Clock of a vehicle, from readings that arrive late.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleClock {
    /// Link time of arrival, and the vehicle's Unix time, us.
    readings: VecDeque<(Micros, u64)>,
    /// Time since the vehicle was switched on, ms, and its Unix time then, us.
    board: Option<(u32, u64)>,
}

/// A board time that is older or newer than the last reading by more is of another boot, ms.
const SAME_BOOT_MS: std::ops::RangeInclusive<i64> = -5_000..=120_000;

impl VehicleClock {
    /// Takes a reading at link time `now`. Times before GPS existed (the vehicle has no GPS time
    /// yet) are ignored.
    pub fn read(&mut self, now: Micros, unix_us: u64) {
        if unix_us / 1_000_000 < GPS_EPOCH_UNIX_S as u64 {
            return;
        }
        if let Some((_, last)) = self.readings.back()
            && unix_us <= *last
        {
            // Repeated or reordered; a clock that was set back is started over.
            if *last - unix_us > JUMP_US as u64 {
                self.readings.clear();
            } else {
                return;
            }
        }
        if let Some(expected) = self.unix_us(now)
            && (expected - unix_us as f64).abs() > JUMP_US * self.rate()
        {
            self.readings.clear();
        }
        if let [.., before, last] = self.readings.make_contiguous()
            && last.0 - before.0 < APART
        {
            *last = (now, unix_us);
            return;
        }
        self.readings.push_back((now, unix_us));
        if self.readings.len() > KEEP {
            self.readings.pop_front();
        }
    }

    /// Takes the board's time and the clock's time from one message.
    pub fn read_board(&mut self, boot_ms: u32, unix_us: u64) {
        if unix_us / 1_000_000 >= GPS_EPOCH_UNIX_S as u64 {
            self.board = Some((boot_ms, unix_us));
        }
    }

    /// GPS time at a time of the board, ms since the GPS epoch, whenever the message that names it
    /// arrives; `None` if the clock was not read since the vehicle was switched on.
    pub fn gps_ms_on_board(&self, boot_ms: u32) -> Option<f64> {
        let (read_ms, unix_us) = self.board?;
        let since_ms = i64::from(boot_ms) - i64::from(read_ms);
        if !SAME_BOOT_MS.contains(&since_ms) {
            return None;
        }
        let unix_ms = i64::try_from(unix_us / 1000).ok()?.checked_add(since_ms)?;
        Some(GpsTime::from_unix_ms(unix_ms)?.total_ms() as f64)
    }

    /// Rate of the vehicle's clock, seconds per second of the station; 1 until it is measured.
    pub fn rate(&self) -> f64 {
        let (Some(first), Some(last)) = (self.readings.front(), self.readings.back()) else {
            return 1.0;
        };
        if last.0 - first.0 < RATE_FROM {
            return 1.0;
        }
        let rate = (last.1 - first.1) as f64 / (last.0 - first.0) as f64;
        if (rate - 1.0).abs() < REAL_TIME_WITHIN { 1.0 } else { rate }
    }

    fn unix_us(&self, now: Micros) -> Option<f64> {
        let rate = self.rate();
        let ahead = |(at, unix): &(Micros, u64)| *unix as f64 + (now as f64 - *at as f64) * rate;
        if rate != 1.0 {
            // A simulator's rate is not constant: the latest reading is the nearest.
            return self.readings.back().map(ahead);
        }
        self.readings.iter().map(ahead).reduce(f64::max)
    }

    /// GPS time on the vehicle now, ms since the GPS epoch; `None` if the clock was never read.
    pub fn gps_ms(&self, now: Micros) -> Option<f64> {
        let unix_us = self.unix_us(now)?;
        let whole = GpsTime::from_unix_ms((unix_us / 1000.0) as i64)?;
        Some(whole.total_ms() as f64 + (unix_us / 1000.0).fract())
    }

    /// Link time at which the vehicle's clock shows a GPS time, us; may lie in the past.
    pub fn link_time(&self, now: Micros, gps_ms: f64) -> Option<Micros> {
        let ahead_us = (gps_ms - self.gps_ms(now)?) * 1000.0 / self.rate();
        Some((now as f64 + ahead_us).max(0.0) as Micros)
    }

    /// Age of the last reading, us.
    pub fn age(&self, now: Micros) -> Option<Micros> {
        self.readings.back().map(|(at, _)| now.saturating_sub(*at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIX_US: u64 = 1_795_143_537_000_000;

    #[test]
    fn the_fastest_reading_counts() {
        let mut clock = VehicleClock::default();
        assert_eq!(clock.gps_ms(0), None);
        for (sent_s, delay) in [(0, 400_000), (1, 200_000), (2, 900_000), (4, 250_000)] {
            clock.read(sent_s * 1_000_000 + delay, UNIX_US + sent_s * 1_000_000);
        }
        let wanted = GpsTime::from_unix_ms((UNIX_US / 1000) as i64 + 10_000).unwrap().total_ms();
        let off_ms = clock.gps_ms(10_000_000).unwrap() - wanted as f64;
        assert!((off_ms + 200.0).abs() < 1.0, "{off_ms}");
        assert_eq!(clock.rate(), 1.0);
    }

    #[test]
    fn a_simulator_may_run_faster() {
        let mut clock = VehicleClock::default();
        for second in 0..10 {
            clock.read(second * 100_000, UNIX_US + second * 1_000_000);
        }
        // Too short to tell; then long enough.
        assert_eq!(clock.rate(), 1.0);
        for second in 10..400 {
            clock.read(second * 100_000, UNIX_US + second * 1_000_000);
        }
        assert!((clock.rate() - 10.0).abs() < 1e-9);
        let gps = clock.gps_ms(40_000_000).unwrap();
        assert_eq!(clock.link_time(39_000_000, gps), Some(40_000_000));
    }

    #[test]
    fn a_clock_without_gps_says_nothing_and_one_that_is_set_starts_over() {
        let mut clock = VehicleClock::default();
        clock.read(5, 7_000_000);
        assert_eq!(clock.gps_ms(5), None);
        clock.read(1_000_000, UNIX_US - 3_600_000_000);
        clock.read(2_000_000, UNIX_US);
        let wanted = GpsTime::from_unix_ms((UNIX_US / 1000) as i64).unwrap().total_ms();
        assert_eq!(clock.gps_ms(2_000_000), Some(wanted as f64));
    }
}
