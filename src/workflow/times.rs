//! Times as people read them.

use crate::base::calendar::date;
use crate::base::time::GpsTime;

/// The nearest second: starts are whole seconds, and logs know them to some tenths.
pub(crate) fn unix_s(time: GpsTime) -> i64 {
    time.to_unix_ms().saturating_add(500).div_euclid(1000)
}

/// `2026-11-21 14:03:11 UTC`.
pub(crate) fn utc(time: GpsTime) -> String {
    let seconds = unix_s(time);
    let (year, month, day) = date(seconds.div_euclid(86_400));
    let second = seconds.rem_euclid(86_400);
    format!(
        "{year:04}-{month:02}-{day:02} {:02}:{:02}:{:02} UTC",
        second / 3600,
        second / 60 % 60,
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        let at = |unix_s: i64| utc(GpsTime::from_unix_ms(unix_s * 1000).unwrap());
        assert_eq!(at(1_795_143_537), "2026-11-20 02:58:57 UTC");
        assert_eq!(at(1_709_164_800), "2024-02-29 00:00:00 UTC");
        assert_eq!(at(1_735_689_599), "2024-12-31 23:59:59 UTC");
    }
}
