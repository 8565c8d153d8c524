//! Logs of a simulated flight and their record: which exist, which fit, what was changed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use rayon::prelude::*;

use super::Simulation;
use crate::base::digest::sha256;
use crate::base::file::{
    FileError, create_folder, read_whole, sweep_partial, write_new, write_whole,
};
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::{AirFile, FLIGHT_SCHEMA, FlightFolder, FlightRecord, LogRecord, to_json};
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::vehicle::Vehicle;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::is_of_simulator;
use crate::workflow::made_by;

/// When simulated shows start: 2026-06-01 12:00 UTC, a summer noon with thermals. Fixed, so that the
/// same seed gives the same bytes.
const START_UNIX_MS: i64 = 1_780_315_200_000;
/// Largest plan that is hashed, bytes.
const MAX_PLAN_BYTES: u64 = 256 << 20;

/// The folder's record: a matching one is continued, another one refused or replaced.
pub(super) fn prepare(
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
    vehicle: &Vehicle,
    air_files: Vec<AirFile>,
) -> Result<FlightRecord, WorkflowError> {
    let plan_bytes = read_whole(&folder.plan(), MAX_PLAN_BYTES)?;
    let vehicle_text = toml::to_string(vehicle)
        .map_err(|error| WorkflowError::Failed(format!("failed to write the vehicle: {error}")))?;
    let start = GpsTime::from_unix_ms(START_UNIX_MS)
        .ok_or_else(|| WorkflowError::Failed("the start time is not a GPS time".to_owned()))?;
    let mut record = FlightRecord {
        schema: FLIGHT_SCHEMA.to_owned(),
        made_by: made_by(),
        source: "simulator".to_owned(),
        seed: simulation.seed,
        vehicle: vehicle.name.clone(),
        vehicle_sha256: sha256(vehicle_text.as_bytes()),
        air_mps: simulation.air.uniform_mps,
        air: simulation.air.texts(),
        air_files,
        start,
        full_logs: simulation.full_logs,
        plan_sha256: sha256(&plan_bytes),
        logs: Vec::new(),
    };
    create_folder(&folder.simulated())?;
    sweep_partial(&folder.simulated())?;
    let is_shard = simulation.share.shard.is_some();
    // Of several shards that begin, one takes the folder; the others find its record.
    if is_shard
        && !folder.record().exists()
        && present_logs(folder, plan).is_empty()
        && write_new(&folder.record(), &record_bytes(&record)?)?
    {
        return Ok(record);
    }
    match folder.read_record()? {
        Some(existing) if existing.source != record.source => {
            return Err(WorkflowError::Usage(format!(
                "{} holds logs of real drones, which belong in logs/; move them there",
                folder.simulated().shown()
            )));
        }
        Some(existing) => {
            let logs = existing.logs.clone();
            let same = FlightRecord { logs: Vec::new(), ..existing } == record;
            if !same && !simulation.force {
                return Err(WorkflowError::Usage(format!(
                    "{} holds logs flown with other settings; give --force to replace them, or use \
                     another folder",
                    folder.simulated().shown()
                )));
            }
            if same {
                record.logs = logs;
            } else {
                remove_logs(folder, plan)?;
            }
        }
        None if !present_logs(folder, plan).is_empty() => {
            return Err(WorkflowError::Usage(format!(
                "{} holds logs that this program did not simulate; use another folder",
                folder.simulated().shown()
            )));
        }
        None => {}
    }
    if !is_shard {
        write_record(folder, &record)?;
    }
    Ok(record)
}

/// Removes a flight's logs and the truth that they were flown in.
fn remove_logs(folder: &FlightFolder, plan: &Plan) -> Result<(), WorkflowError> {
    let paths = present_logs(folder, plan).into_iter().map(|(_, path)| path);
    let truths = plan.slots.iter().map(|slot| folder.truth(slot.slot, plan.slots.len()));
    for path in paths.chain(truths.filter(|path| path.exists())) {
        std::fs::remove_file(&path).map_err(|error| FileError::new("remove", &path, error))?;
    }
    Ok(())
}

/// The logs of a plan's slots that are there.
fn present_logs(folder: &FlightFolder, plan: &Plan) -> Vec<(u16, PathBuf)> {
    let count = plan.slots.len();
    let paths = plan.slots.iter().map(|slot| (slot.slot, folder.simulated_log(slot.slot, count)));
    paths.filter(|(_, path)| path.exists()).collect()
}

/// The record's entries of the logs that are there; those that it lacks, and those of drones just
/// flown, are made from the files.
pub(super) fn taken_down(
    folder: &FlightFolder,
    plan: &Plan,
    record: &FlightRecord,
    flown: &[&Slot],
) -> Result<Vec<LogRecord>, WorkflowError> {
    let flown: BTreeSet<u16> = flown.iter().map(|slot| slot.slot).collect();
    let known: BTreeMap<u16, &LogRecord> = (record.logs.iter())
        .filter(|log| log.crc32.is_some() && !flown.contains(&log.slot))
        .map(|log| (log.slot, log))
        .collect();
    let logs: Result<Vec<_>, FileError> = (present_logs(folder, plan).par_iter())
        .map(|(slot, path)| match known.get(slot) {
            Some(log) => Ok((*log).clone()),
            None => LogRecord::of(*slot, path),
        })
        .collect();
    Ok(logs?)
}

/// Logs that are not as they were flown, and how they differ. What somebody else put in their place
/// is not ours to replace.
pub(super) fn changed_logs(
    folder: &FlightFolder,
    record: &FlightRecord,
    wanted: &[&Slot],
    count: usize,
) -> Result<BTreeMap<u16, String>, WorkflowError> {
    let known: BTreeMap<u16, &LogRecord> = record.logs.iter().map(|log| (log.slot, log)).collect();
    let changed: Result<Vec<_>, WorkflowError> = wanted
        .par_iter()
        .filter_map(|slot| {
            let path = folder.simulated_log(slot.slot, count);
            let log = known.get(&slot.slot).filter(|_| path.exists())?;
            match log.difference(&path) {
                Ok(None) => None,
                Ok(Some(_)) if is_of_simulator(&path) == Some(false) => {
                    Some(Err(WorkflowError::Usage(format!(
                        "{} was not simulated by this program; move it away, or use another folder",
                        path.shown()
                    ))))
                }
                Ok(Some(how)) => Some(Ok((slot.slot, how))),
                Err(error) => Some(Err(error.into())),
            }
        })
        .collect();
    Ok(changed?.into_iter().collect())
}

pub(super) fn write_record(
    folder: &FlightFolder,
    record: &FlightRecord,
) -> Result<(), WorkflowError> {
    Ok(write_whole(&folder.record(), &record_bytes(record)?)?)
}

fn record_bytes(record: &FlightRecord) -> Result<Vec<u8>, WorkflowError> {
    to_json(record)
        .map_err(|error| WorkflowError::Failed(format!("failed to make the record: {error}")))
}
