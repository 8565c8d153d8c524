//! Analysis of logs: laws, a map of the air, and a report.
//!
//! [`gather()`] finds what is to be analysed, [`Analysing`] does it step by step, [`Analysed`] is what
//! came of it; [`analyze_campaign`] is all of it for one campaign.

pub mod each;
mod fields;
mod gather;
mod held;
mod outcome;
mod settings;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use self::fields::{read_study, write_fields};
pub use self::gather::{Request, gather, load_plan};
pub(super) use self::held::doubts_of_held;
pub use self::settings::{Files, Settings, Uncorrected};
use super::ending::Ending;
use super::error::WorkflowError;
use super::find::{Found, Work, find, lean_tables};
use super::hashes::Hashes;
use super::host::Host;
use super::pages;
use super::paper::{PaperFigures, Shown};
use super::provenance::provenance;
use crate::analysis::battery::Sag;
use crate::analysis::combine;
use crate::analysis::lean_table::LeanTable;
use crate::analysis::result::{Analysis, FlightAnalysis, LawsFrom, Yield};
use crate::analysis::{AnalysisOptions, FlightInput, Warning, analyze};
use crate::base::file::{FileError, write_with};
use crate::base::json::write_json;
use crate::base::plain::Shown as _;
use crate::campaign;
use crate::campaign::origin::LogOrigin;
use crate::flight::Indicator;
use crate::mission::plan::Purpose;
use crate::report::{self, Basemap, Beside, Provenance};

/// Analyses the simulated logs of a campaign, and writes numbers and report into its folder.
///
/// # Errors
/// When the campaign cannot be read or written, nothing can be analysed, or the work is stopped.
pub fn analyze_campaign(
    host: &dyn Host,
    root: &Path,
    settings: &Settings,
) -> Result<Analysed, WorkflowError> {
    let work = simulated(root)?;
    let analysed = Analysing::begin(host, &work, settings, None)?.run(true)?;
    analysed.write(host, root)?;
    Ok(analysed)
}

/// The simulated flights of a campaign.
pub(crate) fn simulated(root: &Path) -> Result<Work, WorkflowError> {
    let mut work = Work::new(root);
    work.origin = Some(LogOrigin::Simulated);
    find(root, None, &mut work)?;
    Ok(work)
}

/// An analysis with its input and settings, before it is made.
pub struct Analysing<'a> {
    host: &'a dyn Host,
    work: &'a Work,
    settings: &'a Settings,
    /// The calibration whose A and u0 are held, and where it is from.
    reference: Option<(FlightAnalysis, LawsFrom)>,
    doubts: Option<String>,
}

/// Doubts about the files, whose names count from the campaign: the page may be read elsewhere.
fn file_doubts(work: &Work) -> impl Iterator<Item = String> {
    let before = format!("{}/", work.root.shown());
    let notes = work.flights.iter().flat_map(|flight| &flight.notes);
    notes.map(move |note| note.replace(before.as_str(), ""))
}

impl<'a> Analysing<'a> {
    /// Prepares an analysis and reports to the host which logs are taken, with their doubts. `hold`
    /// is the analysis.json whose A and u0 are held.
    ///
    /// # Errors
    ///
    /// If `hold` has no calibration.
    pub fn begin(
        host: &'a dyn Host,
        work: &'a Work,
        settings: &'a Settings,
        hold: Option<&Path>,
    ) -> Result<Self, WorkflowError> {
        for used in &work.used {
            host.say(used);
        }
        let indicator = settings.options.indicator;
        let reference = hold.map(|path| held::read(path, indicator)).transpose()?;
        for note in work.flights.iter().flat_map(|flight| &flight.notes) {
            host.warn(note);
        }
        let doubts = hold
            .zip(reference.as_ref())
            .and_then(|(path, (reference, _))| doubts_of_held(path, reference, indicator, work));
        let doubts = if hold.is_some() { doubts } else { held::doubts_of_another_campaign(work) };
        Ok(Self { host, work, settings, reference, doubts })
    }

    /// Reason to doubt the laws that are held, if there is one.
    pub fn doubts(&self) -> Option<&str> {
        self.doubts.as_deref()
    }

    /// Runs the analysis. With `provenance` the input is hashed, for [`Analysed::write`].
    ///
    /// # Errors
    ///
    /// If nothing can be analysed, or the work is stopped.
    pub fn run(self, provenance: bool) -> Result<Analysed, WorkflowError> {
        let Self { host, work, settings, reference, doubts } = self;
        let (reference, laws_from) = reference.unzip();
        let tables = lean_tables(work, settings.options.indicator);
        let mut inputs = inputs(work, &tables, settings.without);
        if reference.is_some() {
            drop_unflown_calibrations(&mut inputs);
        }
        let wanted = inputs.len();
        let logs: usize = inputs.iter().map(|input| input.logs.len()).sum();
        let progress = host.progress("analysing", logs as u64);
        // Hashing fills the pauses in which the analysis keeps one processor busy.
        let (analysis, provenance) = rayon::join(
            || {
                analyze(&work.title, &inputs, &settings.options, reference.as_ref(), &|_, _| {
                    progress.advance();
                })
            },
            || provenance.then(|| self::provenance(host, work, settings.words())),
        );
        let mut analysis = analysis.map_err(|error| WorkflowError::Nothing(error.to_string()))?;
        outcome::refuse_level(&analysis)?;
        outcome::refuse_depth(&analysis, settings.options.mixed_layer_depth_m)?;
        if settings.combine {
            analysis = with_others(host, work, settings, reference.as_ref(), analysis);
        }
        progress.finish();
        analysis.laws_from = laws_from;
        analysis.warnings.extend(work.absent.iter().cloned().map(Warning::Failed));
        analysis
            .warnings
            .extend(doubts.into_iter().chain(file_doubts(work)).map(Warning::WhoseLogs));
        host.check_stop()?;
        let some_absent = !work.absent.is_empty() || analysis.flights.len() < wanted;
        Ok(Analysed {
            analysis,
            logs,
            provenance,
            root: work.root.clone(),
            some_absent,
            basemap: None,
            files: settings.files.clone(),
        })
    }
}

/// Leaves out calibrations that were not flown: with laws of an earlier one, nobody misses them.
fn drop_unflown_calibrations(inputs: &mut Vec<FlightInput<'_>>) {
    let is_unflown = |input: &FlightInput<'_>| {
        input.purpose == Some(Purpose::Calibration) && input.logs.is_empty()
    };
    if !inputs.iter().all(is_unflown) {
        inputs.retain(|input| !is_unflown(input));
    }
}

/// An analysis with the maps of all indicators together; an indicator that the logs lack is told.
fn with_others(
    host: &dyn Host,
    work: &Work,
    settings: &Settings,
    reference: Option<&FlightAnalysis>,
    analysis: Analysis,
) -> Analysis {
    let mut all = vec![analysis];
    for indicator in [Indicator::RotorSpeed, Indicator::Power] {
        let tables = lean_tables(work, indicator);
        let inputs = inputs(work, &tables, settings.without);
        let options = AnalysisOptions { indicator, ..settings.options.clone() };
        // Laws that are held are of one indicator.
        let reference = reference.filter(|held| held.indicator == indicator);
        match analyze(&work.title, &inputs, &options, reference, &|_, _| {}) {
            Ok(other) => all.push(other),
            Err(error) => {
                host.warn(&format!("the map is made without {}: {error}", indicator.words()));
            }
        }
    }
    combine::add(&mut all);
    all.swap_remove(0)
}

/// What the analysis gets of each flight.
fn inputs<'a>(
    work: &'a Work,
    tables: &'a [Option<LeanTable>],
    without: Uncorrected,
) -> Vec<FlightInput<'a>> {
    let input = |(flight, table): (&'a Found, &'a Option<LeanTable>)| {
        input(work, flight, table.as_ref(), without)
    };
    work.flights.iter().zip(tables).map(input).collect()
}

fn input<'a>(
    work: &'a Work,
    flight: &'a Found,
    table: Option<&'a LeanTable>,
    without: Uncorrected,
) -> FlightInput<'a> {
    FlightInput {
        name: &flight.name,
        plan: flight.plan.as_ref(),
        purpose: flight.purpose,
        logs: &flight.logs,
        start: flight.start,
        simulated: flight.simulated,
        true_updraft_mps: flight.true_updraft_mps,
        truth: (!flight.truth.is_empty()).then_some(&flight.truth),
        density: flight.density.filter(|_| !without.density),
        leaning: flight.leaning.filter(|_| !without.wind),
        thrust_exponent: flight.thrust_exponent,
        sag: flight.sag.map(|sag| if without.battery { Sag::UNCORRECTED } else { sag }),
        true_air: flight.true_air.as_ref(),
        calibrated_in_other_air: calibrated_in_other_air(work, flight),
        wind_forms: flight.wind_forms.as_ref().filter(|_| !without.wind),
        lean_table: table.filter(|_| !without.wind),
        level: flight.level.as_ref(),
        folder: Some(&work.root),
        campaign: flight.campaign,
    }
}

/// Whether a calibration of the same campaign was simulated in air of other scales.
fn calibrated_in_other_air(work: &Work, flight: &Found) -> bool {
    let is_its_calibration = |other: &&Found| {
        other.campaign == flight.campaign && other.purpose == Some(Purpose::Calibration)
    };
    let mut calibrations = work.flights.iter().filter(is_its_calibration);
    // Of a flight that was not simulated here nothing is known.
    calibrations.any(|other| other.seed.is_some() && other.true_air != flight.true_air)
}

/// One flight as the analysis takes it, with all corrections.
pub fn one_input<'a>(work: &'a Work, flight: &'a Found) -> FlightInput<'a> {
    input(work, flight, None, Uncorrected::default())
}

/// A finished analysis.
pub struct Analysed {
    /// Results of the analysis.
    pub analysis: Analysis,
    /// Number of logs that were examined.
    pub logs: usize,
    provenance: Option<Provenance>,
    root: PathBuf,
    /// Flights that were found gave nothing at all.
    some_absent: bool,
    /// Picture of the ground below the report's maps.
    basemap: Option<Basemap>,
    /// Files for other programs.
    files: Files,
}

impl Analysed {
    /// Puts a picture of the ground below the report's maps.
    #[must_use]
    pub fn on(self, basemap: Option<Basemap>) -> Self {
        Self { basemap, ..self }
    }

    /// Writes numbers and report into a folder. Returns the path of the page; `None` if the page
    /// says that nothing was found, or is not written because an earlier one says more.
    ///
    /// # Errors
    ///
    /// If they cannot be made or written.
    pub fn write(&self, host: &dyn Host, folder: &Path) -> Result<Option<PathBuf>, WorkflowError> {
        if self.is_nothing() && holds_results(folder) {
            host.warn(&format!(
                "{} is that of an earlier analysis, which had results: it and its report are left as they are",
                numbers_path(folder).shown()
            ));
            return Ok(None);
        }
        let study = read_study(host, &self.root);
        let report_folder = folder.join("report");
        // Nothing is written where something else would have to be left out later.
        let inside = [report_folder.clone(), report_folder.join(report::FIGURES_FOLDER)];
        let fields = campaign::fields_csv(folder).parent().map(Path::to_owned);
        if let Some(file) =
            inside.into_iter().chain(fields).find(|one| one.exists() && !one.is_dir())
        {
            let is_file = std::io::Error::from(std::io::ErrorKind::NotADirectory);
            return Err(FileError::new("write into", &file, is_file).into());
        }
        // The page tells the hash of the numbers, which are written while its figures are drawn; the tables are written beside it.
        let beside = Beside { study: study.as_ref(), basemap: self.basemap.as_ref() };
        let (hash, drawn) = rayon::join(
            || {
                let numbers = write_numbers(&self.analysis, folder)?;
                Ok::<_, WorkflowError>(Hashes::default().sha256(&numbers)?)
            },
            || report::draw(&self.analysis, beside),
        );
        let provenance = Provenance {
            analysis_sha256: Some(hash?),
            links: pages::of_report(&self.root, folder, &self.analysis),
            ..self.provenance.clone().unwrap_or_default()
        };
        let (page_made, fields_made) = rayon::join(
            || {
                let made = drawn.page(&self.analysis, &provenance)?;
                let mut names = self.write_turbulence(folder, &report_folder, &provenance)?;
                names.extend(made.figures.iter().map(|(name, _)| name.clone()));
                report::write(&made, &report_folder)?;
                report::remove_other_figures(&report_folder, &names);
                Ok::<_, WorkflowError>(())
            },
            || write_fields(host, (&self.analysis, &provenance), folder, &self.files),
        );
        page_made.and(fields_made)?;
        // A page that says that nothing was found is written, but there is nothing to point at.
        Ok((!self.is_nothing()).then(|| report_folder.join(report::PAGE_FILE)))
    }

    /// Writes the page of turbulence, or removes that of an earlier analysis; names of its figures.
    fn write_turbulence(
        &self,
        folder: &Path,
        report_folder: &Path,
        provenance: &Provenance,
    ) -> Result<BTreeSet<String>, WorkflowError> {
        let links = pages::of_turbulence(folder, &self.analysis);
        let provenance = Provenance { links, ..provenance.clone() };
        let Some(made) = report::render_turbulence(&self.analysis, &provenance)? else {
            // Nothing to remove is the usual case.
            let _ = std::fs::remove_file(report_folder.join(report::TURBULENCE_PAGE));
            return Ok(BTreeSet::new());
        };
        report::write_named(&made, report_folder, report::TURBULENCE_PAGE)?;
        Ok(made.figures.into_iter().map(|(name, _)| name).collect())
    }

    /// Writes the figures of the report as papers print them.
    ///
    /// # Errors
    ///
    /// If they cannot be made or written.
    pub fn print(&self, host: &dyn Host, paper: &PaperFigures) -> Result<(), WorkflowError> {
        let study = read_study(host, &self.root);
        let beside = Beside { study: study.as_ref(), basemap: self.basemap.as_ref() };
        paper.write(host, Shown::Analysis(&self.analysis, beside))
    }

    /// Whether the analysis has neither a law nor a value of the map.
    pub fn is_nothing(&self) -> bool {
        self.analysis.what_was_found() == Yield::Nothing
    }

    /// Number of logs that gave a drone's results.
    pub fn used(&self) -> usize {
        self.analysis.flights.iter().map(|flight| flight.drones.len()).sum()
    }

    /// Losses of the analysis, one line each.
    pub fn problems(&self) -> Vec<String> {
        outcome::problems(&self.analysis, false)
    }

    /// Ending of the analysis.
    ///
    /// # Errors
    ///
    /// If nothing was found; with `reasons`, the error says why.
    pub fn ending(&self, reasons: bool) -> Result<Ending, WorkflowError> {
        let lossy = |flight: &FlightAnalysis| {
            let is_whole = flight.missing.is_empty()
                && flight.unused.is_empty()
                && flight.partly_used.is_empty();
            !is_whole
        };
        let lost =
            self.used() < self.logs || self.some_absent || self.analysis.flights.iter().any(lossy);
        match self.analysis.what_was_found() {
            Yield::Nothing => Err(outcome::nothing_found(&self.analysis, reasons)),
            Yield::Whole if !lost => Ok(Ending::Done),
            Yield::Whole | Yield::Partial => Ok(Ending::Losses),
        }
    }
}

/// File of all numbers.
fn numbers_path(folder: &Path) -> PathBuf {
    folder.join("analysis.json")
}

/// Whether a folder holds an analysis with a law or a value of the air.
fn holds_results(folder: &Path) -> bool {
    let earlier = campaign::read_json::<Analysis>(&numbers_path(folder));
    earlier.is_ok_and(|earlier| earlier.what_was_found() != Yield::Nothing)
}

/// All numbers; the path of their file.
fn write_numbers(analysis: &Analysis, folder: &Path) -> Result<PathBuf, WorkflowError> {
    let path = numbers_path(folder);
    // Streamed: that of a thousand drones has a hundred megabytes.
    write_with(&path, |out| write_json(out, analysis))?;
    Ok(path)
}
