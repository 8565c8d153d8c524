//! GPS time, the clock that all drones share.
//!
//! GPS time has no leap seconds, Unix time leaves them out: what lies between is the table of leap seconds,
//! which is `hifitime`'s. The last one it knows of came at the end of 2016 (18 s); the IERS has announced
//! none since. Should there be another one, times after it are a second off until `hifitime` is updated:
//! only conversions from and to Unix time are, GPS times among themselves never.

use std::fmt;
use std::sync::LazyLock;

use hifitime::leap_seconds::LatestLeapSeconds;
use hifitime::{Duration, Epoch, Unit};

#[cfg(feature = "schemars")]
use schemars::JsonSchema;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Seconds in a GPS week.
pub const WEEK_S: u32 = 604_800;
/// Milliseconds in a GPS week.
pub const WEEK_MS: u64 = 604_800_000;
/// Unix time of the GPS epoch, 1980-01-06 00:00:00 UTC, s.
pub const GPS_EPOCH_UNIX_S: i64 = 315_964_800;

/// An instant on the GPS time scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "schemars", derive(JsonSchema))]
pub struct GpsTime {
    /// Full GPS week number (no rollover).
    pub week: u16,
    /// Milliseconds into the week.
    pub tow_ms: u32,
}

/// Unix time from which on the last known leap second is over, ms, and what GPS time is ahead of Unix time from then on,
/// ms. Nearly all times that are converted are later, and thousands of drones' clocks are read every second.
static LAST_LEAP: LazyLock<(i64, i64)> = LazyLock::new(|| {
    let last_s = LatestLeapSeconds::default().next_back().map_or(0.0, |last| last.timestamp_tai_s);
    let at = Epoch::from_tai_seconds(last_s).to_unix_duration() + Unit::Day * 1;
    let ahead = Epoch::from_unix_duration(at).to_gpst_duration() - at;
    (ms(at), ms(ahead))
});

impl GpsTime {
    /// Milliseconds since the GPS epoch.
    pub fn total_ms(self) -> i64 {
        i64::from(self.week) * WEEK_MS as i64 + i64::from(self.tow_ms)
    }

    /// GPS time from milliseconds since the GPS epoch; `None` before the epoch or after week 65535.
    pub fn from_total_ms(total_ms: i64) -> Option<Self> {
        let total = u64::try_from(total_ms).ok()?;
        let week = u16::try_from(total / WEEK_MS).ok()?;
        Some(Self { week, tow_ms: (total % WEEK_MS) as u32 })
    }

    /// GPS time from Unix time in milliseconds, with the leap seconds of its date; `None`
    /// outside weeks 0 to 65535. No Unix time stands for the instants of a leap second itself.
    pub fn from_unix_ms(unix_ms: i64) -> Option<Self> {
        let (since_ms, ahead_ms) = *LAST_LEAP;
        if unix_ms >= since_ms {
            return Self::from_total_ms(unix_ms.checked_add(ahead_ms)?);
        }
        Self::from_total_ms(ms(
            Epoch::from_unix_duration(Unit::Millisecond * unix_ms).to_gpst_duration()
        ))
    }

    /// Unix time in milliseconds, with the leap seconds of its date.
    pub fn to_unix_ms(self) -> i64 {
        let (since_ms, ahead_ms) = *LAST_LEAP;
        let unix_ms = self.total_ms() - ahead_ms;
        if unix_ms >= since_ms {
            return unix_ms;
        }
        let unix =
            Epoch::from_gpst_duration(Unit::Millisecond * self.total_ms()).to_unix_duration();
        let unix_ms = ms(unix);
        // hifitime 4.3 counts a leap second on the way back some seconds before it comes: the time that
        // leads here is right.
        let later_ms = unix_ms + 1000;
        if Self::from_unix_ms(later_ms) == Some(self) { later_ms } else { unix_ms }
    }
}

/// Whole milliseconds.
fn ms(duration: Duration) -> i64 {
    // A duration holds 66 thousand centuries at most, which is 2e14 ms.
    duration.total_nanoseconds().div_euclid(1_000_000) as i64
}

impl fmt::Display for GpsTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "GPS week {} + {:.3} s", self.week, f64::from(self.tow_ms) / 1000.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{GPS_EPOCH_UNIX_S, GpsTime};

    /// First Unix second from which so many leap seconds separate GPS time and UTC (IERS Bulletin C).
    const LEAPS: [(i64, i64); 19] = [
        (315_964_800, 0),
        (362_793_600, 1),
        (394_329_600, 2),
        (425_865_600, 3),
        (489_024_000, 4),
        (567_993_600, 5),
        (631_152_000, 6),
        (662_688_000, 7),
        (709_948_800, 8),
        (741_484_800, 9),
        (773_020_800, 10),
        (820_454_400, 11),
        (867_715_200, 12),
        (915_148_800, 13),
        (1_136_073_600, 14),
        (1_230_768_000, 15),
        (1_341_100_800, 16),
        (1_435_708_800, 17),
        (1_483_228_800, 18),
    ];

    fn leap_s(unix_s: i64) -> i64 {
        LEAPS.iter().rev().find(|(from_s, _)| unix_s >= *from_s).unwrap().1
    }

    #[test]
    fn every_day_has_its_leap_seconds() {
        // To the year 2105, and the minutes around each leap second.
        let days = (0..46_000).map(|day| GPS_EPOCH_UNIX_S + 86_400 * day + 43_200);
        let around = LEAPS.iter().flat_map(|(from_s, _)| from_s - 60..from_s + 60);
        for unix_s in days.chain(around).filter(|unix_s| *unix_s >= GPS_EPOCH_UNIX_S) {
            let time = GpsTime::from_unix_ms(unix_s * 1000 + 250).unwrap();
            assert_eq!(time.total_ms(), (unix_s - GPS_EPOCH_UNIX_S + leap_s(unix_s)) * 1000 + 250);
            assert_eq!(time.to_unix_ms(), unix_s * 1000 + 250, "{time}");
        }
    }

    #[test]
    fn times_far_away_are_refused() {
        assert_eq!(GpsTime::from_unix_ms(i64::MAX), None);
        assert_eq!(GpsTime::from_unix_ms(i64::MIN), None);
        let last = GpsTime { week: u16::MAX, tow_ms: 604_799_999 };
        assert_eq!(GpsTime::from_unix_ms(last.to_unix_ms()), Some(last));
        assert_eq!(GpsTime::from_unix_ms(last.to_unix_ms() + 1), None);
    }

    #[test]
    fn agrees_with_a_show_flown_on_the_real_firmware() {
        // A start at Unix 1795143537 was stored by the firmware as second 442755 of the week.
        let time = GpsTime::from_unix_ms(1_795_143_537_000).unwrap();
        assert_eq!(time.tow_ms, 442_755_000);
        assert_eq!(time.to_unix_ms(), 1_795_143_537_000);
    }

    #[test]
    fn refuses_times_before_the_epoch() {
        assert_eq!(GpsTime::from_unix_ms(0), None);
        assert_eq!(GpsTime::from_total_ms(-1), None);
    }
}
