//! A server that speaks as Skybrush Server does, with two drones and one fault.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;
use serde_json::{Map, Value, json};
use updraft::campaign::parse_plan;

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
}

/// How long work takes, so that there can be more of it at once.
const WORK: Duration = Duration::from_millis(150);

#[derive(Default)]
struct State {
    asked: Vec<Value>,
    /// Unix time, s, once authorized.
    start: Option<i64>,
    /// How often statuses were asked for, in all and since the start.
    looks: u64,
    looks_in_flight: u64,
    lists: u64,
    /// Drones with an upload or a download, and the most of them there have been.
    busy: Vec<String>,
    most_busy: usize,
    downloads: u64,
}

/// The server, on a port of its own.
pub(crate) struct Fake {
    pub(crate) address: SocketAddr,
    state: Arc<Mutex<State>>,
    over: Arc<AtomicBool>,
}

/// The newest log of a drone.
pub(crate) fn log(id: &str) -> Vec<u8> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ladder-still.trimmed.BIN");
    let mut bytes = fs::read(data).unwrap();
    bytes.truncate(100_000);
    bytes.extend_from_slice(id.as_bytes());
    bytes
}

impl Fake {
    /// Its drones stand on the plan's first two slots: 01 on the second, 02 on the first.
    pub(crate) fn start(plan: &Value, fault: Fault) -> Self {
        let plan = parse_plan(plan.to_string().as_bytes()).unwrap();
        let places = [1, 0].map(|index: usize| {
            let [x, y] = plan.slots[index].home_m[..2] else { panic!("a slot without a home") };
            let off = if index == 1 && fault == Fault::StandsWrong { 3.0 } else { 0.2 };
            let place = plan.site.frame().to_geodetic(Vector3::new(x + off, y, 0.0));
            [(place.lat_deg * 1e7).round() as i64, (place.lon_deg * 1e7).round() as i64]
        });
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let state = Arc::new(Mutex::new(State::default()));
        let over = Arc::new(AtomicBool::new(false));
        let (shared, ended) = (Arc::clone(&state), Arc::clone(&over));
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if ended.load(Ordering::SeqCst) {
                    return;
                }
                let stream = stream.unwrap();
                let visit = Visit {
                    reader: stream.try_clone().unwrap(),
                    out: Out(Arc::new(Mutex::new(stream))),
                    fault,
                    places,
                    state: Arc::clone(&shared),
                    receipts: 0,
                };
                std::thread::spawn(move || visit.serve());
            }
        });
        Self { address, state, over }
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

    pub(crate) fn is_authorized(&self) -> bool {
        self.state.lock().unwrap().start.is_some()
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
    receipts: u32,
}

/// The connection is closed.
struct Closed;

#[expect(clippy::disallowed_methods, reason = "the program under test has the real clock")]
fn unix_s() -> i64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs() as i64
}

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
        std::thread::spawn(move || {
            std::thread::sleep(WORK);
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
        if !["SYS-VER", "UAV-LIST", "UAV-INF"].contains(&kind.as_str()) {
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
                let ids = &["02", "01"][..known.min(2) as usize];
                self.send(Some(id), &json!({ "type": kind, "ids": ids }))
            }
            "UAV-INF" => {
                let status = self.status(&ids(body))?;
                let body = json!({ "type": kind, "status": status });
                // Others are told, too.
                self.send(None, &body)?;
                self.send(Some(id), &body)
            }
            "OBJ-CMD" => self.upload(id, &ids(body)[0]),
            "SHOW-SETCFG" => self.configure(id, &body["configuration"]["start"]),
            "LOG-INF" => self.list(id, &ids(body)),
            "LOG-DATA" => self.log(id, body["uavId"].as_str().unwrap()),
            "ASYNC-CANCEL" => {
                let body = json!({ "type": kind, "success": ids(body) });
                self.send(Some(id), &body)
            }
            "UAV-RTH" | "UAV-LAND" => {
                let result: Map<String, Value> =
                    ids(body).into_iter().map(|id| (id, json!(true))).collect();
                self.send(Some(id), &json!({ "type": kind, "result": result }))
            }
            _ => self.nak(id, "no such message"),
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
        let flying = state.start.is_some_and(|start| unix_s() > start);
        state.looks_in_flight += u64::from(flying);
        let step = state.looks_in_flight;
        let authorized = state.start.is_some();
        drop(state);
        let trouble = self.fault == Fault::TroubleInFlight;
        if trouble && step == 3 {
            return Err(Closed);
        }
        let status = ids.iter().map(|id| {
            let first = id == "01";
            let (mode, mut codes) = match step {
                0 => (if authorized { "show" } else { "stab" }, vec![1]),
                1 => ("show", vec![8]),
                2 => ("show", vec![5]),
                3 => ("show", vec![]),
                4 => ("land", vec![6]),
                // One driver says that it has landed, the other that it is on the ground.
                _ => ("land", vec![if first { 7 } else { 1 }]),
            };
            match self.fault {
                Fault::Trouble if first => codes.push(133),
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
            let late = self.fault == Fault::Late && looks < 5;
            let [lat, lon] = if late { [0, 0] } else { self.places[usize::from(!first)] };
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
                "debug": "",
                "timestamp": 1_795_170_696_891_u64 + looks,
            });
            (id.clone(), status)
        });
        Ok(status.collect())
    }

    fn upload(&mut self, id: &str, drone: &str) -> Result<(), Closed> {
        let receipt = self.receipt();
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
        let time = start["time"].as_i64().filter(|_| authorized);
        self.state.lock().unwrap().start = time;
        self.send(Some(id), &json!({ "type": "ACK-ACK" }))
    }

    fn list(&mut self, id: &str, drones: &[String]) -> Result<(), Closed> {
        let receipts: Vec<String> = drones.iter().map(|_| self.receipt()).collect();
        let by_drone: Map<String, Value> =
            drones.iter().cloned().zip(receipts.iter().map(|receipt| json!(receipt))).collect();
        self.send(Some(id), &json!({ "type": "LOG-INF", "receipt": by_drone }))?;
        for (drone, receipt) in drones.iter().zip(&receipts) {
            let size = log(drone).len();
            let size = match self.fault {
                Fault::LogSize => size + 100,
                Fault::LogGrows if self.state.lock().unwrap().downloads == 0 => size - 100,
                _ => size,
            };
            let logs = json!([
                { "id": "1", "kind": "ardupilot", "size": 1000, "timestamp": 1_795_143_000 },
                { "id": "2", "kind": "ardupilot", "size": size, "timestamp": 1_795_143_906 },
                { "id": "9", "kind": "text", "size": 10 },
            ]);
            self.send(None, &json!({ "type": "ASYNC-RESP", "id": receipt, "result": logs }))?;
        }
        Ok(())
    }

    fn log(&mut self, id: &str, drone: &str) -> Result<(), Closed> {
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
        let bytes = log(drone);
        let body = match self.fault {
            Fault::LogCut => STANDARD.encode(&bytes[..5000]),
            Fault::LogGarbled => "?".to_owned(),
            Fault::LogIsNone => STANDARD.encode(vec![0; bytes.len()]),
            _ => STANDARD.encode(&bytes),
        };
        let result = json!({ "id": "2", "kind": "ardupilot", "size": bytes.len(), "body": body });
        self.end_later(
            drone,
            vec![json!({ "type": "ASYNC-RESP", "id": receipt, "result": result })],
        );
        Ok(())
    }
}

/// The kinds that faults are named by.
fn leaked(kind: &str) -> &'static str {
    ["OBJ-CMD", "SHOW-SETCFG", "LOG-DATA", "LOG-INF"]
        .into_iter()
        .find(|known| *known == kind)
        .unwrap_or("")
}
