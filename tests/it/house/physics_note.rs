//! What the code cites of `docs/physics.md` is there.

use std::fs;
use std::path::Path;

use super::sources;

const CITATION: &str = "docs/physics.md, ";

/// The number at the start of a text: `3.2` of `3.2) and more`.
fn number(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    text[..end].trim_end_matches('.')
}

#[test]
fn every_citation_of_the_physics_note_has_its_section() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let note = fs::read_to_string(root.join("docs/physics.md")).unwrap();
    let sections: Vec<&str> = note
        .lines()
        .filter(|line| line.starts_with("##"))
        .map(|line| number(line.trim_start_matches(['#', ' '])))
        .collect();
    let mut files = Vec::new();
    for folder in ["src", "crates", "tests", "benches"] {
        sources(&root.join(folder), &mut files);
    }
    let mut cited = 0;
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for (index, line) in text.lines().enumerate() {
            for after in line.split(CITATION).skip(1).filter(|_| !line.contains("CITATION")) {
                cited += 1;
                let wanted = number(after);
                let place = format!("{}:{}", file.display(), index + 1);
                assert!(sections.contains(&wanted), "{place} cites section {wanted:?}");
            }
        }
    }
    assert!(cited > 5, "{cited} citations: are they written in another way?");
}
