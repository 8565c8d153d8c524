//! Logs that come through the server.

use std::collections::BTreeMap;

use super::{assign, connect, stopped};
use crate::base::file::{create_folder, write_whole};
use crate::campaign::FlightFolder;
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::simulate::made_by;
use crate::fleet::logs::manifest::{ManifestEntry, Method, Shelf, Verified};
use crate::fleet::logs::part::sums_of;
use crate::link::clock::Clock as _;
use crate::log::Log;
use crate::mission::Plan;
use crate::skybrush_server::{Client, LogEntry, ServerError, log_bytes};

/// What logs the drones have.
pub(in crate::cli) fn list(context: &Context, address: &str) -> Result<Exit, CommandError> {
    let mut client = connect(context, address)?;
    let ids = client.drones()?;
    let mut lost = false;
    for (id, logs) in client.logs(&ids)? {
        let text = match logs {
            Ok(logs) if logs.is_empty() => "no logs".to_owned(),
            Ok(logs) => logs
                .iter()
                .map(|log| format!("{} ({:.1} MB)", log.id, log.size as f64 / 1e6))
                .collect::<Vec<_>>()
                .join(", "),
            Err(reason) => {
                lost = true;
                reason
            }
        };
        context.emit(&format!("drone {id}  {text}\n"))?;
    }
    Ok(if lost { Exit::Losses } else { Exit::Done })
}

/// Brings the newest log of every drone.
pub(in crate::cli) fn pull(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
) -> Result<Exit, CommandError> {
    let mut client = connect(context, address)?;
    let drones = assign(context, &mut client, plan)?;
    bring(context, &mut client, address, folder, plan, &drones)
}

/// Brings the newest log of these drones; what is there already stays.
pub(super) fn bring(
    context: &Context,
    client: &mut Client,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    drones: &BTreeMap<u16, String>,
) -> Result<Exit, CommandError> {
    create_folder(&folder.logs())?;
    let mut shelf = Shelf::open(&folder.logs(), &made_by())?;
    let ids: Vec<String> = drones.values().cloned().collect();
    let listed = client.logs(&ids)?;
    let (mut home, mut lost) = (0, 0);
    for (slot, id) in drones {
        context.check_stop()?;
        let path = folder.log(*slot, plan.slots.len());
        if path.exists() {
            home += 1;
            continue;
        }
        match one(context, client, id, listed.get(id)) {
            Ok((log, bytes)) => {
                let sums = sums_of(&bytes);
                let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
                // The entry is first: a file without one would be anybody's.
                shelf.add(ManifestEntry {
                    file: name.unwrap_or_default(),
                    slot: *slot,
                    drone: None,
                    boot: log.id.parse().ok(),
                    source: format!("skybrush://{address} drone {id} log {}", log.id),
                    size_bytes: sums.size,
                    sha256: sums.sha256,
                    method: Method::SkybrushServer,
                    method_reason: None,
                    verified: Verified::Size,
                    attempts: 1,
                    at_unix_s: SystemClock::start().unix_us() / 1_000_000,
                })?;
                write_whole(&path, &bytes)?;
                home += 1;
            }
            Err(One::Stop(error)) => return Err(error),
            Err(One::Lost(reason)) => {
                lost += 1;
                context.warn(&format!("no log of drone {id} (slot {slot}): {reason}"));
            }
        }
    }
    context.say(&format!("Brought {home} of {} logs home", home + lost));
    if lost == 0 {
        return Ok(Exit::Done);
    }
    let campaign = folder.0.display();
    context.insist(&format!(
        "To try again: updraft logs pull {campaign} --connect skybrush://{address}"
    ));
    Ok(Exit::Losses)
}

enum One {
    Stop(CommandError),
    Lost(String),
}

fn one<'a>(
    context: &Context,
    client: &mut Client,
    id: &str,
    listed: Option<&'a Result<Vec<LogEntry>, String>>,
) -> Result<(&'a LogEntry, Vec<u8>), One> {
    let logs = match listed {
        Some(Ok(logs)) => logs,
        Some(Err(reason)) => return Err(One::Lost(reason.clone())),
        None => return Err(One::Lost("the server did not list its logs".to_owned())),
    };
    let number = |log: &&LogEntry| log.id.parse::<u32>().unwrap_or(0);
    let newest =
        logs.iter().max_by_key(number).ok_or_else(|| One::Lost("it has none".to_owned()))?;
    let stop = |error: ServerError| One::Stop(error.into());
    let running = match client.fetch_log(id, &newest.id) {
        Err(error @ ServerError::Refused { .. }) => return Err(One::Lost(error.to_string())),
        other => other.map_err(stop)?,
    };
    let ended = client.finish(running, |_, _| !stopped(context)).map_err(stop)?;
    let bytes = match ended.into_iter().next() {
        None if stopped(context) => return Err(One::Stop(CommandError::Interrupted)),
        None => return Err(One::Lost("the server's answer names no work".to_owned())),
        Some((_, Err(reason))) => return Err(One::Lost(reason)),
        Some((_, Ok(value))) => log_bytes(&value).map_err(One::Lost)?,
    };
    whole(newest, bytes).map(|bytes| (newest, bytes)).map_err(One::Lost)
}

/// A log is taken when it has the size that was listed and can be read: the server tells no
/// checksum.
fn whole(listed: &LogEntry, bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let (size, came) = (listed.size, bytes.len() as u64);
    if size != came {
        return Err(format!(
            "log {} was listed with {size} bytes, but {came} came: it may still be written; try \
             again when the drone is disarmed",
            listed.id
        ));
    }
    match Log::from_bytes(bytes.clone()).why_not_a_log() {
        Some(reason) => {
            Err(format!("what came as log {} is no DataFlash log: {reason}", listed.id))
        }
        None => Ok(bytes),
    }
}
