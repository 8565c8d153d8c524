//! Logs of a comparison: their drones, and the flights in them.

use std::path::Path;

use rayon::prelude::*;

use crate::analysis::slots::whose_logs;
use crate::analysis::together::{Remark, together};
use crate::analysis::{Cause, FlightInput};
use crate::base::causes::with_causes;
use crate::base::plain::Shown as _;
use crate::flight::{Flight, FlightOptions, Indicator, table};
use crate::gap::LeftOut;
use crate::workflow::find::Found;

/// Logs that were read, and why the others were not.
#[derive(Debug, Default)]
pub(crate) struct Read {
    /// Slot (a running number without a plan) and flight.
    pub(crate) flights: Vec<(u16, Flight)>,
    /// Each other log with its reason.
    pub(crate) left_out: Vec<LeftOut>,
    /// What is lost of logs that were read all the same.
    pub(crate) in_part: Vec<String>,
}

/// A log that could be read.
struct Opened {
    slot: u16,
    flight: Flight,
    /// What is lost of it.
    lost: Option<Remark>,
}

/// Reads all logs of a flight; a log that cannot be used stops none of the others.
pub(crate) fn read(found: &Found, root: &Path) -> Read {
    if found.logs.iter().any(|log| log.table.is_some()) {
        return tables(found);
    }
    let input = FlightInput {
        name: &found.name,
        plan: found.plan.as_ref(),
        logs: &found.logs,
        start: found.start,
        folder: Some(root),
        ..FlightInput::default()
    };
    let (whose, warnings) = whose_logs(&input);
    let opened: Vec<Result<Opened, String>> = found
        .logs
        .par_iter()
        .zip(whose)
        .enumerate()
        .map(|(index, (log, slot))| {
            let shown = log.path.strip_prefix(root).unwrap_or(&log.path).shown().to_string();
            let slot = slot.map_err(|reason| format!("{shown}: {reason}"))?;
            let plan = found.plan.as_ref();
            let planned = plan.zip(slot).and_then(|(plan, slot)| Some((plan, plan.slot(slot)?)));
            let options = FlightOptions {
                start: found.start,
                segments: planned.map(|(plan, slot)| plan.segments(slot)),
                ..FlightOptions::default()
            };
            let flight =
                Flight::open(&log.path, options).map_err(|error| with_causes(&error, ": "))?;
            let number = u16::try_from(index + 1).unwrap_or(u16::MAX);
            let lost = flight.losses();
            let lost = (!lost.is_empty()).then(|| Remark {
                slot,
                name: shown.clone(),
                said: Cause::InPart(lost).sentence(),
            });
            Ok(Opened { slot: slot.unwrap_or(number), flight, lost })
        })
        .collect();
    let left_out = warnings.into_iter().map(LeftOut::Said).collect();
    let mut read = Read { left_out, ..Read::default() };
    let mut in_part = Vec::new();
    for one in opened {
        match one {
            Ok(opened) => {
                read.flights.push((opened.slot, opened.flight));
                in_part.extend(opened.lost);
            }
            Err(reason) => read.left_out.push(reason.into()),
        }
    }
    read.in_part = together(in_part);
    read.flights.sort_by_key(|(slot, _)| *slot);
    read
}

/// Reads the tables of a flight, numbered in their order.
fn tables(found: &Found) -> Read {
    let mut read = Read::default();
    for (index, log) in found.logs.iter().enumerate() {
        let Some(mapping) = &log.table else { continue };
        let number = u16::try_from(index + 1).unwrap_or(u16::MAX);
        let shown = log.path.shown();
        match table::read(&log.path, mapping) {
            Ok(flight) if flight.effort.indicator == Indicator::Power => read.left_out.push(
                format!("{shown}: electrical power is not a pulse; give pulses or rotor speeds")
                    .into(),
            ),
            Ok(flight) => read.flights.push((number, flight)),
            Err(error) => {
                read.left_out.push(format!("{shown}: {}", with_causes(&error, ": ")).into());
            }
        }
    }
    read
}
