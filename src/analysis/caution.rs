//! Cautions that a reader needs before using a flight's numbers, in plain words.

use super::calibrate;
use super::options::AnalysisOptions;
use super::prefer::{misfit, vertex_caution};
use super::result::{DroneAnalysis, Fit, Laws, UpdraftMap, WindCorrection};
use super::stats::mean_sd;
use super::wind::{Leaning, axial_of};
use super::windows::Tilt;
use crate::base::estimate::Estimate;

/// A systematic error above this is worth a sentence, m/s. Chosen.
const WORTH_SAYING_MPS: f64 = 0.05;

/// A change of u0 below this reads as zero, us (or the indicator's unit).
const WORTH_SAYING_US: f64 = 0.05;

/// A law from fewer windows is warned about: two more than a line has parameters.
const FEWEST_WINDOWS: usize = 4;

/// About the laws of a calibration: the flock's, or its only drone's.
pub(super) fn fit_cautions(
    flock: Option<&Laws>,
    drones: &[DroneAnalysis],
    leaning: Option<Leaning>,
    true_updraft_mps: Option<f64>,
) -> Vec<String> {
    if drones.iter().all(|drone| drone.laws.is_none()) {
        return vec![
            "no law was fitted: no drone has a usable speed ladder (the reasons are listed)"
                .to_owned(),
        ];
    }
    let few = flock.and_then(|laws| laws.linear.as_ref()).map(|fit| fit.points);
    let few = few.filter(|points| *points < FEWEST_WINDOWS).map(|points| {
        format!(
            "the laws rest on {points} windows of vertical motion only: this is hardly a ladder, and \
             their errors are not known well, or not at all"
        )
    });
    let misfit = flock
        .and_then(misfit)
        .or_else(|| flock.and_then(|laws| vertex_caution(laws, drones, true_updraft_mps)));
    few.into_iter().chain(misfit).chain(lean_caution(drones, leaning)).collect()
}

/// About wind in a calibration: its W* is not only the air's.
fn lean_caution(drones: &[DroneAnalysis], leaning: Option<Leaning>) -> Option<String> {
    let tilts: Vec<f64> = drones
        .iter()
        .filter(|drone| drone.laws.is_some())
        .flat_map(|drone| &drone.windows)
        .filter(|window| window.kind.is_leg() && window.rejected.is_empty())
        .map(|window| window.lean_deg)
        .collect();
    let tilt = mean_sd(&tilts).0;
    let axial = axial_of(leaning, tilt);
    if axial <= WORTH_SAYING_MPS {
        return None;
    }
    let size = if leaning.is_some() { "about" } else { "up to" };
    Some(format!(
        "wind: the drones leaned {tilt:.1} degrees in the ladder. Wind along the rotor axis of a \
         leaning drone reads as sinking air: {size} {axial:.2} m/s of the fitted W* is that, and A \
         and u0 are off with it{}",
        if leaning.is_some() { " (the map is corrected for it, this table is not)" } else { "" }
    ))
}

/// About the two forms of the tilt correction, where they differ by more than the fleet's u0 is known.
pub(super) fn tilt_caution(drones: &[DroneAnalysis], options: &AnalysisOptions) -> Option<String> {
    let with_laws = || drones.iter().filter_map(|drone| Some((drone, drone.laws.as_ref()?)));
    let changes: Vec<f64> = with_laws()
        .flat_map(|(drone, _)| &drone.windows)
        .filter(|window| calibrate::is_used(window, &options.fit))
        .map(|window| window.tilt_form_us)
        .collect();
    let (change, _) = mean_sd(&changes);
    let fits: Vec<&Fit> = with_laws().filter_map(|(_, laws)| laws.linear.as_ref()).collect();
    let estimates = |index: usize| -> Vec<Estimate> {
        fits.iter().filter_map(|fit| Some(fit.parameters.get(index)?.estimate)).collect()
    };
    let mean = |values: Vec<f64>| mean_sd(&values).0;
    let slope = mean(estimates(0).iter().map(|estimate| estimate.value).collect());
    let error = mean(estimates(1).iter().map(|estimate| estimate.se).collect());
    if changes.is_empty()
        || change.abs() <= error.max(WORTH_SAYING_US)
        || slope.abs() < f64::EPSILON
    {
        return None;
    }
    let unit = options.indicator.unit();
    let (ours, other) = match options.windows.tilt {
        Tilt::Paper => ("the paper's u cos(phi)", "what the vertical part of the thrust takes"),
        Tilt::Thrust => ("what the vertical part of the thrust takes", "the paper's u cos(phi)"),
    };
    Some(format!(
        "tilt: pulses are corrected to {ours}. With {other} u0 would be {change:+.1} {unit}, which \
         is more than its error of {error:.1} {unit} and reads as {:+.2} m/s of updraft where a \
         hover leans alike",
        -change / slope
    ))
}

/// What a map that inverts the laws of the tables does not say.
pub(super) const PLAIN_CAUTION: &str = "errors: this map inverts the laws of the tables, as the \
    paper does. Its standard errors are those of the hover's windows and of the law's parameters: what \
    slow air during the calibration, battery and density shift for all drones alike has no error in \
    this method, and the truth may lie further off than is stated";

/// What a map of drones that moved does not say.
pub(super) const SCAN_CAUTION: &str = "scan: the drones moved, and each value is the mean of the air \
    over 10 s of the way. A difference along a track is one of place and of time; no statistics are \
    made of it";

/// About wind: the drones leaned, and that is corrected for or not.
pub(super) fn wind_caution(map: &UpdraftMap) -> Option<String> {
    let errors: Vec<f64> = map.drones.iter().map(|drone| drone.systematic_mps).collect();
    let error = mean_sd(&errors).0;
    if error <= WORTH_SAYING_MPS {
        return None;
    }
    let tilts: Vec<f64> = map.drones.iter().map(|drone| drone.tilt_deg).collect();
    let tilt = mean_sd(&tilts).0;
    let when = if map.is_scan() { "on their legs" } else { "in the hover" };
    Some(if map.wind == Some(WindCorrection::Physics) {
        format!(
            "wind: the drones leaned {tilt:.1} degrees {when}. What their airspeed does to the pulse \
             (drag, flow along the rotor axis, translational lift) is corrected by their lean, with \
             the physics of their vehicle's file; what is left may be {error:.2} m/s, of the same \
             sign for all drones (stated as the systematic error)"
        )
    } else if map.wind == Some(WindCorrection::Drag) {
        format!(
            "wind: the drones leaned {tilt:.1} degrees {when}. What wind does to a leaning \
             drone is corrected with the drag of the simulated vehicle; what is left may be \
             {error:.2} m/s, of the same sign for all drones (stated as the systematic error)"
        )
    } else {
        format!(
            "wind: the drones leaned {tilt:.1} degrees {when}. Wind along the rotor axis of a \
             leaning drone reads as sinking air, and the lift that rotors gain in wind as rising \
             air. Without the drag and the rotors of these drones known nothing is corrected: the \
             map may be off by up to {error:.2} m/s by the first alone, in the same direction for \
             all drones (stated as the systematic error). Fly in still air where that matters"
        )
    })
}
