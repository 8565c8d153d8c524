//! Ends flights: the drones of the table, or whoever is heard.

use std::collections::{BTreeMap, BTreeSet};

use super::Crew;
use crate::cli::exit::CommandError;
use crate::fleet::abort::{ALL_AT_ONCE, Abort, Aborted, Action};
use crate::link::clock::{MS, Micros};
use crate::link::drive::Watch as _;
use crate::link::id::DroneId;

impl Crew<'_> {
    /// Listens until these drones (or anyone, and a moment more) are heard.
    pub(in crate::cli) fn hear_anyone(
        &mut self,
        wait_s: f64,
        only: Option<&BTreeSet<DroneId>>,
    ) -> Result<(), CommandError> {
        let begun = self.net.now();
        let until = begun + (wait_s * 1e6) as Micros;
        loop {
            self.context.check_stop()?;
            let now = self.net.now();
            let heard: BTreeSet<DroneId> = self.net.heard().into_iter().collect();
            let enough = match only {
                Some(only) => only.is_subset(&heard),
                None => !heard.is_empty() && now >= begun + 1500 * MS,
            };
            if enough {
                return Ok(());
            }
            if now >= until {
                return if heard.is_empty() {
                    Err(CommandError::Nothing(
                        "no drone was heard: use their remote controls".to_owned(),
                    ))
                } else {
                    Ok(())
                };
            }
            if let Some(received) = self.net.recv(now + 50 * MS)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// Ends the flight of these drones (all: of everyone who is heard).
    pub(in crate::cli) fn abort(
        &mut self,
        only: Option<&BTreeSet<DroneId>>,
        action: Action,
    ) -> Result<BTreeMap<DroneId, Aborted>, CommandError> {
        let heard: BTreeSet<DroneId> =
            self.net.heard().into_iter().chain(self.telemetry.drones.keys().copied()).collect();
        let machines = only
            .unwrap_or(&heard)
            .iter()
            .map(|drone| (*drone, Abort::new(*drone, action, self.telemetry.get(*drone))))
            .collect();
        let done = self.all(machines, ALL_AT_ONCE)?;
        self.note("abort", Some(format!("{} drones", done.len())))?;
        Ok(done)
    }
}
