//! `docs/effects.md` is what the library says today; `UPDATE=1` rewrites it.

use std::fs;
use std::path::Path;

use updraft::effects::doc::markdown;
use updraft::vehicle::library::builtin;

#[test]
fn catalogue_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/effects.md");
    let text = markdown(&builtin("pixel").unwrap()).unwrap();
    if std::env::var_os("UPDATE").is_some() {
        fs::write(&path, text).unwrap();
    } else {
        let committed = fs::read_to_string(&path).unwrap_or_default();
        assert!(committed == text, "{} is out of date: UPDATE=1", path.display());
    }
}
