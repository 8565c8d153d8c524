//! One flight of a campaign folder: its plan, its logs, and the contents of its record.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::files::logs_in;
use super::leaning::{leaning, leans_by_rotors};
use super::of_start;
use super::physics::{density, is_of_simulator, linear_thrust, sag};
use super::true_scales::true_scales;
use super::{Found, Hashes};
use crate::analysis::{LogInput, TruthSeries};
use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::campaign::origin::{LogOrigin, LogsAt};
use crate::campaign::{FlightFolder, FlightRecord, LogRecord};
use crate::mission::Plan;
use crate::sim::air::truth::{self, TrueUpdraft};
use crate::vehicle::library;
use crate::workflow::error::WorkflowError;
use crate::workflow::wind_forms::wind_forms;

/// What a flight's folder holds.
pub(super) fn found_flight(
    campaign: &Path,
    folder: &FlightFolder,
    origin: LogOrigin,
    hashes: &Hashes,
) -> Result<Found, WorkflowError> {
    let plan = folder.read_plan()?;
    let at = folder.logs_of(origin);
    let files = if at.folder.is_dir() { logs_in(&at.folder)? } else { Vec::new() };
    let mut notes = Vec::new();
    let record = match at.read_record()? {
        Some(record) => held_record(&at, record, &files, &mut notes, hashes),
        None => None,
    };
    let mut logs: Vec<LogInput> = files
        .into_iter()
        .map(|path| LogInput {
            slot: recorded_slot(&at, record.as_ref(), &path),
            path,
            ..LogInput::default()
        })
        .collect();
    let vehicle = library::load(&folder.vehicle().to_string_lossy()).ok();
    let truth = if record.is_some() { true_air(folder, &plan)? } else { BTreeMap::new() };
    let flown = record.as_ref().zip(vehicle.as_ref());
    // Logs of the simulator have a record; of others the start was written down when it was authorized.
    let start = if let Some(record) = &record {
        Some(record.start)
    } else {
        // What was simulated no drone and no card has.
        let is_real = at.origin == LogOrigin::Real;
        let at = of_start::FlightLogs {
            logs: &at.folder,
            campaign: is_real.then_some((campaign, plan.name.as_str())),
        };
        let (start, doubts) = of_start::refuse(&at, &mut logs)?;
        notes.extend(doubts);
        start
    };
    let forward_deg = plan.site.orientation_deg;
    let true_air =
        record.as_ref().and_then(|record| true_scales(&record.air, record.air_mps, forward_deg));
    Ok(Found {
        leaning: flown.and_then(|(record, vehicle)| leaning(&plan, record, vehicle)),
        sag: sag(&|| flown.is_some() || of_virtual_drones(&logs), vehicle.as_ref()),
        wind_forms: vehicle
            .as_ref()
            .and_then(|vehicle| wind_forms(plan.site.ground_amsl_m, vehicle)),
        density: Some(density(&plan, vehicle.as_ref())),
        thrust_exponent: vehicle.as_ref().and_then(linear_thrust),
        level: None,
        response_of: vehicle.clone().filter(leans_by_rotors),
        name: plan.name.clone(),
        purpose: Some(plan.purpose),
        plan: Some(plan),
        logs,
        simulated: at.origin == LogOrigin::Simulated,
        true_updraft_mps: record
            .as_ref()
            .filter(|record| record.air.is_empty())
            .map(|record| record.air_mps[2]),
        truth,
        start,
        true_air,
        seed: record.map(|record| record.seed),
        notes,
        campaign: 0,
    })
}

/// Whether the logs are of virtual drones, by the first that can be read: no fleet is of both.
fn of_virtual_drones(logs: &[LogInput]) -> bool {
    let mut taken = logs.iter().filter(|log| log.refused.is_none());
    taken.find_map(|log| is_of_simulator(&log.path)).unwrap_or_default()
}

/// The record, if most of the logs are still those that it speaks of: somebody may have put the logs
/// of real drones in their place. Says where files and record differ.
fn held_record(
    at: &LogsAt,
    record: FlightRecord,
    files: &[PathBuf],
    notes: &mut Vec<String>,
    hashes: &Hashes,
) -> Option<FlightRecord> {
    let path_of = |log: &LogRecord| at.folder.join(&log.file);
    let there: Vec<&LogRecord> = record.logs.iter().filter(|log| path_of(log).exists()).collect();
    let differences: Vec<Result<Option<String>, FileError>> = (there.par_iter())
        .map(|log| {
            let path = path_of(log);
            log.difference_by(&path, || hashes.crc32(&path))
        })
        .collect();
    let mut held = 0;
    for (log, difference) in there.into_iter().zip(differences) {
        match difference {
            Ok(None) => held += 1,
            Ok(Some(how)) => notes.push(format!(
                "{} is not the log described in flight.json: {how}",
                path_of(log).shown()
            )),
            // The analysis says why it cannot be read.
            Err(_) => {}
        }
    }
    let holds = record.logs.is_empty() || (held > 0 && 2 * held >= files.len());
    if !holds && !files.is_empty() {
        *notes = vec![format!(
            "{} describes other logs than those beside it: it is not used",
            at.record().shown()
        )];
    }
    holds.then_some(record)
}

/// Whose log a file is by the record.
fn recorded_slot(at: &LogsAt, record: Option<&FlightRecord>, path: &Path) -> Option<u16> {
    let named = |log: &&LogRecord| at.folder.join(&log.file) == path;
    record?.logs.iter().find(named).map(|log| log.slot)
}

/// The true air beside a simulated flight's logs, for the slots that have it.
fn true_air(
    folder: &FlightFolder,
    plan: &Plan,
) -> Result<BTreeMap<u16, TruthSeries>, WorkflowError> {
    let mut found = BTreeMap::new();
    for slot in &plan.slots {
        let path = folder.truth(slot.slot, plan.slots.len());
        if path.is_file() {
            let TrueUpdraft { first_s, updraft_mps } =
                truth::read(&path).map_err(|error| WorkflowError::Failed(error.to_string()))?;
            found.insert(slot.slot, TruthSeries { first_s, updraft_mps });
        }
    }
    Ok(found)
}
