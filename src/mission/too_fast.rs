//! Where a template asks for speeds that its limits forbid.

use super::error::TemplateError;
use super::resolve::ResolvedFlight;
use super::template::{Quantity, Template, span_of};
use crate::base::number::plain;

/// The place in a flight's template whose ladder has speeds above the plan's limits, with what to do; `None` where it
/// has none. The checks find the same in the trajectories, drone by drone.
pub fn too_fast(flight: &ResolvedFlight) -> Option<TemplateError> {
    let text = &flight.template_text;
    let path = format!("template.toml of {}", flight.plan.name);
    let Ok(Template::Flight(template)) = Template::parse(&path, text) else { return None };
    let limits = &flight.plan.limits;
    let most = limits.max_speed_up_mps.min(limits.max_speed_down_mps);
    let in_steps = template.steps.iter().filter_map(|step| step.get_ref().speeds_mps.as_ref());
    let named = template.parameters.get("speeds_mps");
    let (speed, span) = named.into_iter().chain(in_steps).find_map(|value| {
        let list: &[f64] = match value.get_ref() {
            Quantity::List(list) => list,
            Quantity::Number(number) => std::slice::from_ref(number),
            Quantity::Reference(_) => &[],
        };
        let speed = list.iter().copied().find(|speed| *speed > most)?;
        Some((speed, span_of(value)))
    })?;
    let message = format!(
        "{} m/s is more than the limits allow: {} m/s up, {} m/s down",
        plain(speed),
        plain(limits.max_speed_up_mps),
        plain(limits.max_speed_down_mps),
    );
    Some(TemplateError::new(&path, text, span, message).with_help(
        "fly slower (--speeds), or raise max_speed_up_mps and max_speed_down_mps in [limits]; --allow speed-up \
         --allow speed-down writes the show all the same",
    ))
}
