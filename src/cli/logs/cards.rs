//! `updraft logs import`: each log on the cards goes to the flight and slot that it is of.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::sync::OnceLock;

use clap::Args;
use serde::Serialize;

use super::ask;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::start::StartRecord;
use crate::campaign::{self, FlightFolder};
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::words;
use crate::fleet::logs::import::{
    Answers, Carried, CarriedOut, Carry, Decision, Doubt, ImportFlight, StartFrom, Survey, Take,
    carry_out, decide, survey,
};
use crate::fleet::slots::FleetTable;
use crate::flight::identity::{SAME_START_S, later_s};
use crate::link::clock::Clock as _;
use crate::mission::Plan;
use crate::workflow::clock::SystemClock;
use crate::workflow::host::{Host as _, Progress};
use crate::workflow::made_by;

#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft logs import my-campaign /media/card1 /media/card2
  updraft logs import my-campaign --flight hover cards/
  updraft logs import my-campaign --flight hover cards/ --start 1795143537

A card holds the logs of a day, or of a month. A log is taken if it is of the start of a flight: the one
that was written down when it was authorized (logs/start.json), else --start, else the one at which most
drones flew the plan. Its drone is that of its system id and of the place where it stood, whatever folder
or file it lies in. What is taken, and what is left and why, is printed. Where two logs fit equally, or a
log contradicts itself, it asks on a terminal, else leaves them: exit code 3. So does a log that is cut or damaged, which is taken. Logs of another start that
are home go to logs/flight-K/, those that --again replaces to logs/older/; nothing is overwritten.
A card that is not there is exit code 1.")]
pub(super) struct ImportArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Folders of cards, or files
    #[arg(required = true)]
    cards: Vec<PathBuf>,
    /// Only this flight's logs [default: of a campaign of several flights, each log's own]
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// When the show started, Unix time in seconds
    #[arg(long, value_name = "UNIX_S", allow_negative_numbers = true)]
    start: Option<i64>,
    /// Take the place of logs of the same start that are home
    #[arg(long)]
    again: bool,
}

#[derive(Serialize)]
struct ImportOutput {
    schema: &'static str,
    flights: Vec<FlightRow>,
    /// File names, with their flight's folder in a campaign of several flights.
    taken: Vec<String>,
    there: Vec<String>,
    left: Vec<String>,
    doubts: Vec<String>,
    missing_slots: Vec<u16>,
}

#[derive(Serialize)]
struct FlightRow {
    flight: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    start: Option<GpsTime>,
    logs: Vec<LogRow>,
    missing_slots: Vec<u16>,
}

#[derive(Serialize)]
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
    let flights = flights(args)?;
    let _lock = context.lock(&args.campaign)?;
    let progress: OnceLock<Box<dyn Progress + '_>> = OnceLock::new();
    let found = survey(&args.cards, &flights, &|total| {
        progress.get_or_init(|| context.progress("reading", total as u64)).advance();
    })?;
    if let Some(progress) = progress.get() {
        progress.finish();
    }
    context.check_stop()?;
    let decision = decided(context, &found, &flights)?;
    let how = Carry {
        again: args.again,
        made_by: made_by(),
        unix_s: SystemClock::start().unix_us() / 1_000_000,
    };
    let CarriedOut { outcomes, missing } = carry_out(&decision, &found, &flights, &how)?;
    Report { context, found: &found, flights: &flights, decision: &decision }
        .print(&outcomes, &missing)
}

/// The flights of the campaign; those that are not imported are known, to recognize their logs.
fn flights(args: &ImportArgs) -> Result<Vec<ImportFlight>, CommandError> {
    let mut flights = Vec::new();
    let mut unusable = None;
    for folder in campaign::flights(&args.campaign)? {
        let plan = match folder.read_plan() {
            Ok(plan) => plan,
            // One that is not asked for may be broken.
            Err(error) if args.flight.is_some() => {
                unusable = Some(error);
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        let record = StartRecord::read(&folder)?;
        flights.push(ImportFlight {
            name: plan.name.clone(),
            logs: folder.logs(),
            slots: system_ids(&folder)?,
            files: log_names(&folder, &plan),
            start: record.as_ref().map(|record| record.start),
            record,
            is_wanted: args.flight.as_ref().is_none_or(|name| *name == plan.name),
            plan,
        });
    }
    let wanted = flights.iter().filter(|flight| flight.is_wanted).count();
    if wanted == 0 {
        if let Some(error) = unusable {
            return Err(error.into());
        }
        let names: Vec<&str> = flights.iter().map(|flight| flight.name.as_str()).collect();
        let name = args.flight.as_deref().unwrap_or_default();
        return Err(CommandError::Usage(format!(
            "the campaign has no flight \"{name}\", but {}",
            names.join(", ")
        )));
    }
    if let Some(unix_s) = args.start {
        let start = unix_s.checked_mul(1000).and_then(GpsTime::from_unix_ms);
        let start = start
            .ok_or_else(|| CommandError::Usage(format!("--start {unix_s} is not a GPS time")))?;
        if wanted > 1 {
            let reason = "--start is of one flight: say which with --flight";
            return Err(CommandError::Usage(reason.to_owned()));
        }
        for flight in flights.iter_mut().filter(|flight| flight.is_wanted) {
            let known = flight.start.filter(|known| later_s(start, *known).abs() > SAME_START_S);
            if let Some(known) = known {
                return Err(CommandError::Usage(format!(
                    "--start is {}, but {} says that {} began {}: the logs of another start have no \
                     place beside it (leave --start out, or move the file away if it is not true)",
                    utc(start),
                    flight.logs.join("start.json").shown(),
                    flight.name,
                    utc(known)
                )));
            }
            flight.start = flight.start.or(Some(start));
        }
    }
    Ok(flights)
}

/// Decides, with a person's help where there is one.
fn decided(
    context: &Context,
    found: &Survey,
    flights: &[ImportFlight],
) -> Result<Decision, CommandError> {
    let mut answers = Answers::default();
    let mut decision = decide(found, flights, &answers);
    let may_ask = std::io::stdin().is_terminal() && context.interactive && !context.json;
    let mut asked = BTreeSet::new();
    if !may_ask {
        return Ok(decision);
    }
    loop {
        let key = |doubt: &Doubt| match doubt {
            Doubt::Start { flight, .. } => Some((*flight, 0)),
            Doubt::Log { flight, slot, .. } => Some((*flight, *slot)),
            Doubt::Slot { .. } | Doubt::Flight { .. } => None,
        };
        let open = decision.doubts.iter().find_map(|doubt| {
            let key = key(doubt).filter(|key| !asked.contains(key))?;
            Some((key, doubt.clone()))
        });
        let Some((key, doubt)) = open else { return Ok(decision) };
        asked.insert(key);
        match &doubt {
            Doubt::Start { flight, starts } => {
                let question = format!("When did {} begin?", flights[*flight].name);
                let choices = starts.iter().map(|(start, count)| {
                    format!("{} ({})", utc(*start), words::count(*count, "log"))
                });
                if let Some(choice) = ask::which(context, &question, &choices.collect::<Vec<_>>())?
                {
                    answers.starts.insert(*flight, starts[choice].0);
                }
            }
            Doubt::Log { flight, slot, logs, why } => {
                let name = &flights[*flight].name;
                let question = format!("Which log is of slot {slot} of {name}? ({why})");
                let choices = logs.iter().map(|log| about(found, *log));
                let choice = ask::which(context, &question, &choices.collect::<Vec<_>>())?;
                answers.logs.insert((*flight, *slot), choice.map(|choice| logs[choice]));
            }
            Doubt::Slot { .. } | Doubt::Flight { .. } => {}
        }
        decision = decide(found, flights, &answers);
    }
}

/// A log, as people tell logs apart.
fn about(found: &Survey, log: usize) -> String {
    let Some(log) = found.logs.get(log) else { return String::new() };
    let mut text = log.path.shown().to_string();
    if let Some(system) = log.identity.system_id {
        let _ = write!(text, ", drone {system}");
    }
    if let Some((first, _)) = log.identity.span() {
        let _ = write!(text, ", from {}", utc(first));
    }
    text
}

fn is_there(outcome: &Carried) -> bool {
    matches!(outcome, Carried::There(_))
}

struct Report<'a> {
    context: &'a Context,
    found: &'a Survey,
    flights: &'a [ImportFlight],
    decision: &'a Decision,
}

impl Report<'_> {
    /// Says what was done, with what was left and why.
    fn print(
        &self,
        outcomes: &[(Take, Carried)],
        missing: &[BTreeSet<u16>],
    ) -> Result<Exit, CommandError> {
        let Self { context, found, flights, decision } = self;
        for (flight, start) in flights.iter().zip(&decision.starts) {
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
        let mut left: Vec<(PathBuf, String)> = found.unreadable.clone();
        let path = |log: usize| found.logs.get(log).map(|log| log.path.clone()).unwrap_or_default();
        left.extend(decision.left.iter().map(|(log, why)| (path(*log), why.clone())));
        let mut doubts: Vec<String> =
            decision.doubts.iter().map(|doubt| self.doubt(doubt)).collect();
        let (mut taken, mut in_part) = (0, false);
        for (take, outcome) in outcomes {
            match outcome {
                Carried::Taken(entry, moved) => {
                    taken += 1;
                    self.say_taken(take, &entry.file, "")?;
                    in_part |= self.say_incomplete(&entry.file, entry.incomplete.as_deref());
                    if let Some(moved) = moved {
                        context.say(&format!(
                            "{} was of another start, and is {} now",
                            entry.file,
                            moved.shown()
                        ));
                    }
                }
                Carried::There(incomplete) => {
                    let file = flights[take.flight].files.get(&take.slot);
                    let file = file.map_or("", String::as_str);
                    self.say_taken(take, file, ", had come before")?;
                    in_part |= self.say_incomplete(file, incomplete.as_deref());
                }
                Carried::Left(why) => doubts.push(format!("{}: {why}", path(take.log).shown())),
            }
        }
        left.sort();
        for (path, why) in &left {
            context.say(&format!("left {}: {why}", path.shown()));
        }
        for card in &found.empty {
            context.warn(&format!("{} holds no log (.BIN)", card.shown()));
        }
        for doubt in &doubts {
            context.warn(doubt);
        }
        let lost = self.say_missing(outcomes, missing);
        let there = outcomes.iter().filter(|(_, outcome)| is_there(outcome)).count();
        context.say(&format!(
            "Took {} from cards{}",
            words::count(taken, "log"),
            if there == 0 { String::new() } else { format!(" ({there} had come before)") }
        ));
        if context.json {
            context.print_json(&self.output(outcomes, missing, &left, doubts.clone()))?;
        }
        Ok(if lost || in_part || !doubts.is_empty() { Exit::Losses } else { Exit::Done })
    }

    /// Warns of a log that may not hold all of its flight; whether it is one.
    fn say_incomplete(&self, file: &str, why: Option<&str>) -> bool {
        if let Some(why) = why {
            self.context.warn(&format!("{file} is not known to be whole: {why}"));
        }
        why.is_some()
    }

    /// `cards/3/00000012.BIN -> drone 3 -> slot 3 -> hover (03.BIN)`.
    fn say_taken(&self, take: &Take, file: &str, note: &str) -> Result<(), CommandError> {
        let Some(log) = self.found.logs.get(take.log) else { return Ok(()) };
        let drone = log.identity.system_id.map_or("?".to_owned(), |system| system.to_string());
        let line = format!(
            "{} -> drone {drone} -> slot {} -> {} ({file}{note})\n",
            log.path.shown(),
            take.slot,
            self.flights[take.flight].name
        );
        if self.context.json { Ok(()) } else { self.context.print(&line) }
    }

    /// Names the slots without a log. A flight of which nothing is there and that nobody is known to
    /// have started is no loss beside others that are.
    fn say_missing(&self, outcomes: &[(Take, Carried)], missing: &[BTreeSet<u16>]) -> bool {
        let wanted = self.flights.iter().filter(|flight| flight.is_wanted).count();
        let mut lost = false;
        for (index, (flight, slots)) in self.flights.iter().zip(missing).enumerate() {
            if slots.is_empty() {
                continue;
            }
            let came = outcomes.iter().any(|(take, _)| take.flight == index);
            let all = slots.len() == flight.plan.slots.len();
            let is_doubted = self.decision.doubts.iter().any(|doubt| doubt.is_of(index));
            let is_free = all && !came && !is_doubted && flight.record.is_none();
            if is_free && wanted > 1 && !outcomes.is_empty() {
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

    fn doubt(&self, doubt: &Doubt) -> String {
        let name = |flight: &usize| self.flights[*flight].name.as_str();
        let path = |log: &usize| {
            self.found.logs.get(*log).map(|log| log.path.shown().to_string()).unwrap_or_default()
        };
        match doubt {
            Doubt::Start { flight, starts } => {
                let times: Vec<String> = (starts.iter())
                    .map(|(start, count)| {
                        format!(
                            "{} (--start {}, {})",
                            utc(*start),
                            unix_s(*start),
                            words::count(*count, "log")
                        )
                    })
                    .collect();
                format!(
                    "{} was flown several times: {}; none is taken: say which with --flight {} --start",
                    name(flight),
                    times.join(", "),
                    name(flight)
                )
            }
            Doubt::Log { flight, slot, logs, why } => {
                let logs: Vec<String> = logs.iter().map(|log| about(self.found, *log)).collect();
                format!(
                    "no log is taken for slot {slot} of {}: {}: {why}; give the file of the right one \
                     alone, or run this on a terminal",
                    name(flight),
                    logs.join("; ")
                )
            }
            Doubt::Slot { flight, log, why } => {
                format!("{} is of {}, but of which slot? {why}", path(log), name(flight))
            }
            Doubt::Flight { log, flights } => {
                let names: Vec<&str> = flights.iter().map(name).collect();
                format!(
                    "{} fits {} equally: say which with --flight",
                    path(log),
                    words::list(&names)
                )
            }
        }
    }

    fn output(
        &self,
        outcomes: &[(Take, Carried)],
        missing: &[BTreeSet<u16>],
        left: &[(PathBuf, String)],
        doubts: Vec<String>,
    ) -> ImportOutput {
        let several = self.flights.len() > 1;
        let shown = |take: &Take| {
            let flight = &self.flights[take.flight];
            let file = flight.files.get(&take.slot).cloned().unwrap_or_default();
            if several { format!("{}/{file}", flight.name) } else { file }
        };
        let is_taken = |outcome: &Carried| matches!(outcome, Carried::Taken(..));
        let named = |is: &dyn Fn(&Carried) -> bool| {
            outcomes
                .iter()
                .filter(|(_, outcome)| is(outcome))
                .map(|(take, _)| shown(take))
                .collect()
        };
        let row = |(take, outcome): &(Take, Carried)| {
            let log = self.found.logs.get(take.log)?;
            Some(LogRow {
                card: log.path.clone(),
                drone: log.identity.system_id,
                slot: take.slot,
                file: self.flights[take.flight].files.get(&take.slot)?.clone(),
                state: match outcome {
                    Carried::Taken(..) => "taken",
                    Carried::There(_) => "there",
                    Carried::Left(_) => return None,
                },
            })
        };
        let wanted = self.flights.iter().enumerate().filter(|(_, flight)| flight.is_wanted);
        let flights = wanted.map(|(index, flight)| FlightRow {
            flight: flight.name.clone(),
            start: self.decision.starts.get(index).copied().flatten().map(|(start, _)| start),
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
            flights: flights.collect(),
            taken: named(&is_taken),
            there: named(&is_there),
            left: left.iter().map(|(path, why)| format!("{}: {why}", path.shown())).collect(),
            doubts,
            missing_slots: all.into_iter().collect(),
        }
    }
}

/// The nearest second: starts are whole seconds, and logs know them to some tenths.
fn unix_s(time: GpsTime) -> i64 {
    time.to_unix_ms().saturating_add(500).div_euclid(1000)
}

/// `2026-11-21 14:03:11 UTC`.
fn utc(time: GpsTime) -> String {
    let seconds = unix_s(time);
    let (year, month, day) = date(seconds.div_euclid(86_400));
    let second = seconds.rem_euclid(86_400);
    format!(
        "{year:04}-{month:02}-{day:02} {:02}:{:02}:{:02} UTC",
        second / 3600,
        second / 60 % 60,
        second % 60
    )
}

/// Year, month and day of the Gregorian calendar, of so many days since 1970-01-01.
fn date(days: i64) -> (i64, i64, i64) {
    // Years are counted from March: then the leap day is the last of a year.
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    (year_of_era + era * 400 + i64::from(month <= 2), month, day)
}

/// Slots by system id, from the campaign's table.
fn system_ids(folder: &FlightFolder) -> Result<BTreeMap<u8, u16>, CommandError> {
    if !FleetTable::path(&folder.0).exists() {
        return Ok(BTreeMap::new());
    }
    let table = FleetTable::read(&folder.0)?;
    Ok(table.drones.iter().map(|line| (line.drone.system, line.slot)).collect())
}

fn log_names(folder: &FlightFolder, plan: &Plan) -> BTreeMap<u16, String> {
    let name = |path: PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let of = |slot: u16| Some((slot, name(folder.log(slot, plan.slots.len()))?));
    plan.slots.iter().filter_map(|slot| of(slot.slot)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        let at = |unix_s: i64| utc(GpsTime::from_unix_ms(unix_s * 1000).unwrap());
        assert_eq!(at(1_795_143_537), "2026-11-20 02:58:57 UTC");
        assert_eq!(at(1_709_164_800), "2024-02-29 00:00:00 UTC");
        assert_eq!(at(1_735_689_599), "2024-12-31 23:59:59 UTC");
    }
}
