//! The arguments that a command was given, to be written into a script.

use std::collections::BTreeSet;

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, CommandFactory as _};

use crate::cli::exit::CommandError;
use crate::cli::{Cli, Global};

/// Names of all arguments of a set.
fn names<T: Args>() -> BTreeSet<String> {
    let command = T::augment_args(Command::new("names"));
    command.get_arguments().map(|arg| arg.get_id().to_string()).collect()
}

/// Arguments of the command behind `cluster WORD COMMAND`, as the user gave them: positional ones first. Those
/// of `Without` and the global ones are left away.
pub(super) fn arguments<Without: Args>(
    word: &str,
    command: &str,
) -> Result<Vec<String>, CommandError> {
    let definition = Cli::command();
    // It was understood once.
    let fail = |error: clap::Error| CommandError::Usage(error.to_string());
    let matches = definition.clone().try_get_matches().map_err(fail)?;
    let path = ["cluster", word, command];
    let (mut definition, mut matches) = (&definition, &matches);
    for step in path {
        let lost = || CommandError::Failed(format!("the command line has no {step}"));
        matches = matches.subcommand_matches(step).ok_or_else(lost)?;
        definition = definition.find_subcommand(step).ok_or_else(lost)?;
    }
    let mut left_away = names::<Global>();
    left_away.extend(names::<Without>());
    given(definition, matches, &left_away)
}

fn given(
    definition: &Command,
    matches: &ArgMatches,
    left_away: &BTreeSet<String>,
) -> Result<Vec<String>, CommandError> {
    let (mut positional, mut options) = (Vec::new(), Vec::new());
    for arg in definition.get_arguments() {
        let id = arg.get_id().as_str();
        if left_away.contains(id) || matches.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let Some(long) = arg.get_long() else {
            positional.extend(raw(matches, id)?);
            continue;
        };
        if arg.get_action().takes_values() {
            options.extend(raw(matches, id)?.iter().map(|value| format!("--{long}={value}")));
        } else {
            options.push(format!("--{long}"));
        }
    }
    if let Some(odd) = positional.iter().find(|value| value.starts_with('-')) {
        return Err(CommandError::Usage(format!("give \"{odd}\" as ./{odd} on a cluster")));
    }
    positional.append(&mut options);
    Ok(positional)
}

fn raw(matches: &ArgMatches, id: &str) -> Result<Vec<String>, CommandError> {
    let values = matches.get_raw(id).into_iter().flatten();
    let text = |value: &std::ffi::OsStr| {
        let wrong = || {
            CommandError::Usage(format!(
                "an argument for a cluster must be UTF-8: {}",
                value.to_string_lossy()
            ))
        };
        value.to_str().map(str::to_owned).ok_or_else(wrong)
    };
    values.map(text).collect()
}
