//! What became of the logs.

use serde::Serialize;

use crate::cli::context::Context;

/// What became of a slot's log, for `--json`.
#[derive(Clone, Debug, Serialize)]
pub(in crate::cli) struct Row {
    pub(in crate::cli) slot: u16,
    /// The server's name of the drone; none stands there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) drone: Option<String>,
    /// `pulled`, `there` or `missing`.
    pub(in crate::cli) state: &'static str,
    pub(in crate::cli) bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::cli) reason: Option<String>,
}

/// In a line what came of it.
pub(super) fn sum_up(context: &Context, rows: &[Row]) {
    let count = |state: &str| rows.iter().filter(|row| row.state == state).count();
    let (pulled, there) = (count("pulled"), count("there"));
    context.say(&format!(
        "Brought {} of {} logs home{}",
        pulled + there,
        rows.len(),
        match there {
            0 => String::new(),
            there => format!(" ({there} had come before)"),
        }
    ));
}
