//! Comparison of measurement and simulation: where they disagree, and which physics is missing.

mod choose;
mod compare;
pub(crate) mod logs;
pub(crate) mod next;
pub(crate) mod proof;
pub(crate) mod search;

use std::path::{Path, PathBuf};

use self::choose::{known_air, knows_air, measured, model_of, one_flight, unplanned};
use self::compare::{Both, compare};
use super::ending::Ending;
use super::error::WorkflowError;
use super::find::{Found, Work};
use super::host::Host;
use super::pages;
use super::provenance::provenance;
use crate::base::digest::sha256_of_files;
use crate::base::file::{create_folder, write_whole};
use crate::base::plain::Shown as _;
use crate::blind::record;
use crate::campaign::origin::LogOrigin;
use crate::campaign::to_json;
use crate::effects::select::resolved;
use crate::gap::left_out::said_together;
use crate::gap::{Explained, GapError, Options, Verdict};
use crate::report::{self, InputFile, Provenance};
use crate::vehicle::Vehicle;

/// Request for a comparison: measurement, simulation and model.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Path of a campaign folder with the measurement.
    pub campaign: Option<PathBuf>,
    /// Path of drones' logs instead of a campaign: a folder, or one log.
    pub measured: Option<PathBuf>,
    /// Path of a mapping file of tables instead of a campaign.
    pub tables: Option<PathBuf>,
    /// Path of logs of another simulation of the flight; `None`: the plan is simulated.
    pub simulated: Option<PathBuf>,
    /// Path of the plan that `measured` flew.
    pub plan: Option<PathBuf>,
    /// Name of the campaign's flight; `None`: its calibration.
    pub flight: Option<String>,
    /// Origin of the campaign's logs; `None`: real drones if there are any of their logs.
    pub origin: Option<LogOrigin>,
    /// Model to compare, a vehicle's name or file; `None`: the planned vehicle.
    pub vehicle: Option<String>,
    /// Folder of the results; `None`: `gap` in the campaign.
    pub output: Option<PathBuf>,
    /// Options of the search.
    pub options: Options,
}

/// A finished comparison.
pub struct Compared {
    /// Verdict on what the model lacks.
    pub verdict: Verdict,
    /// Path of the model with the effects that were found.
    pub model: PathBuf,
    /// Path of the report's page.
    pub page: PathBuf,
}

impl Compared {
    /// Ending of the comparison: with losses if logs could not be used.
    pub fn ending(&self) -> Ending {
        Ending::of_losses(!self.verdict.data.left_out.is_empty())
    }
}

/// Compares, and writes verdict, model and page.
///
/// # Errors
///
/// If there is nothing to compare, the model cannot be used, or the folder holds something else.
pub fn run(host: &dyn Host, request: &Request) -> Result<Compared, WorkflowError> {
    let (found, others) = measured(host, request)?;
    let other_flights = if request.flight.is_none() { names(&others) } else { Vec::new() };
    let vehicle = model_of(request, &found)?;
    // Before anything is flown: what is wrong with the model is the file's fault, not the flight's.
    resolved(&vehicle).map_err(|error| {
        let file = request.vehicle.as_ref().unwrap_or(&vehicle.name);
        WorkflowError::Usage(format!("the model {file} cannot be used: {error}"))
    })?;
    let folder = output(request)?;
    let simulated = request.simulated.as_deref().map(|path| one_flight(path, None)).transpose()?;
    let simulated = simulated.map(|(flight, _)| flight);
    let hover = request.campaign.as_ref().and_then(|_| known_air(others));
    if request.campaign.is_some() && hover.is_none() && knows_air(&found) {
        host.say(&format!(
            "the error of the map is not given: {} is the flight that is compared, and the \
             campaign has no other measurement flight whose true air is known",
            found.name
        ));
    }
    let both = Both { measured: &found, simulated: simulated.as_ref(), hover: hover.as_ref() };
    let mut explained = compare(&both, &vehicle, &request.options)
        .map_err(|error| with_flights(error, &found.name, &other_flights))?;
    explained.verdict.cautions.extend(unplanned(request, &found, &vehicle));
    host.check_stop()?;
    create_folder(&folder)?;
    let _lock = host.lock(&folder)?;
    let root = request.campaign.as_ref().or(request.measured.as_ref()).or(request.tables.as_ref());
    let root = root.cloned().unwrap_or_default();
    let settings = settings(request, &found, &vehicle);
    let work = Work { flights: vec![found], ..Work::new(&root) };
    let mut read = provenance(host, &work, settings);
    if let (Some(path), Some(simulated)) = (&request.simulated, simulated) {
        let others = Work { flights: vec![simulated], ..Work::new(path) };
        settings_of_simulated(&mut read, path, &others)?;
    }
    let provenance = Provenance {
        seed: Some(request.options.seed),
        links: pages::of_gap(&folder, request.campaign.as_deref()),
        ..read
    };
    explained.verdict.data.logs_sha256 = logs_sha256(&work)?;
    let page = write(&folder, &explained, &provenance)?;
    for reason in said_together(&explained.verdict.data.left_out) {
        host.warn(&reason);
    }
    Ok(Compared { verdict: explained.verdict, model: folder.join(MODEL), page })
}

/// Names of flights that have logs.
fn names(flights: &[Found]) -> Vec<String> {
    let usable = flights.iter().filter(|flight| !flight.logs.is_empty());
    usable.map(|flight| flight.name.clone()).collect()
}

/// An error of a flight without enough steady flight, with the others that nobody has asked for.
fn with_flights(error: WorkflowError, flight: &str, others: &[String]) -> WorkflowError {
    let is_of_flight = matches!(
        error,
        WorkflowError::Gap(GapError::NothingCommon | GapError::NothingMeasured { .. })
    );
    if !is_of_flight || others.is_empty() {
        return error;
    }
    let options: Vec<String> = others.iter().map(|name| format!("--flight {name}")).collect();
    WorkflowError::Nothing(format!(
        "{error}\nThat is the flight {flight}; to compare another one: {}",
        options.join(" or ")
    ))
}

/// SHA-256 of the logs that were compared, by which a verdict is known as theirs.
fn logs_sha256(work: &Work) -> Result<String, WorkflowError> {
    let logs = work.flights.iter().flat_map(|flight| &flight.logs);
    let hashes = logs.map(|log| work.hashes.sha256(&log.path)).collect::<Result<Vec<_>, _>>()?;
    Ok(sha256_of_files(hashes.iter().map(String::as_str)))
}

/// The folder of the results, if it may be written into.
fn output(request: &Request) -> Result<PathBuf, WorkflowError> {
    let folder = match (&request.output, &request.campaign) {
        (Some(folder), _) => folder.clone(),
        (None, Some(campaign)) => campaign.join("gap"),
        (None, None) => PathBuf::from("gap"),
    };
    if folder.exists() && !folder.is_dir() {
        return Err(WorkflowError::Failed(format!(
            "{} is a file: --output must name a folder",
            folder.shown()
        )));
    }
    let has_verdict = folder.join(VERDICT).exists();
    let is_opened = |game: &Path| record::path(game).exists();
    // The verdict of an opened game stays, also where its flight alone is compared.
    let beside = has_verdict && folder.parent().is_some_and(is_opened);
    let own = request.campaign.as_deref().is_some_and(is_opened)
        && (has_verdict || request.output.is_none());
    if beside || own {
        let is = if has_verdict { "is" } else { "was" };
        return Err(WorkflowError::Usage(format!(
            "{} {is} the verdict of a game whose seal was opened, and who knows the truth cannot be asked again; \
             to compare all the same, choose another folder with -o",
            folder.join(VERDICT).shown()
        )));
    }
    if request.output.is_some() {
        has_room(&folder)?;
    }
    Ok(folder)
}

/// File names in the folder of a comparison.
pub(crate) const VERDICT: &str = "verdict.json";
const MODEL: &str = "model.toml";

/// Refuses a named folder with files of somebody else's where this command's would go.
fn has_room(folder: &Path) -> Result<(), WorkflowError> {
    let page = Path::new("report").join(report::PAGE_FILE);
    let theirs = [Path::new(MODEL), &page].into_iter().find(|file| folder.join(file).exists());
    match theirs {
        Some(file) if !folder.join(VERDICT).exists() => Err(WorkflowError::Usage(format!(
            "{} exists and was not made by `updraft gap`; choose another folder with -o",
            folder.join(file).shown()
        ))),
        _ => Ok(()),
    }
}

/// What was chosen, for the page.
fn settings(request: &Request, found: &Found, vehicle: &Vehicle) -> Vec<(&'static str, String)> {
    let mut settings = vec![
        ("Flight", found.name.clone()),
        ("Model", format!("{}: {}", vehicle.name, vehicle.source)),
        ("Chance of a false name", format!("{} in each step (--alpha)", request.options.alpha)),
        (
            "Simulated flights for a threshold",
            format!("{} (--replicates)", request.options.replicates),
        ),
    ];
    if let Some(path) = &request.simulated {
        settings.push(("Simulated logs", path.shown().to_string()));
    }
    if let Some(seed) = found.seed {
        settings.push(("Seed of the flight", format!("{seed}: its logs are simulated")));
    }
    settings
}

/// The logs of another simulation with their hashes, for the page: their files beside the others', and the hash of all.
fn settings_of_simulated(
    page: &mut Provenance,
    path: &Path,
    work: &Work,
) -> Result<(), WorkflowError> {
    let logs = work.flights.iter().flat_map(|flight| &flight.logs);
    for log in logs {
        let sha256 = work.hashes.sha256(&log.path)?;
        page.inputs.push(InputFile { path: log.path.shown().to_string(), sha256 });
    }
    let hash = format!("{} (SHA-256 of the list of their hashes)", logs_sha256(work)?);
    page.settings.push((format!("Logs in {}", path.shown()), hash));
    Ok(())
}

/// Writes verdict, model and page; where the page is.
fn write(
    folder: &Path,
    explained: &Explained,
    provenance: &Provenance,
) -> Result<PathBuf, WorkflowError> {
    let json = to_json(&explained.verdict)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    let model = toml::to_string(&explained.model)
        .map_err(|error| WorkflowError::Failed(format!("failed to make the model: {error}")))?;
    write_whole(&folder.join(MODEL), model.as_bytes())?;
    let made = report::render_gap(&explained.verdict, provenance)?;
    let pages = folder.join("report");
    report::write(&made, &pages)?;
    proof::write(folder, &[(VERDICT, &json), (MODEL, model.as_bytes())])?;
    // Last: who finds a verdict finds the others as well.
    write_whole(&folder.join(VERDICT), &json)?;
    Ok(pages.join(report::PAGE_FILE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_flights_are_named_where_one_has_too_little_steady_flight() {
        let too_little = || WorkflowError::Gap(GapError::NothingCommon);
        let others = ["hover".to_owned(), "scan".to_owned()];
        let text = with_flights(too_little(), "legs", &others).to_string();
        assert!(text.starts_with(&too_little().to_string()), "{text}");
        assert!(
            text.ends_with("legs; to compare another one: --flight hover or --flight scan"),
            "{text}"
        );
        assert_eq!(with_flights(too_little(), "legs", &[]).to_string(), too_little().to_string());
        let other = WorkflowError::Interrupted;
        assert!(matches!(with_flights(other, "legs", &others), WorkflowError::Interrupted));
    }
}
