//! Check of logs at home against their records: manifests of those that came, records of those that
//! were simulated.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::campaign::origin::LogOrigin;
use crate::campaign::start::earlier_folders;
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::fleet::logs::verify::{unknown, verify};
use crate::log::Log;
use crate::workflow::error::WorkflowError;

/// A log at home.
#[derive(Serialize, JsonSchema)]
pub(crate) struct VerifyRow {
    /// Name of its flight.
    pub(crate) flight: String,
    /// Where it is in the flight's folder.
    pub(crate) file: String,
    /// What is wrong with it.
    pub(crate) faults: Vec<String>,
}

/// All logs of a campaign.
pub(crate) fn verify_all(campaign: &Path) -> Result<Vec<VerifyRow>, WorkflowError> {
    let mut rows = Vec::new();
    for folder in campaign::flights(campaign)? {
        let plan = folder.read_plan()?;
        let row = |logs: &Path, file: &str, faults: Vec<String>| {
            let path = logs.join(file);
            let shown = path.strip_prefix(&folder.0).unwrap_or(&path);
            VerifyRow { flight: plan.name.clone(), file: shown.shown().to_string(), faults }
        };
        for (logs, file, faults) in simulated(&folder)? {
            rows.push(row(&logs, &file, faults));
        }
        let earlier = earlier_folders(&folder.logs())?.into_iter().map(|(_, folder)| folder);
        for logs in std::iter::once(folder.logs()).chain(earlier) {
            for checked in verify(&logs)? {
                let faults = checked.faults.iter().map(ToString::to_string).collect();
                rows.push(row(&logs, &checked.entry.file, faults));
            }
            for file in unknown(&logs)? {
                let fault = "has no record of its download (manifest.json), so it cannot be \
                             verified";
                rows.push(row(&logs, &file, vec![fault.to_owned()]));
            }
        }
    }
    Ok(rows)
}

/// A log's folder and file, and what is wrong with it.
type Checked = (PathBuf, String, Vec<String>);

/// Every log of the flight's record, with its folder and what is wrong with it: size, CRC-32, and
/// whether it is a log.
fn simulated(folder: &FlightFolder) -> Result<Vec<Checked>, CampaignError> {
    let at = folder.logs_of(LogOrigin::Simulated);
    let Some(record) = at.read_record()? else { return Ok(Vec::new()) };
    let checked = record.logs.iter().map(|log| {
        let path = at.folder.join(&log.file);
        let again = "simulate it again";
        let difference: Result<Option<String>, FileError> = log.difference(&path);
        let fault = match difference {
            Err(error) => Some(format!("cannot be read: {}; {again}", error.source)),
            Ok(Some(how)) => Some(format!("has changed since it was simulated: {how}; {again}")),
            Ok(None) => Log::open(&path).err().map(|error| {
                format!("is unchanged since it was simulated, but cannot be read as a log: {error}")
            }),
        };
        (at.folder.clone(), log.file.clone(), fault.into_iter().collect())
    });
    Ok(checked.collect())
}
