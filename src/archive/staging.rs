//! Tables of one campaign on their way into an archive: written in a hidden folder, renamed into their places when all of them
//! are whole.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::index::{ArchivedCampaign, Part, place};
use super::table::{Column, Table};
use super::{ArchiveError, PART_FILE};
use crate::base::file::{FileError, create_folder};

/// Name of the hidden folder in an archive.
const STAGING: &str = ".partial-campaign";

/// The tables of one campaign that are written so far.
#[derive(Debug)]
pub struct Staging {
    folder: PathBuf,
    made: Vec<(Part, PathBuf)>,
}

impl Staging {
    /// Begins with an empty folder; what a killed run left there is removed. The archive must be locked.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn begin(archive: &Path) -> Result<Self, ArchiveError> {
        let folder = archive.join(STAGING);
        clear(&folder)?;
        create_folder(&folder)?;
        Ok(Self { folder, made: Vec::new() })
    }

    /// Begins a table of one date.
    ///
    /// # Errors
    /// If its file cannot be made.
    pub fn table<R>(
        &self,
        table: &'static str,
        date: &str,
        columns: Vec<Column<R>>,
    ) -> Result<Table<R, File>, ArchiveError> {
        let path = self.path(table, date);
        let file = File::create(&path).map_err(|error| FileError::new("write", &path, error))?;
        Table::begin(file, columns)
            .map_err(|error| ArchiveError::Table { table, reason: error.to_string() })
    }

    /// Ends a table; its file is on disk then.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish<R>(
        &mut self,
        table: &'static str,
        date: &str,
        written: Table<R, File>,
    ) -> Result<(), ArchiveError> {
        let path = self.path(table, date);
        let (rows, file) = written
            .finish()
            .map_err(|error| ArchiveError::Table { table, reason: error.to_string() })?;
        file.sync_all().map_err(|error| FileError::new("write", &path, error))?;
        let bytes = file.metadata().map_err(|error| FileError::new("read", &path, error))?.len();
        let part = Part { table: table.to_owned(), date: date.to_owned(), rows, bytes };
        self.made.push((part, path));
        Ok(())
    }

    /// Writes a short table of one date, also one without rows: whoever asks for a table finds it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write<R>(
        &mut self,
        table: &'static str,
        date: &str,
        columns: Vec<Column<R>>,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<(), ArchiveError> {
        let mut written = self.table(table, date, columns)?;
        for row in rows {
            written
                .push(row)
                .map_err(|error| ArchiveError::Table { table, reason: error.to_string() })?;
        }
        self.finish(table, date, written)
    }

    fn path(&self, table: &str, date: &str) -> PathBuf {
        self.folder.join(format!("{table} {date}"))
    }

    /// Renames all tables into their places, and removes the partitions of `before` that the campaign no longer has. Returns
    /// the partitions.
    ///
    /// # Errors
    /// If a file cannot be moved or removed.
    pub fn place(
        self,
        archive: &Path,
        id: &str,
        before: Option<&ArchivedCampaign>,
    ) -> Result<Vec<Part>, ArchiveError> {
        let mut parts = Vec::new();
        for (part, from) in &self.made {
            create_folder(&place(archive, &part.table, &part.date, id))?;
            parts.push((part.clone(), from));
        }
        for (part, from) in &parts {
            let to = place(archive, &part.table, &part.date, id).join(PART_FILE);
            fs::rename(from, &to).map_err(|error| FileError::new("write", &to, error))?;
        }
        let parts: Vec<Part> = parts.into_iter().map(|(part, _)| part).collect();
        if let Some(before) = before {
            let stays = |old: &Part| {
                before.id == id
                    && parts.iter().any(|new| (&new.table, &new.date) == (&old.table, &old.date))
            };
            let old = before.parts.iter().filter(|old| !stays(old));
            remove(archive, before, old)?;
        }
        Ok(parts)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // The next campaign clears it as well.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn clear(folder: &Path) -> Result<(), FileError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(FileError::new("remove", folder, error))
        }
        _ => Ok(()),
    }
}

/// Removes partitions of a campaign, and the folders that are empty then.
///
/// # Errors
/// If a file cannot be removed.
pub fn remove<'a>(
    archive: &Path,
    campaign: &ArchivedCampaign,
    parts: impl IntoIterator<Item = &'a Part>,
) -> Result<(), FileError> {
    for part in parts {
        let folder = campaign.place(archive, part);
        let file = folder.join(PART_FILE);
        match fs::remove_file(&file) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(FileError::new("remove", &file, error));
            }
            _ => {}
        }
        // Only empty folders can be removed: others stay.
        let _ = fs::remove_dir(&folder);
        let _ = folder.parent().map(fs::remove_dir);
    }
    Ok(())
}
