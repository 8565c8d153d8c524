//! The server's envelope.

use serde_json::{Value, json};

use crate::base::parse;

/// The protocol's version.
const VERSION: &str = "1.0";

/// A message from the server.
#[derive(Clone, Debug, PartialEq)]
pub struct Incoming {
    /// The request that it answers.
    pub refers_to: Option<String>,
    /// Kind of the body.
    pub kind: String,
    /// The body.
    pub body: Value,
}

/// A request as a line.
pub(super) fn request(id: &str, body: &Value) -> String {
    let mut line = json!({ "$fw.version": VERSION, "id": id, "body": body }).to_string();
    line.push('\n');
    line
}

/// A line from the server; `None`: it is none of its messages.
pub fn parse(line: &[u8]) -> Option<Incoming> {
    let mut value: Value = parse::json(line).ok()?;
    let refers_to = value.get("refs").and_then(Value::as_str).map(str::to_owned);
    let body = value.get_mut("body")?.take();
    let kind = body.get("type")?.as_str()?.to_owned();
    Some(Incoming { refers_to, kind, body })
}
