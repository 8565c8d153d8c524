//! Warnings that a reader needs before using a flight's numbers.

use super::calibrate;
use super::options::AnalysisOptions;
use super::prefer::{misfit, vertex_caution};
use super::result::{DroneAnalysis, Fit, Laws, UpdraftMap, WindCorrection};
use super::stats::mean_sd;
use super::warning::{Warning, WindHandled};
use super::wind::{Leaning, axial_of};
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
) -> Vec<Warning> {
    if drones.iter().all(|drone| drone.laws.is_none()) {
        return vec![Warning::NoLaw];
    }
    let few = flock.and_then(|laws| laws.linear.as_ref()).map(|fit| fit.points);
    let few = few
        .filter(|points| *points < FEWEST_WINDOWS)
        .map(|windows| Warning::FewWindows { windows });
    let misfit = flock
        .and_then(misfit)
        .or_else(|| flock.and_then(|laws| vertex_caution(laws, drones, true_updraft_mps)));
    few.into_iter().chain(misfit).chain(lean_caution(drones, leaning)).collect()
}

/// About wind in a calibration: its W* is not only the air's.
fn lean_caution(drones: &[DroneAnalysis], leaning: Option<Leaning>) -> Option<Warning> {
    let tilts: Vec<f64> = drones
        .iter()
        .filter(|drone| drone.laws.is_some())
        .flat_map(|drone| &drone.windows)
        .filter(|window| window.kind.is_leg() && window.rejected.is_empty())
        .map(|window| window.lean_deg)
        .collect();
    let lean_deg = mean_sd(&tilts).0;
    let axial_mps = axial_of(leaning, lean_deg);
    let known = leaning.is_some();
    (axial_mps > WORTH_SAYING_MPS).then_some(Warning::LadderWind { lean_deg, axial_mps, known })
}

/// About the two forms of the tilt correction, where they differ by more than the fleet's u0 is known.
pub(super) fn tilt_caution(drones: &[DroneAnalysis], options: &AnalysisOptions) -> Option<Warning> {
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
    let (used, indicator) = (options.windows.tilt, options.indicator);
    Some(Warning::TiltForm { used, indicator, change, error, slope })
}

/// About wind: the drones leaned, and that is corrected for or not.
pub(super) fn wind_caution(map: &UpdraftMap) -> Option<Warning> {
    let errors: Vec<f64> = map.drones.iter().map(|drone| drone.systematic_mps).collect();
    let error = mean_sd(&errors).0;
    if error <= WORTH_SAYING_MPS {
        return None;
    }
    let tilts: Vec<f64> = map.drones.iter().map(|drone| drone.tilt_deg).collect();
    let corrected = match map.wind {
        Some(WindCorrection::Physics) => WindHandled::Physics,
        Some(WindCorrection::Drag) => WindHandled::Drag,
        None => WindHandled::Not,
    };
    let lean_deg = mean_sd(&tilts).0;
    Some(Warning::Wind { lean_deg, error_mps: error, corrected, moved: map.is_scan() })
}
