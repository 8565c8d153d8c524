//! Reader of one drone's table.

use std::borrow::Cow;
use std::cell::Cell;
use std::io::{self, Read};
use std::path::Path;

use super::TableError;
use super::mapping::{Channel, Mapping, TimeFormat};
use super::time::seconds_of;
use crate::base::file::{FileError, open_named};
use crate::base::plain::plain;
use crate::flight::{Clock, Effort, Flight, Series};

/// Rows that are read at most.
const MOST_ROWS: usize = 20_000_000;
/// Largest table, bytes.
const MOST_BYTES: u64 = 8 << 30;
/// Longest line, bytes: a quote that is never closed must not take the whole file for one cell.
const LONGEST_LINE: usize = 1 << 20;
/// No time is further from its zero, s: thirty thousand years.
const LATEST_S: f64 = 1e12;
/// Fewer rows are no flight.
const FEWEST_ROWS: usize = 20;

/// Columns of one channel in the table.
struct Wanted<'a> {
    channel: &'a Channel,
    /// Number and name of each column.
    columns: Vec<(usize, &'a str)>,
    series: Series,
    /// Rows that are no measurement.
    left_out: usize,
}

impl Wanted<'_> {
    /// Takes a row. Empty cells and what is not finite are no measurement.
    fn take(&mut self, time_s: f64, row: &csv::StringRecord) -> Result<(), (String, String)> {
        let mut sum = 0.0;
        for (index, name) in &self.columns {
            let cell = row.get(*index).unwrap_or_default().trim();
            if cell.is_empty() {
                self.left_out += 1;
                return Ok(());
            }
            let value: f64 = cell.parse().map_err(|_| {
                ((*name).to_owned(), format!("\"{}\" is not a number", short(cell)))
            })?;
            sum += value;
        }
        let value =
            sum / self.columns.len().max(1) as f64 * self.channel.scale + self.channel.offset;
        if value.is_finite() {
            self.series.time_s.push(time_s);
            self.series.value.push(value);
        } else {
            self.left_out += 1;
        }
        Ok(())
    }
}

/// Reads a table as a flight; show time counts from its first row.
///
/// # Errors
/// [`TableError`]: a column is missing, a cell is no number or no time, or there are too few rows.
pub fn read(path: &Path, mapping: &Mapping) -> Result<Flight, TableError> {
    let fail = |source| TableError::File(FileError::new("open", path, source));
    let file = open_named(path).map_err(fail)?;
    let bytes = file.metadata().map_err(fail)?.len();
    if bytes > MOST_BYTES {
        return Err(TableError::Huge { path: path.to_owned(), bytes, most: MOST_BYTES });
    }
    read_from(file.take(MOST_BYTES), path, mapping)
}

/// Passes bytes on, and none when too many came since the last row was taken.
struct Bounded<'a, R> {
    inner: R,
    since_row: &'a Cell<usize>,
}

impl<R: Read> Read for Bounded<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.since_row.get() > LONGEST_LINE {
            return Err(io::Error::other(format!(
                "a row of more than {LONGEST_LINE} bytes (is a quote not closed, or the file no \
                 table?)"
            )));
        }
        let count = self.inner.read(buffer)?;
        self.since_row.set(self.since_row.get().saturating_add(count));
        Ok(count)
    }
}

/// Reads the table of one drone from a stream; `path` stands in messages only.
///
/// # Errors
///
/// As [`read`].
pub fn read_from(bytes: impl Read, path: &Path, mapping: &Mapping) -> Result<Flight, TableError> {
    let since_row = Cell::new(0);
    let bytes = Bounded { inner: bytes, since_row: &since_row };
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(mapping.delimiter as u8)
        .flexible(true)
        .from_reader(bytes);
    let broken =
        |error: csv::Error| TableError::Row { path: path.to_owned(), reason: error.to_string() };
    let heads = reader.headers().map_err(broken)?.clone();
    if heads.iter().all(|head| head.trim().is_empty()) {
        return Err(TableError::Empty { path: path.to_owned() });
    }
    let find = |column: &str, channel: &'static str| {
        heads.iter().position(|head| plain(head.trim()) == column).ok_or_else(|| {
            TableError::Column {
                path: path.to_owned(),
                column: column.to_owned(),
                channel,
                there: short(&heads.iter().collect::<Vec<_>>().join(", ")).into_owned(),
            }
        })
    };
    let time_index = find(&mapping.time.column, "time")?;
    let mut wanted = Vec::new();
    for (name, channel) in mapping.channels() {
        let columns: Result<Vec<_>, TableError> = channel
            .columns
            .iter()
            .map(|column| Ok((find(column, name)?, column.as_str())))
            .collect();
        let (columns, series) = (columns?, Series::default());
        wanted.push((name, Wanted { channel, columns, series, left_out: 0 }));
    }
    let mut row = csv::StringRecord::new();
    let (mut first, mut last, mut rows, mut backward) = (None, f64::NEG_INFINITY, 0, 0);
    let mut cut_off: Option<TableError> = None;
    while rows < MOST_ROWS && reader.read_record(&mut row).map_err(broken)? {
        since_row.set(0);
        // A row with another number of cells is only forgiven as the last one.
        if let Some(error) = cut_off {
            return Err(error);
        }
        let line = row.position().map_or(0, csv::Position::line);
        if row.len() != heads.len() {
            let reason =
                format!("line {line} has {} cells, the first line {}", row.len(), heads.len());
            cut_off = Some(TableError::Row { path: path.to_owned(), reason });
            continue;
        }
        let cell = |column: &str, reason: String| TableError::Cell {
            path: path.to_owned(),
            line,
            column: column.to_owned(),
            reason,
        };
        let text = row.get(time_index).unwrap_or_default();
        let time = time_of(text, mapping.time.format).ok_or_else(|| {
            cell(&mapping.time.column, format!("\"{}\" is not a time", short(text)))
        })?;
        let show_s = time - *first.get_or_insert(time);
        if show_s <= last {
            backward += 1;
            continue;
        }
        last = show_s;
        rows += 1;
        for (_, one) in &mut wanted {
            one.take(show_s, &row).map_err(|(column, reason)| cell(&column, reason))?;
        }
    }
    if rows < FEWEST_ROWS {
        return Err(TableError::Short { path: path.to_owned(), rows, backward });
    }
    let mut warnings: Vec<String> = Vec::new();
    if cut_off.is_some() {
        warnings.push("the table's last line is cut off and was left out".to_owned());
    }
    if rows == MOST_ROWS {
        warnings.push(format!("only the first {MOST_ROWS} rows were read"));
    }
    if backward > 0 {
        warnings.push(format!("{backward} rows whose time does not go forward were left out"));
    }
    warnings.extend(wanted.iter().filter_map(|(name, one)| holes(name, one)));
    let mut flight = Flight {
        source: path.to_owned(),
        effort: Effort { indicator: mapping.indicator, ..Effort::default() },
        pulse_limits_us: (f64::NEG_INFINITY, f64::INFINITY),
        clock: Clock::default(),
        warnings: warnings.into_iter().map(Into::into).collect(),
        ..Flight::default()
    };
    for (name, Wanted { series, .. }) in wanted {
        match name {
            "effort" => flight.effort.values = series,
            "velocity_up" => flight.velocity_up_mps = series,
            "height" => flight.height_m = from_start(series),
            "roll" => flight.roll_rad = series,
            "pitch" => flight.pitch_rad = series,
            "command_up" => flight.desired_up_mps = Some(series),
            _ => flight.truth_up_mps = Some(series),
        }
    }
    Ok(flight)
}

/// That cells of a channel are no measurement: how many, and the longest time without one.
fn holes(name: &str, one: &Wanted<'_>) -> Option<String> {
    let (from, to) = one.series.span().unwrap_or_default();
    let gap_s = one.series.longest_gap_s(from, to);
    (one.left_out > 0).then(|| {
        let columns: Vec<&str> = one.columns.iter().map(|(_, name)| *name).collect();
        format!(
            "{name}: {} rows without a number in \"{}\" were left out (longest stretch {gap_s:.1} s): \
             they have no value",
            one.left_out,
            columns.join("\", \"")
        )
    })
}

fn time_of(text: &str, format: TimeFormat) -> Option<f64> {
    let number = || text.trim().parse::<f64>().ok();
    let time_s = match format {
        TimeFormat::S => number()?,
        TimeFormat::Ms => number()? / 1e3,
        TimeFormat::Us => number()? / 1e6,
        TimeFormat::Datetime => seconds_of(text)?,
    };
    (time_s.abs() <= LATEST_S).then_some(time_s)
}

/// Heights above the first one.
fn from_start(mut series: Series) -> Series {
    let first = series.value.first().copied().unwrap_or(0.0);
    for height in &mut series.value {
        *height -= first;
    }
    series
}

/// The beginning of what may be long, as plain text.
fn short(text: &str) -> Cow<'_, str> {
    const MOST: usize = 200;
    let end = (0..=MOST.min(text.len())).rev().find(|end| text.is_char_boundary(*end));
    plain(text.get(..end.unwrap_or(0)).unwrap_or_default())
}
