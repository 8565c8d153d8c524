//! Comparison of campaigns: their analyses and records are read, compared and written.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

use super::analysis_file::{AnalysisFile, analysis_of};
use super::ending::Ending;
use super::error::WorkflowError;
use super::find::{labels, stem};
use super::host::Host;
use super::made_by;
use crate::analysis::result::{Analysis, FlightAnalysis};
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;
use crate::campaign::origin::LogOrigin;
use crate::campaign::start::StartRecord;
use crate::campaign::{self, FlightFolder, is_campaign, to_json};
use crate::compare::result::Comparison;
use crate::compare::{FlightFacts, LawChoice, Side, compare};
use crate::fleet::slots::FleetTable;
use crate::report::{self, ComparedFiles, InputFile, PageLink, Provenance};

/// File of the numbers, in the folder of a comparison.
pub const RESULT_FILE: &str = "compare.json";

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
pub(super) fn refuse_output(output: &Path) -> Result<(), WorkflowError> {
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

/// Reads a campaign's analysis and what its records say of the drones.
fn read(path: &Path, id: String) -> Result<(Side, InputFile), WorkflowError> {
    let AnalysisFile { path: file, sha256, analysis } = AnalysisFile::read(path)?;
    let folder = if path.is_dir() { Some(path) } else { path.parent() };
    let facts = match folder.filter(|folder| is_campaign(folder)) {
        Some(folder) => facts(folder, &analysis)?,
        None => Vec::new(),
    };
    let input = InputFile { path: file.shown().to_string(), sha256 };
    Ok((Side { id, path: path.shown().to_string(), analysis, facts }, input))
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
}
