//! `updraft logs import`: each log on the cards goes to the flight and slot that it is of.

use std::collections::BTreeSet;
use std::io::IsTerminal as _;
use std::path::PathBuf;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::ask;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::words;
use crate::fleet::logs::import::{Carried, StartFrom, Take};
use crate::workflow::fleet::cards::{Import, Imported, import};
use crate::workflow::times::utc;

#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft logs import my-campaign /media/card1 /media/card2
  updraft logs import my-campaign --flight hover cards/
  updraft logs import my-campaign --flight hover cards/ --start 1795143537

A card may hold the logs of a day or of a month. A log is imported if it belongs to the start of a
flight: the start recorded when it was authorized (logs/start.json), else --start, else the start at
which most drones flew the plan. Its drone follows from its system id and from where it stood,
whatever its folder or file name. The command prints what it imports, what it leaves behind, and
why. If two logs fit equally well, or a log contradicts itself, you are asked on a terminal;
otherwise they are left behind, with exit code 3. A truncated or damaged log is imported, also with
exit code 3. Logs of another start that are already here move to logs/flight-K/, logs replaced by
--again to logs/older/; nothing is overwritten. A missing card is exit code 1.")]
pub(super) struct ImportArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Folders of cards, or files
    #[arg(required = true)]
    cards: Vec<PathBuf>,
    /// Only this flight's logs [default: each log goes to its own flight]
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// When the show started, as Unix time in seconds
    #[arg(long, value_name = "UNIX_S", allow_negative_numbers = true)]
    start: Option<i64>,
    /// Replace logs of the same start that are already here
    #[arg(long)]
    again: bool,
}

#[derive(Serialize, JsonSchema)]
pub(in crate::cli) struct ImportOutput {
    schema: &'static str,
    flights: Vec<FlightRow>,
    /// File names, with their flight's folder in a campaign of several flights.
    taken: Vec<String>,
    there: Vec<String>,
    left: Vec<String>,
    doubts: Vec<String>,
    missing_slots: Vec<u16>,
}

#[derive(Serialize, JsonSchema)]
struct FlightRow {
    flight: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    start: Option<GpsTime>,
    logs: Vec<LogRow>,
    missing_slots: Vec<u16>,
}

#[derive(Serialize, JsonSchema)]
struct LogRow {
    card: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    drone: Option<u8>,
    slot: u16,
    file: String,
    /// `taken` or `there`.
    state: &'static str,
}

pub(super) fn run(context: &Context, args: &ImportArgs) -> Result<Exit, CommandError> {
    let wish = Import {
        campaign: args.campaign.clone(),
        cards: args.cards.clone(),
        flight: args.flight.clone(),
        start_unix_s: args.start,
        again: args.again,
    };
    let may_ask = std::io::stdin().is_terminal() && context.interactive && !context.json;
    let choose = |question: &str, choices: &[String]| ask::which(context, question, choices);
    let imported = import(context, &wish, may_ask.then_some(&choose))?;
    Report { context, imported: &imported }.print()
}

fn is_taken(outcome: &Carried) -> bool {
    matches!(outcome, Carried::Taken(..))
}

fn is_there(outcome: &Carried) -> bool {
    matches!(outcome, Carried::There(_))
}

struct Report<'a> {
    context: &'a Context,
    imported: &'a Imported,
}

impl Report<'_> {
    /// Says what was done, with what was left and why.
    fn print(&self) -> Result<Exit, CommandError> {
        let Self { context, imported } = self;
        for (flight, start) in imported.flights.iter().zip(&imported.decision.starts) {
            if let (true, Some((start, from))) = (flight.is_wanted, start) {
                context.say(&match from {
                    StartFrom::Known => format!("{} began {}", flight.name, utc(*start)),
                    StartFrom::Agreed(count) => format!(
                        "{} began {}, by the logs of {}",
                        flight.name,
                        utc(*start),
                        words::count(*count, "drone")
                    ),
                });
            }
        }
        for (take, outcome) in &imported.outcomes {
            self.say_outcome(take, outcome)?;
        }
        let left = imported.left();
        for (path, why) in &left {
            context.say(&format!("left {}: {why}", path.shown()));
        }
        for card in &imported.found.empty {
            context.warn(&format!("{} holds no log (.BIN)", card.shown()));
        }
        let doubts = imported.doubts();
        for doubt in &doubts {
            context.warn(doubt);
        }
        let lost = self.say_missing();
        let count = |is: fn(&Carried) -> bool| {
            imported.outcomes.iter().filter(|(_, outcome)| is(outcome)).count()
        };
        let there = count(is_there);
        context.say(&format!(
            "Imported {} from cards{}",
            words::count(count(is_taken), "log"),
            if there == 0 { String::new() } else { format!(" ({there} already here)") }
        ));
        let whole = !lost && !imported.in_part() && doubts.is_empty();
        if context.json {
            context.print_json(&self.output(&left, doubts))?;
        }
        Ok(if whole { Exit::Done } else { Exit::Losses })
    }

    fn say_outcome(&self, take: &Take, outcome: &Carried) -> Result<(), CommandError> {
        match outcome {
            Carried::Taken(entry, moved) => {
                self.say_taken(take, &entry.file, "")?;
                self.say_incomplete(&entry.file, entry.incomplete.as_deref());
                if let Some(moved) = moved {
                    self.context.say(&format!(
                        "{} belonged to another start, and is {} now",
                        entry.file,
                        moved.shown()
                    ));
                }
            }
            Carried::There(incomplete) => {
                let file = self.imported.flights[take.flight].files.get(&take.slot);
                let file = file.map_or("", String::as_str);
                self.say_taken(take, file, ", already here")?;
                self.say_incomplete(file, incomplete.as_deref());
            }
            Carried::Left(_) => {}
        }
        Ok(())
    }

    /// Warns of a log that may not hold all of its flight.
    fn say_incomplete(&self, file: &str, why: Option<&str>) {
        if let Some(why) = why {
            self.context.warn(&format!("{file} may not be complete: {why}"));
        }
    }

    /// `cards/3/00000012.BIN -> drone 3 -> slot 3 -> hover (03.BIN)`.
    fn say_taken(&self, take: &Take, file: &str, note: &str) -> Result<(), CommandError> {
        let Some(log) = self.imported.found.logs.get(take.log) else { return Ok(()) };
        let drone = log.identity.system_id.map_or("?".to_owned(), |system| system.to_string());
        let line = format!(
            "{} -> drone {drone} -> slot {} -> {} ({file}{note})\n",
            log.path.shown(),
            take.slot,
            self.imported.flights[take.flight].name
        );
        if self.context.json { Ok(()) } else { self.context.print(&line) }
    }

    /// Names the slots without a log; whether that is a loss.
    fn say_missing(&self) -> bool {
        let Imported { flights, missing, .. } = self.imported;
        let mut lost = false;
        for (index, (flight, slots)) in flights.iter().zip(missing).enumerate() {
            if slots.is_empty() {
                continue;
            }
            if !self.imported.is_loss(index) {
                self.context.say(&format!("no log of {} is on the cards", flight.name));
                continue;
            }
            lost = true;
            let slots: Vec<String> = slots.iter().map(u16::to_string).collect();
            let noun = if slots.len() == 1 { "slot" } else { "slots" };
            self.context.warn(&format!("no log of {noun} {} of {}", slots.join(", "), flight.name));
        }
        lost
    }

    fn output(&self, left: &[(PathBuf, String)], doubts: Vec<String>) -> ImportOutput {
        let Imported { found, flights, decision, outcomes, missing } = self.imported;
        let several = flights.len() > 1;
        let shown = |take: &Take| {
            let flight = &flights[take.flight];
            let file = flight.files.get(&take.slot).cloned().unwrap_or_default();
            if several { format!("{}/{file}", flight.name) } else { file }
        };
        let named = |is: &dyn Fn(&Carried) -> bool| {
            outcomes
                .iter()
                .filter(|(_, outcome)| is(outcome))
                .map(|(take, _)| shown(take))
                .collect()
        };
        let row = |(take, outcome): &(Take, Carried)| {
            let log = found.logs.get(take.log)?;
            Some(LogRow {
                card: log.path.clone(),
                drone: log.identity.system_id,
                slot: take.slot,
                file: flights[take.flight].files.get(&take.slot)?.clone(),
                state: match outcome {
                    Carried::Taken(..) => "taken",
                    Carried::There(_) => "there",
                    Carried::Left(_) => return None,
                },
            })
        };
        let wanted = flights.iter().enumerate().filter(|(_, flight)| flight.is_wanted);
        let rows = wanted.map(|(index, flight)| FlightRow {
            flight: flight.name.clone(),
            start: decision.starts.get(index).copied().flatten().map(|(start, _)| start),
            logs: outcomes
                .iter()
                .filter(|(take, _)| take.flight == index)
                .filter_map(row)
                .collect(),
            missing_slots: missing.get(index).into_iter().flatten().copied().collect(),
        });
        let all: BTreeSet<u16> = missing.iter().flatten().copied().collect();
        ImportOutput {
            schema: "updraft.import/1",
            flights: rows.collect(),
            taken: named(&is_taken),
            there: named(&is_there),
            left: left.iter().map(|(path, why)| format!("{}: {why}", path.shown())).collect(),
            doubts,
            missing_slots: all.into_iter().collect(),
        }
    }
}
