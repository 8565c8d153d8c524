//! Table of the logs that were brought home, and of those that were not.

use crate::workflow::fleet::bring::LogState;
use crate::workflow::fleet::output::LogOutput;
use crate::workflow::host::Host;

/// In a line what came of it.
pub(super) fn sum_up(host: &dyn Host, rows: &[LogOutput]) {
    let count = |state: LogState| rows.iter().filter(|row| row.state == state).count();
    let (pulled, there) = (count(LogState::Pulled), count(LogState::There));
    host.say(&format!(
        "Downloaded {} of {} logs{}",
        pulled + there,
        rows.len(),
        match there {
            0 => String::new(),
            there => format!(" ({there} already here)"),
        }
    ));
}
