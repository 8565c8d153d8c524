//! The clocks in a log: board time since boot, and GPS time.

use rand::Rng as _;

use crate::rng::{Purpose, stream};
use dataflash::time::{GpsTime, WEEK_MS};

/// Age of a GPS solution when its row is written, us. The firmware's logs show 18 to 36 ms.
const GPS_LATENCY_US: i64 = 25_000;
/// A receiver gives a solution every so many us.
const GPS_INTERVAL_US: i64 = 200_000;
/// Boot is between these before arming, us: a drone is switched on well before its show.
const BOOT_BEFORE_ARMING_US: (u64, u64) = (60_000_000, 180_000_000);

/// Board and GPS time of show times.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Board time of show time 0, us.
    offset_us: i64,
    /// GPS time of show time 0, ms since the GPS epoch.
    start_ms: i64,
}

impl Clock {
    /// The clocks of one drone that arms at a show time. When it was switched on is drawn from the seed
    /// unless it is known.
    pub(super) fn new(
        seed: u64,
        drone: u16,
        armed_us: i64,
        start: GpsTime,
        booted: Option<GpsTime>,
    ) -> Self {
        let start_ms = start.total_ms();
        if let Some(booted) = booted {
            let offset_us = (start_ms - booted.total_ms()).saturating_mul(1000);
            return Self { offset_us, start_ms };
        }
        let mut rng = stream(seed, u64::from(drone), Purpose::Spread);
        let (least, most) = BOOT_BEFORE_ARMING_US;
        let since_boot_us = least + rng.next_u64() % (most - least);
        Self { offset_us: since_boot_us as i64 - armed_us, start_ms }
    }

    /// Board time (TimeUS) of a show time, us.
    #[inline]
    pub(super) fn board_us(&self, show_us: i64) -> i64 {
        show_us + self.offset_us
    }

    /// Week and millisecond of the GPS solution that a row at this show time reports, if a step of
    /// `step_us` at it is the first one to have it.
    #[inline]
    pub(super) fn fix(&self, show_us: i64, step_us: i64) -> Option<(i64, i64)> {
        let now_us = self.start_ms * 1000 + show_us - GPS_LATENCY_US;
        let age_us = now_us.rem_euclid(GPS_INTERVAL_US);
        let total_ms = (now_us - age_us) / 1000;
        let week_ms = WEEK_MS as i64;
        (age_us < step_us).then(|| (total_ms.div_euclid(week_ms), total_ms.rem_euclid(week_ms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_five_fixes_a_second_also_over_the_end_of_a_week() {
        let start = GpsTime { week: 2445, tow_ms: 604_798_001 };
        let clock = Clock::new(1, 1, -8_000_000, start, None);
        let fixes: Vec<_> =
            (0..1600).filter_map(|step| clock.fix(i64::from(step) * 2_500, 2_500)).collect();
        assert_eq!(fixes.len(), 20);
        assert_eq!(fixes[0], (2445, 604_798_000));
        assert_eq!(fixes[10], (2446, 0));
        assert!(fixes.iter().all(|(_, ms)| ms % 200 == 0));
    }

    #[test]
    fn boots_differ_between_drones() {
        let start = GpsTime { week: 2445, tow_ms: 0 };
        let boot = |drone| Clock::new(1, drone, 0, start, None).board_us(0);
        assert_ne!(boot(1), boot(2));
        assert!(boot(1) >= 60_000_000);
    }

    #[test]
    fn a_boot_that_is_known_is_board_time_0() {
        let start = GpsTime { week: 2445, tow_ms: 30_000 };
        let booted = GpsTime { week: 2444, tow_ms: WEEK_MS as u32 - 1_500 };
        let clock = Clock::new(1, 1, -8_000_000, start, Some(booted));
        assert_eq!(clock.board_us(0), 31_500_000);
    }
}
