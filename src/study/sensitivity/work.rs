//! Flight of the campaigns that are not finished yet; every finished one is kept as one whole file.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::design::{Drawn, Item};
use super::item::{ITEM_SCHEMA, ItemRecord, Row, finished, items_folder, shelf, shelves};
use super::outcome::Outcome;
use super::template::SensitivityPlan;
use crate::base::file::{FileError, create_folder, sweep_partial};
use crate::base::shard::Share;
use crate::study::StudyError;

/// A campaign that was flown, before it is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// Outcome of the campaign, or why it was lost: one sentence.
    pub result: Result<Outcome, String>,
    /// Doubts about the campaign, one sentence each.
    pub warnings: Vec<String>,
}

/// Reason why a campaign was not brought to an end; the next run tries it again.
#[derive(Debug)]
pub enum NotDone {
    /// The user asked to stop.
    Stopped,
    /// A file could not be read or written.
    File(FileError),
}

/// A way to fly one campaign.
pub type Fly<'a> = dyn Fn(&Item) -> Result<Done, NotDone> + Sync + 'a;

/// A study with the campaigns that are already finished in its folder.
#[derive(Debug)]
pub struct SensitivityWork<'a> {
    study: &'a SensitivityPlan,
    folder: &'a Path,
    drawn: Drawn<'a>,
    rows: Vec<Option<Row>>,
}

/// The campaigns of a study: finished and lost ones, and those that are still to be flown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gathered {
    /// Row of each campaign, in order; `None`: not flown yet.
    pub rows: Vec<Option<Row>>,
    /// Number of campaigns that were flown by this call.
    pub flown: usize,
}

impl<'a> SensitivityWork<'a> {
    /// Opens a study's folder and finds the campaigns of a share that are already finished with these settings. Of each
    /// record, its row alone is held.
    ///
    /// # Errors
    /// [`StudyError::File`] if the folder cannot be made or read.
    pub fn open(
        study: &'a SensitivityPlan,
        folder: &'a Path,
        seed: u64,
        force: bool,
        share: Share,
    ) -> Result<Self, StudyError> {
        create_folder(&items_folder(folder))?;
        let drawn = study.drawn(seed);
        for first in shelves(drawn.len()) {
            let shelf = shelf(folder, first);
            if shelf.is_dir() {
                sweep_partial(&shelf)?;
            }
        }
        let rows = (0..drawn.len())
            .into_par_iter()
            .map(|index| {
                if force || !share.takes(index) {
                    return Ok(None);
                }
                Ok(finished(folder, index, &key(study, &drawn.item(index))?))
            })
            .collect::<Result<_, StudyError>>()?;
        Ok(Self { study, folder, drawn, rows })
    }

    /// Numbers of the campaigns that are not finished, of those that `takes` takes.
    pub fn missing(&self, takes: &(dyn Fn(usize) -> bool + Sync)) -> Vec<usize> {
        self.open_indices(takes)
    }

    /// Number of campaigns of the study.
    pub fn total(&self) -> usize {
        self.rows.len()
    }

    /// Number of campaigns that are not finished, of those that `takes` takes.
    pub fn open_items(&self, takes: &(dyn Fn(usize) -> bool + Sync)) -> usize {
        self.open_indices(takes).len()
    }

    fn open_indices(&self, takes: &(dyn Fn(usize) -> bool + Sync)) -> Vec<usize> {
        let is_open =
            |(index, row): (usize, &Option<Row>)| (row.is_none() && takes(index)).then_some(index);
        self.rows.iter().enumerate().filter_map(is_open).collect()
    }

    /// Flies the open campaigns that `takes` takes, as many at a time as the current pool has threads; `fly` flies
    /// one with a single thread, so that only so many are in memory and on the disk. One that is lost does not stop
    /// the others. `done` is called after each.
    ///
    /// # Errors
    /// [`StudyError::Stopped`] when `stop` was raised (what is finished is kept), and [`StudyError::File`] when a
    /// file could not be read or written.
    pub fn fly(
        mut self,
        takes: &(dyn Fn(usize) -> bool + Sync),
        fly: &Fly<'_>,
        stop: &AtomicBool,
        done: &(dyn Fn() + Sync),
    ) -> Result<Gathered, StudyError> {
        let open = self.open_indices(takes);
        let (next, failed) = (AtomicUsize::new(0), Mutex::new(None::<StudyError>));
        let new: Mutex<Vec<(usize, Row)>> = Mutex::new(Vec::new());
        let fail = |error: StudyError| {
            let mut first = failed.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert(error);
            // Nobody takes another.
            next.store(open.len(), Ordering::SeqCst);
        };
        let work = || {
            while let Some(index) = open.get(next.fetch_add(1, Ordering::SeqCst)).copied() {
                if stop.load(Ordering::SeqCst) {
                    return fail(StudyError::Stopped);
                }
                match self.fly_one(index, fly) {
                    Ok(row) => {
                        new.lock().unwrap_or_else(PoisonError::into_inner).push((index, row));
                        done();
                    }
                    Err(error) => return fail(error),
                }
            }
        };
        let threads = rayon::current_num_threads().min(open.len());
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    // What a campaign does at the same time, it does here one after the other: a thread that waits
                    // would begin the next campaign in the middle of this one.
                    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                        Ok(pool) => pool.install(work),
                        Err(error) => fail(StudyError::Threads { reason: error.to_string() }),
                    }
                });
            }
        });
        if let Some(error) = failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        let new = new.into_inner().unwrap_or_else(PoisonError::into_inner);
        let flown = new.len();
        for (index, row) in new {
            if let Some(place) = self.rows.get_mut(index) {
                *place = Some(row);
            }
        }
        Ok(Gathered { rows: self.rows, flown })
    }

    /// Flies one campaign and keeps its record.
    fn fly_one(&self, index: usize, fly: &Fly<'_>) -> Result<Row, StudyError> {
        let item = self.drawn.item(index);
        let done = fly(&item).map_err(|error| match error {
            NotDone::Stopped => StudyError::Stopped,
            NotDone::File(error) => StudyError::File(error),
        })?;
        let (outcome, lost) = match done.result {
            Ok(outcome) => (Some(outcome), None),
            Err(reason) => (None, Some(reason)),
        };
        let level = |(factor, level): (&super::Factor, _)| {
            let json = serde_json::to_value::<&super::Level>(level);
            Ok((factor.name.clone(), json.map_err(|error| record_error(&item, error))?))
        };
        let levels = self.study.factors.iter().zip(&item.levels).map(level);
        let record = ItemRecord {
            schema: ITEM_SCHEMA.to_owned(),
            key: key(self.study, &item)?,
            item: index as u64,
            seed: item.seed,
            levels: levels.collect::<Result<_, StudyError>>()?,
            outcome,
            lost,
            warnings: done.warnings,
        };
        record.write(self.folder)?;
        Ok(record.row())
    }
}

fn key(study: &SensitivityPlan, item: &Item) -> Result<String, StudyError> {
    study.key(item).map_err(|error| record_error(item, error))
}

/// SHA-256 of what all campaigns of a study have in common, hexadecimal.
///
/// # Errors
/// [`StudyError::Record`] if the settings have no form as JSON.
pub fn sensitivity_sha256(study: &SensitivityPlan, seed: u64) -> Result<String, StudyError> {
    // The key of one has all of it.
    key(study, &study.drawn(seed).item(0))
}

fn record_error(item: &Item, source: serde_json::Error) -> StudyError {
    StudyError::Record { cell: format!("campaign {}", item.index), source }
}
