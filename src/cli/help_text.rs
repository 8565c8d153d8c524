//! Help in which examples and tables keep their lines, and prose fills the terminal.

use clap::{Command, CommandFactory as _, FromArgMatches as _};

use super::Cli;

/// A space that clap breaks no line at; it is printed as a space.
const GLUE: char = '\u{a0}';

/// The program's command, with long helps whose indented lines are never broken.
pub(super) fn command() -> Command {
    prepared(Cli::command())
}

fn prepared(command: Command) -> Command {
    let text = command.get_after_long_help().map(ToString::to_string);
    let command = match text {
        Some(text) => command.after_long_help(glued(&text)),
        None => command,
    };
    command.mut_subcommands(prepared)
}

/// The text of a help as it is printed.
pub(super) fn printed(help: &str) -> String {
    help.replace(GLUE, " ")
}

/// Indented lines in one piece, and the lines of a paragraph as one, which clap breaks where the terminal
/// ends.
fn glued(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for paragraph in lines_of(text) {
        if !out.is_empty() {
            out.push('\n');
        }
        match paragraph {
            Line::Whole(line) => out.extend(line.chars().map(|c| if c == ' ' { GLUE } else { c })),
            Line::Prose(prose) => out.push_str(&prose),
        }
    }
    out
}

/// A line of a long help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Line<'a> {
    /// Indented, an example or a row of a table, or empty: it stays as it is.
    Whole(&'a str),
    /// A paragraph, without line breaks.
    Prose(String),
}

/// Lines of a long help, with paragraphs in one piece. What follows a colon at the end of a line begins a line.
pub(super) fn lines_of(text: &str) -> Vec<Line<'_>> {
    let mut lines: Vec<Line<'_>> = Vec::new();
    for line in text.lines() {
        if line.is_empty() || line.starts_with(' ') {
            lines.push(Line::Whole(line));
            continue;
        }
        match lines.last_mut() {
            Some(Line::Prose(before)) if !before.ends_with(':') => {
                before.push(' ');
                before.push_str(line);
            }
            _ => lines.push(Line::Prose(line.to_owned())),
        }
    }
    lines
}

/// Reads a command line; with it the words of its command: `fleet restore`.
///
/// # Errors
///
/// As clap's: also where help or the version is asked for.
pub(super) fn parse<I, T>(words: I) -> Result<(Cli, String), clap::Error>
where
    I: IntoIterator<Item = T>,
    T: Into<std::ffi::OsString> + Clone,
{
    let matches = command().try_get_matches_from(words)?;
    let mut names = Vec::new();
    let mut inner = &matches;
    while let Some((name, deeper)) = inner.subcommand() {
        names.push(name.to_owned());
        inner = deeper;
    }
    Ok((Cli::from_arg_matches(&matches)?, names.join(" ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_keep_their_lines_and_prose_fills_the_width() {
        let text = "Examples:\n  updraft plan calibration --grid 7x7 -o my-campaign\n\nProse that was\nbroken.\nA list:\nof this";
        assert_eq!(
            lines_of(text),
            [
                Line::Prose("Examples:".to_owned()),
                Line::Whole("  updraft plan calibration --grid 7x7 -o my-campaign"),
                Line::Whole(""),
                Line::Prose("Prose that was broken. A list:".to_owned()),
                Line::Prose("of this".to_owned()),
            ]
        );
        let whole = printed(&glued(text));
        assert!(whole.contains("\n  updraft plan calibration --grid 7x7 -o my-campaign\n\nProse"));
    }

    #[test]
    fn no_terminal_is_too_narrow_for_an_example() {
        let mut command = command().term_width(40);
        let plan = command.find_subcommand_mut("plan").unwrap();
        let help = printed(&plan.render_long_help().to_string());
        let longest = "  updraft plan templates/calibration.toml --grid 7x7 --spacing 7 --origin 47.4733,19.0621 -o my-campaign\n";
        assert!(help.contains(longest), "{help}");
    }
}
