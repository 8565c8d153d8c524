//! Flights through a running Skybrush Server.

use std::collections::BTreeMap;
use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde_json::Value;

use super::{LeadArgs, asked};
use crate::base::file::{create_folder, write_whole};
use crate::campaign::FlightFolder;
use crate::cli::clock::SystemClock;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit, with_reasons};
use crate::fleet::fence::Fence as Checked;
use crate::link::clock::Clock as _;
use crate::mission::Plan;
use crate::show::Show;
use crate::show::skyc::drone_documents;
use crate::skybrush_server::{
    Client, Fence, LogEntry, ServerError, ShowUpload, StartConfig, log_bytes,
};

/// Distance of the fence's circle beyond the farthest corner, m.
const BEYOND_M: f64 = 10.0;
/// The start is watched for so long after the show, s: landing, and some time to spare.
const AFTER_S: f64 = 90.0;

impl From<ServerError> for CommandError {
    fn from(error: ServerError) -> Self {
        Self::Failed(with_reasons(&error))
    }
}

fn connect(context: &Context, address: &str) -> Result<Client, CommandError> {
    let mut client = Client::connect(address, Arc::new(SystemClock::start()))?;
    context.say(&format!("{} at {address}", client.version()?));
    Ok(client)
}

/// Slots and the server's names of their drones: by what is nearest to each home.
fn assign(
    context: &Context,
    client: &mut Client,
    plan: &Plan,
) -> Result<BTreeMap<u16, String>, CommandError> {
    let ids = client.drones()?;
    let status = client.status(&ids)?;
    let frame = plan.site.frame();
    let allowed_m = crate::fleet::slots::allowed_m(plan);
    let mut found: BTreeMap<u16, String> = BTreeMap::new();
    let mut problems = Vec::new();
    for (id, status) in &status {
        // 1e-7 degrees, as the server has them.
        let part = |index: usize| {
            let value = status.pointer(&format!("/position/{index}")).and_then(Value::as_f64);
            value.map(|value| value * 1e-7)
        };
        let (Some(lat_deg), Some(lon_deg)) = (part(0), part(1)) else {
            problems.push(format!("drone {id} does not say where it stands"));
            continue;
        };
        let place = crate::base::frame::Geodetic { lat_deg, lon_deg, amsl_m: 0.0 };
        let at = frame.from_geodetic(place);
        let near = plan.slots.iter().min_by(|a, b| {
            let away = |slot: &crate::mission::plan::Slot| {
                (at.x - slot.home_m[0]).hypot(at.y - slot.home_m[1])
            };
            away(a).total_cmp(&away(b))
        });
        let Some(near) = near else { continue };
        let away_m = (at.x - near.home_m[0]).hypot(at.y - near.home_m[1]);
        if away_m > allowed_m {
            problems.push(format!("drone {id} stands {away_m:.1} m from slot {}", near.slot));
        } else if let Some(other) = found.insert(near.slot, id.clone()) {
            problems.push(format!("drones {other} and {id} both stand on slot {}", near.slot));
        }
    }
    for slot in &plan.slots {
        if !found.contains_key(&slot.slot) {
            problems.push(format!("slot {} has no drone", slot.slot));
        }
    }
    if problems.is_empty() {
        return Ok(found);
    }
    for problem in &problems {
        context.warn(problem);
    }
    Err(CommandError::Usage("the drones do not stand as planned; nothing was sent".to_owned()))
}

/// The whole flight.
pub(in crate::cli) fn fly(
    context: &Context,
    address: &str,
    folder: &FlightFolder,
    plan: &Plan,
    lead: &LeadArgs,
    with_logs: bool,
) -> Result<Exit, CommandError> {
    if !lead.yes && !std::io::stdin().is_terminal() {
        return Err(CommandError::Usage(
            "a start is authorized by a person, or with --yes; nothing was started".to_owned(),
        ));
    }
    let show = Show::of_plan(plan);
    // The same fence and the same refusal as over MAVLink.
    let checked =
        Checked::of(plan, &show).map_err(|error| CommandError::Usage(error.to_string()))?;
    let corners = &plan.fence.polygon_m;
    let homes = plan.slots.iter().map(|slot| slot.home_m);
    let reach_m = homes
        .flat_map(|home| {
            corners.iter().map(move |corner| (corner[0] - home[0]).hypot(corner[1] - home[1]))
        })
        .fold(0.0, f64::max);
    let upload = ShowUpload {
        id: plan.name.clone(),
        title: plan.title.clone(),
        drones: plan.slots.len(),
        frame: plan.site.frame(),
        fence: Fence {
            polygon_m: corners.clone(),
            max_altitude_m: checked.top_m,
            max_distance_m: reach_m + BEYOND_M,
        },
    };
    let mut client = connect(context, address)?;
    let drones = assign(context, &mut client, plan)?;
    let mut refused = 0;
    for (index, (slot, drone)) in plan.slots.iter().zip(&show.drones).enumerate() {
        context.check_stop()?;
        let Some(id) = drones.get(&slot.slot) else { continue };
        let (trajectory, lights) = drone_documents(drone)
            .map_err(|problem| CommandError::Failed(format!("slot {}: {problem}", slot.slot)))?;
        let payload = upload.payload(index, &trajectory, lights.as_ref())?;
        let running = client.upload(id, &payload)?;
        for (id, outcome) in client.finish(running, |_, _| !stopped(context))? {
            if let Err(reason) = outcome {
                refused += 1;
                context.warn(&format!("drone {id} (slot {}): {reason}", slot.slot));
            }
        }
    }
    context.check_stop()?;
    if refused > 0 {
        context
            .insist(&format!("NO-GO: {refused} drones do not have the show; nothing was started"));
        return Ok(Exit::Unsafe);
    }
    let ids: Vec<String> = drones.values().cloned().collect();
    let troubled = errors(&client.status(&ids)?);
    for (id, codes) in &troubled {
        context.warn(&format!("drone {id} reports {codes}"));
    }
    if !troubled.is_empty() {
        context.insist("NO-GO: nothing was started; Skybrush Live tells what the codes mean");
        return Ok(Exit::Unsafe);
    }
    let clock = SystemClock::start();
    let unix_s = (clock.unix_us() / 1_000_000) as i64 + lead.lead.ceil() as i64;
    let duration_s = plan.duration_ms as f64 / 1000.0;
    let mut start =
        StartConfig { unix_s: Some(unix_s), authorized: false, drones: ids.clone(), duration_s };
    client.set_start(&start)?;
    if !lead.yes && !asked("Authorize the start? Type yes: ")? {
        client.set_start(&StartConfig { unix_s: None, ..start })?;
        return Err(CommandError::Usage("not authorized: the start was taken back".to_owned()));
    }
    start.authorized = true;
    client.set_start(&start)?;
    context.say("Authorized. Skybrush Live shows the flight; Ctrl-C stops waiting for its end");
    let end_us = (unix_s as f64 + duration_s + AFTER_S) * 1e6;
    while (clock.unix_us() as f64) < end_us {
        if stopped(context) {
            context.insist("The drones fly on; use Skybrush Live, or their remote controls");
            return Err(CommandError::Interrupted);
        }
        std::thread::sleep(Duration::from_millis(200));
    }
    if !with_logs {
        return Ok(Exit::Done);
    }
    bring(context, &mut client, folder, plan, &drones)
}

fn stopped(context: &Context) -> bool {
    context.stop_flag().load(Ordering::SeqCst)
}

/// Codes of errors that keep a drone from flying; 1 to 63 are states.
fn errors(status: &BTreeMap<String, Value>) -> BTreeMap<String, String> {
    let codes = |status: &Value| -> Vec<String> {
        let list = status.get("errors").and_then(Value::as_array).cloned().unwrap_or_default();
        list.iter()
            .filter_map(Value::as_u64)
            .filter(|code| *code >= 64)
            .map(|code| format!("error {code}"))
            .collect()
    };
    status
        .iter()
        .map(|(id, status)| (id.clone(), codes(status).join(", ")))
        .filter(|(_, codes)| !codes.is_empty())
        .collect()
}

/// What logs the drones have.
pub(in crate::cli) fn list(context: &Context, address: &str) -> Result<Exit, CommandError> {
    let mut client = connect(context, address)?;
    let ids = client.drones()?;
    for (id, logs) in client.logs(&ids)? {
        let text = match logs {
            Ok(logs) => logs
                .iter()
                .map(|log| format!("{} ({:.1} MB)", log.id, log.size as f64 / 1e6))
                .collect::<Vec<_>>()
                .join(", "),
            Err(reason) => reason,
        };
        context.emit(&format!("drone {id}  {text}\n"))?;
    }
    Ok(Exit::Done)
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
    bring(context, &mut client, folder, plan, &drones)
}

fn bring(
    context: &Context,
    client: &mut Client,
    folder: &FlightFolder,
    plan: &Plan,
    drones: &BTreeMap<u16, String>,
) -> Result<Exit, CommandError> {
    create_folder(&folder.logs())?;
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
            Ok(bytes) => {
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
    Ok(if lost == 0 { Exit::Done } else { Exit::Losses })
}

enum One {
    Stop(CommandError),
    Lost(String),
}

fn one(
    context: &Context,
    client: &mut Client,
    id: &str,
    listed: Option<&Result<Vec<LogEntry>, String>>,
) -> Result<Vec<u8>, One> {
    let logs = match listed {
        Some(Ok(logs)) => logs,
        Some(Err(reason)) => return Err(One::Lost(reason.clone())),
        None => return Err(One::Lost("the server did not list its logs".to_owned())),
    };
    let number = |log: &&LogEntry| log.id.parse::<u32>().unwrap_or(0);
    let newest =
        logs.iter().max_by_key(number).ok_or_else(|| One::Lost("it has none".to_owned()))?;
    let stop = |error: ServerError| One::Stop(error.into());
    let running = client.fetch_log(id, &newest.id).map_err(stop)?;
    let ended = client.finish(running, |_, _| !stopped(context)).map_err(stop)?;
    match ended.into_iter().next() {
        None => Err(One::Stop(CommandError::Interrupted)),
        Some((_, Err(reason))) => Err(One::Lost(reason)),
        Some((_, Ok(value))) => log_bytes(&value).map_err(One::Lost),
    }
}
