//! What a reader must know before using a flight's numbers, in plain words.

use super::prefer::misfit;
use super::result::{DroneAnalysis, Laws, UpdraftMap};
use super::stats::mean_sd;

/// A systematic error above this is worth a sentence, m/s.
const WORTH_SAYING_MPS: f64 = 0.05;

/// About the laws of a calibration: the flock's, or its only drone's.
pub(super) fn fit_cautions(flock: Option<&Laws>, drones: &[DroneAnalysis]) -> Vec<String> {
    if drones.iter().all(|drone| drone.laws.is_none()) {
        return vec![
            "no law was fitted: no drone has a usable speed ladder (the reasons are with the drones)"
                .to_owned(),
        ];
    }
    flock.and_then(misfit).into_iter().collect()
}

/// About wind: the drones leaned, and that is corrected for or not.
pub(super) fn wind_caution(map: &UpdraftMap) -> Option<String> {
    let errors: Vec<f64> = map.drones.iter().map(|drone| drone.systematic_mps).collect();
    let error = mean_sd(&errors).0;
    if error <= WORTH_SAYING_MPS {
        return None;
    }
    let tilts: Vec<f64> = map.drones.iter().map(|drone| drone.tilt_deg).collect();
    let tilt = mean_sd(&tilts).0;
    Some(if map.leaning.is_some() {
        format!(
            "wind: the drones leaned {tilt:.1} degrees in the hover. What wind does to a leaning \
             drone is corrected with the drag of the simulated vehicle; what is left may be \
             {error:.2} m/s, of the same sign for all drones (stated as the systematic error)"
        )
    } else {
        format!(
            "wind: the drones leaned {tilt:.1} degrees in the hover, and a lean in hover or \
             calibration reads as sinking air. The drag of these drones is not known, so that \
             nothing is corrected: the map may be off by up to {error:.2} m/s, in the same direction \
             for all drones (stated as the systematic error). Fly in still air where that matters"
        )
    })
}
