//! The measured fields as Parquet: the tables of `fields.rs` and `fields_grid.rs`, typed and a third of the size.
//!
//! Units, and what a file is, stand in its metadata: as `units`, `title`, `source` and others for all readers, and once more
//! where pandas looks for a table's attributes (`PANDAS_ATTRS`).

use std::sync::Arc;

use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use serde_json::{Map, Value, json};

use super::fields::{FieldRow, has_posterior, rows};
use super::fields_grid::{self, GridRow};
use super::{Origin, words};
use crate::analysis::result::Analysis;

/// Rows that are held and written at a time.
const GROUP: usize = 200_000;

/// A column: its name, its unit (empty: none), and what it holds of a row.
struct Column<R> {
    name: &'static str,
    unit: &'static str,
    get: Get<R>,
}

/// Type of a column, and its value in a row.
enum Get<R> {
    Text(fn(&R) -> &str),
    /// A number that each row has.
    Each(fn(&R) -> f64),
    Real(fn(&R) -> Option<f64>),
    Slot(fn(&R) -> Option<u16>),
    /// Milliseconds of UTC since 1970.
    Time(fn(&R) -> Option<i64>),
}

impl<R> Column<R> {
    /// Its line of a Parquet schema.
    fn schema(&self) -> String {
        let (kind, logical) = match self.get {
            Get::Text(_) => ("REQUIRED BYTE_ARRAY", " (STRING)"),
            Get::Each(_) => ("REQUIRED DOUBLE", ""),
            Get::Real(_) => ("OPTIONAL DOUBLE", ""),
            Get::Slot(_) => ("OPTIONAL INT32", " (INTEGER(16, false))"),
            // Not adjusted to UTC: a reader shows it as it is, whatever the time zone of its computer.
            Get::Time(_) => ("OPTIONAL INT64", " (TIMESTAMP(MILLIS,false))"),
        };
        format!("  {kind} {}{logical};\n", self.name)
    }
}

/// Columns of the drones' table.
fn columns(posterior: bool) -> Vec<Column<FieldRow>> {
    let column = |name, unit, get| Column { name, unit, get };
    let mut columns = vec![
        column("flight", "", Get::Text(|row: &FieldRow| &row.flight)),
        column("time_s", "s", Get::Each(|row| row.time_s)),
        column("slot", "", Get::Slot(|row| row.slot)),
        column("drone", "", Get::Text(|row| &row.drone)),
        column("x_m", "m", Get::Real(|row| row.x_m)),
        column("y_m", "m", Get::Real(|row| row.y_m)),
        column("z_m", "m", Get::Real(|row| row.z_m)),
        column("w_mps", "m s-1", Get::Real(|row| row.w_mps)),
        column("sd_mps", "m s-1", Get::Real(|row| row.sd_mps)),
        column("low_mps", "m s-1", Get::Real(|row| row.low_mps)),
        column("high_mps", "m s-1", Get::Real(|row| row.high_mps)),
        column("flags", "", Get::Text(|row| &row.flags)),
        column("truth_mps", "m s-1", Get::Real(|row| row.truth_mps)),
    ];
    if posterior {
        columns.extend([
            column("posterior_mps", "m s-1", Get::Real(|row| row.posterior_mps)),
            column("posterior_sd_mps", "m s-1", Get::Real(|row| row.posterior_sd_mps)),
        ]);
    }
    columns.extend([
        column("utc", "UTC", Get::Time(|row| row.utc_ms)),
        column("latitude_deg", "degrees_north", Get::Real(|row| row.more()[0].0)),
        column("longitude_deg", "degrees_east", Get::Real(|row| row.more()[1].0)),
        column("height_agl_m", "m", Get::Real(|row| row.more()[2].0)),
        column("altitude_amsl_m", "m", Get::Real(|row| row.more()[3].0)),
        column("place_by", "", Get::Text(FieldRow::place_by)),
        column("w_se_mps", "m s-1", Get::Real(|row| row.more()[4].0)),
        column("u_mps", "m s-1", Get::Real(|row| row.more()[5].0)),
        column("u_se_mps", "m s-1", Get::Real(|row| row.more()[6].0)),
        column("v_mps", "m s-1", Get::Real(|row| row.more()[7].0)),
        column("v_se_mps", "m s-1", Get::Real(|row| row.more()[8].0)),
    ]);
    columns
}

/// Columns of the table between the drones.
fn grid_columns() -> Vec<Column<GridRow>> {
    let column = |name, unit, get| Column { name, unit, get };
    vec![
        column("flight", "", Get::Text(|row: &GridRow| &row.flight)),
        column("time_s", "s", Get::Each(|row| row.time_s)),
        column("x_m", "m", Get::Each(|row| row.x_m)),
        column("y_m", "m", Get::Each(|row| row.y_m)),
        column("z_m", "m", Get::Each(|row| row.z_m)),
        column("w_mps", "m s-1", Get::Each(|row| row.w_mps)),
        column("sd_mps", "m s-1", Get::Each(|row| row.sd_mps)),
        column("utc", "UTC", Get::Time(|row| row.utc_ms)),
        column("latitude_deg", "degrees_north", Get::Real(|row| row.more()[0].0)),
        column("longitude_deg", "degrees_east", Get::Real(|row| row.more()[1].0)),
        column("height_agl_m", "m", Get::Real(|row| row.more()[2].0)),
        column("altitude_amsl_m", "m", Get::Real(|row| row.more()[3].0)),
        column("u_mps", "m s-1", Get::Real(|row| row.more()[4].0)),
        column("u_se_mps", "m s-1", Get::Real(|row| row.more()[5].0)),
        column("v_mps", "m s-1", Get::Real(|row| row.more()[6].0)),
        column("v_se_mps", "m s-1", Get::Real(|row| row.more()[7].0)),
    ]
}

/// Renders the measured fields as a Parquet file.
///
/// # Errors
/// A bug of this program: nothing outside of memory is touched.
pub fn parquet(analysis: &Analysis, origin: &Origin) -> Result<Vec<u8>> {
    let columns = columns(has_posterior(analysis));
    render("updraft", &columns, rows(analysis), (analysis, origin))
}

/// Renders the posterior on its grid as a Parquet file.
///
/// # Errors
/// A bug of this program: nothing outside of memory is touched.
pub fn grid_parquet(analysis: &Analysis, origin: &Origin) -> Result<Vec<u8>> {
    render("updraft_grid", &grid_columns(), fields_grid::rows(analysis), (analysis, origin))
}

/// What the file says of itself.
fn metadata<R>(columns: &[Column<R>], analysis: &Analysis, origin: &Origin) -> Vec<KeyValue> {
    let of = |column: &Column<R>| (column.name.to_owned(), Value::from(column.unit));
    let units: Map<String, Value> =
        columns.iter().filter(|column| !column.unit.is_empty()).map(of).collect();
    let mut said = vec![
        ("title", words::title(analysis)),
        ("source", words::source(analysis)),
        ("program", words::program(analysis, origin)),
        ("references", words::REFERENCES.to_owned()),
    ];
    if let Some(sha256) = &origin.analysis_sha256 {
        said.push(("analysis_sha256", words::clean(sha256)));
    }
    let mut attributes: Map<String, Value> =
        said.iter().map(|(key, value)| ((*key).to_owned(), Value::from(value.as_str()))).collect();
    attributes.insert("units".to_owned(), Value::Object(units.clone()));
    said.push(("units", Value::Object(units).to_string()));
    said.push(("PANDAS_ATTRS", json!(attributes).to_string()));
    said.into_iter().map(|(key, value)| KeyValue::new(key.to_owned(), value)).collect()
}

fn render<R>(
    name: &str,
    columns: &[Column<R>],
    rows: impl Iterator<Item = R>,
    (analysis, origin): (&Analysis, &Origin),
) -> Result<Vec<u8>> {
    let lines: String = columns.iter().map(Column::schema).collect();
    let schema = Arc::new(parse_message_type(&format!("message {name} {{\n{lines}}}"))?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("updraft {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(metadata(columns, analysis, origin)))
        .build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    let mut rows = rows.peekable();
    while rows.peek().is_some() {
        let group: Vec<R> = rows.by_ref().take(GROUP).collect();
        let mut row_group = writer.next_row_group()?;
        let mut of = columns.iter();
        while let Some(mut writer) = row_group.next_column()? {
            let column = of.next().ok_or_else(|| wrong("a column too many"))?;
            write(writer.untyped(), &column.get, &group)?;
            writer.close()?;
        }
        row_group.close()?;
    }
    writer.close()?;
    Ok(bytes)
}

fn wrong(what: &str) -> ParquetError {
    ParquetError::General(what.to_owned())
}

/// Values that are there, and which are.
fn known<R, T>(rows: &[R], get: impl Fn(&R) -> Option<T>) -> (Vec<T>, Vec<i16>) {
    let values: Vec<Option<T>> = rows.iter().map(get).collect();
    let present = values.iter().map(|value| i16::from(value.is_some())).collect();
    (values.into_iter().flatten().collect(), present)
}

fn write<R>(column: &mut ColumnWriter<'_>, get: &Get<R>, rows: &[R]) -> Result<()> {
    match (column, get) {
        (ColumnWriter::ByteArrayColumnWriter(writer), Get::Text(get)) => {
            let values: Vec<ByteArray> = rows.iter().map(|row| ByteArray::from(get(row))).collect();
            writer.write_batch(&values, None, None)?;
        }
        (ColumnWriter::DoubleColumnWriter(writer), Get::Each(get)) => {
            let values: Vec<f64> = rows.iter().map(get).collect();
            writer.write_batch(&values, None, None)?;
        }
        (ColumnWriter::DoubleColumnWriter(writer), Get::Real(get)) => {
            let (values, present) = known(rows, get);
            writer.write_batch(&values, Some(&present), None)?;
        }
        (ColumnWriter::Int32ColumnWriter(writer), Get::Slot(get)) => {
            let (values, present) = known(rows, |row| get(row).map(i32::from));
            writer.write_batch(&values, Some(&present), None)?;
        }
        (ColumnWriter::Int64ColumnWriter(writer), Get::Time(get)) => {
            let (values, present) = known(rows, get);
            writer.write_batch(&values, Some(&present), None)?;
        }
        _ => return Err(wrong("a column has another type")),
    }
    Ok(())
}
