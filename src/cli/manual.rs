//! `updraft man`: a manual page for every command.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::help_text::{Line, lines_of};
use super::words;
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;

/// Arguments of `updraft man`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft man | man -l -
  updraft man fleet upload | man -l -
  updraft man --dir ~/.local/share/man/man1       (then: man updraft-fleet-upload)")]
pub(super) struct ManArgs {
    /// Command whose page is printed, for example `fleet upload` [default: updraft itself]
    command: Vec<String>,
    /// Write the pages of all commands into this folder: updraft.1, updraft-run.1, ...
    #[arg(long, value_name = "FOLDER", conflicts_with = "command")]
    dir: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct ManOutput {
    /// Format name and version: `updraft.man/1`.
    schema: &'static str,
    /// The page that was asked for, or those that were written.
    pages: Vec<PageOutput>,
}

/// A manual page.
#[derive(Serialize, JsonSchema)]
struct PageOutput {
    /// Name of the page: `updraft-fleet-upload`.
    name: String,
    /// Text of the page, in roff; absent: it was written into a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    roff: Option<String>,
    /// File that it was written into.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<PathBuf>,
}

pub(super) fn run(
    context: &Context,
    args: &ManArgs,
    command: Command,
) -> Result<Exit, CommandError> {
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let pages = if let Some(folder) = &args.dir {
        std::fs::create_dir_all(folder).map_err(|error| {
            CommandError::Failed(format!("failed to make {}: {error}", folder.shown()))
        })?;
        let mut pages = Vec::new();
        for (name, roff) in all(&command)? {
            let file = folder.join(format!("{name}.1"));
            write_whole(&file, roff.as_bytes())?;
            pages.push(PageOutput { name, roff: None, file: Some(file) });
        }
        context.say(&format!(
            "Wrote {} into {}",
            words::count(pages.len(), "page"),
            folder.shown()
        ));
        pages
    } else {
        let (name, roff) = page(named(&command, &args.command)?)?;
        if !context.json {
            context.emit(&roff)?;
        }
        vec![PageOutput { name, roff: Some(roff), file: None }]
    };
    if context.json {
        context.print_json(&ManOutput { schema: "updraft.man/1", pages })?;
    }
    Ok(Exit::Done)
}

/// The command that these words name.
fn named<'a>(command: &'a Command, words: &[String]) -> Result<&'a Command, CommandError> {
    words.iter().try_fold(command, |command, word| {
        command.find_subcommand(word).ok_or_else(|| {
            let known = command.get_subcommands().filter(|one| !one.is_hide_set());
            let known: Vec<&str> = known.map(Command::get_name).collect();
            let name = display_name(command);
            CommandError::Usage(if known.is_empty() {
                format!("`{name}` has no command {word}: its own page is all there is")
            } else {
                format!("`{name}` has no command {word}; there are {}", known.join(", "))
            })
        })
    })
}

fn display_name(command: &Command) -> &str {
    command.get_display_name().unwrap_or_else(|| command.get_name())
}

/// Name and text of the pages of a command and all below it.
fn all(command: &Command) -> Result<Vec<(String, String)>, CommandError> {
    let mut pages = vec![page(command)?];
    for inner in command.get_subcommands().filter(|one| !one.is_hide_set()) {
        pages.extend(all(inner)?);
    }
    Ok(pages)
}

/// Name and text of a command's page.
fn page(command: &Command) -> Result<(String, String), CommandError> {
    let failed =
        |error: std::io::Error| CommandError::Failed(format!("failed to make the page: {error}"));
    let name = display_name(command).to_owned();
    let man = Man::new(command.clone().disable_help_subcommand(true))
        .source(concat!("updraft ", env!("CARGO_PKG_VERSION")))
        .manual("updraft");
    let mut text = Vec::new();
    man.render_title(&mut text).map_err(failed)?;
    man.render_name_section(&mut text).map_err(failed)?;
    man.render_synopsis_section(&mut text).map_err(failed)?;
    man.render_description_section(&mut text).map_err(failed)?;
    man.render_options_section(&mut text).map_err(failed)?;
    if command.get_subcommands().any(|one| !one.is_hide_set()) {
        man.render_subcommands_section(&mut text).map_err(failed)?;
    }
    if let Some(more) = command.get_after_long_help() {
        more_of(&more.to_string()).to_writer(&mut text).map_err(failed)?;
    }
    if name.contains('-') {
        let mut roff = Roff::new();
        roff.control("SH", ["SEE ALSO"]);
        let above = name.rsplit_once('-').map_or("updraft", |(above, _)| above);
        roff.text([roman(format!("{above}(1)"))]);
        roff.to_writer(&mut text).map_err(failed)?;
    }
    Ok((name, String::from_utf8_lossy(&text).into_owned()))
}

/// Examples, with each line as it is, and what else the long help has below the options.
fn more_of(text: &str) -> Roff {
    let mut roff = Roff::new();
    let mut is_table = false;
    let lines = lines_of(text);
    let begins = matches!(lines.first(), Some(Line::Prose(first)) if first == "Examples:");
    roff.control("SH", [if begins { "EXAMPLES" } else { "NOTES" }]);
    let mut has_notes = !begins;
    for line in lines.iter().skip(usize::from(begins)) {
        let is_row = matches!(line, Line::Whole(row) if !row.is_empty());
        if is_table && !is_row {
            roff.control("fi", []);
        }
        match line {
            Line::Whole("") => {}
            Line::Whole(row) => {
                if !is_table {
                    roff.control("nf", []);
                }
                roff.text([roman(*row)]);
            }
            Line::Prose(prose) => {
                if has_notes {
                    roff.control("PP", []);
                } else {
                    roff.control("SH", ["NOTES"]);
                    has_notes = true;
                }
                roff.text([roman(prose.as_str())]);
            }
        }
        is_table = is_row;
    }
    if is_table {
        roff.control("fi", []);
    }
    roff
}
