//! `updraft blind reveal`: what a game has hidden, once there is a verdict.

use std::path::PathBuf;

use clap::Args;

use crate::blind::record::BlindRecord;
use crate::blind::told::gap_words;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::workflow::game::reveal;

/// Arguments of `updraft blind reveal`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft blind hide -o game
  updraft gap game
  updraft blind reveal game
  updraft blind reveal game --gap elsewhere       # the comparison was written to another folder

Opens the seal only when there is a verdict, and only if verdict, truth and flight are as they were
written. reveal.json then has what was hidden, what was said, whether that is right, and the SHA-256
of truth and verdict. A seal is opened once: for another verdict there must be another game. Exit
code 5: there is no verdict yet; the truth stays sealed.")]
pub(super) struct RevealArgs {
    /// Folder of the game
    game: PathBuf,
    /// Folder of the comparison [default: GAME/gap]
    #[arg(long, value_name = "FOLDER")]
    gap: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &RevealArgs) -> Result<Exit, CommandError> {
    let (record, path) = reveal::run(context, &args.game, args.gap.as_deref())?;
    if context.json {
        context.print_json(&record)?;
    } else {
        context.print(&text(&record))?;
    }
    context.result(&path)?;
    Ok(Exit::Done)
}

fn text(record: &BlindRecord) -> String {
    let mut lines =
        vec![format!("Hidden:   {}", record.truth), format!("Verdict:  {}", record.verdict)];
    if let Some(shrink) = &record.shrink {
        lines.push(format!("Gap:      {}", gap_words(shrink)));
    }
    lines.extend(record.air.iter().map(|air| format!("Air:      {air}")));
    lines.push(String::new());
    lines.extend(record.words.iter().cloned());
    lines.push(String::new());
    lines.push(format!("SHA-256 of the truth:   {}", record.truth_sha256));
    lines.push(format!("SHA-256 of the verdict: {}", record.verdict_sha256));
    lines.join("\n") + "\n"
}
