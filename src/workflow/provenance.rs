//! Provenance of a report: program, command, settings, and every file that was read with its hash.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::find::Work;
use super::host::Host;
use super::made_by;
use crate::base::plain::Shown as _;
use crate::campaign::origin::LogOrigin;
use crate::campaign::{self, FlightFolder};
use crate::report::{InputFile, Provenance};

/// The provenance of an analysis.
pub(crate) fn provenance(
    host: &dyn Host,
    work: &Work,
    settings: Vec<(&'static str, String)>,
) -> Provenance {
    let mut paths = plans(&work.root, work.origin.unwrap_or(LogOrigin::Real));
    paths.extend(work.flights.iter().flat_map(|flight| &flight.logs).map(|log| log.path.clone()));
    let mut inputs: Vec<InputFile> = paths
        .par_iter()
        .map(|path| {
            // A log that cannot be read is already named as missing by the analysis.
            let sha256 = work.hashes.sha256(path);
            let sha256 = sha256.unwrap_or_else(|error| format!("not read: {error}"));
            let shown = path.strip_prefix(&work.root).unwrap_or(path);
            InputFile { path: shown.shown().to_string(), sha256 }
        })
        .collect();
    inputs.extend(air_files(&work.root, work.origin.unwrap_or(LogOrigin::Real)));
    Provenance {
        program: made_by(),
        command: host.command(),
        seed: work.flights.iter().find_map(|flight| flight.seed),
        settings: settings.into_iter().map(|(what, how)| (what.to_owned(), how)).collect(),
        inputs,
        ..Provenance::default()
    }
}

/// Files that the air of simulated flights was read from, with the hashes that they had then: they may be large, and
/// elsewhere.
fn air_files(root: &Path, origin: LogOrigin) -> Vec<InputFile> {
    if !campaign::is_campaign(root) {
        return Vec::new();
    }
    let mut files: Vec<InputFile> = Vec::new();
    for flight in campaign::flights(root).unwrap_or_default() {
        let Ok(Some(record)) = flight.logs_of(origin).read_record() else { continue };
        for air in record.air_files {
            let file = InputFile { path: air.file, sha256: air.sha256 };
            if files.iter().all(|there| there.path != file.path || there.sha256 != file.sha256) {
                files.push(file);
            }
        }
    }
    files
}

/// What a campaign knows about its flights: plans, vehicles, flight records, and a study.
fn plans(root: &Path, origin: LogOrigin) -> Vec<PathBuf> {
    if !campaign::is_campaign(root) {
        return Vec::new();
    }
    let flights = campaign::flights(root).unwrap_or_default();
    let of =
        |flight: &FlightFolder| [flight.plan(), flight.vehicle(), flight.logs_of(origin).record()];
    let mut paths = vec![campaign::index_path(root)];
    paths.extend(flights.iter().flat_map(of));
    paths.push(campaign::study_result(root));
    paths.retain(|path| path.is_file());
    paths
}
