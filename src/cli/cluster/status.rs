//! `updraft cluster status`.

use std::path::Path;
use std::time::Duration;

use crate::base::plain::Shown as _;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::workflow::clock::Spent;
use crate::workflow::cluster::{ShardState, Status, status};

/// Shards that are named in a table.
const MOST_SHOWN: usize = 20;

pub(super) fn run(context: &Context, folder: &Path) -> Result<Exit, CommandError> {
    let status = status(context, folder)?;
    if context.json {
        context.print_json(&status)?;
    } else {
        context.print(&text(&status))?;
    }
    Ok(if status.ended.is_empty() && status.stuck.is_empty() { Exit::Done } else { Exit::Losses })
}

fn text(status: &Status) -> String {
    let share = 100.0 * status.done as f64 / status.items.max(1) as f64;
    let mut lines = vec![
        status.command.clone(),
        format!("  results   {} of {} ({share:.0} %)", status.done, status.items),
    ];
    if let Some(per_minute) = status.per_minute {
        lines.push(format!("  rate      {} a minute", short(per_minute)));
    }
    if let Some(left_s) = status.left_s.filter(|_| status.done < status.items) {
        let left = Spent(Duration::from_secs_f64(left_s.min(1e9)));
        lines.push(format!("  left      about {left} at this rate"));
    }
    lines.push(tasks(status));
    shards(&mut lines, "stuck", &status.stuck, |shard| {
        let silent = Spent(Duration::from_secs_f64(shard.silent_s.unwrap_or(0.0)));
        format!("no result for {silent} on {}", shard.place.as_deref().unwrap_or("?"))
    });
    shards(&mut lines, "ended", &status.ended, |_| "its task has ended".to_owned());
    if !status.ended.is_empty() && status.running + status.waiting == 0 {
        lines.push("  submit the same command again: only what is missing is made".to_owned());
    }
    if status.complete {
        lines.push("  complete  all results are there and were put together".to_owned());
    } else if status.done == status.items && !status.merge_waits {
        lines.push("  open      all results are there, but were not put together:".to_owned());
        lines.push(format!("            {} --no-fly", status.command));
    }
    lines.push(format!("  output    {}", status.folder.shown()));
    lines.join("\n") + "\n"
}

fn tasks(status: &Status) -> String {
    if let Some(reason) = &status.queue_unknown {
        return format!("  tasks     unknown: {reason}");
    }
    let merge = if status.merge_waits { ", then the merge" } else { "" };
    let age = match status.queue_age_s {
        0 => String::new(),
        age_s => format!(" ({age_s} s ago)"),
    };
    let why = match status.waiting_for.as_slice() {
        [] => String::new(),
        reasons => format!(" ({})", reasons.join(", ")),
    };
    format!("  tasks     {} running, {} waiting{why}{merge}{age}", status.running, status.waiting)
}

fn shards(
    lines: &mut Vec<String>,
    what: &str,
    all: &[ShardState],
    why: impl Fn(&ShardState) -> String,
) {
    for shard in all.iter().take(MOST_SHOWN) {
        lines.push(format!(
            "  {what:<9} shard {}: {} missing, {}",
            shard.shard,
            shard.missing,
            why(shard)
        ));
    }
    if all.len() > MOST_SHOWN {
        lines.push(format!("  {what:<9} and {} more", all.len() - MOST_SHOWN));
    }
}

/// A rate with two digits.
fn short(per_minute: f64) -> String {
    if per_minute < 10.0 { format!("{per_minute:.1}") } else { format!("{per_minute:.0}") }
}
