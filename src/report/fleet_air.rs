//! Results of a map for the fleet as a whole: the mean with all of its error, and the spread.

use crate::analysis::result::{DroneUpdraft, UpdraftMap};
use crate::numeric::{least, most};

use super::figures::air::{deviation, mean, mean_error};
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
    /// Whether that systematic error is half a 95 % interval, of an error within the standard error.
    pub(super) is_in_budget: bool,
    /// Root mean square over drones of the estimated mean minus the true mean, m/s.
    pub(super) rms_error: Option<f64>,
    pub(super) n: usize,
}

/// Whether a drone's standard error has all that is known of its errors, wind with them. Then its systematic error is
/// the half width of a 95 % interval; else it is a bound beside the standard error.
fn is_in_budget(drone: &DroneUpdraft) -> bool {
    drone.errors.total_mps > 0.0
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
        // A budget has the wind in it.
        let beside = known().map(|d| if is_in_budget(d) { 0.0 } else { d.systematic_mps });
        let systematic = mean(beside).unwrap_or(0.0);
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
            None => {
                let halves: Option<Vec<f64>> = known()
                    .map(|drone| drone.mean_interval_mps.map(|[low, high]| (high - low) / 2.0))
                    .collect();
                let half_width = halves.and_then(|halves| mean(halves.into_iter()));
                Self { se: one.hypot(systematic), half_width }
            }
        }
    }

    /// `± 0.30 m/s standard error (95 %: ± 0.60)`.
    pub(super) fn words(self, decimals: usize) -> String {
        let interval = self
            .half_width
            .map_or_else(String::new, |half| format!(" (95 %: ± {})", fixed(half, decimals)));
        format!("± {} m/s standard error{interval}", fixed(self.se, decimals))
    }
}

impl FleetAir {
    /// `standard error of one drone: 0.28 m/s; of it systematic, from wind on the leaning drones: ±0.12 m/s (95 %)`.
    pub(super) fn one_drone_words(&self) -> String {
        let systematic = fixed(self.systematic, 2);
        let wind = match (self.systematic > 0.005, self.is_in_budget) {
            (false, _) => String::new(),
            (true, true) => {
                format!(
                    "; of it systematic, from wind on the leaning drones: ±{systematic} m/s (95 %)"
                )
            }
            (true, false) => {
                format!("; systematic, from wind on the leaning drones: {systematic} m/s")
            }
        };
        format!("standard error of one drone: {} m/s{wind}", fixed(self.se, 3))
    }

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
        let error = mean_error(map, drone)?;
        usable(error).then_some(error * error)
    });
    Some(FleetAir {
        mean: mean(means.clone())?,
        sd: deviation(means.clone()).unwrap_or(0.0),
        error: MeanError::of(map),
        lowest: least(means.clone())?,
        highest: most(means.clone())?,
        se: mean(map.drones.iter().map(|drone| drone.mean.se)).unwrap_or(0.0),
        systematic: mean(map.drones.iter().map(|drone| drone.systematic_mps)).unwrap_or(0.0),
        is_in_budget: map.drones.iter().all(is_in_budget),
        rms_error: mean(squares).map(f64::sqrt),
        n: means.count(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::result::{CommonError, ErrorBudget};
    use crate::base::estimate::Estimate;

    fn map(drones: usize, common: Option<CommonError>) -> UpdraftMap {
        let own = serde_json::json!({
            "law": "linear", "time_s": [], "drones": [], "truth": null
        });
        let mut map: UpdraftMap = serde_json::from_value(own).unwrap();
        map.common = common;
        map.drones = (0..drones)
            .map(|index| DroneUpdraft {
                slot: None,
                name: String::new(),
                position_m: None,
                track_m: Vec::new(),
                height_m: 100.0,
                mapping: crate::analysis::law::LawOf::Own,
                mean: Estimate::new(0.1 * index as f64, 0.5),
                mean_interval_mps: Some([-1.0, 1.2]),
                errors: ErrorBudget { window_mps: 0.3, law_mps: 0.4, ..ErrorBudget::default() },
                systematic_mps: 0.0,
                tilt_deg: 0.0,
                updraft_mps: Vec::new(),
                sd_mps: Vec::new(),
                interval_mps: Vec::new(),
                posterior_mps: Vec::new(),
                posterior_sd_mps: Vec::new(),
                posterior_mean: None,
                quality: Vec::new(),
                truth_mps: None,
                place: None,
                wind: None,
            })
            .collect();
        map
    }

    #[test]
    fn what_the_fleet_shares_is_in_the_error_of_its_mean_and_does_not_average_out() {
        let common = CommonError { se_mps: 0.3, half_width_mps: 0.6, ..CommonError::default() };
        let air = fleet_air(&map(25, Some(common))).unwrap();
        // Each drone's own 0.5 m/s over the root of 25.
        assert!((air.error.se - 0.3_f64.hypot(0.1)).abs() < 1e-12, "{:?}", air.error);
        assert!((air.error.half_width.unwrap() - 0.6_f64.hypot(0.196)).abs() < 1e-12);
        assert_eq!(air.error.words(2), "± 0.32 m/s standard error (95 %: ± 0.63)");
        assert_eq!(air.spread_words().unwrap(), "0.74 m/s between 25 drones");
        // Nothing known of what is shared: averaging is not taken to help.
        let error = fleet_air(&map(25, None)).unwrap().error;
        assert!((error.se - 0.5).abs() < 1e-12, "{error:?}");
        assert!((error.half_width.unwrap() - 1.1).abs() < 1e-9, "{error:?}");
        let mut one_without = map(25, None);
        one_without.drones[3].mean_interval_mps = None;
        assert_eq!(fleet_air(&one_without).unwrap().error.half_width, None);
    }

    #[test]
    fn the_stretch_that_sets_the_zero_is_not_in_the_error_of_a_mean() {
        let mut map = map(1, None);
        map.time_s = vec![10.0, 25.0, 26.0, 27.0];
        let drone = &mut map.drones[0];
        drone.updraft_mps = vec![Some(0.0), Some(0.4), Some(0.4), Some(0.4)];
        drone.truth_mps = Some(vec![Some(9.0), Some(0.1), Some(0.3), None]);
        let rms = |map: &UpdraftMap| fleet_air(map).unwrap().rms_error.unwrap();
        assert!((rms(&map) - 8.6 / 3.0).abs() < 1e-12, "{}", rms(&map));
        map.levelled = Some(crate::analysis::result::LevelledMap {
            zero_s: Some([0.0, 20.0]),
            ..Default::default()
        });
        assert!((rms(&map) - 0.2).abs() < 1e-12, "{}", rms(&map));
    }

    #[test]
    fn one_drone_has_its_own_error_and_no_spread() {
        let common = CommonError { se_mps: 0.3, half_width_mps: 0.6, ..CommonError::default() };
        let air = fleet_air(&map(1, Some(common))).unwrap();
        assert_eq!(air.error, MeanError { se: 0.5, half_width: Some(1.1) });
        assert_eq!(air.spread_words(), None);
    }

    #[test]
    fn wind_that_is_in_a_budget_is_not_added_again() {
        let mut map = map(1, None);
        map.drones[0].systematic_mps = 1.2;
        let beside = fleet_air(&map).unwrap();
        assert!((beside.error.se - 1.3).abs() < 1e-12, "{:?}", beside.error);
        assert_eq!(
            beside.one_drone_words(),
            "standard error of one drone: 0.500 m/s; systematic, from wind on the leaning drones: 1.20 m/s"
        );
        map.drones[0].errors.total_mps = 0.5;
        let within = fleet_air(&map).unwrap();
        assert_eq!(within.error, MeanError { se: 0.5, half_width: Some(1.1) });
        assert_eq!(
            within.one_drone_words(),
            "standard error of one drone: 0.500 m/s; of it systematic, from wind on the leaning drones: ±1.20 m/s \
             (95 %)"
        );
    }
}
