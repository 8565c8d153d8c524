//! The keys that overrides may name, and how their values are written into a template.

use toml::Table;
use toml::Value as Toml;

/// The keys that a template takes at its top, besides its parameters.
pub(super) const TOP_LEVEL: [&str; 16] = [
    "name", "title", "purpose", "vehicle", "site", "grid", "takeoff", "landing", "motion", "fence",
    "window", "limits", "groups", "steps", "legs", "briefing",
];
/// Slips of the finger by which a mistyped key may differ from the one that was meant.
const MAX_SLIPS: usize = 3;

/// What can be set in these templates, and the nearest name to one that cannot.
pub(super) fn keys_of(asked: &str, texts: &[&str]) -> String {
    let mut parameters: Vec<String> = Vec::new();
    for table in texts.iter().filter_map(|text| text.parse::<Table>().ok()) {
        let Some(Toml::Table(own)) = table.get("parameters") else { continue };
        parameters.extend(own.keys().cloned());
    }
    parameters.sort();
    parameters.dedup();
    let first = asked.split('.').next().unwrap_or(asked);
    // Without a point a parameter is meant rather than a section.
    let farther = usize::from(!asked.contains('.'));
    let parameter = parameters.iter().map(|key| (key.as_str(), 0));
    let nearest = parameter
        .chain(TOP_LEVEL.into_iter().map(|key| (key, farther)))
        .map(|(key, farther)| (slips(first, key), farther, key))
        .filter(|(slips, _, key)| *slips <= MAX_SLIPS.min(key.len() / 2))
        .min_by_key(|(slips, farther, key)| (slips + farther, *farther, *key));
    let hint = nearest.map_or(String::new(), |(_, _, key)| format!("did you mean {key}? "));
    let parameters = if parameters.is_empty() {
        String::new()
    } else {
        format!("the parameters {}, and ", parameters.join(", "))
    };
    format!("{hint}there are {parameters}what is under {}", TOP_LEVEL.join(", "))
}

/// Letters to insert, remove or replace to make one word of the other.
fn slips(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// Digits from which a number is written with an exponent.
const LONG_NUMBER: usize = 25;

/// TOML with its numbers of hundreds of digits (1e300) written with an exponent.
pub(super) fn short_numbers(text: &str) -> String {
    let short = |number: &str| match number.parse::<f64>() {
        Ok(value) if number.len() > LONG_NUMBER => format!("{value:e}"),
        _ => number.to_owned(),
    };
    let mut shortened = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let Some((key, value)) = line.split_once(" = ") else {
            shortened.push_str(line);
            continue;
        };
        let (value, end) = value.strip_suffix('\n').map_or((value, ""), |value| (value, "\n"));
        let list = value.strip_prefix('[').and_then(|list| list.strip_suffix(']'));
        let value = match list {
            Some(list) if !list.contains('"') => {
                format!("[{}]", list.split(", ").map(short).collect::<Vec<_>>().join(", "))
            }
            _ => short(value),
        };
        shortened.extend([key, " = ", &value, end]);
    }
    shortened
}
