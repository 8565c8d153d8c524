//! Small pieces of sentences, and lines that fit a terminal.

pub(super) use crate::workflow::words::{count, list, range, shell};

/// The text, or its beginning with dots if it has more characters.
pub(super) fn shorten(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let kept: String = text.chars().take(width.saturating_sub(3)).collect();
    format!("{kept}...")
}

/// Breaks lines longer than the terminal between words; what follows is indented by four. A word
/// longer than a line stays whole.
pub(super) fn wrap(text: &str, width: Option<usize>) -> String {
    let Some(width) = width else { return text.to_owned() };
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let (mut rest, end) = match line.strip_suffix('\n') {
            Some(line) => (line, "\n"),
            None => (line, ""),
        };
        let mut indent = "";
        while indent.len() + rest.chars().count() > width {
            let room = width.saturating_sub(indent.len());
            let limit = rest.char_indices().nth(room).map_or(rest.len(), |(at, _)| at);
            // A space right after the room still ends a line that fits; leading ones are layout.
            let first = rest.len() - rest.trim_start().len();
            let until = rest[limit..].chars().next().map_or(limit, |next| limit + next.len_utf8());
            let Some(at) = rest[first..until.max(first)].rfind(' ').map(|at| first + at) else {
                break;
            };
            out.push_str(indent);
            out.push_str(rest[..at].trim_end());
            out.push('\n');
            rest = rest[at..].trim_start();
            indent = "    ";
        }
        out.push_str(indent);
        out.push_str(rest);
        out.push_str(end);
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
