//! Layout of the fleet on the ground.

use super::error::TemplateError;
use super::plan::{Grid, Slot};
use super::source::Source;
use super::template::{Selection, Shape, span_of};

pub use crate::show::MAX_DRONES;

/// The grid and its slots, centred on the show origin, filled row by row.
pub(super) fn lay_out(source: &Source<'_>) -> Result<(Grid, Vec<Slot>), TemplateError> {
    let grid = &source.template.grid;
    let spacing_m = source.in_range(&grid.spacing_m, "spacing", "m", 0.5..=1000.0)?;
    let whole = |value: &Option<toml::Spanned<i64>>, what: &str| match value {
        None => Ok(None),
        Some(value) => match usize::try_from(*value.get_ref()) {
            Ok(number) if (1..=MAX_DRONES).contains(&number) => Ok(Some(number)),
            _ => Err(source
                .error(span_of(value), format!("{what} cannot be {}", value.get_ref()))
                .with_help(format!("allowed: 1 to {MAX_DRONES}"))),
        },
    };
    let drones = whole(&grid.drones, "number of drones")?;
    let rows = whole(&grid.rows, "number of rows")?;
    let columns = whole(&grid.columns, "number of columns")?;
    let (rows, columns, drones) = match (rows, columns, drones) {
        (Some(rows), Some(columns), drones) => (rows, columns, drones.unwrap_or(rows * columns)),
        (Some(rows), None, Some(drones)) => (rows, drones.div_ceil(rows), drones),
        (None, Some(columns), Some(drones)) => (drones.div_ceil(columns), columns, drones),
        (None, None, Some(drones)) => {
            let columns = (drones as f64).sqrt().ceil() as usize;
            (drones.div_ceil(columns), columns, drones)
        }
        _ => {
            return Err(source
                .error(span_of(&grid.spacing_m), "[grid] does not say how many drones there are")
                .with_help("give `rows` and `columns`, or `drones`"));
        }
    };
    let place = grid.drones.as_ref().or(grid.rows.as_ref()).and_then(span_of);
    if drones > rows * columns {
        return Err(
            source.error(place, format!("{drones} drones do not fit in {rows} rows of {columns}"))
        );
    }
    if drones > MAX_DRONES {
        return Err(source
            .error(place, format!("{rows} x {columns} are {drones} drones"))
            .with_help(format!("a show has at most {MAX_DRONES} drones")));
    }
    let cell: fn(usize, usize) -> (usize, usize) = match grid.shape {
        Shape::Grid => |index, columns| (index / columns, index % columns),
        Shape::Cross => in_cross,
    };
    let (rows, columns) = match grid.shape {
        Shape::Grid => (rows, columns),
        Shape::Cross => (arm(drones), arm(drones)),
    };
    let centre = |index: usize, count: usize| {
        let value = (index as f64 - (count - 1) as f64 / 2.0) * spacing_m;
        let rounded = (value * 1000.0).round() / 1000.0;
        if rounded == 0.0 { 0.0 } else { rounded }
    };
    let slots = (0..drones)
        .map(|index| {
            let (row, column) = cell(index, columns);
            Slot {
                slot: (index + 1) as u16,
                name: format!("Drone {}", index + 1),
                row: row as u32,
                column: column as u32,
                home_m: [centre(row, rows), centre(column, columns), 0.0],
                group: 0,
            }
        })
        .collect();
    Ok((Grid { rows: rows as u32, columns: columns as u32, spacing_m }, slots))
}

/// Cells along each line of a cross of so many drones, an odd number.
fn arm(drones: usize) -> usize {
    2 * (drones - 1).div_ceil(4) + 1
}

/// Row and column of a drone in a cross whose lines have so many cells: one in the middle, the others around it in turn,
/// so that any number of drones is as balanced as it can be.
fn in_cross(index: usize, cells: usize) -> (usize, usize) {
    let middle = cells / 2;
    let Some(beyond) = index.checked_sub(1) else { return (middle, middle) };
    let out = beyond / 4 + 1;
    match beyond % 4 {
        0 => (middle + out, middle),
        1 => (middle - out, middle),
        2 => (middle, middle + out),
        _ => (middle, middle - out),
    }
}

/// Puts every slot into a group; each slot must be in exactly one.
pub(super) fn assign_groups(source: &Source<'_>, slots: &mut [Slot]) -> Result<(), TemplateError> {
    let groups = &source.template.groups;
    if groups.is_empty() {
        return Ok(());
    }
    let mut owner: Vec<Option<u16>> = vec![None; slots.len()];
    for (index, group) in groups.iter().enumerate() {
        let select = group.select.get_ref();
        let mut taken = 0;
        for (slot, owner) in slots.iter().zip(&mut owner) {
            if !selects(source, group, slot)? {
                continue;
            }
            taken += 1;
            if let Some(other) = owner {
                let other = groups[usize::from(*other)].name.get_ref();
                return Err(source.error(
                    span_of(&group.select),
                    format!("slot {} is already in group \"{other}\"", slot.slot),
                ));
            }
            *owner = Some(index as u16);
        }
        if taken == 0 {
            return Err(source.error(
                span_of(&group.select),
                format!("no drone of this grid is in group \"{}\"", group.name.get_ref()),
            ));
        }
        if let Selection::Slots(list) = select
            && let Some(stray) = list.iter().find(|slot| !(1..=slots.len() as u16).contains(slot))
        {
            return Err(source
                .error(span_of(&group.select), format!("there is no slot {stray}"))
                .with_help(format!("slots are 1 to {}", slots.len())));
        }
    }
    for (slot, owner) in slots.iter_mut().zip(owner) {
        slot.group = owner.ok_or_else(|| {
            source.error(
                groups.last().and_then(|group| span_of(&group.select)),
                format!("slot {} is in no group", slot.slot),
            )
        })?;
    }
    Ok(())
}

fn selects(
    source: &Source<'_>,
    group: &super::template::GroupTemplate,
    slot: &Slot,
) -> Result<bool, TemplateError> {
    let name = match group.select.get_ref() {
        Selection::Slots(list) => return Ok(list.contains(&slot.slot)),
        Selection::Pattern(name) => name.as_str(),
    };
    Ok(match name {
        "all" => true,
        "checkerboard-even" => (slot.row + slot.column).is_multiple_of(2),
        "checkerboard-odd" => !(slot.row + slot.column).is_multiple_of(2),
        "rows-even" => slot.row.is_multiple_of(2),
        "rows-odd" => !slot.row.is_multiple_of(2),
        "columns-even" => slot.column.is_multiple_of(2),
        "columns-odd" => !slot.column.is_multiple_of(2),
        _ => {
            return Err(source
                .error(span_of(&group.select), format!("there is no pattern \"{name}\""))
                .with_help(
                    "patterns: all, checkerboard-even, checkerboard-odd, rows-even, rows-odd, \
                     columns-even, columns-odd; or a list of slot numbers",
                ));
        }
    })
}
