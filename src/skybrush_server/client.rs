//! Client of a Skybrush Server: requests, receipts and notifications.

use std::collections::BTreeMap;
use std::io::{self, Read as _, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};

use super::error::ServerError;
use super::lines::Lines;
use super::message::{self, Incoming};
use super::work::Outcome;
use crate::link::clock::{Clock, Micros, S};

/// Longest line: a log of 380 MB in base64.
const MOST_LINE: usize = 512 << 20;
/// An answer to a request comes at once.
const ANSWER: Micros = 10 * S;
/// Longest wait on the socket at once.
const LOOK: Duration = Duration::from_millis(100);
const CONNECT: Duration = Duration::from_secs(5);
/// Notifications that nobody has asked for yet; more are forgotten, the oldest first.
const KEPT: usize = 10_000;

/// A connection to a server.
pub struct Client {
    stream: TcpStream,
    lines: Lines,
    most_line: usize,
    pub(super) clock: Arc<dyn Clock>,
    next_id: u64,
    /// Ends of work by receipt, and progress.
    pub(super) ended: BTreeMap<String, Outcome>,
    pub(super) moved: BTreeMap<String, (Micros, f64)>,
}

impl Client {
    /// Connects to a server at `host:port`.
    ///
    /// # Errors
    ///
    /// [`ServerError::Connect`] if the name has no address or none of its addresses answers.
    pub fn connect(address: &str, clock: Arc<dyn Clock>) -> Result<Self, ServerError> {
        let port = address.rsplit_once(':').and_then(|(_, port)| port.parse().ok()).unwrap_or(0);
        let fail = |source| ServerError::Connect { address: address.to_owned(), port, source };
        let mut last = io::Error::from(io::ErrorKind::NotFound);
        for place in address.to_socket_addrs().map_err(fail)? {
            match TcpStream::connect_timeout(&place, CONNECT) {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(fail)?;
                    stream.set_read_timeout(Some(LOOK)).map_err(fail)?;
                    stream.set_write_timeout(Some(CONNECT)).map_err(fail)?;
                    return Ok(Self {
                        stream,
                        lines: Lines::new(MOST_LINE),
                        most_line: MOST_LINE,
                        clock,
                        next_id: 0,
                        ended: BTreeMap::new(),
                        moved: BTreeMap::new(),
                    });
                }
                Err(error) => last = error,
            }
        }
        Err(fail(last))
    }

    /// Sets the longest line that is accepted from the server, bytes.
    #[must_use]
    pub fn with_longest_line(mut self, bytes: usize) -> Self {
        self.lines = Lines::new(bytes);
        self.most_line = bytes;
        self
    }

    /// Sends a request and waits for the body of its answer.
    ///
    /// # Errors
    ///
    /// If the server refuses, does not answer, or the connection breaks.
    pub fn ask(&mut self, body: &Value) -> Result<Value, ServerError> {
        self.ask_within(body, ANSWER)
    }

    /// Sends a request and waits at most `patience` for the body of its answer.
    pub(super) fn ask_within(
        &mut self,
        body: &Value,
        patience: Micros,
    ) -> Result<Value, ServerError> {
        let what = kind_of(body);
        let id = self.send(body)?;
        let until = self.clock.now() + patience;
        loop {
            let Some(incoming) = self.receive(&what, until)? else {
                return Err(ServerError::Silent { what, seconds: patience / S });
            };
            if incoming.refers_to.as_deref() != Some(&id) {
                self.note(&incoming);
                continue;
            }
            if incoming.kind == "ACK-NAK" {
                let reason = text(&incoming.body, "reason").unwrap_or("no reason given").to_owned();
                return Err(ServerError::Refused { what, reason });
            }
            return Ok(incoming.body);
        }
    }

    fn send(&mut self, body: &Value) -> Result<String, ServerError> {
        self.next_id += 1;
        let id = format!("updraft-{}", self.next_id);
        let line = message::request(&id, body);
        self.stream
            .write_all(line.as_bytes())
            .map_err(|source| ServerError::Broken { what: kind_of(body), source })?;
        Ok(id)
    }

    /// The next message until a time.
    pub(super) fn receive(
        &mut self,
        what: &str,
        until: Micros,
    ) -> Result<Option<Incoming>, ServerError> {
        let broken = |source| ServerError::Broken { what: what.to_owned(), source };
        let most = self.most_line;
        let mut buffer = vec![0; 1 << 16];
        loop {
            while let Some(line) = self.lines.next_line() {
                if let Some(incoming) = message::parse(&line) {
                    return Ok(Some(incoming));
                }
            }
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(broken(io::ErrorKind::UnexpectedEof.into())),
                Ok(size) => {
                    self.lines.push(&buffer[..size]).map_err(|_| ServerError::TooLong { most })?;
                }
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => self.clock.waited(LOOK),
                    io::ErrorKind::Interrupted => {}
                    _ => return Err(broken(error)),
                },
            }
            if self.clock.now() >= until {
                return Ok(None);
            }
        }
    }

    /// Keeps a notification until it is asked for.
    pub(super) fn note(&mut self, incoming: &Incoming) {
        let body = &incoming.body;
        match incoming.kind.as_str() {
            "ASYNC-RESP" => {
                let Some(receipt) = text(body, "id") else { return };
                let outcome = match body.get("error") {
                    Some(error) if !error.is_null() => Err(words(error)),
                    _ => Ok(body.get("result").cloned().unwrap_or(Value::Null)),
                };
                self.ended.insert(receipt.to_owned(), outcome);
            }
            "ASYNC-ST" => {
                let Some(receipt) = text(body, "id") else { return };
                let percentage = body.pointer("/progress/percentage").and_then(Value::as_f64);
                let share = percentage.unwrap_or(0.0).clamp(0.0, 100.0) / 100.0;
                self.moved.insert(receipt.to_owned(), (self.clock.now(), share));
            }
            "ASYNC-TIMEOUT" => {
                let ids = body.get("ids").and_then(Value::as_array).cloned().unwrap_or_default();
                for receipt in ids.iter().filter_map(Value::as_str) {
                    let late = Err("the server gave up: the drone does not answer".to_owned());
                    self.ended.insert(receipt.to_owned(), late);
                }
            }
            _ => {}
        }
        while self.ended.len() > KEPT {
            self.ended.pop_first();
        }
        while self.moved.len() > KEPT {
            self.moved.pop_first();
        }
    }

    /// Identifiers of the drones that the server knows.
    ///
    /// # Errors
    ///
    /// As [`Client::ask`].
    pub fn drones(&mut self) -> Result<Vec<String>, ServerError> {
        let answer = self.ask(&json!({ "type": "UAV-LIST" }))?;
        let ids = answer.get("ids").and_then(Value::as_array).ok_or_else(|| {
            ServerError::Answer { what: "UAV-LIST".to_owned(), problem: "it has no ids".to_owned() }
        })?;
        Ok(ids.iter().filter_map(Value::as_str).map(str::to_owned).collect())
    }

    /// Name and version of the server.
    ///
    /// # Errors
    ///
    /// As [`Client::ask`].
    pub fn version(&mut self) -> Result<String, ServerError> {
        let answer = self.ask(&json!({ "type": "SYS-VER" }))?;
        let part = |key| text(&answer, key).unwrap_or("?").to_owned();
        Ok(format!("{} {}", part("software"), part("version")))
    }

    /// Status of drones by identifier, as the server reports it (UAV-INF).
    ///
    /// # Errors
    ///
    /// As [`Client::ask`].
    pub fn status(&mut self, drones: &[String]) -> Result<BTreeMap<String, Value>, ServerError> {
        let answer = self.ask(&json!({ "type": "UAV-INF", "ids": drones }))?;
        Ok(entries(&answer, "status").collect())
    }
}

impl Client {
    /// Reports of the drones' autopilots on failing arming checks, by drone.
    ///
    /// # Errors
    /// When the server refuses, or is not there.
    pub fn arming_checks(
        &mut self,
        drones: &[String],
        go_on: impl FnMut() -> bool,
    ) -> Result<BTreeMap<String, String>, ServerError> {
        let running = self.begin(&json!({ "type": "UAV-PREFLT", "ids": drones }))?;
        let told = self.finish(running, go_on)?.into_iter();
        let words = |(drone, outcome): (String, Outcome)| {
            // It may lag behind: what has passed is no reason.
            let report = outcome.ok().filter(|report| text(report, "result") != Some("pass"))?;
            let message = text(&report, "message").filter(|message| !message.is_empty())?;
            Some((drone, message.to_owned()))
        };
        Ok(told.filter_map(words).collect())
    }
}

fn kind_of(body: &Value) -> String {
    match (text(body, "type"), text(body, "command")) {
        (Some(kind), Some(command)) => format!("{kind} {command}"),
        (Some(kind), None) => kind.to_owned(),
        _ => "a request".to_owned(),
    }
}

pub(super) fn text<'a>(value: &'a Value, key: &str) -> Option<&'a str> {
    value.get(key).and_then(Value::as_str)
}

pub(super) fn entries(value: &Value, key: &str) -> impl Iterator<Item = (String, Value)> {
    value.get(key).and_then(Value::as_object).cloned().unwrap_or_default().into_iter()
}

pub(super) fn words(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
