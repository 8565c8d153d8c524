//! Input of an analysis: flights behind paths, told apart by name, of the requested start.

use std::path::{Path, PathBuf};

use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign;
use crate::campaign::origin::LogOrigin;
use crate::flight::Indicator;
use crate::flight::identity::{SAME_START_S, later_s};
use crate::mission::Plan;
use crate::vehicle::library;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{Found, LevelWish, Work, find, find_tables, level_tables, stem, twice};
use crate::workflow::shows::load::{has_extension, load_shows};

/// Request for an analysis: its input.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Campaign folders, folders of logs, or logs.
    pub paths: Vec<PathBuf>,
    /// Path of a mapping file of tables, instead of `paths`.
    pub tables: Option<PathBuf>,
    /// Wish for maps of the tables' flights by a response whose level they give; `None`: by the calibration's laws.
    pub level: Option<LevelWish>,
    /// Path of the plan that the logs were flown from.
    pub plan: Option<PathBuf>,
    /// Unix time of show time 0, s.
    pub start_unix_s: Option<i64>,
    /// Origin of a campaign's logs; `None`: real drones if there are any of their logs.
    pub origin: Option<LogOrigin>,
}

impl Request {
    /// The first that was named.
    fn first(&self) -> Result<&PathBuf, WorkflowError> {
        self.tables
            .as_ref()
            .or(self.paths.first())
            .ok_or_else(|| WorkflowError::Usage("give a campaign, logs or --csv".to_owned()))
    }

    /// Default folder of the results: in the campaign, otherwise a folder named after the input.
    ///
    /// # Errors
    ///
    /// If the request names no input.
    pub fn output(&self) -> Result<PathBuf, WorkflowError> {
        let first = self.first()?;
        if self.paths.len() == 1 && campaign::is_campaign(first) {
            return Ok(first.clone());
        }
        Ok(PathBuf::from(format!("{}-analysis", stem(first))))
    }
}

/// Finds the flights, and the indicator of rotor effort that tables hold.
///
/// # Errors
///
/// If a path does not exist, is no log or plan, or is given twice.
pub fn gather(request: &Request) -> Result<(Work, Option<Indicator>), WorkflowError> {
    let plan = request.plan.as_deref().map(load_plan).transpose()?;
    let mut work = Work::new(Path::new("."));
    work.origin = request.origin;
    for path in &request.paths {
        find(path, plan.as_ref(), &mut work)?;
    }
    twice::refuse(&request.paths, &work)?;
    name_apart(&mut work.flights, &request.paths);
    let mut indicator = None;
    if let Some(mapping) = &request.tables {
        let held = find_tables(mapping, &mut work)?;
        request.level.as_ref().map_or(Ok(()), |wish| level_tables(wish, held, &mut work))?;
        indicator = Some(held);
    }
    let first = request.first()?;
    if request.paths.len() < 2 {
        work.root = if first.is_dir() {
            first.clone()
        } else {
            first.parent().unwrap_or(Path::new(".")).to_owned()
        };
    }
    if work.title.is_empty() {
        work.title = stem(first);
    }
    if let Some(unix_s) = request.start_unix_s {
        start_at(&mut work.flights, unix_s)?;
    }
    Ok((work, indicator))
}

/// All flights began then, whatever is written of them.
fn start_at(flights: &mut [Found], unix_s: i64) -> Result<(), WorkflowError> {
    let start = unix_s.checked_mul(1000).and_then(GpsTime::from_unix_ms).ok_or_else(|| {
        WorkflowError::Usage(format!("--start {unix_s} is not a time since 1980"))
    })?;
    for flight in flights {
        // Whoever names another start than the one that was written down means its logs.
        let is_other = |known: GpsTime| later_s(start, known).abs() > SAME_START_S;
        if flight.start.replace(start).is_some_and(is_other) {
            flight.logs.iter_mut().for_each(|log| log.refused = None);
        }
    }
    Ok(())
}

/// Reads the plan behind a path: plan.json, a flight's folder, or a show file of any kind.
///
/// # Errors
///
/// If there is none, or the folder holds several flights.
pub fn load_plan(path: &Path) -> Result<Plan, WorkflowError> {
    if has_extension(path, "json") {
        return Ok(campaign::read_plan(path)?);
    }
    let several = |count: usize| {
        WorkflowError::Usage(format!(
            "{} holds {count} flights; give the folder of one of them",
            path.shown()
        ))
    };
    // The plan is what counts, whatever else of the flight is there.
    if path.is_dir() && campaign::is_campaign(path) {
        return match campaign::flights(path)?.as_slice() {
            [flight] => Ok(flight.read_plan()?),
            flights => Err(several(flights.len())),
        };
    }
    let vehicle = library::builtin("airsim-generic-quad")?;
    let mut loaded = load_shows(path, &vehicle)?;
    if loaded.len() != 1 {
        return Err(several(loaded.len()));
    }
    Ok(loaded.remove(0).plan)
}

/// Flights of several campaigns may have the same name: the folder's name tells them apart.
fn name_apart(flights: &mut [Found], paths: &[PathBuf]) {
    if paths.len() < 2 || flights.len() != paths.len() {
        return;
    }
    let mut names: Vec<String> = paths.iter().map(|path| stem(path)).collect();
    let mut distinct = names.clone();
    distinct.sort();
    distinct.dedup();
    // `calibration/logs` and `hover/logs`: the flight's folder has the name.
    if distinct.len() < names.len() {
        let above = |path: &PathBuf| path.parent().map_or_else(|| stem(path), stem);
        names = paths.iter().map(above).collect();
    }
    for (flight, name) in flights.iter_mut().zip(names) {
        flight.name = name;
    }
}
