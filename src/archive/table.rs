//! Tables of an archive as Parquet: columns by name, type and meaning, rows written in groups as they come.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

/// Rows that are held and written at a time: some ten megabytes.
const GROUP: usize = 50_000;

/// A column: its name and what it holds of a row. Any value may be missing.
pub struct Column<R> {
    /// Name, with its unit.
    pub name: &'static str,
    get: Get<R>,
}

/// Type of a column, and its value in a row.
enum Get<R> {
    Text(fn(&R) -> Option<&str>),
    Real(fn(&R) -> Option<f64>),
    Whole(fn(&R) -> Option<i64>),
    Truth(fn(&R) -> Option<bool>),
    /// Milliseconds of UTC since 1970.
    Time(fn(&R) -> Option<i64>),
}

impl<R> Column<R> {
    /// Type as a part of a Parquet schema, before and after the name.
    fn schema(&self) -> String {
        let (kind, logical) = match self.get {
            Get::Text(_) => ("BYTE_ARRAY", " (STRING)"),
            Get::Real(_) => ("DOUBLE", ""),
            Get::Whole(_) => ("INT64", ""),
            Get::Truth(_) => ("BOOLEAN", ""),
            // Not adjusted to UTC: a reader shows it as it is, whatever the time zone of its computer.
            Get::Time(_) => ("INT64", " (TIMESTAMP(MILLIS,false))"),
        };
        format!("  OPTIONAL {kind} {}{logical};\n", self.name)
    }

    /// Name of the type in the documents.
    pub fn kind(&self) -> &'static str {
        match self.get {
            Get::Text(_) => "text",
            Get::Real(_) => "number",
            Get::Whole(_) => "integer",
            Get::Truth(_) => "boolean",
            Get::Time(_) => "time",
        }
    }
}

/// A column of texts.
pub fn text<R>(name: &'static str, get: fn(&R) -> Option<&str>) -> Column<R> {
    Column { name, get: Get::Text(get) }
}

/// A column of numbers; what is not finite is written as missing.
pub fn real<R>(name: &'static str, get: fn(&R) -> Option<f64>) -> Column<R> {
    Column { name, get: Get::Real(get) }
}

/// A column of whole numbers.
pub fn whole<R>(name: &'static str, get: fn(&R) -> Option<i64>) -> Column<R> {
    Column { name, get: Get::Whole(get) }
}

/// A column of yes and no.
pub fn truth<R>(name: &'static str, get: fn(&R) -> Option<bool>) -> Column<R> {
    Column { name, get: Get::Truth(get) }
}

/// A column of UTC times, in milliseconds since 1970.
pub fn time<R>(name: &'static str, get: fn(&R) -> Option<i64>) -> Column<R> {
    Column { name, get: Get::Time(get) }
}

/// A table that is being written.
pub struct Table<R, W: Write + Send> {
    columns: Vec<Column<R>>,
    writer: SerializedFileWriter<W>,
    group: Vec<R>,
    rows: u64,
}

impl<R, W: Write + Send> Table<R, W> {
    /// Begins a table.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn begin(out: W, columns: Vec<Column<R>>) -> Result<Self> {
        let fields: String = columns.iter().map(Column::schema).collect();
        let schema = Arc::new(parse_message_type(&format!("message updraft {{\n{fields}}}"))?);
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(format!("updraft {}", env!("CARGO_PKG_VERSION")))
            .build();
        let writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
        Ok(Self { columns, writer, group: Vec::new(), rows: 0 })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn push(&mut self, row: R) -> Result<()> {
        self.group.push(row);
        self.rows += 1;
        if self.group.len() < GROUP { Ok(()) } else { self.flush() }
    }

    /// Writes what is left, and returns the number of rows and the output.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn finish(mut self) -> Result<(u64, W)> {
        self.flush()?;
        Ok((self.rows, self.writer.into_inner()?))
    }

    fn flush(&mut self) -> Result<()> {
        if self.group.is_empty() {
            return Ok(());
        }
        let mut row_group = self.writer.next_row_group()?;
        let mut columns = self.columns.iter();
        while let Some(mut writer) = row_group.next_column()? {
            let column = columns.next().ok_or_else(|| wrong("a column too many"))?;
            write_column(writer.untyped(), column, &self.group)?;
            writer.close()?;
        }
        row_group.close()?;
        self.group.clear();
        Ok(())
    }
}

fn wrong(what: &str) -> ParquetError {
    ParquetError::General(what.to_owned())
}

/// The values that are there, and for every row whether it has one.
fn parts<R, T>(rows: &[R], get: impl Fn(&R) -> Option<T>) -> (Vec<T>, Vec<i16>) {
    let mut values = Vec::with_capacity(rows.len());
    let present = rows
        .iter()
        .map(|row| {
            let value = get(row);
            let is_there = i16::from(value.is_some());
            values.extend(value);
            is_there
        })
        .collect();
    (values, present)
}

fn write_column<R>(writer: &mut ColumnWriter<'_>, column: &Column<R>, rows: &[R]) -> Result<()> {
    match (writer, &column.get) {
        (ColumnWriter::ByteArrayColumnWriter(writer), Get::Text(get)) => {
            let (values, present) = parts(rows, |row| get(row).map(ByteArray::from));
            writer.write_batch(&values, Some(&present), None)?;
        }
        (ColumnWriter::DoubleColumnWriter(writer), Get::Real(get)) => {
            let (values, present) = parts(rows, |row| get(row).filter(|value| value.is_finite()));
            writer.write_batch(&values, Some(&present), None)?;
        }
        (ColumnWriter::Int64ColumnWriter(writer), Get::Whole(get) | Get::Time(get)) => {
            let (values, present) = parts(rows, get);
            writer.write_batch(&values, Some(&present), None)?;
        }
        (ColumnWriter::BoolColumnWriter(writer), Get::Truth(get)) => {
            let (values, present) = parts(rows, get);
            writer.write_batch(&values, Some(&present), None)?;
        }
        _ => return Err(wrong(&format!("column {} has another type", column.name))),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};

    use super::*;

    #[test]
    fn groups_are_written_as_they_fill_and_what_is_no_number_is_missing() {
        let columns = vec![
            real("half_m", |row: &usize| Some(*row as f64 / if *row == 3 { 0.0 } else { 2.0 })),
            whole("row", |row| (*row != 1).then_some(*row as i64)),
            text("name", |row| (row % 2 == 0).then_some("even")),
            truth("is_odd", |row| Some(row % 2 == 1)),
            time("utc", |row| Some(1_795_143_537_000 + *row as i64)),
        ];
        let mut table = Table::begin(Vec::new(), columns).unwrap();
        for row in 0..GROUP + 2 {
            table.push(row).unwrap();
        }
        let (rows, bytes) = table.finish().unwrap();
        assert_eq!(rows, GROUP as u64 + 2);
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        assert_eq!(reader.metadata().num_row_groups(), 2);
        let read: Vec<String> = reader
            .get_row_iter(None)
            .unwrap()
            .take(4)
            .map(|row| row.unwrap().to_string())
            .collect();
        assert!(
            read[1]
                .starts_with("{half_m: 0.5, row: null, name: null, is_odd: true, utc: 2026-11-20")
        );
        assert!(
            read[2].starts_with("{half_m: 1.0, row: 2, name: \"even\", is_odd: false"),
            "{}",
            read[2]
        );
        assert!(read[3].starts_with("{half_m: null, row: 3"), "{}", read[3]);
    }
}
