//! Choice of the log for each slot of each flight. No file is read here.

use std::collections::{BTreeMap, BTreeSet};

use super::place::{NoSlot, slot_of};
use super::{Answers, CardLog, Decision, Doubt, ImportFlight, StartFrom, Survey, Take};
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::flight::Belongs;
use crate::flight::identity::{SAME_START_S, later_s};

/// A drone that flew this share of a plan flew it.
const WHOLE: f64 = 0.75;
/// A drone that flew less of it flew something else.
const PART: f64 = 0.15;
/// Plans of which so nearly the same share was flown fit equally.
const EQUAL: f64 = 0.03;
/// A boot that differs by more from the one that was written down is another, s.
const SAME_BOOT_S: f64 = 20.0;

/// Decides which logs are taken, which are left and why, and what a person must decide.
///
/// The start of a flight is the one that is known, else that at which most drones flew its plan. A log is
/// taken if it is of that start and its slot is known; a slot takes one.
pub fn decide(survey: &Survey, flights: &[ImportFlight], answers: &Answers) -> Decision {
    let mut work = Work {
        logs: &survey.logs,
        flights,
        answers,
        reasons: BTreeMap::new(),
        decision: Decision { starts: vec![None; flights.len()], ..Decision::default() },
    };
    for (index, log) in survey.logs.iter().enumerate() {
        if let Some(first) = log.copy_of.and_then(|first| survey.logs.get(first)) {
            work.reasons.insert(index, format!("a copy of {}", first.path.shown()));
        } else if let Some(longer) = log.beginning_of.and_then(|longer| survey.logs.get(longer)) {
            work.reasons.insert(index, format!("only the beginning of {}", longer.path.shown()));
        }
    }
    work.find_starts();
    for flight in 0..flights.len() {
        work.choose(flight);
    }
    work.finish()
}

struct Work<'a> {
    logs: &'a [CardLog],
    flights: &'a [ImportFlight],
    answers: &'a Answers,
    /// Why a log is left, the better reasons first.
    reasons: BTreeMap<usize, String>,
    decision: Decision,
}

/// Drones that flew a plan at one time.
struct Group {
    start: GpsTime,
    slots: BTreeSet<u16>,
}

impl Work<'_> {
    /// Logs that are neither copies nor beginnings of others.
    fn own(&self) -> impl Iterator<Item = (usize, &CardLog)> {
        let is_own = |log: &CardLog| log.copy_of.is_none() && log.beginning_of.is_none();
        self.logs.iter().enumerate().filter(move |(_, log)| is_own(log))
    }

    fn find_starts(&mut self) {
        for (index, flight) in self.flights.iter().enumerate() {
            let known = flight.start.or(self.answers.starts.get(&index).copied());
            self.decision.starts[index] = known.map(|start| (start, StartFrom::Known));
        }
        let mut ambiguous = BTreeMap::new();
        for index in 0..self.flights.len() {
            if self.decision.starts[index].is_some() {
                continue;
            }
            let whole = self.groups(index, WHOLE, &mut ambiguous);
            let groups =
                if whole.is_empty() { self.groups(index, PART, &mut ambiguous) } else { whole };
            let most = groups.iter().map(|group| group.slots.len()).max().unwrap_or_default();
            let leaders: Vec<&Group> =
                groups.iter().filter(|group| group.slots.len() == most).collect();
            match leaders.as_slice() {
                [] => {}
                [only] => {
                    self.decision.starts[index] = Some((only.start, StartFrom::Agreed(most)));
                }
                several if self.flights[index].is_wanted => {
                    let starts = several.iter().map(|group| (group.start, most)).collect();
                    self.decision.doubts.push(Doubt::Start { flight: index, starts });
                }
                _ => {}
            }
        }
        let wanted = |flights: &Vec<usize>| {
            flights.iter().any(|flight| self.flights.get(*flight).is_some_and(|f| f.is_wanted))
        };
        let doubts = ambiguous.into_iter().filter(|(_, flights)| wanted(flights));
        let doubts: Vec<Doubt> =
            doubts.map(|(log, flights)| Doubt::Flight { log, flights }).collect();
        self.decision.doubts.extend(doubts);
    }

    /// The times at which drones flew at least this share of a flight's plan, earliest first.
    fn groups(
        &self,
        flight: usize,
        least: f64,
        ambiguous: &mut BTreeMap<usize, Vec<usize>>,
    ) -> Vec<Group> {
        let mut votes: Vec<(GpsTime, u16)> = Vec::new();
        for (index, log) in self.own() {
            for flown in &log.flown {
                let Some(start) = flown.start else { continue };
                let share = |flight: usize| flown.shares.get(flight).copied().unwrap_or(0.0);
                let own = share(flight);
                if own < least || self.is_of_known(log, start) {
                    continue;
                }
                let rivals: Vec<usize> = (0..self.flights.len())
                    .filter(|other| self.decision.starts[*other].is_none() || *other == flight)
                    .filter(|other| share(*other) >= own - EQUAL)
                    .collect();
                if rivals.iter().any(|other| share(*other) > own + EQUAL) {
                    continue;
                }
                // A flight that was named is meant.
                let named = self.flights.iter().filter(|flight| flight.is_wanted).count() == 1;
                if rivals.len() > 1 && !(named && self.flights[flight].is_wanted) {
                    ambiguous.insert(index, rivals);
                    continue;
                }
                if let Ok(slot) = slot_of(&log.identity, &self.flights[flight], Some(start)) {
                    votes.push((start, slot));
                }
            }
        }
        votes.sort();
        let mut groups: Vec<Group> = Vec::new();
        for (start, slot) in votes {
            match groups.last_mut().filter(|group| later_s(start, group.start) <= SAME_START_S) {
                Some(group) => {
                    group.slots.insert(slot);
                }
                None => groups.push(Group { start, slots: BTreeSet::from([slot]) }),
            }
        }
        groups
    }

    /// Whether what a log holds at this time is of a flight whose start is known.
    fn is_of_known(&self, log: &CardLog, start: GpsTime) -> bool {
        let mut known = self.decision.starts.iter().flatten();
        known.any(|(known, from)| {
            *from == StartFrom::Known
                && later_s(start, *known).abs() <= SAME_START_S
                && log.identity.belongs_to(*known) == Belongs::Yes
        })
    }

    /// Gives each slot of a flight its log.
    fn choose(&mut self, flight: usize) {
        let about = &self.flights[flight];
        let mut sure: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
        let mut perhaps: BTreeMap<u16, Vec<(usize, String)>> = BTreeMap::new();
        let mut doubts = Vec::new();
        for (index, log) in self.own() {
            let Some((start, _)) = self.decision.starts[flight] else {
                if let Some(slot) = self.timeless(log, flight) {
                    let why = "it flew the plan, but has no GPS time: it may be of another day";
                    perhaps.entry(slot).or_default().push((index, why.to_owned()));
                }
                continue;
            };
            let belongs = log.identity.belongs_to(start);
            if matches!(belongs, Belongs::No(_)) {
                continue;
            }
            match (slot_of(&log.identity, about, Some(start)), belongs) {
                (Ok(slot), Belongs::Yes) => match self.other_boot(log, flight, slot, start) {
                    None => sure.entry(slot).or_default().push(index),
                    Some(why) => perhaps.entry(slot).or_default().push((index, why)),
                },
                (Ok(slot), Belongs::Unknown(why)) => {
                    perhaps.entry(slot).or_default().push((index, why));
                }
                (Err(NoSlot::Contradiction(why)), Belongs::Yes) => {
                    doubts.push(Doubt::Slot { flight, log: index, why });
                }
                _ => {}
            }
        }
        let slots: BTreeSet<u16> = sure.keys().chain(perhaps.keys()).copied().collect();
        for slot in slots {
            let own = self.fittest(flight, sure.remove(&slot).unwrap_or_default());
            let open = perhaps.remove(&slot).unwrap_or_default();
            if let Some(answer) = self.answers.logs.get(&(flight, slot)) {
                self.decision.take.extend(answer.map(|log| Take { flight, slot, log }));
                continue;
            }
            let doubt = |logs: Vec<usize>, why: &str| Doubt::Log {
                flight,
                slot,
                logs,
                why: why.to_owned(),
            };
            match (own.as_slice(), open.as_slice()) {
                ([log], _) => self.decision.take.push(Take { flight, slot, log: *log }),
                ([], [(log, why)]) => doubts.push(doubt(vec![*log], why)),
                ([], several) => {
                    let logs = several.iter().map(|(log, _)| *log).collect();
                    doubts.push(doubt(
                        logs,
                        "of none of them it is known whether it is of this flight",
                    ));
                }
                (_, _) => doubts.push(doubt(own, "they fit equally")),
            }
        }
        if about.is_wanted {
            self.decision.doubts.extend(doubts);
        }
    }

    /// Of several logs of one start those that flew the plan, if the others flew something else.
    fn fittest(&self, flight: usize, logs: Vec<usize>) -> Vec<usize> {
        let Some((start, _)) = self.decision.starts[flight].filter(|_| logs.len() > 1) else {
            return logs;
        };
        let share = |log: &usize| {
            let flown = self.logs.get(*log).map(|log| log.flown.as_slice()).unwrap_or_default();
            let is_of = |time: GpsTime| later_s(time, start).abs() <= SAME_START_S;
            let own = flown.iter().filter(|flown| flown.start.is_some_and(is_of));
            own.filter_map(|flown| flown.shares.get(flight).copied()).fold(0.0, f64::max)
        };
        let whole: Vec<usize> = logs.iter().copied().filter(|log| share(log) >= WHOLE).collect();
        let rest = logs.iter().filter(|log| !whole.contains(log)).map(share).fold(0.0, f64::max);
        if !whole.is_empty() && rest < WHOLE - 0.25 { whole } else { logs }
    }

    /// The slot of a log that flew a flight's plan, nobody knows when.
    fn timeless(&self, log: &CardLog, flight: usize) -> Option<u16> {
        let flew = |share: &f64| *share >= WHOLE;
        let is_timeless = |start: &Option<GpsTime>| start.is_none();
        let mut flown = log.flown.iter().filter(|flown| is_timeless(&flown.start));
        let fits = flown.any(|flown| flown.shares.get(flight).is_some_and(flew));
        slot_of(&log.identity, &self.flights[flight], None).ok().filter(|_| fits)
    }

    /// That the boot of a log is not the one that was written down for its slot's drone.
    fn other_boot(
        &self,
        log: &CardLog,
        flight: usize,
        slot: u16,
        start: GpsTime,
    ) -> Option<String> {
        let written = self.flights[flight].record.as_ref()?.drone(slot)?.booted?;
        let booted = log.identity.boot_of(start)?.booted?;
        let later_s = later_s(booted, written);
        (later_s.abs() > SAME_BOOT_S).then(|| {
            format!(
                "its autopilot was switched on {:.0} s {} than that of the slot's drone when the start \
                 was authorized",
                later_s.abs(),
                if later_s < 0.0 { "earlier" } else { "later" }
            )
        })
    }

    fn finish(mut self) -> Decision {
        // What is not wanted was only looked for to say what it is.
        let (take, others): (Vec<Take>, Vec<Take>) =
            self.decision.take.iter().partition(|take| self.flights[take.flight].is_wanted);
        self.decision.take = take;
        self.decision.take.sort();
        let taken: BTreeSet<usize> = self.decision.take.iter().map(|take| take.log).collect();
        let doubtful: BTreeSet<usize> = (self.decision.doubts.iter())
            .flat_map(|doubt| match doubt {
                Doubt::Log { logs, .. } => logs.clone(),
                Doubt::Slot { log, .. } | Doubt::Flight { log, .. } => vec![*log],
                Doubt::Start { .. } => Vec::new(),
            })
            .collect();
        for take in others {
            let name = &self.flights[take.flight].name;
            self.reasons.entry(take.log).or_insert_with(|| format!("it belongs to {name}"));
        }
        for index in 0..self.logs.len() {
            if taken.contains(&index) || doubtful.contains(&index) {
                continue;
            }
            let reason = self.reasons.remove(&index).unwrap_or_else(|| self.why_left(index));
            self.decision.left.push((index, reason));
        }
        self.decision
    }

    /// Why a log is of none of the flights.
    fn why_left(&self, index: usize) -> String {
        let Some(log) = self.logs.get(index) else { return String::new() };
        // The flight whose plan it flew most of, else the flights that were asked for, else all.
        let shares = |number: usize| {
            let of_flight = log.flown.iter().filter_map(move |flown| flown.shares.get(number));
            of_flight.copied().fold(0.0, f64::max)
        };
        let best = (0..self.flights.len()).max_by(|a, b| shares(*a).total_cmp(&shares(*b)));
        let best = best.filter(|number| shares(*number) >= PART);
        let mut nearest: Option<(bool, f64, String)> = None;
        for (number, flight) in self.flights.iter().enumerate() {
            let Some((start, _)) = &self.decision.starts[number] else { continue };
            match log.identity.belongs_to(*start) {
                Belongs::No(why) => {
                    let away_s = log.identity.away_s(*start);
                    let is_meant = best.map_or(flight.is_wanted, |best| best == number);
                    let is_nearer = nearest
                        .as_ref()
                        .is_none_or(|(meant, least_s, _)| (is_meant, *least_s) > (*meant, away_s));
                    if is_nearer {
                        let name = format!("{}'s start", flight.name);
                        let why = why.replace("this flight's start", &name);
                        nearest = Some((is_meant, away_s, why));
                    }
                }
                Belongs::Yes | Belongs::Unknown(_) => {
                    return match slot_of(&log.identity, flight, Some(*start)) {
                        Err(NoSlot::Elsewhere(why) | NoSlot::Contradiction(why)) => why,
                        Ok(slot) if self.answers.logs.contains_key(&(number, slot)) => {
                            "not chosen".to_owned()
                        }
                        Ok(slot) => {
                            let own = format!("slot {slot} of {} has another log", flight.name);
                            if log.flown.is_empty() || shares(number) >= WHOLE {
                                own
                            } else {
                                format!("{own}, which flew more of its plan")
                            }
                        }
                    };
                }
            }
        }
        if !log.identity.flew {
            return "it holds no flight".to_owned();
        }
        let flew = best.map(|number| {
            let name = &self.flights[number].name;
            format!("it flew {:.0} % of {name}'s plan", shares(number) * 100.0)
        });
        match (nearest, flew) {
            (Some((true, _, why)), Some(flew)) => format!("{flew}, but {why}"),
            (Some((_, _, why)), None) => why,
            (_, Some(flew)) => flew,
            (None, None) => "it flew none of the plans".to_owned(),
        }
    }
}
