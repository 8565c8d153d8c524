//! The measured fields as a table for other programs: one row for each drone and second.
//!
//! The columns are described in `docs/fields.md`. Places are in the show frame (x forward, y left, z
//! up, m); speeds are m/s, up positive.

use std::fmt::Write as _;
use std::io;

use crate::analysis::result::{Analysis, DroneUpdraft, FilledDrone, QualityFlag, UpdraftMap};
use crate::numeric::median;

use super::text::clean;

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

/// Stands among the flags of a drone without a log, whose air its neighbours tell.
const FILLED: &str = "filled";

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
}

/// Rows of all flights, flight by flight and drone by drone; drones without a log come last.
pub fn rows(analysis: &Analysis) -> impl Iterator<Item = FieldRow> + '_ {
    analysis.flights.iter().zip(ids(analysis)).flat_map(|(flight, id)| {
        let maps = flight.map.iter();
        maps.flat_map(move |map| measured(id.clone(), map).chain(filled(id.clone(), map)))
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
fn measured(flight: String, map: &UpdraftMap) -> impl Iterator<Item = FieldRow> + '_ {
    map.drones.iter().flat_map(move |drone| {
        let (flight, times) = (flight.clone(), map.time_s.iter().enumerate());
        times.map(move |(index, &time_s)| row(&flight, drone, index, time_s))
    })
}

/// Rows of the drones without one.
fn filled(flight: String, map: &UpdraftMap) -> impl Iterator<Item = FieldRow> + '_ {
    let height_m = median(map.drones.iter().map(|drone| drone.height_m).collect());
    let drones = map.posterior.iter().flat_map(|posterior| &posterior.filled);
    drones.flat_map(move |drone| {
        let (flight, times) = (flight.clone(), map.time_s.iter().enumerate());
        times.map(move |(index, &time_s)| filled_row(&flight, drone, height_m, index, time_s))
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
    COLUMNS.iter().chain(more).copied().collect()
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
    }
}

fn row(flight: &str, drone: &DroneUpdraft, index: usize, time_s: f64) -> FieldRow {
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
        truth_mps: finite(drone.truth_mps.as_ref().and_then(|truth| truth.get(index).copied())),
        posterior_mps: finite(drone.posterior_mps.get(index).copied().flatten()),
        posterior_sd_mps: finite(drone.posterior_sd_mps.get(index).copied().flatten()),
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
