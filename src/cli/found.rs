//! The flights behind the paths given to `updraft analyze`: plans, logs and what is known of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;
use rayon::prelude::*;

use super::exit::CommandError;
use super::hashes::Hashes;
use super::leaning::{lean_table, leaning};
use super::load::has_extension;
use super::of_start;
use super::true_scales::true_scales;
use crate::analysis::battery::Sag;
use crate::analysis::density::Density;
use crate::analysis::lean_table::LeanTable;
use crate::analysis::statistics::result::TrueAir;
use crate::analysis::wind::Leaning;
use crate::analysis::{LogInput, TruthSeries};
use crate::base::causes::with_causes;
use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::base::plain::plain;
use crate::base::time::GpsTime;
use crate::campaign::origin::{self, LogOrigin, LogsAt, is_set_aside};
use crate::campaign::{self, CampaignIndex, FlightFolder, FlightRecord, LogRecord};
use crate::flight::Indicator;
use crate::flight::table::{Mapping, TableError};
use crate::log::Log;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::sim::air::truth::{self, TrueUpdraft};
use crate::vehicle::{Vehicle, library};

/// Which logs of a campaign, if somebody chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum OriginChoice {
    /// Those of real drones, in logs/
    Real,
    /// Simulated ones, in simulated/
    Simulated,
}

impl From<OriginChoice> for LogOrigin {
    fn from(choice: OriginChoice) -> Self {
        match choice {
            OriginChoice::Real => Self::Real,
            OriginChoice::Simulated => Self::Simulated,
        }
    }
}

/// Exponent of density for electric rotors with a real thrust curve.
const REAL_ROTOR_EXPONENT: f64 = 0.4;

/// One flight found behind a path.
pub(super) struct Found {
    pub(super) name: String,
    pub(super) plan: Option<Plan>,
    pub(super) purpose: Option<Purpose>,
    pub(super) logs: Vec<LogInput>,
    pub(super) true_updraft_mps: Option<f64>,
    pub(super) truth: BTreeMap<u16, TruthSeries>,
    pub(super) seed: Option<u64>,
    pub(super) start: Option<GpsTime>,
    pub(super) density: Option<Density>,
    pub(super) leaning: Option<Leaning>,
    /// Power of thrust that `u - 1000` goes with.
    pub(super) thrust_exponent: Option<f64>,
    pub(super) sag: Option<Sag>,
    pub(super) lean_table: Option<LeanTable>,
    pub(super) true_air: Option<TrueAir>,
    /// What is doubtful about the files, one sentence each.
    pub(super) notes: Vec<String>,
}

/// What was asked to be analysed.
#[derive(Default)]
pub(super) struct Work {
    pub(super) title: String,
    /// Paths in the report are shown relative to this.
    pub(super) root: PathBuf,
    pub(super) flights: Vec<Found>,
    /// What has been hashed on the way.
    pub(super) hashes: Hashes,
    /// Flights of a campaign that cannot be looked at, one sentence each.
    pub(super) absent: Vec<String>,
    /// Which logs of campaigns are meant; `None` until a campaign is looked at: real ones if there are
    /// any.
    pub(super) origin: Option<LogOrigin>,
    /// Which of them were taken, one sentence for each campaign.
    pub(super) used: Vec<String>,
}

impl Work {
    /// Nothing yet, with paths relative to `root`.
    pub(super) fn new(root: &Path) -> Self {
        Self { root: root.to_owned(), ..Self::default() }
    }
}

/// Adds what a path holds to the work.
pub(super) fn find(path: &Path, plan: Option<&Plan>, work: &mut Work) -> Result<(), CommandError> {
    if path.is_dir() && campaign::is_campaign(path) {
        let index = campaign::index_path(path);
        if index.is_file() && work.title.is_empty() {
            work.title = campaign::read_json::<CampaignIndex>(&index)?.title;
        }
        let folders = campaign::flights(path)?;
        let origin = work.origin.unwrap_or_else(|| origin::default_of(&folders));
        work.origin = Some(origin);
        work.used.extend(used(&folders, origin));
        let several = folders.len() > 1;
        let mut first_error = None;
        let before = work.flights.len();
        for folder in folders {
            let flight = match found_flight(path, &folder, origin, &work.hashes) {
                Ok(flight) => flight,
                // The campaign's other flights can be analysed without this one.
                Err(error) if several => {
                    work.absent.push(format!(
                        "{} is left out: {}",
                        stem(&folder.0),
                        with_causes(&error, ": ")
                    ));
                    first_error = first_error.or(Some(error));
                    continue;
                }
                Err(error) => return Err(error),
            };
            if work.title.is_empty() {
                work.title =
                    flight.plan.as_ref().map_or_else(String::new, |plan| plan.title.clone());
            }
            work.flights.push(flight);
        }
        let nothing = work.flights.len() == before;
        return first_error.filter(|_| nothing).map_or(Ok(()), Err);
    }
    let logs = if path.is_dir() {
        logs_in(path)?
    } else {
        // A file that is named itself must be there and be a log; one found in a folder may be lost.
        Log::open(path)?;
        vec![path.to_owned()]
    };
    if logs.is_empty() {
        return Err(CommandError::Nothing(format!(
            "{} holds no .BIN logs: give a campaign, or the folder that contains them",
            path.shown()
        )));
    }
    let mut logs: Vec<LogInput> =
        logs.into_iter().map(|path| LogInput { path, ..LogInput::default() }).collect();
    let (start, notes) = if path.is_dir() {
        of_start::refuse(&of_start::Flight { logs: path, campaign: None }, &mut logs)?
    } else {
        (None, Vec::new())
    };
    work.flights.push(Found {
        name: stem(path),
        plan: plan.cloned(),
        purpose: None,
        logs,
        true_updraft_mps: None,
        truth: BTreeMap::new(),
        seed: None,
        start,
        density: plan.map(|plan| density(plan, None)),
        leaning: None,
        thrust_exponent: None,
        sag: Some(if plan.is_some() { Sag::default() } else { Sag::UNKNOWN }),
        lean_table: None,
        true_air: None,
        notes,
    });
    Ok(())
}

/// 1 for vehicles whose thrust is linear in the pulse; for others nothing is known better than what
/// the analysis takes itself.
fn linear_thrust(vehicle: &Vehicle) -> Option<f64> {
    (vehicle.autopilot.mot_thst_expo == 0.0).then_some(1.0)
}

/// Adds the flights of a mapping file to the work; what stands for rotor effort in them.
pub(super) fn find_tables(path: &Path, work: &mut Work) -> Result<Indicator, CommandError> {
    let mapping = Mapping::load(path).map_err(|error| match error {
        TableError::File(error) => CommandError::File(error),
        error => CommandError::Usage(error.to_string()),
    })?;
    // A file that is named itself must be there.
    for file in mapping.flights.iter().flat_map(|flight| &flight.files) {
        std::fs::metadata(file).map_err(|error| FileError::new("read", file, error))?;
    }
    work.title.clone_from(&mapping.title);
    let shared = Arc::new(mapping);
    work.flights.extend(shared.flights.iter().map(|flight| {
        let log = |path: &PathBuf| LogInput {
            path: path.clone(),
            table: Some(Arc::clone(&shared)),
            ..LogInput::default()
        };
        Found {
            name: flight.name.clone(),
            plan: None,
            purpose: Some(flight.purpose),
            logs: flight.files.iter().map(log).collect(),
            true_updraft_mps: None,
            truth: BTreeMap::new(),
            seed: None,
            start: None,
            density: None,
            leaning: None,
            thrust_exponent: None,
            sag: None,
            lean_table: None,
            true_air: None,
            notes: Vec::new(),
        }
    }));
    Ok(shared.indicator)
}

/// Which logs are taken, where there are any.
fn used(folders: &[FlightFolder], origin: LogOrigin) -> Option<String> {
    let others = match origin {
        LogOrigin::Real => folders.iter().any(FlightFolder::has_simulated_logs),
        LogOrigin::Simulated => folders.iter().any(FlightFolder::has_real_logs),
    };
    let any = others || folders.iter().any(|folder| folder.logs_of(origin).folder.is_dir());
    let left = match (others, origin) {
        (false, _) => "",
        (true, LogOrigin::Real) => "; the simulated ones are ignored (--logs simulated uses them)",
        (true, LogOrigin::Simulated) => {
            "; those of real drones are ignored (--logs real uses them)"
        }
    };
    any.then(|| format!("Using the {}{left}", origin.words()))
}

fn found_flight(
    campaign: &Path,
    folder: &FlightFolder,
    origin: LogOrigin,
    hashes: &Hashes,
) -> Result<Found, CommandError> {
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
        let at = of_start::Flight {
            logs: &at.folder,
            campaign: is_real.then_some((campaign, plan.name.as_str())),
        };
        let (start, doubts) = of_start::refuse(&at, &mut logs)?;
        notes.extend(doubts);
        start
    };
    Ok(Found {
        leaning: flown.and_then(|(record, vehicle)| leaning(&plan, record, vehicle)),
        sag: sag(flown.is_some(), vehicle.as_ref()),
        lean_table: vehicle.as_ref().and_then(|vehicle| lean_table(&plan, vehicle)),
        density: Some(density(&plan, vehicle.as_ref())),
        thrust_exponent: vehicle.as_ref().and_then(linear_thrust),
        name: plan.name.clone(),
        purpose: Some(plan.purpose),
        plan: Some(plan),
        logs,
        true_updraft_mps: record
            .as_ref()
            .filter(|record| record.air.is_empty())
            .map(|record| record.air_mps[2]),
        truth,
        start,
        true_air: record.as_ref().and_then(|record| true_scales(&record.air)),
        seed: record.map(|record| record.seed),
        notes,
    })
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
) -> Result<BTreeMap<u16, TruthSeries>, CommandError> {
    let mut found = BTreeMap::new();
    for slot in &plan.slots {
        let path = folder.truth(slot.slot, plan.slots.len());
        if path.is_file() {
            let TrueUpdraft { first_s, updraft_mps } =
                truth::read(&path).map_err(|error| CommandError::Failed(error.to_string()))?;
            found.insert(slot.slot, TruthSeries { first_s, updraft_mps });
        }
    }
    Ok(found)
}

/// How the map is corrected for air density: by the thrust curve that the vehicle's autopilot is set
/// for (none: linear thrust).
fn density(plan: &Plan, vehicle: Option<&Vehicle>) -> Density {
    let linear = vehicle.is_some_and(|vehicle| vehicle.autopilot.mot_thst_expo == 0.0);
    Density {
        ground_amsl_m: plan.site.ground_amsl_m,
        exponent: if linear { 1.0 } else { REAL_ROTOR_EXPONENT },
    }
}

/// How the battery acts on the pulse. Simulated drones without a battery in their physics log one
/// that does nothing; real ones have one that does.
fn sag(is_simulated: bool, vehicle: Option<&Vehicle>) -> Option<Sag> {
    let battery = vehicle.and_then(|vehicle| vehicle.effects.get("battery"));
    match battery.filter(|battery| battery.on) {
        Some(_) => Some(Sag::default()),
        None => (!is_simulated).then(Sag::default),
    }
}

/// Whether a path is a finished log: what an interrupted run or copy left is not.
fn is_log(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    has_extension(path, "bin") && !hidden
}

/// The logs in a folder and in its direct subfolders (one per drone, as SD cards are often copied).
fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, CommandError> {
    let mut logs = Vec::new();
    let list = |folder: &Path| -> Result<Vec<PathBuf>, FileError> {
        let fail = |source| FileError::new("read", folder, source);
        let entries = std::fs::read_dir(folder).map_err(fail)?;
        let mut paths =
            entries.map(|entry| Ok(entry.map_err(fail)?.path())).collect::<Result<Vec<_>, _>>()?;
        paths.sort();
        Ok(paths)
    };
    for path in list(folder)? {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && is_set_aside(name) {
            continue;
        }
        if path.is_dir() {
            logs.extend(list(&path)?.into_iter().filter(|path| is_log(path)));
        } else if is_log(&path) {
            logs.push(path);
        }
    }
    Ok(logs)
}

pub(super) fn stem(path: &Path) -> String {
    // `arducopter-4.4` is a folder, not a file `arducopter-4` with an ending.
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
    let name = name.or(path.file_name());
    let text = name.map_or_else(String::new, |name| plain(&name.to_string_lossy()).into_owned());
    if text.is_empty() { "logs".to_owned() } else { text }
}
