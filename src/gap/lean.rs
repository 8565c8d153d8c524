//! The wind, from how the fleet leans.

use nalgebra::{DMatrix, DVector, Matrix4};

use super::bins::BinValues;
use super::data::Data;
use super::minimise::minimise;
use crate::effects::select::value_of;
use crate::sim::plant::drag::Drag;
use crate::vehicle::Vehicle;

const GRAVITY: f64 = 9.80665;
/// Below this slope of the lean a bin's own lean says less than the flight's mean wind, rad/(m/s).
const LEAST_SLOPE: f64 = 0.004;
/// Rounds of the air speed by a lean.
const ROUNDS: usize = 12;
/// Fastest wind that is believed, m/s.
const FASTEST_MPS: f64 = 25.0;

/// How a vehicle leans at a horizontal air speed v while it climbs at V:
/// `a v + b v ((1 - s) v + s sqrt(v² + V²))`, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeanLaw {
    /// Linear part (blade flapping, a), rad/(m/s).
    pub linear: f64,
    /// Quadratic part (drag, b), rad/(m/s)².
    pub square: f64,
    /// Share of the drag that is a body's in one piece (s), which meets more air the faster it climbs. The
    /// faces of a box do not.
    pub body_share: f64,
}

impl LeanLaw {
    /// What the vehicle's model says at an air density, kg/m³.
    pub fn of(vehicle: &Vehicle, density: f64) -> Self {
        let factor = Drag::new(&vehicle.airframe).factor_m2();
        let box_m2 = (factor.x * factor.y).sqrt();
        let body_m2 = value_of(vehicle, "parasitic-drag", "horizontal_m2").unwrap_or(0.0) / 2.0;
        Self {
            linear: value_of(vehicle, "blade-flapping", "drag_per_weight").unwrap_or(0.0),
            square: density * (box_m2 + body_m2) / (vehicle.airframe.mass_kg * GRAVITY),
            body_share: body_m2 / (box_m2 + body_m2).max(1e-9),
        }
    }

    /// What a body in one piece meets beyond the horizontal air speed, m/s.
    fn more_mps(self, speed_mps: f64, climb_mps: f64) -> f64 {
        self.body_share * (speed_mps.hypot(climb_mps) - speed_mps)
    }

    fn lean(self, speed_mps: f64, climb_mps: f64) -> f64 {
        let met_mps = speed_mps + self.more_mps(speed_mps, climb_mps);
        self.linear * speed_mps + self.square * speed_mps * met_mps
    }

    /// The lean at an air speed, as a vector.
    fn lean_of(self, air_mps: [f64; 2], climb_mps: f64) -> [f64; 2] {
        let speed = air_mps[0].hypot(air_mps[1]).max(1e-9);
        air_mps.map(|part| self.lean(speed, climb_mps) * part / speed)
    }

    fn slope(self, speed_mps: f64) -> f64 {
        self.linear + 2.0 * self.square * speed_mps
    }

    /// Air speed over ground-fixed axes by the lean of the thrust axis, m/s.
    fn air(self, lean_rad: [f64; 2], climb_mps: f64) -> [f64; 2] {
        let lean = lean_rad[0].hypot(lean_rad[1]);
        if lean < 1e-9 {
            return [0.0; 2];
        }
        // What the climb adds is taken from the speed of the round before.
        let mut speed = 0.0;
        for _ in 0..ROUNDS {
            let linear = self.linear + self.square * self.more_mps(speed, climb_mps);
            speed = if self.square > 1e-12 {
                ((linear * linear + 4.0 * self.square * lean).sqrt() - linear) / (2.0 * self.square)
            } else {
                lean / linear.max(1e-6)
            };
            if self.body_share * climb_mps == 0.0 {
                break;
            }
        }
        let speed = speed.min(FASTEST_MPS);
        [lean_rad[0] / lean * speed, lean_rad[1] / lean * speed]
    }
}

/// The horizontal air as the leans of a flight show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    /// Mean wind, show frame, towards, m/s.
    pub mean_mps: [f64; 2],
    /// Its standard error along either axis, m/s.
    pub mean_se_mps: f64,
    /// Air speed of each group's drones in each bin, show frame, m/s.
    pub air_mps: Vec<Vec<[f64; 2]>>,
    /// Lean law that the flight's horizontal legs showed; `None`: it has none, and the model's was
    /// taken.
    pub measured: Option<Measured>,
}

/// A lean law by horizontal legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The law.
    pub law: LeanLaw,
    /// Standard error of its linear part, rad/(m/s).
    pub linear_se: f64,
}

/// Finds the wind. Horizontal legs at known speeds measure the lean law as well.
///
/// `flown` is the simulated side with the wind that it was flown in: legs are short, and what a lean
/// still lacks of its steady value there lacks in the simulator, too.
pub(super) fn wind(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 2])>,
) -> Wind {
    let leans: Vec<Vec<[f64; 2]>> = data
        .groups
        .iter()
        .enumerate()
        .map(|(index, group)| {
            let lean = |bin: usize| {
                let mean = |axis: usize| group.mean(bin, |values| values.lean_rad[axis]);
                let unsettled = flown.and_then(|(side, wind_mps)| {
                    let values = side.get(index)?.get(bin)?;
                    let velocity = group.bins[bin].velocity_mps;
                    let air = [velocity[0] - wind_mps[0], velocity[1] - wind_mps[1]];
                    let steady = law.lean_of(air, velocity[2]);
                    Some([values.lean_rad[0] - steady[0], values.lean_rad[1] - steady[1]])
                });
                let [x, y] = unsettled.unwrap_or_default();
                [mean(0) - x, mean(1) - y]
            };
            (0..group.bins.len()).map(lean).collect()
        })
        .collect();
    let each =
        || data.groups.iter().zip(&leans).flat_map(|(group, leans)| group.bins.iter().zip(leans));
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for (bin, lean) in each().filter(|(bin, _)| !bin.is_horizontal()) {
        let air = law.air(*lean, bin.climb_mps());
        sum[0] -= air[0];
        sum[1] -= air[1];
        count += 1.0;
    }
    let mut mean_mps = sum.map(|sum: f64| if count > 0.0 { sum / count } else { 0.0 });
    let mut law = law;
    let mut measured = None;
    let body_share = law.body_share;
    let points: Vec<Point> = each().map(|(bin, lean)| Point::of(bin, *lean, body_share)).collect();
    let moves = points.iter().filter(|point| point.moves).count() >= FEWEST_MOVING;
    if moves && flown.is_some() {
        let start = [mean_mps[0], mean_mps[1], law.linear.max(1e-4), law.square.max(1e-5)];
        // The search moves in numbers near 1.
        let natural = |at: &[f64; 4]| [at[0], at[1], at[2] * LINEAR_UNIT, at[3] * SQUARE_UNIT];
        let from = [start[0], start[1], start[2] / LINEAR_UNIT, start[3] / SQUARE_UNIT];
        let (at, _) = minimise(from, |at| misfit(&points, &natural(at), start));
        let at = natural(&at);
        mean_mps = [at[0], at[1]];
        law = LeanLaw { linear: at[2], square: at[3], ..law };
        measured = Some(Measured { law, linear_se: linear_se(&points, &at) });
    }
    let air_mps = data
        .groups
        .iter()
        .zip(&leans)
        .map(|(group, leans)| {
            let air = |(bin, lean): (&super::bins::Bin, &[f64; 2])| {
                let steady = [bin.velocity_mps[0] - mean_mps[0], bin.velocity_mps[1] - mean_mps[1]];
                let tells = law.slope(steady[0].hypot(steady[1])) > LEAST_SLOPE;
                if tells { law.air(*lean, bin.climb_mps()) } else { steady }
            };
            let raw: Vec<[f64; 2]> = group.bins.iter().zip(leans).map(air).collect();
            smooth(group, &raw)
        })
        .collect();
    let share = if measured.is_some() { LEGS_DOUBT } else { LAW_DOUBT };
    let speed_mps = mean_mps[0].hypot(mean_mps[1]);
    let mean_se_mps = LEAST_DOUBT_MPS.hypot(share * speed_mps);
    Wind { mean_mps, mean_se_mps, air_mps, measured }
}

/// What the wind that leans say is wrong by: the least, m/s, ...
const LEAST_DOUBT_MPS: f64 = 0.1;
/// ... and as a share of it, by a law that legs measured, or by the model's alone.
const LEGS_DOUBT: f64 = 0.08;
const LAW_DOUBT: f64 = 0.3;

/// Time scales of gusts that are tried, s, and shares of what is scatter.
const GUST_S: [f64; 3] = [12.0, 25.0, 60.0];
const SCATTER: [f64; 5] = [0.02, 0.08, 0.2, 0.45, 0.8];

/// The air as it most probably was: a regressor with scatter of its own would be fitted too small.
/// What the drone flies itself is known and is left out of the smoothing.
fn smooth(group: &super::data::Group, raw: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let wind = |axis: usize| -> Vec<f64> {
        let flown = group.bins.iter().zip(raw);
        smoothed(
            group,
            &flown.map(|(bin, air)| bin.velocity_mps[axis] - air[axis]).collect::<Vec<f64>>(),
        )
    };
    let (x, y) = (wind(0), wind(1));
    group
        .bins
        .iter()
        .zip(x.iter().zip(&y))
        .map(|(bin, (x, y))| [bin.velocity_mps[0] - x, bin.velocity_mps[1] - y])
        .collect()
}

/// Posterior mean of a series that is exponentially correlated with white scatter on top.
fn smoothed(group: &super::data::Group, values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let mean = values.iter().sum::<f64>() / count.max(1) as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count.max(1) as f64;
    if variance < 1e-6 || count < 4 {
        return values.to_vec();
    }
    let times: Vec<f64> = group.bins.iter().map(super::bins::Bin::middle_s).collect();
    let rest = DVector::from_iterator(count, values.iter().map(|value| value - mean));
    let kernel = |tau_s: f64, share: f64| {
        DMatrix::from_fn(count, count, |a, b| {
            let near = (-(times[a] - times[b]).abs() / tau_s).exp();
            variance * ((1.0 - share) * near + if a == b { share } else { 0.0 })
        })
    };
    let mut best: Option<(f64, f64, f64)> = None;
    for tau_s in GUST_S {
        for share in SCATTER {
            let Some(factor) = kernel(tau_s, share).cholesky() else { continue };
            let log_det: f64 = factor.l_dirty().diagonal().iter().map(|v| v.ln()).sum();
            let likelihood = -0.5 * rest.dot(&factor.solve(&rest)) - log_det;
            if best.is_none_or(|(most, ..)| likelihood > most) {
                best = Some((likelihood, tau_s, share));
            }
        }
    }
    let Some((_, tau_s, share)) = best else { return values.to_vec() };
    let whole = kernel(tau_s, share);
    let Some(factor) = whole.clone().cholesky() else { return values.to_vec() };
    let mut signal = whole;
    for index in 0..count {
        signal[(index, index)] -= variance * share;
    }
    (signal * factor.solve(&rest)).iter().map(|value| value + mean).collect()
}

/// Fewest bins of horizontal flight that measure a lean law.
const FEWEST_MOVING: usize = 4;
/// Scatter of a bin's lean: gusts, and legs that are too short to settle, rad.
const UNIT_RAD: f64 = 0.005;
/// How far the model's own law is doubted: its quadratic part (a share), its linear part, rad/(m/s).
const SQUARE_DOUBT: f64 = 0.15;
const LINEAR_DOUBT: f64 = 0.01;
/// Gusts move neighbouring bins together: errors are larger than independent bins would say.
const TOGETHER: f64 = 2.0;

/// The lean in one bin and the velocity over ground.
struct Point {
    velocity_mps: [f64; 2],
    climb_mps: f64,
    lean_rad: [f64; 2],
    moves: bool,
    body_share: f64,
}

impl Point {
    fn of(bin: &super::bins::Bin, lean_rad: [f64; 2], body_share: f64) -> Self {
        let [x, y, climb_mps] = bin.velocity_mps;
        let moves = bin.is_horizontal();
        Self { velocity_mps: [x, y], climb_mps, lean_rad, moves, body_share }
    }

    /// Lean less what the law says, in units.
    fn off(&self, at: &[f64; 4]) -> [f64; 2] {
        let law = LeanLaw { linear: at[2], square: at[3], body_share: self.body_share };
        let air = [self.velocity_mps[0] - at[0], self.velocity_mps[1] - at[1]];
        let speed = air[0].hypot(air[1]).max(1e-9);
        let wanted = law.lean(speed, self.climb_mps);
        let off = |axis: usize| (self.lean_rad[axis] - wanted * air[axis] / speed) / UNIT_RAD;
        [off(0), off(1)]
    }
}

/// Units of the two parts of the law in the search.
const LINEAR_UNIT: f64 = 0.01;
const SQUARE_UNIT: f64 = 0.001;

fn misfit(points: &[Point], at: &[f64; 4], start: [f64; 4]) -> f64 {
    // A lean never goes against the wind.
    let negative = at[2].min(0.0) / 1e-4;
    let square_part = (at[3].max(1e-7) / start[3]).ln() / SQUARE_DOUBT;
    let linear_part = (at[2] - start[2]) / LINEAR_DOUBT;
    let weak = square_part.powi(2) + linear_part.powi(2);
    let square = |point: &Point| point.off(at).iter().map(|off| off * off).sum::<f64>();
    points.iter().map(square).sum::<f64>() + negative * negative + weak
}

/// Standard error of the linear part, by the curvature of the misfit at its bottom.
fn linear_se(points: &[Point], at: &[f64; 4]) -> f64 {
    let steps = [0.01, 0.01, 1e-5, 1e-6];
    let slope = |point: &Point, index: usize| {
        let mut moved = *at;
        moved[index] += steps[index];
        let (from, to) = (point.off(at), point.off(&moved));
        [(to[0] - from[0]) / steps[index], (to[1] - from[1]) / steps[index]]
    };
    let mut normal = Matrix4::zeros();
    let mut square = 0.0;
    for point in points {
        let off = point.off(at);
        square += off[0] * off[0] + off[1] * off[1];
        let slopes = [0, 1, 2, 3].map(|index| slope(point, index));
        for row in 0..4 {
            for column in 0..4 {
                normal[(row, column)] +=
                    slopes[row][0] * slopes[column][0] + slopes[row][1] * slopes[column][1];
            }
        }
    }
    let freedom = (2.0 * points.len() as f64 - 4.0).max(1.0);
    let covariance = normal.try_inverse().map_or(f64::INFINITY, |inverse| inverse[(2, 2)]);
    TOGETHER * (covariance * square / freedom).max(0.0).sqrt()
}
