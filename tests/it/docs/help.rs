//! Examples in the help of every command.

use clap::{Command, CommandFactory as _};
use updraft::cli::Cli;

use super::read::{own_words, takes};
use crate::cli::support::Bench;

/// Commands whose examples are run, too: they take a moment, and neither drones nor flights.
const RUN: [&str; 5] = ["plan", "effects", "man", "schema", "completions"];

/// Examples of the long help of a command and all below it, each with the command's name.
fn examples(command: &Command, above: &str) -> Vec<(String, String)> {
    let name = format!("{above}{}", command.get_name());
    let help = command.get_after_long_help().map(ToString::to_string).unwrap_or_default();
    let lines = help.lines().filter_map(|line| line.strip_prefix("  updraft "));
    let mut found: Vec<_> = lines
        // Comments stand behind two spaces.
        .filter_map(|line| line.split("  ").next())
        .map(|line| (name.clone(), format!("updraft {}", line.split(" # ").next().unwrap_or(line))))
        .collect();
    for inner in command.get_subcommands() {
        found.extend(examples(inner, &format!("{name} ")));
    }
    found
}

#[test]
fn every_command_has_examples_that_it_takes() {
    let command = Cli::command();
    let all = examples(&command, "");
    let wrong: Vec<String> = all
        .iter()
        .filter_map(|(name, text)| {
            let words = own_words(text)?;
            takes(&words, true).err().map(|error| format!("{name}: {text}\n  {error}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for inner in command.get_subcommands() {
        let name = format!("updraft {}", inner.get_name());
        assert!(all.iter().any(|(of, _)| of.starts_with(&name)), "{name} has no examples");
    }
}

#[test]
fn examples_of_quick_commands_run() {
    let bench = Bench::new();
    for (name, text) in examples(&Cli::command(), "") {
        let own = name.strip_prefix("updraft ").unwrap_or_default();
        let of = text.split_whitespace().nth(1).unwrap_or_default();
        if RUN.contains(&own) && RUN.contains(&of) && !text.contains('~') {
            let words = own_words(&text).unwrap();
            let words: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
            bench.expect(0, &words);
        }
    }
}
