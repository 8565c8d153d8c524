//! Aligned tables for terminals.

use crate::base::layout;

/// A last column of words is cut to this before others are dropped.
const FEW_WORDS: usize = 24;

/// How a column is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A column: heading, alignment, and how early it is dropped when the terminal is narrow (0: never).
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) head: &'static str,
    pub(super) align: Align,
    pub(super) drop: u8,
}

/// A column that goes when room is short, those with the highest `drop` first; 0: never.
pub(super) const fn column(head: &'static str, align: Align, drop: u8) -> Column {
    Column { head, align, drop }
}

/// Lines of a table, heading first, each at most `width` columns of the terminal: a last
/// column of words is cut, then columns with the highest `drop` go. Columns that say nothing in any row are left out.
pub(super) fn lines(columns: &[Column], rows: &[Vec<String>], width: usize) -> Vec<String> {
    let cell = |row: &Vec<String>, index: usize| row.get(index).cloned().unwrap_or_default();
    let size = |index: usize, column: &Column| {
        rows.iter()
            .map(|row| layout::columns(&cell(row, index)))
            .chain([layout::columns(column.head)])
            .max()
            .unwrap_or(0)
    };
    let mut shown: Vec<(usize, &Column, usize)> = columns
        .iter()
        .enumerate()
        .filter(|(index, _)| rows.iter().any(|row| !matches!(cell(row, *index).as_str(), "" | "–")))
        .map(|(index, column)| (index, column, size(index, column)))
        .collect();
    let total = |shown: &[(usize, &Column, usize)]| {
        shown.iter().map(|(_, _, size)| size + 2).sum::<usize>().saturating_sub(2)
    };
    // A last column of words is still useful when cut, down to a few words.
    let words =
        shown.last().filter(|(_, column, _)| column.align == Align::Left).map(|last| last.2);
    if let (Some(full), Some(last)) = (words, shown.last_mut()) {
        last.2 = full.min(FEW_WORDS);
    }
    while total(&shown) > width {
        let Some(worst) = shown.iter().map(|(_, column, _)| column.drop).max().filter(|&d| d > 0)
        else {
            break;
        };
        let Some(place) = shown.iter().rposition(|(_, column, _)| column.drop == worst) else {
            break;
        };
        shown.remove(place);
    }
    let spare = width.saturating_sub(total(&shown));
    if let (Some(full), Some(last)) = (words, shown.last_mut())
        && last.1.align == Align::Left
    {
        last.2 = full.min(last.2 + spare);
    }
    let line = |values: &dyn Fn(usize, &Column) -> String| {
        let cells: Vec<String> = shown
            .iter()
            .map(|(index, column, size)| {
                let text = super::text::shortened(&values(*index, column), *size);
                match column.align {
                    Align::Left => layout::left(&text, *size),
                    Align::Right => layout::right(&text, *size),
                }
            })
            .collect();
        let line = cells.join("  ");
        super::text::shortened(line.trim_end(), width)
    };
    std::iter::once(line(&|_, column| column.head.to_owned()))
        .chain(rows.iter().map(|row| line(&|index, _| cell(row, index))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_tables_cut_the_last_column_then_drop_others() {
        let columns = [
            column("slot", Align::Right, 0),
            column("se", Align::Right, 2),
            column("notes", Align::Left, 1),
        ];
        let rows = vec![vec!["1".into(), "0.25".into(), "a long remark about this drone".into()]];
        let line = |width| lines(&columns, &rows, width)[1].clone();
        assert_eq!(line(80), "   1  0.25  a long remark about this drone");
        assert_eq!(line(40), "   1  0.25  a long remark about this dr…");
        assert_eq!(line(32), "   1  a long remark about this…");
        assert_eq!(line(10), "   1");
    }

    #[test]
    fn columns_that_say_nothing_are_left_out() {
        let columns = [column("a", Align::Right, 0), column("b", Align::Right, 0)];
        let rows = vec![vec!["–".into(), "2".into()]];
        assert_eq!(lines(&columns, &rows, 80), ["b", "2"]);
    }
}
