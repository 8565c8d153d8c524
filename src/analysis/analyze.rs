//! Analysis of one flight of a fleet, and of a campaign, from logs to results.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use thiserror::Error;

use super::account::{self, Account};
use super::aware::{ASKED_FOR, Aware, TYPICAL_SLOPE};
use super::beside::Beside;
use super::calibrate::{self, FitOptions};
use super::cause::Cause;
use super::caution::{fit_cautions, response_caution, steep_caution, tilt_caution, wind_caution};
use super::caution_battery::battery_caution;
use super::corrections::Corrections;
use super::drone::{One, Shared, one};
use super::headline;
use super::hold::Holding;
use super::input::{FlightInput, LogInput, TruthSeries};
use super::kriging::Drone;
use super::ladder::{FleetLadders, is_ladder, rungs};
use super::law::{LawKind, LawOf, Symbol};
use super::laws_of_others;
use super::lean_table::LeanTable;
use super::levelled;
use super::map_statistics::{HoverSeen, Observed, wind_of};
use super::measured::Measured;
use super::options::AnalysisOptions;
use super::posterior;
use super::prefer::{better_law, chosen, describes, vertex_mps};
use super::refer::refer_calibration;
use super::reference::same_drone;
use super::result::{
    ANALYSIS_SCHEMA, Analysis, DroneAnalysis, DroneUpdraft, ErrorBudget, FlightAnalysis, Laws,
    LevelledMap, TableRow, Turbulence, Unmeasured, UpdraftMap, WindCorrection, WindLegs,
    WindowStats,
};
use super::site::FlightSite;
use super::slots::{SlotMatch, match_slots};
use super::starts;
use super::statistics::result::{FieldStatistics, TiltWind};
use super::statistics::tilt_wind::LeanDrag;
use super::table::{self, PaperTable, TableLaw};
use super::track;
use super::truth;
use super::turbulence;
use super::updraft::{self, DroneSeries};
use super::warning::Warning;
use super::widened;
use super::wind_legs;
use crate::flight::Indicator;
use crate::mission::plan::{Group, Purpose, Segment, SegmentKind};
use crate::numeric::mean;

/// Progress callback, called after each log with (logs done, logs in all).
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// Error of analysing a flight or a campaign.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// The flight has no logs.
    #[error(
        "{name}: no logs to analyse (put the drones' .BIN files into the flight's logs folder)"
    )]
    NoLogs {
        /// Name of the flight.
        name: String,
    },
    /// None of the flight's logs could be used.
    #[error("{name}: none of the {count} log(s) can be used:{}", listed(reasons))]
    NothingUsable {
        /// Name of the flight.
        name: String,
        /// Number of logs that were given.
        count: usize,
        /// Reasons why the logs could not be used, one sentence each.
        reasons: Vec<String>,
    },
    /// None of several flights can be analysed.
    #[error("{}", failures.iter().map(Self::to_string).collect::<Vec<_>>().join("\n"))]
    Every {
        /// Errors of the flights, one each.
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
    let mut campaigns: Vec<usize> = Vec::new();
    let mut warnings = Vec::new();
    let mut failures = Vec::new();
    // Flights without a plan that turned out to measure, before a calibration of theirs was found.
    let mut early: Vec<(usize, &FlightInput<'_>)> = Vec::new();
    for input in order {
        let own = calibration_of(&flights, &campaigns, input.campaign);
        let laws = reference.or(own.map(|place| &flights[place]));
        let report = |done: usize, _: usize| progress(before + done, total);
        match analyze_flight(input, options, laws, &report) {
            Ok(flight) => {
                let measured = flight.purpose == Purpose::Measurement;
                if reference.is_none() && measured && purpose(input).is_none() {
                    early.push((flights.len(), input));
                }
                flights.push(flight);
                campaigns.push(input.campaign);
            }
            Err(error) => {
                // One warning for each line: what is told and, below it, of which log.
                let lines = error.to_string();
                let lines = lines.lines().map(|line| Warning::Failed(line.trim().to_owned()));
                warnings.extend(lines);
                failures.push(error);
            }
        }
        before += input.logs.len();
    }
    for (index, input) in early {
        let of = |flights: &[FlightAnalysis]| calibration_of(flights, &campaigns, input.campaign);
        let Some(laws) = of(&flights).filter(|laws| of(&flights[..index]) != Some(*laws)) else {
            continue;
        };
        // They could be analysed before it: with its laws they can be as well.
        if let Ok(flight) = analyze_flight(input, options, Some(&flights[laws]), &|_, _| {}) {
            flights[index] = flight;
        }
    }
    if flights.iter().any(is_calibration) {
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
        laws_from: None,
        warnings,
    })
}

/// Whether a flight gives laws for others.
fn is_calibration(flight: &FlightAnalysis) -> bool {
    flight.purpose == Purpose::Calibration && flight.flock.is_some()
}

/// Place of the calibration for a campaign's flights: its own, else the first there is. `campaigns` are those of the flights.
fn calibration_of(
    flights: &[FlightAnalysis],
    campaigns: &[usize],
    campaign: usize,
) -> Option<usize> {
    let mut all = flights.iter().zip(campaigns);
    all.position(|(flight, of)| *of == campaign && is_calibration(flight))
        .or_else(|| flights.iter().position(is_calibration))
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
    let mut corrections = Corrections {
        density: input.density,
        leaning: input.leaning,
        lean_table: input.lean_table,
        track_table: None,
        warm_up_us: input.sag.map(|sag| sag.warm_up_us),
        unknown_share: 0.0,
        indicator: options.indicator,
        unit: None,
    };
    let work: Vec<(&LogInput, &SlotMatch)> = input.logs.iter().zip(&slots).collect();
    let by_forms = input.wind_forms.map(|forms| {
        let own = (planned_purpose == Some(Purpose::Measurement))
            .then(|| own_legs(input, options, corrections, &work))
            .flatten();
        let of_reference = reference.and_then(|reference| reference.wind_legs.as_ref());
        let legs: Vec<&WindLegs> = of_reference.into_iter().chain(&own).collect();
        let slope = ladder_slope(reference);
        let belief = wind_legs::posterior(&legs, forms, slope.unwrap_or(TYPICAL_SLOPE));
        let by_file = forms.tables(&belief, 1.0);
        let is_calm = reference.is_some_and(|found| is_calm(found, &by_file[0]));
        match slope.filter(|_| is_calm && !options.plain) {
            Some(own) => forms.tables(&belief, forms.slope_ratio(own)),
            None => by_file,
        }
    });
    corrections.lean_table = by_forms.as_ref().map(|[table, _]| table).or(input.lean_table);
    corrections.track_table = by_forms.as_ref().map(|[_, table]| table).filter(|_| !options.plain);
    let aware = reference
        .filter(|_| input.level.is_none())
        .filter(|_| !options.plain && planned_purpose != Some(Purpose::Calibration))
        .and_then(|found| Aware::new(found, corrections, input.sag, options.map_law));
    let map_law = options
        .map_law
        .or_else(|| aware.as_ref().map(Aware::law))
        .or_else(|| map_reference.map(better_law));
    let shared = Shared {
        input,
        options,
        reference,
        map_reference,
        planned_purpose,
        map_law,
        corrections,
        aware,
    };

    let done = AtomicUsize::new(0);
    let outcomes: Vec<Result<One, Cause>> = work
        .par_iter()
        .map(|(log, slot)| {
            let outcome = one_of(&shared, log, slot);
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
            reasons: account.unused.iter().map(|log| log.sentence().to_string()).collect(),
        });
    }
    if input.plan.is_some() {
        account.ones.sort_by_key(|one| one.drone.slot);
    }
    let contradictions = warnings.into_iter().map(Warning::WhoseLogs).collect();
    let mut flight = finish(&shared, account, contradictions);
    if flight.purpose == Purpose::Calibration && !options.plain {
        headline::add(&mut flight, corrections, input.sag);
    }
    Ok(flight)
}

fn one_of(shared: &Shared<'_>, log: &LogInput, slot: &SlotMatch) -> Result<One, Cause> {
    match slot {
        SlotMatch::Refused { reason, .. } => Err(reason.clone()),
        SlotMatch::Slot(number) => one(shared, log, Some(*number)),
        SlotMatch::Unplanned => one(shared, log, None),
    }
}

/// The legs of a measurement that calibrate the wind, by which it is corrected itself: its logs are read for them first,
/// so that not all of them are in memory at once.
fn own_legs(
    input: &FlightInput<'_>,
    options: &AnalysisOptions,
    corrections: Corrections<'_>,
    work: &[(&LogInput, &SlotMatch)],
) -> Option<WindLegs> {
    let plan = input.plan?;
    let calibrates = |group: &Group| {
        let leg = |segment: &Segment| segment.kind == SegmentKind::Horizontal;
        group.segments.iter().any(|segment| leg(segment) && segment.window.is_some())
    };
    if !plan.groups.iter().any(calibrates) {
        return None;
    }
    let shared = Shared {
        input,
        options,
        reference: None,
        map_reference: None,
        planned_purpose: Some(Purpose::Measurement),
        map_law: None,
        corrections,
        aware: None,
    };
    let drones: Vec<DroneAnalysis> = work
        .par_iter()
        .filter_map(|(log, slot)| Some(one_of(&shared, log, slot).ok()?.drone))
        .collect();
    WindLegs::of(plan, &drones)
}

/// Pulse per vertical speed of a calibrated fleet's line, us/(m/s).
fn ladder_slope(reference: Option<&FlightAnalysis>) -> Option<f64> {
    let line = reference?.flock.as_ref()?.linear.as_ref()?;
    line.parameters.first().map(|slope| slope.estimate.value)
}

/// Wind in which a ladder's slope is that of still air, m/s: a show drone is 16 % steeper in 2 m/s.
const CALM_MPS: f64 = 2.0;

/// Whether the leans of a calibration's hovers tell no wind that makes the pulse steeper.
fn is_calm(reference: &FlightAnalysis, table: &LeanTable) -> bool {
    let windows = reference.drones.iter().flat_map(|drone| &drone.windows);
    let leans = windows.filter(|window| window.kind.is_hover()).map(|window| window.lean_deg);
    let wind_mps = mean(leans).and_then(|lean_deg| table.wind_at(lean_deg));
    wind_mps.is_some_and(|mps| mps < CALM_MPS)
}

/// Unusable logs named in an error.
const LISTED: usize = 20;

/// Joins the drones' results: purpose, laws, flock, tables, map, missing.
fn finish(shared: &Shared<'_>, account: Account, mut warnings: Vec<Warning>) -> FlightAnalysis {
    let Shared { input, options, .. } = shared;
    let Account { ones, unused, partly_used } = account;
    let fixes = ones.iter().filter_map(|one| one.first_fix_deg);
    let site = input.plan.map(FlightSite::of_plan).or_else(|| FlightSite::of_fixes(&fixes));
    let climbed: Vec<(usize, usize)> = (ones.iter().filter(|one| one.calibration.is_ok()))
        .map(|one| rungs(&one.drone.windows, &options.fit))
        .collect();
    let purpose = shared.planned_purpose.unwrap_or(if climbed.iter().copied().any(is_ladder) {
        Purpose::Calibration
    } else {
        Purpose::Measurement
    });
    let Sorted { mut drones, measured, seen, unmeasured } =
        sorted(shared, purpose, ones, &mut warnings);
    warnings.extend(steep_caution(&mut drones));
    let laws = match purpose {
        Purpose::Calibration => fleet_laws(shared, &mut drones, &mut warnings),
        Purpose::Measurement => FleetLaws::default(),
    };
    if purpose == Purpose::Measurement && shared.reference.is_none() && input.level.is_none() {
        warnings.push(Warning::NoCalibration);
        let most = climbed.iter().copied().max_by_key(|(up, down)| up + down);
        let most = most.filter(|_| shared.planned_purpose.is_none());
        warnings.extend(most.map(|(up, down)| Warning::NoLadder { up, down }));
    }
    let (mut map, modelled) = (!measured.is_empty()).then(|| map(measured, shared)).unzip();
    warnings.extend(map.iter().flat_map(|map| map_warnings(shared, map)));
    if let Some(map) = &mut map {
        Beside::add(map, seen.iter().map(|seen| &seen.beside));
    }
    let still = map.as_ref().filter(|map| !map.is_scan());
    let wind = still.and_then(|map| lean_wind(shared, map, &seen));
    let observed = still.map(|map| Observed::of(map, &seen));
    let places = map.as_ref().map(Places::of);
    let wind = wind.as_ref();
    // None needs another's result, and all take seconds where many drones hover for long.
    let ((), (turbulence, statistics)) = rayon::join(
        || {
            if let Some((map, modelled)) = map.as_mut().zip(modelled).filter(|_| options.posterior)
            {
                posterior::add(map, modelled, shared, wind);
                widened::widen(map);
            }
        },
        || {
            rayon::join(
                || places.and_then(|places| turbulence_of(shared, (&places, &seen), wind)),
                || observed.map(|observed| statistics(shared, &observed, wind)),
            )
        },
    );
    let wind_legs = input.plan.and_then(|plan| WindLegs::of(plan, &drones));
    FlightAnalysis {
        name: input.name.to_owned(),
        purpose,
        indicator: options.indicator,
        planned: input.plan.is_some(),
        orientation_deg: input.plan.map(|plan| plan.site.orientation_deg),
        site,
        site_name: input.plan.and_then(|plan| plan.site_name.clone()),
        utc_offset_h: input.plan.and_then(|plan| plan.utc_offset_h),
        simulated: input.simulated,
        true_updraft_mps: input.true_updraft_mps,
        logs: input.logs.len(),
        missing: account::missing(input, &drones, &unused),
        drones,
        flock: laws.flock,
        headline: None,
        table: laws.table,
        map,
        statistics,
        turbulence,
        wind_legs,
        unmeasured,
        paper_table: laws.paper,
        warnings,
        unused,
        partly_used,
    }
}

/// The drones of a flight, by what became of them.
#[derive(Default)]
struct Sorted {
    drones: Vec<DroneAnalysis>,
    /// What the map is made of.
    measured: Vec<NamedUpdraft>,
    /// The hovers of these, for the statistics.
    seen: Vec<HoverSeen>,
    unmeasured: Vec<Unmeasured>,
}

/// Gives each drone what the flight was for, or says why it has none.
fn sorted(
    shared: &Shared<'_>,
    purpose: Purpose,
    ones: Vec<One>,
    warnings: &mut Vec<Warning>,
) -> Sorted {
    // Without a plan logs may be of any day.
    let planned = shared.input.plan.is_some();
    let apart = if planned { starts::apart(&ones) } else { vec![None; ones.len()] };
    let mut sorted = Sorted::default();
    for (One { mut drone, calibration, updraft, hover, truth, .. }, later_s) in
        ones.into_iter().zip(apart)
    {
        let (slot, name) = (drone.slot, drone.name.clone());
        let updraft = match later_s {
            Some(later_s) => updraft.map(|_| Err(Cause::OtherStart { later_s })),
            None => updraft,
        };
        if let (Purpose::Calibration, Some(later_s)) = (purpose, later_s) {
            warnings.push(Warning::OtherStart { name: name.clone(), later_s });
        }
        let nothing = |reason| Unmeasured { slot, name: name.clone(), reason };
        match (purpose, calibration, updraft) {
            (Purpose::Calibration, Ok(laws), _) => drone.laws = Some(laws),
            (Purpose::Calibration, Err(error), _) => sorted.unmeasured.push(nothing(error.into())),
            (Purpose::Measurement, _, Some(Ok((series, mapping)))) => {
                let partial = partial_law(shared, slot, &name);
                drone.warnings.extend(partial.filter(|_| mapping == LawOf::Flock));
                sorted.seen.push(hover);
                sorted.measured.push((slot, name.clone(), drone.home_m, series, mapping, truth));
            }
            (Purpose::Measurement, _, Some(Err(reason))) => sorted.unmeasured.push(nothing(reason)),
            (Purpose::Measurement, _, None) => {}
        }
        sorted.drones.push(drone);
    }
    sorted
}

/// What a calibration says of the fleet.
#[derive(Default)]
struct FleetLaws {
    flock: Option<Laws>,
    table: Vec<TableRow>,
    paper: Option<PaperTable>,
}

/// The laws of the drones' average and the table over the drones; marks drones with a part of the ladder.
fn fleet_laws(
    shared: &Shared<'_>,
    drones: &mut [DroneAnalysis],
    warnings: &mut Vec<Warning>,
) -> FleetLaws {
    let Shared { input, options, .. } = shared;
    warnings.extend(mark_partial(drones, &options.fit));
    let whole = || drones.iter().filter(|drone| drone.partial_ladder.is_none());
    let windows = whole().map(|drone| drone.windows.as_slice());
    let flock = match calibrate::flock(windows, &options.fit) {
        Ok(laws) => Some(laws),
        Err(error) => {
            warnings.push(Warning::NoFlock(error));
            None
        }
    };
    let flock = hold(shared, drones, flock);
    let whole = || drones.iter().filter(|drone| drone.partial_ladder.is_none());
    let paper = paper_table(shared, drones);
    let laws: Vec<&Laws> = whole().filter_map(|drone| drone.laws.as_ref()).collect();
    let mut table = table::table(&laws, paper, &options.fit, options.plain);
    if let Some(laws) = &flock {
        let vertex = vertex_mps(laws, drones, input.true_updraft_mps).is_some();
        compare_what_fits(&mut table, laws, vertex);
    }
    warnings.extend(fit_cautions(flock.as_ref(), drones, input.leaning, input.true_updraft_mps));
    warnings.extend(tilt_caution(drones, options));
    FleetLaws { flock, table, paper }
}

/// Writes the updraft with the curve of the calibration held, if there is one, into the laws of drones and flock.
fn hold(shared: &Shared<'_>, drones: &mut [DroneAnalysis], flock: Option<Laws>) -> Option<Laws> {
    let Some(holding) = (!shared.options.plain).then(|| holding(shared)).flatten() else {
        return flock;
    };
    drones.par_iter_mut().for_each(|drone| {
        if let Some(laws) = &mut drone.laws {
            laws.held = holding.of_drone(&drone.windows, drone.slot, &drone.name);
        }
    });
    flock.map(|laws| Laws { held: holding.of_fleet(drones), ..laws })
}

/// The calibration whose own curve is held.
fn holding<'a>(shared: &Shared<'a>) -> Option<Holding<'a>> {
    let reference = shared.reference?;
    let Shared { input, map_reference, corrections, .. } = shared;
    let preferred = Aware::new(reference, *corrections, input.sag, None)?;
    // Only the signed quadratic tells the air that it was calibrated in.
    let square = map_reference.and_then(|found| found.flock.as_ref()?.signed_quadratic.as_ref());
    let square = square.filter(|_| preferred.law() == LawKind::SignedQuadratic);
    let origin = square.and_then(|fit| fit.parameter(Symbol::W)).map(|w| w.estimate);
    Holding::new(reference, *corrections, input.sag, origin)
}

/// Marks the drones of a calibration with clearly less of the ladder than the fleet, and warns of them.
/// That most drones have less than two thirds of the plan is a warning of its own.
fn mark_partial(drones: &mut [DroneAnalysis], options: &FitOptions) -> Vec<Warning> {
    let with_laws: Vec<&[WindowStats]> = (drones.iter().filter(|drone| drone.laws.is_some()))
        .map(|drone| drone.windows.as_slice())
        .collect();
    let Some(ladders) = FleetLadders::of(&with_laws, options) else { return Vec::new() };
    let mut named = Vec::new();
    for drone in drones.iter_mut() {
        if let Some(partial) = ladders.partial(&drone.windows, options) {
            named.push((drone.name.clone(), partial));
            drone.partial_ladder = Some(partial);
        }
    }
    let FleetLadders { flown, usable } = ladders;
    let mut warnings = Vec::new();
    if !named.is_empty() {
        let of = drones.len();
        warnings.push(Warning::PartialLadders { drones: named, of, whole: usable });
    }
    warnings.extend(ladders.is_partial().then_some(Warning::FleetLadder { usable, flown }));
    warnings
}

/// What a reader of a map must know.
fn map_warnings(shared: &Shared<'_>, map: &UpdraftMap) -> Vec<Warning> {
    let response = response_caution(map, shared.options.indicator);
    let mut warnings: Vec<Warning> = response.into_iter().chain(wind_caution(map)).collect();
    let calibration = shared.reference.filter(|_| shared.aware.is_some());
    let battery = calibration.filter(|_| shared.input.sag.is_some());
    warnings.extend(battery.and_then(|found| battery_caution(map, found)));
    let is_plain = shared.aware.is_none() && shared.input.level.is_none();
    warnings.extend(is_plain.then_some(Warning::PlainMap));
    warnings.extend(shared.map_reference.and_then(|laws| laws_of_others::doubt(map, laws)));
    warnings.extend(map.is_scan().then_some(Warning::Scan));
    warnings
}

/// The wind by the leans over a map of drones that hover.
fn lean_wind(shared: &Shared<'_>, map: &UpdraftMap, seen: &[HoverSeen]) -> Option<TiltWind> {
    // The wind by which a response was steepened is that of its own leans.
    let leans = shared.input.level.and_then(|level| level.response.as_ref()?.leans());
    let drag = leans.as_ref().map_or_else(|| shared.drag(), LeanDrag::Table);
    wind_of(map, seen, drag)
}

/// Statistics of the air over a map.
fn statistics(
    shared: &Shared<'_>,
    observed: &Observed,
    wind: Option<&TiltWind>,
) -> FieldStatistics {
    FieldStatistics {
        true_air: shared.input.true_air.cloned(),
        ..observed.statistics(&shared.options.statistics, wind.cloned())
    }
}

/// Drones of a map with their places.
struct Places {
    /// Slot, name, and place in the show frame, m.
    drones: Vec<(Option<u16>, String, Option<[f64; 2]>)>,
    /// Their mean height, m.
    height_m: Option<f64>,
}

impl Places {
    fn of(map: &UpdraftMap) -> Self {
        let each = map.drones.iter();
        Self {
            drones: each.map(|drone| (drone.slot, drone.name.clone(), drone.position_m)).collect(),
            height_m: mean(map.drones.iter().map(|drone| drone.height_m)),
        }
    }
}

/// Turbulence over a map's hover; `None` where drones moved.
fn turbulence_of(
    shared: &Shared<'_>,
    (places, seen): (&Places, &[HoverSeen]),
    wind: Option<&TiltWind>,
) -> Option<Turbulence> {
    let known = places.drones.iter().zip(seen);
    let drones: Vec<turbulence::Drone<'_>> = known
        .filter_map(|((slot, name, place_m), seen)| {
            let (slot, name, place_m) = (*slot, name.as_str(), *place_m);
            Some(turbulence::Drone { slot, name, place_m, records: seen.records.as_ref()? })
        })
        .collect();
    let asked = turbulence::Asked {
        orientation_deg: shared.input.plan.map(|plan| plan.site.orientation_deg),
        wind,
        drag_share: shared.drag().share(),
        height_m: places.height_m,
        mixed_layer_depth_m: shared.options.mixed_layer_depth_m,
    };
    turbulence::of_fleet(&drones, asked)
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
        let Some(law) = row.law.kind() else { continue };
        if !describes(flock, law) {
            row.not_compared = Some("this law does not describe this flight".to_owned());
        } else if vertex && row.law == TableLaw::SignedQuadratic {
            row.not_compared = Some(
                "here this law is one flank of a parabola: its A, u0 and W* are no rotor's and no air's"
                    .to_owned(),
            );
        }
    }
}

/// That the law of a measured drone is the flock's because its own is of a part of the ladder.
fn partial_law(shared: &Shared<'_>, slot: Option<u16>, name: &str) -> Option<Warning> {
    let drone = same_drone(shared.map_reference?, slot, name)?;
    let partial = drone.partial_ladder.filter(|_| drone.laws.is_some())?;
    Some(Warning::PartialLaw(partial))
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
fn law_reason(shared: &Shared<'_>, levelled: Option<&LevelledMap>) -> Option<String> {
    if let Some(levelled) = levelled {
        return Some(levelled.words());
    }
    if shared.options.map_law.is_some() {
        return Some(ASKED_FOR.to_owned());
    }
    let aware = shared.aware.as_ref().map(Aware::law_reason);
    aware.or_else(|| shared.map_reference.map(|reference| chosen(reference).1))
}

type NamedUpdraft =
    (Option<u16>, String, Option<[f64; 2]>, DroneSeries, LawOf, Option<TruthSeries>);

/// The map, and its drones' values as the model of the air sees them.
fn map(updrafts: Vec<NamedUpdraft>, shared: &Shared<'_>) -> (UpdraftMap, Vec<Option<Drone>>) {
    let uniform_mps = shared.input.true_updraft_mps;
    let series: Vec<DroneSeries> = updrafts.iter().map(|named| named.3.clone()).collect();
    let times = updraft::common_times(&series);
    let truth_of = |slot: Option<u16>, own: Option<TruthSeries>| match (uniform_mps, own) {
        (Some(truth_mps), _) => Some(vec![Some(truth_mps); times.len()]),
        (None, Some(own)) => own.at(&times),
        (None, None) => shared.input.truth?.get(&slot?)?.at(&times),
    };
    let own_truth: Vec<Option<TruthSeries>> =
        updrafts.iter().map(|named| named.5.clone()).collect();
    let levelled = levelled::of_map(&series.iter().collect::<Vec<_>>(), &own_truth);
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
            mapping,
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
            posterior_mps: Vec::new(),
            posterior_sd_mps: Vec::new(),
            posterior_mean: None,
            place: None,
            wind: None,
        })
        .collect();
    let modelled = series
        .iter()
        .zip(&drones)
        .map(|(series, drone)| posterior::seen(series, drone.position_m, &drone.track_m, &times))
        .collect();
    let map = UpdraftMap {
        law: shared.map_law.unwrap_or(LawKind::Linear),
        law_reason: law_reason(shared, levelled.as_ref()),
        wind: match (shared.input.leaning, shared.corrections.lean_table) {
            _ if shared.input.level.is_some() => {
                let response = shared.input.level.and_then(|level| level.response.as_ref());
                response.map(|_| WindCorrection::Physics)
            }
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
        truth: match &levelled {
            Some(levelled) => truth::check_levelled(&drones, levelled, &times),
            None => truth::check(&drones),
        },
        levelled,
        combined: None,
        drones,
        posterior: None,
        thermals: Vec::new(),
    };
    (map, modelled)
}
