//! Reader of one drone's table.

use std::borrow::Cow;
use std::cell::Cell;
use std::io::{self, BufRead as _, BufReader, Read};
use std::path::Path;

use super::TableError;
use super::cells::{Cells, Dead};
use super::mapping::{Channel, Mapping, TimeColumn, TimeFormat};
use super::time::date_time;
use crate::base::file::{FileError, open_named};
use crate::base::plain::plain;
use crate::base::time::GpsTime;
use crate::flight::{Clock, Effort, Flight, Series};

/// Rows that are read at most.
const MOST_ROWS: usize = 20_000_000;
/// Largest table, bytes.
const MOST_BYTES: u64 = 8 << 30;
/// Longest line, bytes: a quote that is never closed must not take the whole file for one cell.
const LONGEST_LINE: usize = 1 << 20;
/// No time is further from its zero, s: thirty thousand years.
const LATEST_S: f64 = 1e12;
/// No local time is further from UTC, h.
const FURTHEST_ZONE_H: f64 = 26.0;
/// Fewer rows are no flight.
pub(super) const FEWEST_ROWS: usize = 20;

/// Columns of one channel in the table.
struct Wanted<'a> {
    channel: &'a Channel,
    /// Number and name of each column.
    columns: Vec<(usize, &'a str)>,
    series: Series,
    /// Rows that are no measurement.
    left_out: usize,
    /// Cells that are looked at for what cannot be.
    cells: Option<Cells>,
}

impl Wanted<'_> {
    /// Takes a row. Empty cells and what is not finite are no measurement.
    fn take(
        &mut self,
        (time_s, line): (f64, u64),
        row: &csv::StringRecord,
    ) -> Result<(), (String, String)> {
        let mut sum = 0.0;
        let kept = self.series.len();
        for (index, name) in &self.columns {
            let cell = row.get(*index).unwrap_or_default().trim();
            if cell.is_empty() {
                self.leave_out(kept);
                return Ok(());
            }
            let value: f64 = cell.parse().map_err(|_| {
                ((*name).to_owned(), format!("\"{}\" is not a number", short(cell)))
            })?;
            sum += value;
            if let Some(cells) = &mut self.cells {
                cells.values.push(value * self.channel.scale + self.channel.offset);
            }
        }
        let value =
            sum / self.columns.len().max(1) as f64 * self.channel.scale + self.channel.offset;
        if value.is_finite() {
            self.series.time_s.push(time_s);
            self.series.value.push(value);
            if let Some(cells) = &mut self.cells {
                cells.lines.push(line);
            }
        } else {
            self.leave_out(kept);
        }
        Ok(())
    }

    /// Leaves a row out, behind so many that are kept.
    fn leave_out(&mut self, kept: usize) {
        self.left_out += 1;
        if let Some(cells) = &mut self.cells {
            cells.values.truncate(kept * self.columns.len());
        }
    }

    /// Takes out the rows with a cell that cannot be; a sentence for each column and reason.
    fn take_out(&mut self, name: &str) -> Vec<String> {
        let Some(cells) = self.cells.take() else { return Vec::new() };
        let names: Vec<&str> = self.columns.iter().map(|(_, name)| *name).collect();
        let (bad, told) = cells.impossible(name, &names);
        if told.is_empty() {
            return told;
        }
        let keep = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(&bad).filter(|(_, bad)| !**bad).map(|(value, _)| *value).collect()
        };
        self.series = Series { time_s: keep(&self.series.time_s), value: keep(&self.series.value) };
        told
    }
}

/// Columns that are read of a table.
#[derive(Clone, Debug)]
pub struct Wish<'a> {
    /// Character between the cells.
    pub delimiter: char,
    /// Column of times.
    pub time: &'a TimeColumn,
    /// Quantities, each with its name in messages.
    pub channels: Vec<(&'static str, &'a Channel)>,
    /// Fewest rows that are enough.
    pub fewest_rows: usize,
    /// Line with the names of the columns, counted from 1.
    pub heads_line: u64,
    /// First line of values: those between are not read.
    pub first_line: u64,
}

impl Wish<'_> {
    /// Reason that nothing can be read by this wish; `None`: it can be used.
    pub fn refusal(&self) -> Option<String> {
        if !self.delimiter.is_ascii() {
            return Some(format!("delimiter {:?} must be one ASCII character", self.delimiter));
        }
        for (name, channel) in &self.channels {
            if channel.columns.is_empty() {
                return Some(format!("{name}: columns is empty; name at least one"));
            }
            if !(channel.scale.is_finite() && channel.offset.is_finite() && channel.scale != 0.0) {
                return Some(format!("{name}: scale and offset must be finite, and scale not 0"));
            }
        }
        if self.time.time_of_day.is_some() && self.time.format != TimeFormat::Datetime {
            return Some("time: time_of_day is for format = \"datetime\"".to_owned());
        }
        let zone_h = self.time.utc_offset_h;
        if zone_h.is_some_and(|h| !(h.is_finite() && h.abs() <= FURTHEST_ZONE_H)) {
            return Some(format!(
                "time: utc_offset_h must be within {FURTHEST_ZONE_H} h: local time less UTC"
            ));
        }
        None
    }
}

/// Columns of a table as series; time counts from the first row.
#[derive(Clone, Debug)]
pub struct Columns {
    /// GPS time of the first row, if the table says.
    pub start: Option<GpsTime>,
    /// Quantities, in the order of the wish, with their names.
    pub channels: Vec<(&'static str, Series)>,
    /// Doubts about how the table was read, a sentence each.
    pub warnings: Vec<String>,
}

/// Reads a table as a flight; show time counts from its first row.
///
/// # Errors
/// [`TableError`]: a column is missing, a cell is no number or no time, or there are too few rows.
pub fn read(path: &Path, mapping: &Mapping) -> Result<Flight, TableError> {
    Ok(flight(read_columns(path, &mapping.wish())?, path, mapping))
}

/// Reads columns of a table.
///
/// # Errors
/// As [`read`].
pub fn read_columns(path: &Path, wish: &Wish<'_>) -> Result<Columns, TableError> {
    let fail = |source| TableError::File(FileError::new("open", path, source));
    let file = open_named(path).map_err(fail)?;
    let bytes = file.metadata().map_err(fail)?.len();
    if bytes > MOST_BYTES {
        return Err(TableError::Huge { path: path.to_owned(), bytes, most: MOST_BYTES });
    }
    columns_from(file.take(MOST_BYTES), path, wish)
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
    Ok(flight(columns_from(bytes, path, &mapping.wish())?, path, mapping))
}

fn columns_from(bytes: impl Read, path: &Path, wish: &Wish<'_>) -> Result<Columns, TableError> {
    let since_row = Cell::new(0);
    let mut bytes = BufReader::new(Bounded { inner: bytes, since_row: &since_row });
    let before = wish.heads_line.saturating_sub(1);
    for _ in 0..before {
        since_row.set(0);
        bytes.skip_until(b'\n').map_err(|error| TableError::Row {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
    }
    let mut reader =
        csv::ReaderBuilder::new().delimiter(wish.delimiter as u8).flexible(true).from_reader(bytes);
    let broken =
        |error: csv::Error| TableError::Row { path: path.to_owned(), reason: error.to_string() };
    let heads = reader.headers().map_err(broken)?.clone();
    // Where lines end with CR and LF, the reader counts a line only when it goes on behind the CR.
    let lines_before = before + u64::from(reader.position().line() < 2);
    let table = Places::of(&heads, path, wish)?;
    let mut rows = Rows {
        path,
        time: wish.time,
        table,
        lines_before,
        first: None,
        start: None,
        last_s: f64::NEG_INFINITY,
        taken: 0,
        backward: 0,
    };
    let mut row = csv::StringRecord::new();
    let mut cut_off: Option<TableError> = None;
    while rows.taken < MOST_ROWS && reader.read_record(&mut row).map_err(broken)? {
        since_row.set(0);
        let line = row.position().map_or(0, csv::Position::line) + lines_before;
        if line < wish.first_line {
            continue;
        }
        // A row with another number of cells is only forgiven as the last one.
        if let Some(error) = cut_off {
            return Err(error);
        }
        if row.len() == heads.len() {
            rows.take(&row)?;
        } else {
            let heads_line = if before == 0 { "the first line" } else { "that of the names" };
            let reason =
                format!("line {line} has {} cells, {heads_line} {}", row.len(), heads.len());
            cut_off = Some(TableError::Row { path: path.to_owned(), reason });
        }
    }
    if rows.taken < wish.fewest_rows {
        let Rows { taken, backward, .. } = rows;
        return Err(TableError::Short { path: path.to_owned(), rows: taken, backward });
    }
    rows.dead().map_or_else(|| Ok(rows.columns(cut_off.is_some())), Err)
}

/// Where a table's columns are.
struct Places<'a> {
    time: usize,
    time_of_day: Option<usize>,
    /// Each channel by its name.
    channels: Vec<(&'static str, Wanted<'a>)>,
}

impl<'a> Places<'a> {
    fn of(heads: &csv::StringRecord, path: &Path, wish: &Wish<'a>) -> Result<Self, TableError> {
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
        let time = find(&wish.time.column, "time")?;
        let time_of_day = wish.time.time_of_day.as_ref();
        let time_of_day = time_of_day.map(|column| find(column, "time_of_day")).transpose()?;
        let mut channels = Vec::new();
        for &(name, channel) in &wish.channels {
            let columns: Result<Vec<_>, TableError> = channel
                .columns
                .iter()
                .map(|column| Ok((find(column, name)?, column.as_str())))
                .collect();
            let (columns, series) = (columns?, Series::default());
            let cells = Cells::of(name);
            channels.push((name, Wanted { channel, columns, series, left_out: 0, cells }));
        }
        Ok(Self { time, time_of_day, channels })
    }
}

/// The rows of a table as they are read.
struct Rows<'a> {
    path: &'a Path,
    time: &'a TimeColumn,
    table: Places<'a>,
    /// Lines of the file before that of the names.
    lines_before: u64,
    /// Time of the first row, s: show time counts from it.
    first: Option<f64>,
    /// GPS time of the first row, if the table says.
    start: Option<GpsTime>,
    /// Show time of the last row, s.
    last_s: f64,
    taken: usize,
    /// Rows whose time does not go forward.
    backward: usize,
}

impl Rows<'_> {
    fn take(&mut self, row: &csv::StringRecord) -> Result<(), TableError> {
        let cell = |column: &str, reason: String| TableError::Cell {
            path: self.path.to_owned(),
            line: row.position().map_or(0, csv::Position::line) + self.lines_before,
            column: column.to_owned(),
            reason,
        };
        let time = self.time;
        let date = row.get(self.table.time).unwrap_or_default();
        let text = match self.table.time_of_day.and_then(|index| row.get(index)) {
            Some(clock) => Cow::Owned(format!("{} {}", date.trim(), clock.trim())),
            None => Cow::Borrowed(date),
        };
        let (time_s, is_utc) = time_of(&text, time)
            .ok_or_else(|| cell(&time.column, format!("\"{}\" is not a time", short(&text))))?;
        if self.first.is_none() && is_utc {
            self.start = GpsTime::from_unix_ms((time_s * 1000.0).round() as i64);
        }
        let show_s = time_s - *self.first.get_or_insert(time_s);
        if show_s <= self.last_s {
            self.backward += 1;
            return Ok(());
        }
        self.last_s = show_s;
        self.taken += 1;
        let line = row.position().map_or(0, csv::Position::line) + self.lines_before;
        for (_, one) in &mut self.table.channels {
            one.take((show_s, line), row).map_err(|(column, reason)| cell(&column, reason))?;
        }
        Ok(())
    }

    /// That a rotor's column has nothing while the others turn.
    fn dead(&self) -> Option<TableError> {
        self.table.channels.iter().find_map(|(channel, one)| {
            let Dead { column, standing, turning } = one.cells.as_ref()?.dead(one.columns.len())?;
            let (_, name) = one.columns.get(column)?;
            let (path, column) = (self.path.to_owned(), (*name).to_owned());
            Some(TableError::Dead { path, column, channel, standing, turning })
        })
    }

    /// What must be known of how the table was read.
    fn warnings(&mut self, cut_off: bool) -> Vec<String> {
        let mut warnings = Vec::new();
        if cut_off {
            warnings.push("the table's last line is cut off and was left out".to_owned());
        }
        if self.taken == MOST_ROWS {
            warnings.push(format!("only the first {MOST_ROWS} rows were read"));
        }
        if self.backward > 0 {
            let backward = self.backward;
            warnings.push(format!("{backward} rows whose time does not go forward were left out"));
        }
        let last_s = self.last_s;
        let channels = || self.table.channels.iter();
        warnings.extend(channels().filter_map(|(name, one)| holes(name, one, last_s)));
        let channels = self.table.channels.iter_mut();
        warnings.extend(channels.flat_map(|(name, one)| one.take_out(name)));
        warnings
    }

    fn columns(mut self, cut_off: bool) -> Columns {
        let warnings = self.warnings(cut_off);
        let channels = self.table.channels.into_iter().map(|(name, one)| (name, one.series));
        Columns { start: self.start, channels: channels.collect(), warnings }
    }
}

/// The flight of a table's columns.
fn flight(columns: Columns, path: &Path, mapping: &Mapping) -> Flight {
    let mut flight = Flight {
        source: path.to_owned(),
        effort: Effort { indicator: mapping.indicator, ..Effort::default() },
        pulse_limits_us: (f64::NEG_INFINITY, f64::INFINITY),
        clock: Clock { start: columns.start, ..Clock::default() },
        warnings: columns.warnings.into_iter().map(Into::into).collect(),
        ..Flight::default()
    };
    for (name, series) in columns.channels {
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
    flight
}

/// That cells of a channel are no measurement: how many, and the longest time without one in a table from 0 to `last_s`.
fn holes(name: &str, one: &Wanted<'_>, last_s: f64) -> Option<String> {
    let gap_s = one.series.longest_gap_s(0.0, last_s.max(0.0));
    (one.left_out > 0).then(|| {
        let columns: Vec<&str> = one.columns.iter().map(|(_, name)| *name).collect();
        format!(
            "{name}: {} rows without a number in \"{}\" were left out (longest stretch {gap_s:.1} s): \
             they have no value",
            one.left_out,
            columns.join("\" or \"")
        )
    })
}

/// Seconds that a cell stands for, and whether they are known to be UTC since 1970.
pub(crate) fn time_of(text: &str, time: &TimeColumn) -> Option<(f64, bool)> {
    let number = || text.trim().parse::<f64>().ok();
    let mut zone_s = time.utc_offset_h.map(|hours| hours * 3600.0);
    let local_s = match time.format {
        TimeFormat::S => number()?,
        TimeFormat::Ms => number()? / 1e3,
        TimeFormat::Us => number()? / 1e6,
        TimeFormat::Ns => number()? / 1e9,
        TimeFormat::Datetime => {
            let found = date_time(text)?;
            zone_s = found.zone_s.or(zone_s);
            found.local_s
        }
    };
    let time_s = local_s - zone_s.unwrap_or(0.0);
    (time_s.abs() <= LATEST_S).then_some((time_s, zone_s.is_some()))
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
