//! Description of a mast's record: TOML, or the names of a table's columns alone.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::MastError;
use super::heads::Heads;
use crate::base::file::read_whole;
use crate::base::parse;
use crate::flight::table::{Channel, TimeColumn, TimeFormat, Wish};

/// Name and version of the format.
const SCHEMA: &str = "updraft.mast/1";
/// Largest description, bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Names by which columns are known without a description, in the order in which they are tried.
pub(super) const TIMES: [&str; 5] = ["utc", "time", "timestamp", "datetime", "date"];
pub(super) const UP: [&str; 8] =
    ["w_mps", "w", "upward_air_velocity", "uz", "w_avg", "uz_avg", "w_mean", "w_unrot"];
pub(super) const EAST: [&str; 3] = ["u_mps", "u", "eastward_wind"];
pub(super) const NORTH: [&str; 3] = ["v_mps", "v", "northward_wind"];
pub(super) const UP_VARIANCE: [&str; 4] = ["w_variance", "w_var", "var_w", "variance_w"];
pub(super) const UP_SD: [&str; 7] =
    ["w_sd", "w_std", "sd_w", "std_w", "sigma_w", "w_stddev", "uz_std"];

/// Which time of a mean its time in the record is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stamp {
    /// The time of its begin.
    Start,
    /// The time of its middle.
    Middle,
    /// The time of its end, as loggers write it.
    End,
}

/// Description of a mast's table or NetCDF file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MastMapping {
    /// Format name and version: `updraft.mast/1`.
    pub schema: String,
    /// Name of the mast, for people.
    #[serde(default)]
    pub name: String,
    /// Table or NetCDF file of the mast, relative to the description.
    pub file: PathBuf,
    /// Character between the cells.
    #[serde(default = "comma")]
    pub delimiter: char,
    /// Column of times, and its format; numbers count since 1970. A NetCDF file may say both itself.
    pub time: Option<TimeColumn>,
    /// Which time of a mean its time is, of records of slow means.
    pub stamp: Option<Stamp>,
    /// Vertical air speed, m/s, up positive. A NetCDF file may say itself which variable it is.
    pub w: Option<Channel>,
    /// Variance of w within each mean, (m/s)².
    pub w_variance: Option<Channel>,
    /// Standard deviation of w within each mean, m/s, where there is no variance.
    pub w_sd: Option<Channel>,
    /// Wind towards east, m/s.
    pub u: Option<Channel>,
    /// Wind towards north, m/s.
    pub v: Option<Channel>,
    /// Latitude of the mast, degrees.
    pub latitude_deg: Option<f64>,
    /// Longitude of the mast, degrees.
    pub longitude_deg: Option<f64>,
    /// Height of the instrument above the ground, m.
    pub height_m: Option<f64>,
}

fn comma() -> char {
    ','
}

impl MastMapping {
    /// Reads a description; the path of its table becomes relative to the working directory.
    ///
    /// # Errors
    /// If the file cannot be read, or is no description.
    pub fn load(path: &Path) -> Result<Self, MastError> {
        let wrong = |reason: String| MastError::Mapping { path: path.to_owned(), reason };
        let bytes = read_whole(path, MAX_BYTES)?;
        let text = std::str::from_utf8(&bytes).map_err(|error| wrong(error.to_string()))?;
        let mut mapping: Self =
            parse::toml(text).map_err(|error| wrong(parse::toml_trouble(text, &error)))?;
        mapping.refusal().map_or(Ok(()), |reason| Err(wrong(reason)))?;
        // Times that are of no known zone could be anywhere: those of masts are UTC unless it is said otherwise.
        if let Some(time) = &mut mapping.time {
            time.utc_offset_h.get_or_insert(0.0);
        }
        mapping.file = path.parent().unwrap_or(Path::new("")).join(&mapping.file);
        Ok(mapping)
    }

    /// The description of a table whose columns have usual names; its times are UTC.
    ///
    /// # Errors
    /// If the columns of time and vertical air speed are not there.
    pub(super) fn of_heads(path: &Path, heads: &Heads) -> Result<Self, MastError> {
        let find = |names: &[&str]| {
            let called =
                |name: &&str| heads.names.iter().find(|head| head.eq_ignore_ascii_case(name));
            names.iter().find_map(called).cloned()
        };
        let missing = |names: &[&str], what: &str| MastError::Record {
            path: path.to_owned(),
            reason: format!(
                "no column with {what} ({}); the columns are: {}; describe the table in a TOML file (docs/mast.md) and give \
                 that",
                names.join(", "),
                heads.listed()
            ),
        };
        let time = heads.time.clone().ok_or_else(|| missing(&TIMES, "times"))?;
        let channel = |column: String| Channel { columns: vec![column], scale: 1.0, offset: 0.0 };
        let w = find(&UP).ok_or_else(|| missing(&UP, "the vertical air speed"))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self {
            schema: SCHEMA.to_owned(),
            name,
            file: path.to_owned(),
            delimiter: heads.delimiter,
            time: Some(time),
            stamp: None,
            w: Some(channel(w)),
            w_variance: find(&UP_VARIANCE).map(channel),
            w_sd: find(&UP_SD).filter(|_| find(&UP_VARIANCE).is_none()).map(channel),
            u: find(&EAST).map(channel),
            v: find(&NORTH).map(channel),
            latitude_deg: None,
            longitude_deg: None,
            height_m: None,
        })
    }

    /// A quantity by the name of its table: `w`, `u`, `v`, `w_variance`, `w_sd`.
    pub fn channel(&self, key: &str) -> Option<&Channel> {
        self.channels().into_iter().find(|(name, _)| *name == key).map(|(_, channel)| channel)
    }

    fn channels(&self) -> Vec<(&'static str, &Channel)> {
        let all = [
            ("w", &self.w),
            ("u", &self.u),
            ("v", &self.v),
            ("w_variance", &self.w_variance),
            ("w_sd", &self.w_sd),
        ];
        all.into_iter().filter_map(|(name, channel)| Some((name, channel.as_ref()?))).collect()
    }

    /// Columns that are read of a table.
    ///
    /// # Errors
    /// [`MastError`]: the part that a table needs and the description does not say.
    pub(super) fn wish(&self, heads: &Heads) -> Result<Wish<'_>, MastError> {
        let time = self.time()?;
        if self.w.is_none() {
            return Err(self.missing("w"));
        }
        let Heads { line, first_line, .. } = *heads;
        Ok(Wish { heads_line: line, first_line, ..self.wish_of(time) })
    }

    /// Column of times of a table.
    ///
    /// # Errors
    /// As [`Self::wish`].
    pub(super) fn time(&self) -> Result<&TimeColumn, MastError> {
        self.time.as_ref().ok_or_else(|| self.missing("time"))
    }

    fn missing(&self, key: &str) -> MastError {
        MastError::Record {
            path: self.file.clone(),
            reason: format!("it is a table, and the mapping has no [{key}] with its column"),
        }
    }

    fn wish_of<'a>(&'a self, time: &'a TimeColumn) -> Wish<'a> {
        // One mean of a slow mast is something to compare with.
        let (fewest_rows, heads_line, first_line) = (1, 1, 2);
        let channels = self.channels();
        Wish { delimiter: self.delimiter, time, channels, fewest_rows, heads_line, first_line }
    }

    fn refusal(&self) -> Option<String> {
        if self.schema != SCHEMA {
            return Some(format!("schema is \"{}\", this program reads \"{SCHEMA}\"", self.schema));
        }
        let any = TimeColumn {
            column: String::new(),
            time_of_day: None,
            format: TimeFormat::S,
            utc_offset_h: None,
        };
        let time = self.time.as_ref().unwrap_or(&any);
        if let Some(reason) = self.wish_of(time).refusal() {
            return Some(reason);
        }
        if self.w_variance.is_some() && self.w_sd.is_some() {
            return Some("w_variance and w_sd say the same: give one of them".to_owned());
        }
        if self.u.is_some() != self.v.is_some() {
            return Some("u and v are given both or not at all".to_owned());
        }
        if self.latitude_deg.is_some() != self.longitude_deg.is_some() {
            return Some("latitude_deg and longitude_deg are given both or not at all".to_owned());
        }
        let within = |value: Option<f64>, most: f64| value.is_none_or(|value| value.abs() <= most);
        if !within(self.latitude_deg, 90.0) || !within(self.longitude_deg, 180.0) {
            return Some("latitude_deg is within 90, longitude_deg within 180 degrees".to_owned());
        }
        if !within(self.height_m, 1e4) {
            return Some("height_m is the height above the ground, m".to_owned());
        }
        None
    }
}
