//! Flight of the cells that are not finished yet; every finished flight is kept as one whole file.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::cell::{Cell, Condition};
use super::error::StudyError;
use super::fly::{CELL_SCHEMA, CellLog, CellRecord, FlyError, fly_cell};
use super::template::StudyPlan;
use crate::base::digest::sha256;
use crate::base::file::{FileError, create_folder, read_whole, sweep_partial, write_whole};
use crate::base::parse;
use crate::base::shard::Share;
use crate::sim::SimError;

/// Largest record that is read back, bytes.
const MAX_RECORD_BYTES: u64 = 16 << 20;

/// Settings of flying a study that do not belong to its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// Seed of the study; every flight has its own from it.
    pub seed: u64,
    /// Whether the log of every flight is kept.
    pub keep_logs: bool,
    /// Whether finished flights are flown again.
    pub force: bool,
    /// Which flights are looked at.
    pub share: Share,
}

impl Settings {
    /// Settings for all flights of a study with this seed; logs are not kept.
    pub fn new(seed: u64) -> Self {
        Self { seed, ..Self::default() }
    }
}

/// A flight that could not be flown or read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lost {
    /// Index in the study's cells.
    pub cell: usize,
    /// Reason why the flight failed, one sentence.
    pub reason: String,
}

/// Flights of a study: finished and lost ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flown {
    /// Record of each cell that was looked at, in the study's order; `None` for a lost flight.
    pub records: Vec<Option<CellRecord>>,
    /// Flights that failed, with their reasons.
    pub lost: Vec<Lost>,
    /// Number of cells flown by this call; the records of the rest were already there.
    pub flown: usize,
}

/// A study with the flights that are already finished in its folder.
#[derive(Debug)]
pub struct Work<'a> {
    study: &'a StudyPlan,
    folder: &'a Path,
    settings: Settings,
    cells: Vec<Item>,
}

#[derive(Debug)]
struct Item {
    cell: Cell,
    key: String,
    record: Option<CellRecord>,
}

/// Folder of the records of finished flights, in a study's folder.
pub fn cells_folder(folder: &Path) -> PathBuf {
    folder.join("cells")
}

/// Folder of the logs that were kept, in a study's folder.
pub fn logs_folder(folder: &Path) -> PathBuf {
    folder.join("logs")
}

impl<'a> Work<'a> {
    /// Opens a study's folder and finds the flights that are already finished with these settings.
    ///
    /// # Errors
    /// [`StudyError::File`] if the folder cannot be made or read.
    pub fn open(
        study: &'a StudyPlan,
        folder: &'a Path,
        settings: Settings,
    ) -> Result<Self, StudyError> {
        create_folder(&cells_folder(folder))?;
        sweep_partial(&cells_folder(folder))?;
        if settings.keep_logs {
            create_folder(&logs_folder(folder))?;
        }
        if logs_folder(folder).is_dir() {
            sweep_partial(&logs_folder(folder))?;
        }
        let mut cells = study.cells();
        let mut item = 0..;
        cells.retain(|_| item.next().is_some_and(|item| settings.share.takes(item)));
        let cells = cells
            .into_par_iter()
            .map(|cell| {
                let key = cell
                    .key(study, settings.seed)
                    .map_err(|source| StudyError::Record { cell: cell.name(), source })?;
                let record = finished(folder, &cell, &key, settings);
                Ok(Item { cell, key, record })
            })
            .collect::<Result<_, StudyError>>()?;
        Ok(Self { study, folder, settings, cells })
    }

    /// Number of flights that are looked at: of the study, or of a share of it.
    pub fn total(&self) -> usize {
        self.cells.len()
    }

    /// Number of flights that are not finished.
    pub fn open_flights(&self) -> usize {
        self.cells.iter().filter(|item| item.record.is_none()).count()
    }

    /// Study that is flown.
    pub fn study(&self) -> &'a StudyPlan {
        self.study
    }

    /// Seed of the study.
    pub fn seed(&self) -> u64 {
        self.settings.seed
    }

    /// Names of the flights that are not finished.
    pub fn missing(&self) -> Vec<String> {
        self.cells
            .iter()
            .filter(|item| item.record.is_none())
            .map(|item| item.cell.name())
            .collect()
    }

    /// Flies the open cells on all threads of the current pool; a flight that fails is lost and
    /// does not stop the others. `done` is called after each flight. Each thread holds one log.
    ///
    /// # Errors
    /// [`StudyError::Stopped`] when `stop` was raised (what is finished is kept), and
    /// [`StudyError::File`] when a finished flight could not be written.
    pub fn fly(self, stop: &AtomicBool, done: &(dyn Fn() + Sync)) -> Result<Flown, StudyError> {
        let flown = self.open_flights();
        let Self { study, folder, settings, cells } = self;
        let results = cells
            .into_par_iter()
            .map(|item| {
                if let Some(record) = item.record {
                    return Ok(Ok(record));
                }
                let result = match fly_cell(study, &item.cell, settings.seed, stop) {
                    Ok((mut record, log)) => {
                        record.key = item.key;
                        let log = settings.keep_logs.then(|| log.held()).flatten();
                        keep(folder, &item.cell, &mut record, log)?;
                        Ok(record)
                    }
                    Err(FlyError::Sim(SimError::Stopped { .. })) => {
                        return Err(StudyError::Stopped);
                    }
                    Err(FlyError::Sim(error)) => Err(error.to_string()),
                    Err(FlyError::Flight(error)) => Err(error.to_string()),
                };
                done();
                Ok(result)
            })
            .collect::<Result<Vec<_>, StudyError>>()?;
        let mut all = Flown { flown, ..Flown::default() };
        for (cell, result) in results.into_iter().enumerate() {
            if let Err(reason) = &result {
                all.lost.push(Lost { cell, reason: reason.clone() });
            }
            all.records.push(result.ok());
        }
        Ok(all)
    }
}

/// SHA-256 of what all flights of a study have in common, hexadecimal.
///
/// # Errors
/// [`StudyError::Record`] if the settings have no form as JSON.
pub fn study_sha256(study: &StudyPlan, seed: u64) -> Result<String, StudyError> {
    // The key of a cell has all of it, and its air beside.
    let reference = Cell { condition: Condition::STILL, updraft_mps: 0.0 };
    reference
        .key(study, seed)
        .map_err(|source| StudyError::Record { cell: reference.name(), source })
}

fn record_path(folder: &Path, cell: &Cell) -> PathBuf {
    cells_folder(folder).join(format!("{}.json", cell.name()))
}

fn log_path(folder: &Path, cell: &Cell) -> PathBuf {
    logs_folder(folder).join(format!("{}.BIN", cell.name()))
}

/// The record of a flight if it is there, whole, and of these settings. A damaged one is flown again.
fn finished(folder: &Path, cell: &Cell, key: &str, settings: Settings) -> Option<CellRecord> {
    if settings.force {
        return None;
    }
    let bytes = read_whole(&record_path(folder, cell), MAX_RECORD_BYTES).ok()?;
    let record: CellRecord = parse::json(&bytes).ok()?;
    if record.schema != CELL_SCHEMA || record.key != key {
        return None;
    }
    if settings.keep_logs {
        let size = std::fs::metadata(log_path(folder, cell)).ok()?.len();
        if record.log.as_ref()?.bytes != size {
            return None;
        }
    }
    Some(record)
}

/// Writes the log, then the record: where the record is, all is.
fn keep(
    folder: &Path,
    cell: &Cell,
    record: &mut CellRecord,
    log: Option<&[u8]>,
) -> Result<(), StudyError> {
    let path = log_path(folder, cell);
    if let Some(bytes) = log {
        write_whole(&path, bytes)?;
        record.log = Some(CellLog {
            file: format!("{}.BIN", cell.name()),
            bytes: bytes.len() as u64,
            sha256: sha256(bytes),
        });
    } else if path.exists() {
        // It belongs to other settings.
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(FileError::new("remove", &path, error).into());
            }
            // A peer that flies the same was first.
            _ => {}
        }
    }
    let mut json = serde_json::to_vec(record)
        .map_err(|source| StudyError::Record { cell: cell.name(), source })?;
    json.push(b'\n');
    Ok(write_whole(&record_path(folder, cell), &json)?)
}
