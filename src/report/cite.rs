//! The section to cite a measurement by: title, site, times, method, program, hashes of files.

use std::fmt::Write as _;

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::result::{Analysis, FlightAnalysis};
use crate::base::digest::sha256_of_list;

use super::opening::{When, day_and_time, named_site, when};
use super::page::capitalised;
use super::text::{clean, count};
use super::{InputFile, Provenance};

/// Inputs that are listed one by one; logs are told by their number and the hash of the list.
const LISTED: [&str; 5] =
    ["plan.json", "vehicle.toml", "campaign.json", "study.json", "manifest.json"];
/// Most of them.
const MOST_LISTED: usize = 12;

/// The section.
pub(super) fn citation(analysis: &Analysis, title: &str, provenance: &Provenance) -> Value {
    let simulated = analysis.flights.iter().any(|flight| flight.simulated);
    let flights: Vec<Value> = analysis.flights.iter().take(MOST_LISTED).map(flight_line).collect();
    let site = named_site(&analysis.flights);
    let is_listed = |input: &&InputFile| {
        LISTED.iter().any(|name| input.path == *name || input.path.ends_with(&format!("/{name}")))
    };
    let listed: Vec<Value> = provenance
        .inputs
        .iter()
        .filter(is_listed)
        .take(MOST_LISTED)
        .map(|input| context! { path => clean(&input.path), sha256 => clean(&input.sha256) })
        .collect();
    let day = analysis.flights.iter().find_map(|flight| {
        let when = when(flight)?;
        Some(day_and_time(when.unix_s(when.span_s[0])?).0)
    });
    let logs: usize = analysis.flights.iter().map(|flight| flight.logs).sum();
    let inputs = provenance.inputs.iter().map(|file| (file.path.as_str(), file.sha256.as_str()));
    context! {
        line => line(analysis, title, day.as_deref(), site.as_deref(), provenance),
        site,
        simulated,
        more_flights => analysis.flights.len().saturating_sub(MOST_LISTED),
        flights,
        logs => count(logs, "log"),
        files => count(provenance.inputs.len(), "file"),
        inputs_sha256 => (!provenance.inputs.is_empty()).then(|| sha256_of_list(inputs)),
        analysis_sha256 => provenance.analysis_sha256.as_deref().map(clean),
        listed,
    }
}

/// The measurement in one reference.
fn line(
    analysis: &Analysis,
    title: &str,
    day: Option<&str>,
    site: Option<&str>,
    provenance: &Provenance,
) -> String {
    let kind = if analysis.flights.iter().any(|flight| flight.simulated) {
        "simulated vertical air speed from rotor effort"
    } else {
        "vertical air speed from rotor effort"
    };
    let mut line = format!("{title}: {kind}");
    for part in [day, site].into_iter().flatten() {
        let _ = write!(line, ", {part}");
    }
    let program =
        if provenance.program.is_empty() { &analysis.made_by } else { &provenance.program };
    let _ = write!(line, ". Analysed with {}", clean(program));
    if let Some(hash) = &provenance.analysis_sha256 {
        let _ = write!(line, "; analysis.json, SHA-256 {}", clean(hash));
    }
    line.push('.');
    line
}

fn flight_line(flight: &FlightAnalysis) -> Value {
    context! {
        name => capitalised(&clean(&flight.name)),
        time => when(flight).and_then(When::utc),
        drones => count(flight.drones.len(), "drone"),
    }
}
