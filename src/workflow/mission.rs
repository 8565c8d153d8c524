//! Resolution of a mission template with overrides, and of its site.

use super::error::WorkflowError;
use crate::mission::plan::Site;
use crate::mission::resolve::{self, EXAMPLE_ORIGIN, Mission, Override};

/// Keys of a template.
const ORIGIN: &str = "site.origin";
const GROUND: &str = "site.ground_amsl_m";
/// An origin that is moved by less is still on the template's own field, m.
const SAME_FIELD_M: f64 = 1000.0;

/// Whether an override sets a key, of all flights of a campaign or of one.
fn names(item: &Override, key: &str) -> bool {
    let flight = item.key.strip_suffix(key).and_then(|flight| flight.strip_suffix('.'));
    item.key == key || flight.is_some_and(|flight| !flight.contains('.'))
}

/// Resolves a template, a file or a built-in name. Where overrides move the origin and leave the
/// ground height to the template, the plans state that the height is assumed.
///
/// # Errors
///
/// If there is no such template, or it is not valid with these overrides.
pub fn resolve(template: &str, overrides: &[Override]) -> Result<Mission, WorkflowError> {
    let mission = resolve::resolve(template, overrides)?;
    let given = |key: &str| overrides.iter().any(|item| names(item, key));
    if !given(ORIGIN) || given(GROUND) {
        return Ok(mission);
    }
    let own: Vec<Override> =
        overrides.iter().filter(|item| !names(item, ORIGIN)).cloned().collect();
    let own = resolve::resolve(template, &own)?;
    let elsewhere = mission.flights.iter().zip(&own.flights).any(|(moved, own)| {
        let place = moved.plan.site.frame().origin;
        let off_m = own.plan.site.frame().from_geodetic(place);
        off_m.x.hypot(off_m.y) > SAME_FIELD_M
    });
    if !elsewhere {
        return Ok(mission);
    }
    let mut overrides = overrides.to_vec();
    overrides.push(Override::new("site.ground_assumed", true));
    Ok(resolve::resolve(template, &overrides)?)
}

/// Whether the site of a plan is the built-in templates' example without an override that asks for
/// it.
pub fn is_example(site: &Site, overrides: &[Override]) -> bool {
    let given = overrides.iter().any(|item| names(item, ORIGIN));
    !given && [site.origin_lat_deg, site.origin_lon_deg] == EXAMPLE_ORIGIN
}
