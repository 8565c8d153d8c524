//! The manifest of a folder of logs, `logs/manifest.json`: what was brought home, from which drone,
//! and how it was verified.

use std::fs::File;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::part::{PartFile, sums};
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::time::GpsTime;
use crate::campaign::start::{earlier_folder, free_name};
use crate::campaign::{CampaignError, read_json, to_json};
use crate::link::id::DroneId;

/// Name and version of the format of a manifest.
pub const MANIFEST_SCHEMA: &str = "updraft.logs/1";

/// `logs/manifest.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format name and version: `updraft.logs/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// The logs, by file name.
    pub logs: Vec<ManifestEntry>,
}

/// One log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ManifestEntry {
    /// File name beside the manifest.
    pub file: String,
    /// Slot of the plan.
    pub slot: u16,
    /// The drone, if it came over MAVLink; Skybrush Server's name for it is in `source`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drone: Option<DroneId>,
    /// Number of the log on the drone; each boot has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub boot: Option<u32>,
    /// Its path on the drone, `log N` by the log messages, the server with drone and log, or the
    /// imported file's path.
    pub source: String,
    /// Size, bytes.
    pub size_bytes: u64,
    /// SHA-256, hexadecimal.
    pub sha256: String,
    /// How it came.
    pub method: Method,
    /// Why not by a better way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method_reason: Option<String>,
    /// How it was compared with the drone's.
    pub verified: Verified,
    /// Why it is, or may be, only the beginning of the drone's log; a later pull brings the rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub incomplete: Option<String>,
    /// How often it was begun or continued.
    pub attempts: u32,
    /// When it was whole, Unix seconds.
    pub at_unix_s: u64,
    /// The flight that it is of; absent: no start was written down when it came.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<LogFlight>,
}

/// The flight that a log is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogFlight {
    /// Number of the start in this folder; 0: it is of none of those that were written down.
    pub number: u32,
    /// GPS time of show time 0 as authorized; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub authorized_start: Option<GpsTime>,
    /// GPS time of show time 0 by the log itself; absent: it does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gps_start: Option<GpsTime>,
    /// When the drone was switched on, by its log; absent: it does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub booted: Option<GpsTime>,
    /// Checksum of the show that the drone was given, as ArduPilot computes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub show_crc32: Option<u32>,
}

/// State of a shelf's file at home, against the manifest.
#[derive(Clone, Debug, PartialEq)]
pub enum AtHome {
    /// The folder has neither the file nor an entry.
    Nothing,
    /// The folder has the file, but the manifest has no entry.
    Foreign,
    /// The manifest has an entry, but the file is gone.
    Gone(ManifestEntry),
    /// The file is not as its entry says.
    Damaged(ManifestEntry),
    /// The file is as its entry says, in size and SHA-256.
    Intact(ManifestEntry),
}

impl AtHome {
    /// Entry of the manifest, if it has one.
    pub fn entry(&self) -> Option<&ManifestEntry> {
        match self {
            Self::Nothing | Self::Foreign => None,
            Self::Gone(entry) | Self::Damaged(entry) | Self::Intact(entry) => Some(entry),
        }
    }
}

/// How a log came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// MAVFTP.
    Mavftp,
    /// LOG_REQUEST_DATA.
    LogMessages,
    /// Named and proved by MAVFTP; the bytes came, wholly or partly, by LOG_REQUEST_DATA, which was
    /// faster.
    Mixed,
    /// Through Skybrush Server.
    SkybrushServer,
    /// Copied from a card.
    Import,
}

/// How a log was compared with the drone's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verified {
    /// Checksum over the whole file, computed by the drone too.
    Checksum,
    /// Its size, and some pieces that were read again.
    Sample,
    /// Its size, and that it can be read as a log.
    Size,
    /// Read again from the card.
    Copy,
}

/// A folder of logs with its manifest.
#[derive(Debug)]
pub struct Shelf {
    folder: PathBuf,
    /// Manifest of the folder.
    pub manifest: Manifest,
}

impl Shelf {
    /// Opens a folder with its manifest, which is empty if there is none. `made_by` goes into new
    /// entries.
    ///
    /// # Errors
    /// When the manifest cannot be read, or names files outside of its folder.
    pub fn open(folder: &Path, made_by: &str) -> Result<Self, CampaignError> {
        let path = folder.join("manifest.json");
        let made_by = made_by.to_owned();
        let schema = MANIFEST_SCHEMA.to_owned();
        let manifest = if path.exists() {
            let mut manifest: Manifest = read_json(&path).map_err(|error: CampaignError| {
                error.with_remedy(
                    "repair it, or move it away: `updraft logs pull --again` downloads the logs \
                     again and makes a new one",
                )
            })?;
            let wrong = if manifest.schema == schema {
                let outside = |entry: &&ManifestEntry| !is_inside(&entry.file);
                let outside = manifest.logs.iter().find(outside);
                outside.map(|entry| format!("a log's file cannot be \"{}\"", entry.file))
            } else {
                Some(format!("this program reads \"{schema}\", not \"{}\"", manifest.schema))
            };
            if let Some(reason) = wrong {
                return Err(CampaignError::Json { path, reason });
            }
            manifest.made_by = made_by;
            manifest
        } else {
            Manifest { schema, made_by, logs: Vec::new() }
        };
        Ok(Self { folder: folder.to_owned(), manifest })
    }

    /// Path of a file in the folder.
    pub fn path(&self, file: &str) -> PathBuf {
        self.folder.join(file)
    }

    /// Entry of a file in the manifest, if it has one.
    pub fn entry(&self, file: &str) -> Option<&ManifestEntry> {
        self.manifest.logs.iter().find(|entry| entry.file == file)
    }

    /// State of a file, which is read through: the manifest alone is not believed.
    pub fn at_home(&self, file: &str) -> AtHome {
        let path = self.path(file);
        let size = std::fs::metadata(&path).map(|about| about.len()).ok();
        match (self.entry(file).cloned(), size) {
            (None, None) => AtHome::Nothing,
            (None, Some(_)) => AtHome::Foreign,
            (Some(entry), None) => AtHome::Gone(entry),
            (Some(entry), Some(size)) => {
                let is_intact = size == entry.size_bytes
                    && sums(&path).is_ok_and(|found| found.sha256 == entry.sha256);
                if is_intact { AtHome::Intact(entry) } else { AtHome::Damaged(entry) }
            }
        }
    }

    /// Moves a file to the older logs under a free name with `mark`: `older/07-damaged-1.BIN`.
    ///
    /// # Errors
    ///
    /// If the file cannot be moved.
    pub fn set_aside(&self, file: &str, mark: &str) -> Result<(), FileError> {
        let from = self.path(file);
        let stem = file.strip_prefix("older/").unwrap_or(file).trim_end_matches(".BIN");
        create_folder(&self.folder.join("older"))?;
        let name = |number: u32| self.folder.join(format!("older/{stem}-{mark}-{number}.BIN"));
        let to = (1..=u32::MAX).map(name).find(|path| !path.exists());
        match to.map(|to| std::fs::rename(&from, to)) {
            Some(Err(source)) if source.kind() != std::io::ErrorKind::NotFound => {
                Err(FileError::new("move aside", &from, source))
            }
            _ => Ok(()),
        }
    }

    /// Moves a log with its entry into the folder of an earlier start, `flight-K`; 0 for a log of
    /// no recorded start. Nothing there is overwritten. Returns the log's new path; `None` if there
    /// was no log.
    ///
    /// # Errors
    /// When a folder or manifest cannot be read or written.
    pub fn retire(&mut self, file: &str, number: u32) -> Result<Option<PathBuf>, CampaignError> {
        let from = self.path(file);
        if !from.exists() {
            return Ok(None);
        }
        let folder = earlier_folder(&self.folder, number);
        create_folder(&folder)?;
        let (stem, extension) = file.rsplit_once('.').unwrap_or((file, "BIN"));
        let to = free_name(&folder, stem.rsplit('/').next().unwrap_or(stem), extension);
        let name = to.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
        // Its entry is there before the file is: a file without one would be anybody's.
        if let Some(entry) = self.entry(file).cloned() {
            let mut there = Self::open(&folder, &self.manifest.made_by)?;
            there.add(ManifestEntry { file: name, ..entry })?;
        }
        std::fs::rename(&from, &to).map_err(|error| FileError::new("move aside", &from, error))?;
        self.forget(file)?;
        Ok(Some(to))
    }

    /// Takes a file's entry out.
    fn forget(&mut self, file: &str) -> Result<(), FileError> {
        self.manifest.logs.retain(|other| other.file != file);
        self.write()
    }

    fn write(&self) -> Result<(), FileError> {
        let path = self.folder.join("manifest.json");
        let bytes =
            to_json(&self.manifest).map_err(|source| FileError::new("write", &path, source))?;
        write_whole(&path, &bytes)
    }

    /// Adds an entry to the manifest and writes it; an entry of the same file is replaced.
    ///
    /// # Errors
    ///
    /// If the manifest cannot be written.
    pub fn add(&mut self, entry: ManifestEntry) -> Result<(), FileError> {
        self.manifest.logs.retain(|other| other.file != entry.file);
        self.manifest.logs.push(entry);
        self.manifest.logs.sort_by(|a, b| a.file.cmp(&b.file));
        self.write()
    }

    /// Gives a finished part its final name, with its entry. The entry is written first: a part
    /// without its name is continued by the next run, a file without an entry would be of unknown
    /// origin.
    ///
    /// # Errors
    ///
    /// If the folder cannot be written.
    pub fn finish(&mut self, part: PartFile, entry: ManifestEntry) -> Result<(), FileError> {
        self.add(entry)?;
        part.finish()
    }

    /// Gives a finished part the name in its entry, which may differ from the one it was begun for;
    /// a log that has this name is moved aside.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn finish_as(&mut self, part: PartFile, entry: ManifestEntry) -> Result<(), FileError> {
        let path = self.path(&entry.file);
        path.parent().map_or(Ok(()), create_folder)?;
        let same = self.entry(&entry.file).is_some_and(|there| there.sha256 == entry.sha256);
        if !same {
            self.set_aside(&entry.file, "other")?;
        }
        self.add(entry)?;
        part.finish_as(&path)
    }

    /// Waits until the disk has the names of all finished logs. Names of earlier logs are on the
    /// disk with the entry of a later one; without this call a power loss could leave the last log
    /// under the name of its part, whole.
    pub fn settle(&self) {
        for folder in [self.folder.clone(), self.folder.join("older")] {
            // Not every file system allows it.
            if let Ok(folder) = File::open(folder) {
                let _ = folder.sync_all();
            }
        }
    }
}

/// A plain file name, or one in the folder of older logs.
fn is_inside(file: &str) -> bool {
    let file = file.strip_prefix("older/").unwrap_or(file);
    !file.is_empty() && !file.starts_with('.') && !file.contains(['/', '\\', ':'])
}
