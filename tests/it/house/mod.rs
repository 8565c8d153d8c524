//! What holds the house together: its layers, what is generated, the fuzzer's corpus, the package.

mod architecture;
mod doc_comments;
mod fuzz_corpus;
mod generated;
mod layers;
mod package;
mod physics_note;

use std::fs;
use std::path::{Path, PathBuf};

/// The Rust files below a folder, appended.
pub(crate) fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}
