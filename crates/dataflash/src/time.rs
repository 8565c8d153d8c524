//! GPS time, the clock that all drones share.

use std::fmt;

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
/// GPS minus UTC since 2017-01-01, s.
pub const LEAP_S: i64 = 18;

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

    /// GPS time from Unix time in milliseconds, with today's 18 leap seconds; `None` outside weeks
    /// 0 to 65535.
    pub fn from_unix_ms(unix_ms: i64) -> Option<Self> {
        Self::from_total_ms(unix_ms - GPS_EPOCH_UNIX_S * 1000 + LEAP_S * 1000)
    }

    /// Unix time in milliseconds, with today's 18 leap seconds.
    pub fn to_unix_ms(self) -> i64 {
        self.total_ms() + GPS_EPOCH_UNIX_S * 1000 - LEAP_S * 1000
    }
}

impl fmt::Display for GpsTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "GPS week {} + {:.3} s", self.week, f64::from(self.tow_ms) / 1000.0)
    }
}

#[cfg(test)]
mod tests {
    use super::GpsTime;

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
