//! Opening of a flight's logs, and their assignment to slots.

use rayon::prelude::*;

use super::cause::Cause;
use super::input::{FlightInput, LogInput};
use super::matching::{self, Candidate, Held, Matched};
use crate::base::causes::with_causes;
use crate::base::plain::Shown as _;
use crate::flight::identify;
use crate::log::{Log, LogError};

/// Whose log it is.
pub(super) enum SlotMatch {
    /// A slot of the plan.
    Slot(u16),
    /// There is no plan.
    Unplanned,
    /// It is not used.
    Refused {
        /// Why.
        reason: Cause,
        /// The slot of the plan that the flight record or the file name mean.
        meant_for: Option<u16>,
    },
}

/// Finds the slot of each log, refuses copies, other places and a slot's second log; and says what
/// contradicts itself.
pub(super) fn match_slots(input: &FlightInput<'_>) -> (Vec<SlotMatch>, Vec<String>) {
    let unreadable = |log: &LogInput, error: &LogError| {
        let said = with_causes(error, ": ");
        Cause::of_log(&said, &log.path.shown().to_string(), &input.shown(&log.path))
    };
    if !input.logs.is_empty() && input.logs.iter().all(|log| log.at_hand.is_some()) {
        let slot = |log: &LogInput| log.slot.map_or(SlotMatch::Unplanned, SlotMatch::Slot);
        return (input.logs.iter().map(slot).collect(), Vec::new());
    }
    let opened: Vec<Result<Log, Cause>> = (input.logs.par_iter())
        .map(|log| Log::open(&log.path).map_err(|error| unreadable(log, &error)))
        .collect();
    let logs: Vec<Option<Held<'_>>> = opened
        .iter()
        .zip(input.logs)
        .map(|(opened, log)| match &log.table {
            Some(_) => Held::table(&log.path),
            None => opened.as_ref().ok().filter(|log| log.size_bytes() > 0).map(Held::Log),
        })
        .collect();
    let copies = matching::same_bytes(&logs);
    let Some(plan) = input.plan else {
        let refused = |first: usize, log: &LogInput| {
            let first =
                input.logs.get(first).map_or(log.path.as_path(), |first| first.path.as_path());
            let reason = if first == log.path {
                Cause::Refused("it is given twice, and used once".to_owned())
            } else {
                Cause::Copy { of: input.shown(first) }
            };
            SlotMatch::Refused { reason, meant_for: None }
        };
        let slots = copies.into_iter().zip(input.logs).map(|(copy, log)| match &log.refused {
            Some(reason) => {
                SlotMatch::Refused { reason: Cause::Refused(reason.clone()), meant_for: None }
            }
            None => copy.map_or(SlotMatch::Unplanned, |first| refused(first, log)),
        });
        return (slots.collect(), Vec::new());
    };
    // Each log is given back as soon as it was read: they are not in memory together.
    let candidates: Vec<Candidate> = (input.logs.par_iter())
        .zip(opened)
        .zip(&copies)
        .map(|((log, opened), copy)| {
            let identity = opened.as_ref().map(identify).unwrap_or_default();
            Candidate {
                name: input.shown(&log.path),
                given: log.slot,
                system_id: identity.system_id,
                file_number: matching::file_number(&log.path),
                home_deg: identity.home_deg,
                flew: identity.flew,
                same_as: *copy,
                unreadable: opened.err(),
                refused: log.refused.clone(),
            }
        })
        .collect();
    let Matched { slots, warnings } = matching::slots(plan, &candidates);
    let in_plan = |slot: &u16| plan.slot(*slot).is_some();
    let slots = slots.into_iter().zip(&candidates).map(|(slot, log)| match slot {
        Ok(slot) => SlotMatch::Slot(slot),
        Err(reason) => {
            let meant_for = log.given.filter(in_plan).or(log.file_number.filter(in_plan));
            SlotMatch::Refused { reason, meant_for }
        }
    });
    (slots.collect(), warnings)
}

/// Owner of each log: a slot of the plan, `None` without a plan, or the reason why the log is not
/// used. The second list has the contradictions between logs.
pub fn whose_logs(input: &FlightInput<'_>) -> (Vec<Result<Option<u16>, Cause>>, Vec<String>) {
    let (slots, warnings) = match_slots(input);
    let of = |slot| match slot {
        SlotMatch::Slot(slot) => Ok(Some(slot)),
        SlotMatch::Unplanned => Ok(None),
        SlotMatch::Refused { reason, .. } => Err(reason),
    };
    (slots.into_iter().map(of).collect(), warnings)
}
