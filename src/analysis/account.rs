//! Account of every log and of every drone of the plan: used, used in part, unused or missing.

use std::collections::BTreeMap;

use super::cause::Cause;
use super::drone::One;
use super::input::{FlightInput, LogInput};
use super::result::{DroneAnalysis, Missing, PartlyUsedLog, UnusedLog};
use super::slots::SlotMatch;

/// The logs of a flight, sorted by their use.
#[derive(Default)]
pub(super) struct Account {
    pub(super) ones: Vec<One>,
    pub(super) unused: Vec<UnusedLog>,
    pub(super) partly_used: Vec<PartlyUsedLog>,
}

impl Account {
    /// Sorts what the logs gave.
    pub(super) fn of<'a>(
        input: &FlightInput<'_>,
        outcomes: impl Iterator<Item = (&'a LogInput, &'a SlotMatch, Result<One, Cause>)>,
    ) -> Self {
        let mut account = Self::default();
        for (log, found, outcome) in outcomes {
            let source = input.shown(&log.path);
            match outcome {
                Ok(one) => {
                    account.partly_used.extend(partly_used(&one, source));
                    account.ones.push(one);
                }
                Err(reason) => {
                    let slot = match found {
                        SlotMatch::Slot(slot) => Some(*slot),
                        SlotMatch::Unplanned => None,
                        SlotMatch::Refused { meant_for, .. } => *meant_for,
                    };
                    account.unused.push(UnusedLog { source, slot, reason });
                }
            }
        }
        account
    }
}

fn partly_used(one: &One, source: String) -> Option<PartlyUsedLog> {
    (!one.losses.is_empty()).then(|| PartlyUsedLog {
        source,
        slot: one.drone.slot,
        reason: Cause::InPart(one.losses.clone()),
        skipped_bytes: one.skipped_bytes,
    })
}

/// Slots of the plan without an analysed log: what became of the log that is theirs by match, record
/// or file name, or that there is none.
pub(super) fn missing(
    input: &FlightInput<'_>,
    drones: &[DroneAnalysis],
    unused: &[UnusedLog],
) -> Vec<Missing> {
    let Some(plan) = input.plan else { return Vec::new() };
    let flown: Vec<u16> = drones.iter().filter_map(|drone| drone.slot).collect();
    let mut logs: BTreeMap<u16, Vec<&UnusedLog>> = BTreeMap::new();
    for log in unused {
        if let Some(slot) = log.slot {
            logs.entry(slot).or_default().push(log);
        }
    }
    let reason = |slot: u16, name: &str| {
        let of_slot = logs.get(&slot).map(Vec::as_slice).unwrap_or_default();
        match of_slot {
            [] => Cause::NoLog { name: name.to_owned() },
            logs => {
                let named = logs.iter().map(|log| (log.source.clone(), log.reason.clone()));
                Cause::LogsNotUsed(named.collect())
            }
        }
    };
    (plan.slots.iter())
        .filter(|slot| !flown.contains(&slot.slot))
        .map(|slot| Missing {
            slot: slot.slot,
            home_m: Some([slot.home_m[0], slot.home_m[1]]),
            reason: reason(slot.slot, &slot.name),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::calibrate::{FitOptions, calibrate};
    use super::super::map_statistics::HoverSeen;
    use super::super::result::Trace;
    use super::*;
    use crate::flight::{Clock, Loss};

    fn one(losses: Vec<Loss>) -> One {
        let drone = DroneAnalysis {
            slot: Some(1),
            name: String::new(),
            source: String::new(),
            home_m: None,
            clock: Clock::default(),
            windows: Vec::new(),
            laws: None,
            line: None,
            offset: None,
            partial_ladder: None,
            trace: Trace::default(),
            warnings: Vec::new(),
        };
        One {
            drone,
            losses,
            skipped_bytes: 12,
            calibration: Err(calibrate(&[], &FitOptions::default()).unwrap_err()),
            updraft: None,
            hover: HoverSeen::default(),
            first_fix_deg: None,
            truth: None,
        }
    }

    #[test]
    fn a_log_is_used_in_part_if_something_of_it_is_lost() {
        let partly_used = |losses: Vec<Loss>| {
            let log = LogInput { path: PathBuf::from("1.BIN"), ..LogInput::default() };
            let outcome = [(&log, &SlotMatch::Slot(1), Ok(one(losses)))];
            let account = Account::of(&FlightInput::default(), outcome.into_iter());
            assert_eq!((account.ones.len(), account.unused.len()), (1, 0));
            account.partly_used
        };
        assert_eq!(partly_used(Vec::new()), []);
        let lost = partly_used(vec![Loss::CutOff { height_m: 20.0 }]);
        let [PartlyUsedLog { source, slot: Some(1), skipped_bytes: 12, .. }] = &lost[..] else {
            panic!("{lost:?}")
        };
        assert_eq!(source, "1.BIN");
    }
}
