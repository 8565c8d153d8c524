//! Text in the columns and lines of a terminal.
//!
//! A column is what a terminal draws: a wide character takes two, a combining one takes none
//! (Unicode Standard Annex 11). Text of others must be [`plain`](super::plain) before.

use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm};
use unicode_width::{UnicodeWidthChar as _, UnicodeWidthStr as _};

/// Columns that a text takes.
pub fn columns(text: &str) -> usize {
    text.width()
}

/// The beginning of a text that fits into so many columns.
pub fn beginning(text: &str, most: usize) -> &str {
    let mut taken = 0;
    let end = text.char_indices().find(|(_, letter)| {
        taken += letter.width().unwrap_or(0);
        taken > most
    });
    end.and_then(|(at, _)| text.get(..at)).unwrap_or(text)
}

/// A text with spaces behind it, to so many columns.
pub fn left(text: &str, width: usize) -> String {
    format!("{text}{}", spaces(text, width))
}

/// A text with spaces before it, to so many columns.
pub fn right(text: &str, width: usize) -> String {
    format!("{}{text}", spaces(text, width))
}

fn spaces(text: &str, width: usize) -> String {
    " ".repeat(width.saturating_sub(columns(text)))
}

/// Cells in columns two spaces apart, each as wide as its widest cell.
pub fn aligned(lines: &[Vec<String>]) -> Vec<String> {
    let mut widths: Vec<usize> = Vec::new();
    for line in lines {
        widths.resize(widths.len().max(line.len()), 0);
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = columns(cell).max(*width);
        }
    }
    let line = |cells: &Vec<String>| {
        let cells: Vec<String> =
            cells.iter().zip(&widths).map(|(cell, width)| left(cell, *width)).collect();
        cells.join("  ").trim_end().to_owned()
    };
    lines.iter().map(line).collect()
}

/// Options by which text is broken: at spaces and nowhere else, each line as long as it goes. A word that is longer
/// than a line is broken, unless [`Options::break_words`] says otherwise.
pub fn options<'a>(width: usize) -> Options<'a> {
    Options::new(width)
        .word_separator(WordSeparator::AsciiSpace)
        .word_splitter(WordSplitter::NoHyphenation)
        .wrap_algorithm(WrapAlgorithm::FirstFit)
}

/// A text whose words are one space apart, broken into lines.
pub fn wrapped(text: &str, options: Options<'_>) -> Vec<String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    textwrap::wrap(&words.join(" "), options).into_iter().map(String::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_letters_take_two_columns_and_accents_none() {
        assert_eq!(columns("abc ±²…–"), 8);
        assert_eq!((columns("無人機"), columns("e\u{301}")), (6, 1));
        assert_eq!((beginning("無人機", 5), beginning("abc", 5)), ("無人", "abc"));
        assert_eq!((left("無", 4).as_str(), right("無", 4).as_str()), ("無  ", "  無"));
        assert_eq!(left("too long", 3), "too long");
    }

    #[test]
    fn columns_stand_below_each_other() {
        let lines = [vec!["slot", "name", "state"], vec!["12", "無人", ""], vec!["3", "a", "ok"]];
        let lines = lines.map(|line| line.into_iter().map(str::to_owned).collect());
        assert_eq!(aligned(&lines), ["slot  name  state", "12    無人", "3     a     ok"]);
    }

    #[test]
    fn lines_break_at_spaces_alone() {
        let text = "take-off  and\nlanding 無人機 無人機";
        let lines = wrapped(text, options(10).subsequent_indent("  "));
        assert_eq!(lines, ["take-off", "  and", "  landing", "  無人機", "  無人機"]);
        assert_eq!(wrapped("/a/long/path x", options(6)), ["/a/lon", "g/path", "x"]);
        assert_eq!(
            wrapped("a /a/long/path x", options(6).break_words(false)),
            ["a", "/a/long/path", "x"]
        );
        assert_eq!(wrapped("", options(6)), [""]);
    }
}
