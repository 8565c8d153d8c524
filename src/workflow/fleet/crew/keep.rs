//! Parameters that are changed on drones: their old values are on disk before new ones are set, and
//! are restored on request.

use std::collections::{BTreeMap, BTreeSet};

use super::{AT_ONCE, Crew};
use crate::fleet::changes::{Change, Changes, DroneChanges};
use crate::fleet::command::Patience;
use crate::fleet::gate::State;
use crate::fleet::params::{ReadParams, SetError, same};
use crate::fleet::slots::FleetTable;
use crate::link::clock::S;
use crate::link::id::DroneId;
use crate::workflow::error::WorkflowError;

/// Long enough for a drone that has just been switched on.
const PATIENCE: Patience = Patience { every: S, tries: 30 };

impl Crew<'_> {
    /// Reads what the fence's parameters are and writes down those that an upload changes: before
    /// it does, so that nothing is lost when this program is killed meanwhile. Drones that do not
    /// tell, with what is said of them: nothing may be changed on them.
    pub(super) fn remember_fence(&mut self) -> Result<BTreeMap<DroneId, String>, WorkflowError> {
        let mut silent = BTreeMap::new();
        if self.is_virtual {
            return Ok(silent);
        }
        let wanted = self.fence()?.params();
        let names = || wanted.iter().map(|(name, _)| name.clone());
        let read = |drone| (drone, ReadParams::new(drone, names()).with_patience(PATIENCE));
        // Nothing is changed on those in the air, so that nothing of them need be kept.
        let is_touched =
            |drone: &DroneId| matches!(self.net.state(*drone), State::Ground | State::Unheard);
        let conversations = self.drones().into_iter().filter(is_touched).map(read).collect();
        let found = self.all(conversations, AT_ONCE)?;
        let mut changes = Changes::read(&self.folder.0)?;
        let before = changes.clone();
        for (drone, values) in found {
            let mut others = Vec::new();
            for (name, now) in &wanted {
                match values.get(name) {
                    Some(was) if !same(*was, *now) => {
                        others.push(Change { name: name.clone(), was: *was, now: *now });
                    }
                    Some(_) => {}
                    None => {
                        let slot = self.table.slot_of(drone).unwrap_or(0);
                        let text = format!(
                            "{name} cannot be read, which the fence needs: bring the drone nearer \
                             to the radio, or restart it, and try again (nothing was changed on \
                             the drone)"
                        );
                        self.host.warn(&format!("drone {drone} (slot {slot}): {text}"));
                        silent.insert(drone, text);
                        break;
                    }
                }
            }
            if !silent.contains_key(&drone) {
                changes.add(drone, &others);
            }
        }
        if changes != before {
            changes.write(&self.folder.0)?;
        }
        Ok(silent)
    }

    /// Puts back the parameters that were changed, on drones that are disarmed; those that leave a
    /// drone without a fence only with `fence_off`, and those that weaken a fence or a failsafe only
    /// while every drone of the fleet is heard and disarmed. How many drones got theirs, and those
    /// that did not get all.
    pub(crate) fn restore(
        &mut self,
        fence_off: bool,
    ) -> Result<(usize, BTreeSet<DroneId>), WorkflowError> {
        let mut changes = Changes::read(&self.folder.0)?;
        let changed: BTreeSet<DroneId> = changes.drones.iter().map(|entry| entry.drone).collect();
        let mut fleet = changed.clone();
        if FleetTable::path(&self.folder.0).exists() {
            fleet.extend(FleetTable::read(&self.folder.0)?.by_drone().into_keys());
        }
        self.net.set_fleet(fleet);
        let mut left = BTreeSet::new();
        let mut outcomes = BTreeMap::new();
        for drone in &changed {
            if self.net.state(*drone) != State::Ground {
                let text = format!("it {}, so nothing was set on it", self.net.words(*drone));
                self.host.warn(&format!("drone {drone}: {text}"));
                outcomes.insert(*drone, text);
                left.insert(*drone);
            }
        }
        let wanted = |change: &Change| fence_off || !change.unfences();
        let held = self.net.not_grounded();
        let protection = self.net.protection().clone();
        let weakens = |change: &Change| protection.is_weakened_by(&change.name, change.was);
        if let Some(why) = &held {
            let kept =
                |entry: &&DroneChanges| entry.changes.iter().any(|it| wanted(it) && weakens(it));
            let kept: BTreeSet<DroneId> =
                changes.drones.iter().filter(kept).map(|entry| entry.drone).collect();
            if !kept.is_empty() {
                self.host.warn(&format!(
                    "fences and failsafes stay as they are, because {why}: they are restored \
                     once every drone of the fleet is heard and disarmed (remove a drone that is \
                     gone for good from fleet.json)"
                ));
                left.extend(kept);
            }
        }
        let on_ground: BTreeSet<DroneId> =
            changed.iter().copied().filter(|of| self.net.state(*of) == State::Ground).collect();
        let may = |drone: DroneId, change: &Change| {
            on_ground.contains(&drone) && wanted(change) && (held.is_none() || !weakens(change))
        };
        let conversations = changes.restore(may);
        let asked: Vec<DroneId> = conversations.keys().copied().collect();
        let done = self.all(conversations, AT_ONCE)?;
        for drone in &asked {
            let outcome = match done.get(drone) {
                Some(Ok(())) => {
                    changes.forget(*drone, may);
                    "put back".to_owned()
                }
                Some(Err(SetError::Silent { .. })) | None if self.held.contains_key(drone) => {
                    self.held[drone].clone()
                }
                Some(Err(error)) => error.to_string(),
                None => "no answer".to_owned(),
            };
            if !matches!(done.get(drone), Some(Ok(()))) {
                self.host.warn(&format!("drone {drone}: {outcome}"));
                left.insert(*drone);
            }
            outcomes.insert(*drone, outcome);
        }
        changes.write(&self.folder.0)?;
        if !fence_off {
            let fenced: Vec<String> =
                changes.unfenced_before().iter().map(ToString::to_string).collect();
            if !fenced.is_empty() {
                self.host.warn(&format!(
                    "the fence stays on, although it was off or without effect before: drones \
                     {}; --fence-off restores that, too",
                    fenced.join(", ")
                ));
            }
        }
        self.note_each("restore", Some(format!("{} refused", left.len())), &outcomes)?;
        let put_back = done.values().filter(|done| done.is_ok()).count();
        Ok((put_back, left))
    }
}
