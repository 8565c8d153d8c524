//! `updraft inspect`: what is in a file.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::show_text::{describe_show, describe_skyb};
use super::timetable;
use super::words::{shorten, wrap};
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::campaign::{self, FlightFolder};
use crate::log::{Inventory, Log, ScanStats};
use crate::mission::Plan;
use crate::show::derive::DeriveParams;
use crate::show::skyb;
use crate::show::summary::{ShowSummary, SkybSummary, summarise, summarise_skyb};
use crate::workflow::shows::load::{LoadError, MAX_SKYB_BYTES, has_extension, read_show};

/// Arguments of `updraft inspect`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft inspect my-campaign/calibration/show.skyc
  updraft inspect my-campaign/calibration/skyb/01.skyb
  updraft inspect my-campaign/calibration/logs/01.BIN
  updraft inspect --json flight.BIN")]
pub(super) struct InspectArgs {
    /// .skyc, .skyb, zipped CSV, .BIN, plan.json or a campaign folder
    file: PathBuf,
}

/// What `--json` prints.
#[derive(Serialize, JsonSchema)]
pub(super) struct InspectDocument<'a> {
    schema: &'static str,
    #[serde(flatten)]
    found: &'a InspectOutput,
}

#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum InspectOutput {
    Log(Box<Inventory>),
    Show(Box<ShowSummary>),
    Skyb(Box<SkybSummary>),
    Plans(Vec<Plan>),
}

pub(super) fn run(context: &Context, args: &InspectArgs) -> Result<Exit, CommandError> {
    let path = &args.file;
    let found = if path.is_dir() {
        let plans = campaign::flights(path)?
            .iter()
            .map(FlightFolder::read_plan)
            .collect::<Result<_, _>>()?;
        InspectOutput::Plans(plans)
    } else if has_extension(path, "json") {
        InspectOutput::Plans(vec![campaign::read_plan(path)?])
    } else if has_extension(path, "skyb") {
        let bytes = read_whole(path, MAX_SKYB_BYTES)?;
        let contents =
            skyb::read(&bytes).map_err(|source| LoadError::Skyb { path: path.clone(), source })?;
        InspectOutput::Skyb(Box::new(summarise_skyb(&contents, &DeriveParams::default())))
    } else if ["skyc", "zip"].iter().any(|wanted| has_extension(path, wanted)) {
        InspectOutput::Show(Box::new(summarise(&read_show(path)?, &DeriveParams::default())))
    } else {
        InspectOutput::Log(Box::new(Log::open(path)?.inventory()))
    };
    if context.json {
        context.print_json(&InspectDocument { schema: "updraft.inspect/1", found: &found })?;
    } else {
        let text = match &found {
            InspectOutput::Log(inventory) => describe_log(path, inventory, context.width),
            InspectOutput::Show(show) => {
                format!("{}: {}", path.shown(), describe_show(show, context.width))
            }
            InspectOutput::Skyb(file) => format!("{}: {}", path.shown(), describe_skyb(file)),
            InspectOutput::Plans(plans) => plans
                .iter()
                .map(|plan| timetable::describe(plan, context.width, false))
                .collect::<Vec<_>>()
                .join("\n"),
        };
        context.emit(&wrap(&text, context.width))?;
    }
    Ok(Exit::Done)
}

fn describe_log(path: &Path, log: &Inventory, width: Option<usize>) -> String {
    let fields_width = width.map_or(60, |width| width.saturating_sub(37).clamp(12, 60));
    let mut text = format!("{}: {:.2} MB", path.shown(), log.size_bytes as f64 / 1e6);
    if let Some(duration_s) = log.duration_s {
        let _ = write!(text, ", {duration_s:.1} s");
    }
    if let Some(firmware) = &log.firmware {
        let _ = write!(text, ", {firmware}");
    }
    if log.boots > 1 {
        let _ = write!(text, ", {} logs in one file", log.boots);
    }
    let _ = writeln!(text, "\n\n{:<6} {:>9} {:>9} {:>8}  fields", "type", "count", "kB", "Hz");
    for message in &log.messages {
        let rate = message.rate_hz().map_or(String::new(), |rate| format!("{rate:.1}"));
        let fields: Vec<_> = message.fields.iter().map(|field| field.label.as_str()).collect();
        let _ = writeln!(
            text,
            "{:<6} {:>9} {:>9.1} {:>8}  {}",
            message.name,
            message.count,
            message.bytes as f64 / 1e3,
            rate,
            shorten(&fields.join(","), fields_width)
        );
    }
    text.push('\n');
    describe_damage(&mut text, log.stats);
    text
}

fn describe_damage(text: &mut String, stats: ScanStats) {
    if stats == ScanStats::default() {
        text.push_str("no damage found\n");
        return;
    }
    let found = [
        (stats.bad_bytes, "bytes where no message starts"),
        (stats.unknown, "messages of unknown type"),
        (stats.rejected_formats, "definitions that contradict themselves"),
        (stats.truncated_bytes, "bytes of an unfinished last message"),
        (stats.time_jumps, "jumps of time"),
    ];
    for (count, what) in found {
        if count > 0 {
            let _ = writeln!(text, "damage: {count} {what}");
        }
    }
}
