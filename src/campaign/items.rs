//! `items.json`: what the items of a folder are made with, so that processes on other machines, with other
//! settings or of another version do not add theirs.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CampaignError, read_json, to_json};
use crate::base::file::{FileError, write_new, write_whole};

/// Name and version of the format.
pub const ITEMS_SCHEMA: &str = "updraft.items/1";

/// Settings of the items in a folder (flights of a table, cells of a study).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ItemsRecord {
    /// Format name and version: `updraft.items/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// Kind of the items: `blind flights`, `cells of a study`, `campaigns of a study`.
    pub items: String,
    /// SHA-256 of all settings that an item depends on, hexadecimal; their number is not among them.
    pub settings_sha256: String,
    /// Command that wrote this, for people.
    pub command: String,
}

impl ItemsRecord {
    /// Record of items with these settings.
    pub fn new(made_by: String, items: &str, settings_sha256: String, command: String) -> Self {
        let schema = ITEMS_SCHEMA.to_owned();
        Self { schema, made_by, items: items.to_owned(), settings_sha256, command }
    }

    /// Difference of the items that are there from these, in words; `None` if they fit together.
    fn difference(&self, there: &Self) -> Option<String> {
        if self.schema != there.schema {
            Some(format!("format \"{}\", this program writes \"{}\"", there.schema, self.schema))
        } else if self.items != there.items {
            Some(format!("{}, not {}", there.items, self.items))
        } else if self.made_by != there.made_by {
            Some(format!("{}, this is {}", there.made_by, self.made_by))
        } else if self.settings_sha256 != there.settings_sha256 {
            Some(format!("made with `{}`", there.command))
        } else {
            None
        }
    }
}

/// Path of the record in a folder.
pub fn items_path(folder: &Path) -> PathBuf {
    folder.join("items.json")
}

/// Takes a folder for items with these settings, or joins those who have taken it. Any number of processes
/// may do so at the same time; no lock is needed.
///
/// # Errors
///
/// [`CampaignError::OtherItems`] if the items there are of other settings or another version, otherwise
/// a file that cannot be read or written.
pub fn join(folder: &Path, record: &ItemsRecord) -> Result<(), CampaignError> {
    let path = items_path(folder);
    if !path.exists() && write_new(&path, &bytes(record, &path)?)? {
        return Ok(());
    }
    check(folder, record)
}

/// Checks that items with these settings may be looked for in a folder, and writes nothing there. A folder without a
/// record has none of others.
///
/// # Errors
///
/// As [`join`].
pub fn check(folder: &Path, record: &ItemsRecord) -> Result<(), CampaignError> {
    let Some(there) = there(folder)? else { return Ok(()) };
    match record.difference(&there) {
        Some(why) => Err(CampaignError::OtherItems { path: folder.to_owned(), why }),
        None => Ok(()),
    }
}

/// Takes a folder for items with these settings, although there are some of others: for items that each know their own
/// settings, so that none is taken for another's.
///
/// # Errors
///
/// [`CampaignError::OtherItems`] if there are items of another kind, otherwise a file that cannot be read or
/// written.
pub fn take_over(folder: &Path, record: &ItemsRecord) -> Result<(), CampaignError> {
    if let Some(there) = there(folder)?
        && (there.schema != record.schema || there.items != record.items)
    {
        return check(folder, record);
    }
    let path = items_path(folder);
    if check(folder, record).is_ok() && path.exists() {
        return Ok(());
    }
    Ok(write_whole(&path, &bytes(record, &path)?)?)
}

/// Record of a folder; `None`: it has none.
fn there(folder: &Path) -> Result<Option<ItemsRecord>, CampaignError> {
    let path = items_path(folder);
    if !path.exists() {
        return Ok(None);
    }
    read_json(&path).map(Some).map_err(|error: CampaignError| {
        error.with_remedy(
            "remove that file if all results there are of this command; each of them is checked",
        )
    })
}

fn bytes(record: &ItemsRecord, path: &Path) -> Result<Vec<u8>, FileError> {
    to_json(record).map_err(|error| FileError::new("write", path, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(settings: &str, version: &str) -> ItemsRecord {
        let command = format!("updraft blind --seed {settings}");
        ItemsRecord::new(
            format!("updraft {version}"),
            "blind flights",
            settings.to_owned(),
            command,
        )
    }

    #[test]
    fn other_settings_and_other_versions_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("blind");
        join(&place, &record("7", "0.1.0")).unwrap();
        join(&place, &record("7", "0.1.0")).unwrap();
        let refusal = |other| join(&place, &other).unwrap_err().to_string();
        let text = refusal(record("8", "0.1.0"));
        assert!(text.contains("made with `updraft blind --seed 7`"), "{text}");
        let text = refusal(record("7", "0.2.0"));
        assert!(text.contains("updraft 0.1.0, this is updraft 0.2.0"), "{text}");
        take_over(&place, &record("8", "0.1.0")).unwrap();
        join(&place, &record("8", "0.1.0")).unwrap();
    }

    #[test]
    fn looking_changes_nothing_and_items_of_another_kind_are_never_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("blind");
        check(&place, &record("7", "0.1.0")).unwrap();
        assert!(!place.exists());
        join(&place, &record("7", "0.1.0")).unwrap();
        assert!(check(&place, &record("8", "0.1.0")).is_err());
        join(&place, &record("7", "0.1.0")).unwrap();
        let cells = ItemsRecord { items: "cells of a study".to_owned(), ..record("7", "0.1.0") };
        let refused = take_over(&place, &cells).unwrap_err().to_string();
        assert!(refused.contains("(blind flights, not cells of a study)"), "{refused}");
        join(&place, &record("7", "0.1.0")).unwrap();
        std::fs::write(items_path(&place), "").unwrap();
        let broken = join(&place, &record("7", "0.1.0")).unwrap_err().to_string();
        assert!(broken.contains("remove that file if all results there"), "{broken}");
    }

    #[test]
    fn the_number_and_the_words_of_a_command_do_not_matter() {
        let folder = tempfile::tempdir().unwrap();
        join(folder.path(), &record("7", "0.1.0")).unwrap();
        let other = ItemsRecord {
            command: "updraft blind --seed 7 --flights 9".to_owned(),
            ..record("7", "0.1.0")
        };
        join(folder.path(), &other).unwrap();
    }

    #[test]
    fn many_at_once_agree() {
        let folder = tempfile::tempdir().unwrap();
        let joined = std::thread::scope(|scope| {
            let place = folder.path();
            let one = |settings: usize| {
                scope.spawn(move || {
                    join(place, &record(&(settings % 2).to_string(), "0.1.0")).is_ok()
                })
            };
            let all: Vec<_> = (0..16).map(one).collect();
            all.into_iter().map(|one| one.join().unwrap()).collect::<Vec<_>>()
        });
        let even = joined.iter().step_by(2).filter(|joined| **joined).count();
        let odd = joined.iter().skip(1).step_by(2).filter(|joined| **joined).count();
        assert!((even, odd) == (8, 0) || (even, odd) == (0, 8), "{joined:?}");
    }
}
