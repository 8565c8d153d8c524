//! The largest doubts about an analysis, in words, the worst first.

use crate::analysis::LawKind;
use crate::analysis::Warning;
use crate::analysis::WindHandled;
use crate::analysis::result::{
    Analysis, CommonError, DroneUpdraft, FlightAnalysis, Quality, UpdraftMap,
};
use crate::report::doubts::LABEL;
use crate::report::page::capitalised;
use crate::report::text::{clean, count, fixed, sentence, shortened, usable};

/// Doubts that are told at the top; the others are counted.
const MOST: usize = 4;
/// True values inside 95 % intervals below which the intervals are called too narrow.
const LEAST_INSIDE: f64 = 0.85;

/// How bad a doubt is, and its words.
type Doubt = (u8, String);

/// The largest doubts about an analysis.
pub(super) fn distrust(analysis: &Analysis) -> Vec<String> {
    let several = analysis.flights.len() > 1;
    let mut doubts: Vec<Doubt> =
        analysis.warnings.iter().map(|warning| (0, sentence(&warning.to_string()))).collect();
    for flight in &analysis.flights {
        let name = format!("{}: ", capitalised(&clean(&flight.name)));
        let of = |(badness, words): Doubt| {
            // A caution about a scan begins so, and a flight may be called that.
            let is_named = !several || words.starts_with(&name);
            (badness, if is_named { words } else { format!("{name}{words}") })
        };
        doubts.extend(lost(flight).map(of));
        doubts.extend(damaged(flight).map(of));
        doubts.extend(flight.map.as_ref().and_then(left_early).map(of));
        doubts.extend(flight.warnings.iter().map(doubt).map(of));
        doubts.extend(flight.map.as_ref().and_then(largest_error).map(of));
        doubts.extend(flight.map.as_ref().and_then(too_narrow).map(of));
    }
    // Equals stay in the order of the flights.
    doubts.sort_by_key(|doubt| doubt.0);
    let left = doubts.len().saturating_sub(MOST);
    let mut said: Vec<String> = doubts.into_iter().take(MOST).map(|doubt| doubt.1).collect();
    if left > 0 {
        said.push(format!("{} more with the flights below.", count(left, "caution")));
    }
    said
}

/// Logs that are not whole.
fn damaged(flight: &FlightAnalysis) -> Option<Doubt> {
    let words = match flight.partly_used.len() {
        0 => return None,
        1 => "One log is damaged or ends in the air: what is left of it is used.".to_owned(),
        n => format!("{n} logs are damaged or end in the air: what is left of them is used."),
    };
    Some((2, words))
}

/// Drones without a result.
fn lost(flight: &FlightAnalysis) -> Option<Doubt> {
    let lost = flight.missing.len() + flight.unmeasured.len();
    let of = flight.missing.len() + flight.drones.len();
    if lost == 0 || of == 0 {
        return None;
    }
    let badness = if 2 * lost >= of { 0 } else { 5 };
    Some((badness, format!("{lost} of {} gave no result.", count(of, "drone"))))
}

/// Drones that were not there to the end.
fn left_early(map: &UpdraftMap) -> Option<Doubt> {
    let is_gone =
        |drone: &&DroneUpdraft| drone.quality.iter().any(|doubt| doubt.flag == Quality::Incomplete);
    let gone: Vec<&str> =
        map.drones.iter().filter(is_gone).map(|drone| drone.name.as_str()).collect();
    let first = shortened(gone.first()?, LABEL);
    let of = map.drones.len();
    Some((
        3,
        if gone.len() == 1 {
            format!("{first}, one of {of}, came down before the hover's end, or its log ends.")
        } else {
            format!(
                "{} of {of} drones came down, or their logs end, before the hover does.",
                gone.len()
            )
        },
    ))
}

type Part = fn(&CommonError) -> f64;

/// The largest part of the error that all drones share.
fn largest_error(map: &UpdraftMap) -> Option<Doubt> {
    let common = map.common.as_ref().filter(|common| usable(common.se_mps))?;
    let parts: [(Part, &str); 5] = [
        (
            |c| c.zero_mps,
            "the zero: the air may have risen or sunk slowly while the drones were calibrated",
        ),
        (
            |c| c.battery_mps,
            "the batteries: what their voltage does to the effort beyond its correction",
        ),
        (|c| c.wind_mps, "the wind: what it does to leaning drones beyond its correction"),
        (|c| c.density_mps, "the air's density: what it does to the effort beyond its correction"),
        (|c| c.law_mps, "the drones' laws: noise and turbulence while they were calibrated"),
    ];
    let known =
        parts.into_iter().map(|(of, words)| (of(common), words)).filter(|part| usable(part.0));
    let (size, words) = known.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|part| part.0 > 0.0)?;
    let beside = if map.posterior.as_ref().is_some_and(|posterior| posterior.fleet.is_some()) {
        " before drones and seconds are taken together"
    } else {
        ""
    };
    let does = if map.law == LawKind::SignedQuadratic {
        "By a law that is flat near hover it makes the air too weak or too strong, differences between drones and \
         their strength as well."
    } else {
        "It shifts the whole map alike; differences between drones are free of it."
    };
    Some((
        2,
        format!(
            "Most of what all drones share of the error ({} of {} m/s{beside}) is {words}. {does}",
            fixed(size, 2),
            fixed(common.se_mps, 2),
        ),
    ))
}

/// Intervals that the true air of a simulated flight leaves too often, or what an instrument read those for its place.
fn too_narrow(map: &UpdraftMap) -> Option<Doubt> {
    if let Some(held) = map.levelled.as_ref().and_then(|levelled| levelled.held_out.as_ref()) {
        // The air at an instrument is not that at the drone: its values are held against the bar for its place.
        let share = held.inside_share_there;
        return (share < LEAST_INSIDE).then(|| {
            (
                1,
                format!(
                    "The errors are too small here: only {} % of what the instrument read lies inside the 95 % intervals \
                     for its place, {} m away.",
                    fixed(100.0 * share, 0),
                    fixed(held.distance_m, 0)
                ),
            )
        });
    }
    let posterior = map.posterior.as_ref().and_then(|posterior| posterior.truth);
    let truth = posterior.or(map.truth).filter(|truth| truth.values > 0)?;
    let inside = truth.inside_share.filter(|share| usable(*share))?;
    (inside < LEAST_INSIDE).then(|| {
        (
            1,
            format!(
                "The errors are too small here: only {} % of the true values lie inside their 95 % intervals.",
                fixed(100.0 * inside, 0)
            ),
        )
    })
}

/// A warning as a doubt of the first page.
fn doubt(warning: &Warning) -> Doubt {
    let own = || sentence(&warning.to_string());
    match warning {
        Warning::WhoseLogs(_)
        | Warning::Failed(_)
        | Warning::LawsOfOthers { .. }
        | Warning::Steep { .. }
        | Warning::OtherResponse { .. } => (0, own()),
        Warning::NoLaw | Warning::NoFlock(_) | Warning::NoCalibration | Warning::NoLadder { .. } => (1, own()),
        Warning::FewWindows { .. } | Warning::FleetLadder { .. } | Warning::OtherStart { .. } => (2, own()),
        Warning::Wind { corrected, error_mps, .. } => (
            if *corrected == WindHandled::Not { 2 } else { 4 },
            match corrected {
                WindHandled::Not => format!(
                    "Nothing is corrected for wind: it may read as sinking air by up to {} m/s.",
                    fixed(*error_mps, 2)
                ),
                WindHandled::Physics | WindHandled::Drag => format!(
                    "Wind on the leaning drones is corrected for, but {} m/s may be left, of one sign for all.",
                    fixed(*error_mps, 2)
                ),
            },
        ),
        Warning::PartialLadders { .. } | Warning::Scan => (4, own()),
        Warning::Misfit { .. } => (
            6,
            "The paper's signed-quadratic law does not describe the calibration: read its line, not A, u₀ and W*."
                .to_owned(),
        ),
        Warning::Vertex { .. } => (
            6,
            "The W* of the fitted laws is the vertex of a parabola and no air speed.".to_owned(),
        ),
        Warning::LadderWind { axial_mps, .. } => (
            5,
            format!(
                "Wind while climbing and sinking may make up {} m/s of the laws' own W*.",
                fixed(*axial_mps, 2)
            ),
        ),
        Warning::TiltForm { .. } => (7, own()),
        _ => (3, own()),
    }
}
