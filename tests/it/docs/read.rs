//! Examples as the program reads them: options that exist, values that it takes, files that are there.

use std::path::Path;

use clap::Parser as _;
use clap::error::ErrorKind;
use updraft::cli::Cli;

use super::blocks::{self, Example};

/// What stands for something behind a word, and an instance of it.
const BEHIND: &[(&str, &str, &str)] = &[
    ("--effect", "NAME", "battery"),
    ("schema", "NAME", "plan"),
    ("--connect", "...", "udpin:0.0.0.0:14550"),
];
/// What stands for something in the documents, and an instance of it.
const PLACEHOLDERS: &[(&str, &str)] = &[
    ("LAT,LON", "47.4733,19.0621"),
    ("DEG", "90"),
    ("M", "190"),
    ("SEED", "21"),
    ("K/N", "1/8"),
    ("HASH", "3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b8550"),
    ("{}/40", "1/40"),
    ("{}/16", "1/16"),
];

/// Words of the program's own command line; `None`: it is another program's.
pub(crate) fn own_words(text: &str) -> Option<Vec<String>> {
    // What feeds it, and what it is fed to.
    let text = text.split(" | man").next()?.split(" > ").next()?;
    let from = match text.find("updraft ") {
        Some(at) if at == 0 || text[..at].ends_with(' ') => at,
        _ => {
            let run = text.strip_prefix("cargo run --release -- ")?;
            return Some(with_placeholders(&format!("updraft {run}")));
        }
    };
    let own = text[from..].split(['\'', ';']).next()?;
    let is_first = text[..from].split_whitespace().all(|word| word != "duckdb");
    is_first.then(|| with_placeholders(if from == 0 { text } else { own }))
}

fn with_placeholders(text: &str) -> Vec<String> {
    let mut before = String::new();
    let replaced = |word: String| {
        let behind = BEHIND.iter().find(|(after, name, _)| *after == before && *name == word);
        let known = PLACEHOLDERS.iter().find(|(name, _)| *name == word);
        let instance = behind.map(|(_, _, one)| *one).or(known.map(|(_, one)| *one));
        before.clone_from(&word);
        instance.map_or(word, str::to_owned)
    };
    blocks::words(text).into_iter().map(replaced).collect()
}

/// Whether the program takes these words, with all values. `is_whole`: nothing may be missing.
pub(crate) fn takes(words: &[String], is_whole: bool) -> Result<(), String> {
    let Err(error) = Cli::try_parse_from(words) else { return files(words) };
    let unfinished = matches!(
        error.kind(),
        ErrorKind::MissingRequiredArgument
            | ErrorKind::MissingSubcommand
            | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    ) || (error.kind() == ErrorKind::InvalidValue
        && error.to_string().contains("none was supplied"));
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => Ok(()),
        _ if unfinished && !is_whole => Ok(()),
        _ => Err(error.to_string()),
    }
}

/// Files of the repository that are named must be there.
fn files(words: &[String]) -> Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ours =
        |word: &&String| ["templates/", "shows/", "docs/"].iter().any(|at| word.starts_with(at));
    match words.iter().filter(ours).find(|word| !root.join(word).exists()) {
        Some(word) => Err(format!("{word} is not in the repository")),
        None => Ok(()),
    }
}

/// Reads an example; an error with its place.
pub(crate) fn read(example: &Example) -> Result<(), String> {
    let Some(mut words) = own_words(&example.text) else { return Ok(()) };
    let is_whole = example.block.is_some();
    if !is_whole {
        // In a sentence, dots stand for what is not said.
        words.retain(|word| word != "...");
    }
    takes(&words, is_whole).map_err(|error| format!("{example}\n  {error}"))
}

#[test]
fn what_the_program_does_not_take_is_noticed() {
    let takes = |text: &str| takes(&own_words(text).unwrap(), true);
    assert_eq!(takes("updraft plan calibration --grid 7x7 --origin LAT,LON"), Ok(()));
    assert_eq!(takes("cargo run --release -- sweep templates/study.toml"), Ok(()));
    assert!(takes("updraft plan calibration --grids 7x7").unwrap_err().contains("--grids"));
    assert!(takes("updraft plan calibration --grid seven").unwrap_err().contains("7x7"));
    assert!(takes("updraft plan").unwrap_err().contains("TEMPLATE"));
    assert!(takes("updraft plan templates/gone.toml").unwrap_err().contains("repository"));
    assert_eq!(own_words("cargo test --workspace"), None);
    let piped = own_words("seq 40 | xargs -P 4 -I{} updraft blind --seed 1 --shard {}/40").unwrap();
    assert_eq!(piped, ["updraft", "blind", "--seed", "1", "--shard", "1/40"]);
}
