//! The fence of a plan, for the vehicles of its show.
//!
//! It is never smaller than the show: a plan whose show does not fit into its own fence with the
//! margin is refused before anything is sent.

use crate::check::{CheckInput, Severity, check};
use crate::mission::Plan;
use crate::show::Show;
use nalgebra::Vector3;

pub use mavlink_station::fence::*;

/// Most corners that are sent; ArduPilot stores a few dozen points in all.
const MOST_CORNERS: usize = 60;
/// Lowest top that ArduPilot accepts, m.
const LEAST_TOP_M: f64 = 10.0;

/// Reason why a plan has no usable fence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FenceRefusal {
    /// The fence is not a polygon, or one of its numbers is not finite.
    #[error(
        "the plan has no usable fence ({reason}): a show is not flown without one; plan the \
         flight again"
    )]
    Unusable {
        /// Reason why the fence cannot be used.
        reason: String,
    },
    /// The show leaves the fence or comes too near to it.
    #[error("the fence is smaller than the show: {finding}")]
    Smaller {
        /// Finding of the checks: drone, time, amount and remedy.
        finding: String,
    },
}

/// Fence of a plan for its vehicles.
///
/// # Errors
///
/// [`FenceRefusal`], if it is not a usable polygon, or the show does not fit into it with the plan's
/// margin.
pub fn fence_of(plan: &Plan, show: &Show) -> Result<Fence, FenceRefusal> {
    let fence = &plan.fence;
    let unusable = |reason: &str| FenceRefusal::Unusable { reason: reason.to_owned() };
    if fence.polygon_m.len() < 3 {
        return Err(unusable("it has fewer than three corners"));
    }
    if fence.polygon_m.len() > MOST_CORNERS {
        return Err(unusable("it has more than 60 corners"));
    }
    let numbers = fence.polygon_m.iter().flatten().chain([&fence.margin_m]);
    if numbers.chain([&fence.max_altitude_m]).any(|number| !number.is_finite()) {
        return Err(unusable("one of its numbers is not a number"));
    }
    if fence.margin_m < 0.0 {
        return Err(unusable("its margin is negative"));
    }
    let report = check(&CheckInput::new(show, &plan.limits).with_fence(Some(fence)));
    let broken = report.findings.iter().find(|finding| {
        finding.severity == Severity::Error
            && matches!(finding.check, "fence" | "fence-altitude" | "validity")
    });
    if let Some(finding) = broken {
        let (drones, message) = (finding.drones.join(", "), &finding.message);
        let finding = format!("{drones} {message}: {}", finding.remedy);
        return Err(FenceRefusal::Smaller { finding });
    }
    let frame = plan.site.frame();
    let corner = |[x, y]: &[f64; 2]| {
        let place = frame.to_geodetic(Vector3::new(*x, *y, 0.0));
        (degrees_1e7(place.lat_deg), degrees_1e7(place.lon_deg))
    };
    Ok(Fence {
        corners_1e7: fence.polygon_m.iter().map(corner).collect(),
        top_m: fence.max_altitude_m.max(LEAST_TOP_M),
    })
}
