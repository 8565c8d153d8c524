//! Logs through the server, one download per drone at a time.

use std::collections::BTreeMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::client::{Client, text};
use super::error::ServerError;
use super::work::Job;

/// A log on a drone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogEntry {
    /// Identifier of the log on the server.
    pub id: String,
    /// Size of the log, bytes.
    pub size: u64,
    /// Date of the log, Unix time, s; `None` when the autopilot had no clock.
    pub unix_s: Option<i64>,
}

impl Client {
    /// Lists the logs of drones; the value of a drone is its list, or what went wrong with it. The
    /// wait ends when `go_on` returns false.
    ///
    /// # Errors
    /// When the server refuses, or is not there.
    pub fn logs(
        &mut self,
        drones: &[String],
        go_on: impl FnMut() -> bool,
    ) -> Result<BTreeMap<String, Result<Vec<LogEntry>, String>>, ServerError> {
        let running = self.begin(&list_body(drones))?;
        let ended = self.finish(running, go_on)?;
        Ok(ended
            .into_iter()
            .map(|(drone, outcome)| (drone, outcome.and_then(|value| log_entries(&value))))
            .collect())
    }
}

fn list_body(drones: &[String]) -> Value {
    json!({ "type": "LOG-INF", "ids": drones })
}

/// The request for a list of a drone's logs; [`log_entries`] reads its result.
pub fn list_logs(drone: &str) -> Job {
    Job { drone: drone.to_owned(), body: list_body(&[drone.to_owned()]) }
}

/// The request for a log; [`log_bytes`] reads its result.
pub fn fetch_log(drone: &str, log: &str) -> Job {
    let body = json!({ "type": "LOG-DATA", "uavId": drone, "logId": log });
    Job { drone: drone.to_owned(), body }
}

/// Reads the list of logs in the result of a LOG-INF request.
///
/// # Errors
/// When it is no list.
pub fn log_entries(value: &Value) -> Result<Vec<LogEntry>, String> {
    let list = value.as_array().ok_or("the server's list of logs is not a list")?;
    Ok(list
        .iter()
        .filter(|entry| text(entry, "kind") == Some("ardupilot"))
        .filter_map(|entry| {
            Some(LogEntry {
                id: text(entry, "id")?.to_owned(),
                size: entry.get("size")?.as_u64()?,
                unix_s: entry.get("timestamp").and_then(Value::as_i64).filter(|time| *time > 0),
            })
        })
        .collect())
}

/// Reads the bytes of a downloaded log, and checks that their number is as announced.
///
/// # Errors
/// When they are not all there.
pub fn log_bytes(value: &Value) -> Result<Vec<u8>, String> {
    let body = text(value, "body").ok_or("the server sent no log")?;
    let bytes = STANDARD.decode(body).map_err(|error| format!("the log is garbled: {error}"))?;
    match value.get("size").and_then(Value::as_u64) {
        Some(size) if size != bytes.len() as u64 => {
            Err(format!("the server sent {} of {size} bytes", bytes.len()))
        }
        _ => Ok(bytes),
    }
}
