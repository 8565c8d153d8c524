//! Limits that were loosened beyond the vehicle's own, or would be: whoever flies must know.

use super::CheckInput;
use super::report::{Collector, Finding, Severity};
use crate::check::Limits;
use untrusted_io::number::plain;

/// Differences of limits that are rounding, relative.
const SAME: f64 = 1e-9;

/// One limit: its key, unit, whether larger is looser, and where it is.
type Row = (&'static str, &'static str, bool, fn(&Limits) -> f64);

/// Every limit of [`Limits`].
const ROWS: [Row; 9] = [
    ("max_speed_xy_mps", "m/s", true, |limits| limits.max_speed_xy_mps),
    ("max_speed_up_mps", "m/s", true, |limits| limits.max_speed_up_mps),
    ("max_speed_down_mps", "m/s", true, |limits| limits.max_speed_down_mps),
    ("max_acceleration_mps2", "m/s²", true, |limits| limits.max_acceleration_mps2),
    ("max_velocity_step_mps", "m/s", true, |limits| limits.max_velocity_step_mps),
    ("max_altitude_m", "m", true, |limits| limits.max_altitude_m),
    ("min_distance_m", "m", false, |limits| limits.min_distance_m),
    ("endurance_s", "s", true, |limits| limits.endurance_s),
    ("endurance_reserve", "", false, |limits| limits.endurance_reserve),
];

/// Warns of each limit that is looser than the vehicle's own.
pub(super) fn check(input: &CheckInput<'_>, collector: &mut Collector) {
    let Some(stock) = input.stock else { return };
    for (key, unit, larger_is_looser, get) in ROWS {
        let (own, value) = (get(stock), get(input.limits));
        let beyond = if larger_is_looser { value - own } else { own - value };
        if beyond <= SAME * own.abs() {
            if let Some(value) = stated(input, key) {
                let beyond = if larger_is_looser { value - own } else { own - value };
                if beyond > SAME * own.abs() {
                    collector.add(0, unheard(key, unit, value, own));
                }
            }
            continue;
        }
        let gap = if unit.is_empty() { "" } else { " " };
        let message = format!(
            "{key} is loosened to {}{gap}{unit}; the vehicle's own is {}{gap}{unit}",
            plain(value),
            plain(own),
        );
        collector.add(
            0,
            warning(
                (value, own, unit),
                message,
                "fly like this only if somebody has tried it with this vehicle",
            ),
        );
    }
}

/// What the show itself states of the limits that it cannot loosen.
fn stated(input: &CheckInput<'_>, key: &str) -> Option<f64> {
    let stated = input.show.validation?;
    match key {
        "max_speed_xy_mps" => stated.max_velocity_xy_mps,
        "max_speed_up_mps" => stated.max_velocity_z_up_mps.or(stated.max_velocity_z_mps),
        "max_speed_down_mps" => stated.max_velocity_z_mps,
        "max_altitude_m" => stated.max_altitude_m,
        // A show that states it for all directions is one of this program's, where it counts.
        "max_acceleration_mps2" if stated.max_acceleration_mps2.is_none() => {
            let [xy, z] = [stated.max_acceleration_xy_mps2, stated.max_acceleration_z_mps2];
            xy.into_iter().chain(z).reduce(f64::max)
        }
        "min_distance_m" => stated.min_distance_m,
        _ => None,
    }
    .filter(|value| value.is_finite() && *value > 0.0)
}

/// The warning of a limit that the show states and that does not count.
fn unheard(key: &str, unit: &'static str, value: f64, own: f64) -> Finding {
    let message = format!(
        "the show states {key} = {} {unit}; the vehicle's own {} {unit} are stricter and count",
        plain(value),
        plain(own),
    );
    let remedy = "name the vehicle that flies it, or allow the check by its name";
    warning((value, own, unit), message, remedy)
}

fn warning(
    (value, limit, unit): (f64, f64, &'static str),
    message: String,
    remedy: &'static str,
) -> Finding {
    Finding {
        value: Some(value),
        limit: Some(limit),
        unit,
        ..Finding::new(Severity::Warning, "limits", message, remedy)
    }
}
