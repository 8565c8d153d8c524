//! `updraft logs`: what is on the drones, bringing it home, checking it, and cards.

mod ask;
mod cards;
mod dry;
mod listing;

pub(super) use cards::ImportOutput;
pub(super) use listing::ListOutput;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::fleet::connect::{ConnectArgs, Target};
use super::fleet::server;
use super::simulate::parse_slots;
use super::words;
use crate::base::plain::Shown as _;
use crate::fleet::logs::one::Which;
use crate::mission::Plan;
use crate::workflow::fleet::bring::{Brought, Wish};
use crate::workflow::fleet::crew::Crew;
use crate::workflow::fleet::logs::{self, has_slots};
use crate::workflow::fleet::one_flight;
use crate::workflow::fleet::output::LogOutput;
use crate::workflow::fleet::server::{list as list_through, pull as pull_through};
use crate::workflow::fleet::verify::{VerifyRow, verify_all};
use crate::workflow::slots::SlotSet;

/// How long a drone may be silent, s.
const PATIENCE_S: f64 = 60.0;

/// Arguments of `updraft logs`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft logs list my-campaign --flight hover
  updraft logs pull my-campaign --flight hover              # after Ctrl-C: the same command
  updraft logs pull my-campaign --flight hover --log all --rate 400000
  updraft logs verify my-campaign
  updraft logs import my-campaign /media/card1 /media/card2   # each log to its own flight

Logs are downloaded over MAVFTP or by log messages, whichever is faster. What has arrived is kept at
every interruption. A log gets its name once its checksum (or its size, and pieces read again)
agrees with the drone's; logs/manifest.json says how. A log that is already here is compared with
the drone's: if that is longer, the download continues; a file that was damaged since moves to
logs/older and is downloaded again. An armed drone gives no logs. Drones that are switched off are
waited for (--wait) while other logs are downloaded. Exit code 3: some logs are missing; each is
named, with the reason and what to do.")]
pub(super) struct LogsArgs {
    #[command(subcommand)]
    command: LogsCommand,
}

#[derive(Debug, Subcommand)]
enum LogsCommand {
    /// List the logs that the drones have
    List(ListArgs),
    /// Download logs
    Pull(PullArgs),
    /// Check logs against their manifest (simulated ones against their record): size, checksum, and
    /// whether they are logs
    Verify(VerifyArgs),
    /// Import logs from SD cards, each to the drone and flight it belongs to
    Import(cards::ImportArgs),
}

#[derive(Debug, Args)]
struct ListArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Which flight to use, if the campaign has several
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    #[command(flatten)]
    connect: ConnectArgs,
    /// Only these slots: 1-10,12
    #[arg(long, value_name = "SLOTS", value_parser = parse_slots)]
    slots: Option<SlotSet>,
}

#[derive(Debug, Args)]
struct PullArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Which flight to use, if the campaign has several
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    #[command(flatten)]
    connect: ConnectArgs,
    /// Which log of each drone: `flight` (that of the flight's start), newest, all, or a number
    #[arg(long, value_name = "WHICH", default_value = "flight", value_parser = which)]
    log: Which,
    /// Download logs again; those already here move to logs/flight-K
    #[arg(long)]
    again: bool,
    /// Only these slots: 1-10,12
    #[arg(long, value_name = "SLOTS", value_parser = parse_slots)]
    slots: Option<SlotSet>,
    /// Requested rate of each network, bytes per second [default: as much as it carries]
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u32).range(1..))]
    rate: Option<u32>,
    /// Most drones of a network served at once
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u16).range(1..=1000))]
    at_once: u16,
    /// Refuse larger logs, MB
    #[arg(long, value_name = "MB", default_value_t = 2048, value_parser = clap::value_parser!(u32).range(1..))]
    max_size: u32,
    /// Give up on a drone after this long without an answer, s
    #[arg(long, value_name = "S", default_value_t = PATIENCE_S, value_parser = super::fleet::connect::seconds)]
    patience: f64,
    /// Print what would be requested, but send nothing
    #[arg(long)]
    dry_run: bool,
}

#[derive(Debug, Args)]
struct VerifyArgs {
    /// Campaign folder
    campaign: PathBuf,
}

fn which(text: &str) -> Result<Which, String> {
    match text {
        "flight" => Ok(Which::Flight),
        "newest" => Ok(Which::Newest),
        "all" => Ok(Which::All),
        number => {
            number.parse().map(Which::Number).map_err(|_| "flight, newest, all, or a number".into())
        }
    }
}

pub(super) fn run(context: &Context, args: &LogsArgs) -> Result<Exit, CommandError> {
    match &args.command {
        LogsCommand::List(args) => list(context, args),
        LogsCommand::Pull(args) => pull(context, args),
        LogsCommand::Verify(args) => check(context, args),
        LogsCommand::Import(args) => cards::run(context, args),
    }
}

fn list(context: &Context, args: &ListArgs) -> Result<Exit, CommandError> {
    let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
    has_slots(&plan, args.slots.as_ref())?;
    let links = match args.connect.target()? {
        Target::Links(links) => links,
        Target::Server(address) => {
            server::refuse(&args.connect, &[])?;
            let (slots, wait_s) = (args.slots.as_ref(), args.connect.wait);
            return listing::show(context, list_through(context, &address, &plan, slots, wait_s)?);
        }
        Target::Sim => return Err(gone()),
    };
    let mut station = args.connect.open(context, links)?;
    let mut crew = Crew::new(context, &mut station, &folder, &plan);
    let (slots, wait_s) = (args.slots.as_ref(), args.connect.wait);
    listing::show(context, logs::list(context, &mut crew, slots, wait_s)?)
}

fn gone() -> CommandError {
    CommandError::Usage(
        "virtual drones end with their program: `updraft fly --connect sim` saves their logs itself"
            .to_owned(),
    )
}

#[derive(Serialize, JsonSchema)]
pub(super) struct PullOutput {
    /// Format name and version: `updraft.pull/1`.
    schema: &'static str,
    /// The logs, in slot order.
    logs: PulledLogs,
}

/// Logs over the drones' own links, or through Skybrush Server.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum PulledLogs {
    OverLinks(Vec<Brought>),
    ThroughServer(Vec<LogOutput>),
}

/// The command that brings these slots' logs, over the same links and with the same options.
fn once_more(args: &PullArgs, flight: &str, slots: &[u16]) -> String {
    let campaign = args.campaign.shown().to_string();
    let mut words = vec!["updraft logs pull".to_owned(), words::shell(&campaign)];
    let mut add =
        |option: &str, value: &str| words.push(format!("{option} {}", words::shell(value)));
    add("--flight", flight);
    for link in &args.connect.connect {
        add("--connect", link);
    }
    if let Some(key) = &args.connect.key {
        add("--key", &key.shown().to_string());
    }
    match args.log {
        Which::Flight => {}
        Which::Newest => add("--log", "newest"),
        Which::All => add("--log", "all"),
        Which::Number(number) => add("--log", &number.to_string()),
    }
    if let Some(rate) = args.rate {
        add("--rate", &rate.to_string());
    }
    let slots: Vec<String> = slots.iter().map(u16::to_string).collect();
    add("--slots", &slots.join(","));
    words.join(" ")
}

fn pull(context: &Context, args: &PullArgs) -> Result<Exit, CommandError> {
    let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
    has_slots(&plan, args.slots.as_ref())?;
    let target = args.connect.target()?;
    if args.dry_run {
        let lines = dry::lines(&folder, &plan, args);
        return super::fleet::dry::print(context, lines);
    }
    let _lock = context.lock(&args.campaign)?;
    let wish = Wish {
        which: args.log,
        again: args.again,
        most_bytes: u64::from(args.max_size) * 1_000_000,
        rate: args.rate.map(f64::from),
        at_once: args.at_once.into(),
        patience_s: args.patience,
        wait_s: args.connect.wait,
        ..Wish::default()
    };
    let links = match target {
        Target::Links(links) => links,
        Target::Server(address) => {
            let rate = "it queries the drones at its own pace; --at-once limits how many drones \
                        at a time";
            let patience = "it gives up on a drone by itself, after 90 s without progress";
            server::refuse(
                &args.connect,
                &[
                    ("--rate", args.rate.is_some(), rate),
                    ("--patience", (args.patience - PATIENCE_S).abs() > 0.0, patience),
                ],
            )?;
            let (slots, wait_s) = (args.slots.as_ref(), args.connect.wait);
            let rows = pull_through(context, &address, &folder, &plan, slots, &wish, wait_s)?;
            let lost = rows.iter().filter(|row| row.is_missing()).map(|row| row.slot);
            let lost: Vec<u16> = lost.collect();
            return end_pull(context, args, &plan, PulledLogs::ThroughServer(rows), &lost);
        }
        Target::Sim => return Err(gone()),
    };
    let mut station = args.connect.open(context, links)?;
    let mut crew = Crew::new(context, &mut station, &folder, &plan);
    let (slots, wait_s) = (args.slots.as_ref(), args.connect.wait);
    let brought = logs::pull(context, &mut crew, slots, wait_s, &wish)?;
    let lost: Vec<u16> =
        brought.iter().filter(|one| one.is_missing()).map(|one| one.slot).collect();
    end_pull(context, args, &plan, PulledLogs::OverLinks(brought), &lost)
}

/// What to do about lost logs, and all of it for programs.
fn end_pull(
    context: &Context,
    args: &PullArgs,
    plan: &Plan,
    logs: PulledLogs,
    lost: &[u16],
) -> Result<Exit, CommandError> {
    if !lost.is_empty() {
        context.insist(&format!("To try again: {}", once_more(args, &plan.name, lost)));
    }
    if context.json {
        context.print_json(&PullOutput { schema: "updraft.pull/1", logs })?;
    }
    Ok(if lost.is_empty() { Exit::Done } else { Exit::Losses })
}

#[derive(Serialize, JsonSchema)]
pub(super) struct VerifyOutput {
    schema: &'static str,
    logs: Vec<VerifyRow>,
}

fn check(context: &Context, args: &VerifyArgs) -> Result<Exit, CommandError> {
    let rows = verify_all(&args.campaign)?;
    if rows.is_empty() {
        return Err(CommandError::Nothing(
            "there are no logs yet: no manifest of downloaded logs (`updraft logs pull` or \
             `import`), and no record of simulated ones (`updraft simulate`)"
                .to_owned(),
        ));
    }
    let bad = rows.iter().filter(|row| !row.faults.is_empty()).count();
    for row in rows.iter().filter(|row| !row.faults.is_empty()) {
        context.warn(&format!("{}/{} {}", row.flight, row.file, row.faults.join("; ")));
    }
    context.say(&format!(
        "{} of {} are unchanged",
        rows.len() - bad,
        words::count(rows.len(), "log")
    ));
    if context.json {
        context.print_json(&VerifyOutput { schema: "updraft.verify/1", logs: rows })?;
    }
    Ok(if bad == 0 { Exit::Done } else { Exit::Losses })
}
