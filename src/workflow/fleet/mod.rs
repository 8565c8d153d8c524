//! Flights of real and of virtual drones: found, loaded, checked, started, watched, brought down, and
//! their logs brought home.

pub(crate) mod bring;
pub(crate) mod cards;
pub(crate) mod crew;
pub(crate) mod dry;
pub(crate) mod end;
pub(crate) mod fly;
pub(crate) mod hangar;
pub(crate) mod interrupt;
pub(crate) mod links;
pub(crate) mod logs;
pub(crate) mod output;
pub(crate) mod practice;
pub(crate) mod preflight;
pub(crate) mod server;
pub(crate) mod start;
pub(crate) mod steps;
pub(crate) mod verify;
mod virtual_flight;
pub(crate) mod watch;
mod who;

use std::path::Path;

pub use self::virtual_flight::fly_virtual;
pub(crate) use self::virtual_flight::rehearse;
use super::error::WorkflowError;
use super::host::Host;
use crate::base::plain::Shown as _;
use crate::campaign::lock::FolderLock;
use crate::campaign::{self, FlightFolder};
use crate::mission::Plan;

/// A campaign is a folder that is there.
fn needs_folder(campaign: &Path) -> Result<(), WorkflowError> {
    if campaign.is_file() {
        return Err(WorkflowError::Usage(format!(
            "{} is a file; give the campaign's folder",
            campaign.shown()
        )));
    }
    Ok(())
}

/// Locks a campaign; a folder that is not there is not made.
pub(crate) fn lock(host: &dyn Host, campaign: &Path) -> Result<FolderLock, WorkflowError> {
    needs_folder(campaign)?;
    if !campaign.exists() {
        campaign::flights(campaign)?;
    }
    host.lock(campaign)
}

/// The one flight of a campaign that is meant.
pub(crate) fn one_flight(
    campaign: &Path,
    name: Option<&str>,
) -> Result<(FlightFolder, Plan), WorkflowError> {
    needs_folder(campaign)?;
    let mut names = Vec::new();
    let mut found = Vec::new();
    for folder in campaign::flights(campaign)? {
        let plan = folder.read_plan()?;
        names.push(plan.name.clone());
        if name.is_none_or(|name| name == plan.name) {
            found.push((folder, plan));
        }
    }
    let listed = names.join(", ");
    match (found.len(), name) {
        (1, _) => Ok(found.remove(0)),
        (0, Some(name)) => Err(WorkflowError::Usage(format!(
            "the campaign has no flight \"{name}\", but {listed}"
        ))),
        _ => Err(WorkflowError::Usage(format!("which flight? give --flight ({listed})"))),
    }
}
