//! Aligned tables for terminals.

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

/// Lines of a table, heading first, each at most `width` characters: columns with the highest `drop`
/// go first, then the last column is cut. Columns that say nothing in any row are left out.
pub(super) fn lines(columns: &[Column], rows: &[Vec<String>], width: usize) -> Vec<String> {
    let cell = |row: &Vec<String>, index: usize| row.get(index).cloned().unwrap_or_default();
    let size = |index: usize, column: &Column| {
        rows.iter()
            .map(|row| cell(row, index).chars().count())
            .chain([column.head.chars().count()])
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
    while total(&shown) > width {
        let Some(worst) = shown.iter().map(|(_, column, _)| column.drop).max().filter(|&d| d > 0)
        else {
            break;
        };
        let Some(place) = shown.iter().rposition(|(_, column, _)| column.drop == worst) else {
            break;
        };
        // A last column of words is still useful when cut.
        let rest = width.saturating_sub(total(&shown) - shown[place].2);
        if place + 1 == shown.len() && shown[place].1.align == Align::Left && rest >= 12 {
            shown[place].2 = rest;
            break;
        }
        shown.remove(place);
    }
    let line = |values: &dyn Fn(usize, &Column) -> String| {
        let cells: Vec<String> = shown
            .iter()
            .map(|(index, column, size)| {
                let text = super::text::shortened(&values(*index, column), *size);
                match column.align {
                    Align::Left => format!("{text:<size$}"),
                    Align::Right => format!("{text:>size$}"),
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

    fn column(head: &'static str, align: Align, drop: u8) -> Column {
        Column { head, align, drop }
    }

    #[test]
    fn narrow_tables_drop_columns_and_cut_the_last() {
        let columns = [
            column("slot", Align::Right, 0),
            column("se", Align::Right, 2),
            column("notes", Align::Left, 1),
        ];
        let rows = vec![vec!["1".into(), "0.25".into(), "a long remark about this".into()]];
        assert_eq!(lines(&columns, &rows, 80)[1], "   1  0.25  a long remark about this");
        assert_eq!(lines(&columns, &rows, 30)[1], "   1  a long remark about this");
        assert_eq!(lines(&columns, &rows, 20)[1], "   1  a long remark…");
        assert_eq!(lines(&columns, &rows, 10)[1], "   1");
    }
}
