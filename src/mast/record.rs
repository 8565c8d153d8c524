//! The record of a mast: vertical air speed and wind at times in UTC.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};

use super::MastError;
use super::mapping::MastMapping;
use crate::base::file::{FileError, open_named};
use crate::flight::Series;
use crate::flight::table::read_columns;
use crate::numeric::median;

/// Longest first lines that are looked at for names of columns, bytes.
const HEAD_BYTES: u64 = 64 << 10;
/// Values of a mast are no further apart than this, s: they are averaged over ten seconds.
const SLOWEST_S: f64 = 5.0;
/// Share of the values that a mean must have.
const COVERED: f64 = 0.8;

/// Record of a mast.
#[derive(Clone, Debug, PartialEq)]
pub struct MastRecord {
    /// Table that it was read from.
    pub file: PathBuf,
    /// Name of the mast.
    pub name: String,
    /// Latitude and longitude, degrees, if known.
    pub place_deg: Option<[f64; 2]>,
    /// Height of the instrument above the ground, m, if known.
    pub height_m: Option<f64>,
    /// UTC of time 0 of the series, ms since 1970.
    pub zero_ms: i64,
    /// Distance between values, s.
    pub step_s: f64,
    /// Vertical air speed, m/s, up positive.
    pub w: Series,
    /// Wind towards east and north, m/s, if measured.
    pub wind: Option<[Series; 2]>,
    /// Doubts about how it was read, a sentence each.
    pub notes: Vec<String>,
}

impl MastRecord {
    /// Reads a table (`.csv`), or the description of one (`.toml`).
    ///
    /// # Errors
    /// [`MastError`]: what is missing or wrong, and where.
    pub fn read(path: &Path) -> Result<Self, MastError> {
        let is = |end: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
        let mapping = if is("toml") { MastMapping::load(path)? } else { by_heads(path)? };
        let columns = read_columns(&mapping.file, &mapping.wish())?;
        let broken = |reason: String| MastError::Record { path: mapping.file.clone(), reason };
        let start = columns.start.ok_or_else(|| broken("its times are no dates".to_owned()))?;
        let mut notes = columns.warnings;
        let (mut w, mut u, mut v) = (Series::default(), None, None);
        for (name, series) in columns.channels {
            match name {
                "w" => w = series,
                "u" => u = Some(series),
                _ => v = Some(series),
            }
        }
        let steps = w.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let step_s = median(steps).unwrap_or(f64::INFINITY);
        if step_s > SLOWEST_S {
            return Err(broken(format!(
                "its values are {step_s:.0} s apart, and drones are compared by means over 10 s: give a record with a \
                 value at least every {SLOWEST_S:.0} s"
            )));
        }
        if mapping.latitude_deg.is_none() {
            notes.push("the mast's place is not known: distances are not told".to_owned());
        }
        Ok(Self {
            name: mapping.name,
            file: mapping.file,
            place_deg: mapping.latitude_deg.zip(mapping.longitude_deg).map(<[f64; 2]>::from),
            height_m: mapping.height_m,
            zero_ms: start.to_unix_ms(),
            step_s,
            w,
            wind: u.zip(v).map(<[Series; 2]>::from),
            notes,
        })
    }

    /// First and last time, UTC, ms since 1970.
    pub fn span_ms(&self) -> [i64; 2] {
        let (from_s, to_s) = self.w.span().unwrap_or_default();
        [from_s, to_s].map(|time_s| self.zero_ms + (time_s * 1000.0) as i64)
    }

    /// Mean of a series over `length_s` around a time (UTC, ms since 1970); `None` where too much of it is missing.
    pub fn mean(&self, series: &Series, at_ms: i64, length_s: f64) -> Option<f64> {
        let middle_s = (at_ms - self.zero_ms) as f64 / 1000.0;
        let values = series.between(middle_s - 0.5 * length_s, middle_s + 0.5 * length_s);
        let enough = (COVERED * length_s / self.step_s).max(1.0);
        (values.len() as f64 >= enough).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// The description of a table by the names of its columns.
fn by_heads(path: &Path) -> Result<MastMapping, MastError> {
    let failed = |error| FileError::new("read", path, error);
    let file = open_named(path).map_err(failed)?;
    let mut lines = BufReader::new(file.take(HEAD_BYTES)).lines();
    let mut next = || lines.next().transpose().map_err(failed).map(Option::unwrap_or_default);
    let cells = |line: &str| -> Vec<String> {
        line.trim_start_matches('\u{feff}')
            .split(',')
            .map(|cell| cell.trim_matches('"').to_owned())
            .collect()
    };
    let heads = cells(&next()?);
    let first = cells(&next()?);
    let first_time = MastMapping::time_column(&heads).and_then(|index| first.get(index));
    MastMapping::of_heads(path, &heads, first_time.map_or("", String::as_str))
}
