//! End of flights: over the links, or by the station that holds them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use super::crew::Crew;
use super::one_flight;
use crate::base::causes::with_causes;
use crate::campaign::lock::FolderLock;
use crate::campaign::start::StartRecord;
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::fleet::abort::{Aborted, Action};
use crate::fleet::order_handler::{Notice, OrderHandler};
use crate::fleet::orders::{Given, Inbox, OrderFrom, give, has_station};
use crate::fleet::slots::FleetTable;
use crate::link::id::DroneId;
use crate::link::net::Net;
use crate::link::station::Station;
use crate::mission::Plan;
use crate::workflow::clock::Stopwatch;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::{Host, News};

/// A station that flies answers within this.
const ANSWERS_WITHIN: Duration = Duration::from_secs(3);
/// One that has answered and says nothing more for so long has died.
const DEAD_AFTER: Duration = Duration::from_secs(6);
/// Who has not confirmed for so long is named with what to do, once.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);
/// A running station is given so long at least to hear everyone; it goes on when nobody waits any more.
const FOLLOWED: Duration = Duration::from_secs(15);
const PAUSE: Duration = Duration::from_millis(100);

/// What is to be done where the drones cannot be reached from here.
const INSTEAD: &str = "press Ctrl-C in the terminal of the command that holds the link, and give the order \
     again; or use the remote controls";

/// In words.
pub(crate) fn word(action: Action) -> &'static str {
    match action {
        Action::Return => "abort",
        Action::Land => "land",
    }
}

/// Nobody is heard whom an order could reach.
const NOBODY: &str = "no drone was heard: use the remote controls";

fn own_name(host: &dyn Host) -> String {
    format!("{:020}-{}", host.clock().unix_us(), std::process::id())
}

/// A net on which `fleet abort` and `fleet land` of other terminals are carried out, whatever this
/// command is at.
pub(crate) fn order_handler<'a>(
    host: &'a dyn Host,
    net: &'a mut dyn Net,
    folder: &'a FlightFolder,
) -> OrderHandler<'a> {
    let inbox = Inbox::open(&folder.0, own_name(host));
    if let Err(error) = &inbox {
        host.warn(&format!(
            "{}; `fleet abort` from another terminal will not reach the drones: use Ctrl-C here",
            with_causes(error, ": ")
        ));
    }
    // An order needs no disk: without the table it is for those who are heard.
    let fleet = || table_of(folder);
    OrderHandler::new(net, inbox.ok(), move |notice| tell(host, folder, notice)).with_fleet(fleet)
}

/// The drones of a flight's table, if it has one that can be read.
fn table_of(folder: &FlightFolder) -> BTreeSet<DroneId> {
    FleetTable::read(&folder.0)
        .map(|table| table.by_drone().into_keys().collect())
        .unwrap_or_default()
}

fn tell(host: &dyn Host, folder: &FlightFolder, notice: &Notice) {
    let (text, step, outcomes) = match notice {
        Notice::Ordered { action, drones, from } => {
            let text = format!("Ordered {from}: {}", word(*action));
            let said = |drone: &DroneId| (*drone, format!("ordered {from}"));
            (text, word(*action), drones.iter().map(said).collect())
        }
        Notice::Done { action, drone, done } => {
            let outcome = BTreeMap::from([(*drone, done.to_string())]);
            (format!("drone {drone}: {done}"), word(*action), outcome)
        }
        Notice::NoAnswer { reason } => {
            (format!("warning: the order is being carried out, but {reason}"), "", BTreeMap::new())
        }
    };
    host.insist(&text);
    host.news(&News::Order(notice));
    if !step.is_empty()
        && let Err(error) = super::crew::write_outcomes(host, folder, step, &outcomes)
    {
        host.warn(&error.to_string());
    }
}

/// Whether another process works in the campaign.
fn is_busy(campaign: &Path) -> bool {
    campaign.is_dir() && matches!(FolderLock::take(campaign), Err(CampaignError::Busy { .. }))
}

/// The flights of the campaign that a station is flying, with their names, wherever in it the folder
/// is. In truth that is one; others are of stations that have died.
pub(crate) fn flying(folder: &Path) -> Vec<(FlightFolder, String)> {
    if !is_busy(folder) {
        return Vec::new();
    }
    let full = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let whole = full.parent().filter(|above| campaign::index_path(above).is_file());
    let mut folders = campaign::flights(whole.unwrap_or(folder)).unwrap_or_default();
    folders.retain(|folder| has_station(&folder.0));
    let name =
        |folder: &FlightFolder| folder.read_plan().map_or_else(|_| String::new(), |plan| plan.name);
    folders
        .into_iter()
        .map(|folder| {
            let name = name(&folder);
            (folder, name)
        })
        .collect()
}

/// The drones that somebody ordering everyone down means, heard or not: those of the flight, or where
/// none is named of the one that was started last.
fn meant(campaign: &Path, flight: Option<&str>) -> BTreeSet<DroneId> {
    let mut folders = campaign::flights(campaign).unwrap_or_default();
    if let Some(name) = flight {
        folders.retain(|folder| folder.read_plan().is_ok_and(|plan| plan.name == name));
    }
    let started = |folder: &FlightFolder| {
        StartRecord::read(folder).ok().flatten().map(|record| record.authorized_unix_s)
    };
    let last = folders.iter().filter_map(|folder| Some((started(folder)?, folder)));
    match last.max_by_key(|(at, _)| *at) {
        Some((_, folder)) => table_of(folder),
        None => folders.iter().flat_map(table_of).collect(),
    }
}

fn any_flight(campaign: &Path) -> Option<(FlightFolder, Plan)> {
    let folder = campaign::flights(campaign).ok()?.into_iter().next()?;
    let plan = folder.read_plan().ok()?;
    Some((folder, plan))
}

/// Gives the order to the stations of these flights, and waits for one to carry it out. `None`:
/// nobody has taken it.
fn give_to(
    host: &dyn Host,
    flights: &[(FlightFolder, String)],
    order: &Order<'_>,
    patience: Duration,
) -> Result<Option<BTreeMap<DroneId, Aborted>>, WorkflowError> {
    let name = own_name(host);
    let drones = order.only.as_ref().map(|only| only.iter().copied().collect::<Vec<_>>());
    let mut given: Vec<(Given, &str)> = Vec::new();
    for (folder, flight) in flights {
        match give(&folder.0, &name, order.action, drones.clone(), OrderFrom::Terminal) {
            Ok(taken) => given.extend(taken.map(|taken| (taken, flight.as_str()))),
            Err(error) => host
                .warn(&format!("no order to the running station: {}", with_causes(&error, ": "))),
        }
    }
    let watch = Stopwatch::start(host);
    loop {
        if let Some(place) = given.iter().position(|(given, _)| given.answer().is_some()) {
            let (taken, flight) = given.swap_remove(place);
            for (other, _) in &given {
                other.withdraw();
            }
            if order.flight.is_some_and(|wanted| wanted != flight) {
                // Whoever orders drones down in a hurry means those that fly.
                host.insist(&format!("{flight} is flying: its station will carry out the order"));
            } else {
                host.say("The link is held by a running station: it will carry out the order");
            }
            return follow(host, taken, patience).map(Some);
        }
        if given.is_empty() || watch.elapsed() >= ANSWERS_WITHIN {
            break;
        }
        host.clock().pause(PAUSE);
    }
    // One that was taken at the last moment is waited for.
    let mut taken = given.into_iter().filter(|(given, _)| !given.withdraw());
    match taken.next() {
        Some((taken, _)) => follow(host, taken, patience).map(Some),
        None => Ok(None),
    }
}

/// Tells what a station answers until everyone has confirmed, or for so long.
fn follow(
    host: &dyn Host,
    given: Given,
    patience: Duration,
) -> Result<BTreeMap<DroneId, Aborted>, WorkflowError> {
    let mut beat = (None, Stopwatch::start(host));
    let watch = Stopwatch::start(host);
    let (mut seen, mut named): (BTreeMap<_, _>, bool) = (BTreeMap::new(), false);
    loop {
        let answer = given.answer();
        if let Some(answer) = &answer {
            seen = answer.drones.iter().copied().collect();
        }
        if let Some(answer) = answer.as_ref().filter(|answer| answer.is_over()) {
            let done = answer.drones.iter().filter_map(|(drone, done)| Some((*drone, (*done)?)));
            let done = done.collect();
            given.forget();
            return Ok(done);
        }
        if let Some(answer) = answer.filter(|answer| Some(answer.beat) != beat.0) {
            beat = (Some(answer.beat), Stopwatch::start(host));
            if answer.beat % 10 == 9 {
                let open = answer.drones.iter().filter(|(_, done)| done.is_none());
                host.say(&waiting(open.map(|(drone, _)| *drone)));
            }
        }
        if !named && watch.elapsed() >= PATIENCE {
            named = true;
            let open = seen.iter().filter(|(_, done)| done.is_none()).map(|(drone, _)| *drone);
            host.insist(&by_hand(open));
        }
        if watch.elapsed() >= patience {
            let seconds = watch.elapsed().as_secs();
            let end = |done: Option<Aborted>| done.unwrap_or(Aborted::StillTold { seconds });
            return Ok(seen.into_iter().map(|(drone, done)| (drone, end(done))).collect());
        }
        if beat.1.elapsed() >= DEAD_AFTER {
            return Err(WorkflowError::Failed(format!(
                "the station accepted the order and no longer answers: {INSTEAD}"
            )));
        }
        if host.check_stop().is_err() {
            return Err(WorkflowError::Stopped(
                "stopped waiting; the running station continues with the order",
            ));
        }
        host.clock().pause(PAUSE);
    }
}

/// Who has not confirmed yet.
pub(crate) fn waiting(drones: impl Iterator<Item = DroneId>) -> String {
    let names: Vec<String> = drones.map(|drone| drone.to_string()).collect();
    format!("not confirmed yet, the order is being repeated: {}", names.join(", "))
}

/// What people do about drones that have not confirmed for a while.
pub(crate) fn by_hand(drones: impl Iterator<Item = DroneId>) -> String {
    let names: Vec<String> = drones.map(|drone| drone.to_string()).collect();
    format!(
        "warning: not confirmed after {} s: {}. Use the remote controls of these drones; the \
         order is still being repeated",
        PATIENCE.as_secs(),
        names.join(", ")
    )
}

/// An order to end flights.
pub(crate) struct Order<'a> {
    /// The campaign.
    pub(crate) campaign: &'a Path,
    /// Its flight, if one is named.
    pub(crate) flight: Option<&'a str>,
    /// Only these drones; `None`: all that are heard.
    pub(crate) only: Option<BTreeSet<DroneId>>,
    pub(crate) action: Action,
    /// How long drones are waited for, s.
    pub(crate) wait_s: f64,
}

/// Who has carried an order out, and what became of it for each drone.
pub(crate) enum CarriedOut {
    /// The station that flies the drones.
    ByStation(BTreeMap<DroneId, Aborted>),
    /// This program.
    Here(BTreeMap<DroneId, Aborted>),
}

/// Ends flights: by the station that flies them, else over links that `open` opens.
pub(crate) fn end(
    host: &dyn Host,
    order: &Order<'_>,
    open: impl FnOnce() -> Result<Station, WorkflowError>,
) -> Result<CarriedOut, WorkflowError> {
    let Order { campaign, flight, only, action, wait_s } = order;
    let stations = flying(campaign);
    let mut unanswered = "";
    if !stations.is_empty() {
        let patience = Duration::from_secs_f64(*wait_s).max(FOLLOWED);
        if let Some(done) = give_to(host, &stations, order, patience)? {
            return Ok(CarriedOut::ByStation(done));
        }
        unanswered = "no station answered within 3 s";
        host.warn(&format!("{unanswered}; the order is sent from here"));
    } else if is_busy(campaign) {
        unanswered = "another updraft is working in this campaign and accepts no orders";
    }
    let (folder, plan) = find(campaign, *flight)?;
    let mut station = open().map_err(|error| match error {
        WorkflowError::Failed(text) if !unanswered.is_empty() => {
            WorkflowError::Failed(format!("{unanswered}, and {text}\n  what to do: {INSTEAD}"))
        }
        WorkflowError::Failed(text) => {
            WorkflowError::Failed(format!("{text}\n  what to do: {INSTEAD}"))
        }
        other => other,
    })?;
    let mut crew = Crew::new(host, &mut station, &folder, &plan);
    crew.hear_anyone(*wait_s, only.as_ref(), NOBODY)?;
    let left_s = wait_s - crew.net.now() as f64 * 1e-6;
    let meant = meant(campaign, *flight);
    let done = crew.abort(only.as_ref(), &meant, *action, left_s.max(0.0))?;
    crew.withdraw_unflown(&done);
    Ok(CarriedOut::Here(done))
}

/// The flight that is meant: nobody looks for its name while drones fall, any plan will do.
pub(crate) fn find(
    campaign: &Path,
    flight: Option<&str>,
) -> Result<(FlightFolder, Plan), WorkflowError> {
    one_flight(campaign, flight).or_else(|error| any_flight(campaign).ok_or(error))
}
