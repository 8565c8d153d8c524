//! The wanted columns of the wanted messages: a plan per type byte, run at each message.

use super::format::Format;
use super::letter::{Letter, field_text};
use super::reader::{Column, Select, Table};
use super::scan::{Units, Visitor};

/// Builds the tables of a selection.
pub(super) struct Columns<'a> {
    wanted: &'a [Select<'a>],
    tables: Vec<Building>,
    /// By type byte.
    plans: Vec<Vec<Plan>>,
}

/// A table in the making.
struct Building {
    rows: usize,
    /// One per wanted field.
    columns: Vec<Cells>,
    /// Type byte and field index that a column was first seen with.
    sources: Vec<Option<(u8, usize)>>,
}

enum Cells {
    /// No format had this field so far.
    Unseen,
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

/// What a message of one type adds to one table.
struct Plan {
    table: usize,
    steps: Vec<Step>,
    /// Columns that this type lacks though another one of the same name has them.
    gaps: Vec<usize>,
}

struct Step {
    column: usize,
    offset: usize,
    letter: Letter,
}

impl<'a> Columns<'a> {
    pub(super) fn new(wanted: &'a [Select<'a>]) -> Self {
        let tables = wanted
            .iter()
            .map(|select| Building {
                rows: 0,
                columns: select.fields.iter().map(|_| Cells::Unseen).collect(),
                sources: vec![None; select.fields.len()],
            })
            .collect();
        Self { wanted, tables, plans: (0..256).map(|_| Vec::new()).collect() }
    }

    /// The finished tables, in the order of the selection.
    pub(super) fn finish(self, units: &Units) -> Vec<Table> {
        let mut tables = Vec::with_capacity(self.tables.len());
        for (select, building) in self.wanted.iter().zip(self.tables) {
            let mut table = Table {
                message: select.message.to_owned(),
                rows: building.rows,
                ..Table::default()
            };
            let parts = select.fields.iter().zip(building.columns).zip(building.sources);
            for ((&field, cells), source) in parts {
                let Some((id, index)) = source else { continue };
                table.columns.push(Column {
                    field: field.to_owned(),
                    unit: units.label(id, index).map(str::to_owned),
                    multiplier: units.multiplier(id, index),
                });
                match cells {
                    Cells::Numbers(numbers) => table.numbers.push((field.to_owned(), numbers)),
                    Cells::Texts(texts) => table.texts.push((field.to_owned(), texts)),
                    Cells::Unseen => {}
                }
            }
            tables.push(table);
        }
        tables
    }
}

impl Visitor for Columns<'_> {
    fn defined(&mut self, id: u8, format: &Format) -> bool {
        let mut plans = Vec::new();
        for (table, (select, building)) in self.wanted.iter().zip(&mut self.tables).enumerate() {
            if select.message != format.name {
                continue;
            }
            let mut steps = Vec::new();
            for (column, label) in select.fields.iter().enumerate() {
                let Some((index, field)) = format.field(label) else { continue };
                if field.letter == Letter::Samples {
                    continue;
                }
                let cells = &mut building.columns[column];
                match (&cells, field.letter.is_text()) {
                    (Cells::Unseen, true) => {
                        *cells = Cells::Texts(vec![String::new(); building.rows]);
                    }
                    (Cells::Unseen, false) => {
                        *cells = Cells::Numbers(vec![f64::NAN; building.rows]);
                    }
                    (Cells::Texts(_), true) | (Cells::Numbers(_), false) => {}
                    // The field turned from text to number or back: nothing to add.
                    _ => continue,
                }
                building.sources[column].get_or_insert((id, index));
                steps.push(Step { column, offset: field.offset, letter: field.letter });
            }
            plans.push(Plan { table, steps, gaps: Vec::new() });
        }
        self.plans[usize::from(id)] = plans;
        self.find_gaps();
        !self.plans[usize::from(id)].is_empty()
    }

    #[inline]
    fn message(&mut self, id: u8, message: &[u8]) {
        for plan in &self.plans[usize::from(id)] {
            let Some(building) = self.tables.get_mut(plan.table) else { continue };
            building.rows += 1;
            for step in &plan.steps {
                let bytes = message.get(step.offset..).unwrap_or_default();
                match building.columns.get_mut(step.column) {
                    Some(Cells::Numbers(numbers)) => numbers.push(step.letter.number(bytes)),
                    Some(Cells::Texts(texts)) => {
                        let field = bytes.get(..step.letter.size()).unwrap_or_default();
                        texts.push(field_text(field));
                    }
                    _ => {}
                }
            }
            for &gap in &plan.gaps {
                match building.columns.get_mut(gap) {
                    Some(Cells::Numbers(numbers)) => numbers.push(f64::NAN),
                    Some(Cells::Texts(texts)) => texts.push(String::new()),
                    _ => {}
                }
            }
        }
    }
}

impl Columns<'_> {
    /// Types of one name may differ in their fields, and a new column must not stay shorter.
    fn find_gaps(&mut self) {
        for plan in self.plans.iter_mut().flatten() {
            let columns = &self.tables[plan.table].columns;
            plan.gaps = (0..columns.len())
                .filter(|&column| !matches!(columns[column], Cells::Unseen))
                .filter(|&column| plan.steps.iter().all(|step| step.column != column))
                .collect();
        }
    }
}
