//! Virtual drones for any ground station to practise with.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use super::hangar::Hangar;
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::campaign::origin::default_of;
use crate::mission::Plan;
use crate::virtual_fleet::broadcast::{BROADCAST_PORT, Broadcasts};
use crate::workflow::clock::SinceNow;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::words;

/// How often it is looked up whether to stop.
const LOOK: Duration = Duration::from_millis(100);
/// Largest log that virtual drones have on their cards, bytes.
const MOST_LOG: u64 = 1 << 28;

/// The logs of a flight that is home, for the drones' cards.
pub(crate) fn cards(
    folder: &FlightFolder,
    plan: &Plan,
) -> Result<BTreeMap<u16, Vec<u8>>, WorkflowError> {
    let mut cards = BTreeMap::new();
    let at = folder.logs_of(default_of(std::slice::from_ref(folder)));
    for slot in &plan.slots {
        let path = at.log(slot.slot, plan.slots.len());
        if path.exists() {
            cards.insert(slot.slot, read_whole(&path, MOST_LOG)?);
        }
    }
    if cards.is_empty() {
        return Err(WorkflowError::Nothing(format!(
            "{} has no logs for the drones' cards: `updraft simulate` makes them",
            at.folder.shown()
        )));
    }
    Ok(cards)
}

/// The ear for broadcasts. The usual port may be another fleet's: this one does without it then,
/// but says so; a port that was asked for is needed.
fn broadcasts(host: &dyn Host, asked: Option<u16>) -> Result<Option<Broadcasts>, WorkflowError> {
    let port = asked.unwrap_or(BROADCAST_PORT);
    if port == 0 {
        return Ok(None);
    }
    let error = match Broadcasts::open(port) {
        Ok(broadcasts) => return Ok(Some(broadcasts)),
        Err(error) => error,
    };
    let taken = format!(
        "UDP port {port}, on which Skybrush Server's starts are received, cannot be opened: \
         {error}\n  Another `fleet virtual` or a drone's simulator uses it: end that one, or give \
         --broadcast-port another port and the server the same (broadcast_port in its connection \
         udp-listen://:14550?broadcast_port=PORT)"
    );
    if asked.is_some() {
        return Err(WorkflowError::Failed(taken));
    }
    host.warn(&format!(
        "{taken}; everything else works, and --broadcast-port 0 avoids this warning"
    ));
    Ok(None)
}

/// Switches the drones of a hangar on until the work is stopped; they look for ground stations at these
/// addresses, one for each network. `broadcast_port`: where all of them hear what is broadcast.
pub(crate) fn serve(
    host: &dyn Host,
    hangar: &Hangar<'_>,
    stations: Vec<SocketAddr>,
    broadcast_port: Option<u16>,
) -> Result<(), WorkflowError> {
    let broadcasts = broadcasts(host, broadcast_port)?;
    let shown: Vec<String> = stations.iter().map(ToString::to_string).collect();
    host.say(&format!(
        "{} are switched on and talk to {}; Ctrl-C switches them off",
        words::count(hangar.slots.len(), "virtual drone"),
        shown.join(", ")
    ));
    let clock = SinceNow::of(host.clock());
    hangar.serve(stations, broadcasts.as_ref(), &clock, |running| {
        let mut told = false;
        while !host.is_stopped() {
            host.clock().pause(LOOK);
            if running.refused() > 0 && !told {
                told = true;
                host.warn(
                    "the drones refuse frames that are not signed with their key: give the \
                     station the same --key",
                );
            }
        }
    })
}
