//! Opens the logs of a flight and finds out whose they are.

use rayon::prelude::*;

use super::analyze::FlightInput;
use super::matching::{self, Candidate, Matched};
use crate::base::causes::with_causes;
use crate::flight::identify;
use crate::log::Log;

/// Whose log it is.
pub(super) enum SlotMatch {
    /// A slot of the plan.
    Slot(u16),
    /// There is no plan.
    Unplanned,
    /// Nobody's, and why.
    Refused(String),
}

/// Finds the slot of each log, refuses copies, other places and a slot's second log; and says what
/// contradicts itself.
pub(super) fn match_slots(input: &FlightInput<'_>) -> (Vec<SlotMatch>, Vec<String>) {
    let opened: Vec<Result<Log, String>> = (input.logs.par_iter())
        .map(|log| Log::open(&log.path).map_err(|error| with_causes(&error, ": ")))
        .collect();
    let bytes: Vec<Option<&[u8]>> = opened
        .iter()
        .map(|log| log.as_ref().ok().map(Log::bytes).filter(|bytes| !bytes.is_empty()))
        .collect();
    let copies = matching::same_bytes(&bytes);
    let Some(plan) = input.plan else {
        let refused = |first: usize| {
            let first = input.logs.get(first).map(|log| input.shown(&log.path));
            SlotMatch::Refused(matching::copy_of(&first.unwrap_or_default()))
        };
        let slots = copies.into_iter().map(|copy| copy.map_or(SlotMatch::Unplanned, refused));
        return (slots.collect(), Vec::new());
    };
    let candidates: Vec<Candidate> = (input.logs.par_iter())
        .zip(&opened)
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
                unreadable: opened.as_ref().err().cloned(),
            }
        })
        .collect();
    let Matched { slots, warnings } = matching::slots(plan, &candidates);
    let slots = slots.into_iter().map(|slot| slot.map_or_else(SlotMatch::Refused, SlotMatch::Slot));
    (slots.collect(), warnings)
}
