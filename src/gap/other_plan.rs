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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Series;
    use crate::mission::resolve::{Override, resolve};

    fn plan(template: &str, overrides: &[Override]) -> Plan {
        let grid = [Override::new("grid.rows", 2), Override::new("grid.columns", 2)];
        let all = [&grid[..], overrides].concat();
        resolve(template, &all).unwrap().flights.remove(0).plan
    }

    /// A flight whose command at each show time, m/s, is this; `None`: the log has ended.
    fn told(plan: &Plan, up_mps: impl Fn(f64) -> Option<f64>) -> Flight {
        let end_s = plan.duration_ms as f64 / 1000.0;
        let times = (0..(10.0 * end_s) as usize).map(|tick| 0.1 * tick as f64);
        let (time_s, value) = times.filter_map(|time| Some((time, up_mps(time)?))).unzip();
        Flight { desired_up_mps: Some(Series { time_s, value }), ..Flight::default() }
    }

    fn as_planned(plan: &Plan, late_s: f64) -> Flight {
        let segments = &plan.groups[0].segments;
        told(plan, |time_s| Some(planned_up_mps(segments, time_s - late_s)))
    }

    #[test]
    fn another_ladder_is_another_plan() {
        let own = plan("calibration", &[]);
        let segments = &own.groups[0].segments;
        let is_other = |flight: &Flight| flew_instead(flight, segments).is_some();
        assert!(!is_other(&as_planned(&own, 0.0)));
        let hovers = plan("calibration", &[Override::new("hover_s", 15.0)]);
        assert!(is_other(&as_planned(&hovers, 0.0)), "rungs at other times");
        assert!(is_other(&as_planned(&plan("calibration-counterphase", &[]), 0.0)));
        assert!(is_other(&told(&own, |_| Some(0.0))), "a hover");
    }

    #[test]
    fn late_and_failed_drones_flew_the_plan() {
        let own = plan("calibration", &[]);
        let segments = &own.groups[0].segments;
        let is_other = |flight: &Flight| flew_instead(flight, segments).is_some();
        assert!(!is_other(&as_planned(&own, 1.5)), "a clock that is late");
        // Home after a fifth of the flight: up to the height of the return, and down in two parts.
        let gives_up_s = 0.2 * own.duration_ms as f64 / 1000.0;
        let home = |time_s: f64| match time_s - gives_up_s {
            since if since < 0.0 => Some(planned_up_mps(segments, time_s)),
            since if since < 12.0 => Some(2.5),
            since if since < 30.0 => Some(0.0),
            since if since < 60.0 => Some(-1.5),
            since if since < 80.0 => Some(-0.5),
            _ => None,
        };
        assert!(!is_other(&told(&own, home)));
        let is_cut = |time_s: f64| (time_s < gives_up_s).then(|| planned_up_mps(segments, time_s));
        assert!(!is_other(&told(&own, is_cut)), "the log is cut off");
        assert!(!is_other(&Flight::default()), "a log without commands");
    }

    #[test]
    fn half_of_the_logs_are_another_plan_and_fewer_are_left_out() {
        let own = plan("calibration", &[]);
        let other = plan("calibration", &[Override::new("hover_s", 15.0)]);
        let flights = [as_planned(&own, 0.0), as_planned(&other, 0.0)];
        let fleet = |which: [usize; 4]| {
            let flown: Vec<Flown<'_>> = which
                .iter()
                .zip(1..)
                .map(|(which, slot)| Flown { slot, flight: &flights[*which] })
                .collect();
            without_strangers(&own, &flown, None).map(|(own, left_out)| (own.len(), left_out))
        };
        assert_eq!(fleet([0, 0, 0, 0]).unwrap().0, 4);
        let (kept, left_out) = fleet([0, 1, 0, 0]).unwrap();
        assert_eq!((kept, left_out.len()), (3, 1));
        assert!(left_out[0].to_string().starts_with("slot 2: this log does not belong"));
        let said = fleet([0, 1, 0, 1]).unwrap_err().to_string();
        assert!(
            said.starts_with("2 of 4 logs do not follow the plan\n  slots 2 and 4: "),
            "{said}"
        );
        let flown = [Flown { slot: 1, flight: &flights[0] }];
        let simulated = [Flown { slot: 1, flight: &flights[1] }];
        let said = without_strangers(&own, &flown, Some(&simulated)).unwrap_err().to_string();
        assert!(said.starts_with("1 of 1 simulated logs do not follow the plan"), "{said}");
    }
}
