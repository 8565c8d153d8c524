//! First lines of a table: where its names and its values begin. Loggers write lines before and between: Campbell's
//! (TOA5) a line about themselves, one of units and one of kinds of means, EddyPro groups of columns and units.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;

use super::MastError;
use super::mapping::TIMES;
use crate::base::file::{FileError, open_named};
use crate::base::plain::plain;
use crate::flight::table::{TimeColumn, TimeFormat, time_of};

/// First bytes of a table that are looked at.
const HEAD_BYTES: u64 = 256 << 10;
/// Lines among which that with the names is.
const MOST_BEFORE: usize = 4;
/// Lines between the names and the first values.
const MOST_BETWEEN: usize = 3;
/// Characters between cells, in the order in which they are tried.
const DELIMITERS: [char; 3] = [',', ';', '\t'];
/// Larger numbers than these are times since 1970 in ms, us, ns: as seconds they are later than the year 5000.
const UNITS: [(f64, TimeFormat); 3] =
    [(1e17, TimeFormat::Ns), (1e14, TimeFormat::Us), (1e11, TimeFormat::Ms)];
/// Names in a message.
const MOST_NAMES: usize = 30;

/// Where the names and the values of a table are.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Heads {
    /// Character between the cells.
    pub(super) delimiter: char,
    /// Line with the names, counted from 1.
    pub(super) line: u64,
    /// First line of values.
    pub(super) first_line: u64,
    /// Names of the columns.
    pub(super) names: Vec<String>,
    /// Column of times, if there is one.
    pub(super) time: Option<TimeColumn>,
}

/// First lines of a table.
pub(super) fn lines(path: &Path) -> Result<Vec<String>, MastError> {
    let failed = |error| FileError::new("read", path, error);
    let mut reader = BufReader::new(open_named(path).map_err(failed)?.take(HEAD_BYTES));
    let mut lines = Vec::new();
    for _ in 0..=MOST_BEFORE + MOST_BETWEEN {
        let mut line = Vec::new();
        if reader.read_until(b'\n', &mut line).map_err(failed)? == 0 {
            break;
        }
        let text = String::from_utf8_lossy(&line);
        lines.push(text.trim_start_matches('\u{feff}').trim_end_matches(['\r', '\n']).to_owned());
    }
    Ok(lines)
}

impl Heads {
    /// Heads of a table whose columns have usual names.
    pub(super) fn usual(lines: &[String]) -> Self {
        for delimiter in DELIMITERS {
            for (index, line) in lines.iter().take(MOST_BEFORE).enumerate() {
                let names = cells(line, delimiter);
                let after = below(lines, index, delimiter);
                if let Some((column, between)) = usual_time(&names, &after) {
                    return Self::at(index, between, (delimiter, names), Some(column));
                }
            }
        }
        let most =
            |delimiter: &char| lines.first().map_or(0, |line| line.matches(*delimiter).count());
        // The first of several that are as frequent.
        let delimiter = DELIMITERS.into_iter().rev().max_by_key(most).unwrap_or(',');
        let names = lines.first().map(|line| cells(line, delimiter)).unwrap_or_default();
        Self::at(0, 0, (delimiter, names), None)
    }

    /// Heads of a table that a description tells: the line of names has the column of times.
    pub(super) fn described(lines: &[String], delimiter: char, time: &TimeColumn) -> Self {
        let mut all = lines.iter().take(MOST_BEFORE).map(|line| cells(line, delimiter));
        let has = |names: &Vec<String>| names.iter().any(|name| plain(name) == time.column);
        let index = all.position(|names| has(&names)).unwrap_or(0);
        let names = lines.get(index).map(|line| cells(line, delimiter)).unwrap_or_default();
        let after = below(lines, index, delimiter);
        let between = first_of(&names, &after, time).unwrap_or(0);
        Self::at(index, between, (delimiter, names), Some(time.clone()))
    }

    fn at(
        index: usize,
        between: usize,
        (delimiter, names): (char, Vec<String>),
        time: Option<TimeColumn>,
    ) -> Self {
        let line = index as u64 + 1;
        Self { delimiter, line, first_line: line + 1 + between as u64, names, time }
    }

    /// Names of the columns, for messages.
    pub(super) fn listed(&self) -> String {
        let names = self.names.iter().filter(|name| !name.is_empty());
        let names: Vec<_> = names.take(MOST_NAMES).map(|name| plain(name).into_owned()).collect();
        let more = if self.names.len() > MOST_NAMES { ", ..." } else { "" };
        if names.is_empty() { "none".to_owned() } else { format!("{}{more}", names.join(", ")) }
    }

    /// Sentence about lines that are no values, if there are any.
    pub(super) fn note(&self) -> Option<String> {
        let between = self.first_line - self.line - 1;
        let to = self.first_line - 1;
        match (between, self.line) {
            (0, 1) => None,
            (0, line) => {
                Some(format!("the names of the mast's columns are taken from line {line}"))
            }
            (_, line) => Some(format!(
                "the names of the mast's columns are taken from line {line}, values from line {} on: line{} {} no value",
                to + 1,
                if between == 1 { format!(" {to}") } else { format!("s {} to {to}", line + 1) },
                if between == 1 { "is" } else { "are" },
            )),
        }
    }
}

/// Column of times by its usual name, and the number of lines between the names and the first values.
fn usual_time(names: &[String], after: &[Vec<String>]) -> Option<(TimeColumn, usize)> {
    let called = |name: &str| names.iter().find(|own| own.eq_ignore_ascii_case(name));
    let column = |column: &String, time_of_day: Option<&String>, format: TimeFormat| TimeColumn {
        column: column.clone(),
        time_of_day: time_of_day.cloned(),
        format,
        utc_offset_h: Some(0.0),
    };
    if let (Some(date), Some(clock)) = (called("date"), called("time")) {
        let both = column(date, Some(clock), TimeFormat::Datetime);
        if let Some(between) = first_of(names, after, &both) {
            return Some((both, between));
        }
    }
    for own in TIMES.iter().filter_map(|name| called(name)) {
        let dates = column(own, None, TimeFormat::Datetime);
        if let Some(between) = first_of(names, after, &dates) {
            return Some((dates, between));
        }
    }
    for own in TIMES.iter().filter_map(|name| called(name)) {
        let index = names.iter().position(|name| name == own)?;
        let number = |cells: &Vec<String>| cells.get(index)?.parse::<f64>().ok();
        let first = after.iter().enumerate().find_map(|(line, cells)| Some((line, number(cells)?)));
        if let Some((between, first)) = first.filter(|(_, first)| first.is_finite()) {
            let format = UNITS.into_iter().find(|(least, _)| first.abs() > *least);
            let format = format.map_or(TimeFormat::S, |(_, format)| format);
            return Some((column(own, None, format), between));
        }
    }
    // Whatever stands there is told as no time where the table is read.
    let first = TIMES.iter().find_map(|name| called(name))?;
    Some((column(first, None, TimeFormat::Datetime), 0))
}

/// The first of the lines that has a time.
fn first_of(names: &[String], after: &[Vec<String>], time: &TimeColumn) -> Option<usize> {
    let place = |column: &str| names.iter().position(|name| plain(name) == column);
    let date = place(&time.column)?;
    let clock = match &time.time_of_day {
        Some(column) => Some(place(column)?),
        None => None,
    };
    after.iter().position(|cells| {
        let cell = |index: usize| cells.get(index).map_or("", String::as_str);
        let text = match clock {
            Some(clock) => format!("{} {}", cell(date), cell(clock)),
            None => cell(date).to_owned(),
        };
        time_of(&text, time).is_some()
    })
}

/// Cells of the lines in which the first values may be, below that of the names.
fn below(lines: &[String], names: usize, delimiter: char) -> Vec<Vec<String>> {
    let after = lines.iter().skip(names + 1).take(MOST_BETWEEN + 1);
    after.map(|line| cells(line, delimiter)).collect()
}

/// Cells of a line.
fn cells(line: &str, delimiter: char) -> Vec<String> {
    let delimiter = u8::try_from(delimiter).unwrap_or(b',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .from_reader(line.as_bytes());
    let first = reader.records().next().and_then(Result::ok).unwrap_or_default();
    first.iter().map(|cell| cell.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn usual(text: &str) -> Heads {
        Heads::usual(&text.lines().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn names_and_values_are_found_among_the_lines_of_loggers() {
        let toa5 = "\"TOA5\",\"tower\",\"CR3000\",\"1\",\"os\",\"p\",\"9\",\"flux\"\n\
                    \"TIMESTAMP\",\"RECORD\",\"Uz_Avg\"\n\"TS\",\"RN\",\"m/s\"\n\"\",\"\",\"Avg\"\n\
                    \"2026-06-01 12:00:00\",0,0.1\n";
        let found = usual(toa5);
        assert_eq!((found.line, found.first_line, found.delimiter), (2, 5, ','));
        assert_eq!(found.time.as_ref().unwrap().column, "TIMESTAMP");
        assert!(found.note().unwrap().contains("line 2, values from line 5 on: lines 3 to 4 are"));
        let eddypro = "file_info,,,,\nfilename,date,time,DOY,w_unrot\n,[yyyy-mm-dd],[HH:MM],[ddd.ddd],[m+1s-1]\n\
                       a.dat,2026-06-01,12:00,152.5,0.1\n";
        let found = usual(eddypro);
        let time = found.time.clone().unwrap();
        assert_eq!((found.line, found.first_line), (2, 4));
        assert_eq!((time.column.as_str(), time.time_of_day.as_deref()), ("date", Some("time")));
        assert_eq!(found.listed(), "filename, date, time, DOY, w_unrot");
    }

    #[test]
    fn usual_tables_have_a_line_of_names() {
        for (text, delimiter, format) in [
            ("utc,w\n2026-06-01T12:00:00Z,1\n", ',', TimeFormat::Datetime),
            (
                "\u{feff}utc;w\n2026-06-01 12:00:00+00:00;1\n".trim_start_matches('\u{feff}'),
                ';',
                TimeFormat::Datetime,
            ),
            ("time\tw\n1780000000.5\t1\n", '\t', TimeFormat::S),
            ("time,w\n1780000000500,1\n", ',', TimeFormat::Ms),
            ("time,w\n1780000000500000,1\n", ',', TimeFormat::Us),
            ("time,w\n1780000000500000000,1\n", ',', TimeFormat::Ns),
            ("date,time,w\n2026-06-01 12:00:00,5,1\n", ',', TimeFormat::Datetime),
        ] {
            let found = usual(text);
            assert_eq!((found.line, found.first_line, found.note()), (1, 2, None), "{text}");
            assert_eq!(
                (found.delimiter, found.time.unwrap().format),
                (delimiter, format),
                "{text}"
            );
        }
        let none = usual("when;speed\n1;2\n");
        assert!(none.time.is_none() && none.delimiter == ';' && none.listed() == "when, speed");
        assert_eq!(usual("").listed(), "none");
        // No time at all: told where the table is read.
        assert_eq!(usual("utc,w\nnoon,1\n").first_line, 2);
    }
}
