//! The measured fields as Parquet: the table of `fields.rs`, typed and a third of the size.

use std::sync::Arc;

use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::analysis::result::Analysis;

use super::fields::{FieldRow, has_posterior, rows};
use super::fields_grid::{self, GridRow};

/// The columns of [`super::fields::COLUMNS`]: what may be missing is optional.
const SCHEMA: &str = "
message updraft {
  REQUIRED BYTE_ARRAY flight (STRING);
  REQUIRED DOUBLE time_s;
  OPTIONAL INT32 slot (INTEGER(16, false));
  REQUIRED BYTE_ARRAY drone (STRING);
  OPTIONAL DOUBLE x_m;
  OPTIONAL DOUBLE y_m;
  OPTIONAL DOUBLE z_m;
  OPTIONAL DOUBLE w_mps;
  OPTIONAL DOUBLE sd_mps;
  OPTIONAL DOUBLE low_mps;
  OPTIONAL DOUBLE high_mps;
  REQUIRED BYTE_ARRAY flags (STRING);
  OPTIONAL DOUBLE truth_mps;
";
/// The columns of [`super::fields::POSTERIOR_COLUMNS`].
const POSTERIOR_SCHEMA: &str = "
  OPTIONAL DOUBLE posterior_mps;
  OPTIONAL DOUBLE posterior_sd_mps;
";
/// The columns of [`super::fields_grid::COLUMNS`]; rows have all of them.
const GRID_SCHEMA: &str = "
message updraft_grid {
  REQUIRED BYTE_ARRAY flight (STRING);
  REQUIRED DOUBLE time_s;
  REQUIRED DOUBLE x_m;
  REQUIRED DOUBLE y_m;
  REQUIRED DOUBLE z_m;
  REQUIRED DOUBLE w_mps;
  REQUIRED DOUBLE sd_mps;
}";
/// Rows that are held and written at a time.
const GROUP: usize = 200_000;

/// Renders the measured fields as a Parquet file.
///
/// # Errors
/// A bug of this program: nothing outside of memory is touched.
pub fn parquet(analysis: &Analysis) -> Result<Vec<u8>> {
    let posterior = if has_posterior(analysis) { POSTERIOR_SCHEMA } else { "" };
    render(&format!("{SCHEMA}{posterior}}}"), rows(analysis), write_column)
}

/// Renders the posterior on its grid as a Parquet file.
///
/// # Errors
/// A bug of this program: nothing outside of memory is touched.
pub fn grid_parquet(analysis: &Analysis) -> Result<Vec<u8>> {
    render(GRID_SCHEMA, fields_grid::rows(analysis), write_grid_column)
}

fn render<Row>(
    schema: &str,
    rows: impl Iterator<Item = Row>,
    write: fn(&mut ColumnWriter<'_>, usize, &[Row]) -> Result<()>,
) -> Result<Vec<u8>> {
    let schema = Arc::new(parse_message_type(schema)?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("updraft {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    let mut rows = rows.peekable();
    while rows.peek().is_some() {
        let group: Vec<Row> = rows.by_ref().take(GROUP).collect();
        let mut row_group = writer.next_row_group()?;
        let mut index = 0;
        while let Some(mut column) = row_group.next_column()? {
            write(column.untyped(), index, &group)?;
            column.close()?;
            index += 1;
        }
        row_group.close()?;
    }
    writer.close()?;
    Ok(bytes)
}

fn write_grid_column(column: &mut ColumnWriter<'_>, index: usize, rows: &[GridRow]) -> Result<()> {
    match column {
        ColumnWriter::ByteArrayColumnWriter(writer) => {
            let values: Vec<ByteArray> =
                rows.iter().map(|row| ByteArray::from(row.flight.as_str())).collect();
            writer.write_batch(&values, None, None)?;
        }
        ColumnWriter::DoubleColumnWriter(writer) => {
            let number = |row: &GridRow| match index {
                1 => row.time_s,
                2 => row.x_m,
                3 => row.y_m,
                4 => row.z_m,
                5 => row.w_mps,
                _ => row.sd_mps,
            };
            let values: Vec<f64> = rows.iter().map(number).collect();
            writer.write_batch(&values, None, None)?;
        }
        _ => return Err(ParquetError::General(format!("column {index} has another type"))),
    }
    Ok(())
}

fn write_column(column: &mut ColumnWriter<'_>, index: usize, rows: &[FieldRow]) -> Result<()> {
    match column {
        ColumnWriter::ByteArrayColumnWriter(writer) => {
            let text = |row: &FieldRow| match index {
                0 => ByteArray::from(row.flight.as_str()),
                3 => ByteArray::from(row.drone.as_str()),
                _ => ByteArray::from(row.flags.as_str()),
            };
            let values: Vec<ByteArray> = rows.iter().map(text).collect();
            writer.write_batch(&values, None, None)?;
        }
        ColumnWriter::Int32ColumnWriter(writer) => {
            let values: Vec<i32> = rows.iter().filter_map(|r| r.slot).map(i32::from).collect();
            let present: Vec<i16> = rows.iter().map(|r| i16::from(r.slot.is_some())).collect();
            writer.write_batch(&values, Some(&present), None)?;
        }
        ColumnWriter::DoubleColumnWriter(writer) if index == 1 => {
            let values: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
            writer.write_batch(&values, None, None)?;
        }
        ColumnWriter::DoubleColumnWriter(writer) => {
            let number = |row: &FieldRow| match index {
                4 => row.x_m,
                5 => row.y_m,
                6 => row.z_m,
                7 => row.w_mps,
                8 => row.sd_mps,
                9 => row.low_mps,
                10 => row.high_mps,
                12 => row.truth_mps,
                13 => row.posterior_mps,
                _ => row.posterior_sd_mps,
            };
            let values: Vec<f64> = rows.iter().filter_map(number).collect();
            let present: Vec<i16> =
                rows.iter().map(|row| i16::from(number(row).is_some())).collect();
            writer.write_batch(&values, Some(&present), None)?;
        }
        _ => return Err(ParquetError::General(format!("column {index} has another type"))),
    }
    Ok(())
}
