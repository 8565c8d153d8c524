//! Options of commands whose items can be shared out between processes.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::words;
use crate::base::shard::{Shard, Share};
use crate::workflow::share::ShardDone;

/// The word for the shard of an array job's task.
const SLURM: &str = "slurm";

/// Which items are worked on.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = "Sharing the work (docs/cluster.md)")]
pub(super) struct ShardArgs {
    /// Only every N-th item, from the K-th on, for one of N processes; `slurm` takes K and N from the
    /// array job. The same command without --shard puts the results together
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub(super) shard: Option<Shard>,
    /// Make nothing: put together what is there, or name what is missing (exit code 3)
    #[arg(long)]
    pub(super) no_fly: bool,
}

/// Parser of `--shard`.
fn shard(text: &str) -> Result<Shard, String> {
    let found = match text {
        SLURM => Shard::of_slurm(|name| std::env::var(name).ok()),
        text => text.parse(),
    };
    found.map_err(|error| error.to_string())
}

impl ShardArgs {
    /// The share that was asked for.
    pub(super) fn share(self) -> Share {
        Share { shard: self.shard, gather_only: self.no_fly }
    }
}

/// What `--json` prints of a shard.
#[derive(Serialize, JsonSchema)]
pub(super) struct ShardOutput<'a> {
    /// Format name and version: `updraft.shard/1`.
    schema: &'static str,
    /// Shard, as `K/N`.
    shard: String,
    /// Number of its items.
    items: usize,
    /// Number of those that were finished before.
    there: usize,
    /// Number of those that this process made.
    made: usize,
    /// Reasons why others could not be made.
    lost: &'a [String],
}

/// Says what a shard has done; `item`: one of its items, in a word or two.
pub(super) fn report(
    context: &Context,
    done: &ShardDone,
    item: &str,
) -> Result<Exit, CommandError> {
    if context.json {
        context.print_json(&ShardOutput {
            schema: "updraft.shard/1",
            shard: done.shard.to_string(),
            items: done.items,
            there: done.there,
            made: done.made(),
            lost: &done.lost,
        })?;
    }
    context.say(&format!(
        "Shard {}: {} complete, {} of them made now",
        done.shard,
        words::count(done.items - done.lost.len(), item),
        done.made()
    ));
    Ok(done.ending().into())
}
