//! Parameters that are changed on drones: what they were is on the disk before they are set, and
//! is put back on request.

use std::collections::BTreeMap;

use super::{AT_ONCE, Crew};
use crate::cli::exit::CommandError;
use crate::fleet::changes::{Change, Changes};
use crate::fleet::command::Patience;
use crate::fleet::params::{ReadParams, same};
use crate::link::clock::S;
use crate::link::id::DroneId;

/// Long enough for a drone that has just been switched on.
const PATIENCE: Patience = Patience { every: S, tries: 30 };

impl Crew<'_> {
    /// Reads what the fence's parameters are and writes down those that an upload changes: before
    /// it does, so that nothing is lost when this program is killed meanwhile. Drones that do not
    /// tell, with what is said of them: nothing may be changed on them.
    pub(super) fn remember_fence(&mut self) -> Result<BTreeMap<DroneId, String>, CommandError> {
        let mut silent = BTreeMap::new();
        if self.is_virtual {
            return Ok(silent);
        }
        let wanted = self.fence()?.params();
        let names = || wanted.iter().map(|(name, _)| name.clone());
        let read = |drone| (drone, ReadParams::new(drone, names()).with_patience(PATIENCE));
        let machines = self.drones().into_iter().map(read).collect();
        let found = self.all(machines, AT_ONCE)?;
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
                        self.context.warn(&format!("drone {drone} (slot {slot}): {text}"));
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

    /// Puts back the parameters that were changed; those that leave a drone without a fence only
    /// with `fence_off`. Drones that did not take them.
    pub(in crate::cli) fn restore(
        &mut self,
        fence_off: bool,
    ) -> Result<Vec<DroneId>, CommandError> {
        let mut changes = Changes::read(&self.folder.0)?;
        let machines = changes.restore(fence_off);
        let wanted: Vec<DroneId> = machines.keys().copied().collect();
        let done = self.all(machines, AT_ONCE)?;
        let mut left = Vec::new();
        let mut outcomes = BTreeMap::new();
        for drone in wanted {
            let outcome = match done.get(&drone) {
                Some(Ok(())) => "put back".to_owned(),
                Some(Err(error)) => error.to_string(),
                None => "no answer".to_owned(),
            };
            outcomes.insert(drone, outcome);
            match done.get(&drone) {
                Some(Ok(())) => changes.forget(drone, fence_off),
                Some(Err(error)) => {
                    self.context.warn(&format!("drone {drone}: {error}"));
                    left.push(drone);
                }
                None => left.push(drone),
            }
        }
        changes.write(&self.folder.0)?;
        if !fence_off {
            let fenced: Vec<String> =
                changes.unfenced_before().iter().map(ToString::to_string).collect();
            if !fenced.is_empty() {
                self.context.warn(&format!(
                    "the fence stays on, although it was off or without effect before: drones {}; \
                     --fence-off puts that back, too",
                    fenced.join(", ")
                ));
            }
        }
        self.note_each("restore", Some(format!("{} refused", left.len())), &outcomes)?;
        Ok(left)
    }
}
