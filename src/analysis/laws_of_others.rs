//! Test whether the laws that measure the air are those of the drones that measured it.
//!
//! The air over a drone knows nothing of the drone. With its own law, what a drone measures does not depend on this law's
//! level, the rotor effort without any motion. With the law of another drone it does: that one's level counts as if it were
//! the drone's, and what it is too high reads as rising air.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::kind::LawOf;
use super::reference::same_drone;
use super::result::{FlightAnalysis, UpdraftMap};
use super::warning::Warning;
use crate::numeric::{Line, rms};

/// Fewest drones that are tested.
const FEWEST: usize = 6;
/// Chance of a fleet with its own laws to be doubted nevertheless. Chosen.
const CHANCE: f64 = 0.003;
/// Share of the levels' differences that is found again in what is measured: all of it with others' laws; with their own
/// no more than what the levels themselves are off by.
const SHARE: f64 = 0.5;
/// Levels must differ by so many times their standard errors. What they are off by is in all that their own laws measure, and of drones
/// that are alike nothing else is in the levels. Chosen: a quarter of their variance is then error.
const BEYOND_ERRORS: f64 = 2.0;

/// That the laws of a calibration seem to be those of other drones than the map's.
pub(super) fn doubt(map: &UpdraftMap, calibration: &FlightAnalysis) -> Option<Warning> {
    let slope = calibration.flock.as_ref()?.linear.as_ref()?.parameters.first()?.estimate.value;
    let (pairs, errors): (Vec<(f64, f64)>, Vec<f64>) = map
        .drones
        .iter()
        .filter(|drone| drone.mapping == LawOf::Own)
        .filter_map(|drone| {
            let calibrated = same_drone(calibration, drone.slot, &drone.name)?;
            let level = calibrated.laws.as_ref()?.linear.as_ref()?.parameters.get(1)?.estimate;
            Some(((level.value / slope, drone.mean.value), level.se / slope))
        })
        .filter(|((level_mps, mean_mps), _)| level_mps.is_finite() && mean_mps.is_finite())
        .unzip();
    depends(&pairs, &errors).map(|(correlation, spread_mps)| Warning::LawsOfOthers {
        drones: pairs.len(),
        correlation,
        spread_mps,
    })
}

/// Correlation of the levels with the means that were measured, both in m/s, and the standard deviation of the levels;
/// `None` as long as they may be independent, or the levels' errors (m/s) be all that they differ by.
fn depends(pairs: &[(f64, f64)], errors: &[f64]) -> Option<(f64, f64)> {
    if pairs.len() < FEWEST {
        return None;
    }
    let line = Line::through(pairs.iter().copied())?;
    let correlation = line.correlation()?;
    let freedom = (pairs.len() - 2) as f64;
    let t = correlation * (freedom / (1.0 - correlation * correlation).max(1e-12)).sqrt();
    let chance = StudentsT::new(0.0, 1.0, freedom).ok()?.sf(t);
    let centre_mps = line.mean[0];
    let spread_mps = rms(pairs.iter().map(|pair| pair.0 - centre_mps))?;
    let error_mps = rms(errors.iter().copied().filter(|se| se.is_finite())).unwrap_or(0.0);
    let is_beyond = spread_mps > BEYOND_ERRORS * error_mps;
    (is_beyond && chance < CHANCE && line.slope() > SHARE).then_some((correlation, spread_mps))
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    /// Share of fleets that are doubted, whose levels differ by 0.4 m/s and the air from place to place by `air_mps`.
    fn doubted(drones: usize, air_mps: f64, own: bool) -> f64 {
        let mut rng = rand_pcg::Pcg64::new(5, 7);
        let mut draw = |sd: f64| -> f64 {
            let unit: f64 = StandardNormal.sample(&mut rng);
            sd * unit
        };
        let fleets = 1000;
        let found = (0..fleets).filter(|_| {
            let pairs: Vec<(f64, f64)> = (0..drones)
                .map(|_| {
                    let (level, error, other) = (draw(0.4), draw(0.03), draw(0.4));
                    let off = if own { error } else { level - other };
                    (level, draw(air_mps) + off)
                })
                .collect();
            depends(&pairs, &vec![0.03; drones]).is_some()
        });
        found.count() as f64 / f64::from(fleets)
    }

    #[test]
    fn laws_of_other_drones_are_found_and_their_own_are_not() {
        for air_mps in [0.02, 0.2, 1.0] {
            assert!(doubted(9, air_mps, true) <= 0.008, "{air_mps}");
            assert!(doubted(49, air_mps, true) <= 0.008, "{air_mps}");
        }
        assert!(doubted(25, 0.2, false) > 0.8);
        assert!(doubted(49, 0.2, false) > 0.99);
        // Few drones are doubted where the chance is small, and none where it is not.
        assert!(doubted(9, 0.2, false) > 0.2);
        assert!(doubted(5, 0.2, false) == 0.0);
    }

    #[test]
    fn levels_that_differ_by_their_errors_alone_doubt_nobody() {
        // Of drones that are alike: what a level is off by is in all that is measured by it.
        let pairs: Vec<(f64, f64)> =
            (0..16).map(|at| 0.01 * f64::from(at)).map(|level| (level, level)).collect();
        assert!(depends(&pairs, &[0.08; 16]).is_none());
        assert!(depends(&pairs, &[0.01; 16]).is_some());
    }
}
