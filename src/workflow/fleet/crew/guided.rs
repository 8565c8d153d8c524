//! Flight that the station itself guides: every drone's trajectory is streamed in GUIDED.

use std::collections::BTreeMap;

use super::down::{GUIDED_LEFT, bring_down, in_words, stopped};
use super::eyes::Eyes;
use super::start::refused;
use super::stubborn::Stubborn;
use super::{AT_ONCE, Crew};
use crate::base::time::GpsTime;
use crate::fleet::abort::{ALL_AT_ONCE, Aborted};
use crate::fleet::command::Command;
use crate::fleet::fence::PutFence;
use crate::fleet::guided::{Guided, GuidedError, GuidedFlight};
use crate::fleet::messages::{GUIDED, set_mode};
use crate::fleet::start::{Start, StartOptions};
use crate::fleet::telemetry::Drone;
use crate::link::clock::MS;
use crate::link::conversation::{Observer as _, run_all};
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::interrupt::Choice;
use crate::workflow::host::News;

impl<'a> Crew<'a> {
    /// Why a show cannot be flown by these drones: who has no show mode, and who has; `None`: it
    /// can.
    pub(crate) fn firmwares(&self) -> Option<String> {
        let has_show =
            |drone: &DroneId| self.telemetry.get(*drone).and_then(Drone::has_show_firmware);
        let named = |wanted: Option<bool>| {
            let drones = self.drones().into_iter().filter(|drone| has_show(drone) == wanted);
            drones.map(|drone| drone.to_string()).collect::<Vec<_>>().join(", ")
        };
        let stock = named(Some(false));
        let all: Vec<String> = [
            ("without show firmware", stock.clone()),
            ("with it", named(Some(true))),
            ("not known", named(None)),
        ]
        .into_iter()
        .filter(|(_, drones)| !drones.is_empty())
        .map(|(what, drones)| format!("{what}: drones {drones}"))
        .collect();
        (!stock.is_empty()).then(|| {
            format!(
                "NO-GO: {}. Nothing was sent. --guided flies all of them by streaming, whatever \
                 their firmware; or leave out those without it",
                all.join("; ")
            )
        })
    }

    /// Puts the fence on every drone, and every drone into GUIDED, where it waits on the ground.
    /// The drones that refused, with their reasons.
    pub(crate) fn make_guided(&mut self) -> Result<BTreeMap<DroneId, String>, WorkflowError> {
        let fence = self.fence()?;
        let silent = self.remember_fence()?;
        let mut drones = self.drones();
        drones.retain(|drone| !silent.contains_key(drone));
        let put = |drone: &DroneId| (*drone, PutFence::new(*drone, fence.clone()));
        let fenced = self.all(drones.iter().map(put).collect(), AT_ONCE)?;
        let mode = |drone: &DroneId| {
            (*drone, Command::new("go into guided mode", set_mode(*drone, GUIDED, 0)))
        };
        let in_mode = self.all(drones.iter().map(mode).collect(), AT_ONCE)?;
        let mut bad = BTreeMap::new();
        for (drone, outcome) in fenced {
            match outcome {
                Ok(()) => {
                    self.known.fenced.insert(drone);
                }
                Err(error) => {
                    bad.insert(drone, crate::workflow::error::with_reasons(&error));
                }
            }
        }
        for (drone, outcome) in in_mode {
            if let Err(error) = outcome {
                bad.insert(drone, error.to_string());
            }
        }
        for (drone, reason) in &bad {
            let slot = self.table.slot_of(*drone).unwrap_or(0);
            self.host.warn(&format!("drone {drone} (slot {slot}): {reason}"));
        }
        bad.extend(silent);
        let fine = |_: &DroneId| "fence set and read back, guided".to_owned();
        let outcomes = self.outcomes_of(fine, &bad);
        self.note_each("guided", Some(format!("{} refused", bad.len())), &outcomes)?;
        Ok(bad)
    }

    /// Sets a start by the drones' clocks. Nothing is sent: it is the station that keeps it.
    pub(crate) fn set_guided_start(
        &mut self,
        options: StartOptions,
    ) -> Result<Start, WorkflowError> {
        self.not_ordered_down()?;
        let now = self.net.now();
        Start::announce(self.drones(), &self.telemetry, options, now).map_err(refused)
    }

    /// Authorizes a start that the station keeps, and writes it down: the logs will not say it.
    pub(crate) fn authorize_guided(&mut self, start: &Start) -> Result<(), WorkflowError> {
        // A person has taken their time to answer.
        while let Some(received) = self.net.recv(0)? {
            crate::link::conversation::Observer::on_message(
                &mut self.telemetry,
                self.net.now(),
                &received,
            );
        }
        self.not_ordered_down()?;
        start.check_time(&self.telemetry, self.net.now()).map_err(refused)?;
        self.write_start(start)?;
        self.note("authorized", Some(format!("start at {}", start.second_of_week())))
    }

    /// Flies everyone, watching, until all have landed. Drones that gave an alarm or were not
    /// flown to the end. Ctrl-C sends all home: without the station nobody else flies them.
    pub(crate) fn fly_guided(
        &mut self,
        start: &Start,
    ) -> Result<BTreeMap<DroneId, Vec<String>>, WorkflowError> {
        let start_gps_ms = start.time().map_or(0, GpsTime::total_ms);
        self.host.news(&News::Start(Some(start_gps_ms)));
        let frame = self.plan.site.frame();
        let mut conversations = BTreeMap::new();
        for line in &self.table.drones {
            let (Some(slot), Some(known)) =
                (self.plan.slot(line.slot), self.telemetry.get(line.drone))
            else {
                continue;
            };
            let flight = GuidedFlight {
                trajectory: self.plan.trajectory(slot),
                frame,
                start_gps_ms,
                yaw_rad: None,
                clock: known.clock.clone(),
            };
            conversations.insert(line.drone, Guided::new(line.drone, flight));
        }
        let eyes = self.eyes(Some(start_gps_ms));
        self.host.set_in_flight(Some(GUIDED_LEFT));
        let (mut eyes, failed, ended) = self.stream(conversations, eyes);
        self.host.set_in_flight(None);
        if !ended.is_empty() {
            self.try_note("abort", &in_words(&ended));
        }
        let choice = eyes.choice(self.net.now());
        let written = failed.map_or(Ok(()), |reason| self.note("link", Some(reason)));
        let alarms = self.close(eyes);
        if let Some(choice) = choice {
            return Err(stopped(choice, true, &self.drones(), &ended));
        }
        written?;
        alarms
    }

    /// Flies, and brings everyone down. Nothing that fails here ends it: drones are in the air.
    fn stream(
        &mut self,
        conversations: BTreeMap<DroneId, Guided>,
        mut eyes: Eyes<'a>,
    ) -> (Eyes<'a>, Option<String>, BTreeMap<DroneId, Aborted>) {
        let drones = self.drones();
        let host = self.host;
        let mut ended = BTreeMap::new();
        let mut net = Stubborn::new(&mut self.net, host);
        let done = run_all(&mut net, conversations, ALL_AT_ONCE, &mut eyes).unwrap_or_default();
        for (drone, outcome) in done {
            match outcome {
                // That was told when it happened.
                Ok(()) | Err(GuidedError::Held { .. }) => {}
                Err(error) => eyes.alarm(drone, error.to_string()),
            }
        }
        // Those that were taken over or called home are still on their way.
        let going_on = |net: &Stubborn<'_>| net.ordered_down().into_values().any(|on| on);
        while eyes.choice(net.now()).is_none() && (!eyes.is_over() || going_on(&net)) {
            let until = net.now() + 100 * MS;
            if let Ok(Some(received)) = net.recv(until) {
                eyes.on_message(net.now(), &received);
            }
            eyes.stop(net.now());
            eyes.ask_times(&mut net);
        }
        if let Some(action) = eyes.choice(net.now()).and_then(Choice::action) {
            ended = bring_down(host, &mut net, &mut eyes, &drones, action);
        }
        (eyes, net.failed, ended)
    }
}
