//! Losses of an analysis, as lines for those who do not see the tables.

use std::fmt::Write as _;

use crate::analysis::Cause;
use crate::analysis::result::{Analysis, FlightAnalysis, Unmeasured};
use crate::analysis::together::{Remark, together};
use crate::base::sentence::Sentence;
use crate::mission::plan::Purpose;
use crate::workflow::error::{BECAUSE, WorkflowError};

/// Reasons that an error lists.
const LISTED: usize = 12;

/// Everything that is lost: one line each, with the flight's name. `cautions`: also what must be known
/// before numbers are used.
pub(crate) fn problems(analysis: &Analysis, cautions: bool) -> Vec<String> {
    let of_flight = |flight: &FlightAnalysis| {
        let name = flight.name.clone();
        let lost = lost(flight);
        lost.into_iter()
            .chain(flight.warnings.iter().filter(|_| cautions).map(ToString::to_string))
            .map(move |problem| format!("{name}: {problem}"))
            .collect::<Vec<_>>()
    };
    let flights = analysis.flights.iter().flat_map(of_flight);
    analysis.warnings.iter().map(ToString::to_string).chain(flights).collect()
}

/// Refuses a mixed layer that drones fly above.
pub(super) fn refuse_depth(analysis: &Analysis, depth_m: Option<f64>) -> Result<(), WorkflowError> {
    let Some(depth_m) = depth_m else { return Ok(()) };
    let known = |flight: &&FlightAnalysis| flight.turbulence.is_some();
    for flight in analysis.flights.iter().filter(known) {
        let drones = flight.map.iter().flat_map(|map| &map.drones);
        let highest_m = drones.map(|drone| drone.height_m).fold(f64::NEG_INFINITY, f64::max);
        if highest_m >= depth_m {
            return Err(WorkflowError::Usage(format!(
                "--mixed-layer-depth {depth_m}: the drones of {} were {highest_m:.0} m above the ground, and the mixed layer \
                 must reach above them; give its depth zi, from the ground to the inversion",
                crate::base::plain::plain(&flight.name)
            )));
        }
    }
    Ok(())
}

/// Refuses a zero that no hover has, or a level that nothing gives: they were asked for.
///
/// # Errors
///
/// With what to give instead.
pub(crate) fn refuse_level(analysis: &Analysis) -> Result<(), WorkflowError> {
    let measures = || analysis.flights.iter().filter(|one| one.purpose == Purpose::Measurement);
    if measures().any(|flight| flight.results() > 0) {
        return Ok(());
    }
    let asked = |cause: &Cause| {
        matches!(cause, Cause::ZeroOutside { .. } | Cause::NoResponse | Cause::NoLevel)
    };
    let refused = measures().flat_map(|flight| &flight.unmeasured).find(|one| asked(&one.reason));
    refused.map_or(Ok(()), |one| Err(WorkflowError::Usage(format!("{}: {}", one.name, one.reason))))
}

/// Drones and logs of a flight that gave nothing, or not everything.
fn lost(flight: &FlightAnalysis) -> Vec<String> {
    let who = |drone: &Unmeasured| match drone.slot {
        Some(slot) => format!("slot {slot}"),
        None => drone.name.clone(),
    };
    let missing = flight.missing.iter().map(|one| Remark {
        slot: Some(one.slot),
        name: format!("slot {}", one.slot),
        said: one.reason.sentence(),
    });
    // A missing drone's reason is that of its log.
    let told = |slot: Option<u16>| flight.missing.iter().any(|one| Some(one.slot) == slot);
    let unused = flight.unused.iter().filter(|log| !told(log.slot));
    let unused = unused.map(|log| Remark {
        slot: log.slot,
        name: "not used".to_owned(),
        said: log.sentence(),
    });
    let partly = flight.partly_used.iter().map(|log| Remark {
        slot: log.slot,
        name: log.source.clone(),
        said: log.reason.sentence(),
    });
    let what = match flight.purpose {
        Purpose::Calibration => "no law",
        Purpose::Measurement => "no value in the map",
    };
    let unmeasured = flight.unmeasured.iter().map(|one| Remark {
        slot: one.slot,
        name: who(one),
        said: Sentence::from(format!("{what}: ")).then(one.reason.sentence()),
    });
    let partial = flight.drones.iter().filter_map(|drone| {
        drone.partial_ladder.map(|partial| Remark {
            slot: drone.slot,
            name: drone.slot.map_or_else(|| drone.name.clone(), |slot| format!("slot {slot}")),
            said: Sentence::from("partial ladder (")
                .then(partial.sentence())
                .words("): not in the fleet's numbers"),
        })
    });
    together(missing.chain(unused).chain(partly).chain(unmeasured).chain(partial))
}

/// The error of an analysis without one law and one value, with what to do. `reasons`: also why, for
/// those who do not see the tables.
pub(crate) fn nothing_found(analysis: &Analysis, reasons: bool) -> WorkflowError {
    let has = |purpose| analysis.flights.iter().any(|flight| flight.purpose == purpose);
    let remedy = match (has(Purpose::Calibration), has(Purpose::Measurement)) {
        // A flight that failed is a warning of the whole.
        (false, _) if analysis.warnings.is_empty() => {
            "a map of the air needs laws: analyse the calibration flight together with this one \
             (updraft analyze CALIBRATION HOVER), or use the laws of another analysis of these \
             drones (--hold analysis.json)"
        }
        (false, _) => {
            "the calibration cannot be used: correct the problems named, or use the laws of \
             another analysis of these drones (--hold analysis.json)"
        }
        (true, true) => {
            "neither the calibration nor the measurement can be used: correct the problems \
             named, or download the logs again (updraft logs pull)"
        }
        (true, false) => {
            "the calibration cannot be used: correct the problems named, download the logs again \
             (updraft logs pull), or give the plan that they flew (--plan)"
        }
    };
    let mut text = format!("no results: no law and no value of the air; {remedy}");
    if reasons {
        let problems = problems(analysis, true);
        for problem in problems.iter().take(LISTED) {
            text.push_str(BECAUSE);
            text.push_str(problem);
        }
        if problems.len() > LISTED {
            let _ = write!(text, "{BECAUSE}and {} more", problems.len() - LISTED);
        }
    }
    WorkflowError::Nothing(text)
}
