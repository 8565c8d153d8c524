//! Start in two steps, and the show that follows.

use std::collections::BTreeMap;

use super::Crew;
use super::down::{SHOW_LEFT, bring_down, in_words, stopped};
use super::eyes::Eyes;
use super::hear::hear_together;
use crate::base::time::GpsTime;
use crate::fleet::abort::Aborted;
use crate::fleet::journal::Journal;
use crate::fleet::start::{Start, StartOptions, StartPhase, StartRefusal};
use crate::fleet::telemetry::Drone;
use crate::fleet::watch::{self, Monitor};
use crate::link::clock::{MS, S};
use crate::link::conversation::Observer as _;
use crate::link::error::NetError;
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::live::view::Step;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::interrupt::Interrupt;
use crate::workflow::host::News;

/// That there is no start is said so often, with 200 ms between, whatever is heard; and on until
/// everyone knows, but no more often than this.
const TOLD_AT_LEAST: u32 = 5;
const TOLD_AT_MOST: u32 = 50;

/// The refusal of a start; one that came too late is no failure: nothing was started.
#[expect(clippy::needless_pass_by_value, reason = "as map_err hands it over")]
pub(super) fn refused(error: StartRefusal) -> WorkflowError {
    match error {
        StartRefusal::TooLate { .. } => WorkflowError::Unsafe(error.to_string()),
        _ => WorkflowError::Failed(error.to_string()),
    }
}

impl<'a> Crew<'a> {
    /// Sets a start and waits until every drone has taken it.
    pub(crate) fn announce(&mut self, options: StartOptions) -> Result<Start, WorkflowError> {
        self.not_ordered_down()?;
        self.step(Step::Start, "Waiting for every drone to take the start time");
        let mut start = Start::announce(self.drones(), &self.telemetry, options, self.net.now())
            .map_err(refused)?;
        self.until_taken(&mut start)?;
        self.host.news(&News::Start(start.time().map(GpsTime::total_ms)));
        let latest_s = options.authorize_before_s;
        self.step(
            Step::Start,
            &format!(
                "Every drone has the start time: a person must authorize it until {latest_s:.0} s before it"
            ),
        );
        Ok(start)
    }

    /// Refuses where too little time is left to authorize a start.
    pub(crate) fn in_time(&self, start: &Start) -> Result<(), WorkflowError> {
        let left = start.check_time(&self.telemetry, self.net.now());
        left.map_err(refused)
    }

    /// Authorizes a start that all have taken, and waits until all know.
    pub(crate) fn authorize(&mut self, start: &mut Start) -> Result<(), WorkflowError> {
        if let Err(ordered) = self.not_ordered_down() {
            self.cancel(start)?;
            return Err(ordered);
        }
        if let Err(error) = start.authorize(&self.telemetry, self.net.now()) {
            self.cancel(start)?;
            return Err(refused(error));
        }
        if let Err(error) = self.write_start(start) {
            self.cancel(start)?;
            return Err(error);
        }
        self.step(
            Step::Start,
            "Authorized: waiting for every drone to know, then they take off by themselves",
        );
        self.note("authorized", Some(format!("start at {}", start.second_of_week())))?;
        self.until_taken(start)
    }

    /// Broadcasts until all have taken it, or the time is up.
    fn until_taken(&mut self, start: &mut Start) -> Result<(), WorkflowError> {
        let until = self.net.now() + 10 * S;
        loop {
            let now = self.net.now();
            if let Err(ordered) = self.not_ordered_down() {
                self.cancel(start)?;
                return Err(ordered);
            }
            if let Some(packet) = start.due(&self.telemetry, now) {
                match self.net.broadcast(&packet) {
                    // It is sent again in a moment.
                    Err(NetError::Refused(refusal)) if refusal.for_now => {}
                    Err(NetError::Refused(refusal)) => {
                        self.cancel(start)?;
                        let why = refusal.why;
                        return Err(WorkflowError::Unsafe(format!(
                            "the start was cancelled: {why}"
                        )));
                    }
                    sent => sent?,
                }
            }
            let late = start.late(&self.telemetry, now);
            if late.is_empty() {
                return Ok(());
            }
            if now >= until || self.host.is_stopped() {
                self.cancel(start)?;
                self.host.check_stop()?;
                let names: Vec<String> =
                    late.iter().map(|(drone, what)| format!("drone {drone}: {what}")).collect();
                return Err(WorkflowError::Failed(format!(
                    "the start was cancelled, because not every drone accepted it ({}); try again",
                    names.join("; ")
                )));
            }
            let next = start.next().clamp(now + MS, now + 100 * MS);
            while let Some(received) = self.net.recv(next)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
    }

    /// Takes a start back, for as long as it takes everyone to hear it.
    pub(crate) fn cancel(&mut self, start: &mut Start) -> Result<(), WorkflowError> {
        self.tell_of_no_start(start)?;
        self.finish_orders()?;
        self.withdraw_start();
        self.host.news(&News::Start(None));
        self.try_note("cancelled", &BTreeMap::new());
        Ok(())
    }

    /// Clears a start that was flown once everyone is down: an authorization that stays on a drone
    /// stands in the way of the next flight.
    pub(crate) fn clear_start(&mut self, start: &mut Start) -> Result<(), WorkflowError> {
        if self.drones().into_iter().all(|drone| self.ended(drone).is_down()) {
            self.tell_of_no_start(start)?;
        }
        Ok(())
    }

    fn tell_of_no_start(&mut self, start: &mut Start) -> Result<(), WorkflowError> {
        start.cancel(self.net.now());
        for round in 0..TOLD_AT_MOST {
            let all_know = start.late(&self.telemetry, self.net.now()).is_empty();
            if round >= TOLD_AT_LEAST && all_know {
                break;
            }
            self.net.broadcast(&start.packet())?;
            let until = self.net.now() + 200 * MS;
            while let Some(received) = self.net.recv(until)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
        Ok(())
    }

    /// Goes on until what another terminal has ordered is confirmed or given up.
    pub(super) fn finish_orders(&mut self) -> Result<(), WorkflowError> {
        while self.net.ordered_down().values().any(|going_on| *going_on) {
            let until = self.net.now() + 100 * MS;
            if let Some(received) = self.net.recv(until)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
        }
        Ok(())
    }

    /// Watches the show until everyone has landed. Drones whose flight gave an alarm.
    pub(crate) fn watch(
        &mut self,
        start: &mut Start,
    ) -> Result<BTreeMap<DroneId, Vec<String>>, WorkflowError> {
        let start_gps_ms = start.time().map(GpsTime::total_ms);
        let mut eyes = self.eyes(start_gps_ms.filter(|_| start.is_known()));
        if !self.is_virtual {
            self.host.set_in_flight(Some(SHOW_LEFT));
        }
        let (drones, mut held) = (self.drones(), false);
        let outcome = loop {
            let now = self.net.now();
            let ordered = self.net.ordered_down();
            let before = start.left_s(eyes.telemetry(), now).is_some_and(|left_s| left_s > 0.0);
            if !ordered.is_empty() && before && start.phase() != StartPhase::Cancelled {
                // A start packet has no address: who goes on needs a new one.
                self.host.insist("The start is being cancelled on all drones");
                start.cancel(now);
                self.withdraw_start();
            }
            let cancelled = start.phase() == StartPhase::Cancelled;
            let told = cancelled && start.late(eyes.telemetry(), now).is_empty();
            if let Some(packet) = start.due(eyes.telemetry(), now).filter(|_| !told) {
                match self.net.broadcast(&packet) {
                    // Everyone has the start; it is only repeated.
                    Err(NetError::Refused(refusal)) if !held => {
                        held = true;
                        self.host.warn(&format!("the start is not repeated: {}", refusal.why));
                    }
                    Err(NetError::Refused(_)) => {}
                    sent => sent?,
                }
            }
            let next = start.next().clamp(now + MS, now + 100 * MS);
            hear_together(&mut self.net, next, |now, received| eyes.on_message(now, received))?;
            eyes.stop(self.net.now());
            eyes.ask_times(&mut self.net);
            eyes.ask_streams(&mut self.net);
            let going_on = ordered.values().any(|going_on| *going_on);
            let down = |drone: &DroneId| {
                let armed = eyes.telemetry().get(*drone).and_then(Drone::is_armed);
                (cancelled || ordered.contains_key(drone)) && armed == Some(false)
            };
            let all_down = told == cancelled && !ordered.is_empty() && drones.iter().all(down);
            if !going_on && (eyes.is_over() || all_down) {
                break Ok(());
            }
            if let Some(choice) = eyes.choice(self.net.now()) {
                let mut ended = BTreeMap::new();
                if let Some(action) = choice.action() {
                    let (host, net) = (self.host, &mut self.net);
                    ended = bring_down(host, net, &mut eyes, &drones, action);
                    self.try_note("abort", &in_words(&ended));
                    if before && ended.values().all(|end| *end == Aborted::Grounded) {
                        self.withdraw_start();
                    }
                }
                break Err(if self.is_virtual {
                    WorkflowError::Interrupted
                } else {
                    stopped(choice, false, &drones, &ended)
                });
            }
        };
        eyes.end_streams(&mut self.net);
        self.host.set_in_flight(None);
        let alarms = self.close(eyes);
        outcome.and(alarms)
    }

    /// Watches a flight from here on.
    pub(super) fn eyes(&mut self, start_gps_ms: Option<i64>) -> Eyes<'a> {
        self.host.news(&News::Assigned(&self.table));
        self.host.news(&News::Start(start_gps_ms));
        self.step(Step::Flying, "Waiting for every drone to fly its show and to land");
        let telemetry = std::mem::take(&mut self.telemetry);
        let mut monitor =
            Monitor::new(self.plan, &self.table, telemetry, watch::Limits::of(self.plan));
        monitor.set_start(start_gps_ms);
        let interrupt = if self.is_virtual {
            Interrupt::silent(self.host)
        } else {
            Interrupt::new(self.host, self.on_interrupt)
        };
        let is_quiet = self.is_virtual && !self.tells_all;
        let mut eyes = Eyes::new(self.host, monitor, is_quiet, interrupt);
        if !self.is_virtual {
            // Drones that are about to fly are watched, journal or not.
            eyes.write_into(Journal::open(&self.folder.0));
        }
        eyes
    }

    /// What was seen: the drones whose flight gave an alarm.
    pub(super) fn close(
        &mut self,
        eyes: Eyes<'_>,
    ) -> Result<BTreeMap<DroneId, Vec<String>>, WorkflowError> {
        self.flew.extend(eyes.flew());
        self.fell.extend(eyes.fell());
        let (telemetry, alarms) = eyes.close();
        self.telemetry = telemetry;
        self.tell_troubles();
        Ok(alarms?)
    }
}
