//! A flight as its station hears it.
//!
//! The station's own work goes on beside this: it tells what it hears and does ([`Station::hear`] and the others), and
//! pages ask for a view. Both take a lock for as long as they write or read a few numbers.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::facts::{Facts, centi};
use super::http::guard::Rank;
use super::orders::{Refused, Said as Answered, Wish};
use super::source::Source;
use super::thin::Thin;
use super::trouble::{Looked, trouble};
use super::view::{AirView, DroneView, Level, PreflightView, Question, Said, Step, View};
use crate::base::causes::with_causes;
use crate::base::time::GpsTime;
use crate::fleet::abort::Action;
use crate::fleet::messages::{LAND, RTL, mode_name};
use crate::fleet::order_handler::Notice;
use crate::fleet::orders::{OrderFrom, give};
use crate::fleet::preflight::{COLUMNS, Preflight};
use crate::fleet::slots::{FleetTable, geodetic};
use crate::fleet::telemetry::{Drone, Telemetry};
use crate::fleet::watch::{Flying, Limits, Monitor};
use crate::flight::Flight;
use crate::link::clock::{Clock, Micros, S};
use crate::link::conversation::Observer as _;
use crate::link::id::DroneId;
use crate::link::net::Received;
use crate::mission::Plan;
use crate::protocol::show::Stage;

/// Sentences that are kept.
const MOST_SAID: usize = 300;
/// Bytes a second that streams for the air may cost a link.
const LINK_BYTES_PER_S: f64 = 50_000.0;
/// Bytes of one round of a drone: ATTITUDE, GLOBAL_POSITION_INT and SERVO_OUTPUT_RAW.
const STREAM_BYTES: f64 = 125.0;
/// Rounds a second: at most, and at least.
const FASTEST_HZ: f64 = 4.0;
const SLOWEST_HZ: f64 = 1.0;
/// Charge is a rate after so long in the air, us.
const RATED: Micros = 60 * S;
/// Charge that was used must be so much to be a rate, %.
const RATED_PERCENT: f64 = 1.0;

/// A drone's text is shown so long, us.
const TEXT_SHOWN: Micros = 30 * S;

/// Answer of a person at a page.
type Line = io::Result<Option<String>>;

/// Flight at hand, shared between its station and its pages.
pub struct Station {
    plan: Plan,
    folder: PathBuf,
    clock: Arc<dyn Clock>,
    limits: Limits,
    now: Mutex<Now>,
}

struct Now {
    monitor: Monitor,
    start_gps_ms: Option<i64>,
    step: Step,
    waits: String,
    question: Option<Question>,
    answers: Option<SyncSender<Line>>,
    questions: u64,
    said: VecDeque<Said>,
    said_ever: u64,
    preflight: Option<PreflightView>,
    orders: BTreeMap<DroneId, String>,
    orders_ever: u64,
    words: BTreeMap<DroneId, String>,
    /// When each drone took off, and the charge that it had.
    charge: BTreeMap<DroneId, (Micros, f64)>,
    air: Option<AirView>,
    air_of: BTreeMap<u16, (f64, f64)>,
    /// Channels for the air, if it is wanted.
    thin: Option<Thin>,
}

impl std::fmt::Debug for Station {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Station").field("flight", &self.plan.name).finish_non_exhaustive()
    }
}

impl Station {
    /// A flight of a plan, whose orders go through `folder`.
    pub fn new(plan: &Plan, folder: PathBuf, clock: Arc<dyn Clock>) -> Self {
        let limits = Limits::of(plan);
        let table = FleetTable::new([]);
        let monitor = Monitor::new(plan, &table, Telemetry::default(), limits);
        let now = Now {
            monitor,
            start_gps_ms: None,
            step: Step::default(),
            waits: String::new(),
            question: None,
            answers: None,
            questions: 0,
            said: VecDeque::new(),
            said_ever: 0,
            preflight: None,
            orders: BTreeMap::new(),
            orders_ever: 0,
            words: BTreeMap::new(),
            charge: BTreeMap::new(),
            air: None,
            air_of: BTreeMap::new(),
            thin: None,
        };
        Self { plan: plan.clone(), folder, clock, limits, now: Mutex::new(now) }
    }

    fn lock(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A message has come.
    pub fn hear(&self, received: &Received) {
        let mut now = self.lock();
        let now = &mut *now;
        now.monitor.on_message(self.clock.now(), received);
        if let Some(thin) = &mut now.thin {
            thin.hear(&now.monitor.telemetry, received);
        }
        now.take_events();
    }

    /// Keeps what the air is told from, of drones with so many motors, from now on.
    pub fn keep_air(&self, motors: usize) {
        self.lock().thin = Some(Thin::new(motors));
    }

    /// How often drones are to tell outputs and attitude, us; `None`: nobody wants them.
    pub fn stream_every(&self) -> Option<Micros> {
        self.lock().thin.as_ref()?;
        let drones = self.plan.slots.len().max(1) as f64;
        let rate_hz = (LINK_BYTES_PER_S / (STREAM_BYTES * drones)).clamp(SLOWEST_HZ, FASTEST_HZ);
        Some((S as f64 / rate_hz) as Micros)
    }

    /// Flights so far, from a show time on, s, by slot; `None` while no start is known.
    pub fn flights(&self, from_s: f64) -> Option<Vec<(u16, Flight)>> {
        let now = self.lock();
        let (start, thin) = (GpsTime::from_total_ms(now.start_gps_ms?)?, now.thin.as_ref()?);
        let flight = |(drone, slot)| Some((slot, thin.flight(drone, start, from_s)?));
        Some(now.monitor.slots().filter_map(flight).collect())
    }

    /// Whether all drones that state a firmware state this revision of it, and one does.
    pub fn are_of(&self, revision: [u8; 8]) -> bool {
        let now = self.lock();
        let version = |drone| now.monitor.telemetry.get(drone)?.version;
        let versions = now.monitor.slots().filter_map(|(drone, _)| version(drone));
        versions.map(|version| version.revision == revision).reduce(|a, b| a && b) == Some(true)
    }

    /// Step of the station, and the time of the show, s.
    pub fn moment(&self) -> (Step, Option<f64>) {
        let now = self.lock();
        (now.step, now.monitor.flying().filter_map(|(_, of)| of.show_s).reduce(f64::max))
    }

    /// Which drone flies which slot is known.
    pub fn assign(&self, table: &FleetTable) {
        let mut now = self.lock();
        let telemetry = std::mem::take(&mut now.monitor.telemetry);
        now.monitor = Monitor::new(&self.plan, table, telemetry, self.limits);
        let start = now.start_gps_ms;
        now.monitor.set_start(start);
    }

    /// Show time 0 is known, ms since the GPS epoch; `None`: there is no start any more.
    pub fn start(&self, start_gps_ms: Option<i64>) {
        let mut now = self.lock();
        now.start_gps_ms = start_gps_ms;
        now.monitor.set_start(start_gps_ms);
    }

    /// The station is at another step; `waits`: what it waits for and what follows.
    pub fn step(&self, step: Step, waits: &str) {
        let mut now = self.lock();
        now.step = step;
        waits.clone_into(&mut now.waits);
    }

    /// Nothing more follows, for a reason that was told or for none.
    pub fn over(&self) {
        let mut now = self.lock();
        now.question = None;
        if now.step != Step::Over {
            now.step = Step::Over;
            "The station's work is done".clone_into(&mut now.waits);
        }
    }

    /// The table before a start, as far as it is filled.
    pub fn preflight(&self, found: &Preflight) {
        let rows = found.rows.iter().map(|row| {
            let cell = |cell: &crate::fleet::preflight::Cell| {
                (cell.text.clone(), cell.no_go.clone().unwrap_or_default())
            };
            (row.slot, row.cells.iter().map(cell).collect())
        });
        let view = PreflightView {
            go: found.go(),
            columns: COLUMNS.map(str::to_owned).to_vec(),
            rows: rows.collect(),
            fleet: found.fleet.clone(),
        };
        self.lock().preflight = Some(view);
    }

    /// Something was said to people.
    pub fn say(&self, level: Level, text: &str) {
        let at_ms = self.clock.unix_us() / 1000;
        let mut now = self.lock();
        for line in text.lines().map(str::trim_end).filter(|line| !line.is_empty()) {
            now.push(Said { number: 0, at_ms, level, text: line.to_owned() });
        }
    }

    /// Takes sentences that were said before this station was opened, the oldest first.
    pub fn recall(&self, said: Vec<Said>) {
        let mut now = self.lock();
        for said in said {
            now.push(said);
        }
    }

    /// News of an order.
    pub fn ordered(&self, notice: &Notice) {
        let mut now = self.lock();
        match notice {
            Notice::Ordered { action, drones, .. } => {
                for drone in drones {
                    now.orders.insert(*drone, format!("{}: told", word(*action)));
                }
            }
            Notice::Done { action, drone, done } => {
                now.orders.insert(*drone, format!("{}: {done}", word(*action)));
            }
            Notice::NoAnswer { .. } => {}
        }
    }

    /// Asks pages; the answer of the first comes back.
    pub fn ask(&self, text: &str, answers: &[(&str, &str)]) -> Receiver<Line> {
        let (send, receive) = sync_channel(1);
        let mut now = self.lock();
        now.questions += 1;
        let owned = |(word, does): &(&str, &str)| ((*word).to_owned(), (*does).to_owned());
        now.question = Some(Question {
            number: now.questions,
            text: plainly(text),
            answers: answers.iter().map(owned).collect(),
        });
        now.answers = Some(send);
        receive
    }

    /// The question is answered elsewhere, or not open any more.
    pub fn answered(&self) {
        let mut now = self.lock();
        now.question = None;
        now.answers = None;
    }

    /// The air as it is measured: a view, and value and standard error by slot, m/s.
    pub fn air(&self, view: Option<AirView>, of: BTreeMap<u16, (f64, f64)>) {
        let mut now = self.lock();
        now.air = view;
        now.air_of = of;
    }

    fn give(&self, action: Action, drones: Option<&[DroneId]>) -> Answered {
        let name = {
            let mut now = self.lock();
            now.orders_ever += 1;
            format!("{:020}-page-{}", self.clock.unix_us(), now.orders_ever)
        };
        let drones = drones.map(<[DroneId]>::to_vec);
        if drones.as_ref().is_some_and(Vec::is_empty) {
            return Err(Refused::Nothing("no drone is chosen".to_owned()));
        }
        match give(&self.folder, &name, action, drones, OrderFrom::Page) {
            Ok(Some(_)) => Ok(format!("{}: the order is given", word(action))),
            Ok(None) => Err(Refused::Failed(
                "the station takes no orders: press Ctrl-C in its terminal, or use the remote \
                 controls"
                    .to_owned(),
            )),
            Err(error) => Err(Refused::Failed(format!(
                "{}: press Ctrl-C in the station's terminal, or use the remote controls",
                with_causes(&error, ": ")
            ))),
        }
    }

    fn answer(&self, question: u64, answer: &str) -> Answered {
        let mut now = self.lock();
        let open = now.question.as_ref().filter(|open| open.number == question);
        let Some(open) = open else {
            return Err(Refused::Nothing("this question is not open any more".to_owned()));
        };
        if !open.answers.iter().any(|(word, _)| word == answer) {
            return Err(Refused::Nothing(format!("\"{answer}\" is no answer to it")));
        }
        let sent = now.answers.take().map(|to| to.try_send(Ok(Some(answer.to_owned()))));
        now.question = None;
        match sent {
            Some(Ok(())) => Ok("answered".to_owned()),
            _ => Err(Refused::Nothing("it was answered already".to_owned())),
        }
    }
}

/// A question without what it says of a keyboard: its first sentence that asks.
fn plainly(text: &str) -> String {
    let text = text.trim();
    text.split_inclusive('?').next().unwrap_or(text).to_owned()
}

fn word(action: Action) -> &'static str {
    match action {
        Action::Return => "return",
        Action::Land => "land",
    }
}

impl Source for Station {
    fn facts(&self) -> Facts {
        Facts::of(&self.plan, false)
    }

    fn view(&self, now_ms: u64) -> View {
        let mut now = self.lock();
        let at = self.clock.now();
        now.monitor.stop(at);
        now.take_events();
        now.look_at_charge(at);
        let flying: BTreeMap<DroneId, Flying> = now.monitor.flying().collect();
        let slots: BTreeMap<DroneId, u16> = now.monitor.slots().collect();
        let taken: BTreeMap<u16, DroneId> =
            slots.iter().map(|(drone, slot)| (*slot, *drone)).collect();
        let of_slots =
            self.plan.slots.iter().map(|slot| (Some(slot.slot), taken.get(&slot.slot).copied()));
        let heard = now.monitor.telemetry.drones.keys();
        let others =
            heard.filter(|drone| !slots.contains_key(drone)).map(|drone| (None, Some(*drone)));
        let rows: Vec<(Option<u16>, Option<DroneId>)> = of_slots.chain(others).collect();
        let drones = rows.into_iter().map(|(slot, drone)| {
            let state = drone.and_then(|drone| now.monitor.telemetry.get(drone));
            let flying = drone.and_then(|drone| flying.get(&drone).copied());
            self.drone(&now, (at, now_ms), (slot, drone), state, flying)
        });
        let drones = drones.collect();
        let show_s = flying.values().filter_map(|of| of.show_s).reduce(f64::max);
        View {
            now_ms,
            show_s: show_s.map(centi),
            step: now.step,
            waits: now.waits.clone(),
            question: now.question.clone(),
            drones,
            said: now.said.iter().cloned().collect(),
            preflight: now.preflight.clone(),
            air: now.air.clone(),
            replay: None,
        }
    }

    fn wish(&self, rank: Rank, wish: &Wish) -> Answered {
        if rank < Rank::Operator {
            return Err(Refused::LooksOnly);
        }
        match wish {
            Wish::Order { action, drones } => self.give(*action, drones.as_deref()),
            Wish::Answer { question, answer } => self.answer(*question, answer),
            Wish::Replay { .. } => {
                Err(Refused::Nothing("this flight is no replay: its time cannot be set".to_owned()))
            }
        }
    }
}

impl Now {
    /// Takes a sentence with the next number.
    fn push(&mut self, said: Said) {
        self.said_ever += 1;
        self.said.push_back(Said { number: self.said_ever, ..said });
        if self.said.len() > MOST_SAID {
            self.said.pop_front();
        }
    }

    fn take_events(&mut self) {
        for told in self.monitor.take_events() {
            self.words.insert(told.drone, told.event.to_string());
        }
    }

    /// Remembers the charge at take-off.
    fn look_at_charge(&mut self, at: Micros) {
        let Self { monitor, charge, .. } = self;
        for (drone, of) in &monitor.telemetry.drones {
            let percent = of.health.and_then(|(_, health)| health.battery_percent);
            match (of.is_armed(), percent) {
                (Some(true), Some(percent)) => {
                    charge.entry(*drone).or_insert((at, f64::from(percent)));
                }
                (Some(false), _) => {
                    charge.remove(drone);
                }
                _ => {}
            }
        }
    }

    /// Minutes until the reserve is all there is, at the rate of the flight so far.
    fn minutes_left(&self, drone: DroneId, at: Micros, percent: f64, reserve: f64) -> Option<f64> {
        let (since, full) = self.charge.get(&drone)?;
        let (passed, used) = (at.saturating_sub(*since), full - percent);
        if passed < RATED || used < RATED_PERCENT {
            return None;
        }
        let rate = used / (passed as f64 / (60.0 * S as f64));
        Some(((percent - reserve).max(0.0) / rate * 10.0).round() / 10.0)
    }
}

impl Station {
    fn drone(
        &self,
        now: &Now,
        (at, now_ms): (Micros, u64),
        (slot, drone): (Option<u16>, Option<DroneId>),
        state: Option<&Drone>,
        flying: Option<Flying>,
    ) -> DroneView {
        let looked = Looked {
            now: at,
            drone: state,
            flying,
            limits: &self.limits,
            has_slot: slot.is_some(),
        };
        let (level, why) = match drone {
            // Who has landed may be switched off.
            Some(_) if now.step >= Step::Logs && state.and_then(Drone::is_armed) == Some(false) => {
                (Level::Good, String::new())
            }
            Some(_) => trouble(&looked),
            None if now.step <= Step::Assigning => (Level::Good, String::new()),
            None => (Level::Warning, "nobody flies this slot".to_owned()),
        };
        let air = slot.and_then(|slot| now.air_of.get(&slot));
        let mut view = DroneView {
            slot,
            drone: drone.map(|drone| drone.to_string()),
            level,
            trouble: why,
            distance_m: flying.and_then(|of| of.distance_m).map(centi),
            words: drone.and_then(|drone| now.words.get(&drone).cloned()).unwrap_or_default(),
            order: drone.and_then(|drone| now.orders.get(&drone).cloned()).unwrap_or_default(),
            air_mps: air.map(|(value, _)| centi(*value)),
            air_se_mps: air.map(|(_, error)| centi(*error)),
            ..DroneView::default()
        };
        let (Some(state), Some(drone)) = (state, drone) else { return view };
        view.stage = stage(state);
        view.armed = state.is_armed();
        // The flight mode of one that was sent home says no more when it is there.
        let came_down = state.mode.is_some_and(|(_, mode)| [RTL, LAND].contains(&mode));
        let fell = flying.is_some_and(|of| of.fell);
        let is_off = state.status.is_none_or(|(_, status)| status.stage == Stage::Off);
        if view.armed == Some(false) && came_down && is_off && !fell {
            view.stage = Stage::Landed.to_string();
        }
        view.heard_ms = Some(now_ms.saturating_sub(at.saturating_sub(state.heard) / 1000));
        view.loss_percent = state.link_quality().map(|share| (100.0 * (1.0 - share)).round());
        view.signal_percent = state.signal_percent();
        view.gps_fix = state.gps.map(|(_, gps)| gps.fix);
        view.satellites = state.gps.map(|(_, gps)| gps.satellites);
        if let Some((_, health)) = state.health {
            view.battery_v = health.battery_v.map(centi);
            view.battery_percent = health.battery_percent.map(f64::from);
        }
        let is_heard = at.saturating_sub(state.heard) <= self.limits.silent;
        view.minutes_left = view
            .battery_percent
            .filter(|_| is_heard)
            .and_then(|percent| now.minutes_left(drone, at, percent, self.limits.battery_percent));
        view.place_m = state.position.filter(|(_, at)| at.has_place()).map(|(_, at)| {
            let frame = self.plan.site.frame();
            let mut place = frame.from_geodetic(geodetic(&at));
            // Heights are above home, wherever the vehicle believes the sea to be.
            place.z = at.above_home_m;
            [place.x, place.y, place.z].map(centi)
        });
        if view.words.is_empty()
            && let Some(text) = state.texts.back()
            && at < text.at + TEXT_SHOWN
            && !(text.text.starts_with("PreArm: ") && is_ready(state))
        {
            view.words.clone_from(&text.text);
        }
        view
    }
}

/// Whether nothing stands in the way of arming any more, whatever was said before.
fn is_ready(state: &Drone) -> bool {
    let passes = state.health.and_then(|(_, health)| health.prearm_ok) == Some(true);
    passes || state.is_armed() == Some(true)
}

/// Stage of the show, or flight mode.
fn stage(state: &Drone) -> String {
    match state.status.map(|(_, status)| status.stage) {
        Some(stage) if stage != Stage::Off => stage.to_string(),
        _ => state.mode.map_or_else(String::new, |(_, mode)| mode_name(mode)),
    }
}
