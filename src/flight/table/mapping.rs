//! The mapping file: TOML.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::TableError;
use super::read::{FEWEST_ROWS, Wish};
use crate::base::file::read_whole;
use crate::base::parse;
use crate::flight::Indicator;
use crate::mission::plan::Purpose;

/// Name and version of the format.
const SCHEMA: &str = "updraft.csv/1";
/// Largest mapping file, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Which column is what, and which files are which flight.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mapping {
    /// Format name and version: `updraft.csv/1`.
    pub schema: String,
    /// Title of the flights, for people.
    #[serde(default)]
    pub title: String,
    /// Character between the cells.
    #[serde(default = "comma")]
    pub delimiter: char,
    /// Indicator of rotor effort that the table holds: `pulse`, `rotor_speed` or `power`.
    pub indicator: Indicator,
    /// Column of times, and its format.
    pub time: TimeColumn,
    /// Rotor effort, in the indicator's unit.
    pub effort: Channel,
    /// Vertical velocity, m/s, up positive (a column that points down has the scale -1).
    pub velocity_up: Channel,
    /// Height above any level, m, up positive.
    pub height: Channel,
    /// Roll, rad, right side down positive.
    pub roll: Channel,
    /// Pitch, rad, nose up positive.
    pub pitch: Channel,
    /// Commanded vertical velocity, m/s, up positive, if there is one: windows come from it.
    pub command_up: Option<Channel>,
    /// True vertical velocity of the air, m/s, up positive, if something measured it.
    pub truth: Option<Channel>,
    /// Distance between the drone and what measured the truth, m; `None`: not told.
    pub truth_distance_m: Option<f64>,
    /// Rules for finding windows where there is no commanded velocity.
    #[serde(default)]
    pub steps: Steps,
    /// Flights, each with the tables of its drones.
    pub flights: Vec<TableFlight>,
}

/// Column of times, and its format.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeColumn {
    /// Name of the column of times.
    pub column: String,
    /// Column of the times of day, where `column` has the dates alone.
    pub time_of_day: Option<String>,
    /// Format of the times.
    #[serde(default)]
    pub format: TimeFormat,
    /// Local time of the column less UTC, h; 0: it is UTC. With it numbers count since 1970. Absent: only dates with a
    /// zone (Z, +01:00) are known in UTC, and numbers count since any instant. The zone of a date goes before it.
    pub utc_offset_h: Option<f64>,
}

/// Format of a column of times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeFormat {
    /// Seconds since any instant.
    #[default]
    S,
    /// Milliseconds since any instant.
    Ms,
    /// Microseconds since any instant.
    Us,
    /// Nanoseconds since any instant.
    Ns,
    /// Date and time of day, as `2021-04-20 09:29:26.100`, with a blank or a T.
    Datetime,
}

/// A quantity: the mean of some columns, times a scale, plus an offset.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Columns whose mean is taken.
    pub columns: Vec<String>,
    /// Factor from the column to our unit and sign.
    #[serde(default = "one")]
    pub scale: f64,
    /// Summand to the scaled mean, in our unit.
    #[serde(default)]
    pub offset: f64,
}

/// Rules for finding windows in the measured velocity.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Steps {
    /// Largest deviation of the velocity from its mean within a steady step, m/s.
    pub wobble_mps: f64,
    /// Time left out at the start of a step, s: the controller's transient.
    pub settle_s: f64,
    /// Duration of the shortest window that is used, s.
    pub shortest_s: f64,
}

impl Default for Steps {
    fn default() -> Self {
        Self { wobble_mps: 0.3, settle_s: 3.0, shortest_s: 6.0 }
    }
}

/// One flight of one or more drones, a table each.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableFlight {
    /// Short name of the flight.
    pub name: String,
    /// Purpose of the flight: `calibration` or `measurement`.
    pub purpose: Purpose,
    /// Tables of the flight's drones, relative to the mapping file.
    pub files: Vec<PathBuf>,
}

fn comma() -> char {
    ','
}

fn one() -> f64 {
    1.0
}

impl Mapping {
    /// Reads a mapping file; the paths of its tables become relative to the working directory.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or is not a mapping.
    pub fn load(path: &Path) -> Result<Self, TableError> {
        Self::parse(path, &read_whole(path, MAX_BYTES)?)
    }

    /// Reads a mapping from the content of a file at `path`.
    ///
    /// # Errors
    ///
    /// If it is not a mapping.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, TableError> {
        let wrong = |reason: String| TableError::Mapping { path: path.to_owned(), reason };
        let text = std::str::from_utf8(bytes).map_err(|error| wrong(error.to_string()))?;
        let mut mapping: Self =
            parse::toml(text).map_err(|error| wrong(parse::toml_trouble(text, &error)))?;
        mapping.refusal().map_or(Ok(()), |reason| Err(wrong(reason)))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for file in mapping.flights.iter_mut().flat_map(|flight| &mut flight.files) {
            *file = folder.join(&*file);
        }
        Ok(mapping)
    }

    /// Columns that are read of each table.
    pub(super) fn wish(&self) -> Wish<'_> {
        Wish {
            delimiter: self.delimiter,
            time: &self.time,
            channels: self.channels(),
            fewest_rows: FEWEST_ROWS,
            heads_line: 1,
            first_line: 2,
        }
    }

    /// The channels, with their names in the file.
    pub(super) fn channels(&self) -> Vec<(&'static str, &Channel)> {
        let always = [
            ("effort", &self.effort),
            ("velocity_up", &self.velocity_up),
            ("height", &self.height),
            ("roll", &self.roll),
            ("pitch", &self.pitch),
        ];
        let command = self.command_up.as_ref().map(|channel| ("command_up", channel));
        let truth = self.truth.as_ref().map(|channel| ("truth", channel));
        always.into_iter().chain(command).chain(truth).collect()
    }

    fn refusal(&self) -> Option<String> {
        if self.schema != SCHEMA {
            return Some(format!("schema is \"{}\", this program reads \"{SCHEMA}\"", self.schema));
        }
        if let Some(reason) = self.wish().refusal() {
            return Some(reason);
        }
        if self.truth_distance_m.is_some_and(|m| !(m.is_finite() && m >= 0.0)) {
            return Some("truth_distance_m must be a distance, m, not below 0".to_owned());
        }
        let Steps { wobble_mps, settle_s, shortest_s } = self.steps;
        let finite = [wobble_mps, settle_s, shortest_s].iter().all(|value| value.is_finite());
        if !(finite && wobble_mps > 0.0 && settle_s >= 0.0 && shortest_s >= 1.0) {
            return Some(
                "steps: wobble_mps must be above 0, settle_s not below 0, shortest_s 1 or more"
                    .to_owned(),
            );
        }
        if self.flights.iter().all(|flight| flight.files.is_empty()) {
            return Some("there are no flights with files".to_owned());
        }
        None
    }
}
