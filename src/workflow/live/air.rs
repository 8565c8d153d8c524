//! The air while drones are in it: telemetry through the same analysis as logs, again and again.
//!
//! It runs on a thread of its own, and waits nineteen times as long as it works: it takes a twentieth of one processor,
//! however many drones there are.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use super::agreement::{Agreement, Look};
use super::of_map;
use crate::analysis::battery::Sag;
use crate::analysis::result::{FlightAnalysis, UpdraftMap};
use crate::analysis::{AtHand, LogInput, Warning, analyze_flight};
use crate::base::causes::with_causes;
use crate::base::estimate::Estimate;
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::campaign::origin::LogOrigin;
use crate::live::station::Station;
use crate::live::view::{AirView, Level, Step};
use crate::mission::Plan;
use crate::mission::plan::{Purpose, SegmentKind};
use crate::numeric;
use crate::vehicle::library;
use crate::virtual_fleet::vehicle::REVISION;
use crate::workflow::analysis_file::AnalysisFile;
use crate::workflow::analyze::Settings;
use crate::workflow::analyze::{doubts_of_held, one_input};
use crate::workflow::clock::{Clock, Micros, S};
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{Found, Work, find, sag};
use crate::workflow::host::{Host, News};

/// A first look is taken so long after the hover has begun, s.
const FIRST_S: f64 = 40.0;
/// What is older does not count, s: the air of now is asked for.
const WINDOW_S: f64 = 180.0;
/// Looks are no closer together, us.
const CLOSEST: Micros = 4 * S;
/// Time between looks, in times that one takes.
const SHARE: u32 = 19;
/// Error of a drone's mean over 10 s by messages that are too few, times their rate, m/s Hz: measured with logs that
/// were thinned (`examples/thinned_telemetry.rs`).
const COST_MPS_HZ: f64 = 0.11;
/// The same of the fleet's mean, in shares of a drone's: drones do not err alike.
const COST_OF_FLEET: f64 = 0.37;
/// The rate of messages is that of so many last seconds, s.
const RATE_OVER_S: f64 = 20.0;
/// Motors of a vehicle, on its first outputs: all that updraft knows have four.
const MOTORS: usize = 4;

/// What the air is told with.
#[derive(Clone, Debug)]
pub(crate) struct AirWish {
    /// Folder of the campaign.
    pub(crate) campaign: PathBuf,
    /// Folder of the flight.
    pub(crate) folder: FlightFolder,
    /// An analysis.json with the calibration; absent: the campaign's own.
    pub(crate) law: Option<PathBuf>,
}

/// A thread that looks at the air; dropped, it ends.
pub(crate) struct AirWatch {
    shared: Arc<Shared>,
    thread: Option<std::thread::JoinHandle<()>>,
    station: Arc<Station>,
    campaign: PathBuf,
    flight: String,
    reference: Arc<FlightAnalysis>,
}

struct Shared {
    stop: AtomicBool,
    guard: Mutex<()>,
    bell: Condvar,
    /// What was shown so far.
    looks: Mutex<Vec<Look>>,
}

impl AirWatch {
    /// Begins to look, if the flight measures and there is a calibration; says why not.
    ///
    /// # Errors
    /// If a calibration was named and cannot be read.
    pub(crate) fn begin(
        host: &dyn Host,
        station: &Arc<Station>,
        plan: &Plan,
        wish: &AirWish,
    ) -> Result<Option<Self>, WorkflowError> {
        let mut work = Work::new(&wish.campaign);
        find(&wish.campaign, None, &mut work)?;
        let found = work.flights.iter().find(|found| found.name == plan.name).cloned();
        let Some(found) = found else { return Ok(None) };
        if found.purpose != Some(Purpose::Measurement) {
            return Ok(None);
        }
        let tell = |text: &str| {
            host.say(text);
            station.say(Level::Notice, text);
        };
        let own = wish.campaign.join("analysis.json");
        let path = wish.law.as_ref().unwrap_or(&own);
        let reference = match calibration(path) {
            Ok(Some(reference)) => reference,
            Ok(None) if wish.law.is_none() => {
                tell(
                    "the page shows no air: the campaign has no analysed calibration (`updraft \
                     analyze`, or --law with another campaign's analysis.json)",
                );
                return Ok(None);
            }
            Ok(None) => {
                return Err(WorkflowError::Usage(format!(
                    "{} has no calibration whose laws could tell the air",
                    path.shown()
                )));
            }
            Err(error) if wish.law.is_none() => {
                tell(&format!("the page shows no air: {error}"));
                return Ok(None);
            }
            Err(error) => return Err(error),
        };
        if let Some(law) = &wish.law
            && let Some(doubts) =
                doubts_of_held(law, &reference, Settings::default().options.indicator, &work)
        {
            host.warn(&doubts);
            station.say(Level::Warning, &doubts);
        }
        station.keep_air(MOTORS);
        let note = format!("The first values come {FIRST_S:.0} s into the hover.");
        let first = AirView { provisional: true, note, ..AirView::default() };
        station.air(Some(first), BTreeMap::new());
        let shared = Arc::new(Shared {
            stop: AtomicBool::new(false),
            guard: Mutex::default(),
            bell: Condvar::new(),
            looks: Mutex::default(),
        });
        let reference = Arc::new(reference);
        let mut watch = Self {
            shared: Arc::clone(&shared),
            thread: None,
            station: Arc::clone(station),
            campaign: wish.campaign.clone(),
            flight: found.name.clone(),
            reference: Arc::clone(&reference),
        };
        let (clock, station) = (Arc::clone(host.clock()), Arc::clone(station));
        let vehicle = library::load(&wish.folder.vehicle().to_string_lossy()).ok();
        // Virtual drones whose battery acts on nothing still tell of one.
        let of_virtual = sag(&|| true, vehicle.as_ref());
        let body = move || look_again(&shared, &clock, &station, (&found, of_virtual), &reference);
        let thread = std::thread::Builder::new().name("live air".to_owned()).spawn(body);
        watch.thread = Some(thread.map_err(|error| {
            WorkflowError::Failed(format!("failed to start a thread: {error}"))
        })?);
        Ok(Some(watch))
    }

    /// Shows the air of the logs, which are home, in place of that of telemetry, and says how far they are apart.
    pub(crate) fn show_logs(&mut self, host: &dyn Host) {
        self.end();
        host.news(&News::Step(Step::Logs, "Analysing the logs".to_owned()));
        match self.of_logs() {
            Ok(Some(map)) => {
                let looks = std::mem::take(
                    &mut *self.shared.looks.lock().unwrap_or_else(PoisonError::into_inner),
                );
                let agreement =
                    Agreement::of(&looks, &|slot, time_s| of_map::at(&map, slot, time_s));
                if let Some(agreement) = &agreement {
                    host.say(&agreement.to_string());
                }
                let (view, of) = final_view(&map, agreement.as_ref());
                self.station.air(Some(view), of);
            }
            Ok(None) => host.warn("the page's air stays provisional: the logs give no map"),
            Err(error) => {
                host.warn(&format!(
                    "the page's air stays provisional: {}",
                    with_causes(&error, ": ")
                ));
            }
        }
    }

    fn of_logs(&self) -> Result<Option<UpdraftMap>, WorkflowError> {
        let mut work = Work::new(&self.campaign);
        work.origin = Some(LogOrigin::Real);
        find(&self.campaign, None, &mut work)?;
        let found = work.flights.iter().find(|found| found.name == self.flight);
        let Some(found) = found.filter(|found| !found.logs.is_empty()) else { return Ok(None) };
        let settings = Settings::default();
        let input = one_input(&work, found);
        let looked = analyze_flight(&input, &settings.options, Some(&self.reference), &|_, _| {})
            .map_err(|error| WorkflowError::Failed(with_causes(&error, ": ")))?;
        Ok(looked.map)
    }

    fn end(&mut self) {
        self.shared.stop.store(true, Ordering::SeqCst);
        self.shared.bell.notify_all();
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has said so.
            let _ = thread.join();
        }
    }
}

impl Drop for AirWatch {
    fn drop(&mut self) {
        self.end();
    }
}

impl Shared {
    fn is_over(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn wait(&self, time: Duration) {
        let guard = self.guard.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.bell.wait_timeout_while(guard, time, |()| !self.is_over());
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }
}

fn calibration(path: &Path) -> Result<Option<FlightAnalysis>, WorkflowError> {
    let AnalysisFile { analysis, .. } = AnalysisFile::read(path)?;
    let usable =
        |flight: &FlightAnalysis| flight.purpose == Purpose::Calibration && flight.flock.is_some();
    Ok(analysis.flights.into_iter().find(usable))
}

/// Resistance of the battery that flew a slot in the calibration, ohm: the mean over its windows.
fn resistance_ohm(reference: &FlightAnalysis, slot: u16) -> Option<f64> {
    let drone = reference.drones.iter().find(|drone| drone.slot == Some(slot))?;
    let supplies = drone.windows.iter().filter_map(|window| window.supply.as_ref());
    numeric::mean(supplies.map(|supply| supply.resistance_ohm))
}

/// Show times of the flight's hover, s.
fn hover_s(plan: &Plan) -> Option<[f64; 2]> {
    let segments = plan.groups.iter().flat_map(|group| &group.segments);
    let hovers = segments.filter(|segment| segment.kind == SegmentKind::Hover);
    hovers
        .map(|segment| [segment.start_ms as f64 / 1000.0, segment.end_ms as f64 / 1000.0])
        .max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
}

fn look_again(
    shared: &Shared,
    clock: &Arc<dyn Clock>,
    station: &Station,
    (found, of_virtual): (&Found, Option<Sag>),
    reference: &FlightAnalysis,
) {
    let Some(plan) = &found.plan else { return };
    let Some([begins_s, ends_s]) = hover_s(plan) else { return };
    // The station's own work has the other processors.
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else { return };
    let settings = Settings::default();
    let (mut has_told, mut has_doubted) = (false, false);
    while !shared.is_over() {
        let (step, show_s) = station.moment();
        let flown = show_s.filter(|_| step == Step::Flying);
        if !has_told && flown.is_some_and(|show_s| show_s > ends_s) {
            has_told = true;
            let note = "This station heard too little of the hover to tell its air: the logs will."
                .to_owned();
            let none = AirView { provisional: true, note, ..AirView::default() };
            station.air(Some(none), BTreeMap::new());
        }
        let Some(show_s) = flown.filter(|show_s| (begins_s + FIRST_S..=ends_s).contains(show_s))
        else {
            shared.wait(Duration::from_secs(1));
            continue;
        };
        let begun = clock.now();
        let from_s = (show_s - WINDOW_S).max(begins_s);
        let flights = station.flights(from_s).unwrap_or_default();
        let rates_hz: BTreeMap<u16, f64> = flights
            .iter()
            .map(|(slot, flight)| (*slot, rate_hz(&flight.effort.values.time_s, show_s)))
            .collect();
        let logs = flights.into_iter().map(|(slot, mut flight)| {
            // No message has it, and packs keep theirs.
            flight.resistance_ohm = resistance_ohm(reference, slot);
            LogInput {
                slot: Some(slot),
                path: flight.source.clone(),
                at_hand: Some(AtHand(Arc::new(flight))),
                ..LogInput::default()
            }
        });
        let sag = if station.are_of(REVISION) { of_virtual } else { found.sag };
        let found = Found { logs: logs.collect(), sag, ..found.clone() };
        if !found.logs.is_empty() {
            let work = Work::default();
            let input = one_input(&work, &found);
            let looked = pool
                .install(|| analyze_flight(&input, &settings.options, Some(reference), &|_, _| {}));
            // Too little was heard yet, for example: the next look may have more.
            let (map, warnings) =
                looked.map_or_else(|_| (None, Vec::new()), |flight| (flight.map, flight.warnings));
            let others = warnings.iter().find(|told| matches!(told, Warning::LawsOfOthers { .. }));
            if let Some(others) = others.filter(|_| !has_doubted) {
                has_doubted = true;
                station.say(Level::Warning, &others.to_string());
            }
            if let Some(map) = map {
                let (view, of) = shown(&map, from_s, &rates_hz);
                let look = Look { time_s: view.time_s, of: of.clone() };
                shared.looks.lock().unwrap_or_else(PoisonError::into_inner).push(look);
                station.air(Some(view), of);
                has_told = true;
            }
        }
        let took = clock.now().saturating_sub(begun);
        shared.wait(Duration::from_micros((took * u64::from(SHARE)).max(CLOSEST)));
    }
}

/// Messages a second of these times, over the last seconds before `now_s`.
fn rate_hz(times_s: &[f64], now_s: f64) -> f64 {
    let recent = times_s.iter().filter(|time_s| **time_s > now_s - RATE_OVER_S).count();
    recent as f64 / RATE_OVER_S
}

/// Standard error that messages at this rate add to a drone's mean over 10 s, m/s: on a link that loses, or of drones whose
/// time runs faster, fewer come than were asked for.
fn cost_mps(rate_hz: f64) -> f64 {
    COST_MPS_HZ / rate_hz.max(0.1)
}

/// What of telemetry's map is shown, and what it lacks, by the rates at which slots are heard, Hz.
fn shown(
    map: &UpdraftMap,
    from_s: f64,
    rates_hz: &BTreeMap<u16, f64>,
) -> (AirView, BTreeMap<u16, (f64, f64)>) {
    let (latest_s, mut of) = of_map::latest(map);
    let latest_s = latest_s.unwrap_or(from_s);
    let span_s = map.time_s.first().map_or(0.0, |first_s| latest_s - first_s);
    let rate_hz = numeric::median(rates_hz.values().copied().collect()).unwrap_or_default();
    for (slot, (_, error)) in &mut of {
        let rate_hz = rates_hz.get(slot).copied().unwrap_or_default();
        *error = error.hypot(cost_mps(rate_hz));
    }
    let cost_mps = cost_mps(rate_hz);
    let note = format!(
        "From telemetry at {rate_hz:.1} Hz: {span_s:.0} s of the hover, and the colours are 10 s means. \
         At this rate a drone's own mean is off by {cost_mps:.2} m/s for want of messages. The logs tell it again, \
         and better."
    );
    let mut view = latest_view(map, latest_s, true, note);
    let fleet = map.posterior.as_ref().and_then(|posterior| posterior.fleet);
    view.fleet_mps = fleet.map(|fleet| {
        let se = fleet.se.hypot(COST_OF_FLEET * cost_mps);
        of_map::interval_mps(Estimate { se, ..fleet })
    });
    (view, of)
}

/// What of the logs' map is shown: the end of the hover, and how far the page was from it.
fn final_view(
    map: &UpdraftMap,
    agreement: Option<&Agreement>,
) -> (AirView, BTreeMap<u16, (f64, f64)>) {
    let (latest_s, of) = of_map::latest(map);
    let mut note =
        "From the logs: the mean is over the whole hover, the colours are of its last seconds."
            .to_owned();
    if let Some(agreement) = agreement {
        note = format!("{note} {agreement}.");
    }
    (latest_view(map, latest_s.unwrap_or_default(), false, note), of)
}

/// Mean of a map, and what is known between the drones at its end.
fn latest_view(map: &UpdraftMap, time_s: f64, provisional: bool, note: String) -> AirView {
    let posterior = map.posterior.as_ref();
    let grid = posterior.and_then(|posterior| posterior.grid.as_ref());
    AirView {
        provisional,
        time_s,
        fleet_mps: posterior.and_then(|posterior| posterior.fleet).map(of_map::interval_mps),
        map: grid.and_then(|grid| of_map::maps(grid).next_back()).map(|(_, map)| map),
        note,
    }
}
