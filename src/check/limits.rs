//! Limits that were loosened beyond the vehicle's own: whoever flies must know.

use super::CheckInput;
use super::report::{Collector, Finding, Severity};
use crate::base::number::plain;
use crate::vehicle::Limits;

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
            Finding {
                severity: Severity::Warning,
                check: "limits",
                drones: vec![],
                time_s: None,
                end_s: None,
                value: Some(value),
                limit: Some(own),
                unit,
                message,
                remedy: "fly like this only if somebody has tried it with this vehicle",
            },
        );
    }
}
