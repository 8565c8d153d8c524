//! Doc comments of public items stand alone: a reader of the API page has no line before them.

#![expect(clippy::unwrap_used, reason = "a test that cannot read the repository fails")]

use std::fs;
use std::path::{Path, PathBuf};

/// Rooms whose words are finished with their rebuilding.
const UNFINISHED: &[&str] = &["src/analysis", "src/gap", "src/cli"];

/// Beginnings that lean on another line, or ask where they should say.
const OPENINGS: &[&str] =
    &["The same", "Same", "Why", "What", "So", "Likewise", "Ditto", "As above", "See", "Its"];

/// Derives whose doc comments are a schema's descriptions or a command's help, reviewed there.
const PUBLISHED: &[&str] = &["JsonSchema", "Args", "Parser", "Subcommand", "ValueEnum"];

#[derive(Default)]
struct Doc {
    line: usize,
    text: String,
    is_module: bool,
    item: String,
}

/// The item at the left margin that a line stands in.
#[derive(Default)]
struct Outer {
    /// What is in it is public without saying so: a public enum or trait.
    opens: bool,
    published: bool,
}

/// Doc comments of public items, by the layout that rustfmt gives a file.
fn public_docs(source: &str) -> Vec<Doc> {
    let mut found = Vec::new();
    let mut outer = Outer::default();
    let mut doc: Option<Doc> = None;
    let mut attributes = String::new();
    let mut lines = source.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let code = line.trim();
        if let Some(text) = code.strip_prefix("//!").or_else(|| code.strip_prefix("///")) {
            let doc = doc.get_or_insert_with(|| Doc { line: index + 1, ..Doc::default() });
            doc.text.push_str(text);
            doc.is_module = code.starts_with("//!");
            continue;
        }
        if code.starts_with("#[") {
            attributes.push_str(code);
            while attributes.matches('[').count() > attributes.matches(']').count() {
                let Some((_, more)) = lines.next() else { break };
                attributes.push_str(more.trim());
            }
            continue;
        }
        let at_margin = line.starts_with(|c: char| !c.is_whitespace() && c != '}' && c != '/');
        if attributes.contains("#[cfg(test)]") && code.starts_with("mod ") && code.ends_with('{') {
            lines.by_ref().find(|(_, line)| *line == "}");
        } else if at_margin {
            outer = Outer {
                opens: code.starts_with("pub enum ") || code.starts_with("pub trait "),
                published: PUBLISHED.iter().any(|name| attributes.contains(name)),
            };
        }
        if let Some(mut doc) = doc.take() {
            let public = doc.is_module || code.starts_with("pub ") || (!at_margin && outer.opens);
            if public && (doc.is_module || !outer.published) {
                code.clone_into(&mut doc.item);
                found.push(doc);
            }
        }
        attributes.clear();
    }
    found
}

/// What is wrong with a doc comment.
fn fault(text: &str) -> Option<&'static str> {
    let text = text.trim_start();
    let opens = |opening: &&str| {
        text.strip_prefix(*opening).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
    };
    if OPENINGS.iter().any(opens) {
        return Some("does not stand alone");
    }
    let words = text.split_whitespace().filter(|word| word.contains(char::is_alphanumeric));
    let has_unit = text.contains([',', '`']) || text.contains(|c: char| c.is_ascii_digit());
    (words.count() <= 2 && !has_unit).then_some("says too little")
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.ends_with("tests") {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !path.ends_with("tests.rs")
        {
            found.push(path);
        }
    }
}

#[test]
fn public_items_are_documented_on_their_own() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    for member in fs::read_dir(root.join("crates")).unwrap() {
        sources(&member.unwrap().path().join("src"), &mut files);
    }
    files.retain(|file| !UNFINISHED.iter().any(|room| file.starts_with(root.join(room))));
    let mut faults = Vec::new();
    for file in files {
        let name = file.strip_prefix(root).unwrap().display().to_string();
        for Doc { line, text, item, .. } in public_docs(&fs::read_to_string(&file).unwrap()) {
            if let Some(fault) = fault(&text) {
                faults.push(format!("{name}:{line}:{text} ({item}) {fault}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_bad_kinds_are_found() {
    let source = "\
//! The same for modules.

/// Why.
pub fn why() {}

/// Why.
fn private() {}

/// An error of something.
#[derive(Debug)]
pub enum Error {
    /// Why.
    Variant {
        /// What was asked.
        reason: String,
    },
}

/// A vehicle and its load.
pub struct Vehicle {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Its name.
    pub name: String,
    /// Why.
    hidden: bool,
}

/// What a schema describes.
#[derive(
    Debug,
    JsonSchema,
)]
pub struct Published {
    /// Why.
    pub reason: String,
}

#[cfg(test)]
mod tests {
    /// Why.
    pub fn helper() {}
}
";
    let bad: Vec<usize> = (public_docs(source).into_iter())
        .filter(|doc| fault(&doc.text).is_some())
        .map(|doc| doc.line)
        .collect();
    assert_eq!(bad, [1, 3, 12, 14, 23]);
    assert_eq!(fault("Whatever else a show holds."), None);
    assert_eq!(fault("Velocity, m/s."), None);
    assert!(fault("North.").is_some());
}
