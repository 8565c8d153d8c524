//! Return or landing of drones in the air through the server.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::ServedFlight;
use crate::fleet::abort::Action;
use crate::fleet::messages;
use crate::skybrush_server::watch::is_on_ground;
use crate::skybrush_server::{Client, Foreman, Job, Outcome, end_flight, mode};
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::interrupt::Choice;
use crate::workflow::host::Host;

/// What is said when the program is ended at once in flight.
pub(super) const LEFT: &str = "Ended at once: drones that have not confirmed a return or a landing fly on by \
    themselves. `updraft fleet abort` through the server sends them home; so do Skybrush Live and their \
    remote controls";

/// What became of an order to come down.
pub(super) struct Down {
    /// Who was told, and what it answered.
    pub(super) told: BTreeMap<String, Answer>,
    /// Who is on the ground already.
    pub(super) on_ground: Vec<String>,
}

/// A drone's answer to an order to come down.
pub(super) struct Answer {
    /// In words.
    pub(super) text: String,
    /// Whether it obeys.
    pub(super) confirmed: bool,
}

/// Tells everyone who is not known to be on the ground to come down: by the server's own order, and
/// who does not obey that by the flight mode. `go_on`: false ends the waiting.
pub(super) fn bring_down(
    client: &mut Client,
    ids: Vec<String>,
    action: Action,
    go_on: &dyn Fn() -> bool,
) -> Result<Down, WorkflowError> {
    let status = client.status(&ids)?;
    let (on_ground, up): (Vec<String>, Vec<String>) =
        ids.into_iter().partition(|id| status.get(id).is_some_and(is_on_ground));
    let mut down = Down { told: BTreeMap::new(), on_ground };
    if up.is_empty() {
        return Ok(down);
    }
    let running = client.begin(&end_flight(&up, action == Action::Return))?;
    let mut done = client.finish(running, go_on)?;
    let open: Vec<&String> = up.iter().filter(|id| !matches!(done.get(*id), Some(Ok(_)))).collect();
    let number = match action {
        Action::Return => messages::RTL,
        Action::Land => messages::LAND,
    };
    let jobs: Vec<Job> = open.iter().map(|id| mode(id, number)).collect();
    let mut again = Again { go_on, done: BTreeMap::new() };
    client.work(jobs, open.len(), &mut again)?;
    // Of those who do not obey that either the first answer counts.
    done.extend(again.done.into_iter().filter(|(_, outcome)| outcome.is_ok()));
    for id in up {
        let outcome = done.get(&id);
        let text = match outcome {
            Some(Ok(_)) if action == Action::Return => "returns".to_owned(),
            Some(Ok(_)) => "lands where it is".to_owned(),
            Some(Err(reason)) => format!("NOT CONFIRMED: {reason}"),
            None => "NOT CONFIRMED: the server does not report on it".to_owned(),
        };
        let confirmed = matches!(outcome, Some(Ok(_)));
        down.told.insert(id, Answer { text, confirmed });
    }
    Ok(down)
}

struct Again<'a> {
    go_on: &'a dyn Fn() -> bool,
    done: BTreeMap<String, Outcome>,
}

impl Foreman for Again<'_> {
    fn over(&mut self, drone: &str, outcome: Outcome) -> Option<Job> {
        self.done.insert(drone.to_owned(), outcome);
        None
    }

    fn stop(&mut self) -> bool {
        !(self.go_on)()
    }
}

/// Ctrl-C in flight, once it is known what it means.
pub(super) fn interrupted(
    host: &dyn Host,
    client: &mut Client,
    flight: &ServedFlight<'_>,
    choice: Choice,
) -> WorkflowError {
    host.next_ends();
    if let Some(action) = choice.action() {
        let drones: Vec<String> = flight.drones.values().cloned().collect();
        let mut down = bring_down(client, drones.clone(), action, &|| true);
        // The connection may have broken some time ago, and the server be back.
        if down.is_err()
            && let Ok(mut again) = Client::connect(flight.address, Arc::clone(host.clock()))
        {
            down = bring_down(&mut again, drones, action, &|| true);
        }
        match down {
            Ok(down) => {
                for (id, answer) in &down.told {
                    host.insist(&format!("drone {id}: {}", answer.text));
                }
                for id in &down.on_ground {
                    host.insist(&format!("drone {id}: on the ground"));
                }
            }
            Err(error) => {
                host.warn(&format!("{error}: use Skybrush Live, or the remote controls"));
            }
        }
    }
    WorkflowError::Stopped(match choice {
        Choice::Return => {
            "stopped: this program has sent them home; those above that have not confirmed it need \
             their remote controls, or Skybrush Live"
        }
        Choice::Land => {
            "stopped: this program has ordered them to land; those above that have not confirmed \
             it need their remote controls, or Skybrush Live"
        }
        Choice::Leave => {
            "stopped: the flight is no longer watched, and the drones fly on by themselves; \
             `updraft fleet abort` through the server sends them home; so do Skybrush Live and \
             their remote controls"
        }
    })
}
