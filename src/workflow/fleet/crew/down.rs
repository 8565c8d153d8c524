//! Interruption in flight: all drones are brought down, or left.

use std::collections::{BTreeMap, BTreeSet};

use super::eyes::Eyes;
use crate::fleet::abort::{ALL_AT_ONCE, Abort, Aborted, Action};
use crate::fleet::telemetry::Drone;
use crate::link::clock::MS;
use crate::link::conversation::{Observer as _, run_all};
use crate::link::id::DroneId;
use crate::link::net::Net;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::interrupt::Choice;
use crate::workflow::host::Host;

/// Words for ending the program at once while a show is in the air.
pub(super) const SHOW_LEFT: &str = "Ended at once: drones that have not confirmed a return or a \
                                    landing fly on by themselves. `updraft fleet watch` follows \
                                    them, `updraft fleet abort` sends them home; otherwise use \
                                    their remote controls";
/// Words for ending the program at once while it flies the drones itself.
pub(super) const GUIDED_LEFT: &str = "Ended at once: drones that had not confirmed their return \
                                      stop within 3 s (GUID_TIMEOUT) and return when they lose \
                                      the station (FS_GCS_ENABLE). Watch them: `updraft fleet \
                                      watch`, `updraft fleet abort`, their remote controls";

/// Tells all of these to return or land, except those that were ordered down already, until each
/// has confirmed it; how it ended for each.
pub(super) fn bring_down(
    host: &dyn Host,
    net: &mut dyn Net,
    eyes: &mut Eyes<'_>,
    drones: &BTreeSet<DroneId>,
    action: Action,
) -> BTreeMap<DroneId, Aborted> {
    let is_down =
        |drone: &DroneId| eyes.telemetry().get(*drone).and_then(Drone::is_armed) == Some(false);
    host.insist(match action {
        _ if drones.iter().all(is_down) => {
            "Stopped: no drone is in the air; the start is being cancelled. Press Ctrl-C again \
             to end at once"
        }
        Action::Return => {
            "Stopped: the drones are being sent home. Press Ctrl-C again to end at \
                           once"
        }
        Action::Land => {
            "Stopped: the drones are ordered to land where they are. Press Ctrl-C \
                         again to end at once"
        }
    });
    host.next_ends();
    eyes.finishes = true;
    let ordered = net.ordered_down();
    let end = |drone: &DroneId| (*drone, Abort::new(*drone, action, eyes.telemetry().get(*drone)));
    let conversations: BTreeMap<DroneId, Abort> =
        drones.iter().filter(|drone| !ordered.contains_key(drone)).map(end).collect();
    let done = run_all(net, conversations, ALL_AT_ONCE, eyes).unwrap_or_default();
    for (drone, end) in &done {
        host.insist(&format!("drone {drone}: {end}"));
    }
    while net.ordered_down().into_values().any(|going_on| going_on) {
        let until = net.now() + 100 * MS;
        if let Ok(Some(received)) = net.recv(until) {
            eyes.on_message(net.now(), &received);
        }
    }
    done
}

/// For the journal.
pub(super) fn in_words(ended: &BTreeMap<DroneId, Aborted>) -> BTreeMap<DroneId, String> {
    ended.iter().map(|(drone, end)| (*drone, end.to_string())).collect()
}

/// How a command ends that was interrupted while these drones may have been in the air. `ended`: how
/// that ended for those that this program has told.
pub(super) fn stopped(
    choice: Choice,
    is_guided: bool,
    drones: &BTreeSet<DroneId>,
    ended: &BTreeMap<DroneId, Aborted>,
) -> WorkflowError {
    let all = |is: fn(Aborted) -> bool| {
        drones.iter().all(|drone| ended.get(drone).is_some_and(|ended| is(*ended)))
    };
    let grounded = all(|ended| ended == Aborted::Grounded);
    let confirmed = all(Aborted::is_confirmed);
    WorkflowError::Stopped(match (choice, is_guided) {
        (Choice::Return | Choice::Land, _) if grounded => {
            "stopped: all drones are on the ground, and none has a start pending"
        }
        (Choice::Return, _) if confirmed => {
            "stopped: this program has sent them home, and all have confirmed it; `updraft fleet \
             watch` follows them"
        }
        (Choice::Land, _) if confirmed => {
            "stopped: this program has ordered them to land, and all have confirmed it; `updraft \
             fleet watch` follows them"
        }
        (Choice::Return, _) => {
            "stopped: this program has sent them home; those above that have not confirmed it need \
             their remote controls; `updraft fleet watch` follows them"
        }
        (Choice::Land, _) => {
            "stopped: this program has ordered them to land; those above that have not confirmed \
             it need their remote controls; `updraft fleet watch` follows them"
        }
        (Choice::Leave, false) => {
            "stopped: the flight is no longer watched, and the drones fly on by themselves \
             (those on the ground take off on time); `updraft fleet watch` resumes watching, \
             `updraft fleet abort` sends them home, `updraft fleet land` lands them where they are"
        }
        (Choice::Leave, true) => {
            "stopped: the drones no longer receive targets. Those in the air stop where they are \
             within 3 s (GUID_TIMEOUT) and return when they have not heard the station for 5 s \
             (FS_GCS_ENABLE); `updraft fleet watch` follows them, `updraft fleet land` lands them \
             where they are"
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remote_controls_are_named_only_while_somebody_has_not_confirmed() {
        let drone = |system| DroneId { network: 0, system };
        let drones = BTreeSet::from([drone(1), drone(2)]);
        let says = |ended: &[(u8, Aborted)]| {
            let ended = ended.iter().map(|(of, ended)| (drone(*of), *ended)).collect();
            stopped(Choice::Return, false, &drones, &ended).to_string()
        };
        let (home, down) = (Aborted::Confirmed(Action::Return), Aborted::Grounded);
        for (ended, wanted, by_hand) in [
            (&[(1, down), (2, down)][..], "all drones are on the ground", false),
            (&[(1, home), (2, down)], "all have confirmed it", false),
            (&[(1, home), (2, Aborted::Unheard)], "sent them home", true),
            // Somebody else was told by another terminal.
            (&[(1, home)], "sent them home", true),
        ] {
            let said = says(ended);
            assert!(said.contains(wanted), "{said}");
            assert_eq!(said.contains("remote controls"), by_hand, "{said}");
        }
    }
}
