//! Units of times and speeds, as the CF conventions write them.

use crate::flight::table::{date_time, zoned};

/// First year in which the standard calendar is the Gregorian one throughout.
const GREGORIAN: &str = "1583";

/// Times counted from an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Since {
    /// Duration of a unit, s.
    pub(super) unit_s: f64,
    /// The instant that is 0, s since 1970, UTC.
    pub(super) zero_s: f64,
}

/// Duration of a unit of time, s.
pub(super) fn unit_s(word: &str) -> Option<f64> {
    match word.to_ascii_lowercase().as_str() {
        "microsecond" | "microseconds" | "microsec" | "us" => Some(1e-6),
        "millisecond" | "milliseconds" | "millisec" | "msec" | "ms" => Some(1e-3),
        "s" | "sec" | "secs" | "second" | "seconds" => Some(1.0),
        "min" | "mins" | "minute" | "minutes" => Some(60.0),
        "h" | "hr" | "hrs" | "hour" | "hours" => Some(3600.0),
        "d" | "day" | "days" => Some(86_400.0),
        _ => None,
    }
}

/// Units as `seconds since 2021-04-20 09:00:00 +02:00`, in a calendar by its CF name.
///
/// # Errors
/// The reason that they are no such units.
pub(super) fn since(units: &str, calendar: Option<&str>) -> Result<Since, String> {
    let wrong = || {
        format!("its units \"{units}\" are not of the form \"seconds since 1970-01-01 00:00:00\"")
    };
    let lower = units.to_ascii_lowercase();
    let (word, rest) = lower.split_once(" since ").ok_or_else(wrong)?;
    let unit_s = unit_s(word.trim()).ok_or_else(wrong)?;
    let rest = rest.trim();
    let (date, time) = match rest.find([' ', 't']) {
        Some(at) => (&rest[..at], rest[at + 1..].trim()),
        None => (rest.trim_end_matches('z'), ""),
    };
    let calendar = calendar.unwrap_or("standard").to_ascii_lowercase();
    match calendar.as_str() {
        "proleptic_gregorian" => {}
        "standard" | "gregorian" | "" => {
            let year: f64 =
                date.split('-').next().and_then(|y| y.parse().ok()).ok_or_else(wrong)?;
            if year < GREGORIAN.parse().unwrap_or(1583.0) {
                return Err(format!(
                    "its units \"{units}\" count from before {GREGORIAN}, across the change of calendars: count from 1970 \
                     (`cdo setreftime,1970-01-01,00:00:00`)"
                ));
            }
        }
        other => {
            return Err(format!(
                "its calendar \"{other}\" is none that clocks go by: give one with the standard calendar"
            ));
        }
    }
    let (time, zone_s) = zoned(time).ok_or_else(wrong)?;
    let time = match time.matches(':').count() {
        _ if time.is_empty() => "00:00:00".to_owned(),
        0 => format!("{time}:00:00"),
        1 => format!("{time}:00"),
        _ => time.to_owned(),
    };
    let local_s = date_time(&format!("{date} {time}")).ok_or_else(wrong)?.local_s;
    Ok(Since { unit_s, zero_s: local_s - zone_s.unwrap_or(0.0) })
}

/// Factor to m/s; `None`: the unit is not known.
pub(super) fn speed_mps(units: &str) -> Option<f64> {
    let bare: String =
        units.to_ascii_lowercase().chars().filter(|c| !" ^*.()_".contains(*c)).collect();
    match bare.as_str() {
        "ms-1" | "m/s" | "m/sec" | "msec-1" | "meters/second" | "meter/second"
        | "metres/second" | "meterspersecond" | "meterpersecond" | "metrespersecond"
        | "metersecond-1" | "meterssecond-1" | "metresecond-1" | "mps" => Some(1.0),
        "cms-1" | "cm/s" => Some(0.01),
        "mms-1" | "mm/s" => Some(0.001),
        "kmh-1" | "km/h" | "kph" | "kmhr-1" | "km/hr" => Some(1.0 / 3.6),
        "knot" | "knots" | "kt" | "kts" => Some(1852.0 / 3600.0),
        _ => None,
    }
}

/// Factor to (m/s)²; `None`: the unit is not known.
pub(super) fn variance_m2ps2(units: &str) -> Option<f64> {
    let bare: String =
        units.to_ascii_lowercase().chars().filter(|c| !" ^*.()_".contains(*c)).collect();
    match bare.as_str() {
        "m2s-2" | "m2/s2" | "m/s2" | "ms-12" => Some(1.0),
        "cm2s-2" | "cm2/s2" => Some(1e-4),
        _ => None,
    }
}

/// Height of a length, m per unit; `None`: it is no length.
pub(super) fn length_m(units: &str) -> Option<f64> {
    match units.trim().to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "cm" => Some(0.01),
        "km" => Some(1000.0),
        "ft" | "foot" | "feet" => Some(0.3048),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_conventions_are_known() {
        let at = |units: &str| since(units, None).map(|since| (since.unit_s, since.zero_s));
        let zero_s = 1_618_909_200.0; // 2021-04-20 09:00:00 UTC
        for units in [
            "seconds since 2021-04-20 09:00:00",
            "seconds since 2021-04-20T09:00:00Z",
            "seconds since 2021-04-20 09:00",
            "s since 2021-4-20 9:0:0.0",
            "seconds since 2021-04-20 09:00:00 UTC",
            "seconds since 2021-04-20 11:00:00 +02:00",
            "seconds since 2021-04-20 11:00:00 +2:00",
            "seconds since 2021-04-20 11:00:00+0200",
            "seconds since 2021-04-20 04:00:00 -5",
            "Seconds Since 2021-04-20T09:00:00",
        ] {
            assert_eq!(at(units), Ok((1.0, zero_s)), "{units}");
        }
        assert_eq!(at("days since 1970-01-01"), Ok((86_400.0, 0.0)));
        assert_eq!(at("minutes since 1970-1-1 0:0:0"), Ok((60.0, 0.0)));
        assert_eq!(at("hours since 1900-01-01 00:00:0.0").unwrap().1, -2_208_988_800.0);
        assert_eq!(
            since("days since 0001-01-01", Some("proleptic_gregorian")).unwrap().unit_s,
            86_400.0
        );
        for wrong in [
            "seconds",
            "since 1970-01-01",
            "months since 1970-01-01",
            "seconds since",
            "",
            "seconds since yesterday",
            "seconds since 2021-13-01",
            "seconds since 1970-01-01 00:00:00 +99",
            "seconds since 2021-04-20 é",
            "days since é",
        ] {
            assert!(at(wrong).unwrap_err().contains("since 1970-01-01"), "{wrong}");
        }
        assert!(at("days since 0001-01-01").unwrap_err().contains("calendars"));
        assert!(since("days since 1970-01-01", Some("360_day")).unwrap_err().contains("360_day"));
    }

    #[test]
    fn speeds_become_metres_per_second() {
        for units in ["m s-1", "m/s", "m s^-1", "m s**-1", "m.s-1", "ms-1"] {
            assert_eq!(speed_mps(units), Some(1.0), "{units}");
        }
        assert_eq!(speed_mps("cm s-1"), Some(0.01));
        assert_eq!(speed_mps("km h-1"), Some(1.0 / 3.6));
        assert_eq!(speed_mps("K"), None);
        assert_eq!(variance_m2ps2("m2 s-2"), Some(1.0));
        assert_eq!(variance_m2ps2("(m/s)^2"), Some(1.0));
        assert_eq!(variance_m2ps2("m s-1"), None);
        assert_eq!(length_m("km"), Some(1000.0));
    }
}
