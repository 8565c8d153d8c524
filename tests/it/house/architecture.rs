//! Files and folders that ARCHITECTURE.md names are there.

use std::fs;
use std::path::Path;

/// Whether a path means something in the repository: as it stands, below `src/`, or below a crate's
/// sources if it begins with the crate's name.
fn exists(root: &Path, path: &str) -> bool {
    let (first, rest) = path.split_once('/').unwrap_or((path, ""));
    let in_crate = root.join("crates").join(first);
    root.join(path).exists()
        || root.join("src").join(path).exists()
        || (in_crate.is_dir() && in_crate.join("src").join(rest).exists())
}

/// Paths in backquotes; those of placeholders such as `NAME` are left out.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2).filter(|span| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
        let placeholder = span.contains("NN.") || span.contains("NAME");
        span.contains('/') && span.chars().all(plain) && !placeholder
    })
}

#[test]
fn every_path_that_the_architecture_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    // A campaign's folder is drawn in the middle: its files are nobody's sources.
    let (before, rest) = text.split_once("## A campaign folder").unwrap();
    let (_, after) = rest.split_once("## Conventions").unwrap();
    let named: Vec<_> = paths(before).chain(paths(after)).collect();
    assert!(named.len() > 100, "{} paths were found", named.len());
    let missing: Vec<_> = named.into_iter().filter(|path| !exists(root, path)).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md names what is not there: {missing:?}");
}

/// Each crate and each room stands in the tables.
#[test]
fn every_crate_and_room_has_its_line() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    for folder in ["crates", "src"] {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            if entry.path().is_dir() {
                assert!(text.contains(&format!("\n| `{name}` | ")), "{folder}/{name}");
            }
        }
    }
}
