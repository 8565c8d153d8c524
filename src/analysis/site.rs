//! The place of a flight on the globe.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mission::Plan;
use crate::numeric::upper_median;

/// Place of a flight: the origin of its plan, or where its logs began.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FlightSite {
    /// Latitude, degrees.
    pub lat_deg: f64,
    /// Longitude, degrees.
    pub lon_deg: f64,
    /// Height of the ground above mean sea level, m; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_amsl_m: Option<f64>,
    /// Whether it is the plan's; otherwise it is the middle of the drones' first fixes.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub planned: bool,
}

impl FlightSite {
    /// Origin of the show frame: latitude and longitude, degrees; `None` where it is not the plan's.
    pub fn origin_deg(&self) -> Option<[f64; 2]> {
        self.planned.then_some([self.lat_deg, self.lon_deg])
    }

    /// The origin of a plan.
    pub(super) fn of_plan(plan: &Plan) -> Self {
        let site = plan.site;
        Self {
            lat_deg: site.origin_lat_deg,
            lon_deg: site.origin_lon_deg,
            ground_amsl_m: (!site.ground_assumed).then_some(site.ground_amsl_m),
            planned: true,
        }
    }

    /// The middle of first fixes, (latitude, longitude), degrees; `None` without any.
    pub(super) fn of_fixes(fixes: &(impl Iterator<Item = (f64, f64)> + Clone)) -> Option<Self> {
        let known = |fix: &(f64, f64)| fix.0.abs() <= 90.0 && fix.1.abs() <= 180.0;
        let middle =
            |of: fn((f64, f64)) -> f64| upper_median(fixes.clone().filter(known).map(of).collect());
        let (lat_deg, lon_deg) = (middle(|fix| fix.0)?, middle(|fix| fix.1)?);
        Some(Self { lat_deg, lon_deg, ground_amsl_m: None, planned: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_plan_the_middle_drone_is_the_place() {
        let fixes = [(47.1, 19.3), (f64::NAN, 0.0), (47.3, 19.1), (47.2, 19.2)];
        let site = FlightSite::of_fixes(&fixes.into_iter()).unwrap();
        assert_eq!((site.lat_deg, site.lon_deg, site.planned), (47.2, 19.2, false));
        assert_eq!(FlightSite::of_fixes(&[].into_iter()), None);
    }
}
