//! The wanted columns of the wanted messages.
//!
//! The walk through the log only notes where wanted messages start. As soon as a few of one type
//! have come they are decoded, column by column, by a loop made for the letter: late enough to make
//! the loop worth its start, early enough to find the messages still in the processor's cache.

use super::format::Format;
use super::letter::{Letter, field_text};
use super::reader::{Column, Select, Table};
use super::scan::{Units, Visitor};
use super::window::Window;

/// Messages of one type that are decoded together. At a kilobyte or so of log from one to the next
/// of a type they lie in a second-level cache.
const BLOCK: usize = 64;

/// Room for rows beyond those expected.
const SPARE: f64 = 1.02;
/// A message with a time is longer than this.
const LEAST_MESSAGE_BYTES: usize = 12;

/// Takes the messages of a selection.
pub(super) struct Notes<'a> {
    wanted: &'a [Select<'a>],
    /// One per entry of the selection.
    rows: Vec<Rows>,
    /// By type byte: what its messages are noted for.
    plans: Vec<Vec<Plan>>,
}

/// The messages of one table.
struct Rows {
    /// Rows that are decoded.
    count: usize,
    /// Where in the window the next ones start, all of them of the layout `current`.
    pending: Vec<usize>,
    current: usize,
    layouts: Vec<Layout>,
    /// One per wanted field; `None` until a definition has it.
    columns: Vec<Option<Found>>,
}

/// A wanted field that the log has.
struct Found {
    /// The first type that has it, and which of its fields it is.
    id: u8,
    index: usize,
    values: Values,
}

enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

/// Where a definition has the wanted fields.
struct Layout {
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
        let rows = wanted.iter().map(Rows::new).collect();
        Self { wanted, rows, plans: (0..256).map(|_| Vec::new()).collect() }
    }

    /// The tables, in the order of the selection.
    pub(super) fn tables(self, units: &Units) -> Vec<Table> {
        let tables = self.wanted.iter().zip(self.rows);
        tables.map(|(select, rows)| rows.table(select, units)).collect()
    }
}

impl Visitor for Notes<'_> {
    fn defined(&mut self, id: u8, format: &Format, window: Window<'_>) -> bool {
        let mut plans = Vec::new();
        for (table, (select, rows)) in self.wanted.iter().zip(&mut self.rows).enumerate() {
            if select.message == format.name {
                plans.push(Plan { table, layout: rows.layouts.len() });
                rows.define(id, Layout::new(select, format), window);
            }
        }
        let wanted = !plans.is_empty();
        self.plans[usize::from(id)] = plans;
        wanted
    }

    #[inline]
    fn message(&mut self, id: u8, _message: &[u8], window: Window<'_>, start: usize) {
        for plan in &self.plans[usize::from(id)] {
            let Some(rows) = self.rows.get_mut(plan.table) else { continue };
            if rows.pending.len() == BLOCK || rows.current != plan.layout {
                rows.decode(window);
                rows.current = plan.layout;
            }
            rows.pending.push(start);
        }
    }

    fn leave(&mut self, window: Window<'_>) {
        for rows in &mut self.rows {
            rows.decode(window);
        }
    }
}

impl Layout {
    fn new(select: &Select<'_>, format: &Format) -> Self {
        let place = |label: &&str| {
            let (index, field) = format.field(label)?;
            let place = Place { index, offset: field.offset, letter: field.letter };
            // Arrays have no place in a table.
            (field.letter != Letter::Samples).then_some(place)
        };
        Self { places: select.fields.iter().map(place).collect() }
    }
}

impl Rows {
    fn new(select: &Select<'_>) -> Self {
        Self {
            count: 0,
            pending: Vec::with_capacity(BLOCK),
            current: 0,
            layouts: Vec::new(),
            columns: select.fields.iter().map(|_| None).collect(),
        }
    }

    /// Adds a layout. A definition counts although none of its messages may come: its columns are
    /// there then.
    fn define(&mut self, id: u8, layout: Layout, window: Window<'_>) {
        self.decode(window);
        for (column, place) in self.columns.iter_mut().zip(&layout.places) {
            if let (None, Some(place)) = (&column, place) {
                let values = if place.letter.is_text() {
                    Values::Texts(vec![String::new(); self.count])
                } else {
                    Values::Numbers(vec![f64::NAN; self.count])
                };
                *column = Some(Found { id, index: place.index, values });
            }
        }
        self.layouts.push(layout);
    }

    /// Decodes what is pending.
    #[inline(never)]
    fn decode(&mut self, window: Window<'_>) {
        let Some(layout) = self.layouts.get(self.current) else { return };
        let (Some(first), Some(last)) = (self.pending.first(), self.pending.last()) else { return };
        // A type mostly comes as often in the rest of the log as up to here. Memory that turns out
        // to be too much is never touched.
        let rows = self.count + self.pending.len();
        let share = rows as f64 / (window.base + last + 1) as f64;
        let rest = window.size.saturating_sub(window.base + first);
        let expected = ((rest as f64 * share * SPARE) as usize).min(rest / LEAST_MESSAGE_BYTES);
        for (column, place) in self.columns.iter_mut().zip(&layout.places) {
            match column.as_mut().map(|found| &mut found.values) {
                Some(Values::Numbers(numbers)) => {
                    if numbers.capacity() - numbers.len() < self.pending.len() {
                        numbers.reserve_exact(expected.max(rows / 4 + self.pending.len()));
                    }
                    match place {
                        Some(Place { offset, letter, .. }) => {
                            letter.column(window.bytes, &self.pending, *offset, numbers);
                        }
                        None => numbers.resize(rows, f64::NAN),
                    }
                }
                Some(Values::Texts(texts)) => {
                    texts.extend(
                        self.pending.iter().map(|start| text(window.bytes, *start, *place)),
                    );
                }
                None => {}
            }
        }
        self.count += self.pending.len();
        self.pending.clear();
    }

    fn table(self, select: &Select<'_>, units: &Units) -> Table {
        let mut table =
            Table { message: select.message.to_owned(), rows: self.count, ..Table::default() };
        for (column, &field) in self.columns.into_iter().zip(select.fields) {
            let Some(Found { id, index, values }) = column else { continue };
            table.columns.push(Column {
                field: field.to_owned(),
                unit: units.label(id, index).map(str::to_owned),
                multiplier: units.multiplier(id, index),
            });
            match values {
                Values::Numbers(numbers) => table.numbers.push((field.to_owned(), numbers)),
                Values::Texts(texts) => table.texts.push((field.to_owned(), texts)),
            }
        }
        table
    }
}

/// The text of a field; empty where a definition has none there.
fn text(bytes: &[u8], start: usize, place: Option<Place>) -> String {
    let field = place.filter(|place| place.letter.is_text()).and_then(|place| {
        let offset = start + place.offset;
        bytes.get(offset..offset + place.letter.size())
    });
    field.map(field_text).unwrap_or_default()
}
