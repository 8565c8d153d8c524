//! Start of a flight: its time, a person's leave, and the flight that follows.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use super::crew::{Crew, Ended};
use super::interrupt::Choice;
use crate::fleet::start::{Start, StartOptions};
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::{Host, News};
use crate::workflow::words::time_of_day;

/// How a start is given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lead {
    /// From now to the start, s of the drones' time.
    pub(crate) ahead_s: f64,
    /// Whether it is authorized without asking.
    pub(crate) yes: bool,
    /// What drones in the air do when the work is interrupted.
    pub(crate) on_interrupt: Choice,
}

impl Lead {
    fn options(&self) -> StartOptions {
        StartOptions { lead_s: self.ahead_s, ..StartOptions::default() }
    }
}

/// What a person is told once a start is authorized.
const AUTHORIZED: &str = "Authorized. Ctrl-C asks whether the drones land, return or fly on \
                          (without a terminal: --on-interrupt, by default they return); `updraft \
                          fleet abort` sends all drones home";

/// What gave an alarm, by drone.
pub(crate) type Alarms = BTreeMap<DroneId, Vec<String>>;

/// The two steps of a start, and the show.
pub(crate) fn fly_now(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    lead: &Lead,
) -> Result<(Ending, Alarms), WorkflowError> {
    needs_person(host, lead)?;
    let mut start = crew.announce(lead.options())?;
    say_start(host, crew, &start, "Every drone has the start time");
    let yes = lead.yes || {
        let answer = asked(host, "Authorize the start? Type yes: ", || {
            crew.idle()?;
            crew.in_time(&start)
        });
        if !matches!(answer, Ok(true)) {
            crew.cancel(&mut start)?;
        }
        answer?
    };
    if !yes {
        return Err(WorkflowError::Unsafe("not authorized: the start was cancelled".to_owned()));
    }
    crew.authorize(&mut start)?;
    crew.on_interrupt = lead.on_interrupt;
    host.say(AUTHORIZED);
    let alarms = crew.watch(&mut start)?;
    crew.clear_start(&mut start)?;
    Ok((landed(host, crew, &alarms), alarms))
}

/// The two steps of a start of drones that the station flies itself, and their flight.
pub(crate) fn guide_now(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    lead: &Lead,
) -> Result<(Ending, Alarms), WorkflowError> {
    needs_person(host, lead)?;
    let start = crew.set_guided_start(lead.options())?;
    say_start(host, crew, &start, "The start time, by the drones' clocks");
    if !lead.yes && !asked(host, "Authorize the start? Type yes: ", || crew.idle())? {
        return Err(WorkflowError::Unsafe("not authorized: no drone takes off".to_owned()));
    }
    crew.authorize_guided(&start)?;
    crew.on_interrupt = lead.on_interrupt;
    host.say(AUTHORIZED);
    host.say("This program flies the drones: leave it running until they have landed");
    let alarms = crew.fly_guided(&start)?;
    Ok((landed(host, crew, &alarms), alarms))
}

pub(crate) fn needs_person(host: &dyn Host, lead: &Lead) -> Result<(), WorkflowError> {
    if !lead.yes && !host.is_attended() {
        return Err(WorkflowError::Usage(
            "a start must be authorized by a person or with --yes; nothing was started".to_owned(),
        ));
    }
    Ok(())
}

fn say_start(host: &dyn Host, crew: &mut Crew<'_>, start: &Start, what: &str) {
    let time = start.time().map_or_else(String::new, time_of_day);
    host.say(&format!(
        "{what}: {time} ({} s of the GPS week), in {:.0} s",
        start.second_of_week(),
        start.left_s(&crew.telemetry, crew.net.now()).unwrap_or(0.0)
    ));
}

/// Says how many drones have landed, and names the others; whether all have.
pub(crate) fn say_landed(host: &dyn Host, crew: &Crew<'_>) -> bool {
    let (all, words) = crew.ends();
    if all {
        host.say(&words);
    } else {
        host.insist(&words);
    }
    all
}

/// How the flight ends; what was lost is said.
pub(crate) fn landed(host: &dyn Host, crew: &Crew<'_>, alarms: &Alarms) -> Ending {
    say_landed(host, crew);
    let who = |is: fn(&Ended) -> bool| -> Vec<DroneId> {
        let all = crew.table.drones.iter().map(|line| line.drone);
        all.filter(|drone| is(&crew.ended(*drone))).collect()
    };
    let on_ground = who(|ended| matches!(ended, Ended::NeverTookOff));
    let missing = who(|ended| !matches!(ended, Ended::Landed | Ended::NeverTookOff));
    let ordered = crew.net.ordered_down();
    let mut why = Vec::new();
    let named = |drones: Vec<DroneId>| {
        let names: Vec<String> = drones.iter().map(ToString::to_string).collect();
        names.join(", ")
    };
    // Others were heard, too, and obey: they are none of this flight.
    let of_flight = |drone: &DroneId| crew.table.slot_of(*drone).is_some();
    let ordered: BTreeSet<DroneId> =
        ordered.into_keys().chain(crew.ordered_before.iter().copied()).filter(of_flight).collect();
    if !ordered.is_empty() {
        why.push(format!("ordered down: drones {}", named(ordered.into_iter().collect())));
    }
    if !alarms.is_empty() {
        let told: Vec<String> = alarms
            .iter()
            .map(|(drone, said)| match said.as_slice() {
                [only] => format!("drone {drone} ({only})"),
                [first, ..] => format!("drone {drone} ({first}, {} alarms)", said.len()),
                [] => format!("drone {drone}"),
            })
            .collect();
        why.push(format!("alarms of {}", told.join(", ")));
    }
    // In which way each has not landed is said above.
    if !on_ground.is_empty() {
        why.push(format!("never took off: drones {}", named(on_ground)));
    }
    if !missing.is_empty() {
        why.push(format!("not seen to land: drones {}", named(missing)));
    }
    if why.is_empty() {
        return Ending::Done;
    }
    host.warn(&format!("the flight had losses: {}", why.join("; ")));
    Ending::Losses
}

/// Asks a person. While they think, the links are listened to and orders carried out.
pub(crate) fn asked(
    host: &dyn Host,
    question: &str,
    mut meanwhile: impl FnMut() -> Result<(), WorkflowError>,
) -> Result<bool, WorkflowError> {
    let failed = |error: io::Error| WorkflowError::Failed(format!("failed to ask: {error}"));
    let answers = [("yes", "Authorize the start"), ("no", "Cancel: nothing starts")];
    let answered = host.offer(question, &answers).map_err(failed)?;
    loop {
        match answered.recv_timeout(Duration::from_millis(50)) {
            Ok(answer) => {
                host.news(&News::Answered);
                let answer = answer.map_err(failed)?.unwrap_or_default();
                return Ok(answer.trim().eq_ignore_ascii_case("yes"));
            }
            Err(RecvTimeoutError::Timeout) => {
                meanwhile().inspect_err(|_| host.news(&News::Answered))?;
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(false),
        }
    }
}
