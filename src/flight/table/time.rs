//! Dates with times of day, in seconds.

/// Date and time of day.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DateTime {
    /// Seconds since 1970, as the clock of its zone shows them.
    pub(crate) local_s: f64,
    /// The zone's clock less UTC, s, where the text says (Z: 0).
    pub(crate) zone_s: Option<f64>,
}

/// `2021-04-20 09:29:26.100`, with a blank or a T, perhaps without seconds, perhaps with a zone (`Z`, `+01:00`, `+0100`,
/// `+01`); the proleptic Gregorian calendar without leap seconds. `None`: it is none.
pub(crate) fn date_time(text: &str) -> Option<DateTime> {
    let (date, time) = text.trim().split_once([' ', 'T'])?;
    let (time, zone_s) = zoned(time.trim())?;
    Some(DateTime { local_s: seconds_of(date, time)?, zone_s })
}

/// Time of day without its zone, and what the zone's clock is ahead of UTC, s, if it is told: `Z`, `UTC`, `+01:00`,
/// `+0100`, `+1`. `None`: what follows is no zone.
pub(crate) fn zoned(time: &str) -> Option<(&str, Option<f64>)> {
    for utc in ["z", "utc", "gmt"] {
        let at = time.len().saturating_sub(utc.len());
        if time.get(at..).is_some_and(|end| end.eq_ignore_ascii_case(utc)) {
            return Some((time.get(..at)?.trim_end(), Some(0.0)));
        }
    }
    let Some(at) = time.find(['+', '-']) else { return Some((time, None)) };
    let (time, zone) = time.split_at(at);
    let sign = if zone.starts_with('-') { -1.0 } else { 1.0 };
    let digits = zone.get(1..)?.trim();
    let (hours, minutes) = match digits.split_once(':') {
        Some(parts) => parts,
        None if digits.len() == 4 && digits.is_ascii() => digits.split_at(2),
        None => (digits, "0"),
    };
    let number = |text: &str| {
        let is_number =
            matches!(text.len(), 1 | 2) && text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<f64>().ok().filter(|_| is_number)
    };
    let (hours, minutes) = (number(hours)?, number(minutes)?);
    let is_zone = hours <= 14.0 && minutes < 60.0;
    is_zone.then_some((time.trim_end(), Some(sign * (hours * 3600.0 + minutes * 60.0))))
}

fn seconds_of(date: &str, time: &str) -> Option<f64> {
    let [year, month, day] = three(date, '-')?;
    let with_seconds = time.matches(':').count() > 1;
    let [hour, minute, second] =
        if with_seconds { three(time, ':')? } else { three(&format!("{time}:0"), ':')? };
    let whole = [year, month, day, hour, minute];
    if whole.iter().any(|part| part.fract() != 0.0) {
        return None;
    }
    let in_range = (1.0..=9999.0).contains(&year)
        && (1.0..=12.0).contains(&month)
        && (1.0..=31.0).contains(&day)
        && (0.0..24.0).contains(&hour)
        && (0.0..60.0).contains(&minute)
        && (0.0..61.0).contains(&second);
    let days = days_from_civil(year as i64, month as i64, day as i64);
    in_range.then_some(days as f64 * 86_400.0 + hour * 3600.0 + minute * 60.0 + second)
}

fn three(text: &str, between: char) -> Option<[f64; 3]> {
    let mut parts = text.split(between).map(|part| {
        let digits = part.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
        part.parse::<f64>().ok().filter(|_| digits)
    });
    let three = [parts.next()??, parts.next()??, parts.next()??];
    parts.next().is_none().then_some(three)
}

/// Days since 1970-01-01: years counted from March, so that the leap day is the last of a year.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let month_from_march = (month + 9) % 12;
    let day_of_year = (153 * month_from_march + 2) / 5 + day - 1;
    year * 365 + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + day_of_year
        - 719_468
}

#[cfg(test)]
mod tests {
    use super::{DateTime, date_time};

    fn seconds_of(text: &str) -> Option<f64> {
        date_time(text).map(|found| found.local_s)
    }

    #[test]
    fn dates_are_seconds_since_1970() {
        assert_eq!(seconds_of("1970-01-01 00:00:00"), Some(0.0));
        assert_eq!(seconds_of("2000-02-29T12:00:00Z"), Some(951_825_600.0));
        let found = seconds_of("2021-04-20 09:29:26.100").unwrap();
        assert!((found - 1_618_910_966.1).abs() < 1e-3, "{found}");
        for wrong in [
            "",
            "2021-04-20",
            "2021-13-01 00:00:00",
            "a-b-c d:e:f",
            "1-1-1 1:1:1:1",
            "2021-04-20 -1:00:00",
            "2021-04-20 12",
            "2021-04-20 12:00:00+99:00",
            "2021-04-20 12:00:00+01:00:00",
            "2021-04-20 12:00:00 +é1",
        ] {
            assert_eq!(seconds_of(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn zones_are_told_as_people_and_programs_write_them() {
        let noon_s = 1_618_920_000.0;
        for (text, zone_s) in [
            ("2021-04-20 12:00", None),
            ("2021-04-20 12:00:00Z", Some(0.0)),
            ("2021-04-20T12:00:00z", Some(0.0)),
            ("2021-04-20 12:00:00+00:00", Some(0.0)),
            ("2021-04-20 12:00:00.000+02:00", Some(7200.0)),
            ("2021-04-20 12:00:00 -0930", Some(-34_200.0)),
            ("2021-04-20T12:00+01", Some(3600.0)),
            ("2021-04-20 12:00:00 UTC", Some(0.0)),
            ("2021-04-20 12:00:00 -5", Some(-18_000.0)),
        ] {
            assert_eq!(date_time(text), Some(DateTime { local_s: noon_s, zone_s }), "{text}");
        }
    }
}
