//! List of the logs on the drones, for people and for programs.

use schemars::JsonSchema;
use serde::Serialize;

use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::workflow::fleet::output::ListRow;

#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct ListOutput {
    schema: &'static str,
    drones: Vec<ListRow>,
}

/// Prints them; exit code 3 when one is not known.
pub(super) fn show(context: &Context, rows: Vec<ListRow>) -> Result<Exit, CommandError> {
    let lost = rows.iter().any(|row| row.reason.is_some());
    for row in &rows {
        if let Some(reason) = row.reason.as_ref().filter(|_| context.quiet || context.json) {
            context.warn(&format!("drone {}: {reason}", row.drone));
        }
    }
    if context.json {
        context.print_json(&ListOutput { schema: "updraft.log-list/1", drones: rows })?;
    } else {
        for row in &rows {
            let logs: Vec<String> = row
                .logs
                .iter()
                .map(|log| format!("{} ({:.1} MB)", log.number, log.bytes as f64 / 1e6))
                .collect();
            let what = row.reason.clone().unwrap_or_else(|| match logs.len() {
                0 => "no logs".to_owned(),
                _ => logs.join(", "),
            });
            let slot = row.slot.map_or_else(|| "-".to_owned(), |slot| slot.to_string());
            context.emit(&format!("drone {:>4}  slot {slot:>4}  {what}\n", row.drone))?;
        }
    }
    Ok(if lost { Exit::Losses } else { Exit::Done })
}
