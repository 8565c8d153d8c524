//! `updraft blind verify`: whether anybody has altered a game.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::workflow::game::verify::{self, Verification};

/// Digits of a SHA-256.
const DIGITS: usize = 64;

/// Arguments of `updraft blind verify`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft blind verify game
  updraft blind verify game --sha256 3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b8550

Checks that the sealed truth with its nonce, the flight's files, the verdict and the record belong
together, and names what was altered. It can be used before the seal is opened as well, and tells
nothing of the truth then. With --sha256 the truth is held against the hash that was published when
the game was made, not against those in the folder, which somebody may have altered too. Exit code
4: something was altered.")]
pub(super) struct VerifyArgs {
    /// Folder of the game
    game: PathBuf,
    /// SHA-256 of the truth, as it was published
    #[arg(long, value_name = "HASH", value_parser = hash)]
    sha256: Option<String>,
}

fn hash(text: &str) -> Result<String, String> {
    let is_hash = text.len() == DIGITS && text.chars().all(|c| c.is_ascii_hexdigit());
    is_hash.then(|| text.to_lowercase()).ok_or_else(|| format!("{DIGITS} hexadecimal digits"))
}

pub(super) fn run(context: &Context, args: &VerifyArgs) -> Result<Exit, CommandError> {
    let verified = verify::run(&args.game, args.sha256.as_deref())?;
    if context.json {
        context.print_json(&verified)?;
    } else {
        context.print(&text(&verified))?;
    }
    // What is not on standard output goes to the other.
    if context.quiet || context.json {
        for wrong in verified.checks.iter().filter_map(|check| check.wrong(": ")) {
            context.warn(&wrong);
        }
    }
    Ok(if verified.intact { Exit::Done } else { Exit::Unsafe })
}

fn text(verified: &Verification) -> String {
    let mut text = String::new();
    for check in &verified.checks {
        let _ = match check.wrong(": ") {
            None => writeln!(text, "ok     {}  {}", check.file, check.holds),
            Some(wrong) => writeln!(text, "WRONG  {wrong}"),
        };
    }
    let _ = writeln!(text, "SHA-256 that the truth is held against: {}", verified.truth_sha256);
    text.push_str(match (verified.intact, verified.revealed) {
        (true, true) => "All of it belongs together: the truth is the one that was published, and the seal was opened for this verdict.\n",
        (true, false) => "All of it belongs together. The seal was not opened yet.\n",
        (false, _) => "Something was altered or is missing: as it is, this game proves nothing.\n",
    });
    text
}
