//! Flights of virtual drones: over MAVLink, like those of real ones.

use super::bring::{Brought, Wish, bring};
use super::crew::Crew;
use super::hangar::{Hangar, Mishaps, TO_START};
use super::output::{FlightEnd, FlightOutput, LogOutput};
use super::preflight::PreflightOutput;
use super::start::{Lead, asked, say_landed};
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::campaign::origin::LogOrigin;
use crate::fleet::preflight::Preflight;
use crate::fleet::start::StartOptions;
use crate::link::station::Station;
use crate::mission::Plan;
use crate::virtual_fleet::lossy::Faults;
use crate::virtual_fleet::server::Pace;
use crate::virtual_fleet::vehicle::BootTimes;
use crate::workflow::clock::Stopwatch;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::simulate::{Flown, Ready, Simulation, make_ready, settle};

/// Virtual drones on the ground live so many times as fast as the clock on the wall.
const GROUND_PACE: f64 = 20.0;

/// Flies a flight with virtual drones, over MAVLink like real ones, and brings their logs home. The
/// logs are those of [`simulate`](crate::workflow::simulate::simulate), to the byte.
///
/// # Errors
/// When the flight's files cannot be read or written, the drones cannot be reached, or the work is
/// stopped.
pub fn fly_virtual(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
) -> Result<Flown, WorkflowError> {
    rehearse(host, folder, plan, simulation, None).map(|(flown, _)| flown)
}

/// Flies a flight as [`fly_virtual`] does, and returns the outcome of each drone and log as well. With
/// `rehearsed` people practise: they are shown and asked all that they are in the field.
pub(crate) fn rehearse(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
    rehearsed: Option<&Lead>,
) -> Result<(Flown, FlightOutput), WorkflowError> {
    let watch = Stopwatch::start(host);
    let ready = make_ready(host, folder, plan, simulation)?;
    let mut output = FlightOutput {
        flight: plan.name.clone(),
        outcome: FlightEnd::Flown,
        preflight: None,
        drones: Vec::new(),
        logs: ready.wanted.iter().map(|slot| LogOutput::there(slot.slot)).collect(),
    };
    let mut failed = Vec::new();
    if !ready.open.is_empty() {
        let (flown, brought) = launch(host, folder, plan, simulation, &ready, rehearsed)?;
        output.preflight = flown.preflight;
        failed.extend(brought.iter().filter_map(Brought::loss));
        output.drones = flown.drones;
        for one in &brought {
            output.logs.retain(|log| log.slot != one.slot);
            output.logs.push(LogOutput::from(one));
        }
        output.logs.sort_by_key(|log| log.slot);
    }
    Ok((settle(host, folder, plan, ready, failed, &watch)?, output))
}

/// A crew for virtual drones of this program, once they are heard.
fn virtual_crew<'a>(
    host: &'a dyn Host,
    station: &'a mut Station,
    folder: &'a FlightFolder,
    plan: &'a Plan,
) -> Result<Crew<'a>, WorkflowError> {
    let mut crew = Crew::new(host, station, folder, plan);
    crew.is_virtual = true;
    crew.listen(60.0)?;
    crew.greet()?;
    Ok(crew)
}

/// Everything before the start; virtual drones have no reason to refuse.
fn make_start_ready(crew: &mut Crew<'_>) -> Result<Preflight, WorkflowError> {
    let no_go =
        |what: &str| WorkflowError::Failed(format!("the virtual drones did not start: {what}"));
    if !crew.assign(true)? {
        return Err(no_go("they do not stand as planned"));
    }
    let refused = crew.upload()?;
    crew.params(true)?;
    let table = crew.preflight(20.0)?;
    if !refused.is_empty() || !table.go() {
        return Err(no_go(&format!("\n{table}")));
    }
    Ok(table)
}

fn launch(
    host: &dyn Host,
    folder: &FlightFolder,
    plan: &Plan,
    simulation: &Simulation,
    ready: &Ready<'_>,
    rehearsed: Option<&Lead>,
) -> Result<(FlightOutput, Vec<Brought>), WorkflowError> {
    let start = ready.record.start;
    let switched_on = GpsTime::from_total_ms(start.total_ms() - (TO_START / 1000) as i64)
        .ok_or_else(|| WorkflowError::Failed("the start time is not a GPS time".to_owned()))?;
    let hangar = Hangar {
        plan,
        slots: ready.open.clone(),
        vehicle: &ready.vehicle,
        air: &ready.air,
        seed: simulation.seed,
        full_logs: simulation.full_logs,
        boots_by_seed: true,
        switched_on,
        pace: Pace::Fast { ground: GROUND_PACE },
        faults: Faults::default(),
        boot: BootTimes::short(),
        mishaps: Mishaps::default(),
        key: None,
    };
    // A part of the fleet is a fleet of its own.
    let mut part = plan.clone();
    part.slots.retain(|slot| ready.open.iter().any(|open| open.slot == slot.slot));
    let mut found = None;
    if let Some(lead) = rehearsed {
        host.say(&format!("Practice of {} with virtual drones: as in the field", plan.name));
        // While a person thinks, time goes on for drones on the ground, and the start that is the same
        // every time would pass: they are switched on again for the flight.
        found = hangar.open(host.clock(), |station| {
            let mut crew = virtual_crew(host, station, folder, &part)?;
            let table = make_start_ready(&mut crew)?;
            host.show(&table.to_string()).map_err(WorkflowError::Output)?;
            if !lead.yes && !asked(host, "Authorize the start? Type yes: ", || crew.idle())? {
                return Err(WorkflowError::Unsafe("not authorized: no drone takes off".to_owned()));
            }
            Ok(Some(PreflightOutput::of(&table)))
        })?;
    }
    hangar.open(host.clock(), |station| {
        let mut crew = virtual_crew(host, station, folder, &part)?;
        crew.tells_all = rehearsed.is_some();
        make_start_ready(&mut crew)?;
        let options = StartOptions { at: Some(start), ..StartOptions::default() };
        let mut start = crew.announce(options)?;
        crew.authorize(&mut start)?;
        let alarms = crew.watch(&mut start)?;
        if rehearsed.is_some() {
            say_landed(host, &crew);
        }
        let flown = FlightOutput::flown(&crew, &alarms, found);
        // Virtual drones fly again at any time.
        let wish = Wish {
            quiet: true,
            is_durable: false,
            origin: LogOrigin::Simulated,
            ..Wish::default()
        };
        Ok((flown, bring(host, &mut crew.net, folder, plan, &crew.table, &wish)?))
    })
}
