//! Small pieces of sentences, and lines that fit a terminal.

use crate::base::layout;
pub(super) use crate::workflow::words::{count, list, shell};

/// The text, or its beginning with dots if it has more characters.
pub(super) fn shorten(text: &str, width: usize) -> String {
    if layout::columns(text) <= width {
        return text.to_owned();
    }
    format!("{}...", layout::beginning(text, width.saturating_sub(3)))
}

/// Breaks lines longer than the terminal between words; what follows is indented by four. A word
/// longer than a line stays whole.
pub(super) fn wrap(text: &str, width: Option<usize>) -> String {
    let Some(width) = width else { return text.to_owned() };
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        if layout::columns(line.trim_end_matches('\n')) <= width {
            out.push_str(line);
            continue;
        }
        // Spaces before are layout, spaces behind part a prompt from its answer.
        let words = line.trim();
        let (before, behind) = (line.len() - line.trim_start().len(), line.trim_end().len());
        let options = layout::options(width)
            .initial_indent(line.get(..before).unwrap_or_default())
            .subsequent_indent("    ")
            .break_words(false);
        out.push_str(&textwrap::fill(words, options));
        out.push_str(line.get(behind..).unwrap_or_default());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::wrap;

    #[test]
    fn long_lines_break_between_words_and_lose_nothing() {
        let text = "  check   12.00 m   closest approach between Drone 1 and Drone 2\nshort\n";
        assert_eq!(wrap(text, None), text);
        let narrow = wrap(text, Some(30));
        assert!(narrow.lines().all(|line| line.chars().count() <= 30), "{narrow}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&narrow), words(text));
        assert!(narrow.starts_with("  check   12.00 m"), "{narrow}");
        let word = "x".repeat(40);
        assert_eq!(wrap(&word, Some(10)), word);
    }
}
