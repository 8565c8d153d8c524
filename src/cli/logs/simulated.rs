//! Logs that the simulator wrote: they are home from the beginning, and their record says what they
//! were.

use std::path::PathBuf;

use crate::base::file::FileError;
use crate::campaign::origin::LogOrigin;
use crate::campaign::{CampaignError, FlightFolder};
use crate::log::Log;

/// A log's folder and file, and what is wrong with it.
pub(super) type Checked = (PathBuf, String, Vec<String>);

/// Every log of the flight's record, with its folder and what is wrong with it: size, CRC-32, and
/// whether it is a log.
pub(super) fn verify(folder: &FlightFolder) -> Result<Vec<Checked>, CampaignError> {
    let at = folder.logs_of(LogOrigin::Simulated);
    let Some(record) = at.read_record()? else { return Ok(Vec::new()) };
    let checked = record.logs.iter().map(|log| {
        let path = at.folder.join(&log.file);
        let again = "simulate it again";
        let difference: Result<Option<String>, FileError> = log.difference(&path);
        let fault = match difference {
            Err(error) => Some(format!("cannot be read: {}; {again}", error.source)),
            Ok(Some(how)) => Some(format!("is not as it was simulated: {how}; {again}")),
            Ok(None) => Log::open(&path).err().map(|error| {
                format!("is as it was simulated, but no log that can be read: {error}")
            }),
        };
        (at.folder.clone(), log.file.clone(), fault.into_iter().collect())
    });
    Ok(checked.collect())
}
