//! Import of logs from cards: each goes to the flight and slot that it is of.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::OnceLock;

use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::start::StartRecord;
use crate::campaign::{self, FlightFolder};
use crate::fleet::logs::import::{
    Answers, Carried, CarriedOut, Carry, Decision, Doubt, ImportFlight, Survey, Take, carry_out,
    decide, survey,
};
use crate::fleet::slots::FleetTable;
use crate::flight::identity::{SAME_START_S, later_s};
use crate::mission::Plan;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::{Host, Progress};
use crate::workflow::times::{unix_s, utc};
use crate::workflow::{made_by, words};

/// What is to be imported.
pub(crate) struct Import {
    /// Campaign folder.
    pub(crate) campaign: PathBuf,
    /// Folders of cards, or files.
    pub(crate) cards: Vec<PathBuf>,
    /// Only this flight's logs.
    pub(crate) flight: Option<String>,
    /// When its show started, Unix time, s.
    pub(crate) start_unix_s: Option<i64>,
    /// Whether they take the place of logs of the same start that are home.
    pub(crate) again: bool,
}

/// Asks a person which of several is meant; `None`: none of them.
pub(crate) type Choose<'a> = &'a dyn Fn(&str, &[String]) -> Result<Option<usize>, WorkflowError>;

/// What became of the logs on cards.
pub(crate) struct Imported {
    /// All that is on the cards.
    pub(crate) found: Survey,
    /// The flights of the campaign.
    pub(crate) flights: Vec<ImportFlight>,
    /// Which log is of what.
    pub(crate) decision: Decision,
    /// What became of those that are of a slot.
    pub(crate) outcomes: Vec<(Take, Carried)>,
    /// The slots without a log, for each flight.
    pub(crate) missing: Vec<BTreeSet<u16>>,
}

/// Takes logs from cards. `choose`: whom to ask where two logs fit equally; else they are left.
pub(crate) fn import(
    host: &dyn Host,
    wish: &Import,
    choose: Option<Choose<'_>>,
) -> Result<Imported, WorkflowError> {
    let flights = flights(wish)?;
    let _lock = host.lock(&wish.campaign)?;
    let progress: OnceLock<Box<dyn Progress + '_>> = OnceLock::new();
    let found = survey(&wish.cards, &flights, &|total| {
        progress.get_or_init(|| host.progress("reading", total as u64)).advance();
    })?;
    if let Some(progress) = progress.get() {
        progress.finish();
    }
    host.check_stop()?;
    let decision = decided(choose, &found, &flights)?;
    let how =
        Carry { again: wish.again, made_by: made_by(), unix_s: host.clock().unix_us() / 1_000_000 };
    let CarriedOut { outcomes, missing } = carry_out(&decision, &found, &flights, &how)?;
    Ok(Imported { found, flights, decision, outcomes, missing })
}

impl Imported {
    /// The path of a log on a card.
    pub(crate) fn path(&self, log: usize) -> PathBuf {
        self.found.logs.get(log).map(|log| log.path.clone()).unwrap_or_default()
    }

    /// What was left on the cards, and why.
    pub(crate) fn left(&self) -> Vec<(PathBuf, String)> {
        let mut left: Vec<(PathBuf, String)> = self.found.unreadable.clone();
        left.extend(self.decision.left.iter().map(|(log, why)| (self.path(*log), why.clone())));
        left.sort();
        left
    }

    /// What nobody has decided, and what could not be carried out, a sentence each.
    pub(crate) fn doubts(&self) -> Vec<String> {
        let open = self.decision.doubts.iter().map(|doubt| self.doubt(doubt));
        let refused = self.outcomes.iter().filter_map(|(take, outcome)| match outcome {
            Carried::Left(why) => Some(format!("{}: {why}", self.path(take.log).shown())),
            _ => None,
        });
        open.chain(refused).collect()
    }

    /// Whether a log that was taken, or had come before, is not known to be whole.
    pub(crate) fn in_part(&self) -> bool {
        self.outcomes.iter().any(|(_, outcome)| match outcome {
            Carried::Taken(entry, _) => entry.incomplete.is_some(),
            Carried::There(incomplete) => incomplete.is_some(),
            Carried::Left(_) => false,
        })
    }

    /// Whether the slots of a flight without a log are a loss. A flight of which nothing is there and
    /// that nobody is known to have started is none beside others that are.
    pub(crate) fn is_loss(&self, index: usize) -> bool {
        let (Some(flight), Some(slots)) = (self.flights.get(index), self.missing.get(index)) else {
            return false;
        };
        let wanted = self.flights.iter().filter(|flight| flight.is_wanted).count();
        let came = self.outcomes.iter().any(|(take, _)| take.flight == index);
        let all = slots.len() == flight.plan.slots.len();
        let is_doubted = self.decision.doubts.iter().any(|doubt| doubt.is_of(index));
        let is_free = all && !came && !is_doubted && flight.record.is_none();
        let is_left = is_free && wanted > 1 && !self.outcomes.is_empty();
        !(slots.is_empty() || is_left)
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
                    "{} was flown several times: {}; none was imported: say which with --flight \
                     {} --start",
                    name(flight),
                    times.join(", "),
                    name(flight)
                )
            }
            Doubt::Log { flight, slot, logs, why } => {
                let logs: Vec<String> = logs.iter().map(|log| about(&self.found, *log)).collect();
                format!(
                    "no log was imported for slot {slot} of {}: {}: {why}; give only the right \
                     file, or run this on a terminal",
                    name(flight),
                    logs.join("; ")
                )
            }
            Doubt::Slot { flight, log, why } => {
                format!("{} belongs to {}, but to which slot? {why}", path(log), name(flight))
            }
            Doubt::Flight { log, flights } => {
                let names: Vec<&str> = flights.iter().map(name).collect();
                format!(
                    "{} fits {} equally well: say which with --flight",
                    path(log),
                    words::list(&names)
                )
            }
        }
    }
}

/// The flights of the campaign; those that are not imported are known, to recognize their logs.
fn flights(wish: &Import) -> Result<Vec<ImportFlight>, WorkflowError> {
    let mut flights = Vec::new();
    let mut unusable = None;
    for folder in campaign::flights(&wish.campaign)? {
        let plan = match folder.read_plan() {
            Ok(plan) => plan,
            // One that is not asked for may be broken.
            Err(error) if wish.flight.is_some() => {
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
            is_wanted: wish.flight.as_ref().is_none_or(|name| *name == plan.name),
            plan,
        });
    }
    let wanted = flights.iter().filter(|flight| flight.is_wanted).count();
    if wanted == 0 {
        if let Some(error) = unusable {
            return Err(error.into());
        }
        let names: Vec<&str> = flights.iter().map(|flight| flight.name.as_str()).collect();
        let name = wish.flight.as_deref().unwrap_or_default();
        return Err(WorkflowError::Usage(format!(
            "the campaign has no flight \"{name}\", but {}",
            names.join(", ")
        )));
    }
    if let Some(unix_s) = wish.start_unix_s {
        let start = unix_s.checked_mul(1000).and_then(GpsTime::from_unix_ms);
        let start = start
            .ok_or_else(|| WorkflowError::Usage(format!("--start {unix_s} is not a GPS time")))?;
        if wanted > 1 {
            let reason = "--start is for one flight: say which with --flight";
            return Err(WorkflowError::Usage(reason.to_owned()));
        }
        for flight in flights.iter_mut().filter(|flight| flight.is_wanted) {
            let known = flight.start.filter(|known| later_s(start, *known).abs() > SAME_START_S);
            if let Some(known) = known {
                return Err(WorkflowError::Usage(format!(
                    "--start is {}, but {} says that {} began {}: the logs of another start \
                     cannot be placed beside it (omit --start, or move the file away if it is \
                     wrong)",
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
    choose: Option<Choose<'_>>,
    found: &Survey,
    flights: &[ImportFlight],
) -> Result<Decision, WorkflowError> {
    let mut answers = Answers::default();
    let mut decision = decide(found, flights, &answers);
    let mut asked = BTreeSet::new();
    let Some(choose) = choose else { return Ok(decision) };
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
                if let Some(choice) = choose(&question, &choices.collect::<Vec<_>>())? {
                    answers.starts.insert(*flight, starts[choice].0);
                }
            }
            Doubt::Log { flight, slot, logs, why } => {
                let name = &flights[*flight].name;
                let question = format!("Which log belongs to slot {slot} of {name}? ({why})");
                let choices = logs.iter().map(|log| about(found, *log));
                let choice = choose(&question, &choices.collect::<Vec<_>>())?;
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

/// Slots by system id, from the campaign's table.
fn system_ids(folder: &FlightFolder) -> Result<BTreeMap<u8, u16>, WorkflowError> {
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
