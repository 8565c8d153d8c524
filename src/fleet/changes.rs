//! Record of parameters that were changed on vehicles, with their old values, and the way to
//! restore them.
//!
//! What belongs to an upload (the fence) and what is required otherwise are written down alike.
//! An old value that leaves a vehicle without a fence is put back only when that is said.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::params::SetParams;
use crate::base::file::write_whole;
use crate::campaign::{CampaignError, read_json, to_json};
use crate::link::id::DroneId;

/// A change that was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// The parameter.
    pub name: String,
    /// Its value before.
    pub was: f32,
    /// Its value since.
    pub now: f32,
}

impl Change {
    /// Whether restoring the old value would leave the vehicle without a fence: switched off, of no
    /// type, or without consequences.
    pub fn unfences(&self) -> bool {
        matches!(self.name.as_str(), "FENCE_ENABLE" | "FENCE_TYPE" | "FENCE_ACTION")
            && self.was as i64 == 0
    }
}

/// Name and version of the file of changes.
pub const CHANGES_SCHEMA: &str = "updraft.changes/1";
/// Name of the file of changes in a campaign folder.
pub const CHANGES_FILE: &str = "fleet-changes.json";

/// `fleet-changes.json`: every parameter changed on a vehicle, with the value it had at first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Changes {
    /// Format name and version: `updraft.changes/1`.
    pub schema: String,
    /// Per vehicle; the newest value counts, the first one is restored.
    pub drones: Vec<DroneChanges>,
}

/// The changes of one vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DroneChanges {
    /// The vehicle.
    pub drone: DroneId,
    /// What was changed.
    pub changes: Vec<Change>,
}

impl Default for Changes {
    fn default() -> Self {
        Self { schema: CHANGES_SCHEMA.to_owned(), drones: Vec::new() }
    }
}

impl Changes {
    /// Reads the file of changes in a folder; no changes if there is no file.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read(folder: &Path) -> Result<Self, CampaignError> {
        let path = folder.join(CHANGES_FILE);
        if !path.exists() {
            return Ok(Self::default());
        }
        let changes: Self = read_json(&path)?;
        if changes.schema == CHANGES_SCHEMA {
            Ok(changes)
        } else {
            let (right, found) = (CHANGES_SCHEMA, &changes.schema);
            let reason = format!("this program reads \"{right}\", not \"{found}\"");
            Err(CampaignError::Json { path, reason })
        }
    }

    /// Writes the file of changes into a folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), CampaignError> {
        let path = folder.join(CHANGES_FILE);
        let json = to_json(self).map_err(|error| CampaignError::Json {
            path: path.clone(),
            reason: error.to_string(),
        })?;
        Ok(write_whole(&path, &json)?)
    }

    /// Adds changes of a vehicle; if a parameter was changed before, its first old value is kept.
    pub fn add(&mut self, drone: DroneId, changes: &[Change]) {
        if changes.is_empty() {
            return;
        }
        let index = self.drones.iter().position(|entry| entry.drone == drone);
        let index = index.unwrap_or_else(|| {
            self.drones.push(DroneChanges { drone, changes: Vec::new() });
            self.drones.len() - 1
        });
        let known = &mut self.drones[index].changes;
        for change in changes {
            match known.iter_mut().find(|old| old.name == change.name) {
                Some(old) => old.now = change.now,
                None => known.push(change.clone()),
            }
        }
        self.drones.sort_by_key(|entry| entry.drone);
    }

    /// Conversations that restore old values, one per vehicle, for the changes that `may` allows.
    /// Afterwards [`Changes::forget`] removes them from the record.
    pub fn restore(&self, may: impl Fn(DroneId, &Change) -> bool) -> BTreeMap<DroneId, SetParams> {
        let conversation = |entry: &DroneChanges| {
            let changes = entry.changes.iter().filter(|change| may(entry.drone, change));
            let values: Vec<_> = changes.map(|change| (change.name.clone(), change.was)).collect();
            (!values.is_empty()).then(|| (entry.drone, SetParams::new(entry.drone, values)))
        };
        self.drones.iter().filter_map(conversation).collect()
    }

    /// Removes the changes that [`Changes::restore`] has undone on a vehicle.
    pub fn forget(&mut self, drone: DroneId, may: impl Fn(DroneId, &Change) -> bool) {
        for entry in self.drones.iter_mut().filter(|entry| entry.drone == drone) {
            entry.changes.retain(|change| !may(drone, change));
        }
        self.drones.retain(|entry| !entry.changes.is_empty());
    }

    /// Vehicles whose fence was off, or without effect, before the first change: it stays on until
    /// somebody decides otherwise.
    pub fn unfenced_before(&self) -> Vec<DroneId> {
        let unfenced = |entry: &&DroneChanges| entry.changes.iter().any(Change::unfences);
        self.drones.iter().filter(unfenced).map(|entry| entry.drone).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_read_as_they_were_written_and_there_are_none_without_a_file() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Changes::read(folder.path()).unwrap(), Changes::default());
        let mut changes = Changes::default();
        let change = Change { name: "FENCE_ENABLE".to_owned(), was: 0.0, now: 1.0 };
        changes.add(DroneId { network: 0, system: 1 }, &[change]);
        changes.write(folder.path()).unwrap();
        assert_eq!(Changes::read(folder.path()).unwrap(), changes);
    }
}
