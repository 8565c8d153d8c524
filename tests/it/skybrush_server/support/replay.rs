//! A recorded Skybrush Server: it answers as the real one did, to the same requests in the same
//! order. The recording is one of our client with Skybrush Server 2.50.0 and two of our virtual
//! drones, without the notifications that nobody asked for, the shows and the logs.

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::clock::TrialClock;
use super::log_of;

/// Requests that are asked again and again: answered with what the server said by then.
const LOOKS: [&str; 5] = ["SYS-VER", "UAV-LIST", "UAV-INF", "SHOW-CFG", "UAV-PREFLT"];
/// Work that took the server longer is over after so long.
const LONGEST_WORK: Duration = Duration::from_millis(200);

/// A request that does something, and all that came of it.
struct Step {
    at_s: f64,
    request: Value,
    answer: Value,
    /// What came later, after so long.
    later: Vec<(Duration, Value)>,
}

struct Recording {
    steps: VecDeque<Step>,
    /// Answers to looks, by kind, with their times.
    looks: BTreeMap<String, Vec<(f64, Value)>>,
    clock: TrialClock,
    /// The last step that was asked for: its time then, and now, ms.
    anchor: (f64, u64),
    start_unix_s: i64,
    surprises: Vec<String>,
}

/// The server, on a port of its own.
pub(crate) struct Replay {
    pub(crate) address: SocketAddr,
    pub(crate) clock: TrialClock,
    recording: Arc<Mutex<Recording>>,
}

fn read(name: &str, clock: TrialClock) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    let text = fs::read_to_string(path).unwrap();
    let mut steps: VecDeque<Step> = VecDeque::new();
    let mut looks: BTreeMap<String, Vec<(f64, Value)>> = BTreeMap::new();
    let mut asked: BTreeMap<String, Value> = BTreeMap::new();
    for line in text.lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        let Some(at_s) = line["t"].as_f64() else { continue };
        let message = &line["line"];
        let body = message["body"].clone();
        if line["from"] == "client" {
            let id = message["id"].as_str().unwrap().to_owned();
            if !LOOKS.contains(&body["type"].as_str().unwrap()) {
                let (answer, later) = (Value::Null, Vec::new());
                steps.push_back(Step { at_s, request: body.clone(), answer, later });
            }
            asked.insert(id, body);
            continue;
        }
        let answers = message["refs"].as_str().and_then(|refs| asked.get(refs));
        match answers {
            Some(request) if LOOKS.contains(&request["type"].as_str().unwrap()) => {
                let kind = request["type"].as_str().unwrap().to_owned();
                looks.entry(kind).or_default().push((at_s, body));
            }
            Some(request) => {
                let open = |step: &&mut Step| step.answer.is_null() && step.request == *request;
                steps.iter_mut().find(open).unwrap().answer = body;
            }
            None => {
                let receipt = body["id"].as_str().unwrap_or_default();
                let of_it = |step: &&mut Step| step.answer.to_string().contains(receipt);
                if let Some(step) = steps.iter_mut().find(of_it) {
                    let after = Duration::from_secs_f64((at_s - step.at_s).max(0.0));
                    step.later.push((after.min(LONGEST_WORK), body));
                }
            }
        }
    }
    let anchor = (0.0, clock.unix_ms());
    Recording { steps, looks, clock, anchor, start_unix_s: 0, surprises: Vec::new() }
}

impl Replay {
    pub(crate) fn start(name: &str) -> Self {
        let clock = TrialClock::start();
        let recording = Arc::new(Mutex::new(read(name, clock.clone())));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let shared = Arc::clone(&recording);
        std::thread::spawn(move || {
            // One after the other, as they were recorded.
            for stream in listener.incoming() {
                serve(&stream.unwrap(), &shared);
            }
        });
        Self { address, clock, recording }
    }

    /// What was not asked for as recorded; nothing: all was.
    pub(crate) fn surprises(&self) -> Vec<String> {
        let recording = self.recording.lock().unwrap();
        // How often lists of logs are asked for hangs on when the downloads end.
        let left = recording.steps.iter().filter(|step| step.request["type"] != "LOG-INF");
        let left = left.map(|step| format!("not asked: {}", step.request));
        recording.surprises.iter().cloned().chain(left).collect()
    }
}

fn serve(stream: &TcpStream, recording: &Arc<Mutex<Recording>>) {
    stream.set_nodelay(true).unwrap();
    let out = Arc::new(Mutex::new(stream.try_clone().unwrap()));
    let send = |out: &Mutex<TcpStream>, refs: Option<&str>, body: &Value| {
        let mut message = json!({ "$fw.version": "1.0", "id": "s", "body": body });
        if let Some(refs) = refs {
            message["refs"] = json!(refs);
        }
        // Whoever has asked may be gone.
        drop(writeln!(out.lock().unwrap(), "{message}"));
    };
    for line in BufReader::new(stream).lines() {
        let Ok(line) = line else { return };
        let message: Value = serde_json::from_str(&line).unwrap();
        let (id, body) = (message["id"].as_str().unwrap(), &message["body"]);
        let mut recording = recording.lock().unwrap();
        if LOOKS.contains(&body["type"].as_str().unwrap()) {
            send(&out, Some(id), &recording.look(body["type"].as_str().unwrap()));
            continue;
        }
        let Some(step) = recording.step(body) else {
            recording.surprises.push(format!("asked: {body}"));
            send(&out, Some(id), &json!({ "type": "ACK-NAK", "reason": "not as recorded" }));
            continue;
        };
        send(&out, Some(id), &step.answer);
        let out = Arc::clone(&out);
        std::thread::spawn(move || {
            let mut passed = Duration::ZERO;
            for (after, body) in step.later {
                std::thread::sleep(after.saturating_sub(passed));
                passed = after;
                send(&out, None, &body);
            }
        });
    }
}

impl Recording {
    /// What the server said by now, counted from the last step.
    fn look(&self, kind: &str) -> Value {
        let (at_s, since) = self.anchor;
        let end_s = self.steps.front().map_or(f64::INFINITY, |step| step.at_s);
        let passed_ms = self.clock.unix_ms().saturating_sub(since);
        let now_s = (at_s + passed_ms as f64 / 1000.0).min(end_s);
        let all = self.looks.get(kind).map(Vec::as_slice).unwrap_or_default();
        let found = all.iter().rev().find(|(said_s, _)| *said_s <= now_s).or(all.first());
        found.unwrap_or_else(|| panic!("{kind} was never asked")).1.clone()
    }

    /// The next step that is this request; shows, times and receipts may differ.
    fn step(&mut self, body: &Value) -> Option<Step> {
        let same = |step: &Step| {
            ["type", "command", "args", "ids", "uavId", "logId"]
                .iter()
                .all(|key| step.request.get(key) == body.get(key))
                && ["authorized", "uavIds", "method"].iter().all(|key| {
                    let pointer = format!("/configuration/start/{key}");
                    step.request.pointer(&pointer) == body.pointer(&pointer)
                })
        };
        let index = self.steps.iter().position(same)?;
        let mut step = self.steps.remove(index)?;
        self.anchor = (step.at_s, self.clock.unix_ms());
        if let Some(start) = body.pointer("/configuration/start/time").and_then(Value::as_i64) {
            self.start_unix_s = start;
        }
        // The logs are of the flight that is flown now.
        let drone = body["uavId"].as_str().or(body["ids"][0].as_str()).unwrap_or_default();
        if body["type"] == "LOG-DATA" || body["type"] == "LOG-INF" {
            let log = log_of(drone, self.start_unix_s);
            for (_, message) in &mut step.later {
                let result = &mut message["result"];
                if body["type"] == "LOG-DATA" && !result.is_null() {
                    result["body"] = json!(STANDARD.encode(&log));
                    result["size"] = json!(log.len());
                } else if let Some(newest) = result.as_array_mut().and_then(|all| all.last_mut()) {
                    newest["size"] = json!(log.len());
                }
            }
        }
        Some(step)
    }
}
