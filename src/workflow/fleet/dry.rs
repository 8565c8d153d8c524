//! Dry runs over links: the messages of each step, which no drone hears.

use std::collections::BTreeMap;
use std::path::Path;

use super::crew::Crew;
use super::end::find;
use super::one_flight;
use crate::base::frame::Geodetic;
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::fleet::abort::{Abort, Action};
use crate::fleet::changes::{Change, Changes};
use crate::fleet::command::Command;
use crate::fleet::dry_run::{Obliging, dry_run};
use crate::fleet::fence::PutFence;
use crate::fleet::greet::Greet;
use crate::fleet::guided::{Guided, GuidedFlight};
use crate::fleet::messages::{GUIDED, set_mode};
use crate::fleet::params::ReadParams;
use crate::fleet::required::{CheckParams, requirements};
use crate::fleet::slots::FleetTable;
use crate::fleet::vehicle_clock::VehicleClock;
use crate::link::clock::Micros;
use crate::link::conversation::Conversation;
use crate::link::error::NetError;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// What each drone would be sent.
pub(crate) type Lines = BTreeMap<DroneId, Vec<String>>;

/// Most messages shown of a conversation.
const MOST: usize = 20_000;

/// Most messages shown of a flight by streaming: three hours.
const MOST_STREAMED: usize = 100_000;

/// No links at all.
struct Nobody;

impl Net for Nobody {
    fn now(&self) -> Micros {
        0
    }

    fn recv(&mut self, _: Micros) -> Result<Option<Received>, NetError> {
        Ok(None)
    }

    fn send(&mut self, _: DroneId, _: &MavMessage) -> Result<(), NetError> {
        Ok(())
    }

    fn broadcast(&mut self, _: &MavMessage) -> Result<(), NetError> {
        Ok(())
    }

    fn heard(&self) -> Vec<DroneId> {
        Vec::new()
    }
}

/// The table of the campaign, or drones by the number of their slots.
fn table(folder: &Path, plan: &Plan) -> Result<FleetTable, WorkflowError> {
    if FleetTable::path(folder).exists() {
        return Ok(FleetTable::read(folder)?);
    }
    Ok(FleetTable::new(plan.slots.iter().map(|slot| {
        let number = usize::from(slot.slot) - 1;
        let id = DroneId { network: (number / 253) as u16, system: (number % 253 + 1) as u8 };
        (id, slot.slot)
    })))
}

fn place(plan: &Plan, slot: Option<&Slot>) -> Geodetic {
    let home = slot.map_or([0.0; 3], |slot| slot.home_m);
    plan.site.frame().to_geodetic(home.into())
}

fn shown<C: Conversation>(
    plan: &Plan,
    table: &FleetTable,
    drone: DroneId,
    conversation: C,
) -> Vec<String> {
    let slot = table.slot_of(drone).and_then(|slot| plan.slot(slot));
    let mut vehicle = Obliging::new(drone, true, place(plan, slot));
    dry_run(conversation, &mut vehicle, MOST).0
}

/// A campaign's flight, and the drones that it would be flown by.
struct Dry {
    folder: FlightFolder,
    plan: Plan,
    table: FleetTable,
}

impl Dry {
    fn of(campaign: &Path, flight: Option<&str>) -> Result<Self, WorkflowError> {
        let (folder, plan) = one_flight(campaign, flight)?;
        let table = table(&folder.0, &plan)?;
        Ok(Self { folder, plan, table })
    }

    /// What each drone would be sent.
    fn each(&self, lines: impl Fn(DroneId) -> Vec<String>) -> BTreeMap<DroneId, Vec<String>> {
        self.table.drones.iter().map(|line| (line.drone, lines(line.drone))).collect()
    }

    fn shown<C: Conversation>(&self, drone: DroneId, conversation: C) -> Vec<String> {
        shown(&self.plan, &self.table, drone, conversation)
    }

    /// A flight by streaming, from its authorization on.
    fn flown(&self, drone: DroneId, lead_s: f64) -> Vec<String> {
        let Some(slot) = self.table.slot_of(drone).and_then(|slot| self.plan.slot(slot)) else {
            return Vec::new();
        };
        let mut vehicle = Obliging::new(drone, false, place(&self.plan, Some(slot)));
        let authorized_ms = (vehicle.unix_us / 1000) as i64 + (lead_s * 1000.0) as i64;
        let flight = GuidedFlight {
            trajectory: self.plan.trajectory(slot),
            frame: self.plan.site.frame(),
            start_gps_ms: GpsTime::from_unix_ms(authorized_ms).map_or(0, GpsTime::total_ms),
            yaw_rad: None,
            clock: VehicleClock::default(),
        };
        let (lines, _) = dry_run(Guided::new(drone, flight), &mut vehicle, MOST_STREAMED);
        told_once(lines)
    }

    fn params(&self, drone: DroneId) -> Vec<String> {
        self.shown(drone, CheckParams::new(drone, requirements(&self.plan, true), false))
    }

    fn upload(&self, host: &dyn Host) -> Result<Lines, WorkflowError> {
        let mut nobody = Nobody;
        let mut crew = Crew::new(host, &mut nobody, &self.folder, &self.plan);
        crew.table = self.table.clone();
        let fence = crew.fence()?;
        let mut lines = BTreeMap::new();
        for (drone, upload) in crew.uploads()? {
            let names = fence.params().into_iter().map(|(name, _)| name);
            let mut all = self.shown(drone, ReadParams::new(drone, names));
            all.extend(self.shown(drone, upload));
            all.extend(self.params(drone));
            lines.insert(drone, all);
        }
        Ok(lines)
    }
}

/// Targets one after another with the same velocity are told by the first of them.
fn told_once(lines: Vec<String>) -> Vec<String> {
    let velocity = |line: &str| {
        let (_, rest) = line.split_once("SET_POSITION_TARGET")?;
        let (_, rest) = rest.split_once("velocity ")?;
        Some(rest.to_owned())
    };
    let (mut told, mut last, mut more) = (Vec::new(), None, 0);
    let rest = |told: &mut Vec<String>, more: &mut usize| {
        if *more > 0 {
            told.push(format!("             and {more} more with this velocity, 10 a second"));
            *more = 0;
        }
    };
    for line in lines {
        let this = velocity(&line);
        if this.is_some() && this == last {
            more += 1;
            continue;
        }
        rest(&mut told, &mut more);
        last = this;
        told.push(line);
    }
    rest(&mut told, &mut more);
    told
}

fn start_lines(lead_s: f64) -> Vec<String> {
    let packet = |authorized| {
        format!("DATA16 start packet: the drones' GPS time + {lead_s:.0} s (by then), {authorized}")
    };
    vec![
        format!("once a second: {}", packet("not authorized")),
        format!("once authorized, until the start: {}", packet("authorized")),
    ]
}

/// The flights of a campaign that are meant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Of<'a> {
    pub(crate) campaign: &'a Path,
    /// Which, if the campaign has several.
    pub(crate) flight: Option<&'a str>,
}

impl Of<'_> {
    fn dry(self) -> Result<Dry, WorkflowError> {
        Dry::of(self.campaign, self.flight)
    }

    /// The flight's plan.
    pub(crate) fn plan(self) -> Result<Plan, WorkflowError> {
        one_flight(self.campaign, self.flight).map(|(_, plan)| plan)
    }
}

/// What a look at the fleet would send.
pub(crate) fn status(of: Of<'_>) -> Result<Lines, WorkflowError> {
    let dry = of.dry()?;
    Ok(dry.each(|drone| dry.shown(drone, Greet::new(drone))))
}

/// What the preflight table would send.
pub(crate) fn preflight(of: Of<'_>) -> Result<Lines, WorkflowError> {
    let dry = of.dry()?;
    Ok(dry.each(|drone| {
        let mut lines = dry.shown(drone, Greet::new(drone));
        lines.extend(dry.params(drone));
        lines
    }))
}

/// What an upload would send.
pub(crate) fn upload(host: &dyn Host, of: Of<'_>) -> Result<Lines, WorkflowError> {
    of.dry()?.upload(host)
}

/// What a start would send.
pub(crate) fn start(of: Of<'_>, lead_s: f64) -> Result<Lines, WorkflowError> {
    Ok(of.dry()?.each(|_| start_lines(lead_s)))
}

/// What a whole flight would send.
pub(crate) fn fly(host: &dyn Host, of: Of<'_>, lead_s: f64) -> Result<Lines, WorkflowError> {
    let mut lines = of.dry()?.upload(host)?;
    for all in lines.values_mut() {
        all.extend(start_lines(lead_s));
    }
    Ok(lines)
}

/// What a whole flight by streaming would send.
pub(crate) fn guided(host: &dyn Host, of: Of<'_>, lead_s: f64) -> Result<Lines, WorkflowError> {
    let dry = of.dry()?;
    let mut nobody = Nobody;
    let fence = Crew::new(host, &mut nobody, &dry.folder, &dry.plan).fence()?;
    let mode = |drone| Command::new("go into guided mode", set_mode(drone, GUIDED, 0));
    let required = requirements(&dry.plan, false);
    Ok(dry.each(|drone| {
        let mut lines = dry.shown(drone, PutFence::new(drone, fence.clone()));
        lines.extend(dry.shown(drone, mode(drone)));
        lines.extend(dry.shown(drone, CheckParams::new(drone, required.clone(), false)));
        lines.extend(dry.flown(drone, lead_s));
        lines
    }))
}

/// What putting parameters back would send.
pub(crate) fn restore(of: Of<'_>, fence_off: bool) -> Result<Lines, WorkflowError> {
    let dry = of.dry()?;
    let may = |_, change: &Change| fence_off || !change.unfences();
    let machines = Changes::read(&dry.folder.0)?.restore(may).into_iter();
    Ok(machines.map(|(drone, set)| (drone, dry.shown(drone, set))).collect())
}

/// What an abort would send.
pub(crate) fn end(of: Of<'_>, action: Action) -> Result<Lines, WorkflowError> {
    // As when it is done: any flight will do.
    let (folder, plan) = find(of.campaign, of.flight)?;
    let table = table(&folder.0, &plan)?;
    let dry = Dry { folder, plan, table };
    Ok(dry.each(|drone| {
        let slot = dry.table.slot_of(drone).and_then(|slot| dry.plan.slot(slot));
        let mut vehicle = Obliging::new(drone, true, place(&dry.plan, slot));
        vehicle.armed = true;
        vehicle.above_home_m = 20.0;
        dry_run(Abort::new(drone, action, None), &mut vehicle, MOST).0
    }))
}
