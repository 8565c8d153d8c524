//! Files in which the items of some work appear, each whole or not at all.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest number of items whose files are looked for.
const MOST_ITEMS: usize = 10_000_000;

/// Files of results, in the order of the items.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Results {
    /// Files that are named by their numbers, from 0.
    Numbered {
        /// Folder of the files.
        folder: PathBuf,
        /// Digits of a number: 5 for `00042`.
        digits: usize,
        /// Rest of the name: `.json`.
        suffix: String,
        /// Number of items.
        count: usize,
        /// Number of items in each folder below `folder`, which are numbered, too, with three digits; absent:
        /// all lie in `folder`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        per_folder: Option<usize>,
    },
    /// Files with names of their own.
    Named {
        /// Paths of the files.
        files: Vec<PathBuf>,
    },
}

impl Results {
    /// Number of items.
    pub fn count(&self) -> usize {
        match self {
            Self::Numbered { count, .. } => (*count).min(MOST_ITEMS),
            Self::Named { files } => files.len(),
        }
    }

    /// Path of the result of an item, counted from 0; `None` beyond the last.
    pub fn path(&self, item: usize) -> Option<PathBuf> {
        match self {
            Self::Numbered { folder, digits, suffix, per_folder, .. } => {
                let digits = (*digits).min(20);
                let name = format!("{item:0digits$}{suffix}");
                let below = per_folder.map(|per| format!("{:03}", item / per.max(1)));
                let folder = below.map_or_else(|| folder.clone(), |below| folder.join(below));
                (item < self.count()).then(|| folder.join(name))
            }
            Self::Named { files } => files.get(item).cloned(),
        }
    }

    /// When each result was finished, Unix time in ms; `None` for one that is missing. Each folder is listed
    /// once, which on the file systems of clusters is much faster than to ask for each file.
    pub fn finished(&self) -> Vec<Option<u64>> {
        let mut items: BTreeMap<PathBuf, BTreeMap<OsString, usize>> = BTreeMap::new();
        for (item, path) in (0..self.count()).filter_map(|item| Some((item, self.path(item)?))) {
            let folder = path.parent().unwrap_or(Path::new("")).to_owned();
            if let Some(name) = path.file_name() {
                items.entry(folder).or_default().insert(name.to_owned(), item);
            }
        }
        let mut finished = vec![None; self.count()];
        for (folder, names) in items {
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                let place = names.get(&entry.file_name()).and_then(|item| finished.get_mut(*item));
                let (Some(place), Ok(found)) = (place, entry.metadata()) else { continue };
                let since = found.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
                let ms = since.and_then(|since| u64::try_from(since.as_millis()).ok());
                *place = Some(ms.unwrap_or_default());
            }
        }
        finished
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_files_count_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let results = Results::Numbered {
            folder: folder.path().to_owned(),
            digits: 5,
            suffix: ".json".to_owned(),
            count: 3,
            per_folder: None,
        };
        for name in ["00001.json", "00003.json", ".partial-n-0-1-x", "00002.json.tmp"] {
            std::fs::write(folder.path().join(name), "{}").unwrap();
        }
        let there: Vec<bool> = results.finished().iter().map(Option::is_some).collect();
        assert_eq!(there, [false, true, false]);
    }

    #[test]
    fn many_results_lie_in_folders() {
        let results = Results::Numbered {
            folder: PathBuf::from("items"),
            digits: 6,
            suffix: ".json".to_owned(),
            count: 5000,
            per_folder: Some(1000),
        };
        assert_eq!(results.path(4321), Some(PathBuf::from("items/004/004321.json")));
        assert_eq!(results.path(5000), None);
    }
}
