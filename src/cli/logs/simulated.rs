//! Logs that the simulator wrote: they are home from the beginning, and their record says what they
//! were.

use crate::base::file::FileError;
use crate::campaign::{CampaignError, FlightFolder};
use crate::log::Log;
use crate::mission::Plan;

/// Whether every drone of the plan has a simulated log in the folder.
pub(super) fn all_home(folder: &FlightFolder, plan: &Plan) -> Result<bool, CampaignError> {
    let Some(record) = folder.read_record()? else { return Ok(false) };
    let is_home = |slot: u16| {
        let log = record.logs.iter().find(|log| log.slot == slot);
        log.is_some_and(|log| folder.logs().join(&log.file).is_file())
    };
    Ok(plan.slots.iter().all(|slot| is_home(slot.slot)))
}

/// Every log of the flight's record with what is wrong with it: size, CRC-32, and whether it is a log.
pub(super) fn verify(folder: &FlightFolder) -> Result<Vec<(String, Vec<String>)>, CampaignError> {
    let Some(record) = folder.read_record()? else { return Ok(Vec::new()) };
    let checked = record.logs.iter().map(|log| {
        let path = folder.logs().join(&log.file);
        let again = "simulate it again";
        let difference: Result<Option<String>, FileError> = log.difference(&path);
        let fault = match difference {
            Err(error) => Some(format!("cannot be read: {}; {again}", error.source)),
            Ok(Some(how)) => Some(format!("is not as it was simulated: {how}; {again}")),
            Ok(None) => Log::open(&path).err().map(|error| {
                format!("is as it was simulated, but no log that can be read: {error}")
            }),
        };
        (log.file.clone(), fault.into_iter().collect())
    });
    Ok(checked.collect())
}
