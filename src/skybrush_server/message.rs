//! Envelope of the server's messages: version, identifier, body.

use serde_json::{Value, json};

use crate::base::parse;

/// Version of the server's protocol.
const VERSION: &str = "1.0";

/// A message from the server.
#[derive(Clone, Debug, PartialEq)]
pub struct Incoming {
    /// Identifier of the request that the message answers, if it answers one.
    pub refers_to: Option<String>,
    /// Type of the body.
    pub kind: String,
    /// Body of the message, with its `type`.
    pub body: Value,
}

/// A request as a line.
pub(super) fn request(id: &str, body: &Value) -> String {
    let mut line = json!({ "$fw.version": VERSION, "id": id, "body": body }).to_string();
    line.push('\n');
    line
}

/// Reads a line from the server; `None` if it is not one of its messages.
pub fn parse(line: &[u8]) -> Option<Incoming> {
    let mut value: Value = parse::json(line).ok()?;
    let refers_to = value.get("refs").and_then(Value::as_str).map(str::to_owned);
    let body = value.get_mut("body")?.take();
    let kind = body.get("type")?.as_str()?.to_owned();
    Some(Incoming { refers_to, kind, body })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::plain::acts;

    #[test]
    fn what_a_server_says_is_text() {
        let line =
            br#"{ "refs": "1", "body": { "type": "ACK-NAK", "reason": "x\u001b[2K\rGO\nGO\u202e",
            "failed": { "01\u001b": "no\u0007" } } }"#;
        let incoming = parse(line).unwrap();
        let text = incoming.body.to_string();
        assert_eq!(incoming.body["reason"], "x␛[2K␍GO␊GO\u{fffd}");
        assert_eq!(incoming.body["failed"]["01␛"], "no␇");
        assert!(!text.contains(acts) && !text.contains("\\u00"), "{text}");
    }
}
