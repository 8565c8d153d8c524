//! Start and end of a show through the server.

use serde_json::{Value, json};

use super::client::Client;
use super::error::ServerError;
use super::work::Job;
use crate::protocol::show::SHOW_MODE;

/// Start of a show: time, authorization, and the drones that take part.
#[derive(Clone, Debug, PartialEq)]
pub struct StartConfig {
    /// Start time, Unix, whole seconds; `None`: no start.
    pub unix_s: Option<i64>,
    /// Whether the start is authorized.
    pub authorized: bool,
    /// Drones that take part, as the server names them.
    pub drones: Vec<String>,
    /// Duration of the show, s.
    pub duration_s: f64,
}

impl StartConfig {
    /// A configuration without a start: no time, no authorization, no drones.
    pub fn none() -> Self {
        Self { unix_s: None, authorized: false, drones: Vec::new(), duration_s: 0.0 }
    }
}

impl StartConfig {
    /// The request that sets this start.
    pub fn body(&self) -> Value {
        json!({
            "type": "SHOW-SETCFG",
            "configuration": {
                "start": {
                    "authorized": self.authorized,
                    "authorizationScope": "live",
                    "clock": null,
                    "time": self.unix_s,
                    "method": "auto",
                    "uavIds": self.drones,
                },
                "duration": self.duration_s,
            },
        })
    }
}

impl Client {
    /// Gives the server the start; it passes it on to the drones once a second.
    ///
    /// # Errors
    ///
    /// If the server refuses, does not answer, or the connection breaks.
    pub fn set_start(&mut self, start: &StartConfig) -> Result<(), ServerError> {
        self.ask(&start.body()).map(|_| ())
    }

    /// Start that is authorized at the server, if one is.
    ///
    /// # Errors
    /// When the server does not say whether there is one.
    pub fn authorized(&mut self) -> Result<Option<Authorized>, ServerError> {
        let answer = self.ask(&json!({ "type": "SHOW-CFG" }))?;
        let start = answer.pointer("/configuration/start");
        let is_authorized = start.and_then(|start| start.get("authorized")?.as_bool());
        let is_authorized = is_authorized.ok_or_else(|| ServerError::Answer {
            what: "SHOW-CFG".to_owned(),
            problem: "it does not say whether a start is authorized".to_owned(),
        })?;
        let unix_s = start.and_then(|start| start.get("time")?.as_f64());
        let when = unix_s.map_or(Authorized::Anyhow, |unix_s| Authorized::At(unix_s as i64));
        Ok(is_authorized.then_some(when))
    }
}

/// A start that the server has authorized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Authorized {
    /// A start at this Unix time, s.
    At(i64),
    /// A start by hand, or by a clock of the server's own.
    Anyhow,
}

/// The request that sends drones home, or lets them land where they are.
pub fn end_flight(drones: &[String], home: bool) -> Value {
    json!({ "type": if home { "UAV-RTH" } else { "UAV-LAND" }, "ids": drones })
}

/// The request that switches a drone to show mode, as over its own link: by number.
pub fn show_mode(drone: &str) -> Job {
    mode(drone, SHOW_MODE)
}

/// The request that switches a drone to a flight mode, as a number: the server passes numbers on as
/// they are, while it has its own names for modes.
pub fn mode(drone: &str, number: u32) -> Job {
    let body = json!({
        "type": "OBJ-CMD",
        "ids": [drone],
        "command": "mode",
        "args": [number.to_string()],
    });
    Job { drone: drone.to_owned(), body }
}
