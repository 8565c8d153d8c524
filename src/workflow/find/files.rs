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
