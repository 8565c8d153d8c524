//! Words that the files have in common.

#[cfg(any(feature = "netcdf", feature = "parquet"))]
use super::Origin;
use crate::analysis::result::Analysis;
use crate::base::calendar::date;
use crate::base::plain::plain;

/// Text of others without control characters, new lines and marks of direction.
pub fn clean(text: &str) -> String {
    plain(text).into_owned()
}

/// Documents of the method.
#[cfg(any(feature = "netcdf", feature = "parquet"))]
pub(super) const REFERENCES: &str = "Thermal Updraft Profiling with an Array of Show Drones; docs/products.md, \
     docs/fields.md and docs/errors.md of updraft";

/// A time of UTC, in milliseconds since 1970, as ISO 8601 has it: `2026-06-01T12:00:52.000Z`.
pub fn iso(utc_ms: i64) -> String {
    let (seconds, ms) = (utc_ms.div_euclid(1000), utc_ms.rem_euclid(1000));
    let (days, second) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    let (year, month, day) = date(days);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{ms:03}Z")
}

/// Title of all files of an analysis.
pub(super) fn title(analysis: &Analysis) -> String {
    format!("{}: vertical air speed measured by drones", clean(&analysis.title))
}

/// Name and version of the program.
#[cfg(any(feature = "netcdf", feature = "parquet"))]
pub(super) fn program(analysis: &Analysis, origin: &Origin) -> String {
    clean(if origin.program.is_empty() { &analysis.made_by } else { &origin.program })
}

/// Origin of the values, in a sentence.
pub(super) fn source(analysis: &Analysis) -> String {
    let simulated = analysis.flights.iter().filter(|flight| flight.simulated).count();
    let of = "rotor effort of multirotor drones that hold their place, by the law of a calibration flight";
    match (simulated, analysis.flights.len()) {
        (0, _) => of.to_owned(),
        (some, all) if some == all => {
            format!("simulated flights, their air and clock are a simulator's: {of}")
        }
        _ => format!("flights, some of them simulated, with a simulator's air and clock: {of}"),
    }
}

#[cfg(test)]
mod tests {
    use super::iso;

    #[test]
    fn times_are_written_as_iso_8601_has_them() {
        assert_eq!(iso(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(iso(1_795_143_537_250), "2026-11-20T02:58:57.250Z");
        assert_eq!(iso(-1), "1969-12-31T23:59:59.999Z");
    }
}
