//! The results as a table: a row for each campaign that was flown, with its seed, levels and outcome.

use std::io::{self, Write};

use super::design::{Drawn, Item};
use super::factor::{Factor, Level, Levels};
use super::item::Row;
use super::outcome::{OUTCOMES, Outcome};
use super::template::SensitivityPlan;

/// A column of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name of the column, as in the head of the table.
    pub name: String,
    /// Type of its values.
    pub kind: Kind,
}

/// Type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers of 64 bits.
    Integer,
    /// Numbers with fractions.
    Number,
    /// Texts of any length.
    Text,
}

/// A value of the table.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Nothing: it could not be told.
    Empty,
    /// A whole number.
    Integer(i64),
    /// A number with a fraction.
    Number(f64),
    /// A text of any length.
    Text(String),
}

/// Columns of a study's table.
pub fn columns(study: &SensitivityPlan) -> Vec<Column> {
    let column = |name: &str, kind| Column { name: name.to_owned(), kind };
    let mut columns = vec![column("item", Kind::Integer), column("seed", Kind::Integer)];
    columns.extend(study.factors.iter().map(|factor| column(&factor.name, kind_of(factor))));
    columns.extend(OUTCOMES.iter().map(|outcome| column(outcome.name, Kind::Number)));
    columns.push(column("naming", Kind::Text));
    columns.push(column("found", Kind::Text));
    columns.push(column("warnings", Kind::Integer));
    columns.push(column("lost", Kind::Text));
    columns
}

fn kind_of(factor: &Factor) -> Kind {
    let is_whole = |level: &Level| level.0.is_integer();
    match &factor.levels {
        Levels::Range(range) if range.whole => Kind::Integer,
        Levels::List(levels) if levels.iter().all(is_whole) => Kind::Integer,
        levels if levels.are_numbers() => Kind::Number,
        _ => Kind::Text,
    }
}

/// Rows of the campaigns that were flown, one after the other.
pub fn rows<'a>(
    study: &'a SensitivityPlan,
    drawn: &'a Drawn<'a>,
    rows: &'a [Option<Row>],
) -> impl Iterator<Item = Vec<Value>> + 'a {
    let of = move |(index, row): (usize, &Option<Row>)| {
        Some(values(study, &drawn.item(index), row.as_ref()?))
    };
    rows.iter().enumerate().filter_map(of)
}

fn values(study: &SensitivityPlan, item: &Item, row: &Row) -> Vec<Value> {
    let text = |text: &str| Value::Text(text.to_owned());
    let mut values = vec![Value::Integer(item.index as i64), Value::Integer(item.seed as i64)];
    values.extend(study.factors.iter().zip(&item.levels).map(|(factor, level)| {
        match (kind_of(factor), level.number()) {
            (Kind::Integer, Some(number)) => Value::Integer(number as i64),
            (Kind::Number, Some(number)) => Value::Number(number),
            _ => Value::Text(level.to_string()),
        }
    }));
    let nothing = Outcome::default();
    let outcome = row.result.as_ref().ok();
    values.extend(OUTCOMES.iter().map(|column| {
        let number = outcome.and_then(|outcome| (column.get)(outcome));
        number.filter(|number| number.is_finite()).map_or(Value::Empty, Value::Number)
    }));
    let naming = outcome.unwrap_or(&nothing).naming.as_ref();
    values.push(naming.map_or(Value::Empty, |naming| text(&naming.called.to_string())));
    values.push(naming.map_or(Value::Empty, |naming| text(&naming.found.join("; "))));
    values.push(Value::Integer(i64::from(row.warnings)));
    values.push(row.result.as_ref().err().map_or(Value::Empty, |reason| text(reason)));
    values
}

/// Writes the table as CSV, row after row. What could not be told is empty.
///
/// # Errors
/// That of the output.
pub fn write_csv(
    out: &mut impl Write,
    study: &SensitivityPlan,
    drawn: &Drawn<'_>,
    of_all: &[Option<Row>],
) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(columns(study).iter().map(|column| column.name.as_str()))?;
    for row in rows(study, drawn, of_all) {
        let texts = row.into_iter().map(|value| match value {
            Value::Empty => String::new(),
            Value::Integer(number) => number.to_string(),
            Value::Number(number) => number.to_string(),
            Value::Text(text) => text,
        });
        csv.write_record(texts)?;
    }
    csv.flush()
}
