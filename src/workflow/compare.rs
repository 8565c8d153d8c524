//! Comparison of campaigns: their analyses and records are read, compared and written.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use super::ending::Ending;
use super::error::WorkflowError;
use super::find::{labels, stem};
use super::host::Host;
use super::made_by;
use crate::analysis::result::{ANALYSIS_SCHEMA, Analysis, FlightAnalysis};
use crate::base::digest::sha256;
use crate::base::file::{FileError, read_whole, write_whole};
use crate::base::parse;
use crate::base::plain::Shown as _;
use crate::campaign::origin::LogOrigin;
use crate::campaign::start::StartRecord;
use crate::campaign::{self, CampaignError, FlightFolder, is_campaign, to_json};
use crate::compare::result::Comparison;
use crate::compare::{FlightFacts, LawChoice, Side, compare};
use crate::fleet::slots::FleetTable;
use crate::report::{self, ComparedFiles, InputFile, PageLink, Provenance};

/// File of the numbers, in the folder of a comparison.
pub const RESULT_FILE: &str = "compare.json";

/// Largest analysis that is read, bytes; see the archive's.
const MOST_ANALYSIS_BYTES: u64 = 4 << 30;

/// Request for a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// Campaign folders, folders with an analysis.json, or such files; the first is the reference.
    pub paths: Vec<PathBuf>,
    /// Choice of the law that is compared.
    pub law: LawChoice,
    /// Folder of numbers and report; `None`: nothing is written.
    pub output: Option<PathBuf>,
}

/// A finished comparison.
#[derive(Debug)]
pub struct Compared {
    /// Results of the comparison.
    pub comparison: Comparison,
    /// Path of the page, if one was written.
    pub page: Option<PathBuf>,
    /// Ending: with losses if something could not be compared.
    pub ending: Ending,
}

/// Compares campaigns, and writes numbers and report where that is asked for.
///
/// # Errors
///
/// If an analysis cannot be read or written, two are the same, or nothing can be compared.
pub fn run(host: &dyn Host, request: &Request) -> Result<Compared, WorkflowError> {
    refuse_twice(&request.paths)?;
    if let Some(output) = &request.output {
        refuse_output(output)?;
    }
    let ids = labels(&request.paths);
    let (mut sides, mut inputs) = (Vec::new(), Vec::new());
    for (path, id) in request.paths.iter().zip(ids) {
        host.check_stop()?;
        let (side, input) = read(path, id)?;
        sides.push(side);
        inputs.push(input);
    }
    let comparison = compare(&sides, request.law, &made_by())?;
    for note in &comparison.notes {
        host.warn(note);
    }
    for reason in &comparison.not_compared {
        host.warn(reason);
    }
    let page = request.output.as_deref().map(|output| {
        let provenance = Provenance {
            program: made_by(),
            command: host.command(),
            inputs,
            ..Provenance::default()
        };
        write(host, &comparison, (&sides, &request.paths), &provenance, output)
    });
    let ending = Ending::of_losses(!comparison.not_compared.is_empty());
    Ok(Compared { page: page.transpose()?, comparison, ending })
}

fn write(
    host: &dyn Host,
    comparison: &Comparison,
    (sides, paths): (&[Side], &[PathBuf]),
    provenance: &Provenance,
    output: &Path,
) -> Result<PathBuf, WorkflowError> {
    let _lock = host.lock(output)?;
    let json = to_json(comparison)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    let folder = output.join("report");
    let files: Vec<ComparedFiles> =
        sides.iter().zip(paths).map(|(side, path)| files_of(side, path, output)).collect();
    let made = report::render_comparison(comparison, provenance, &files)?;
    write_whole(&output.join(RESULT_FILE), &json)?;
    report::write(&made, &folder)?;
    Ok(folder.join(report::PAGE_FILE))
}

/// Where and when a campaign was flown, and links to its report and analysis as far as they are there.
fn files_of(side: &Side, path: &Path, output: &Path) -> ComparedFiles {
    let analysis = analysis_of(path);
    let page = analysis.parent().map(|folder| folder.join("report").join(report::PAGE_FILE));
    let links = [("report", page), ("analysis.json", Some(analysis))];
    let link = |(title, file): (&str, Option<PathBuf>)| {
        Some(PageLink::there(title, way(output, &file.filter(|file| file.is_file())?)?))
    };
    ComparedFiles {
        links: links.into_iter().filter_map(link).collect(),
        circumstances: report::where_and_when(&side.analysis),
    }
}

/// Address of a file as seen from the report in a folder; `None`: no relative one leads there.
fn way(output: &Path, file: &Path) -> Option<String> {
    let (output, file) = (output.canonicalize().ok()?, file.canonicalize().ok()?);
    let page = output.join("report");
    let common = page.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    // On another drive.
    if common == 0 {
        return None;
    }
    let up = page.components().skip(common).map(|_| "..".to_owned());
    let down =
        file.components().skip(common).map(|part| escaped(&part.as_os_str().to_string_lossy()));
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// A part of a path as an address has it.
fn escaped(part: &str) -> String {
    let mut out = String::new();
    for byte in part.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => {
                out.push(char::from(byte));
            }
            _ => {
                // A string takes everything.
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

/// A page of one campaign must not be replaced by one of several.
fn refuse_output(output: &Path) -> Result<(), WorkflowError> {
    if is_campaign(output) || output.join("analysis.json").exists() {
        return Err(WorkflowError::Usage(format!(
            "{} holds a campaign or its analysis, whose report would be overwritten; give the comparison another \
             folder with --output",
            output.shown()
        )));
    }
    Ok(())
}

fn refuse_twice(paths: &[PathBuf]) -> Result<(), WorkflowError> {
    let real = |path: &PathBuf| {
        let file = analysis_of(path);
        file.canonicalize().unwrap_or(file)
    };
    for (index, path) in paths.iter().enumerate() {
        if let Some(same) = paths.iter().take(index).find(|one| real(one) == real(path)) {
            let (one, other) = (same.shown(), path.shown());
            return Err(WorkflowError::Usage(format!(
                "{one} and {other} are the same: give two that differ"
            )));
        }
    }
    Ok(())
}

/// Path of the analysis behind a path.
fn analysis_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("analysis.json") } else { path.to_owned() }
}

/// The format's name alone.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    schema: Option<String>,
}

/// Reads a campaign's analysis and what its records say of the drones.
fn read(path: &Path, id: String) -> Result<(Side, InputFile), WorkflowError> {
    std::fs::metadata(path).map_err(|error| FileError::new("read", path, error))?;
    let file = analysis_of(path);
    if path.is_dir() && !file.exists() {
        return Err(WorkflowError::Nothing(format!(
            "{} has no analysis.json: run `updraft analyze` on it",
            path.shown()
        )));
    }
    let bytes = read_whole(&file, MOST_ANALYSIS_BYTES)?;
    let broken = |reason: String| CampaignError::Json { path: file.clone(), reason };
    let head: Head = parse::json(&bytes).map_err(|error| broken(error.to_string()))?;
    refuse_schema(&file, head.schema.as_deref())?;
    let analysis: Analysis = parse::json(&bytes).map_err(|error| broken(error.to_string()))?;
    let folder = if path.is_dir() { Some(path) } else { path.parent() };
    let facts = match folder.filter(|folder| is_campaign(folder)) {
        Some(folder) => facts(folder, &analysis)?,
        None => Vec::new(),
    };
    let shown = file.shown().to_string();
    let input = InputFile { path: shown, sha256: sha256(&bytes) };
    Ok((Side { id, path: path.shown().to_string(), analysis, facts }, input))
}

/// Refuses files of other kinds, and of a newer format, by its name.
fn refuse_schema(file: &Path, schema: Option<&str>) -> Result<(), WorkflowError> {
    let file = file.shown();
    let Some(schema) = schema.filter(|schema| *schema != ANALYSIS_SCHEMA) else {
        return match schema {
            Some(_) => Ok(()),
            None => Err(WorkflowError::Usage(format!("{file} is no analysis: it has no schema"))),
        };
    };
    let version = |schema: &str| {
        let (name, version) = schema.rsplit_once('/')?;
        Some((name.to_owned(), version.parse::<u32>().ok()?))
    };
    let plain = crate::base::plain::plain(schema);
    Err(WorkflowError::Usage(match (version(schema), version(ANALYSIS_SCHEMA)) {
        (Some((name, theirs)), Some((own, ours))) if name == own && theirs > ours => format!(
            "{file} was made by a newer updraft (\"{plain}\"; this one reads \"{ANALYSIS_SCHEMA}\"): use that one, or \
             analyse the campaign again"
        ),
        _ => format!("{file} is no analysis: its schema is \"{plain}\", not \"{ANALYSIS_SCHEMA}\""),
    }))
}

/// What the records of a campaign say of each analysed flight.
fn facts(folder: &Path, analysis: &Analysis) -> Result<Vec<FlightFacts>, WorkflowError> {
    let mut known: Vec<(String, FlightFolder)> = Vec::new();
    for flight in campaign::flights(folder)? {
        // A plan that is gone or broken takes nothing from the analysis.
        let name = flight.read_plan().map_or_else(|_| stem(&flight.0), |plan| plan.name);
        known.push((name, flight));
    }
    let of = |flight: &FlightAnalysis| {
        let is_it = |(name, at): &&(String, FlightFolder)| {
            *name == flight.name || stem(&at.0) == flight.name
        };
        known.iter().find(is_it).map_or_else(FlightFacts::default, |(_, at)| facts_of(flight, at))
    };
    Ok(analysis.flights.iter().map(of).collect())
}

fn facts_of(flight: &FlightAnalysis, folder: &FlightFolder) -> FlightFacts {
    let vehicle = folder.read_plan().ok().map(|plan| plan.vehicle);
    let is_simulated = flight.drones.iter().any(|drone| {
        let mut parts = Path::new(&drone.source).components();
        parts.any(|part| part == Component::Normal("simulated".as_ref()))
    });
    if is_simulated {
        let record = folder.logs_of(LogOrigin::Simulated).read_record().ok().flatten();
        return FlightFacts {
            vehicle,
            seed: record.map(|record| record.seed),
            ..FlightFacts::default()
        };
    }
    let mut airframes = BTreeMap::new();
    if let Ok(table) = FleetTable::read(&folder.0) {
        airframes.extend(table.drones.iter().map(|line| (line.slot, line.drone.to_string())));
    }
    if let Ok(Some(start)) = StartRecord::read(folder) {
        airframes.extend(start.drones.into_iter().map(|drone| (drone.slot, drone.drone)));
    }
    FlightFacts { airframes, vehicle, seed: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_from_the_page_to_a_campaign_beside_it() {
        let room = tempfile::tempdir().unwrap();
        let (output, campaign) = (room.path().join("week"), room.path().join("mon day#1"));
        std::fs::create_dir_all(&output).unwrap();
        std::fs::create_dir_all(&campaign).unwrap();
        let file = campaign.join("analysis.json");
        std::fs::write(&file, "{}").unwrap();
        assert_eq!(way(&output, &file).unwrap(), "../../mon%20day%231/analysis.json");
        assert_eq!(way(&output, &campaign.join("none")), None);
    }

    #[test]
    fn other_formats_are_refused_by_their_name() {
        let told = |schema: Option<&str>| {
            refuse_schema(Path::new("a.json"), schema).map_err(|error| error.to_string())
        };
        assert_eq!(told(Some(ANALYSIS_SCHEMA)), Ok(()));
        assert!(told(Some("updraft.analysis/2")).unwrap_err().contains("newer updraft"));
        assert!(told(Some("updraft.plan/1")).unwrap_err().contains("is no analysis"));
        assert!(told(None).unwrap_err().contains("no schema"));
    }
}
