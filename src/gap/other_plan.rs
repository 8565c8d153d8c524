//! Logs of another plan than the one they are compared by.
//!
//! In the bins of a plan that was not flown hardly anything is steady, and what is says nothing of the model. One log that
//! contradicts its plan is a drone that failed, or a log in the wrong folder: it is left out. Half of them are another
//! plan.

use super::data::Flown;
use super::error::GapError;
use super::left_out::LeftOut;
use crate::analysis::Cause;
use crate::analysis::windows::{Target, contradiction, inferred, planned};
use crate::flight::{Flight, planned_up_mps};
use crate::mission::plan::{Plan, Segment};

/// A log flew a ladder of its own with this many legs that the plan has not. A drone that goes home climbs to the height of
/// the return, and descends from it in two parts: three legs.
const FEWEST_LEGS: usize = 4;
/// A log that stood still, or in its air, in this many legs of the plan and flew none of them flew no ladder. Chosen: a
/// drone that gives up has flown some, or its log ends.
const FEWEST_MISSED: usize = 4;
/// A command further than this from the plan's is another, m/s: rungs are 0.5 m/s apart.
const WRONG_MPS: f64 = 0.3;

/// What a log flew instead of what its slot was to fly; `None`: it flew that, or so much of it as it could.
pub(super) fn flew_instead(flight: &Flight, segments: &[Segment]) -> Option<Cause> {
    // Without commands only its velocity would tell, and that may be what is off.
    flight.desired_up_mps.as_ref()?;
    let cause = contradiction(flight, &planned(segments))?;
    let is_none_flown = match &cause {
        Cause::OtherSpeeds { wrong_of: [wrong, of], .. } => wrong == of && *of >= FEWEST_MISSED,
        _ => false,
    };
    let own = inferred(flight);
    let is_not_planned = |leg: &&Target| {
        let middle_s = f64::midpoint(leg.start_s, leg.end_s);
        leg.kind.is_leg()
            && (leg.commanded_mps - planned_up_mps(segments, middle_s)).abs() > WRONG_MPS
    };
    let legs = own.iter().filter(is_not_planned).count();
    (is_none_flown || legs >= FEWEST_LEGS).then_some(cause)
}

/// Logs of drones that flew another plan are left out, if they are few.
///
/// # Errors
/// Half of the logs did not follow the plan, or half of the other simulation's.
pub(super) fn without_strangers<'a>(
    plan: &Plan,
    flown: &[Flown<'a>],
    simulated: Option<&[Flown<'_>]>,
) -> Result<(Vec<Flown<'a>>, Vec<LeftOut>), GapError> {
    let mut own = Vec::new();
    let mut reasons = Vec::new();
    for one in flown {
        let segments = plan.slot(one.slot).map(|slot| plan.segments(slot));
        match segments.and_then(|segments| flew_instead(one.flight, segments)) {
            Some(cause) => {
                let said = format!("slot {}: {}", one.slot, cause.sentence());
                reasons.push(LeftOut::from(said));
            }
            None => own.push(Flown { slot: one.slot, flight: one.flight }),
        }
    }
    refuse("logs", &reasons, flown.len())?;
    // Which slot a simulated drone flew is not known: it need follow one of the groups.
    let of_simulated = |one: &Flown<'_>| {
        let mut causes = plan.groups.iter().map(|group| flew_instead(one.flight, &group.segments));
        let first = causes.next()??;
        let said = format!("simulated log {}: {}", one.slot, first.sentence());
        causes.all(|cause| cause.is_some()).then(|| LeftOut::from(said))
    };
    let simulated = simulated.unwrap_or_default();
    let strangers: Vec<LeftOut> = simulated.iter().filter_map(of_simulated).collect();
    refuse("simulated logs", &strangers, simulated.len())?;
    reasons.extend(strangers);
    Ok((own, reasons))
}

fn refuse(whose: &'static str, reasons: &[LeftOut], of: usize) -> Result<(), GapError> {
    if reasons.is_empty() || 2 * reasons.len() < of {
        return Ok(());
    }
    Err(GapError::OtherPlan { whose, wrong: reasons.len(), of, reasons: reasons.to_vec() })
}
