//! The measured fields as a table for other programs: one row for each drone and second.
//!
//! The columns are described in `docs/fields.md`. Places are in the show frame (x forward, y left, z
//! up, m) and on the globe; vertical speeds are m/s, up positive.

use std::fmt::Write as _;
use std::io;

use crate::analysis::result::{
    Analysis, DroneUpdraft, DroneWindSeries, FilledDrone, QualityFlag, UpdraftMap,
};
use crate::numeric::median;

use super::where_when::{Fix, FixBy, WhereWhen};
use super::words::{clean, iso};

/// Names of the columns, in the order of the file.
pub const COLUMNS: [&str; 13] = [
    "flight",
    "time_s",
    "slot",
    "drone",
    "x_m",
    "y_m",
    "z_m",
    "w_mps",
    "sd_mps",
    "low_mps",
    "high_mps",
    "flags",
    "truth_mps",
];

/// Names of the columns that follow where a map has a posterior.
pub const POSTERIOR_COLUMNS: [&str; 2] = ["posterior_mps", "posterior_sd_mps"];

/// Names of the columns that all files end with: where and when, all errors of w in one number, the horizontal wind.
pub const MORE_COLUMNS: [&str; 11] = [
    "utc",
    "latitude_deg",
    "longitude_deg",
    "height_agl_m",
    "altitude_amsl_m",
    "place_by",
    "w_se_mps",
    "u_mps",
    "u_se_mps",
    "v_mps",
    "v_se_mps",
];

/// Stands among the flags of a drone without a log, whose air its neighbours tell.
pub const FILLED: &str = "filled";
/// Standard errors to each side of a 95 % interval.
const NORMAL: f64 = 1.96;
/// Numbers of [`FieldRow::more`] that stand before `place_by`.
const PLACES: usize = 4;

/// A row of the measured fields: one drone in one second.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldRow {
    /// Name of the flight, which no other flight of the analysis has.
    pub flight: String,
    /// Show time of the second, s.
    pub time_s: f64,
    /// Slot of the drone, if it has one in the plan.
    pub slot: Option<u16>,
    /// Label of the drone.
    pub drone: String,
    /// Distance forward of the show's origin (x) at that time, m, if known.
    pub x_m: Option<f64>,
    /// Distance to the left of the show's origin (y) at that time, m, if known.
    pub y_m: Option<f64>,
    /// Height above home at that time (z), m, if known.
    pub z_m: Option<f64>,
    /// Running 10 s estimate of the vertical air speed, m/s, up positive.
    pub w_mps: Option<f64>,
    /// Statistical standard error of the estimate alone, m/s.
    pub sd_mps: Option<f64>,
    /// Lower end of the 95 % interval for the true vertical air speed, all errors included, m/s.
    pub low_mps: Option<f64>,
    /// Upper end of the 95 % interval for the true vertical air speed, all errors included, m/s.
    pub high_mps: Option<f64>,
    /// Doubts about the estimate, by name, separated by semicolons.
    pub flags: String,
    /// True vertical air speed, m/s, up positive, where it is known.
    pub truth_mps: Option<f64>,
    /// Posterior mean of the vertical air speed, m/s, up positive.
    pub posterior_mps: Option<f64>,
    /// Standard deviation of the posterior, all origins of error included, m/s.
    pub posterior_sd_mps: Option<f64>,
    /// UTC, ms since 1970, if the log has a clock.
    pub utc_ms: Option<i64>,
    /// Place on the globe, as far as it is known.
    pub fix: Fix,
    /// Standard error of w, all origins included, m/s: the 95 % interval's length over 3.92.
    pub w_se_mps: Option<f64>,
    /// Horizontal wind towards east and north, m/s, if it is known.
    pub wind_mps: Option<[f64; 2]>,
    /// Standard errors of both, m/s.
    pub wind_se_mps: Option<[f64; 2]>,
}

impl FieldRow {
    /// Values of [`MORE_COLUMNS`] that are numbers, in their order, with the decimals of the CSV.
    pub(super) fn more(&self) -> [(Option<f64>, usize); 9] {
        let degrees = |axis: usize| (self.fix.lat_lon_deg.map(|(deg, _)| deg[axis]), 7);
        let of = |wind: Option<[f64; 2]>, axis: usize| (wind.map(|wind| wind[axis]), 3);
        [
            degrees(0),
            degrees(1),
            (self.fix.height_m, 2),
            (self.fix.amsl_m, 2),
            (self.w_se_mps, 4),
            of(self.wind_mps, 0),
            of(self.wind_se_mps, 0),
            of(self.wind_mps, 1),
            of(self.wind_se_mps, 1),
        ]
    }

    /// Origin of the place on the globe: `log`, `plan`, or nothing.
    pub fn place_by(&self) -> &'static str {
        self.fix.lat_lon_deg.map_or("", |(_, by)| by.name())
    }
}

/// Rows of all flights, flight by flight and drone by drone; drones without a log come last.
pub fn rows(analysis: &Analysis) -> impl Iterator<Item = FieldRow> + '_ {
    analysis.flights.iter().zip(ids(analysis)).flat_map(|(flight, id)| {
        flight.map.iter().flat_map(move |map| {
            let here = WhereWhen::of(flight);
            measured(id.clone(), map, here.clone()).chain(filled(id.clone(), map, here))
        })
    })
}

/// Names of the flights as tables have them: numbered where an earlier flight has the same, so that the rows of two
/// flights are never taken for those of one.
pub fn ids(analysis: &Analysis) -> Vec<String> {
    let mut ids: Vec<String> = Vec::new();
    for flight in &analysis.flights {
        let name = clean(&flight.name);
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|id| !ids.contains(id));
        ids.push(free.unwrap_or_default());
    }
    ids
}

/// Rows of the drones with a log.
fn measured<'a>(
    flight: String,
    map: &'a UpdraftMap,
    here: WhereWhen<'a>,
) -> impl Iterator<Item = FieldRow> + 'a {
    map.drones.iter().flat_map(move |drone| {
        let (flight, here, zero) = (flight.clone(), here.clone(), here.zero_of(drone));
        let times = map.time_s.iter().enumerate();
        times.map(move |(index, &time_s)| FieldRow {
            utc_ms: zero.and_then(|zero| zero.utc_ms(time_s)),
            ..row(&flight, drone, (index, time_s), &here)
        })
    })
}

/// Rows of the drones without one.
fn filled<'a>(
    flight: String,
    map: &'a UpdraftMap,
    here: WhereWhen<'a>,
) -> impl Iterator<Item = FieldRow> + 'a {
    let height_m = finite(median(map.drones.iter().map(|drone| drone.height_m).collect()));
    let drones = map.posterior.iter().flat_map(|posterior| &posterior.filled);
    drones.flat_map(move |drone| {
        let (flight, here) = (flight.clone(), here.clone());
        let fix = Fix {
            lat_lon_deg: here.lat_lon_deg(drone.position_m).map(|deg| (deg, FixBy::Plan)),
            height_m,
            amsl_m: height_m.and_then(|height_m| here.amsl_m(height_m)),
        };
        let times = map.time_s.iter().enumerate();
        times.map(move |(index, &time_s)| FieldRow {
            utc_ms: here.utc_ms(time_s),
            fix,
            ..filled_row(&flight, drone, height_m, index, time_s)
        })
    })
}

/// Whether any map has a posterior, and the tables its columns.
pub fn has_posterior(analysis: &Analysis) -> bool {
    let mut maps = analysis.flights.iter().filter_map(|flight| flight.map.as_ref());
    maps.any(|map| map.posterior.is_some())
}

/// Names of the columns of an analysis.
pub fn columns(analysis: &Analysis) -> Vec<&'static str> {
    let more: &[&str] = if has_posterior(analysis) { &POSTERIOR_COLUMNS } else { &[] };
    COLUMNS.iter().chain(more).chain(&MORE_COLUMNS).copied().collect()
}

/// Whether the analysis has any rows.
pub fn any(analysis: &Analysis) -> bool {
    rows(analysis).next().is_some()
}

fn finite(value: Option<f64>) -> Option<f64> {
    value.filter(|v| v.is_finite())
}

fn filled_row(
    flight: &str,
    drone: &FilledDrone,
    height_m: Option<f64>,
    index: usize,
    time_s: f64,
) -> FieldRow {
    let value = |of: &[Option<f64>]| finite(of.get(index).copied().flatten());
    FieldRow {
        flight: flight.to_owned(),
        time_s,
        slot: Some(drone.slot),
        drone: format!("slot {}", drone.slot),
        x_m: finite(Some(drone.position_m[0])),
        y_m: finite(Some(drone.position_m[1])),
        z_m: finite(height_m),
        w_mps: None,
        sd_mps: None,
        low_mps: None,
        high_mps: None,
        flags: FILLED.to_owned(),
        truth_mps: None,
        posterior_mps: value(&drone.posterior_mps),
        posterior_sd_mps: value(&drone.posterior_sd_mps),
        utc_ms: None,
        fix: Fix::default(),
        w_se_mps: None,
        wind_mps: None,
        wind_se_mps: None,
    }
}

fn row(
    flight: &str,
    drone: &DroneUpdraft,
    (index, time_s): (usize, f64),
    here: &WhereWhen<'_>,
) -> FieldRow {
    let wind = |of: fn(&DroneWindSeries) -> &[Option<[f64; 2]>]| {
        let wind = of(drone.wind.as_ref()?).get(index).copied().flatten();
        wind.filter(|wind| wind.iter().all(|mps| mps.is_finite()))
    };
    let interval = drone.interval_mps.get(index).copied().flatten();
    let place = if drone.track_m.is_empty() {
        let at = drone.position_m;
        [at.map(|p| p[0]), at.map(|p| p[1]), Some(drone.height_m)]
    } else {
        let at = drone.track_m.get(index).copied().flatten();
        [0, 1, 2].map(|axis| at.map(|p| p[axis]))
    };
    FieldRow {
        flight: flight.to_owned(),
        time_s,
        slot: drone.slot,
        drone: clean(&drone.name),
        x_m: finite(place[0]),
        y_m: finite(place[1]),
        z_m: finite(place[2]),
        w_mps: finite(drone.updraft_mps.get(index).copied().flatten()),
        sd_mps: finite(drone.sd_mps.get(index).copied().flatten()),
        low_mps: finite(interval.map(|interval| interval[0])),
        high_mps: finite(interval.map(|interval| interval[1])),
        flags: flags(&drone.quality, time_s),
        truth_mps: finite(drone.truth_at(index)),
        posterior_mps: finite(drone.posterior_mps.get(index).copied().flatten()),
        posterior_sd_mps: finite(drone.posterior_sd_mps.get(index).copied().flatten()),
        utc_ms: None,
        fix: here.fix(drone, index),
        w_se_mps: finite(interval.map(|[low, high]| (high - low) / (2.0 * NORMAL))),
        wind_mps: wind(|wind| &wind.east_north_mps),
        wind_se_mps: wind(|wind| &wind.se_mps),
    }
}

/// Names of the flags that hold at a time: `low_battery;drift`.
fn flags(quality: &[QualityFlag], time_s: f64) -> String {
    let mut names: Vec<String> = quality
        .iter()
        .filter(|flag| (flag.start_s..=flag.end_s).contains(&time_s))
        .filter_map(|flag| Some(serde_json::to_value(flag.flag).ok()?.as_str()?.to_owned()))
        .collect();
    names.sort();
    names.dedup();
    names.join(";")
}

/// Writes the rows as CSV: comma, point, a header, empty where there is no value; RFC 4180.
///
/// # Errors
///
/// The error of the output.
pub fn write_csv(analysis: &Analysis, out: &mut dyn io::Write) -> io::Result<()> {
    writeln!(out, "{}", columns(analysis).join(","))?;
    let posterior = has_posterior(analysis);
    let mut line = String::new();
    for row in rows(analysis) {
        line.clear();
        quoted(&mut line, &row.flight);
        let _ = write!(line, ",{}", row.time_s);
        let _ = write!(line, ",{},", row.slot.map_or(String::new(), |slot| slot.to_string()));
        quoted(&mut line, &row.drone);
        for (value, decimals) in [(row.x_m, 2), (row.y_m, 2), (row.z_m, 2), (row.w_mps, 4)]
            .into_iter()
            .chain([(row.sd_mps, 4), (row.low_mps, 4), (row.high_mps, 4)])
        {
            number(&mut line, value, decimals);
        }
        let _ = write!(line, ",{}", row.flags);
        number(&mut line, row.truth_mps, 4);
        if posterior {
            number(&mut line, row.posterior_mps, 4);
            number(&mut line, row.posterior_sd_mps, 4);
        }
        let _ = write!(line, ",{}", row.utc_ms.map(iso).unwrap_or_default());
        for (index, (value, decimals)) in row.more().into_iter().enumerate() {
            if index == PLACES {
                let _ = write!(line, ",{}", row.place_by());
            }
            number(&mut line, value, decimals);
        }
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}

pub(super) fn number(line: &mut String, value: Option<f64>, decimals: usize) {
    line.push(',');
    if let Some(value) = value {
        let _ = write!(line, "{value:.decimals$}");
    }
}

pub(super) fn quoted(line: &mut String, text: &str) {
    if text.contains([',', '"', '\n', '\r']) {
        let _ = write!(line, "\"{}\"", text.replace('"', "\"\""));
    } else {
        line.push_str(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::result::Quality;

    #[test]
    fn flags_hold_from_their_start_to_their_end() {
        let flag =
            |flag, start_s, end_s| QualityFlag { flag, start_s, end_s, reason: String::new() };
        let quality = [flag(Quality::LowBattery, 10.0, 20.0), flag(Quality::Drift, 15.0, 30.0)];
        assert_eq!(flags(&quality, 9.0), "");
        assert_eq!(flags(&quality, 15.0), "drift;low_battery");
        assert_eq!(flags(&quality, 30.0), "drift");
    }

    #[test]
    fn flights_of_one_name_are_told_apart() {
        let flight = |name: &str| {
            serde_json::json!({
                "name": name, "purpose": "measurement", "planned": true, "true_updraft_mps": null, "drones": [],
                "missing": [], "flock": null, "table": [], "map": null
            })
        };
        let flights = ["hover", "hover-2", "hover"].map(flight);
        let analysis: Analysis = serde_json::from_value(serde_json::json!({
            "schema": "", "made_by": "", "title": "", "flights": flights, "warnings": []
        }))
        .unwrap();
        assert_eq!(ids(&analysis), ["hover", "hover-2", "hover-3"]);
    }

    #[test]
    fn names_with_commas_and_quotes_stay_one_field() {
        let mut line = String::new();
        quoted(&mut line, "a,\"b\"");
        assert_eq!(line, "\"a,\"\"b\"\"\"");
    }
}
