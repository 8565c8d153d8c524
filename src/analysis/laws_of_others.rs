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
/// The same among drones that are near to each other, which tell less of it.
const SHARE_OF_NEAR: f64 = 0.25;
/// Levels must differ by so many times their standard errors. What they are off by is in all that their own laws measure, and of drones
/// that are alike nothing else is in the levels. Chosen: a quarter of their variance is then error.
const BEYOND_ERRORS: f64 = 2.0;

/// Nearest drones from whose mean a drone is told apart. Chosen: those beside it in a grid.
const NEIGHBOURS: usize = 4;

/// One drone: what its law says and what was measured with it.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// The level of its law, as rising air, m/s, and the mean that was measured, m/s.
    pair: (f64, f64),
    /// Standard error of the level, m/s.
    error_mps: f64,
    /// East and north of the site, m; absent: not known.
    place_m: Option<[f64; 2]>,
}

/// That the laws of a calibration seem to be those of other drones than the map's.
pub(super) fn doubt(map: &UpdraftMap, calibration: &FlightAnalysis) -> Option<Warning> {
    let slope = calibration.flock.as_ref()?.linear.as_ref()?.parameters.first()?.estimate.value;
    let seen: Vec<Seen> = map
        .drones
        .iter()
        .filter(|drone| drone.mapping == LawOf::Own)
        .filter_map(|drone| {
            let calibrated = same_drone(calibration, drone.slot, &drone.name)?;
            let level = calibrated.laws.as_ref()?.linear.as_ref()?.parameters.get(1)?.estimate;
            let pair = (level.value / slope, drone.mean.value);
            Some(Seen { pair, error_mps: level.se / slope, place_m: drone.position_m })
        })
        .filter(|seen| seen.pair.0.is_finite() && seen.pair.1.is_finite())
        .collect();
    doubted(&seen).map(|(correlation, spread_mps)| Warning::LawsOfOthers {
        drones: seen.len(),
        correlation,
        spread_mps,
    })
}

/// As [`depends`], if drones that are near to each other differ like this as well.
fn doubted(seen: &[Seen]) -> Option<(f64, f64)> {
    depends(seen)
        .filter(|_| Levels::of(&apart(seen)).is_some_and(|levels| levels.are_others(SHARE_OF_NEAR)))
}

/// Drones apart from the mean of those nearest to them, with the spread that they would have had with none beside them. Air
/// that lasts through a calibration differs from one end of the array to the other, and is then in the levels of laws that
/// are the drones' own; laws differ from drone to drone. As they are where a place is not known, or with few drones.
fn apart(seen: &[Seen]) -> Vec<Seen> {
    let places: Option<Vec<[f64; 2]>> = seen.iter().map(|one| one.place_m).collect();
    let Some(places) = places.filter(|places| places.len() > NEIGHBOURS) else {
        return seen.to_vec();
    };
    let narrower = (1.0 + 1.0 / NEIGHBOURS as f64).sqrt();
    let others_mean = |of: usize| {
        let distance =
            |to: usize| (places[to][0] - places[of][0]).hypot(places[to][1] - places[of][1]);
        let mut others: Vec<(f64, usize)> =
            (0..seen.len()).filter(|to| *to != of).map(|to| (distance(to), to)).collect();
        others
            .select_nth_unstable_by(NEIGHBOURS - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let near = others.iter().take(NEIGHBOURS).map(|(_, other)| seen[*other].pair);
        let sum = near.fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        (sum.0 / NEIGHBOURS as f64, sum.1 / NEIGHBOURS as f64)
    };
    let one = |(at, one): (usize, &Seen)| {
        let mean = others_mean(at);
        let pair = ((one.pair.0 - mean.0) / narrower, (one.pair.1 - mean.1) / narrower);
        Seen { pair, ..*one }
    };
    seen.iter().enumerate().map(one).collect()
}

/// What levels differ by and what is measured with them.
#[derive(Clone, Copy, Debug)]
struct Levels {
    line: Line,
    spread_mps: f64,
    error_mps: f64,
}

impl Levels {
    fn of(seen: &[Seen]) -> Option<Self> {
        let line = Line::through(seen.iter().map(|one| one.pair))?;
        let centre_mps = line.mean[0];
        let spread_mps = rms(seen.iter().map(|one| one.pair.0 - centre_mps))?;
        let errors = seen.iter().map(|one| one.error_mps).filter(|se| se.is_finite());
        Some(Self { line, spread_mps, error_mps: rms(errors).unwrap_or(0.0) })
    }

    /// Whether they differ by more than their errors, and are found again in what is measured.
    fn are_others(self, share: f64) -> bool {
        self.spread_mps > BEYOND_ERRORS * self.error_mps && self.line.slope() > share
    }
}

/// Correlation of the levels with the means that were measured, both in m/s, and the standard deviation of the levels;
/// `None` as long as they may be independent, or the levels' errors (m/s) be all that they differ by.
fn depends(seen: &[Seen]) -> Option<(f64, f64)> {
    if seen.len() < FEWEST {
        return None;
    }
    let levels = Levels::of(seen)?;
    let correlation = levels.line.correlation()?;
    let freedom = (seen.len() - 2) as f64;
    let t = correlation * (freedom / (1.0 - correlation * correlation).max(1e-12)).sqrt();
    let chance = StudentsT::new(0.0, 1.0, freedom).ok()?.sf(t);
    (levels.are_others(SHARE) && chance < CHANCE).then_some((correlation, levels.spread_mps))
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    /// A drone in a grid of this side, 7 m apart.
    fn at(drone: usize, side: usize, pair: (f64, f64), error_mps: f64) -> Seen {
        let place_m = [7.0 * (drone % side) as f64, 7.0 * (drone / side) as f64];
        Seen { pair, error_mps, place_m: Some(place_m) }
    }

    /// Share of fleets that are doubted, whose levels differ by 0.4 m/s and the air from place to place by `air_mps`.
    fn doubted(drones: usize, air_mps: f64, own: bool) -> f64 {
        let mut rng = rand_pcg::Pcg64::new(5, 7);
        let mut draw = |sd: f64| -> f64 {
            let unit: f64 = StandardNormal.sample(&mut rng);
            sd * unit
        };
        let fleets = 1000;
        let found = (0..fleets).filter(|_| {
            let side = (drones as f64).sqrt().ceil() as usize;
            let seen: Vec<Seen> = (0..drones)
                .map(|drone| {
                    let (level, error, other) = (draw(0.4), draw(0.03), draw(0.4));
                    let off = if own { error } else { level - other };
                    at(drone, side, (level, draw(air_mps) + off), 0.03)
                })
                .collect();
            super::doubted(&seen).is_some()
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
        let doubted = |error_mps: f64| {
            let level = |drone: usize| 0.01 * drone as f64;
            let seen: Vec<Seen> = (0..16)
                .map(|drone| at(drone, 4, (level(drone), level(drone)), error_mps))
                .collect();
            depends(&seen)
        };
        assert!(doubted(0.08).is_none());
        assert!(doubted(0.01).is_some());
    }

    #[test]
    fn air_that_lasts_through_a_calibration_is_in_the_levels_of_own_laws() {
        // From one end of 63 m to the other the level of drones that are alike differs by the air's 0.3 m/s.
        let mut rng = rand_pcg::Pcg64::new(5, 7);
        let seen: Vec<Seen> = (0..100)
            .map(|drone| {
                let error: f64 = StandardNormal.sample(&mut rng);
                let lasting = 0.15 * (0.045 * 7.0 * (drone % 10) as f64).cos();
                let level = lasting + 0.03 * error;
                at(drone, 10, (level, level), 0.03)
            })
            .collect();
        assert!(depends(&seen).is_some(), "by the levels as they are");
        assert!(super::doubted(&seen).is_none());
    }
}
