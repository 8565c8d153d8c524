//! Data of the page's interactive parts: every drone of a flight over time, and the replay of its tracks.
//!
//! The page itself holds what fits: of small fleets everything, of large ones every few seconds. Then files beside
//! the page hold the rest, some drones each, which the page loads when one of them is picked.

use minijinja::context;
use minijinja::value::Value;
use rayon::prelude::*;
use serde::Serialize;

use crate::analysis::result::{DroneUpdraft, FlightAnalysis, UpdraftMap};

use super::colour::diverging;
use super::delta::packed;
use super::film::{COLOURS, thinned};
use super::frames::{Frames, scale_end};
use super::page_air::colour_bar;
use super::text::{clean, effort_name, shortened, unit, usable};
use super::tracks::{Times, Track, track};

/// Samples of one channel in the page, all drones together.
const MOST_SAMPLES: usize = 160_000;
/// Drones in a file beside the page.
const DRONES_PER_FILE: usize = 20;

/// Steps of coded values.
const PLACE_M: f64 = 0.01;
const SPEED_MPS: f64 = 0.01;
const AIR_MPS: f64 = 0.001;
const EFFORT: f64 = 0.1;

/// What the scripts read. Rows are drones, one after the other in each text.
#[derive(Serialize)]
struct Data {
    flight: String,
    /// By which the drones are picked, all over the page.
    picks: Vec<String>,
    names: Vec<String>,
    /// From the lower end of the scale to the upper one.
    colours: Vec<String>,
    /// End of the scale, m/s.
    limit: f64,
    /// Name and unit of the rotor effort.
    effort: [String; 2],
    air: Option<Air>,
    tracks: Option<Tracks>,
    /// Drones in each file beside the page; absent: there are none, the page holds everything.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<usize>,
}

/// The vertical air speed.
#[derive(Serialize)]
struct Air {
    /// Row of each drone in the values; null: it has none.
    rows: Vec<Option<usize>>,
    /// Element whose film holds the values; absent: they are here.
    #[serde(skip_serializing_if = "Option::is_none")]
    film: Option<String>,
    #[serde(flatten)]
    own: Option<Values>,
    /// How far the 95 % interval reaches below and above each value.
    #[serde(skip_serializing_if = "Option::is_none")]
    reach: Option<[String; 2]>,
}

/// Values of the air.
#[derive(Serialize)]
struct Values {
    /// Show times, s.
    times: Vec<f64>,
    estimate: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior: Option<[String; 2]>,
}

/// Tracks on common times.
#[derive(Serialize)]
struct Tracks {
    start: f64,
    step: f64,
    count: usize,
    /// Forward, left, up, m.
    place: [String; 3],
    climb: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    effort: Option<String>,
}

/// A file beside the page: everything about some drones.
#[derive(Serialize)]
struct Detail {
    /// Their rows in the page.
    first: usize,
    air: Option<Air>,
    tracks: Option<Tracks>,
}

/// The interactive parts of a flight.
pub(super) struct Explorer {
    /// For the template.
    pub(super) values: Value,
    /// Files beside the page: names without `.js`, and their content.
    pub(super) files: Vec<(String, String)>,
}

/// By which a drone is picked in all parts of the page: its slot, else its name.
pub(super) fn pick(slot: Option<u16>, name: &str) -> String {
    slot.map_or_else(|| shortened(name, 64), |slot| slot.to_string())
}

/// The interactive parts of a flight; `None` where there is nothing over time.
pub(super) fn explorer(
    flight: &FlightAnalysis,
    key: &str,
    frames: Option<&Frames<'_>>,
    film: bool,
) -> Option<Explorer> {
    let map = flight.map.as_ref();
    let rows = map.map_or_else(Vec::new, |map| rows_of(flight, map));
    let fine = Times::of(flight, usize::MAX);
    let coarse = Times::of(flight, MOST_SAMPLES);
    let tracks: Vec<Track> = fine.map_or_else(Vec::new, |times| tracks_of(flight, times));
    let times: Vec<usize> = match (map, frames.filter(|_| film)) {
        (_, Some(frames)) => frames.times.clone(),
        (Some(map), None) => (0..map.time_s.len()).collect(),
        (None, None) => Vec::new(),
    };
    let shown = thinned(&times, map.map_or(0, |map| map.drones.len()));
    let whole = fine == coarse && shown.len() == times.len();
    let air = map.filter(|_| shown.len() > 1).map(|map| {
        let all: Vec<usize> = (0..map.drones.len()).collect();
        Air {
            film: film.then(|| format!("film-{key}")),
            own: (!film).then(|| Values::of(map, &all, &shown)),
            reach: whole.then(|| reach(map, &all, &shown)).flatten(),
            rows: rows.clone(),
        }
    });
    let picks: Vec<String> =
        flight.drones.iter().map(|drone| pick(drone.slot, &drone.name)).collect();
    let names: Vec<String> = flight.drones.iter().map(|drone| shortened(&drone.name, 32)).collect();
    let limit_mps = match (map, frames) {
        (Some(_), Some(frames)) => frames.limit_mps,
        (Some(map), None) => {
            let values = map.drones.iter().flat_map(|drone| drone.updraft_mps.iter().flatten());
            scale_end(values.copied().filter(|w| usable(*w)).map(f64::abs).collect())
        }
        _ => {
            let climbs = tracks.iter().flat_map(|track| track.climb_mps.iter().flatten());
            scale_end(climbs.copied().map(f64::abs).collect())
        }
    };
    let in_page = match coarse {
        Some(times) if times != fine? => Some(Tracks::of(&tracks_of(flight, times), times, false)),
        Some(times) => Some(Tracks::of(&tracks, times, true)),
        None => None,
    };
    if air.is_none() && in_page.is_none() {
        return None;
    }
    let files = if whole { Vec::new() } else { files(flight, key, &rows, fine, &tracks, &times) };
    let banded = map.is_some_and(|map| {
        map.posterior.is_some() || map.drones.iter().any(|drone| !drone.interval_mps.is_empty())
    });
    let choices: Vec<Value> = (picks.iter().zip(&names))
        .map(|(pick, name)| context! { pick, label => label(pick, name) })
        .collect();
    let placed = flight.drones.iter().any(|drone| drone.home_m.is_some());
    let data = Data {
        flight: key.to_owned(),
        picks,
        names,
        colours: (0..=COLOURS)
            .map(|i| diverging(2.0 * f64::from(i) / f64::from(COLOURS) - 1.0))
            .collect(),
        limit: limit_mps,
        effort: [effort_name(flight.indicator).to_owned(), unit(flight.indicator.unit())],
        files: (!files.is_empty()).then_some(DRONES_PER_FILE),
        air,
        tracks: in_page,
    };
    let values = context! {
        key,
        air => data.air.is_some(),
        tracks => data.tracks.is_some(),
        replay => data.tracks.is_some() && tracks.iter().any(Track::has_place),
        posterior => map.is_some_and(|map| map.posterior.is_some()),
        banded,
        truth => film && frames.is_some_and(|frames| frames.truth_known),
        placed,
        north => flight.orientation_deg.is_some(),
        turn => flight.orientation_deg.filter(|deg| usable(*deg)).unwrap_or(0.0),
        files => data.files.is_some(),
        effort => format!("{} ({})", data.effort[0], data.effort[1]),
        choices,
        bar => colour_bar(limit_mps),
        json => Value::from_safe_string(in_script(&data)?),
    };
    Some(Explorer { values, files })
}

/// `Drone 7`, or `7: Lea` where the name does not tell the slot.
fn label(pick: &str, name: &str) -> String {
    if name.contains(pick) { clean(name) } else { format!("{pick}: {}", clean(name)) }
}

/// JSON in which nothing can end the script that holds it.
fn in_script(data: &impl Serialize) -> Option<String> {
    Some(serde_json::to_string(data).ok()?.replace('<', "\\u003c"))
}

/// Which of the map's drones each drone of the flight is.
fn rows_of(flight: &FlightAnalysis, map: &UpdraftMap) -> Vec<Option<usize>> {
    let same = |drone: &crate::analysis::result::DroneAnalysis, one: &DroneUpdraft| match drone.slot
    {
        Some(slot) => one.slot == Some(slot),
        None => one.slot.is_none() && one.name == drone.name,
    };
    let row = |drone| map.drones.iter().position(|one| same(drone, one));
    flight.drones.iter().map(row).collect()
}

fn tracks_of(flight: &FlightAnalysis, times: Times) -> Vec<Track> {
    flight.drones.par_iter().map(|drone| track(flight, drone, times)).collect()
}

/// A file for every few drones.
fn files(
    flight: &FlightAnalysis,
    key: &str,
    rows: &[Option<usize>],
    times: Option<Times>,
    tracks: &[Track],
    shown: &[usize],
) -> Vec<(String, String)> {
    let map = flight.map.as_ref();
    let firsts = (0..flight.drones.len()).step_by(DRONES_PER_FILE);
    let file = |first: usize| {
        let last = (first + DRONES_PER_FILE).min(flight.drones.len());
        let some = rows.get(first..last).unwrap_or_default();
        let of: Vec<usize> = some.iter().copied().flatten().collect();
        let air = map.filter(|_| !of.is_empty()).map(|map| Air {
            rows: some.iter().map(|row| of.iter().position(|of| Some(*of) == *row)).collect(),
            film: None,
            own: Some(Values::of(map, &of, shown)),
            reach: reach(map, &of, shown),
        });
        let tracks = times
            .zip(tracks.get(first..last))
            .map(|(times, tracks)| Tracks::of(tracks, times, true));
        let detail = in_script(&Detail { first, air, tracks })?;
        let flight = in_script(&key)?;
        let name = format!("{key}-{}", first / DRONES_PER_FILE + 1);
        Some((name, format!("updraft.detail({flight},{detail});\n")))
    };
    firsts.filter_map(file).collect()
}

impl Values {
    /// The air of some drones of a map at some of its times.
    fn of(map: &UpdraftMap, drones: &[usize], times: &[usize]) -> Self {
        let at = |of: &dyn Fn(&DroneUpdraft) -> &[Option<f64>]| rows(map, drones, times, of);
        Self {
            times: times.iter().filter_map(|time| map.time_s.get(*time).copied()).collect(),
            estimate: at(&|drone| &drone.updraft_mps),
            posterior: map
                .posterior
                .as_ref()
                .map(|_| [at(&|drone| &drone.posterior_mps), at(&|drone| &drone.posterior_sd_mps)]),
        }
    }
}

fn rows(
    map: &UpdraftMap,
    drones: &[usize],
    times: &[usize],
    of: &dyn Fn(&DroneUpdraft) -> &[Option<f64>],
) -> String {
    let one = |drone: &usize| {
        let values = map.drones.get(*drone).map_or(&[][..], of);
        times.iter().map(|time| values.get(*time).copied().flatten()).collect::<Vec<_>>()
    };
    packed(drones.iter().map(one), AIR_MPS)
}

/// How far the intervals reach below and above the values; `None` where they are not known.
fn reach(map: &UpdraftMap, drones: &[usize], times: &[usize]) -> Option<[String; 2]> {
    map.drones.iter().find(|drone| !drone.interval_mps.is_empty())?;
    let ends = |end: usize| {
        let one = |drone: &usize| {
            let drone = map.drones.get(*drone);
            let away = |time: &usize| {
                let value = drone?.updraft_mps.get(*time).copied().flatten()?;
                let interval = drone?.interval_mps.get(*time).copied().flatten()?;
                Some((interval[end] - value).abs())
            };
            times.iter().map(away).collect::<Vec<_>>()
        };
        packed(drones.iter().map(one), AIR_MPS)
    };
    Some([ends(0), ends(1)])
}

impl Tracks {
    fn of(tracks: &[Track], times: Times, with_effort: bool) -> Self {
        let channel = |of: &dyn Fn(&Track) -> &Vec<Option<f64>>, step: f64| {
            packed(tracks.iter().map(|track| of(track).iter().copied()), step)
        };
        Self {
            start: times.start_s,
            step: times.step_s,
            count: times.count,
            place: [0, 1, 2].map(|axis| channel(&|track| &track.place_m[axis], PLACE_M)),
            climb: channel(&|track| &track.climb_mps, SPEED_MPS),
            effort: with_effort.then(|| channel(&|track| &track.effort, EFFORT)),
        }
    }
}
