//! Search for logs in folders, and names made from paths.

use std::path::{Path, PathBuf};

use crate::base::file::FileError;
use crate::base::plain::plain;
use crate::campaign::origin::is_set_aside;
use crate::workflow::shows::load::has_extension;

/// Whether a path is a finished log: what an interrupted run or copy left is not.
fn is_log(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    has_extension(path, "bin") && !hidden
}

/// The logs in a folder and in its direct subfolders (one per drone, as SD cards are often copied).
pub(super) fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let mut logs = Vec::new();
    let list = |folder: &Path| -> Result<Vec<PathBuf>, FileError> {
        let fail = |source| FileError::new("read", folder, source);
        let entries = std::fs::read_dir(folder).map_err(fail)?;
        let mut paths =
            entries.map(|entry| Ok(entry.map_err(fail)?.path())).collect::<Result<Vec<_>, _>>()?;
        paths.sort();
        Ok(paths)
    };
    for path in list(folder)? {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && is_set_aside(name) {
            continue;
        }
        if path.is_dir() {
            logs.extend(list(&path)?.into_iter().filter(|path| is_log(path)));
        } else if is_log(&path) {
            logs.push(path);
        }
    }
    Ok(logs)
}

/// The name of a folder, or of a file without its ending; `logs` where there is none.
pub(crate) fn stem(path: &Path) -> String {
    // `arducopter-4.4` is a folder, not a file `arducopter-4` with an ending.
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
    let name = name.or(path.file_name());
    let text = name.map_or_else(String::new, |name| plain(&name.to_string_lossy()).into_owned());
    if text.is_empty() { "logs".to_owned() } else { text }
}

/// Labels of paths that are put side by side, no two alike: names of their folders, with the folder above where two have
/// the same, and numbered where that does not help. An analysis stands for its folder.
pub(crate) fn labels(paths: &[PathBuf]) -> Vec<String> {
    let folder = |path: &PathBuf| {
        let whole = path.canonicalize().unwrap_or_else(|_| path.clone());
        match whole.parent() {
            Some(parent) if whole.file_name().is_some_and(|name| name == "analysis.json") => {
                parent.to_owned()
            }
            _ => whole,
        }
    };
    let folders: Vec<PathBuf> = paths.iter().map(folder).collect();
    let plain: Vec<String> = folders.iter().map(|path| stem(path)).collect();
    let named = folders.iter().zip(&plain).map(|(path, name)| {
        let is_alone = plain.iter().filter(|one| *one == name).count() == 1;
        match path.parent() {
            Some(above) if !is_alone => format!("{}/{name}", stem(above)),
            _ => name.clone(),
        }
    });
    numbered(named)
}

/// Names with a number where an earlier one is the same, so that no two are alike.
pub(crate) fn numbered(names: impl IntoIterator<Item = String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for name in names {
        let free = std::iter::once(name.clone()).chain((2..).map(|at| format!("{name}-{at}")));
        let found = free.into_iter().find(|one| !all.contains(one));
        all.push(found.unwrap_or(name));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_folders_with_one_name_have_the_folder_above() {
        let of = |paths: &[&str]| labels(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        let months = of(&["may/monday", "june/monday", "june/tuesday"]);
        assert_eq!(months, ["may/monday", "june/monday", "tuesday"]);
        assert_eq!(of(&["x/may/monday", "y/may/monday"]), ["may/monday", "may/monday-2"]);
    }

    #[test]
    fn no_two_names_are_alike() {
        let names = ["a", "a-2", "a", "a"].map(str::to_owned);
        assert_eq!(numbered(names), ["a", "a-2", "a-3", "a-4"]);
    }
}
