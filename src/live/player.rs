//! A flight as its logs tell it, at any time and any speed.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::facts::{Facts, centi};
use super::http::guard::Rank;
use super::orders::{Refused, Said as Answered, Wish};
use super::source::Source;
use super::view::{AirMap, AirView, DroneView, Level, Replay, Said, Step, View};
use crate::link::clock::{Clock, Micros};
use crate::mission::Plan;
use crate::protocol::show::Stage;
use crate::show::trajectory::{Cursor, Trajectory};

/// Slowest and fastest replay.
pub const SPEEDS: [f64; 2] = [0.1, 60.0];
/// Distance from the trajectory at which a drone is far, m: as in the watch of a flight.
const FAR_M: f64 = 3.0;
/// A map is shown at times no further from its own, s.
const MAP_S: f64 = 10.0;

/// Trouble of a drone that was not logged.
const NO_LOG: &str = "its log is not here";

/// One drone of a replay, on an even grid of times.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Slot of the plan.
    pub slot: u16,
    /// Identifier, if the log has it.
    pub drone: Option<String>,
    /// Show time of the first place, s.
    pub first_s: f64,
    /// Distance of times, s.
    pub step_s: f64,
    /// Places in the show frame, heights above home, m; absent: the log has a gap.
    pub place_m: Vec<Option<[f32; 3]>>,
    /// Voltage by whole seconds from `first_s` on, V.
    pub voltage_v: Vec<Option<f32>>,
    /// Stages of the show, by the time at which each began, s.
    pub stages: Vec<(f64, u8)>,
    /// Stretches in which the motors were armed, s.
    pub armed_s: Vec<(f64, f64)>,
    /// Words of the station about the drone, by the time at which they were said, s.
    pub words: Vec<(f64, String)>,
    /// Doubts about the log, one sentence each.
    pub doubts: Vec<String>,
    /// Vertical air speed and standard error by whole seconds of show time from `air_first_s` on, m/s.
    pub air_mps: Vec<Option<[f32; 2]>>,
    /// Show time of the first of them, s.
    pub air_first_s: i64,
}

/// The air over the fleet, as it was analysed.
#[derive(Clone, Debug, Default)]
pub struct FleetAir {
    /// Mean and 95 % interval over the hover, m/s.
    pub fleet_mps: Option<[f64; 3]>,
    /// Maps between the drones, by the times that they are of, s.
    pub maps: Vec<(f64, AirMap)>,
    /// How it was made.
    pub note: String,
}

impl FleetAir {
    fn view(&self, time_s: f64) -> AirView {
        let near = |(at_s, _): &&(f64, AirMap)| (at_s - time_s).abs() <= MAP_S;
        let gap = |(at_s, _): &(f64, AirMap)| (at_s - time_s).abs();
        let map = self.maps.iter().filter(near).min_by(|a, b| gap(a).total_cmp(&gap(b)));
        AirView {
            provisional: false,
            time_s: map.map_or_else(|| time_s.round(), |(at_s, _)| *at_s),
            fleet_mps: self.fleet_mps,
            map: map.map(|(_, map)| map.clone()),
            note: self.note.clone(),
        }
    }
}

/// A flight that is played again.
pub struct Player {
    plan: Plan,
    clock: Arc<dyn Clock>,
    /// Tracks by slot, each with what was planned.
    tracks: Vec<(Track, Trajectory)>,
    air: Option<FleetAir>,
    /// What the station has said in that flight.
    said: Vec<Said>,
    ends_s: [f64; 2],
    state: Mutex<Playing>,
}

/// Where it stands.
#[derive(Clone, Copy, Debug)]
struct Playing {
    speed: f64,
    plays: bool,
    /// Show time at the moment `since`, s.
    at_s: f64,
    since: Micros,
}

impl std::fmt::Debug for Player {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Player").field("flight", &self.plan.name).finish_non_exhaustive()
    }
}

impl Player {
    /// A replay that begins at once; `said`: what its station has said then, numbered from 1.
    pub fn new(
        plan: &Plan,
        clock: Arc<dyn Clock>,
        mut tracks: Vec<Track>,
        (air, said): (Option<FleetAir>, Vec<Said>),
        speed: f64,
    ) -> Self {
        tracks.sort_by_key(|track| track.slot);
        // Words before and after a log do not make the flight longer; without logs they are all there is.
        let logged = tracks.iter().any(Track::is_logged);
        let counts = || tracks.iter().filter(|track| track.is_logged() || !logged);
        let first = counts().map(|track| track.first_s).reduce(f64::min);
        let last = counts().map(Track::end_s).reduce(f64::max);
        let ends_s = [first.unwrap_or(0.0).floor(), last.unwrap_or(0.0).ceil()];
        let state = Playing {
            speed: speed.clamp(SPEEDS[0], SPEEDS[1]),
            plays: true,
            at_s: ends_s[0],
            since: clock.now(),
        };
        let planned = |track: Track| {
            let slot = plan.slot(track.slot);
            let trajectory = slot.map(|slot| plan.trajectory(slot)).unwrap_or_default();
            (track, trajectory)
        };
        let tracks = tracks.into_iter().map(planned).collect();
        Self { plan: plan.clone(), clock, tracks, air, said, ends_s, state: Mutex::new(state) }
    }

    fn lock(&self) -> MutexGuard<'_, Playing> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the time forward; the end stops it.
    fn advance(&self) -> Playing {
        let mut state = self.lock();
        let now = self.clock.now();
        if state.plays {
            state.at_s += now.saturating_sub(state.since) as f64 * 1e-6 * state.speed;
        }
        if state.at_s >= self.ends_s[1] {
            state.at_s = self.ends_s[1];
            state.plays = false;
        }
        state.since = now;
        *state
    }
}

impl Track {
    /// Whether it has places, not words alone.
    fn is_logged(&self) -> bool {
        !self.place_m.is_empty()
    }

    /// Show time at which its log ends, or of its last words, s.
    fn end_s(&self) -> f64 {
        match self.words.last() {
            Some((said_s, _)) if !self.is_logged() => *said_s,
            _ => self.first_s + self.step_s * self.place_m.len() as f64,
        }
    }

    fn place(&self, time_s: f64) -> Option<[f64; 3]> {
        let at = (time_s - self.first_s) / self.step_s;
        if at < 0.0 {
            return None;
        }
        let low = at.floor() as usize;
        let (a, b) = (self.place_m.get(low).copied()??, self.place_m.get(low + 1).copied()??);
        let part = at - at.floor();
        Some(std::array::from_fn(|i| f64::from(a[i]) * (1.0 - part) + f64::from(b[i]) * part))
    }

    fn by_second<T: Copy>(values: &[Option<T>], first_s: f64, time_s: f64) -> Option<T> {
        let index = (time_s - first_s).round();
        (index >= 0.0).then(|| values.get(index as usize).copied().flatten())?
    }

    /// Latest words, which a live page would show at this time.
    fn words_at(&self, time_s: f64) -> String {
        let until = self.words.partition_point(|(said_s, _)| *said_s <= time_s);
        let last = until.checked_sub(1).and_then(|at| self.words.get(at));
        last.map_or_else(String::new, |(_, words)| words.clone())
    }

    fn stage_at(&self, time_s: f64) -> Option<Stage> {
        let until = self.stages.partition_point(|(from_s, _)| *from_s <= time_s);
        let last = until.checked_sub(1).and_then(|at| self.stages.get(at));
        last.map(|(_, number)| Stage::from_number(*number))
    }

    fn view(&self, planned: &Trajectory, time_s: f64) -> DroneView {
        let armed = self.armed_s.iter().any(|(from, to)| (*from..=*to).contains(&time_s));
        let stage = match self.stage_at(time_s) {
            // Out of the show mode, on its way home or down.
            Some(Stage::Off) if armed => "not in the show".to_owned(),
            Some(stage) => stage.to_string(),
            None if armed => "armed".to_owned(),
            None => "on the ground".to_owned(),
        };
        let place_m = self.place(time_s);
        let performs = self.stages.is_empty()
            || self.stage_at(time_s).is_some_and(|stage| stage == Stage::Performing);
        let wanted = (armed && performs).then(|| {
            let mut at = Cursor::new(planned).state_at(time_s).position_m;
            at.z -= planned.start_m.z;
            at
        });
        let distance_m = place_m.zip(wanted).map(|(place, wanted)| {
            (0..3).map(|i| (place[i] - wanted[i]).powi(2)).sum::<f64>().sqrt()
        });
        let ended = self.is_logged() && time_s > self.end_s();
        let (level, trouble) = match distance_m {
            // What its station said of it is all that there is.
            _ if !self.is_logged() => (Level::Good, String::new()),
            Some(far_m) if far_m > FAR_M => {
                (Level::Alarm, format!("{far_m:.1} m off its trajectory"))
            }
            _ if place_m.is_none() && armed => (Level::Notice, "the log has a gap".to_owned()),
            _ => (Level::Good, String::new()),
        };
        let air = Self::by_second(&self.air_mps, self.air_first_s as f64, time_s);
        DroneView {
            slot: Some(self.slot),
            drone: self.drone.clone(),
            stage: if ended { "log ends".to_owned() } else { stage },
            armed: Some(armed),
            battery_v: Self::by_second(&self.voltage_v, self.first_s, time_s)
                .map(|volts| centi(f64::from(volts))),
            place_m: place_m.map(|place| place.map(centi)),
            distance_m: distance_m.map(centi),
            level,
            trouble,
            words: self.words_at(time_s),
            air_mps: air.map(|[value, _]| centi(f64::from(value))),
            air_se_mps: air.map(|[_, error]| centi(f64::from(error))),
            ..DroneView::default()
        }
    }
}

impl Source for Player {
    fn facts(&self) -> Facts {
        Facts::of(&self.plan, true)
    }

    fn view(&self, now_ms: u64) -> View {
        let state = self.advance();
        let mut tracks = self.tracks.iter().peekable();
        let drones = self.plan.slots.iter().map(|slot| {
            while tracks.next_if(|track| track.0.slot < slot.slot).is_some() {}
            match tracks.next_if(|track| track.0.slot == slot.slot) {
                Some((track, planned)) => track.view(planned, state.at_s),
                None => DroneView {
                    slot: Some(slot.slot),
                    stage: "no log".to_owned(),
                    level: Level::Notice,
                    trouble: NO_LOG.to_owned(),
                    ..DroneView::default()
                },
            }
        });
        let drones = drones.collect();
        let doubts = self.tracks.iter().flat_map(|(track, _)| {
            track.doubts.iter().map(|doubt| format!("slot {}: {doubt}", track.slot))
        });
        let doubts = doubts.zip(1 + self.said.len() as u64..).map(|(text, number)| Said {
            number,
            at_ms: now_ms,
            level: Level::Notice,
            text,
        });
        let said = self.said.iter().cloned().chain(doubts);
        View {
            now_ms,
            show_s: Some(centi(state.at_s)),
            step: Step::Replay,
            waits: String::new(),
            drones,
            said: said.collect(),
            air: self.air.as_ref().map(|air| air.view(state.at_s)),
            replay: Some(Replay { ends_s: self.ends_s, speed: state.speed, plays: state.plays }),
            ..View::default()
        }
    }

    fn wish(&self, _: Rank, wish: &Wish) -> Answered {
        let Wish::Replay { speed, plays, at_s } = wish else {
            return Err(Refused::Nothing("this is a replay: nobody is in the air".to_owned()));
        };
        self.advance();
        let mut state = self.lock();
        if let Some(speed) = speed.filter(|speed| speed.is_finite()) {
            state.speed = speed.clamp(SPEEDS[0], SPEEDS[1]);
        }
        if let Some(at_s) = at_s.filter(|at_s| at_s.is_finite()) {
            state.at_s = at_s.clamp(self.ends_s[0], self.ends_s[1]);
        }
        if let Some(plays) = *plays {
            // From the end it begins anew.
            if plays && state.at_s >= self.ends_s[1] {
                state.at_s = self.ends_s[0];
            }
            state.plays = plays;
        }
        Ok(String::new())
    }
}
