//! The wanted columns of the wanted messages.
//!
//! The walk through the log only notes where wanted messages start. Columns are decoded after it,
//! one at a time: each into memory of its final size, by a loop made for its letter.

use super::format::Format;
use super::letter::{Letter, field_text};
use super::reader::{Column, Select, Table};
use super::scan::{Units, Visitor};

/// Notes the messages of a selection.
pub(super) struct Notes<'a> {
    wanted: &'a [Select<'a>],
    /// One per entry of the selection.
    rows: Vec<Rows>,
    /// By type byte: what its messages are noted for.
    plans: Vec<Vec<Plan>>,
}

/// The messages of one table.
#[derive(Default)]
struct Rows {
    starts: Vec<usize>,
    /// Stretches of messages of one definition.
    runs: Vec<Run>,
    layouts: Vec<Layout>,
}

struct Run {
    first_row: usize,
    layout: usize,
}

/// Where a definition has the wanted fields.
struct Layout {
    id: u8,
    /// One per wanted field.
    places: Vec<Option<Place>>,
}

#[derive(Clone, Copy)]
struct Place {
    /// Index of the field in the message.
    index: usize,
    offset: usize,
    letter: Letter,
}

struct Plan {
    table: usize,
    layout: usize,
}

impl<'a> Notes<'a> {
    pub(super) fn new(wanted: &'a [Select<'a>]) -> Self {
        let rows = wanted.iter().map(|_| Rows::default()).collect();
        Self { wanted, rows, plans: (0..256).map(|_| Vec::new()).collect() }
    }

    /// The tables, in the order of the selection.
    pub(super) fn decode(&self, bytes: &[u8], units: &Units) -> Vec<Table> {
        let tables = self.wanted.iter().zip(&self.rows);
        tables.map(|(select, rows)| rows.decode(select, bytes, units)).collect()
    }
}

impl Visitor for Notes<'_> {
    fn defined(&mut self, id: u8, format: &Format) -> bool {
        let mut plans = Vec::new();
        for (table, (select, rows)) in self.wanted.iter().zip(&mut self.rows).enumerate() {
            if select.message == format.name {
                plans.push(Plan { table, layout: rows.layouts.len() });
                rows.layouts.push(Layout::new(id, select, format));
            }
        }
        let wanted = !plans.is_empty();
        self.plans[usize::from(id)] = plans;
        wanted
    }

    #[inline]
    fn message(&mut self, id: u8, _message: &[u8], start: usize) {
        for plan in &self.plans[usize::from(id)] {
            let Some(rows) = self.rows.get_mut(plan.table) else { continue };
            if rows.runs.last().is_none_or(|run| run.layout != plan.layout) {
                rows.runs.push(Run { first_row: rows.starts.len(), layout: plan.layout });
            }
            rows.starts.push(start);
        }
    }
}

impl Layout {
    fn new(id: u8, select: &Select<'_>, format: &Format) -> Self {
        let place = |label: &&str| {
            let (index, field) = format.field(label)?;
            let place = Place { index, offset: field.offset, letter: field.letter };
            // Arrays have no place in a table.
            (field.letter != Letter::Samples).then_some(place)
        };
        Self { id, places: select.fields.iter().map(place).collect() }
    }
}

impl Rows {
    fn decode(&self, select: &Select<'_>, bytes: &[u8], units: &Units) -> Table {
        let mut table = Table {
            message: select.message.to_owned(),
            rows: self.starts.len(),
            ..Table::default()
        };
        for (column, &field) in select.fields.iter().enumerate() {
            let found = |layout: &Layout| Some((layout.id, (*layout.places.get(column)?)?));
            // A definition counts although none of its messages came: the column is empty then.
            let Some((id, place)) = self.layouts.iter().find_map(found) else { continue };
            table.columns.push(Column {
                field: field.to_owned(),
                unit: units.label(id, place.index).map(str::to_owned),
                multiplier: units.multiplier(id, place.index),
            });
            if place.letter.is_text() {
                table.texts.push((field.to_owned(), self.texts(column, bytes)));
            } else {
                table.numbers.push((field.to_owned(), self.numbers(column, bytes)));
            }
        }
        table
    }

    fn numbers(&self, column: usize, bytes: &[u8]) -> Vec<f64> {
        let mut numbers = Vec::with_capacity(self.starts.len());
        for (starts, place) in self.runs(column) {
            match place {
                Some(place) => place.letter.column(bytes, starts, place.offset, &mut numbers),
                None => numbers.resize(numbers.len() + starts.len(), f64::NAN),
            }
        }
        numbers
    }

    fn texts(&self, column: usize, bytes: &[u8]) -> Vec<String> {
        let mut texts = Vec::with_capacity(self.starts.len());
        for (starts, place) in self.runs(column) {
            texts.extend(starts.iter().map(|start| {
                let field = place.filter(|place| place.letter.is_text()).and_then(|place| {
                    let offset = start + place.offset;
                    bytes.get(offset..offset + place.letter.size())
                });
                field.map(field_text).unwrap_or_default()
            }));
        }
        texts
    }

    /// The stretches of rows with the place of a column in each.
    fn runs(&self, column: usize) -> impl Iterator<Item = (&[usize], Option<Place>)> {
        self.runs.iter().enumerate().map(move |(index, run)| {
            let end = self.runs.get(index + 1).map_or(self.starts.len(), |next| next.first_row);
            let starts = self.starts.get(run.first_row..end).unwrap_or_default();
            let layout = self.layouts.get(run.layout);
            (starts, layout.and_then(|layout| *layout.places.get(column)?))
        })
    }
}
