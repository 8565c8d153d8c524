//! What a map says about the fleet as a whole: its mean with all of its error, and the spread.

use crate::analysis::result::{DroneUpdraft, UpdraftMap};

use super::figures::air::{deviation, mean, mean_truth};
use super::text::{count, fixed, usable};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;

/// What the map says about the fleet as a whole.
pub(super) struct FleetAir {
    /// Mean of the drones' means, m/s, and their standard deviation between drones.
    pub(super) mean: f64,
    pub(super) sd: f64,
    /// Error of that mean.
    pub(super) error: MeanError,
    pub(super) lowest: f64,
    pub(super) highest: f64,
    /// Mean standard error and mean systematic error of one drone, m/s.
    pub(super) se: f64,
    pub(super) systematic: f64,
    /// Root mean square over drones of the estimated mean minus the true mean, m/s.
    pub(super) rms_error: Option<f64>,
    pub(super) n: usize,
}

/// Error of the mean over a fleet, m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeanError {
    /// Standard error, of all origins: what all drones share, and what is each drone's own.
    pub(super) se: f64,
    /// Half width of the 95 % interval; absent: not known.
    pub(super) half_width: Option<f64>,
}

impl MeanError {
    /// With the budget of the fleet: the shared part as it is, the drones' own parts averaged.
    /// Without one nothing is known of what is shared, and averaging is taken to help nothing.
    fn of(map: &UpdraftMap) -> Self {
        let known = || map.drones.iter().filter(|drone| usable(drone.mean.value));
        let one = mean(known().map(|drone| drone.mean.se)).unwrap_or(0.0);
        let systematic = mean(known().map(|drone| drone.systematic_mps)).unwrap_or(0.0);
        match map.common.filter(|common| usable(common.se_mps)) {
            // One drone shares with nobody: its own error and interval are all there is.
            Some(_) if known().count() == 1 => {
                let interval = known().find_map(|drone| drone.mean_interval_mps);
                let half_width = interval.map(|[low, high]| (high - low) / 2.0);
                Self { se: one, half_width: half_width.filter(|half| usable(*half)) }
            }
            Some(common) => {
                let n = known().count().max(1) as f64;
                let own2 = |drone: &DroneUpdraft| {
                    let errors = &drone.errors;
                    let law2 = (errors.law_mps.powi(2) - common.law_mps.powi(2)).max(0.0);
                    errors.window_mps.powi(2) + errors.velocity_mps.powi(2) + law2
                };
                let own = known().map(own2).filter(|own2| usable(*own2)).sum::<f64>().sqrt() / n;
                let half_width = common.half_width_mps.hypot(NORMAL * own);
                Self {
                    se: common.se_mps.hypot(own),
                    half_width: (usable(half_width) && half_width > 0.0).then_some(half_width),
                }
            }
            None => Self { se: one.hypot(systematic), half_width: None },
        }
    }

    /// `± 0.30 m/s standard error (95 %: ± 0.60)`.
    pub(super) fn words(self) -> String {
        let interval = self
            .half_width
            .map_or_else(String::new, |half| format!(" (95 %: ± {})", fixed(half, 2)));
        format!("± {} m/s standard error{interval}", fixed(self.se, 2))
    }
}

impl FleetAir {
    /// `0.15 m/s between 42 drones`; absent for one drone.
    pub(super) fn spread_words(&self) -> Option<String> {
        (self.n > 1)
            .then(|| format!("{} m/s between {}", fixed(self.sd, 2), count(self.n, "drone")))
    }
}

/// Summary of a map; `None` without a usable estimate.
pub(super) fn fleet_air(map: &UpdraftMap) -> Option<FleetAir> {
    let means = map.drones.iter().map(|drone| drone.mean.value).filter(|&w| usable(w));
    let squares = map.drones.iter().filter_map(|drone| {
        let error = drone.mean.value - mean_truth(drone)?;
        usable(error).then_some(error * error)
    });
    Some(FleetAir {
        mean: mean(means.clone())?,
        sd: deviation(means.clone()).unwrap_or(0.0),
        error: MeanError::of(map),
        lowest: means.clone().fold(f64::INFINITY, f64::min),
        highest: means.clone().fold(f64::NEG_INFINITY, f64::max),
        se: mean(map.drones.iter().map(|drone| drone.mean.se)).unwrap_or(0.0),
        systematic: mean(map.drones.iter().map(|drone| drone.systematic_mps)).unwrap_or(0.0),
        rms_error: mean(squares).map(f64::sqrt),
        n: means.count(),
    })
}
