//! Text from others, made harmless.
//!
//! Names in shows, words of drones and servers, names of files: whoever wrote them may have put
//! characters there that drive a terminal (escape sequences, carriage returns), begin a line that
//! looks like one of ours, or turn the order of what is read around. Such a text passes [`plain`]
//! where it comes in (or [`Shown`], for the name of a file), and everything passes [`for_terminal`]
//! where it goes out.

use std::borrow::Cow;
use std::fmt::{self, Write as _};
use std::path::Path;

/// Escape sequences that this program prints itself: reset, bold, dim and four colours.
pub const STYLES: [&str; 7] =
    ["\u{1b}[0m", "\u{1b}[1m", "\u{1b}[2m", "\u{1b}[31m", "\u{1b}[32m", "\u{1b}[33m", "\u{1b}[34m"];

/// Whether a character does more than show itself: it moves the cursor, ends the line, turns the
/// direction of writing, or is invisible.
pub fn acts(c: char) -> bool {
    c.is_control()
        || matches!(c,
            // Marks of direction, and what overrides it.
            '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{206f}'
            // Separators of lines and paragraphs.
            | '\u{2028}' | '\u{2029}'
            // Not seen.
            | '\u{180e}' | '\u{200b}' | '\u{2060}'..='\u{2065}' | '\u{feff}'
            | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}'
            // No characters, and not allowed in XML.
            | '\u{fffe}' | '\u{ffff}')
}

/// What is shown instead of a character that [`acts`]: its picture where Unicode has one.
fn picture(c: char) -> char {
    match c {
        '\0'..='\u{1f}' => char::from_u32(0x2400 + u32::from(c)).unwrap_or('\u{fffd}'),
        '\u{7f}' => '\u{2421}',
        _ => '\u{fffd}',
    }
}

/// One line of text that does nothing but be read: `GO\r\u{1b}[2J` becomes `GO␍␛[2J`.
///
/// ```
/// use untrusted_io::plain::plain;
///
/// assert_eq!(plain("Drone 1"), "Drone 1");
/// assert_eq!(plain("GO\r\u{1b}[2J\u{202e}"), "GO␍␛[2J\u{fffd}");
/// ```
pub fn plain(text: &str) -> Cow<'_, str> {
    replaced(text, |_, c| acts(c).then(|| picture(c).into()))
}

/// Makes an owned string [`plain`], without copying if it already is.
pub fn plain_string(text: String) -> String {
    match plain(&text) {
        Cow::Borrowed(_) => text,
        Cow::Owned(plain) => plain,
    }
}

/// Text made safe for a terminal: line feeds and tabs stay, other control characters become
/// pictures. With `styles`, this program's own escape sequences for colours and weights stay too.
pub fn for_terminal(text: &str, styles: bool) -> Cow<'_, str> {
    replaced(text, |rest, c| {
        let is_ours = matches!(c, '\n' | '\t')
            || (styles && c == '\u{1b}' && STYLES.iter().any(|style| rest.starts_with(style)));
        (!is_ours && acts(c)).then(|| picture(c).into())
    })
}

/// JSON text made safe for a terminal without changing its meaning: characters that act on a
/// terminal ([`acts`]) become `\u` escapes; line feeds stay.
pub fn json_for_terminal(json: &str) -> Cow<'_, str> {
    replaced(json, |_, c| {
        (c != '\n' && acts(c)).then(|| {
            let mut units = [0; 2];
            let units = c.encode_utf16(&mut units);
            let mut escape = String::new();
            for unit in units {
                let _ = write!(escape, "\\u{unit:04x}");
            }
            escape.into()
        })
    })
}

/// What stands in for a character.
enum Instead {
    Char(char),
    Text(String),
}

impl From<char> for Instead {
    fn from(c: char) -> Self {
        Self::Char(c)
    }
}

impl From<String> for Instead {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

/// The text with some characters replaced; `instead` gets the rest of it from each on.
fn replaced(text: &str, instead: impl Fn(&str, char) -> Option<Instead>) -> Cow<'_, str> {
    // Nearly all text is of this kind.
    if text.bytes().all(|byte| matches!(byte, b' '..=b'~')) {
        return Cow::Borrowed(text);
    }
    let mut out: Option<String> = None;
    for (at, c) in text.char_indices() {
        let rest = text.get(at..).unwrap_or_default();
        match instead(rest, c) {
            None => {
                if let Some(out) = &mut out {
                    out.push(c);
                }
            }
            Some(new) => {
                let out = out.get_or_insert_with(|| text.get(..at).unwrap_or_default().to_owned());
                match new {
                    Instead::Char(c) => out.push(c),
                    Instead::Text(text) => out.push_str(&text),
                }
            }
        }
    }
    out.map_or(Cow::Borrowed(text), Cow::Owned)
}

/// Display of a path as [`plain`] text, in place of `Path::display`, which passes control
/// characters in a file's name on to the terminal.
pub trait Shown {
    /// The path as one line of text.
    fn shown(&self) -> ShownPath<'_>;
}

impl Shown for Path {
    fn shown(&self) -> ShownPath<'_> {
        ShownPath(self)
    }
}

/// A path as one line of text.
#[derive(Clone, Copy, Debug)]
pub struct ShownPath<'a>(&'a Path);

impl fmt::Display for ShownPath<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&plain(&self.0.to_string_lossy()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything that has been used against terminals and readers.
    const HOSTILE: &str = "a\u{1b}[32mGO\u{1b}[0m\r\nb\u{8}\u{7}\u{7f}\u{9b}2J\u{85}\u{202e}c\u{2066}\u{200f}\u{2028}d";

    #[test]
    fn nothing_acts_in_plain_text_and_letters_stay() {
        let shown = plain(HOSTILE);
        assert!(!shown.contains(acts), "{shown:?}");
        assert_eq!(shown, "a␛[32mGO␛[0m␍␊b␈␇␡\u{fffd}2J\u{fffd}\u{fffd}c\u{fffd}\u{fffd}\u{fffd}d");
        assert_eq!(plain(&shown), shown, "once is enough");
        for text in ["Tölgyes 1", "ドローン", "עברית", "zero\u{200d}width joiner", "✈ µs"]
        {
            assert!(matches!(plain(text), Cow::Borrowed(same) if same == text));
        }
    }

    #[test]
    fn only_own_styles_and_lines_go_to_a_terminal() {
        let own = "\u{1b}[1mbold\u{1b}[0m\n\ttab";
        assert_eq!(for_terminal(own, true), own);
        assert_eq!(for_terminal(own, false), "␛[1mbold␛[0m\n\ttab");
        for text in ["\u{1b}[2J", "\u{1b}]0;title\u{7}", "\u{1b}[1A", "\r", "\u{9b}m", "\u{1b}[1"] {
            let shown = for_terminal(text, true);
            assert!(!shown.contains(acts), "{shown:?}");
        }
    }

    #[test]
    fn json_keeps_its_meaning() {
        let value = serde_json::json!({ HOSTILE: [HOSTILE, "\u{e0041}"] });
        let text = serde_json::to_string_pretty(&value).unwrap();
        let shown = json_for_terminal(&text);
        assert!(!shown.contains(|c| c != '\n' && acts(c)), "{shown:?}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
    }

    #[test]
    fn a_path_is_one_line() {
        let path = Path::new("logs/\u{1b}[2K01\n.BIN");
        assert_eq!(format!("{:>20}|", path.shown()), "    logs/␛[2K01␊.BIN|");
    }
}
