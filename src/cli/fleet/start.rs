//! How a start is given: its time, a person's word, and the flight that comes of it.

use std::collections::BTreeMap;
use std::io::{BufRead as _, IsTerminal as _};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use clap::Args;

use super::crew::{Crew, Ended};
use super::interrupt::InterruptArgs;
use super::tables;
use crate::cli::context::{Context, prompt};
use crate::cli::exit::{CommandError, Exit};
use crate::fleet::start::{LEAST_LEAD_S, MOST_LEAD_S, Start, StartOptions};
use crate::link::id::DroneId;
use crate::link::net::Net as _;

/// How a start is given.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct LeadArgs {
    /// From now to the start, s of the drones' time: 20 to 43200
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = lead_seconds)]
    pub(in crate::cli) lead: f64,
    /// Authorize the start without asking
    #[arg(short, long)]
    pub(in crate::cli) yes: bool,
    #[command(flatten)]
    pub(in crate::cli) interrupt: InterruptArgs,
}

/// Parser of `--lead`: nothing has been sent when it refuses.
fn lead_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (LEAST_LEAD_S..=MOST_LEAD_S).contains(&value) => Ok(value),
        _ => Err(format!(
            "a lead between {LEAST_LEAD_S} and {MOST_LEAD_S} s: the drones set their home and arm in \
             the last 10 s"
        )),
    }
}

impl LeadArgs {
    fn options(&self) -> StartOptions {
        StartOptions { lead_s: self.lead, ..StartOptions::default() }
    }
}

/// What a person is told once a start is authorized.
const AUTHORIZED: &str = "Authorized. Ctrl-C asks whether the drones land, return or fly on (without a \
    terminal: --on-interrupt, by default they return); `updraft fleet abort` sends everyone home";

/// What gave an alarm, by drone.
pub(in crate::cli) type Alarms = BTreeMap<DroneId, Vec<String>>;

/// The two steps of a start, and the show.
pub(in crate::cli) fn fly_now(
    context: &Context,
    crew: &mut Crew<'_>,
    lead: &LeadArgs,
) -> Result<(Exit, Alarms), CommandError> {
    needs_person(lead)?;
    let mut start = crew.announce(lead.options())?;
    say_start(context, crew, &start, "Every drone has the start time");
    let yes = lead.yes || {
        let answer = asked("Authorize the start? Type yes: ", || crew.idle());
        if !matches!(answer, Ok(true)) {
            crew.cancel(&mut start)?;
        }
        answer?
    };
    if !yes {
        return Err(CommandError::Unsafe("not authorized: the start was taken back".to_owned()));
    }
    crew.authorize(&mut start)?;
    crew.on_interrupt = lead.interrupt.on_interrupt;
    context.say(AUTHORIZED);
    let alarms = crew.watch(&mut start)?;
    crew.clear_start(&mut start)?;
    Ok((landed(context, crew, &alarms), alarms))
}

/// The same for drones that the station flies itself.
pub(in crate::cli) fn guide_now(
    context: &Context,
    crew: &mut Crew<'_>,
    lead: &LeadArgs,
) -> Result<(Exit, Alarms), CommandError> {
    needs_person(lead)?;
    let start = crew.set_guided_start(lead.options())?;
    say_start(context, crew, &start, "The start time, by the drones' clocks");
    if !lead.yes && !asked("Authorize the start? Type yes: ", || crew.idle())? {
        return Err(CommandError::Unsafe("not authorized: nobody takes off".to_owned()));
    }
    crew.authorize_guided(&start)?;
    crew.on_interrupt = lead.interrupt.on_interrupt;
    context.say(AUTHORIZED);
    context.say("This program flies the drones: leave it running until they have landed");
    let alarms = crew.fly_guided(&start)?;
    Ok((landed(context, crew, &alarms), alarms))
}

pub(in crate::cli) fn needs_person(lead: &LeadArgs) -> Result<(), CommandError> {
    if !lead.yes && !std::io::stdin().is_terminal() {
        return Err(CommandError::Usage(
            "a start is authorized by a person, or with --yes; nothing was started".to_owned(),
        ));
    }
    Ok(())
}

fn say_start(context: &Context, crew: &mut Crew<'_>, start: &Start, what: &str) {
    let time = start.time().map_or_else(String::new, tables::time_of_day);
    context.say(&format!(
        "{what}: {time} ({} s of the GPS week), in {:.0} s",
        start.second_of_week(),
        start.left_s(&crew.telemetry, crew.net.now()).unwrap_or(0.0)
    ));
}

/// Says how many drones have landed, and names the others; whether all have.
pub(in crate::cli) fn say_landed(context: &Context, crew: &Crew<'_>) -> bool {
    let (all, words) = crew.ends();
    if all {
        context.say(&words);
    } else {
        context.insist(&words);
    }
    all
}

/// How the flight ends; what was lost is said.
pub(super) fn landed(context: &Context, crew: &Crew<'_>, alarms: &Alarms) -> Exit {
    let all = say_landed(context, crew);
    let is_missing = |drone: &DroneId| !matches!(crew.ended(*drone), Ended::Landed);
    let missing: Vec<DroneId> =
        crew.table.drones.iter().map(|line| line.drone).filter(is_missing).collect();
    let ordered = crew.net.ordered_down();
    let mut why = Vec::new();
    let named = |drones: Vec<DroneId>| {
        let names: Vec<String> = drones.iter().map(ToString::to_string).collect();
        names.join(", ")
    };
    // Others were heard, too, and obey: they are none of this flight.
    let of_flight = |drone: &DroneId| crew.table.slot_of(*drone).is_some();
    let ordered: Vec<DroneId> = ordered.into_keys().filter(of_flight).collect();
    if !ordered.is_empty() {
        why.push(format!("ordered down: drones {}", named(ordered)));
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
    if !all {
        // In which way each has not is said above.
        why.push(format!("not seen to land: drones {}", named(missing)));
    }
    if why.is_empty() {
        return Exit::Done;
    }
    context.warn(&format!("not a flight without loss: {}", why.join("; ")));
    Exit::Losses
}

/// Asks a person. While they think, the links are listened to and orders carried out.
pub(in crate::cli) fn asked(
    question: &str,
    mut meanwhile: impl FnMut() -> Result<(), CommandError>,
) -> Result<bool, CommandError> {
    let failed = |error: std::io::Error| CommandError::Failed(format!("failed to ask: {error}"));
    prompt(question).map_err(failed)?;
    let (answers, answered) = std::sync::mpsc::sync_channel(1);
    // Ends with the program if nobody answers.
    let read = move || {
        let mut answer = String::new();
        let _ = answers.send(std::io::stdin().lock().read_line(&mut answer).map(|_| answer));
    };
    std::thread::Builder::new().name("answer".to_owned()).spawn(read).map_err(failed)?;
    loop {
        match answered.recv_timeout(Duration::from_millis(50)) {
            Ok(answer) => return Ok(answer.map_err(failed)?.trim().eq_ignore_ascii_case("yes")),
            Err(RecvTimeoutError::Timeout) => meanwhile()?,
            Err(RecvTimeoutError::Disconnected) => return Ok(false),
        }
    }
}
