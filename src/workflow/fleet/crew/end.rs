//! End of flights: for the drones of the table, or for all that are heard.

use std::collections::{BTreeMap, BTreeSet};

use super::Crew;
use crate::fleet::abort::{ALL_AT_ONCE, Abort, Aborted, Action};
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Observer, Progress, run_all};
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::end::{PATIENCE, by_hand, waiting, word};
use crate::workflow::host::Host;

impl Crew<'_> {
    /// Listens until one of these drones (or anyone, and a moment more) is heard. `nobody`: what is
    /// said when nobody is.
    pub(crate) fn hear_anyone(
        &mut self,
        wait_s: f64,
        only: Option<&BTreeSet<DroneId>>,
        nobody: &str,
    ) -> Result<(), WorkflowError> {
        let begun = self.net.now();
        let until = begun + (wait_s * 1e6) as Micros;
        loop {
            self.host.check_stop()?;
            let now = self.net.now();
            let heard: BTreeSet<DroneId> = self.net.heard().into_iter().collect();
            let enough = match only {
                // The others are told as soon as they are heard.
                Some(only) => !only.is_disjoint(&heard),
                None => !heard.is_empty() && now >= begun + 1500 * MS,
            };
            if enough || now >= until {
                self.tell_troubles();
                return if heard.is_empty() {
                    Err(WorkflowError::Nothing(nobody.to_owned()))
                } else {
                    Ok(())
                };
            }
            if let Some(received) = self.net.recv(now + 50 * MS)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// Ends the flight of these drones (all: of the `fleet` and of everyone else who is heard), giving
    /// up those that are not heard within `wait_s`. What is done by Ctrl-C is there then.
    pub(crate) fn abort(
        &mut self,
        only: Option<&BTreeSet<DroneId>>,
        fleet: &BTreeSet<DroneId>,
        action: Action,
        wait_s: f64,
    ) -> Result<BTreeMap<DroneId, Aborted>, WorkflowError> {
        let heard = self.net.heard().into_iter().chain(self.telemetry.drones.keys().copied());
        let all: BTreeSet<DroneId> = heard.chain(fleet.iter().copied()).collect();
        let drones = only.unwrap_or(&all);
        let end = |drone: &DroneId| {
            let abort = Abort::new(*drone, action, self.telemetry.get(*drone));
            (*drone, abort.heard_within((wait_s * 1e6) as Micros))
        };
        let conversations: BTreeMap<DroneId, Abort> = drones.iter().map(end).collect();
        let now = self.net.now();
        let (next, by_hand) = (now + TELL, Some(now + PATIENCE.as_micros() as Micros));
        let mut ears = Waiting { host: self.host, open: drones.clone(), next, by_hand };
        let done = run_all(&mut self.net, conversations, ALL_AT_ONCE, &mut ears)?;
        let outcomes = drones.iter().map(|drone| {
            (*drone, done.get(drone).map_or("not confirmed".to_owned(), Aborted::to_string))
        });
        self.try_note(word(action), &outcomes.collect());
        Ok(done)
    }
}

/// Who has not confirmed is told so often.
const TELL: Micros = 5 * S;

/// Tells who has not confirmed yet.
struct Waiting<'a> {
    host: &'a dyn Host,
    open: BTreeSet<DroneId>,
    next: Micros,
    /// When it is said what people do about them.
    by_hand: Option<Micros>,
}

impl Observer for Waiting<'_> {
    fn on_progress(&mut self, drone: DroneId, _: Progress, over: bool) {
        if over {
            self.open.remove(&drone);
        }
    }

    fn stop(&mut self, now: Micros) -> bool {
        if now >= self.next && !self.open.is_empty() {
            self.next = now + TELL;
            self.host.say(&waiting(self.open.iter().copied()));
        }
        if self.by_hand.is_some_and(|at| now >= at) && !self.open.is_empty() {
            self.by_hand = None;
            self.host.insist(&by_hand(self.open.iter().copied()));
        }
        self.host.check_stop().is_err()
    }
}
