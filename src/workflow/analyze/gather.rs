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
use crate::workflow::find::{
    Found, LevelWish, Work, find, find_tables, labels, level_tables, numbered, stem, twice,
};
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
    let mut behind = Vec::new();
    for (index, path) in request.paths.iter().enumerate() {
        find(path, plan.as_ref(), &mut work)?;
        behind.resize(work.flights.len(), index);
    }
    twice::refuse(&request.paths, &work)?;
    let campaigns = campaigns(&request.paths);
    for (flight, path) in work.flights.iter_mut().zip(&behind) {
        flight.campaign = campaigns.get(*path).copied().unwrap_or_default();
    }
    name_apart(&mut work.flights, &request.paths, &behind);
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

/// Number of the campaign that each path is, or lies in; else its own.
fn campaigns(paths: &[PathBuf]) -> Vec<usize> {
    let root = |path: &PathBuf| {
        let path = path.canonicalize().unwrap_or_else(|_| path.clone());
        let above = path.parent().filter(|above| campaign::is_campaign(above));
        above.map_or_else(|| path.clone(), Path::to_owned)
    };
    let roots: Vec<PathBuf> = paths.iter().map(root).collect();
    let first = |root| roots.iter().position(|other| other == root).unwrap_or_default();
    roots.iter().map(first).collect()
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

/// Flights of several campaigns may have the same name: `monday/hover`, or where each path is one flight, its folder's
/// name, tells them apart. `behind`: the path of each flight.
fn name_apart(flights: &mut [Found], paths: &[PathBuf], behind: &[usize]) {
    if paths.len() < 2 {
        return;
    }
    let distinct = |names: &[String]| {
        let mut sorted: Vec<&String> = names.iter().collect();
        sorted.sort();
        sorted.dedup();
        sorted.len() == names.len()
    };
    let names = if flights.len() == paths.len() {
        let plain: Vec<String> = paths.iter().map(|path| stem(path)).collect();
        if distinct(&plain) {
            plain
        } else {
            // `calibration/logs` and `hover/logs`: the flight's folder has the name.
            let above = |path: &PathBuf| path.parent().map_or_else(|| stem(path), stem);
            paths.iter().map(above).collect()
        }
    } else {
        let plain: Vec<String> = flights.iter().map(|flight| flight.name.clone()).collect();
        if distinct(&plain) {
            return;
        }
        let labels = labels(paths);
        let whole = |(name, at): (String, &usize)| match labels.get(*at) {
            Some(label) => format!("{label}/{name}"),
            None => name,
        };
        plain.into_iter().zip(behind).map(whole).collect()
    };
    let names = if distinct(&names) { names } else { of_whole_paths(names, paths, behind) };
    for (flight, name) in flights.iter_mut().zip(names) {
        flight.name = name;
    }
}

/// Names that are still alike, with the labels of their paths; numbered where these are alike, too.
fn of_whole_paths(names: Vec<String>, paths: &[PathBuf], behind: &[usize]) -> Vec<String> {
    let labels = labels(paths);
    let all = names.clone();
    let told = names.into_iter().zip(behind).map(|(name, at)| {
        let is_alone = all.iter().filter(|one| **one == name).count() == 1;
        labels.get(*at).filter(|_| !is_alone).cloned().unwrap_or(name)
    });
    numbered(told)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(flights: &[(&str, usize)], paths: &[&str]) -> Vec<String> {
        let mut found: Vec<Found> = flights
            .iter()
            .map(|(name, _)| Found { name: (*name).to_owned(), ..Found::default() })
            .collect();
        let behind: Vec<usize> = flights.iter().map(|(_, at)| *at).collect();
        let paths: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
        name_apart(&mut found, &paths, &behind);
        found.into_iter().map(|flight| flight.name).collect()
    }

    #[test]
    fn flights_of_several_campaigns_have_names_of_their_own() {
        let both = [("calibration", 0), ("hover", 0), ("calibration", 1), ("hover", 1)];
        let expected = ["mon/calibration", "mon/hover", "tue/calibration", "tue/hover"];
        assert_eq!(named(&both, &["may/mon", "may/tue"]), expected);
        let expected =
            ["may/mon/calibration", "may/mon/hover", "june/mon/calibration", "june/mon/hover"];
        assert_eq!(named(&both, &["may/mon", "june/mon"]), expected);
        let apart = [("ladder", 0), ("hover", 1), ("hover at noon", 1)];
        assert_eq!(named(&apart, &["a", "b"]), ["ladder", "hover", "hover at noon"]);
    }

    #[test]
    fn folders_of_logs_have_the_names_of_their_flights() {
        let logs = [("logs", 0), ("logs", 1)];
        assert_eq!(named(&logs, &["a/calibration/logs", "a/hover/logs"]), ["calibration", "hover"]);
        let twice = named(&logs, &["a/hover/logs", "b/hover/logs"]);
        assert_eq!(twice, ["hover/logs", "hover/logs-2"]);
    }
}
