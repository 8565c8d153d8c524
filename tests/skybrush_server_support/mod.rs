//! A server that speaks as Skybrush Server does, with two drones and one fault.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

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
}

#[derive(Default)]
struct State {
    asked: Vec<Value>,
    /// Unix time, s, once authorized.
    start: Option<i64>,
    /// How often statuses were asked for, in all and since the start.
    looks: u64,
    looks_in_flight: u64,
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
                let visit = Visit {
                    stream: stream.unwrap(),
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

struct Visit {
    stream: TcpStream,
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

impl Visit {
    fn serve(mut self) {
        let reader = BufReader::new(self.stream.try_clone().unwrap());
        for line in reader.lines() {
            let Ok(line) = line else { return };
            let request: Value = serde_json::from_str(&line).unwrap();
            assert_eq!(request["$fw.version"], "1.0");
            let id = request["id"].as_str().unwrap().to_owned();
            assert!((1..=36).contains(&id.len()));
            if self.answer(&id, &request["body"]).is_err() {
                return;
            }
        }
    }

    fn send(&mut self, refs: Option<&str>, body: &Value) -> Result<(), Closed> {
        let mut message = json!({ "$fw.version": "1.0", "id": "s", "body": body });
        if let Some(refs) = refs {
            message["refs"] = json!(refs);
        }
        let line = format!("{message}\n");
        // In two pieces: lines do not come in packets.
        let (one, two) = line.as_bytes().split_at(line.len() / 2);
        self.stream.write_all(one).and_then(|()| self.stream.write_all(two)).map_err(|_| Closed)
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
                self.stream.write_all(&vec![b'x'; 2 << 20]).map_err(|_| Closed)
            }
            "SYS-VER" => {
                let body = json!({ "type": kind, "software": "fake", "version": "1.2.3" });
                self.send(Some(id), &body)
            }
            "UAV-LIST" => self.send(Some(id), &json!({ "type": kind, "ids": ["01", "02"] })),
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
            "UAV-RTH" | "UAV-LAND" => {
                let result: Map<String, Value> =
                    ids(body).into_iter().map(|id| (id, json!(true))).collect();
                self.send(Some(id), &json!({ "type": kind, "result": result }))
            }
            _ => self.nak(id, "no such message"),
        }
    }

    fn nak(&mut self, id: &str, reason: &str) -> Result<(), Closed> {
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
            let percent = if trouble && first && step >= 2 { 9 } else { 80 };
            let [lat, lon] = self.places[usize::from(!first)];
            let status = json!({
                "mode": mode,
                "errors": codes,
                "position": [lat, lon, 190_000, 0],
                "battery": [123, percent],
                "timestamp": looks,
            });
            (id.clone(), status)
        });
        Ok(status.collect())
    }

    fn upload(&mut self, id: &str, drone: &str) -> Result<(), Closed> {
        let receipt = self.receipt();
        let answer = json!({ "type": "OBJ-CMD", "receipt": { drone: receipt } });
        let end = json!({ "type": "ASYNC-RESP", "id": receipt, "result": null });
        if drone != "01" {
            // The end overtakes the receipt.
            self.send(None, &end)?;
            return self.send(Some(id), &answer);
        }
        self.send(Some(id), &answer)?;
        let progress = json!({ "percentage": 50, "message": "half" });
        self.send(None, &json!({ "type": "ASYNC-ST", "id": receipt, "progress": progress }))?;
        match self.fault {
            Fault::Upload(why) => {
                self.send(None, &json!({ "type": "ASYNC-RESP", "id": receipt, "error": why }))
            }
            Fault::UploadTimeout => {
                self.send(None, &json!({ "type": "ASYNC-TIMEOUT", "ids": [receipt] }))
            }
            _ => self.send(None, &end),
        }
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
            let more = if self.fault == Fault::LogSize { 100 } else { 0 };
            let size = log(drone).len() + more;
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
        let receipt = self.receipt();
        self.send(Some(id), &json!({ "type": "LOG-DATA", "receipt": receipt }))?;
        for percentage in [0, 30, 99] {
            let progress = json!({ "percentage": percentage });
            self.send(None, &json!({ "type": "ASYNC-ST", "id": receipt, "progress": progress }))?;
        }
        let bytes = log(drone);
        let body = match self.fault {
            Fault::LogCut => STANDARD.encode(&bytes[..5000]),
            Fault::LogGarbled => "?".to_owned(),
            Fault::LogIsNone => STANDARD.encode(vec![0; bytes.len()]),
            _ => STANDARD.encode(&bytes),
        };
        let result = json!({ "id": "2", "kind": "ardupilot", "size": bytes.len(), "body": body });
        self.send(None, &json!({ "type": "ASYNC-RESP", "id": receipt, "result": result }))
    }
}

/// The kinds that faults are named by.
fn leaked(kind: &str) -> &'static str {
    ["OBJ-CMD", "SHOW-SETCFG", "LOG-DATA"].into_iter().find(|known| *known == kind).unwrap_or("")
}
