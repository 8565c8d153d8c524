//! Search for flights behind paths: plans, logs and what is known of them.

mod files;
mod flight;
mod leaning;
mod of_start;
mod physics;
mod response;
mod true_scales;
pub(crate) mod twice;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use self::files::logs_in;
pub(crate) use self::files::{labels, numbered, stem};
use self::flight::found_flight;
use self::physics::density;
pub(crate) use self::physics::{is_of_simulator, sag};
use super::error::WorkflowError;
use super::hashes::Hashes;
use super::shows::load::has_extension;
use crate::analysis::battery::Sag;
use crate::analysis::density::Density;
use crate::analysis::lean_table::LeanTable;
use crate::analysis::statistics::result::TrueAir;
use crate::analysis::wind::Leaning;
use crate::analysis::wind_forms::WindForms;
use crate::analysis::{Level, LogInput, TruthSeries};
use crate::base::causes::with_causes;
use crate::base::file::FileError;
use crate::base::names;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::origin::{self, LogOrigin};
use crate::campaign::{self, CampaignIndex, FlightFolder};
use crate::flight::Indicator;
use crate::flight::table::{Mapping, TableError};
use crate::log::Log;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::vehicle::{Vehicle, library};

/// A flight found behind a path: its logs, and what is known of it. Without a plan and a record
/// most of it is `None`.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Name of the flight.
    pub name: String,
    /// Plan that was flown.
    pub plan: Option<Plan>,
    /// Purpose of the flight, if it is known.
    pub purpose: Option<Purpose>,
    /// Logs of the flight, in the order of their paths.
    pub logs: Vec<LogInput>,
    /// Whether the logs are of the simulator.
    pub simulated: bool,
    /// True vertical speed of uniform air, m/s, up positive (simulated flights).
    pub true_updraft_mps: Option<f64>,
    /// True vertical speed of the air at each slot's planned place (simulated flights).
    pub truth: BTreeMap<u16, TruthSeries>,
    /// Seed of the simulation.
    pub seed: Option<u64>,
    /// GPS time of show time 0.
    pub start: Option<GpsTime>,
    /// Effect of the air's density on the pulse, if known.
    pub density: Option<Density>,
    /// Lean of the vehicle in wind, if known.
    pub leaning: Option<Leaning>,
    /// Power of thrust that `u - 1000` goes with.
    pub thrust_exponent: Option<f64>,
    /// Effect of the battery on the pulse, if known.
    pub sag: Option<Sag>,
    /// Effect of wind on the pulse of a leaning drone, if known.
    pub wind_forms: Option<WindForms>,
    /// Response of the vehicle whose level the flight gives, if that was asked for.
    pub level: Option<Level>,
    /// Vehicle whose response says what wind does to other indicators than the pulse, if it is known.
    pub response_of: Option<Vehicle>,
    /// Scales of the simulated air, if there is any.
    pub true_air: Option<TrueAir>,
    /// Doubts about the files, one sentence each.
    pub notes: Vec<String>,
    /// Number of the campaign, or else of the path, that it is of.
    pub campaign: usize,
}

/// Work for an analysis: flights found behind paths.
#[derive(Debug, Default)]
pub struct Work {
    /// Title of the work, for people.
    pub title: String,
    /// Folder to which paths in the report are relative.
    pub root: PathBuf,
    /// Flights in their order.
    pub flights: Vec<Found>,
    /// Hashes of files that were read on the way.
    pub hashes: Hashes,
    /// Flights of a campaign that cannot be analysed, one sentence each.
    pub absent: Vec<String>,
    /// Origin of a campaign's logs; `None` until a campaign is found: real drones if there are any
    /// of their logs.
    pub origin: Option<LogOrigin>,
    /// Origin of the logs that were taken, one sentence for each campaign.
    pub used: Vec<String>,
}

impl Work {
    /// Work without any flights, with paths relative to `root`.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned(), ..Self::default() }
    }
}

/// Adds the flights behind a path to the work: a campaign folder, a folder of logs, or one log.
/// `plan` is that of logs outside a campaign.
///
/// # Errors
///
/// If there is nothing, or a file that was named cannot be read.
pub fn find(path: &Path, plan: Option<&Plan>, work: &mut Work) -> Result<(), WorkflowError> {
    if has_extension(path, "csv") && path.is_file() {
        return Err(WorkflowError::Usage(format!(
            "{} is a table, not a log: say in a mapping file what its columns are, and give that with --csv \
             (docs/csv.md)",
            path.shown()
        )));
    }
    if path.is_dir() && campaign::is_campaign(path) {
        let index = campaign::index_path(path);
        if index.is_file() && work.title.is_empty() {
            work.title = campaign::read_json::<CampaignIndex>(&index)?.title;
        }
        let folders = campaign::flights(path)?;
        let origin = work.origin.unwrap_or_else(|| origin::default_of(&folders));
        work.origin = Some(origin);
        work.used.extend(used(&folders, origin));
        work.used.extend(simulated_alone(&folders, origin));
        let several = folders.len() > 1;
        let mut first_error = None;
        let before = work.flights.len();
        for folder in folders {
            let flight = match found_flight(path, &folder, origin, &work.hashes) {
                Ok(flight) => told_apart(flight, &folder, &work.flights[before..]),
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
        return Err(WorkflowError::Nothing(format!(
            "{} holds no .BIN logs: give a campaign, or the folder that contains them",
            path.shown()
        )));
    }
    let mut logs: Vec<LogInput> =
        logs.into_iter().map(|path| LogInput { path, ..LogInput::default() }).collect();
    let (start, notes) = if path.is_dir() {
        of_start::refuse(&of_start::FlightLogs { logs: path, campaign: None }, &mut logs)?
    } else {
        (None, Vec::new())
    };
    work.flights.push(Found {
        name: stem(path),
        plan: plan.cloned(),
        logs,
        start,
        density: plan.map(|plan| density(plan, None)),
        sag: Some(if plan.is_some() { Sag::default() } else { Sag::UNKNOWN }),
        notes,
        ..Found::default()
    });
    Ok(())
}

/// The flight, with its folder's name where an earlier one of its campaign has the plan's.
fn told_apart(flight: Found, folder: &FlightFolder, earlier: &[Found]) -> Found {
    let is_taken = |name: &str| earlier.iter().any(|one| one.name == name);
    if !is_taken(&flight.name) {
        return flight;
    }
    let of_folder = stem(&folder.0);
    let numbered = (2..).map(|number| format!("{}-{number}", flight.name));
    let name = std::iter::once(of_folder).chain(numbered).find(|name| !is_taken(name));
    Found { name: name.unwrap_or_default(), ..flight }
}

/// Adds the flights of a mapping file to the work; returns the indicator of rotor effort that they
/// hold.
///
/// # Errors
///
/// If the mapping is not valid, or a file that it names does not exist.
pub fn find_tables(path: &Path, work: &mut Work) -> Result<Indicator, WorkflowError> {
    let mapping = Mapping::load(path).map_err(|error| match error {
        TableError::File(error) => WorkflowError::File(error),
        error => WorkflowError::Usage(error.to_string()),
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
            purpose: Some(flight.purpose),
            logs: flight.files.iter().map(log).collect(),
            ..Found::default()
        }
    }));
    Ok(shared.indicator)
}

/// What wind does to an indicator by the lean, for each flight of the work; `None` where the vehicle does not say, and
/// for the pulse, of which the flights have [`Found::wind_forms`].
pub(crate) fn lean_tables(work: &Work, indicator: Indicator) -> Vec<Option<LeanTable>> {
    let of = |flight: &Found| {
        let vehicle = flight.response_of.as_ref().filter(|_| indicator != Indicator::Pulse)?;
        let response = response::response(vehicle, indicator).ok()?;
        Some(leaning::lean_table_of(&response, indicator))
    };
    work.flights.iter().map(of).collect()
}

/// Wish for maps from a vehicle's response whose level the flights of a mapping give.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LevelWish {
    /// Vehicle: a built-in name or a file; `None`: the slope of the calibration's line.
    pub vehicle: Option<String>,
    /// Stretch of the hover that sets the zero, from and to, s of the table; `None`: the calibration's windows do.
    pub zero_s: Option<[f64; 2]>,
}

/// Gives the flights of tables the response and the level that are wished for.
///
/// # Errors
///
/// If the vehicle is unknown, or cannot hover in its own model.
pub fn level_tables(
    wish: &LevelWish,
    indicator: Indicator,
    work: &mut Work,
) -> Result<(), WorkflowError> {
    let vehicle = wish.vehicle.as_deref().map(library::load).transpose()?;
    let response = vehicle.map(|vehicle| response::response(&vehicle, indicator)).transpose()?;
    for flight in &mut work.flights {
        let mapping = flight.logs.first().and_then(|log| log.table.as_ref());
        flight.level = Some(Level {
            response: response.clone(),
            zero_s: wish.zero_s,
            distance_m: mapping.and_then(|mapping| mapping.truth_distance_m),
        });
    }
    Ok(())
}

/// Flights that were simulated beside others that were flown: they give no laws by themselves.
fn simulated_alone(folders: &[FlightFolder], origin: LogOrigin) -> Option<String> {
    if origin != LogOrigin::Real || !folders.iter().any(FlightFolder::has_real_logs) {
        return None;
    }
    let alone = folders.iter().filter(|of| !of.has_real_logs() && of.has_simulated_logs());
    let names: Vec<String> = alone.map(|folder| stem(&folder.0)).collect();
    let (has, them) = match names.len() {
        0 => return None,
        1 => ("has", "it"),
        _ => ("have", "them"),
    };
    Some(format!(
        "{} {has} simulated logs alone; laws that were simulated are used on purpose only: analyse {them} with --logs \
         simulated -o FOLDER, then this campaign with --hold FOLDER/analysis.json",
        names::listed(names.iter().map(String::as_str))
    ))
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
