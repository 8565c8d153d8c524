//! Dates with times of day, in seconds.

/// Seconds since 1970 of `2021-04-20 09:29:26.100` (with a blank or a T, perhaps a Z at the end); the
/// proleptic Gregorian calendar without leap seconds. `None`: it is none.
pub(crate) fn seconds_of(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    let (date, time) = text.split_once([' ', 'T'])?;
    let [year, month, day] = three(date, '-')?;
    let [hour, minute, second] = three(time, ':')?;
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
    use super::seconds_of;

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
        ] {
            assert_eq!(seconds_of(wrong), None, "{wrong}");
        }
    }
}
