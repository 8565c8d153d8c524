//! Tables that the steps with a fleet print.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;

use super::server;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::abort::Aborted;
use crate::fleet::messages::mode_name;
use crate::fleet::preflight::Preflight;
use crate::fleet::slots::{FleetTable, picture, stands};
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::link::traffic::Traffic;
use crate::workflow::fleet::crew::Crew;
use crate::workflow::fleet::preflight::PreflightOutput;

#[derive(Serialize, JsonSchema)]
struct StatusRow {
    drone: DroneId,
    nearest_slot: Option<u16>,
    distance_m: Option<f64>,
    mode: Option<String>,
    armed: Option<bool>,
    stage: Option<String>,
    satellites: Option<u8>,
    battery_percent: Option<u8>,
    battery_v: Option<f64>,
    link_quality: Option<f64>,
    obstacle: Option<&'static str>,
    firmware: Option<String>,
    /// Its system id was heard from two places at once.
    doubled: bool,
}

/// What went through a network.
#[derive(Serialize, JsonSchema)]
struct NetworkRow {
    network: u16,
    bytes_in: u64,
    bytes_out: u64,
    frames_in: u64,
    /// Frames that were refused, as they are not signed.
    unsigned: u64,
    /// Frames that were refused, as their signature is wrong, or they were sent before.
    forged: u64,
    /// Frames of MAVLink 1, which are ignored.
    mavlink_1: u64,
    /// Bytes that are no frame.
    noise_bytes: u64,
}

#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct StatusOutput {
    schema: &'static str,
    drones: Vec<StatusRow>,
    networks: Vec<NetworkRow>,
}

fn networks(crew: &Crew<'_>) -> Vec<NetworkRow> {
    let row = |(network, of): (u16, Traffic)| NetworkRow {
        network,
        bytes_in: of.bytes_in,
        bytes_out: of.bytes_out,
        frames_in: of.frames_in,
        unsigned: of.loss.unsigned,
        forged: of.loss.forged,
        mavlink_1: of.loss.version_1,
        noise_bytes: of.loss.noise_bytes,
    };
    crew.net.traffic().into_iter().map(row).collect()
}

/// Who is heard.
pub(in crate::cli) fn status(context: &Context, crew: &mut Crew<'_>) -> Result<Exit, CommandError> {
    crew.greet()?;
    let now = crew.net.now();
    let stands = stands(crew.plan, &crew.telemetry, now);
    let doubled = crew.net.doubled();
    let rows: Vec<StatusRow> = crew
        .telemetry
        .drones
        .iter()
        .map(|(drone, of)| {
            let stand = stands.get(drone);
            let status = of.status.map(|(_, status)| status);
            let health = of.health.map(|(_, health)| health);
            StatusRow {
                drone: *drone,
                nearest_slot: stand.map(|stand| stand.nearest),
                distance_m: stand.map(|stand| stand.distance_m),
                mode: of.mode.map(|(_, mode)| mode_name(mode)),
                armed: of.is_armed(),
                stage: status.map(|status| status.stage.to_string()),
                satellites: of.gps.map(|(_, gps)| gps.satellites),
                battery_percent: health.and_then(|health| health.battery_percent),
                battery_v: health.and_then(|health| health.battery_v),
                link_quality: of.link_quality(),
                obstacle: status.and_then(|status| status.obstacle()),
                firmware: of.version.map(|version| version.to_string()),
                doubled: doubled.contains(drone),
            }
        })
        .collect();
    if context.json {
        let networks = networks(crew);
        let schema = "updraft.fleet-status/1";
        let output = StatusOutput { schema, drones: rows, networks };
        context.print_json(&FleetStatus::OverLinks(output))?;
        return Ok(Exit::Done);
    }
    let mut text = String::from(
        "drone  slot  away m  mode        stage              sats  battery      link  firmware\n",
    );
    let dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    for row in &rows {
        let battery = match (row.battery_percent, row.battery_v) {
            (Some(percent), Some(volts)) => format!("{percent} % {volts:.1} V"),
            (Some(percent), None) => format!("{percent} %"),
            (None, Some(volts)) => format!("{volts:.1} V"),
            (None, None) => "-".to_owned(),
        };
        let _ = writeln!(
            text,
            "{:>5}  {:>4}  {:>6}  {:<10}  {:<17}  {:>4}  {:<11}  {:>4}  {}",
            row.drone,
            dash(row.nearest_slot.map(|slot| slot.to_string())),
            dash(row.distance_m.map(|m| if m < 1000.0 { format!("{m:.1}") } else { "far".into() })),
            dash(row.mode.clone()),
            dash(row.stage.clone()),
            dash(row.satellites.map(|count| count.to_string())),
            battery,
            dash(row.link_quality.map(|share| format!("{:.0}%", share * 100.0))),
            dash(row.firmware.clone()),
        );
    }
    text.push('\n');
    text.push_str(&picture(crew.plan, &crew.telemetry, now));
    text.push('\n');
    for of in networks(crew) {
        let _ = writeln!(
            text,
            "network {}: {} frames heard; {} not signed and {} forged or repeated (refused), {} \
             of MAVLink 1 (ignored), {} bytes that are not frames",
            of.network, of.frames_in, of.unsigned, of.forged, of.mavlink_1, of.noise_bytes
        );
    }
    context.print(&text)?;
    Ok(Exit::Done)
}

/// The table before a start.
pub(in crate::cli) fn preflight(
    context: &Context,
    table: &Preflight,
) -> Result<Exit, CommandError> {
    if context.json {
        context.print_json(&PreflightOutput::of(table))?;
    } else {
        context.emit(&table.to_string())?;
    }
    Ok(if table.go() { Exit::Done } else { Exit::Unsafe })
}

/// What an upload prints under `--json`.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct UploadOutput {
    schema: &'static str,
    drones: Vec<UploadRow>,
}

#[derive(Serialize, JsonSchema)]
struct UploadRow {
    slot: u16,
    drone: DroneId,
    loaded: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

impl UploadOutput {
    pub(super) fn new(table: &FleetTable, refused: &BTreeMap<DroneId, String>) -> Self {
        let drones = table.drones.iter().map(|line| UploadRow {
            slot: line.slot,
            drone: line.drone,
            loaded: !refused.contains_key(&line.drone),
            reason: refused.get(&line.drone).cloned(),
        });
        Self { schema: "updraft.upload/1", drones: drones.collect() }
    }
}

/// What a look at the fleet prints under `--json`: over the drones' own links, or through Skybrush Server.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(in crate::cli) enum FleetStatus<'a> {
    OverLinks(StatusOutput),
    ThroughServer(server::StatusOutput<'a>),
}

/// What an upload prints under `--json`: over the drones' own links, or through Skybrush Server.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(in crate::cli) enum FleetUpload {
    OverLinks(UploadOutput),
    ThroughServer(server::UploadOutput),
}

/// What an abort prints under `--json`.
#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct EndOutput {
    schema: &'static str,
    drones: Vec<EndRow>,
}

#[derive(Serialize, JsonSchema)]
struct EndRow {
    drone: DroneId,
    confirmed: bool,
    text: String,
}

impl EndOutput {
    pub(super) fn new(done: &BTreeMap<DroneId, Aborted>) -> Self {
        let drones = done.iter().map(|(drone, done)| EndRow {
            drone: *drone,
            confirmed: done.is_confirmed(),
            text: done.to_string(),
        });
        Self { schema: "updraft.abort/1", drones: drones.collect() }
    }
}
