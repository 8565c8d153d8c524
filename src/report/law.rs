//! Fitted laws as curves, and windows as points.

use crate::analysis::law::{LawKind, Symbol};
use crate::analysis::prefer;
use crate::analysis::result::{BentLine, DroneAnalysis, Fit, FlightAnalysis, Laws, WindowStats};

use super::axis::Axis;
use super::chart::Mark;
use super::text::usable;

/// Samples of a drawn curve.
const CURVE_POINTS: u32 = 81;

/// The point of a window in the plane of V_U (m/s) and offset-corrected u_phi (us), with the
/// standard deviations of its samples as errors.
pub(super) fn mark(window: &WindowStats) -> Mark {
    Mark {
        x: window.velocity_mps.median,
        y: window.effort_phi.median - window.offset_us.unwrap_or(0.0),
        x_error: window.velocity_mps.sd,
        y_error: window.effort_phi.sd,
    }
}

/// Windows that laws are fitted to: accepted rungs of the ladder.
pub(super) fn moving(drone: &DroneAnalysis) -> impl Iterator<Item = &WindowStats> {
    drone.windows.iter().filter(|window| window.kind.is_leg() && window.rejected.is_empty())
}

/// The signed-quadratic fit to show: with A and u0 held where it was made so, and they are of this vehicle.
pub(super) fn signed_quadratic(laws: &Laws) -> Option<&Fit> {
    laws.of_own_vehicle().or(laws.signed_quadratic.as_ref())
}

/// The fit of a law to show; of the signed quadratic, [`signed_quadratic`].
pub(super) fn fit_of(laws: &Laws, law: LawKind) -> Option<&Fit> {
    match law {
        LawKind::Linear => laws.linear.as_ref(),
        LawKind::SignedQuadratic => signed_quadratic(laws),
    }
}

/// The laws of a flight as one: the flock's, or its only drone's.
pub(super) fn flight_laws(flight: &FlightAnalysis) -> Option<&Laws> {
    flight.flock.as_ref().or(match flight.drones.as_slice() {
        [drone] => drone.laws.as_ref(),
        _ => None,
    })
}

/// W* of the flight's signed quadratic where it is the vertex of a parabola and no air, m/s.
pub(super) fn vertex_mps(flight: &FlightAnalysis) -> Option<f64> {
    prefer::vertex_mps(flight_laws(flight)?, &flight.drones, flight.true_updraft_mps)
}

/// Points (V_U, u) of `u = A f(V - W) + u0` over a velocity axis; empty if a parameter is missing.
pub(super) fn signed_quadratic_curve(fit: &Fit, axis: &Axis) -> Vec<(f64, f64)> {
    let get = |symbol| value(fit, symbol);
    let (Some(a), Some(u0), Some(w)) = (get(Symbol::A), get(Symbol::U0), get(Symbol::W)) else {
        return Vec::new();
    };
    sampled(axis, |v| a * (v - w) * (v - w).abs() + u0)
}

/// Points (V_U, u) of `u = A' V + u0` over a velocity axis; empty if a parameter is missing.
pub(super) fn linear_curve(fit: &Fit, axis: &Axis) -> Vec<(f64, f64)> {
    let (Some(slope), Some(u0)) = (value(fit, Symbol::Slope), value(fit, Symbol::U0)) else {
        return Vec::new();
    };
    sampled(axis, |v| slope * v + u0)
}

/// Points (V_U, u) of a line that may bend, within the speeds of its windows.
pub(super) fn bent_curve(line: &BentLine) -> Vec<(f64, f64)> {
    let [low, high] = line.speeds_mps;
    let effort = |v: f64| {
        let bends = line.bend.value * v * v + line.drag.value * v * v.abs();
        line.u0.value + line.slope.value * v + bends
    };
    let all = [low, high, line.u0.value, line.slope.value, line.bend.value, line.drag.value];
    if all.into_iter().all(usable) { curve(low, high, effort) } else { Vec::new() }
}

fn value(fit: &Fit, symbol: Symbol) -> Option<f64> {
    fit.value(symbol).filter(|&value| usable(value))
}

fn sampled(axis: &Axis, law: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    curve(axis.min, axis.max, law)
}

fn curve(low: f64, high: f64, law: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..CURVE_POINTS)
        .map(|i| {
            let v = low + (high - low) * f64::from(i) / f64::from(CURVE_POINTS - 1);
            (v, law(v))
        })
        .collect()
}
