//! Warnings that a reader needs before using a flight's numbers.

use super::calibrate;
use super::options::AnalysisOptions;
use super::prefer::{misfit, vertex_caution};
use super::result::{DroneAnalysis, Fit, Laws, UpdraftMap, WindCorrection};
use super::stats::mean_sd;
use super::warning::{Warning, WindHandled};
use super::wind::{Leaning, axial_of};
use crate::base::estimate::Estimate;
use crate::flight::{Flight, Indicator, Series};

/// A systematic error above this is worth a sentence, m/s. Chosen.
const WORTH_SAYING_MPS: f64 = 0.05;

/// A change of u0 below this reads as zero, us (or the indicator's unit).
const WORTH_SAYING_US: f64 = 0.05;

/// Roll and pitch beyond this are steep, degrees: no drone that measures flies so for long. Chosen.
pub(super) const STEEP_DEG: f64 = 45.0;

/// Angles are doubted where more than this share of them is steep: degrees that are taken for radians are steep from
/// 0.8 degrees on. Chosen.
const STEEP_SHARE: f64 = 0.1;

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

/// About the angles of a table, whose unit its mapping says: they are steeper than a drone's.
pub(super) fn steep(flight: &Flight, name: &str) -> Option<Warning> {
    let share = |angles: &Series| {
        let steep = angles.value.iter().filter(|angle| angle.abs() > STEEP_DEG.to_radians());
        steep.count() as f64 / angles.len().max(1) as f64
    };
    let share = share(&flight.roll_rad).max(share(&flight.pitch_rad));
    (share > STEEP_SHARE).then(|| Warning::Steep { drones: vec![name.to_owned()], share })
}

/// Takes what is said of the drones' angles from them: it is one caution of their flight.
pub(super) fn steep_caution(drones: &mut [DroneAnalysis]) -> Option<Warning> {
    let (mut names, mut most) = (Vec::new(), 0.0_f64);
    for drone in drones {
        drone.warnings.retain(|warning| {
            let Warning::Steep { drones, share } = warning else { return true };
            names.extend_from_slice(drones);
            most = most.max(*share);
            false
        });
    }
    (!names.is_empty()).then_some(Warning::Steep { drones: names, share: most })
}

/// About a vehicle whose response is not that of the calibration's legs.
pub(super) fn response_caution(map: &UpdraftMap, indicator: Indicator) -> Option<Warning> {
    let levels = map.levelled.iter().flat_map(|levelled| &levelled.drones);
    let drones: Vec<(String, [f64; 2])> = levels
        .filter_map(|drone| Some((drone.name.clone(), [drone.slope, drone.legs_slope?])))
        .collect();
    (!drones.is_empty()).then_some(Warning::OtherResponse { drones, indicator })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_that_are_taken_for_radians_are_no_angles_of_a_drone() {
        let flight = |angles: &[f64]| {
            let time_s = (0..angles.len()).map(|index| index as f64).collect();
            let roll_rad = Series { time_s, value: angles.to_vec() };
            Flight { pitch_rad: roll_rad.clone(), roll_rad, ..Flight::default() }
        };
        let radians = [0.05, -0.02, 0.03, 0.04, -0.3, 0.5, 0.02, 0.01, 0.0, 0.9];
        assert!(steep(&flight(&radians), "a").is_none(), "one in ten is a turn");
        assert!(steep(&Flight::default(), "a").is_none());
        let degrees = radians.map(f64::to_degrees);
        let said = steep(&flight(&degrees), "a").unwrap().to_string();
        assert!(
            said.starts_with("angles: roll or pitch of a is beyond 45 degrees in 80 % of the rows"),
            "{said}"
        );
    }
}
