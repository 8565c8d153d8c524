//! Windows as points of a curve: one drone's, or averages over drones.

use std::collections::BTreeMap;

use super::super::battery::Pack;
use super::super::corrections::{Corrections, DOUBTS, Raw};
use super::super::split::LEAST_NOISE_US;
use super::super::wind::axial_of;
use super::super::window::WindowStats;

/// What was flown: kind of the window and command, and which of several alike.
pub(super) type Key = (u8, i64, usize);

/// A window referred to level flight, the ground's density and the reference voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) key: Key,
    pub(super) is_leg: bool,
    pub(super) time_s: f64,
    /// Vertical speed over ground with what the wind adds along the rotor axis, up positive, m/s.
    pub(super) velocity_mps: f64,
    pub(super) pulse_us: f64,
    /// Standard error of the pulse, us.
    pub(super) noise_us: f64,
    /// Standard error of the velocity, m/s.
    pub(super) velocity_noise_mps: f64,
    /// What wind may add along the rotor axis where the vehicle's drag is not known, at most, m/s.
    pub(super) axial_mps: f64,
    /// Change of the pulse per unit of each doubt, us.
    pub(super) doubts_us: [f64; DOUBTS],
}

/// The usable legs and hovers of a drone.
pub(super) fn keyed(
    windows: &[WindowStats],
    corrections: &Corrections<'_>,
    pack: Option<&Pack>,
    slope: f64,
) -> Vec<Point> {
    let mut seen = BTreeMap::<(u8, i64), usize>::new();
    let mut points = Vec::new();
    for window in windows.iter().filter(|one| one.kind.is_leg() || one.kind.is_hover()) {
        let command = (window.commanded_mps * 1000.0).round() as i64;
        let kind = u8::from(window.kind.is_hover());
        let number = seen.entry((kind, command)).or_default();
        let key = (kind, command, *number);
        *number += 1;
        if !window.rejected.is_empty() {
            continue;
        }
        let referred = corrections.refer(&Raw::of(window), pack, slope);
        let point = Point {
            key,
            is_leg: window.kind.is_leg(),
            time_s: f64::midpoint(window.start_s, window.end_s),
            velocity_mps: referred.velocity_mps,
            pulse_us: referred.pulse_us,
            noise_us: window.effort_phi.se.max(LEAST_NOISE_US),
            velocity_noise_mps: window.velocity_mps.se,
            axial_mps: if corrections.knows_wind() { 0.0 } else { axial_of(None, window.lean_deg) },
            doubts_us: referred.doubts_us,
        };
        let finite = [point.velocity_mps, point.pulse_us, point.noise_us, point.velocity_noise_mps];
        if finite.iter().chain(&point.doubts_us).all(|value| value.is_finite()) {
            points.push(point);
        }
    }
    points
}

/// The windows that every drone has.
pub(super) fn common(mut drones: Vec<Vec<Point>>) -> Vec<Vec<Point>> {
    let mut counts = BTreeMap::<Key, usize>::new();
    for point in drones.iter().flatten() {
        *counts.entry(point.key).or_default() += 1;
    }
    let all = drones.len();
    // Where drones have hardly a window in common (groups that fly apart), all are taken.
    let shared = counts.values().filter(|count| **count == all).count();
    if 2 * shared >= counts.len() {
        for points in &mut drones {
            points.retain(|point| counts.get(&point.key) == Some(&all));
        }
    }
    drones
}

/// Averages over drones with equal weights.
pub(super) fn average(drones: &[Vec<Point>]) -> Vec<Point> {
    let mut cells = BTreeMap::<Key, Vec<&Point>>::new();
    for point in drones.iter().flatten() {
        cells.entry(point.key).or_default().push(point);
    }
    let mut averages: Vec<Point> = cells.into_values().filter_map(|cell| of_cell(&cell)).collect();
    averages.sort_by(|left, right| left.time_s.total_cmp(&right.time_s));
    averages
}

fn of_cell(cell: &[&Point]) -> Option<Point> {
    let n = cell.len() as f64;
    let over = |value: &dyn Fn(&Point) -> f64| cell.iter().map(|one| value(one)).sum::<f64>() / n;
    let error = |value: &dyn Fn(&Point) -> f64| {
        cell.iter().map(|one| value(one).powi(2)).sum::<f64>().sqrt() / n
    };
    Some(Point {
        time_s: over(&|one| one.time_s),
        velocity_mps: over(&|one| one.velocity_mps),
        pulse_us: over(&|one| one.pulse_us),
        noise_us: error(&|one| one.noise_us),
        velocity_noise_mps: error(&|one| one.velocity_noise_mps),
        axial_mps: over(&|one| one.axial_mps),
        doubts_us: std::array::from_fn(|doubt| over(&|one| one.doubts_us[doubt])),
        ..**cell.first()?
    })
}
