//! `archive.json`: what an archive holds, and what it was made from.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TABLES;
use crate::base::digest::sha256;
use crate::base::file::write_whole;
use crate::campaign::{CampaignError, read_json, to_json};

/// Name and version of the index's format.
pub const INDEX_SCHEMA: &str = "updraft.archive-index/1";

/// Path of an archive's index.
pub fn index_path(archive: &Path) -> PathBuf {
    archive.join("archive.json")
}

/// `archive.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArchiveIndex {
    /// Format name and version: `updraft.archive-index/1`.
    pub schema: String,
    /// Program and version that wrote it last.
    pub made_by: String,
    /// The campaigns, by id.
    pub campaigns: Vec<ArchivedCampaign>,
}

/// A campaign of an archive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArchivedCampaign {
    /// Id, the value of the partition `campaign`.
    pub id: String,
    /// Folder that it was gathered from.
    pub folder: PathBuf,
    /// Hash of the files that it was gathered from.
    pub inputs_sha256: String,
    /// Whether it was simulated; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated: Option<bool>,
    /// Partitions of the campaign.
    pub parts: Vec<Part>,
}

/// One file of a campaign: `TABLE/date=DATE/campaign=ID/part.parquet`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Name of the table.
    pub table: String,
    /// Date (UTC), the value of the partition `date`.
    pub date: String,
    /// Rows.
    pub rows: u64,
    /// Size of its file, bytes; 0: not known.
    #[serde(default)]
    pub bytes: u64,
}

/// Date of flights whose date is not known, as Hive writes a partition without a value: readers show a null.
pub const NO_DATE: &str = "__HIVE_DEFAULT_PARTITION__";

impl ArchivedCampaign {
    /// Folder of one of its partitions.
    pub fn place(&self, archive: &Path, part: &Part) -> PathBuf {
        place(archive, &part.table, &part.date, &self.id)
    }

    /// Rows of a table.
    pub fn rows(&self, table: &str) -> u64 {
        self.parts.iter().filter(|part| part.table == table).map(|part| part.rows).sum()
    }
}

/// Folder of a partition.
pub fn place(archive: &Path, table: &str, date: &str, id: &str) -> PathBuf {
    archive.join(table).join(format!("date={date}")).join(format!("campaign={id}"))
}

/// Longest name of a campaign's folder that goes into its id, characters.
const LONGEST_NAME: usize = 48;
/// Digits of the hash in an id: by chance, one in 10^12 pairs of the same name has the same.
const DIGITS: usize = 10;

/// Id of a campaign: the name of its folder, of letters, digits, hyphens and underscores alone, and a hash of what no other
/// campaign has.
pub fn id_of(folder: &Path, identity: &str) -> String {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let mut id = String::new();
    for c in name.chars().take(LONGEST_NAME) {
        if c.is_ascii_alphanumeric() || c == '_' {
            id.push(c);
        } else if !id.ends_with('-') && !id.is_empty() {
            id.push('-');
        }
    }
    let hash = sha256(identity.as_bytes());
    let name = Some(id.trim_end_matches('-')).filter(|name| !name.is_empty()).unwrap_or("campaign");
    format!("{name}-{}", hash.get(..DIGITS).unwrap_or(&hash))
}

/// Whether a name read from an index can be a folder's, and nothing else.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}

impl ArchiveIndex {
    /// Reads the index of an archive; empty if there is none.
    ///
    /// # Errors
    /// If it cannot be read, is of another version, or names folders outside of the archive.
    pub fn read(archive: &Path, made_by: &str) -> Result<Self, CampaignError> {
        let path = index_path(archive);
        if !path.exists() {
            return Ok(Self {
                schema: INDEX_SCHEMA.to_owned(),
                made_by: made_by.to_owned(),
                campaigns: Vec::new(),
            });
        }
        let mut index: Self = read_json(&path).map_err(|error: CampaignError| {
            error.with_remedy("gather all campaigns into another folder")
        })?;
        let wrong = |reason| CampaignError::Json { path: path.clone(), reason };
        if index.schema != INDEX_SCHEMA {
            let found = &index.schema;
            return Err(wrong(format!("this program reads \"{INDEX_SCHEMA}\", not \"{found}\"")));
        }
        for campaign in &index.campaigns {
            let is_part =
                |part: &Part| TABLES.contains(&part.table.as_str()) && is_plain(&part.date);
            if !is_plain(&campaign.id) || !campaign.parts.iter().all(is_part) {
                return Err(wrong(format!("a campaign cannot be \"{}\"", campaign.id)));
            }
        }
        made_by.clone_into(&mut index.made_by);
        Ok(index)
    }

    /// Writes the index.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, archive: &Path) -> Result<(), CampaignError> {
        let path = index_path(archive);
        let json = to_json(self).map_err(|error| CampaignError::Json {
            path: path.clone(),
            reason: error.to_string(),
        })?;
        Ok(write_whole(&path, &json)?)
    }

    /// The campaign with an id.
    pub fn of_id(&self, id: &str) -> Option<&ArchivedCampaign> {
        let at = self.campaigns.binary_search_by(|campaign| campaign.id.as_str().cmp(id)).ok();
        self.campaigns.get(at?)
    }

    /// Puts a campaign in the place of the one with its id, or takes it in.
    pub fn put(&mut self, campaign: ArchivedCampaign) {
        match self.campaigns.binary_search_by(|of| of.id.cmp(&campaign.id)) {
            Ok(at) => self.campaigns[at] = campaign,
            Err(at) => self.campaigns.insert(at, campaign),
        }
    }

    /// Takes a campaign out.
    pub fn remove(&mut self, id: &str) -> Option<ArchivedCampaign> {
        let at = self.campaigns.binary_search_by(|campaign| campaign.id.as_str().cmp(id)).ok()?;
        Some(self.campaigns.remove(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_names_of_folders_whatever_a_campaign_is_called() {
        let id = |name: &str| id_of(Path::new(name), "x");
        let hash = "2d711642b7";
        assert_eq!(id("/data/my-campaign"), format!("my-campaign-{hash}"));
        assert_eq!(id("/data/Käse am Kékes=1/"), format!("K-se-am-K-kes-1-{hash}"));
        assert_eq!(id("/data/..hidden.."), format!("hidden-{hash}"));
        assert_eq!(id("/data/風"), format!("campaign-{hash}"));
        assert_eq!(id("/"), format!("campaign-{hash}"));
        assert_eq!(id(&"y".repeat(300)).len(), 48 + 11);
        assert_ne!(id_of(Path::new("a"), "1"), id_of(Path::new("a"), "2"));
    }

    #[test]
    fn an_index_cannot_point_outside_of_its_archive() {
        let folder = tempfile::tempdir().unwrap();
        for (id, table, date) in [
            ("../x", "flights", "2026-06-01"),
            ("x", "../flights", "2026-06-01"),
            ("x", "flights", "../.."),
            ("", "flights", "2026-06-01"),
        ] {
            let part = Part { table: table.to_owned(), date: date.to_owned(), rows: 1, bytes: 0 };
            let campaign = ArchivedCampaign {
                id: id.to_owned(),
                folder: "x".into(),
                inputs_sha256: String::new(),
                simulated: None,
                parts: vec![part],
            };
            let index = ArchiveIndex {
                schema: INDEX_SCHEMA.to_owned(),
                made_by: String::new(),
                campaigns: vec![campaign],
            };
            index.write(folder.path()).unwrap();
            assert!(ArchiveIndex::read(folder.path(), "x").is_err(), "{id} {table} {date}");
        }
    }
}
