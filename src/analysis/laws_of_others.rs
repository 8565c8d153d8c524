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

/// That the laws of a calibration seem to be those of other drones than the map's.
pub(super) fn doubt(map: &UpdraftMap, calibration: &FlightAnalysis) -> Option<Warning> {
    let slope = calibration.flock.as_ref()?.linear.as_ref()?.parameters.first()?.estimate.value;
    let pairs: Vec<(f64, f64)> = map
        .drones
        .iter()
        .filter(|drone| drone.mapping == LawOf::Own)
        .filter_map(|drone| {
            let calibrated = same_drone(calibration, drone.slot, &drone.name)?;
            let level =
                calibrated.laws.as_ref()?.linear.as_ref()?.parameters.get(1)?.estimate.value;
            Some((level / slope, drone.mean.value))
        })
        .filter(|(level_mps, mean_mps)| level_mps.is_finite() && mean_mps.is_finite())
        .collect();
    depends(&pairs).map(|(correlation, spread_mps)| Warning::LawsOfOthers {
        drones: pairs.len(),
        correlation,
        spread_mps,
    })
}

/// Correlation of the levels with the means that were measured, both in m/s, and the standard deviation of the levels;
/// `None` as long as they may be independent.
fn depends(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
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
    (chance < CHANCE && line.slope() > SHARE).then_some((correlation, spread_mps))
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
            depends(&pairs).is_some()
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
}
