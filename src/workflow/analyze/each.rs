//! Analysis of many campaigns, each by itself into its own folder; those that are done are not done again.

use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::gather::{Request, gather};
use super::{Analysing, Settings};
use crate::base::digest::sha256;
use crate::base::file::{FileError, open_regular, write_whole};
use crate::base::plain::Shown as _;
use crate::base::shard::Share;
use crate::campaign::{self, FlightFolder, read_json, to_json};
use crate::workflow::ending::Ending;
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::host::Host;
use crate::workflow::made_by;

/// Name and version of the format of [`AnalysisRecord`].
pub const ANALYSIS_RECORD_SCHEMA: &str = "updraft.analysis-record/1";

/// `analysis-record.json`: what an analysis was made of, and what came of it. Written last, so that an
/// analysis with a record is whole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AnalysisRecord {
    /// Format name and version: `updraft.analysis-record/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// SHA-256 of the settings, hexadecimal.
    pub settings_sha256: String,
    /// Files that were there to be analysed.
    pub inputs: Vec<InputState>,
    /// Files that the analysis has written.
    #[serde(default)]
    pub outputs: Vec<OutputState>,
    /// Number of logs.
    pub logs: usize,
    /// Number of logs that gave a drone's results.
    pub used: usize,
    /// Losses of the analysis, one sentence each.
    pub problems: Vec<String>,
    /// Whether the analysis gave neither a law nor a value of the map.
    pub is_nothing: bool,
}

/// State of a file by which a change is noticed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InputState {
    /// Path of the file, from the campaign's folder.
    pub path: String,
    /// Size, bytes.
    pub bytes: u64,
    /// Unix time of the last change, ms.
    pub modified_unix_ms: u64,
}

/// File that an analysis has written.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputState {
    /// Path of the file, from the folder of the analysis.
    pub path: String,
    /// Size, bytes.
    pub bytes: u64,
}

/// One of many campaigns after its analysis.
#[derive(Debug)]
pub struct EachDone {
    /// Path as it was given.
    pub path: PathBuf,
    /// Folder of the results.
    pub folder: PathBuf,
    /// Record of the analysis, or why there is none.
    pub result: Result<AnalysisRecord, WorkflowError>,
    /// Whether it was analysed before.
    pub was_there: bool,
}

impl EachDone {
    /// Whether the campaign's analysis lost nothing.
    pub fn is_whole(&self) -> bool {
        self.result.as_ref().is_ok_and(|record| record.problems.is_empty() && !record.is_nothing)
    }
}

/// Ending of all: with losses if a campaign's analysis failed or lost something.
pub fn ending(all: &[EachDone]) -> Ending {
    Ending::of_losses(!all.iter().all(EachDone::is_whole))
}

/// Ending of a shard: with losses if an analysis failed. One of logs with losses is complete.
pub fn ending_of_shard(all: &[EachDone]) -> Ending {
    Ending::of_losses(all.iter().any(|done| done.result.is_err()))
}

/// Analyses the campaigns of a share, each into its own folder. `requests` have one path each; `hold` is the
/// analysis.json whose laws are held. A campaign that cannot be analysed does not stop the others.
///
/// # Errors
///
/// If two would be written into one folder, the work is stopped, or, where missing analyses are only to be named, one is missing.
pub fn each(
    host: &dyn Host,
    requests: &[Request],
    settings: &Settings,
    hold: Option<&Path>,
    share: Share,
) -> Result<Vec<EachDone>, WorkflowError> {
    refuse_one_folder(requests)?;
    let taken: Vec<&Request> = requests
        .iter()
        .enumerate()
        .filter(|(item, _)| share.takes(*item))
        .map(|(_, r)| r)
        .collect();
    let mut all = Vec::new();
    let mut missing = Vec::new();
    for request in &taken {
        host.check_stop()?;
        let path = request.paths.first().cloned().unwrap_or_default();
        let folder = request.output()?;
        let (result, was_there) = match wanted(request, settings, hold) {
            Err(error) => (Err(error), false),
            Ok(wanted) => match found(&folder, &wanted) {
                Some(record) => (Ok(record), true),
                None if share.gather_only => {
                    missing.push(path.shown().to_string());
                    continue;
                }
                None => (one(host, request, settings, hold, share, &folder, wanted), false),
            },
        };
        match &result {
            Err(WorkflowError::Interrupted) => return Err(WorkflowError::Interrupted),
            Err(error) => host.warn(&format!("{}: {}", path.shown(), with_reasons(error))),
            Ok(record) => {
                for problem in &record.problems {
                    host.warn(&format!("{}: {problem}", path.shown()));
                }
            }
        }
        all.push(EachDone { path, folder, result, was_there });
    }
    if missing.is_empty() {
        return Ok(all);
    }
    let (count, of, missing) = (missing.len(), taken.len(), missing.join(", "));
    Err(WorkflowError::Missing { what: "analyses", count, of, missing })
}

/// Refuses two requests whose results would go into one folder, the second over the first.
fn refuse_one_folder(requests: &[Request]) -> Result<(), WorkflowError> {
    let mut seen: BTreeMap<PathBuf, &Request> = BTreeMap::new();
    for request in requests {
        let folder = request.output()?;
        let shown = |of: &Request| of.paths.first().map(|path| path.shown().to_string());
        let before = seen.insert(folder.clone(), request);
        if let Some(before) = before.filter(|before| before.paths != request.paths) {
            let [one, other] = [before, request].map(|of| shown(of).unwrap_or_default());
            return Err(WorkflowError::Usage(format!(
                "the results of {one} and {other} would both go into {}: give each once, and folders of logs with \
                 one name in commands of their own, with --output",
                folder.shown()
            )));
        }
    }
    Ok(())
}

/// Analyses one campaign; the record comes last.
fn one(
    host: &dyn Host,
    request: &Request,
    settings: &Settings,
    hold: Option<&Path>,
    share: Share,
    folder: &Path,
    wanted: AnalysisRecord,
) -> Result<AnalysisRecord, WorkflowError> {
    // Shards share folders, on file systems that may have no locks; two that analyse the same write the same.
    let _lock = share.shard.is_none().then(|| host.lock(folder)).transpose()?;
    let (work, _) = gather(request)?;
    let analysed = Analysing::begin(host, &work, settings, hold)?.run(true)?;
    analysed.write(host, folder)?;
    let record = AnalysisRecord {
        outputs: outputs(folder)?,
        logs: analysed.logs,
        used: analysed.used(),
        problems: analysed.problems(),
        is_nothing: analysed.is_nothing(),
        ..wanted
    };
    let json = to_json(&record)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    write_whole(&record_path(folder), &json)?;
    Ok(record)
}

/// Path of the record in the folder of an analysis.
pub fn record_path(folder: &Path) -> PathBuf {
    folder.join("analysis-record.json")
}

/// Record of an analysis that is there and fits.
fn found(folder: &Path, wanted: &AnalysisRecord) -> Option<AnalysisRecord> {
    let record: AnalysisRecord = read_json(&record_path(folder)).ok()?;
    let fits = record.schema == wanted.schema
        && record.made_by == wanted.made_by
        && record.settings_sha256 == wanted.settings_sha256
        && record.inputs == wanted.inputs;
    let is_there = |output: &OutputState| {
        std::fs::metadata(folder.join(&output.path)).is_ok_and(|found| found.len() == output.bytes)
    };
    (fits && !record.outputs.is_empty() && record.outputs.iter().all(is_there)).then_some(record)
}

/// Files that an analysis writes: numbers, fields and pages.
fn outputs(folder: &Path) -> Result<Vec<OutputState>, WorkflowError> {
    let mut files = vec![folder.join("analysis.json")];
    for below in ["fields", "report", "report/figures", "report/data"] {
        files.extend(files_in(&folder.join(below))?);
    }
    files.retain(|file| file.is_file());
    let state = |file: &PathBuf| {
        let found = std::fs::metadata(file).map_err(|error| FileError::new("read", file, error))?;
        let path = file.strip_prefix(folder).unwrap_or(file).shown().to_string();
        Ok(OutputState { path, bytes: found.len() })
    };
    let mut states = files.iter().map(state).collect::<Result<Vec<_>, FileError>>()?;
    states.sort();
    Ok(states)
}

/// Record that an analysis would have, without what comes of it.
fn wanted(
    request: &Request,
    settings: &Settings,
    hold: Option<&Path>,
) -> Result<AnalysisRecord, WorkflowError> {
    let Request { paths, plan, start_unix_s, origin, .. } = request;
    let of_files = [hold, plan.as_deref()].map(|path| path.map(state).transpose());
    let [hold, plan] = of_files;
    let settings = format!("{settings:?} {start_unix_s:?} {origin:?} {:?} {:?}", hold?, plan?);
    let path = paths.first().map_or(Path::new(""), PathBuf::as_path);
    Ok(AnalysisRecord {
        schema: ANALYSIS_RECORD_SCHEMA.to_owned(),
        made_by: made_by(),
        settings_sha256: sha256(settings.as_bytes()),
        inputs: inputs(path)?,
        outputs: Vec::new(),
        logs: 0,
        used: 0,
        problems: Vec::new(),
        is_nothing: false,
    })
}

/// Files that an analysis of a campaign, a folder of logs or a log looks at.
fn inputs(path: &Path) -> Result<Vec<InputState>, WorkflowError> {
    let mut files = Vec::new();
    if campaign::is_campaign(path) {
        files.push(campaign::index_path(path));
        files.push(campaign::study_result(path));
        for flight in campaign::flights(path)? {
            let FlightFolder(folder) = &flight;
            files.extend([flight.plan(), flight.vehicle()]);
            for below in [flight.logs(), flight.simulated(), flight.truth_folder()] {
                files.extend(files_in(&below)?);
            }
            files.push(folder.join("fleet.json"));
        }
    } else if path.is_dir() {
        files.extend(files_in(path)?);
    } else {
        open_regular(path).map_err(|error| FileError::new("read", path, error))?;
        files.push(path.to_owned());
    }
    files.retain(|file| file.is_file());
    let states = files.iter().map(|file| {
        let state = state(file)?;
        let shown = file.strip_prefix(path).ok().filter(|rest| !rest.as_os_str().is_empty());
        Ok(InputState { path: shown.unwrap_or(file).shown().to_string(), ..state })
    });
    let mut states: Vec<InputState> = states.collect::<Result<_, FileError>>()?;
    states.sort();
    Ok(states)
}

/// Files of a folder, without those that are being written.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let fail = |error| FileError::new("read", folder, error);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        if !entry.file_name().to_string_lossy().starts_with('.') {
            files.push(entry.path());
        }
    }
    Ok(files)
}

fn state(path: &Path) -> Result<InputState, FileError> {
    let found = std::fs::metadata(path).map_err(|error| FileError::new("read", path, error))?;
    let (bytes, modified_unix_ms) = (found.len(), modified_unix_ms(&found));
    Ok(InputState { path: path.shown().to_string(), bytes, modified_unix_ms })
}

fn modified_unix_ms(found: &Metadata) -> u64 {
    let since = found.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    since.map_or(0, |since| u64::try_from(since.as_millis()).unwrap_or(u64::MAX))
}
