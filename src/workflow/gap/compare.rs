//! Reading of logs and their comparison with the model.

use std::path::Path;

use super::logs::{self, Read};
use crate::flight::{Flight, Indicator};
use crate::gap::{
    Explained, Flown, Input, LeftOut, Measured, Options, aloft, as_pulses, explain, lossless,
    map_gain,
};
use crate::vehicle::Vehicle;
use crate::workflow::error::WorkflowError;
use crate::workflow::find::Found;
use crate::workflow::words;

/// The flights of a comparison.
pub(super) struct Both<'a> {
    /// The flight that was measured.
    pub(super) measured: &'a Found,
    /// The flight as another program simulated it.
    pub(super) simulated: Option<&'a Found>,
    /// A measurement flight whose true air is known.
    pub(super) hover: Option<&'a Found>,
}

/// Reads the logs and compares.
pub(super) fn compare(
    both: &Both<'_>,
    vehicle: &Vehicle,
    options: &Options,
) -> Result<Explained, WorkflowError> {
    let Both { measured: found, simulated, hover } = *both;
    let mut read = logs::read(found, Path::new(""));
    let mapping = found.logs.iter().find_map(|log| log.table.clone());
    let has_speeds = |(_, flight): &(u16, Flight)| flight.effort.indicator == Indicator::RotorSpeed;
    let by_speed = read.flights.iter().any(has_speeds);
    let planned = vehicle;
    let lossless = lossless(planned);
    let vehicle = if by_speed { &lossless } else { planned };
    for (_, flight) in &mut read.flights {
        if mapping.is_some() {
            *flight = aloft(flight);
        }
        if by_speed {
            *flight = as_pulses(flight, vehicle);
        }
    }
    let others = simulated.map(|simulated| logs::read(simulated, Path::new("")));
    let left_out = left_out(&read, others.as_ref());
    if read.flights.is_empty() {
        return Err(unusable(&words::count(found.logs.len(), "log"), &left_out));
    }
    if let (Some(simulated), Some(others)) = (simulated, &others)
        && others.flights.is_empty()
    {
        let logs = words::count(simulated.logs.len(), "simulated log");
        return Err(unusable(&logs, &others.left_out));
    }
    let flown = flown(&read);
    let other = others.as_ref().map(self::flown);
    let input = Input {
        vehicle,
        plan: found.plan.as_ref(),
        flown: &flown,
        simulated: other.as_deref(),
        table: mapping.as_ref().map(|mapping| &mapping.steps),
        logs: found.logs.len(),
        left_out,
    };
    let mut explained = explain(&input, options)?;
    explained.model.airframe.rotor = planned.airframe.rotor;
    if let Some((hover, plan)) = hover.and_then(|hover| Some((hover, hover.plan.as_ref()?))) {
        let read = logs::read(hover, Path::new(""));
        let flown = self::flown(&read);
        let measured = Measured { name: &hover.name, plan, flown: &flown, truth: &hover.truth };
        explained.verdict.map = map_gain(&input, &explained, &measured)?;
    }
    Ok(explained)
}

/// Flights as the comparison takes them.
pub(super) fn flown(read: &Read) -> Vec<Flown<'_>> {
    read.flights.iter().map(|(slot, flight)| Flown { slot: *slot, flight }).collect()
}

/// Why logs are not used, or not all of them.
fn left_out(read: &Read, others: Option<&Read>) -> Vec<LeftOut> {
    let mut left_out = read.left_out.clone();
    left_out.extend(read.in_part.iter().map(|lost| format!("{lost} (the rest is used)").into()));
    left_out.extend(others.iter().flat_map(|others| others.left_out.clone()));
    left_out
}

fn unusable(logs: &str, reasons: &[LeftOut]) -> WorkflowError {
    let reasons: Vec<String> = reasons.iter().map(ToString::to_string).collect();
    WorkflowError::Nothing(format!("none of the {logs} can be used:\n  {}", reasons.join("\n  ")))
}
