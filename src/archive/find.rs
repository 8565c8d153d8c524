//! Campaigns below folders.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::index::index_path;
use crate::base::file::FileError;
use crate::campaign::is_campaign;

/// Folders below a given one that are looked into.
const MOST_DEPTH: usize = 6;
/// Folders that are looked into in all.
const MOST_FOLDERS: usize = 100_000;

/// Campaigns that were found.
#[derive(Debug, Default, PartialEq)]
pub struct Found {
    /// Their folders without links, each once, by name below each of the given ones.
    pub campaigns: Vec<PathBuf>,
    /// Given folders without a campaign.
    pub empty: Vec<PathBuf>,
    /// Folders that cannot be read, with the reason.
    pub unread: Vec<(PathBuf, String)>,
    /// Whether some folders were not looked into, as there are too many.
    pub cut: bool,
}

/// Whether a folder is a campaign, or has the analysis of one.
pub fn holds_campaign(folder: &Path) -> bool {
    is_campaign(folder) || folder.join("analysis.json").is_file()
}

/// Finds the campaigns that `given` folders are or hold. Links are not followed below them; hidden folders, and other
/// archives, are passed over. Campaigns are not looked into.
///
/// # Errors
/// If a given folder cannot be read.
pub fn find(given: &[PathBuf]) -> Result<Found, FileError> {
    let mut found = Found::default();
    let mut seen = BTreeSet::new();
    let mut left = MOST_FOLDERS;
    for given in given {
        let fail = |error| FileError::new("read", given, error);
        let root = given.canonicalize().map_err(fail)?;
        // A file is no folder of campaigns; the operating system says so.
        drop(fs::read_dir(&root).map_err(fail)?);
        let mut is_empty = true;
        let mut open = vec![(root, 0)];
        while let Some((folder, depth)) = open.pop() {
            if holds_campaign(&folder) {
                is_empty = false;
                if seen.insert(folder.clone()) {
                    found.campaigns.push(folder);
                }
            } else if depth < MOST_DEPTH && !index_path(&folder).is_file() {
                match below(&folder) {
                    Ok(folders) if folders.len() > left => found.cut = true,
                    Ok(folders) => {
                        left -= folders.len();
                        // The first is looked into next.
                        open.extend(folders.into_iter().rev().map(|folder| (folder, depth + 1)));
                    }
                    Err(error) => found.unread.push((folder, error.to_string())),
                }
            }
        }
        if is_empty {
            found.empty.push(given.clone());
        }
    }
    Ok(found)
}

/// Folders in a folder, by name.
fn below(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut folders = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
        if !is_hidden && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            folders.push(entry.path());
        }
    }
    folders.sort();
    Ok(folders)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(path: &Path) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "{}").unwrap();
    }

    #[test]
    fn campaigns_are_found_below_and_not_within_each_other_nor_through_links() {
        let temporary = tempfile::tempdir().unwrap();
        let root = temporary.path().canonicalize().unwrap();
        put(&root.join("2026/june/a/analysis.json"));
        put(&root.join("2026/june/a/hover/plan.json"));
        put(&root.join("2026/b/campaign.json"));
        put(&root.join("2026/.hidden/plan.json"));
        put(&root.join("2026/old/archive.json"));
        put(&root.join("2026/old/x/analysis.json"));
        put(&root.join("1/2/3/4/5/6/7/8/analysis.json"));
        put(&root.join("elsewhere/analysis.json"));
        #[cfg(unix)]
        std::os::unix::fs::symlink(root.join("elsewhere"), root.join("2026/link")).unwrap();
        let given = [root.join("2026"), root.join("2026/june/a"), root.join("1")];
        let found = find(&given).unwrap();
        assert_eq!(found.campaigns, [root.join("2026/b"), root.join("2026/june/a")]);
        assert_eq!(found.empty, [root.join("1")], "too deep");
        assert!(find(&[root.join("nowhere")]).is_err());
        assert!(find(&[root.join("2026/b/campaign.json")]).is_err(), "a file");
    }
}
