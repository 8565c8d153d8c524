//! A server that speaks as Skybrush Server does, with two drones and one fault.

pub(crate) mod clock;
pub(crate) mod replay;

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;
use serde_json::{Map, Value, json};
use updraft::base::time::GpsTime;
use updraft::campaign::parse_plan;
use updraft::flight::identity::identify;
use updraft::log::Log;

use self::clock::TrialClock;

/// What the server or one of its drones does wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    None,
    /// Drone 01 stands 3 m from its slot.
    StandsWrong,
    /// Drone 01 does not take its show.
    Upload(&'static str),
    /// Drone 01 does not answer any more.
    UploadTimeout,
    /// A request is refused.
    Nak(&'static str),
    NakAuthorization,
    /// The server is gone when it is asked this.
    Gone(&'static str),
    /// Drone 01 has an error before the start.
    Trouble,
    /// Drone 01 has an error and a low battery in flight, and the server is gone for a moment.
    TroubleInFlight,
    /// Drone 01 is in the air.
    OneFlies,
    /// Drone 01 stays in the mode of its last abort.
    StaysOutOfShowMode,
    /// Drone 01 is in show mode, and leaves it once it has the start time.
    LeavesShowMode,
    /// Drone 01 is still initializing.
    Initializes,
    /// Drone 01 fails its arming checks.
    FailsChecks,
    /// Drone 01 has no show, whatever it is sent.
    NoShow,
    /// Drone 01 does not take the start time; it has another one; it is not authorized by it.
    NoStartTime,
    OtherStartTime,
    NoAuthorization,
    /// The server hears no more of drone 01.
    Silent,
    /// Drone 01 sends no show status.
    NoShowStatus,
    /// Somebody has authorized a start; or takes it back before it comes.
    AuthorizedAlready,
    TakenBack,
    /// Drone 01 stays where it is.
    NeverTakesOff,
    /// The server remembers a drone that was there a minute ago, on the slot of drone 02.
    Remembers,
    /// Logs are larger in the list.
    LogSize,
    /// Logs are cut.
    LogCut,
    /// Logs are no base64.
    LogGarbled,
    /// Logs are zeros.
    LogIsNone,
    /// A line that does not end.
    Endless,
    /// Drones are known one after the other, and then where they are.
    Late,
    /// Drone 01 is not known any more when its log is asked for.
    LogUnknown,
    /// Somebody else downloads a log of drone 01.
    LogBusy,
    /// Logs are smaller in the first list.
    LogGrows,
    /// Downloads begin, and go on for ever.
    LogHangs,
    /// Drone 01 misses the first request for a log.
    LogOnce,
    /// The server says nothing more once the start is authorized, or once everyone is in the air, until it
    /// is let go; then they stay there.
    HoldsBeforeStart,
    HoldsInFlight,
    /// The same, and the server is gone when somebody wants them down: once, or for ever.
    GoneWhenOrdered,
    GoneForOrders,
    /// Nothing is wrong, and downloads go on until there are two.
    Patient,
    /// The server knows no drone.
    NoDrones,
    /// Drone 01 stands where drone 02 does; it does not say where it stands.
    SameSlot,
    NoPlace,
    /// The server forgets drone 01 once everyone is where they belong.
    Forgets,
    /// Drone 01 takes the start time late.
    LateStartTime,
    /// The start cannot be cleared.
    NakClear,
    /// Drone 01 obeys no order to come down.
    Disobeys,
    /// Drone 01 has a log of a later flight, too; it has none; a huge one; one without a time.
    LogNewer,
    LogNone,
    LogHuge,
    LogTimeless,
    /// Logs of drone 01 are not listed; not once one came; log 2 is gone then.
    NoList,
    NoListAfter,
    LogGone,
    /// The server has not found out what firmware the drones have, and has no name for the show mode.
    ModeByNumber,
}

impl Fault {
    fn holds_in_flight(self) -> bool {
        matches!(self, Self::HoldsInFlight | Self::GoneWhenOrdered | Self::GoneForOrders)
    }

    /// The drones stay in the air until they are told otherwise.
    fn stays_up(self) -> bool {
        self.holds_in_flight() || self == Self::Disobeys
    }
}

/// How long work takes, so that there can be more of it at once.
const WORK: Duration = Duration::from_millis(150);

#[derive(Default)]
struct State {
    asked: Vec<Value>,
    /// Unix time, s, once set, and once authorized.
    set: Option<i64>,
    start: Option<i64>,
    /// Looks since it was set.
    /// The start that was flown, whose log the drones have.
    flown: Option<i64>,
    looks_since_set: u64,
    cleared: bool,
    /// Drones that have a show, and are in show mode.
    loaded: BTreeSet<String>,
    in_show_mode: BTreeSet<String>,
    /// How often statuses were asked for, in all and since the start.
    looks: u64,
    looks_in_flight: u64,
    lists: u64,
    /// Drones with an upload or a download, and the most of them there have been.
    busy: Vec<String>,
    most_busy: usize,
    downloads: u64,
    let_go: bool,
    /// Everyone lands, in this mode if they were ordered to; looks since then.
    lands: bool,
    ordered: Option<&'static str>,
    looks_since_order: u64,
    orders: u64,
}

/// The server, on a port of its own.
pub(crate) struct Fake {
    pub(crate) address: SocketAddr,
    pub(crate) clock: TrialClock,
    state: Arc<Mutex<State>>,
    over: Arc<AtomicBool>,
}

/// The newest log of a drone, of no flight of today.
pub(crate) fn log(id: &str) -> Vec<u8> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("crates/dataflash/tests/data/ladder-still.trimmed.BIN");
    let mut bytes = fs::read(data).unwrap();
    bytes.truncate(SIZE);
    bytes.extend_from_slice(id.as_bytes());
    bytes
}

/// Bytes of the beginning of a real log that are used.
const SIZE: usize = 100_000;

/// The same log, as if its show had begun at this Unix time, s: its GPS times are moved.
pub(crate) fn log_of(id: &str, start_unix_s: i64) -> Vec<u8> {
    let mut bytes = log(id);
    let identity = identify(&Log::from_bytes(bytes.clone()));
    let began = identity.shows().next().expect("the log has a show clock").start;
    let start = GpsTime::from_unix_ms(start_unix_s * 1000).unwrap();
    move_gps(&mut bytes, start.total_ms() - began.total_ms());
    bytes
}

/// A log whose satellite messages have a name that nobody knows.
fn without_gps(mut bytes: Vec<u8>) -> Vec<u8> {
    let name = bytes.windows(4).position(|name| name == b"GPS\0").unwrap();
    bytes[name + 2] = b'?';
    bytes
}

/// Adds to the times of all GPS rows of a DataFlash log.
fn move_gps(bytes: &mut [u8], by_ms: i64) {
    let size = |kind: char| match kind {
        'b' | 'B' | 'M' => 1,
        'h' | 'H' | 'c' | 'C' => 2,
        'i' | 'I' | 'f' | 'n' | 'e' | 'E' | 'L' => 4,
        'd' | 'q' | 'Q' => 8,
        'N' => 16,
        'Z' | 'a' => 64,
        other => panic!("a field of kind {other}"),
    };
    let mut lengths = [0_usize; 256];
    let mut gps = None;
    let mut at = 0;
    while at + 3 <= bytes.len() && bytes[at..].starts_with(&[0xA3, 0x95]) {
        let kind = bytes[at + 2];
        if kind == 0x80 {
            let row = &bytes[at + 3..at + 89];
            lengths[usize::from(row[0])] = row[1].into();
            if row[2..6] == *b"GPS\0" {
                let formats = row[6..22].iter().map(|byte| char::from(*byte));
                let labels = String::from_utf8_lossy(&row[22..86]).into_owned();
                let labels = labels.trim_end_matches('\0').split(',').map(str::to_owned);
                let mut place = 3;
                let mut places = std::collections::BTreeMap::new();
                for (format, label) in formats.zip(labels) {
                    places.insert(label, place);
                    place += size(format);
                }
                gps = Some((row[0], places["GMS"], places["GWk"]));
            }
        }
        let length = if kind == 0x80 { 89 } else { lengths[usize::from(kind)] };
        if length == 0 || at + length > bytes.len() {
            return;
        }
        if let Some((_, ms, week)) = gps.filter(|(it, ..)| *it == kind) {
            let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            let weeks = u16::from_le_bytes([bytes[at + week], bytes[at + week + 1]]);
            let total = i64::from(weeks) * 604_800_000 + i64::from(number(at + ms)) + by_ms;
            let tow = (total % 604_800_000) as u32;
            bytes[at + ms..at + ms + 4].copy_from_slice(&tow.to_le_bytes());
            let weeks = (total / 604_800_000) as u16;
            bytes[at + week..at + week + 2].copy_from_slice(&weeks.to_le_bytes());
        }
        at += length;
    }
}

impl Fake {
    /// Its drones stand on the plan's first two slots: 01 on the second, 02 on the first.
    pub(crate) fn start(plan: &Value, fault: Fault) -> Self {
        let plan = parse_plan(plan.to_string().as_bytes()).unwrap();
        let slots = if fault == Fault::SameSlot { [0, 0] } else { [1, 0] };
        let places = slots.map(|index: usize| {
            let [x, y] = plan.slots[index].home_m[..2] else { panic!("a slot without a home") };
            let off = if index == 1 && fault == Fault::StandsWrong { 3.0 } else { 0.2 };
            let place = plan.site.frame().to_geodetic(Vector3::new(x + off, y, 0.0));
            [(place.lat_deg * 1e7).round() as i64, (place.lon_deg * 1e7).round() as i64]
        });
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let state = Arc::new(Mutex::new(State::default()));
        let over = Arc::new(AtomicBool::new(false));
        let clock = TrialClock::start();
        let (shared, ended, time) = (Arc::clone(&state), Arc::clone(&over), clock.clone());
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if ended.load(Ordering::SeqCst) {
                    return;
                }
                let stream = stream.unwrap();
                stream.set_nodelay(true).unwrap();
                let visit = Visit {
                    reader: stream.try_clone().unwrap(),
                    out: Out(Arc::new(Mutex::new(stream))),
                    fault,
                    places,
                    state: Arc::clone(&shared),
                    clock: time.clone(),
                    receipts: 0,
                    looks_in_flight: 0,
                    asks_for_start: 0,
                };
                std::thread::spawn(move || visit.serve());
            }
        });
        Self { address, clock, state, over }
    }

    /// Nobody listens any more.
    pub(crate) fn stop(&self) {
        self.over.store(true, Ordering::SeqCst);
        while TcpStream::connect(self.address).is_ok() {
            std::thread::yield_now();
        }
    }

    /// Bodies of all requests but those for versions and statuses.
    pub(crate) fn asked(&self) -> Vec<Value> {
        self.state.lock().unwrap().asked.clone()
    }

    /// How many drones have had an upload or a download at the same time.
    pub(crate) fn most_at_once(&self) -> usize {
        self.state.lock().unwrap().most_busy
    }

    /// When the flight began, if one was flown.
    pub(crate) fn flown_unix_s(&self) -> Option<i64> {
        self.state.lock().unwrap().flown
    }

    /// Lets it answer again.
    pub(crate) fn let_go(&self) {
        self.state.lock().unwrap().let_go = true;
    }

    /// The drones land.
    pub(crate) fn land(&self) {
        let mut state = self.state.lock().unwrap();
        (state.lands, state.let_go) = (true, true);
        state.looks_in_flight = state.looks_in_flight.min(2);
    }

    pub(crate) fn is_authorized(&self) -> bool {
        let state = self.state.lock().unwrap();
        state.start.is_some() && !state.cleared
    }
}

impl Drop for Fake {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
        drop(TcpStream::connect(self.address));
    }
}

#[derive(Clone)]
struct Out(Arc<Mutex<TcpStream>>);

struct Visit {
    reader: TcpStream,
    out: Out,
    fault: Fault,
    places: [[i64; 2]; 2],
    state: Arc<Mutex<State>>,
    clock: TrialClock,
    receipts: u32,
    /// Looks of this visit since the start.
    looks_in_flight: u64,
    /// How often it has asked for the start.
    asks_for_start: u64,
}

/// The connection is closed.
struct Closed;

fn ids(body: &Value) -> Vec<String> {
    let ids = body["ids"].as_array().unwrap();
    ids.iter().map(|id| id.as_str().unwrap().to_owned()).collect()
}

impl Out {
    fn send(&self, refs: Option<&str>, body: &Value) -> Result<(), Closed> {
        let mut message = json!({ "$fw.version": "1.0", "id": "s", "body": body });
        if let Some(refs) = refs {
            message["refs"] = json!(refs);
        }
        let line = format!("{message}\n");
        // In two pieces: lines do not come in packets.
        let (one, two) = line.as_bytes().split_at(line.len() / 2);
        let mut stream = self.0.lock().unwrap();
        stream.write_all(one).and_then(|()| stream.write_all(two)).map_err(|_| Closed)
    }
}

impl Visit {
    fn serve(mut self) {
        let reader = BufReader::new(self.reader.try_clone().unwrap());
        for line in reader.lines() {
            let Ok(line) = line else { return };
            let request: Value = serde_json::from_str(&line).unwrap();
            assert_eq!(request["$fw.version"], "1.0");
            let id = request["id"].as_str().unwrap().to_owned();
            assert!((1..=36).contains(&id.len()));
            if self.answer(&id, &request["body"]).is_err() {
                drop(self.reader.shutdown(Shutdown::Both));
                return;
            }
        }
    }

    fn send(&self, refs: Option<&str>, body: &Value) -> Result<(), Closed> {
        self.out.send(refs, body)
    }

    /// Ends work after a while.
    fn end_later(&self, drone: &str, messages: Vec<Value>) {
        let mut state = self.state.lock().unwrap();
        assert!(!state.busy.iter().any(|busy| busy == drone), "one thing at a time and drone");
        state.busy.push(drone.to_owned());
        state.most_busy = state.most_busy.max(state.busy.len());
        drop(state);
        let (out, state, drone) = (self.out.clone(), Arc::clone(&self.state), drone.to_owned());
        let is_patient = self.fault == Fault::Patient;
        std::thread::spawn(move || {
            std::thread::sleep(WORK);
            let waits = |state: &State| state.downloads > 0 && state.most_busy < 2;
            while is_patient && waits(&state.lock().unwrap()) {
                std::thread::sleep(Duration::from_millis(5));
            }
            state.lock().unwrap().busy.retain(|busy| *busy != drone);
            // Whoever has asked may be gone.
            for message in messages {
                drop(out.send(None, &message));
            }
        });
    }

    fn receipt(&mut self) -> String {
        self.receipts += 1;
        format!("receipt-{}", self.receipts)
    }

    fn answer(&mut self, id: &str, body: &Value) -> Result<(), Closed> {
        let kind = body["type"].as_str().unwrap().to_owned();
        let looks = ["SYS-VER", "UAV-LIST", "UAV-INF", "SHOW-CFG", "UAV-PREFLT"];
        if !looks.contains(&kind.as_str()) {
            self.state.lock().unwrap().asked.push(body.clone());
        }
        if self.fault == Fault::Gone(leaked(&kind)) {
            return Err(Closed);
        }
        if self.fault == Fault::Nak(leaked(&kind)) {
            return self.nak(id, "not now");
        }
        match kind.as_str() {
            "SYS-VER" if self.fault == Fault::Endless => {
                self.out.0.lock().unwrap().write_all(&vec![b'x'; 2 << 20]).map_err(|_| Closed)
            }
            "SYS-VER" => {
                let body = json!({ "type": kind, "software": "fake", "version": "1.2.3" });
                self.send(Some(id), &body)
            }
            "UAV-LIST" => {
                let mut state = self.state.lock().unwrap();
                state.lists += 1;
                let known = if self.fault == Fault::Late { state.lists - 1 } else { 2 };
                drop(state);
                // In no order.
                let ids = match self.fault {
                    Fault::NoDrones => &[][..],
                    Fault::Remembers => &["77", "02", "01"][..],
                    _ => &["02", "01"][..known.min(2) as usize],
                };
                self.send(Some(id), &json!({ "type": kind, "ids": ids }))
            }
            "UAV-INF" => {
                let status = self.status(&ids(body))?;
                if self.fault.holds_in_flight() {
                    let looks = self.looks_in_flight;
                    self.hold(|_| looks >= 3);
                }
                let body = json!({ "type": kind, "status": status });
                // Others are told, too.
                self.send(None, &body)?;
                self.send(Some(id), &body)
            }
            "OBJ-CMD" if body["command"] == "mode" => self.mode(id, &ids(body)[0], &body["args"]),
            "OBJ-CMD" => self.upload(id, &ids(body)[0]),
            "UAV-PREFLT" => {
                let report = json!({ "message": "Need Position Estimate", "result": "failure" });
                let result: Map<String, Value> =
                    ids(body).into_iter().map(|id| (id, report.clone())).collect();
                self.send(Some(id), &json!({ "type": kind, "result": result }))
            }
            "SHOW-CFG" => {
                let state = self.state.lock().unwrap();
                let start = state.start.filter(|_| !state.cleared);
                drop(state);
                self.asks_for_start += 1;
                if self.fault == Fault::HoldsBeforeStart && self.asks_for_start > 1 {
                    self.hold(|state| state.start.is_some());
                }
                let authorized = match self.fault {
                    Fault::AuthorizedAlready => true,
                    Fault::TakenBack => false,
                    _ => start.is_some(),
                };
                let configuration = json!({ "start": { "authorized": authorized, "time": start } });
                self.send(Some(id), &json!({ "type": kind, "configuration": configuration }))
            }
            "SHOW-SETCFG" => self.configure(id, &body["configuration"]["start"]),
            "LOG-INF" => self.list(id, &ids(body)),
            "LOG-DATA" => {
                self.log(id, body["uavId"].as_str().unwrap(), body["logId"].as_str().unwrap())
            }
            "ASYNC-CANCEL" => {
                let body = json!({ "type": kind, "success": ids(body) });
                self.send(Some(id), &body)
            }
            "UAV-RTH" | "UAV-LAND" => {
                let mut state = self.state.lock().unwrap();
                let is_first = state.orders == 0;
                state.orders += 1;
                drop(state);
                if self.fault == Fault::GoneForOrders
                    || self.fault == Fault::GoneWhenOrdered && is_first
                {
                    return Err(Closed);
                }
                let (deaf, obey): (Vec<String>, Vec<String>) = ids(body)
                    .into_iter()
                    .partition(|id| self.fault == Fault::Disobeys && id == "01");
                let of = |ids: Vec<String>, what: Value| -> Map<String, Value> {
                    ids.into_iter().map(|id| (id, what.clone())).collect()
                };
                let (result, error) = (of(obey, json!(true)), of(deaf, json!("no response")));
                let mut state = self.state.lock().unwrap();
                state.ordered = Some(if kind == "UAV-RTH" { "rth" } else { "land" });
                drop(state);
                self.send(Some(id), &json!({ "type": kind, "result": result, "error": error }))
            }
            _ => self.nak(id, "no such message"),
        }
    }

    /// Waits to be let go, if that is so.
    fn hold(&self, is_so: impl Fn(&State) -> bool) {
        while {
            let state = self.state.lock().unwrap();
            is_so(&state) && !state.let_go
        } {
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn nak(&self, id: &str, reason: &str) -> Result<(), Closed> {
        self.send(Some(id), &json!({ "type": "ACK-NAK", "reason": reason }))
    }

    /// The flight goes on by a state with every look, so that none is missed.
    fn status(&mut self, ids: &[String]) -> Result<Map<String, Value>, Closed> {
        let mut state = self.state.lock().unwrap();
        state.looks += 1;
        let looks = state.looks;
        let now_s = (self.clock.unix_ms() / 1000) as i64;
        let flying = state.start.is_some_and(|start| now_s > start);
        state.looks_in_flight += u64::from(flying);
        let step = state.looks_in_flight;
        state.looks_since_set += u64::from(state.set.is_some());
        self.looks_in_flight += u64::from(flying);
        state.looks_since_order += u64::from(state.ordered.is_some());
        let (lands, ordered, since_order) = (state.lands, state.ordered, state.looks_since_order);
        let known = (state.looks_since_set, state.set, state.start);
        let (loaded, in_show_mode) = (state.loaded.clone(), state.in_show_mode.clone());
        drop(state);
        let trouble = self.fault == Fault::TroubleInFlight;
        if trouble && step == 3 {
            return Err(Closed);
        }
        let forgotten = |id: &str| self.fault == Fault::Forgets && looks > 1 && id == "01";
        let ids = ids.iter().filter(|id| !forgotten(id));
        let status = ids.map(|id| {
            let first = id == "01";
            let step = match self.fault {
                Fault::NeverTakesOff if first => 0,
                fault if fault.stays_up() && ordered.is_some() => 3 + since_order,
                fault if fault.stays_up() && !lands => step.min(3),
                _ => step,
            };
            let (since_set, set, authorized) = known;
            let left = first && self.fault == Fault::LeavesShowMode && since_set > 2;
            let in_show_mode = in_show_mode.contains(id) && !left;
            let out = if first && self.fault == Fault::StaysOutOfShowMode { "rth" } else { "stab" };
            let (mode, mut codes) = match step {
                0 => (if in_show_mode { "show" } else { out }, vec![1]),
                1 => ("show", vec![8]),
                2 => ("show", vec![5]),
                3 => ("show", vec![]),
                4 => ("show", vec![6]),
                // One driver says that it has landed, the other that it is on the ground.
                _ => ("show", vec![if first { 7 } else { 1 }]),
            };
            let mode = match (mode, ordered) {
                ("show", Some(ordered)) if step >= 3 => ordered,
                ("show", _) if self.fault == Fault::ModeByNumber => "mode 127",
                (mode, _) => mode,
            };
            let set = match self.fault {
                Fault::NoStartTime if first => None,
                Fault::LateStartTime if first => set.filter(|_| since_set > 16),
                Fault::OtherStartTime if first => set.map(|set| set + 60),
                _ => set,
            };
            let authorized = authorized.filter(|_| !first || self.fault != Fault::NoAuthorization);
            let debug = match step {
                _ if first && self.fault == Fault::NoShowStatus => String::new(),
                0 => STANDARD.encode(show_line(
                    loaded.contains(id) && !(first && self.fault == Fault::NoShow),
                    in_show_mode,
                    set,
                    authorized.is_some(),
                    now_s,
                )),
                _ => STANDARD.encode("[ 00:00:01] Performing show"),
            };
            match self.fault {
                Fault::Trouble if first => codes.push(133),
                Fault::FailsChecks if first => codes.push(3),
                Fault::Initializes if first => codes = vec![4],
                Fault::OneFlies if first => codes.clear(),
                Fault::TroubleInFlight if first && step == 2 => codes.push(75),
                _ => {}
            }
            // The percentage is there only if the autopilot tells it.
            let battery = match (trouble && step >= 2, first) {
                (true, true) => json!([123, 9]),
                (_, true) => json!([123, 80]),
                (_, false) => json!([126]),
            };
            let silent = first && self.fault == Fault::Silent;
            let late = self.fault == Fault::Late && looks < 5;
            let lost = first && self.fault == Fault::NoPlace;
            let [lat, lon] = if late || lost { [0, 0] } else { self.places[usize::from(!first)] };
            let status = json!({
                "id": id,
                "mode": mode,
                "errors": codes,
                "position": [lat, lon, 190_000, 0],
                "positionXYZ": null,
                "velocity": [-10, 10, 0],
                "velocityXYZ": null,
                "attitude": null,
                "heading": 12,
                "gps": [6, 10, 300, 300],
                "battery": battery,
                "light": 65535,
                "rssi": [],
                "debug": debug,
                "timestamp": 1_795_170_696_891_u64 + if silent { 0 } else { looks }
                    - if id == "77" { 60_000 } else { 0 },
            });
            (id.clone(), status)
        });
        Ok(status.collect())
    }

    fn mode(&mut self, id: &str, drone: &str, args: &Value) -> Result<(), Closed> {
        let is_show = args == &json!(["127"]);
        assert!(is_show || [json!(["6"]), json!(["9"])].contains(args), "{args}");
        let receipt = self.receipt();
        self.send(Some(id), &json!({ "type": "OBJ-CMD", "receipt": { drone: receipt } }))?;
        let end = if drone == "01" && self.fault == Fault::Disobeys && !is_show {
            json!({ "type": "ASYNC-TIMEOUT", "ids": [receipt] })
        } else if drone == "01" && self.fault == Fault::StaysOutOfShowMode {
            json!({ "type": "ASYNC-RESP", "id": receipt, "error": "UAV rejected flight mode 127" })
        } else {
            self.state.lock().unwrap().in_show_mode.insert(drone.to_owned());
            json!({ "type": "ASYNC-RESP", "id": receipt, "result": "Mode changed to '127'" })
        };
        self.send(None, &end)
    }

    fn upload(&mut self, id: &str, drone: &str) -> Result<(), Closed> {
        let receipt = self.receipt();
        self.state.lock().unwrap().loaded.insert(drone.to_owned());
        let answer = json!({ "type": "OBJ-CMD", "receipt": { drone: receipt } });
        let end = json!({ "type": "ASYNC-RESP", "id": receipt, "result": null });
        if drone != "01" && self.state.lock().unwrap().busy.is_empty() {
            // The end overtakes the receipt.
            self.send(None, &end)?;
            return self.send(Some(id), &answer);
        }
        self.send(Some(id), &answer)?;
        let progress = json!({ "percentage": 50, "message": "half" });
        self.send(None, &json!({ "type": "ASYNC-ST", "id": receipt, "progress": progress }))?;
        let end = match self.fault {
            Fault::Upload(why) => json!({ "type": "ASYNC-RESP", "id": receipt, "error": why }),
            Fault::UploadTimeout => json!({ "type": "ASYNC-TIMEOUT", "ids": [receipt] }),
            _ => end,
        };
        self.end_later(drone, vec![end]);
        Ok(())
    }

    fn configure(&mut self, id: &str, start: &Value) -> Result<(), Closed> {
        let authorized = start["authorized"].as_bool().unwrap();
        if authorized && self.fault == Fault::NakAuthorization {
            return self.nak(id, "not now");
        }
        let time = start["time"].as_i64();
        if time.is_none() && self.fault == Fault::NakClear {
            return self.nak(id, "not now");
        }
        let mut state = self.state.lock().unwrap();
        // The flight is not over when its start is cleared.
        let flies = time.is_none() && state.looks_in_flight > 0;
        if !flies {
            state.start = time.filter(|_| authorized);
            state.flown = state.start.or(state.flown);
        }
        state.cleared = time.is_none();
        if state.set != time {
            (state.set, state.looks_since_set) = (time, 0);
        }
        drop(state);
        self.send(Some(id), &json!({ "type": "ACK-ACK" }))
    }

    fn list(&mut self, id: &str, drones: &[String]) -> Result<(), Closed> {
        let receipts: Vec<String> = drones.iter().map(|_| self.receipt()).collect();
        let by_drone: Map<String, Value> =
            drones.iter().cloned().zip(receipts.iter().map(|receipt| json!(receipt))).collect();
        self.send(Some(id), &json!({ "type": "LOG-INF", "receipt": by_drone }))?;
        for (drone, receipt) in drones.iter().zip(&receipts) {
            let size = self.newest_log(drone).len();
            let size = match self.fault {
                Fault::LogSize => size + 100,
                Fault::LogGrows if self.state.lock().unwrap().downloads == 0 => size - 100,
                _ => size,
            };
            let entry = |id: &str, size: usize, time: u64| json!({ "id": id, "kind": "ardupilot", "size": size, "timestamp": time });
            let mut logs = vec![
                entry("1", 1000, 1_795_143_000),
                entry("2", size, 1_795_143_906),
                json!({ "id": "9", "kind": "text", "size": 10 }),
            ];
            let came = self.state.lock().unwrap().downloads > 0;
            let is_listed = match self.fault {
                Fault::NoList => drone != "01",
                Fault::NoListAfter => drone != "01" || !came,
                _ => true,
            };
            if drone == "01" {
                match self.fault {
                    Fault::LogNewer => logs.push(entry("3", size, 1_795_143_999)),
                    Fault::LogNone => drop(logs.drain(..2)),
                    Fault::LogHuge => logs[1]["size"] = json!(9_000_000_000_u64),
                    Fault::LogGone if came => drop(logs.remove(1)),
                    _ => {}
                }
            }
            let end = if is_listed {
                json!({ "type": "ASYNC-RESP", "id": receipt, "result": logs })
            } else {
                json!({ "type": "ASYNC-RESP", "id": receipt, "error": "log list timed out" })
            };
            self.send(None, &end)?;
        }
        Ok(())
    }

    fn flown_unix_s(&self) -> Option<i64> {
        self.state.lock().unwrap().flown
    }

    /// Of the flight that was flown, if one was.
    fn newest_log(&self, drone: &str) -> Vec<u8> {
        let flown = self.state.lock().unwrap().flown;
        flown.map_or_else(|| log(drone), |start| log_of(drone, start))
    }

    fn log(&mut self, id: &str, drone: &str, number: &str) -> Result<(), Closed> {
        let first = drone == "01";
        if first && self.fault == Fault::LogUnknown {
            // Of a single drone, the error has no key.
            return self.send(Some(id), &json!({ "type": "LOG-DATA", "error": "no such UAV" }));
        }
        let receipt = self.receipt();
        self.send(Some(id), &json!({ "type": "LOG-DATA", "receipt": receipt }))?;
        for percentage in [0, 30, 99] {
            let progress = json!({ "percentage": percentage, "message": "Downloading log..." });
            self.send(None, &json!({ "type": "ASYNC-ST", "id": receipt, "progress": progress }))?;
        }
        let mut state = self.state.lock().unwrap();
        state.downloads += 1;
        let downloads = state.downloads;
        drop(state);
        let error = |why: &str| json!({ "type": "ASYNC-RESP", "id": receipt, "error": why });
        match self.fault {
            Fault::LogHangs => return Ok(()),
            Fault::LogBusy if first => {
                self.end_later(drone, vec![error("Another log download is in progress")]);
                return Ok(());
            }
            Fault::LogOnce if first && downloads == 1 => {
                self.end_later(drone, vec![error("MAVLink mission operation timed out")]);
                return Ok(());
            }
            _ => {}
        }
        let bytes = match self.fault {
            Fault::LogNewer if number == "3" => {
                let now_s = (self.clock.unix_ms() / 1000) as i64;
                log_of(drone, self.flown_unix_s().unwrap_or(now_s) + 7200)
            }
            Fault::LogTimeless if first => without_gps(self.newest_log(drone)),
            _ => self.newest_log(drone),
        };
        let body = match self.fault {
            Fault::LogCut => STANDARD.encode(&bytes[..5000]),
            Fault::LogGarbled => "?".to_owned(),
            Fault::LogIsNone => STANDARD.encode(vec![0; bytes.len()]),
            _ => STANDARD.encode(&bytes),
        };
        let result =
            json!({ "id": number, "kind": "ardupilot", "size": bytes.len(), "body": body });
        self.end_later(
            drone,
            vec![json!({ "type": "ASYNC-RESP", "id": receipt, "result": result })],
        );
        Ok(())
    }
}

/// What a drone on the ground says of its show, with a clock in another time zone.
fn show_line(
    loaded: bool,
    in_show_mode: bool,
    set: Option<i64>,
    authorized: bool,
    now_s: i64,
) -> String {
    let clock = match set {
        None => "---:--:--".to_owned(),
        Some(start) => {
            let elapsed = now_s - start;
            let sign = if elapsed < 0 { '-' } else { ' ' };
            let (sign, shown) = match elapsed {
                -30.. => (sign, elapsed.abs()),
                _ => ('@', (start + 5400).rem_euclid(86_400)),
            };
            format!("{sign}{:02}:{:02}:{:02}", shown / 3600, shown / 60 % 60, shown % 60)
        }
    };
    let text = match (loaded, in_show_mode, set, authorized) {
        (false, ..) => "No show data",
        (_, false, ..) => "",
        (_, _, None, _) => "Start time not set",
        (_, _, _, false) => "Not authorized to start",
        _ => "Countdown to show start",
    };
    format!("[{clock}] {text}")
}

/// The kinds that faults are named by.
fn leaked(kind: &str) -> &'static str {
    ["OBJ-CMD", "SHOW-SETCFG", "LOG-DATA", "LOG-INF"]
        .into_iter()
        .find(|known| *known == kind)
        .unwrap_or("")
}
