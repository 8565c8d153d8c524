//! Dependencies between the rooms point one way.

#![expect(clippy::unwrap_used, reason = "a test that cannot read the repository fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Each room and those it may use.
const ALLOWED: &[(&str, &[&str])] = &[
    ("base", &[]),
    ("mission", &["base", "vehicle"]),
    ("skybrush_server", &["base"]),
    ("campaign", &["base", "vehicle", "mission", "check"]),
    ("fleet", &["base", "vehicle", "mission", "campaign", "flight"]),
    ("virtual_fleet", &["base", "vehicle", "mission", "sim"]),
    ("flight", &["base", "vehicle", "mission"]),
    ("analysis", &["base", "vehicle", "mission", "flight"]),
    ("gap", &["base", "vehicle", "mission", "effects", "sim", "flight", "analysis"]),
    (
        "blind",
        &["base", "vehicle", "mission", "campaign", "effects", "sim", "flight", "analysis", "gap"],
    ),
    ("study", &["base", "vehicle", "mission", "sim", "flight", "analysis"]),
    ("report", &["base", "vehicle", "mission", "effects", "flight", "analysis", "gap", "study"]),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The rooms that a file's code names, without its test module and comments.
fn rooms_named(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| line.split("crate::").skip(1))
        .map(|rest| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect())
        .collect()
}

#[test]
fn no_room_uses_one_behind_it() {
    let allowed: BTreeMap<_, _> = ALLOWED.iter().copied().collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut against = Vec::new();
    for (room, may_use) in &allowed {
        let mut files = Vec::new();
        sources(&root.join(room), &mut files);
        assert!(!files.is_empty(), "{room} has moved");
        // A room's tests may look ahead.
        for file in files.into_iter().filter(|file| !file.ends_with("tests.rs")) {
            let text = fs::read_to_string(&file).unwrap();
            for named in rooms_named(&text) {
                let known = allowed.contains_key(named.as_str()) || named == "cli";
                if known && named != *room && !may_use.contains(&named.as_str()) {
                    against.push(format!("{} uses {named}", file.display()));
                }
            }
        }
    }
    assert!(against.is_empty(), "{}", against.join("\n"));
}

/// What passes on the text of others as it is, what to use instead, and the files that may.
const DOORS: &[(&str, &str, &[&str])] = &[
    (".display()", "base::plain::Shown: `path.shown()`", &[]),
    (
        "serde_json::from_",
        "base::parse::json",
        &["crates/skybrush-show/src/skyc/write.rs", "crates/untrusted-io/src/parse.rs"],
    ),
    ("toml::from_str", "base::parse::toml", &[]),
    ("io::stdout().lock()", "cli::context::Context", &["src/cli/context.rs"]),
    ("io::stderr().lock()", "cli::context::complain or prompt", &["src/cli/context.rs"]),
    ("fs::read_to_string(", "base::file::read_whole, which is bounded", &["src/cli/signals.rs"]),
    ("fs::read(", "base::file::read_whole, which is bounded", &[]),
];

#[test]
fn text_of_others_comes_and_goes_by_its_own_doors() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    for of_crate in fs::read_dir(root.join("crates")).unwrap() {
        sources(&of_crate.unwrap().path().join("src"), &mut files);
    }
    let mut wrong = Vec::new();
    for path in files {
        let name = path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let code = code.split("#[cfg(all(test").next().unwrap_or_default();
        for (at, line) in code.lines().enumerate() {
            for (call, instead, may) in DOORS {
                let is_code = !line.trim_start().starts_with("//");
                if is_code && line.contains(call) && !may.contains(&name.as_str()) {
                    wrong.push(format!("{name}:{}: {call}: use {instead}", at + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
