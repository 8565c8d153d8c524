//! What became of the logs.

use crate::cli::context::Context;
use crate::cli::fly_output::LogOutput;

/// In a line what came of it.
pub(super) fn sum_up(context: &Context, rows: &[LogOutput]) {
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
