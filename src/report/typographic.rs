//! Words of the program as a page sets them: Greek letters, true minus signs, degrees.

use super::text::clean;

/// Words that are symbols, with what a page has for them.
const SYMBOLS: [(&str, &str); 5] =
    [("us", "µs"), ("chi2", "χ²"), ("chi2/nu", "χ²/ν"), ("u0", "u₀"), ("+-", "±")];
/// Units that begin with microseconds.
const OF_US: &str = "us/";
/// Marks around a word that do not belong to it.
const AROUND: [char; 9] = ['(', ')', ',', ';', ':', '.', '!', '?', '"'];

/// [`clean`] text of the program with the signs of the page: `-3 us` is `−3 µs`. Names from outside that are words of
/// their own stay as they are.
pub(super) fn typographic(text: &str) -> String {
    let text = clean(text);
    let words: Vec<String> = text.split(' ').map(word).collect();
    let mut out = String::new();
    for (index, one) in words.iter().enumerate() {
        let before = index.checked_sub(1).and_then(|before| words.get(before));
        let after_number =
            before.is_some_and(|before| before.ends_with(|c: char| c.is_ascii_digit()));
        if let Some(rest) = one.strip_prefix("degrees").filter(|_| after_number)
            && !rest.starts_with(char::is_alphanumeric)
        {
            out.push('°');
            out.push_str(rest);
            continue;
        }
        if index > 0 {
            out.push(' ');
        }
        out.push_str(one);
    }
    out
}

fn word(word: &str) -> String {
    let core = word.trim_matches(AROUND);
    let Some(start) = word.find(core).filter(|_| !core.is_empty()) else { return word.to_owned() };
    let (before, after) = (&word[..start], &word[start + core.len()..]);
    let set = SYMBOLS.iter().find(|(from, _)| *from == core).map(|(_, to)| (*to).to_owned());
    let set = set.or_else(|| core.strip_prefix(OF_US).map(|rest| format!("µs/{rest}")));
    let set = set.unwrap_or_else(|| {
        let number =
            core.strip_prefix('-').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        number.map_or_else(|| core.to_owned(), |number| format!("−{number}"))
    });
    format!("{before}{set}{after}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_of_the_program_are_set() {
        let shown = [
            ("chi2/nu is 2038.89: more.", "χ²/ν is 2038.89: more."),
            ("u0 fell (by -30.9 us, 2 us/(m/s))", "u₀ fell (by −30.9 µs, 2 µs/(m/s))"),
            ("turned by 30 degrees, not more", "turned by 30°, not more"),
            ("some degrees", "some degrees"),
        ];
        for (from, to) in shown {
            assert_eq!(typographic(from), to);
        }
    }

    #[test]
    fn names_stay_as_they_are() {
        for name in ["us-07 of bus 3", "log-3.bin", "drone-7", "", " ", "(", "a  b", "2026-06-01"] {
            assert_eq!(typographic(name), name);
        }
    }
}
