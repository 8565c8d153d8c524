//! The table of a sensitivity study as Parquet, written in groups of rows: only one group is in memory.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::study::sensitivity::table::{Column, Kind, Value, columns, rows};
use crate::study::sensitivity::{Drawn, Row, SensitivityPlan};

/// Rows that are held and written at a time.
const GROUP: usize = 20_000;

/// Writes the table: all columns are optional, as what could not be told is null.
///
/// # Errors
/// That of the output.
pub fn write(
    out: &mut (impl Write + Send),
    study: &SensitivityPlan,
    drawn: &Drawn<'_>,
    of_all: &[Option<Row>],
) -> Result<()> {
    let columns = columns(study);
    let fields = columns.iter().map(field).collect::<Result<Vec<_>>>()?;
    let schema = Type::group_type_builder("campaigns").with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("updraft {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    let mut rows = rows(study, drawn, of_all).peekable();
    while rows.peek().is_some() {
        let group: Vec<Vec<Value>> = rows.by_ref().take(GROUP).collect();
        let mut row_group = writer.next_row_group()?;
        let mut index = 0;
        while let Some(mut column) = row_group.next_column()? {
            write_column(column.untyped(), index, &group)?;
            column.close()?;
            index += 1;
        }
        row_group.close()?;
    }
    writer.close()?;
    Ok(())
}

fn field(column: &Column) -> Result<Arc<Type>> {
    let (physical, logical) = match column.kind {
        Kind::Integer => (PhysicalType::INT64, None),
        Kind::Number => (PhysicalType::DOUBLE, None),
        Kind::Text => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(field))
}

fn write_column(column: &mut ColumnWriter<'_>, index: usize, rows: &[Vec<Value>]) -> Result<()> {
    let values = || rows.iter().map(|row| row.get(index).unwrap_or(&Value::Empty));
    let present: Vec<i16> = values().map(|value| i16::from(*value != Value::Empty)).collect();
    match column {
        ColumnWriter::Int64ColumnWriter(writer) => {
            let of = |value: &Value| match value {
                Value::Integer(number) => Some(*number),
                _ => None,
            };
            writer.write_batch(
                &values().filter_map(of).collect::<Vec<_>>(),
                Some(&present),
                None,
            )?;
        }
        ColumnWriter::DoubleColumnWriter(writer) => {
            let of = |value: &Value| match value {
                Value::Number(number) => Some(*number),
                _ => None,
            };
            writer.write_batch(
                &values().filter_map(of).collect::<Vec<_>>(),
                Some(&present),
                None,
            )?;
        }
        ColumnWriter::ByteArrayColumnWriter(writer) => {
            let of = |value: &Value| match value {
                Value::Text(text) => Some(ByteArray::from(text.as_str())),
                _ => None,
            };
            writer.write_batch(
                &values().filter_map(of).collect::<Vec<_>>(),
                Some(&present),
                None,
            )?;
        }
        _ => return Err(ParquetError::General(format!("column {index} has another type"))),
    }
    Ok(())
}
