//! One flight of a fleet, and a campaign, from logs to results.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use thiserror::Error;

use super::account::{self, Account};
use super::aware::{ASKED_FOR, Aware, Measured};
use super::calibrate::{self, PaperTable};
use super::caution::{PLAIN_CAUTION, SCAN_CAUTION, fit_cautions, tilt_caution, wind_caution};
use super::caution_battery::battery_caution;
use super::corrections::Corrections;
use super::drone::{FLOCK, One, Shared, one, same_drone};
use super::input::{FlightInput, LogInput, TruthSeries};
use super::ladder::{is_ladder, mark_partial, no_ladder, rungs};
use super::law::{LINEAR, SIGNED_QUADRATIC};
use super::options::{AnalysisOptions, MapLaw};
use super::prefer::{better_law, chosen, describes, vertex_mps};
use super::refer::refer_calibration;
use super::result::{
    ANALYSIS_SCHEMA, Analysis, DroneAnalysis, DroneUpdraft, ErrorBudget, FlightAnalysis, Laws,
    TableRow, Unmeasured, UnusedLog, UpdraftMap, WindCorrection,
};
use super::slots::{SlotMatch, match_slots};
use super::starts;
use super::statistics::of_map;
use super::statistics::result::FieldStatistics;
use super::statistics::tilt_wind::LeanDrag;
use super::track;
use super::truth;
use super::updraft::{self, DroneSeries};
use crate::flight::Indicator;
use crate::mission::plan::Purpose;

/// Told after each log: (logs done, logs in all).
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// A flight cannot be analysed at all.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// There are no logs.
    #[error(
        "{name}: no logs to analyse (put the drones' .BIN files into the flight's logs folder)"
    )]
    NoLogs {
        /// The flight.
        name: String,
    },
    /// None of the logs could be used.
    #[error("{name}: none of the {count} log(s) can be used:{}", listed(reasons))]
    NothingUsable {
        /// The flight.
        name: String,
        /// Logs given.
        count: usize,
        /// Why not, one sentence for each.
        reasons: Vec<String>,
    },
    /// None of several flights can be analysed.
    #[error("{}", failures.iter().map(Self::to_string).collect::<Vec<_>>().join("\n"))]
    Every {
        /// Why not, one for each.
        failures: Vec<AnalysisError>,
    },
    /// The campaign has no flights.
    #[error("there is no flight to analyse")]
    NoFlights,
}

/// Analyses a campaign: calibrations first, and measurements with the laws of the first calibration
/// (or of `reference`).
pub fn analyze(
    title: &str,
    inputs: &[FlightInput<'_>],
    options: &AnalysisOptions,
    reference: Option<&FlightAnalysis>,
    progress: Progress<'_>,
) -> Result<Analysis, AnalysisError> {
    if inputs.is_empty() {
        return Err(AnalysisError::NoFlights);
    }
    let purpose = |input: &FlightInput<'_>| input.purpose.or(input.plan.map(|plan| plan.purpose));
    let mut order: Vec<&FlightInput<'_>> = inputs.iter().collect();
    order.sort_by_key(|input| match purpose(input) {
        Some(Purpose::Calibration) => 0,
        None => 1,
        Some(Purpose::Measurement) => 2,
    });
    let total: usize = inputs.iter().map(|input| input.logs.len()).sum();
    let mut before = 0;
    let mut flights: Vec<FlightAnalysis> = Vec::new();
    let mut warnings = Vec::new();
    let mut failures = Vec::new();
    // Flights without a plan that turned out to measure, before a calibration was found.
    let mut early: Vec<(usize, &FlightInput<'_>)> = Vec::new();
    for input in order {
        let laws = reference.or(calibration_of(&flights));
        let report = |done: usize, _: usize| progress(before + done, total);
        match analyze_flight(input, options, laws, &report) {
            Ok(flight) => {
                let measured = flight.purpose == Purpose::Measurement;
                if laws.is_none() && measured && purpose(input).is_none() {
                    early.push((flights.len(), input));
                }
                flights.push(flight);
            }
            Err(error) => {
                // One warning for each line: what is told and, below it, of which log.
                warnings.extend(error.to_string().lines().map(|line| line.trim().to_owned()));
                failures.push(error);
            }
        }
        before += input.logs.len();
    }
    if let Some(laws) = calibration_of(&flights).cloned() {
        for (index, input) in early {
            // They could be analysed without laws: with them they can be as well.
            if let Ok(flight) = analyze_flight(input, options, Some(&laws), &|_, _| {}) {
                flights[index] = flight;
            }
        }
        flights.sort_by_key(|flight| flight.purpose == Purpose::Measurement);
    }
    if flights.is_empty() {
        return Err(match failures.pop() {
            Some(only) if failures.is_empty() => only,
            Some(last) => {
                failures.push(last);
                AnalysisError::Every { failures }
            }
            None => AnalysisError::NoFlights,
        });
    }
    Ok(Analysis {
        schema: ANALYSIS_SCHEMA.to_owned(),
        made_by: concat!("updraft ", env!("CARGO_PKG_VERSION")).to_owned(),
        title: title.to_owned(),
        flights,
        warnings,
    })
}

/// The first flight that gave laws for others.
fn calibration_of(flights: &[FlightAnalysis]) -> Option<&FlightAnalysis> {
    flights.iter().find(|flight| flight.purpose == Purpose::Calibration && flight.flock.is_some())
}

/// Reasons one below the other; the first ones of many.
fn listed(reasons: &[String]) -> String {
    let mut text = String::new();
    for reason in reasons.iter().take(LISTED) {
        text.push_str("\n  ");
        text.push_str(reason);
    }
    if reasons.len() > LISTED {
        text.push_str("\n  and more");
    }
    text
}

/// Analyses one flight of a fleet. A log that cannot be used is listed with its reason
/// ([`FlightAnalysis::unused`]) and does not stop the others.
///
/// `reference` is a calibration whose laws measure the air and hold A and u0 (unless
/// `FitOptions::hold` gives them): each drone's own laws, else its flock mapping.
pub fn analyze_flight(
    input: &FlightInput<'_>,
    options: &AnalysisOptions,
    reference: Option<&FlightAnalysis>,
    progress: Progress<'_>,
) -> Result<FlightAnalysis, AnalysisError> {
    if input.logs.is_empty() {
        return Err(AnalysisError::NoLogs { name: input.name.to_owned() });
    }
    let options = &options.of_flight(input);
    let input = &input.for_indicator(options.indicator);
    let (slots, warnings) = match_slots(input);
    let planned_purpose = input.purpose.or(input.plan.map(|plan| plan.purpose));
    let referred = reference
        .filter(|_| input.density.is_some() || input.leaning.is_some())
        .map(|found| refer_calibration(input.density, input.leaning, found, &options.fit));
    let map_reference = referred.as_ref().or(reference);
    let corrections = Corrections {
        density: input.density,
        leaning: input.leaning,
        lean_table: input.lean_table,
        has_battery: input.sag.is_some(),
        unknown_share: 0.0,
    };
    let aware = reference
        .filter(|_| options.air_aware && planned_purpose != Some(Purpose::Calibration))
        .and_then(|found| Aware::new(found, corrections, input.sag, options.map_law));
    let map_law = options
        .map_law
        .or_else(|| aware.as_ref().map(Aware::law))
        .or_else(|| map_reference.map(better_law));
    let shared =
        Shared { input, options, reference, map_reference, planned_purpose, map_law, aware };

    let done = AtomicUsize::new(0);
    let work: Vec<(&LogInput, &SlotMatch)> = input.logs.iter().zip(&slots).collect();
    let outcomes: Vec<Result<One, String>> = work
        .par_iter()
        .map(|(log, slot)| {
            let outcome = match slot {
                SlotMatch::Refused { reason, .. } => Err(reason.clone()),
                SlotMatch::Slot(number) => one(&shared, log, Some(*number)),
                SlotMatch::Unplanned => one(&shared, log, None),
            };
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, input.logs.len());
            outcome
        })
        .collect();

    let outcomes = work.iter().zip(outcomes).map(|((log, slot), outcome)| (*log, *slot, outcome));
    let mut account = Account::of(input, outcomes);
    if account.ones.is_empty() {
        return Err(AnalysisError::NothingUsable {
            name: input.name.to_owned(),
            count: input.logs.len(),
            reasons: account.unused.iter().map(UnusedLog::sentence).collect(),
        });
    }
    if input.plan.is_some() {
        account.ones.sort_by_key(|one| one.drone.slot);
    }
    Ok(finish(&shared, account, warnings))
}

/// Unusable logs named in an error.
const LISTED: usize = 20;

/// Joins the drones' results: purpose, laws, flock, tables, map, missing.
fn finish(shared: &Shared<'_>, account: Account, mut warnings: Vec<String>) -> FlightAnalysis {
    let Shared { input, options, .. } = shared;
    let Account { ones, unused, partly_used } = account;
    let with_laws = ones.iter().filter(|one| one.calibration.is_ok());
    let climbed: Vec<(usize, usize)> =
        with_laws.map(|one| rungs(&one.drone, &options.fit)).collect();
    let purpose = shared.planned_purpose.unwrap_or(if climbed.iter().copied().any(is_ladder) {
        Purpose::Calibration
    } else {
        Purpose::Measurement
    });
    let mut drones = Vec::new();
    let (mut updrafts, mut seen) = (Vec::new(), Vec::new());
    let mut unmeasured = Vec::new();
    // Without a plan logs may be of any day.
    let apart = if input.plan.is_some() { starts::apart(&ones) } else { vec![None; ones.len()] };
    for (One { mut drone, calibration, updraft, hover, truth, .. }, later_s) in
        ones.into_iter().zip(apart)
    {
        let (slot, name) = (drone.slot, drone.name.clone());
        let updraft = match later_s {
            Some(later_s) => updraft.map(|_| Err(starts::not_in_map(later_s))),
            None => updraft,
        };
        if let (Purpose::Calibration, Some(later_s)) = (purpose, later_s) {
            warnings.push(starts::in_calibration(&name, later_s));
        }
        let nothing = |reason| Unmeasured { slot, name: name.clone(), reason };
        match (purpose, calibration, updraft) {
            (Purpose::Calibration, Ok(laws), _) => drone.laws = Some(laws),
            (Purpose::Calibration, Err(error), _) => unmeasured.push(nothing(error.to_string())),
            (Purpose::Measurement, _, Some(Ok((series, mapping)))) => {
                drone
                    .warnings
                    .extend(partial_law(shared, slot, &name).filter(|_| mapping == FLOCK));
                seen.push(hover);
                updrafts.push((slot, name.clone(), drone.home_m, series, mapping, truth));
            }
            (Purpose::Measurement, _, Some(Err(reason))) => unmeasured.push(nothing(reason)),
            (Purpose::Measurement, _, None) => {}
        }
        drones.push(drone);
    }
    let mut flock = None;
    let mut table = Vec::new();
    let mut paper = None;
    if purpose == Purpose::Calibration {
        warnings.extend(mark_partial(&mut drones, &options.fit));
        match calibrate::flock(&drones, &options.fit) {
            Ok(laws) => flock = Some(laws),
            Err(error) => warnings.push(format!("flock mapping: {error}")),
        }
        paper = paper_table(shared, &drones);
        table = calibrate::table(&drones, paper, &options.fit);
        if let Some(laws) = &flock {
            let vertex = vertex_mps(laws, &drones, input.true_updraft_mps).is_some();
            compare_what_fits(&mut table, laws, vertex);
        }
        warnings.extend(fit_cautions(
            flock.as_ref(),
            &drones,
            input.leaning,
            input.true_updraft_mps,
        ));
        warnings.extend(tilt_caution(&drones, options));
    } else if shared.reference.is_none() {
        warnings.push(
            "no calibration was given: the air cannot be measured without laws. Analyse the \
             calibration flight together with this one (updraft analyze CALIBRATION HOVER), or take \
             the laws of an analysis of these drones (--hold analysis.json). Until then there are \
             only the flight's windows and its traces"
                .to_owned(),
        );
        let most = climbed.iter().copied().max_by_key(|(up, down)| up + down);
        warnings.extend(most.filter(|_| shared.planned_purpose.is_none()).map(no_ladder));
    }
    let map = (!updrafts.is_empty()).then(|| map(updrafts, shared));
    warnings.extend(map.as_ref().and_then(wind_caution));
    let calibration = shared.aware.as_ref().zip(shared.reference).map(|(_, found)| found);
    let battery = calibration.zip(map.as_ref()).filter(|_| input.sag.is_some());
    warnings.extend(battery.and_then(|(found, map)| battery_caution(map, found)));
    if map.is_some() && shared.aware.is_none() {
        warnings.push(PLAIN_CAUTION.to_owned());
    }
    let moved = map.as_ref().is_some_and(UpdraftMap::is_scan);
    if moved {
        warnings.push(SCAN_CAUTION.to_owned());
    }
    let drag = match (input.leaning, input.lean_table) {
        (Some(leaning), _) => LeanDrag::Faces(leaning.drag_speed_mps),
        (None, Some(table)) => LeanDrag::Table(table),
        (None, None) => LeanDrag::Unknown,
    };
    let statistics = map.as_ref().filter(|_| !moved).map(|map| FieldStatistics {
        true_air: input.true_air.cloned(),
        ..of_map(map, &seen, &options.statistics, drag)
    });
    FlightAnalysis {
        name: input.name.to_owned(),
        purpose,
        indicator: options.indicator,
        planned: input.plan.is_some(),
        orientation_deg: input.plan.map(|plan| plan.site.orientation_deg),
        true_updraft_mps: input.true_updraft_mps,
        logs: input.logs.len(),
        missing: account::missing(input, &drones, &unused),
        drones,
        flock,
        table,
        map,
        statistics,
        unmeasured,
        paper_table: paper.map(|paper| paper.number().to_owned()),
        warnings,
        unused,
        partly_used,
    }
}

/// The table of the paper to compare a calibration with. Table II is one of a fleet in the field: a
/// single log is none.
fn paper_table(shared: &Shared<'_>, drones: &[DroneAnalysis]) -> Option<PaperTable> {
    let counted = |drone: &&DroneAnalysis| drone.laws.is_some() && drone.partial_ladder.is_none();
    let is_fleet = drones.iter().filter(counted).count() > 1;
    // The paper's numbers are pulse widths.
    let pulses = shared.options.indicator == Indicator::Pulse;
    let paper = shared.options.paper.unwrap_or(match shared.input.true_updraft_mps {
        Some(_) => PaperTable::Simulation,
        None => PaperTable::Field,
    });
    (pulses && (is_fleet || paper == PaperTable::Simulation)).then_some(paper)
}

/// Says which rows are not to be compared with the paper's: those of a law that does not describe the
/// flight, whose parameters mean nothing there.
fn compare_what_fits(table: &mut [TableRow], flock: &Laws, vertex: bool) {
    for row in table.iter_mut().filter(|row| row.paper.is_some()) {
        let law = if row.law == LINEAR { MapLaw::Linear } else { MapLaw::SignedQuadratic };
        if !describes(flock, law) {
            row.not_compared = Some("this law does not describe this flight".to_owned());
        } else if vertex && row.law == SIGNED_QUADRATIC {
            row.not_compared = Some(
                "here this law is one flank of a parabola: its A, u0 and W* are no rotor's and no air's"
                    .to_owned(),
            );
        }
    }
}

/// That the law of a measured drone is the flock's because its own is of a part of the ladder.
fn partial_law(shared: &Shared<'_>, slot: Option<u16>, name: &str) -> Option<String> {
    let drone = same_drone(shared.map_reference?, slot, name)?;
    let partial = drone.partial_ladder.filter(|_| drone.laws.is_some())?;
    Some(format!(
        "the map uses the flock's law: its own is of a partial ladder ({})",
        partial.short()
    ))
}

/// Where a drone that moved was at the map's times, in the show frame where its home is known.
fn track_of(
    shared: &Shared<'_>,
    home_m: Option<[f64; 2]>,
    series: &DroneSeries,
    times: &[i64],
) -> Vec<Option<[f64; 3]>> {
    let Some((plan, home_m)) = shared.input.plan.zip(home_m) else { return Vec::new() };
    if series.moved_m.is_empty() {
        return Vec::new();
    }
    let frame = plan.site.frame();
    let places = series.spread(&series.moved_m, times);
    places.into_iter().map(|moved| Some(track::place_m(&frame, home_m, moved?))).collect()
}

/// Why the map's law was taken.
fn law_reason(shared: &Shared<'_>) -> Option<String> {
    if shared.options.map_law.is_some() {
        return Some(ASKED_FOR.to_owned());
    }
    let aware = shared.aware.as_ref().map(Aware::law_reason);
    aware.or_else(|| shared.map_reference.map(|reference| chosen(reference).1))
}

type NamedUpdraft =
    (Option<u16>, String, Option<[f64; 2]>, DroneSeries, &'static str, Option<TruthSeries>);

fn map(updrafts: Vec<NamedUpdraft>, shared: &Shared<'_>) -> UpdraftMap {
    let uniform_mps = shared.input.true_updraft_mps;
    let series: Vec<DroneSeries> = updrafts.iter().map(|named| named.3.clone()).collect();
    let times = updraft::common_times(&series);
    let truth_of = |slot: Option<u16>, own: Option<TruthSeries>| match (uniform_mps, own) {
        (Some(truth_mps), _) => Some(vec![truth_mps; times.len()]),
        (None, Some(own)) => own.at(&times),
        (None, None) => shared.input.truth?.get(&slot?)?.at(&times),
    };
    let measured: Vec<&Measured> =
        series.iter().filter_map(|series| series.measured.as_ref()).collect();
    let aware = shared.aware.as_ref().filter(|_| !measured.is_empty());
    let drones: Vec<DroneUpdraft> = updrafts
        .into_iter()
        .map(|(slot, name, position_m, series, mapping, truth)| DroneUpdraft {
            slot,
            name,
            // A drone that moved has a track, and no place.
            position_m: position_m.filter(|_| series.moved_m.is_empty()),
            track_m: track_of(shared, position_m, &series, &times),
            height_m: series.height_m,
            mapping: mapping.to_owned(),
            mean: series.mean,
            mean_interval_mps: series.measured.as_ref().map(|one| one.mean_interval_mps),
            errors: series.measured.as_ref().map_or_else(ErrorBudget::default, |one| one.errors),
            systematic_mps: series.systematic_mps,
            tilt_deg: series.tilt_deg,
            updraft_mps: series.at(&times),
            sd_mps: series
                .measured
                .as_ref()
                .map_or_else(Vec::new, |one| series.spread(&one.sd_mps, &times)),
            interval_mps: series
                .measured
                .as_ref()
                .map_or_else(Vec::new, |one| series.spread(&one.interval_mps, &times)),
            quality: series.measured.as_ref().map_or_else(Vec::new, |one| one.quality.clone()),
            truth_mps: truth_of(slot, truth),
        })
        .collect();
    UpdraftMap {
        law: match shared.map_law {
            Some(MapLaw::SignedQuadratic) => SIGNED_QUADRATIC,
            _ => LINEAR,
        }
        .to_owned(),
        law_reason: law_reason(shared),
        wind: match (shared.input.leaning, shared.input.lean_table) {
            (Some(_), _) => Some(WindCorrection::Drag),
            (None, table) => {
                table.filter(|_| shared.aware.is_some()).map(|_| WindCorrection::Physics)
            }
        },
        leaning: shared.input.leaning,
        density: shared.input.density,
        flock: shared.map_reference.and_then(|reference| reference.flock.clone()),
        time_s: times.iter().map(|time| *time as f64).collect(),
        battery: aware.and_then(|aware| aware.battery),
        calibration_air: aware.map(|aware| aware.zero.air),
        common: aware.map(|aware| aware.common(&measured)),
        truth: truth::check(&drones),
        drones,
    }
}
