//! A flown or simulated campaign in a browser, from its logs and its journal.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use rayon::prelude::*;

use super::of_map;
use super::recorded::OfJournal;
use super::serve::{LiveWish, Served, serve};
use crate::analysis::result::{Analysis, FlightAnalysis};
use crate::analysis::slots::whose_logs;
use crate::analysis::{FlightInput, LogInput};
use crate::base::causes::with_causes;
use crate::base::plain::Shown as _;
use crate::campaign::origin::{self, LogOrigin};
use crate::campaign::{self, FlightFolder, read_json};
use crate::flight::{Flight, FlightOptions, Series};
use crate::live::player::{FleetAir, Player, Track};
use crate::live::source::Source;
use crate::mission::Plan;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{Found, Work, find};
use crate::workflow::host::Host;
use crate::workflow::words::count;

/// Places are so far apart, s.
const STEP_S: f64 = 0.2;
/// A gap of a log is longer than this, s.
const GAP_S: f64 = 1.0;
/// No log is longer, s.
const LONGEST_S: f64 = 6.0 * 3600.0;

/// What is replayed, and how.
#[derive(Clone, Debug)]
pub(crate) struct ReplayWish {
    /// Folder of the campaign.
    pub(crate) campaign: PathBuf,
    /// Name of the flight; absent: the last that has logs, or else the last that has a journal.
    pub(crate) flight: Option<String>,
    /// Whose logs; absent: real drones', if there are any.
    pub(crate) origin: Option<LogOrigin>,
    /// Times as fast as the flight.
    pub(crate) speed: f64,
}

/// A replay that is being served.
pub(crate) struct Replayed {
    _served: Served,
    /// Name of the flight.
    pub(crate) flight: String,
    /// Drones with a log, and drones of which the journal alone tells.
    pub(crate) drones: (usize, usize),
}

/// Reads the logs and the journal of a flight, and serves its page.
///
/// # Errors
/// If there is no such flight, it has neither logs nor a journal, or none can be read.
pub(crate) fn replay(
    host: &dyn Host,
    wish: &ReplayWish,
    live: &LiveWish,
) -> Result<Replayed, WorkflowError> {
    let folders = campaign::flights(&wish.campaign)?;
    let mut work = Work::new(&wish.campaign);
    work.origin = Some(wish.origin.unwrap_or_else(|| origin::default_of(&folders)));
    find(&wish.campaign, None, &mut work)?;
    for used in &work.used {
        host.say(used);
    }
    let found = chosen(&work, wish.flight.as_deref())?;
    let plan = found.plan.as_ref().ok_or_else(|| {
        WorkflowError::Nothing(format!("{}: no plan to replay it by", found.name))
    })?;
    let analysis: Option<Analysis> = read_json(&wish.campaign.join("analysis.json")).ok();
    let analysed = analysis
        .as_ref()
        .and_then(|analysis| analysis.flights.iter().find(|flight| flight.name == found.name));
    let mut journal = of_journal(host, &work, &folders, found)?;
    let mut tracks = match found.logs[..] {
        [] => Vec::new(),
        _ => match tracks(host, found, plan, analysed) {
            // Those of an earlier flight, as long as this one's are not home.
            Err(WorkflowError::Nothing(reason)) if !journal.tracks.is_empty() => {
                host.warn(&format!("{reason}; replayed from its journal alone"));
                Vec::new()
            }
            read => read?,
        },
    };
    let logged = tracks.len();
    let mut of_slot = std::mem::take(&mut journal.tracks);
    let said = journal.said_by_show_time();
    for track in &mut tracks {
        track.words = of_slot.remove(&track.slot).map(|told| told.words).unwrap_or_default();
    }
    tracks.extend(of_slot.into_values());
    let drones = (logged, tracks.len() - logged);
    if tracks.is_empty() {
        return Err(nothing(&found.name));
    }
    let air = analysed.and_then(fleet_air);
    let player = Player::new(plan, Arc::clone(host.clock()), tracks, (air, said), wish.speed);
    let source: Arc<dyn Source> = Arc::new(player);
    let served = serve(host, &wish.campaign, &wish.campaign, &source, live)?;
    Ok(Replayed { _served: served, flight: found.name.clone(), drones })
}

/// The flight that is meant.
fn chosen<'a>(work: &'a Work, name: Option<&str>) -> Result<&'a Found, WorkflowError> {
    let names =
        || work.flights.iter().map(|found| found.name.as_str()).collect::<Vec<_>>().join(", ");
    if let Some(name) = name {
        return work.flights.iter().find(|found| found.name == name).ok_or_else(|| {
            WorkflowError::Usage(format!("the campaign has no flight \"{name}\", but {}", names()))
        });
    }
    let logged = work.flights.iter().rev().find(|found| !found.logs.is_empty());
    let flown = |found: &&Found| found.start.is_some();
    logged.or_else(|| work.flights.iter().rev().find(flown)).ok_or_else(|| nothing(&names()))
}

fn nothing(names: &str) -> WorkflowError {
    WorkflowError::Nothing(format!(
        "{names}: neither logs nor the journal of a flight: fly it, or simulate it with `updraft simulate`"
    ))
}

/// What the journal says of the flight; nothing of flights that were simulated.
fn of_journal(
    host: &dyn Host,
    work: &Work,
    folders: &[FlightFolder],
    found: &Found,
) -> Result<OfJournal, WorkflowError> {
    if work.origin == Some(LogOrigin::Simulated) {
        return Ok(OfJournal::default());
    }
    let is_its = |folder: &&FlightFolder| {
        folder
            .read_plan()
            .is_ok_and(|plan| Some(&plan.name) == found.plan.as_ref().map(|of| &of.name))
    };
    let Some(folder) = folders.iter().find(is_its) else { return Ok(OfJournal::default()) };
    match OfJournal::read(folder) {
        Err(error) if !found.logs.is_empty() => {
            host.warn(&format!("replayed without its journal: {}", with_causes(&error, ": ")));
            Ok(OfJournal::default())
        }
        read => read,
    }
}

/// One track for each log whose slot is known.
fn tracks(
    host: &dyn Host,
    found: &Found,
    plan: &Plan,
    analysed: Option<&FlightAnalysis>,
) -> Result<Vec<Track>, WorkflowError> {
    let input = FlightInput {
        name: &found.name,
        plan: Some(plan),
        purpose: found.purpose,
        logs: &found.logs,
        start: found.start,
        ..FlightInput::default()
    };
    let (slots, _) = whose_logs(&input);
    let work: Vec<_> = found.logs.iter().zip(slots).collect();
    let progress = host.progress("reading", work.len() as u64);
    let read = |(log, slot): &(&LogInput, Result<Option<u16>, _>)| {
        let read = match slot {
            Ok(Some(slot)) => track(log, *slot, plan, found, analysed),
            Ok(None) => Err("of which slot it is nobody knows".to_owned()),
            Err(cause) => Err(format!("{cause}")),
        };
        progress.advance();
        read.map_err(|reason| format!("{}: {reason}", log.path.shown()))
    };
    let read: Vec<Result<Track, String>> = work.par_iter().map(read).collect();
    progress.finish();
    host.check_stop()?;
    let mut tracks: BTreeMap<u16, Track> = BTreeMap::new();
    let mut lost = Vec::new();
    for one in read {
        match one {
            Ok(track) => {
                tracks.entry(track.slot).or_insert(track);
            }
            Err(reason) => lost.push(reason),
        }
    }
    for reason in &lost {
        host.warn(reason);
    }
    if tracks.is_empty() {
        return Err(WorkflowError::Nothing(format!(
            "{}: none of {} can be replayed, for the reasons above",
            found.name,
            count(found.logs.len(), "log")
        )));
    }
    Ok(tracks.into_values().collect())
}

fn track(
    log: &LogInput,
    slot: u16,
    plan: &Plan,
    found: &Found,
    analysed: Option<&FlightAnalysis>,
) -> Result<Track, String> {
    let place = plan.slot(slot).ok_or("the plan has no such slot")?;
    let options = FlightOptions {
        start: found.start,
        segments: Some(plan.segments(place)),
        ..FlightOptions::default()
    };
    let flight = Flight::open(&log.path, options).map_err(|error| with_causes(&error, ": "))?;
    let (first, last) = flight.height_m.span().ok_or("the log says nothing of heights")?;
    let (first_s, last_s) = (first.floor(), last.ceil().min(first + LONGEST_S));
    let frame = plan.site.frame();
    let moved = |series: &Series, time_s: f64| {
        Some(series.at(time_s, GAP_S)? - series.value.first().copied()?)
    };
    let steps = ((last_s - first_s) / STEP_S).ceil().max(1.0) as usize;
    let place_m = (0..=steps).map(|step| {
        let time_s = first_s + STEP_S * step as f64;
        let north = moved(&flight.north_m, time_s)?;
        let east = moved(&flight.east_m, time_s)?;
        let show = frame.from_neu([north, east, 0.0].into());
        let at = [
            place.home_m[0] + show.x,
            place.home_m[1] + show.y,
            flight.height_m.at(time_s, GAP_S)?,
        ];
        Some(at.map(|value| value as f32))
    });
    let voltage = flight.voltage_v.as_ref();
    let seconds = (last_s - first_s).ceil() as usize;
    let (air_first_s, air_mps) = analysed.and_then(|of| air_of(of, slot)).unwrap_or_default();
    Ok(Track {
        slot,
        drone: flight.system_id.map(|system| system.to_string()),
        first_s,
        step_s: STEP_S,
        place_m: place_m.collect(),
        voltage_v: (0..=seconds)
            .map(|second| {
                let volts = voltage?.latest(first_s + second as f64, 2.0 * GAP_S)?;
                Some(volts as f32)
            })
            .collect(),
        words: Vec::new(),
        stages: flight.stages.clone(),
        armed_s: flight.armed_s.clone(),
        doubts: flight.warnings.iter().map(ToString::to_string).collect(),
        air_mps,
        air_first_s,
    })
}

/// The air at a slot, by whole seconds: the posterior, or the drone's own estimate where there is none.
fn air_of(analysed: &FlightAnalysis, slot: u16) -> Option<(i64, Vec<Option<[f32; 2]>>)> {
    let map = analysed.map.as_ref()?;
    let drone = map.drones.iter().find(|drone| drone.slot == Some(slot))?;
    let first_s = map.time_s.first()?.round() as i64;
    let value =
        |value: Option<(f64, f64)>| value.map(|(value, error)| [value as f32, error as f32]);
    Some((first_s, of_map::values(drone).map(value).collect()))
}

/// Mean over fleet and hover, and maps between the drones.
fn fleet_air(analysed: &FlightAnalysis) -> Option<FleetAir> {
    let Some(posterior) = analysed.map.as_ref()?.posterior.as_ref() else {
        let note = "From the logs: the colours are each drone's own estimate at this time";
        return Some(FleetAir { note: note.to_owned(), ..FleetAir::default() });
    };
    let grid = posterior.grid.as_ref();
    Some(FleetAir {
        fleet_mps: posterior.fleet.map(of_map::interval_mps),
        maps: grid.map(|grid| of_map::maps(grid).collect()).unwrap_or_default(),
        note: "From the logs: the mean is over the whole hover, the colours are the posterior at this time"
            .to_owned(),
    })
}
