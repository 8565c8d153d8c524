//! One effect, one file: no code outside of an effect's own file decides by its name.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::house::sources;
use updraft::effects::LIBRARY;

/// Where effects have their names: their own files, and the tables of what the benchmark hides.
const OWN: [&str; 2] = ["crates/multirotor-sim/src/effects/", TABLES];
const TABLES: &str = "src/blind/tables.rs";
/// Tests that are files of the library.
const TESTS: [&str; 1] = ["src/gap/null_flights.rs"];
/// Help, which shows commands by example.
const HELP: [&str; 4] =
    ["src/cli/effects.rs", "src/cli/blind/hide.rs", "src/cli/blind/mod.rs", "src/cli/physics.rs"];
/// Files in which a word that is also an effect's name means something else.
const OTHER: [(&str, &str); 1] = [("src/report/errors.rs", "battery")];

/// The string literals of a source text, without its comments and what follows `#[cfg(test)]`.
fn literals(text: &str) -> Vec<String> {
    let text = text.split("\n#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find(['"', '/', '\'']) {
        let (mark, after) = (rest.as_bytes()[at], &rest[at + 1..]);
        rest = match mark {
            b'/' if after.starts_with('/') => after.split_once('\n').map_or("", |(_, rest)| rest),
            b'\'' if after.starts_with("\"'") => &after[2..],
            b'\'' if after.starts_with("\\\"'") => &after[3..],
            b'"' => {
                let mut end = 0;
                let bytes = after.as_bytes();
                while end < bytes.len() && bytes[end] != b'"' {
                    end += if bytes[end] == b'\\' { 2 } else { 1 };
                }
                found.push(after[..end].to_owned());
                &after[end + 1..]
            }
            _ => after,
        };
    }
    found
}

/// Whether a literal is a name, or has a name of several words in it.
fn says(literal: &str, name: &str) -> bool {
    literal == name || name.contains('-') && literal.contains(name)
}

#[test]
fn no_effect_is_named_outside_its_file_its_tests_and_data() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    for crate_folder in fs::read_dir(root.join("crates")).unwrap() {
        sources(&crate_folder.unwrap().path().join("src"), &mut files);
    }
    let mut named = Vec::new();
    let mut homes: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for path in files {
        let place = path.strip_prefix(root).unwrap().display().to_string();
        let text = fs::read_to_string(&path).unwrap();
        // Who knows nothing of effects means another battery.
        if TESTS.contains(&place.as_str()) || !text.contains("ffect") {
            continue;
        }
        let is_own = OWN.iter().any(|own| place.starts_with(own));
        for literal in literals(&text) {
            for name in LIBRARY.iter().map(|effect| effect.definition().name) {
                let is_help = HELP.contains(&place.as_str()) && literal != name;
                if !says(&literal, name) || is_help || OTHER.contains(&(place.as_str(), name)) {
                    continue;
                }
                if is_own && place != TABLES {
                    homes.entry(name).or_default().insert(place.clone());
                } else if !is_own {
                    named.push(format!("{place}: {name}"));
                }
            }
        }
    }
    assert!(named.is_empty(), "{named:#?}");
    for name in LIBRARY.iter().map(|effect| effect.definition().name) {
        let homes = homes.remove(name).unwrap_or_default();
        assert_eq!(homes.len(), 1, "{name} is named in {homes:?}");
    }
}

#[test]
fn literals_are_told_from_comments_and_quotes() {
    let text = "let a = \"one\\\" two\"; // \"three\"\nlet b = '\"'; let c = \"four\";\n";
    assert_eq!(literals(text), ["one\\\" two", "four"]);
}
