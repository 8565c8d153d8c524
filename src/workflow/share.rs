//! Work that is shared out between processes: what a shard has done, and which items are missing.

use std::path::Path;

use super::ending::Ending;
use super::error::WorkflowError;
use crate::base::file::FileError;
use crate::base::shard::{Shard, Share};
use crate::campaign::items::{self, ItemsRecord};

/// Outcome of a shard's work.
#[derive(Clone, Debug)]
pub struct ShardDone {
    /// Shard whose items were worked on.
    pub shard: Shard,
    /// Number of its items.
    pub items: usize,
    /// Number of items that were finished before.
    pub there: usize,
    /// Reasons why items could not be made, one sentence each.
    pub lost: Vec<String>,
}

impl ShardDone {
    /// Ending of the work: with losses if an item could not be made.
    pub fn ending(&self) -> Ending {
        Ending::of_losses(!self.lost.is_empty())
    }

    /// Number of items that were made by this process.
    pub fn made(&self) -> usize {
        self.items - self.there - self.lost.len()
    }
}

/// Refuses to gather from a folder that is not there, and does not make it.
///
/// # Errors
/// If results are only to be put together, and their folder does not exist.
pub fn needs_folder(folder: &Path, share: Share) -> Result<(), WorkflowError> {
    if share.gather_only && !folder.is_dir() {
        let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(FileError::new("gather results from", folder, missing).into());
    }
    Ok(())
}

/// Takes a folder for items, joins those who have taken it, or, where results are only to be put together, looks. Without
/// a shard `takes_over` says whether items of other settings give way.
///
/// # Errors
/// If the folder has items of other settings, another version or another kind.
pub fn join(
    folder: &Path,
    record: &ItemsRecord,
    share: Share,
    takes_over: bool,
) -> Result<(), WorkflowError> {
    match share {
        Share { gather_only: true, .. } => items::check(folder, record)?,
        Share { shard: None, .. } if takes_over => items::take_over(folder, record)?,
        _ => items::join(folder, record)?,
    }
    Ok(())
}

/// Runs `work` on so many threads; `None`: on those of the program.
pub(crate) fn on_threads<T: Send>(
    jobs: Option<u16>,
    work: impl FnOnce() -> T + Send,
) -> Result<T, WorkflowError> {
    let Some(jobs) = jobs else { return Ok(work()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(jobs)).build();
    let pool =
        pool.map_err(|error| WorkflowError::Failed(format!("failed to start threads: {error}")))?;
    Ok(pool.install(work))
}

/// Numbers in a few words: `3, 7 to 12, 40`. They ascend.
pub(crate) fn numbers(all: &[usize]) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for number in all {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == *number => *last = *number,
            _ => runs.push((*number, *number)),
        }
    }
    let word = |(first, last): &(usize, usize)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first} to {last}"),
    };
    runs.iter().map(word).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::numbers;

    #[test]
    fn every_number_is_named() {
        assert_eq!(numbers(&[3, 7, 8, 9, 12, 13, 40]), "3, 7 to 9, 12, 13, 40");
        assert_eq!(numbers(&[]), "");
    }
}
