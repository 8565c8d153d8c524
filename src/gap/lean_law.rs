//! How a vehicle leans in horizontal air.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};

use crate::base::air::SEA_LEVEL_DENSITY;
use crate::effects::Role;
use crate::sim::plant::drag::Drag;
use crate::sim::plant::trim::{Condition, Trim};
use crate::vehicle::Vehicle;

/// Standard gravity, m/s².
pub(super) const GRAVITY: f64 = 9.80665;
/// Rounds of the air speed by a lean, at most: each takes away half of the error or more. Numerical.
const ROUNDS: usize = 40;
/// Fastest wind that is believed, m/s: no small multirotor holds its place in more.
const FASTEST_MPS: f64 = 25.0;
/// Air speeds at which a law of leaning axes is made to fit the trim, m/s: up to a leg of 6 m/s into 8 m/s of wind.
const TRIM_SPEEDS_MPS: [f64; 6] = [1.0, 3.0, 5.0, 8.0, 11.0, 14.0];
/// Fewest whole speeds that a vehicle flies at for that, m/s.
const FEWEST_SPEEDS: usize = 6;
/// Directions of the air at which it is, degrees from the nose: a box leans otherwise along its diagonals than along its faces.
const TRIM_TURNS_DEG: [f64; 3] = [0.0, 22.5, 45.0];
/// Climbs at which it is, m/s: to the fastest rung of a ladder.
const TRIM_CLIMBS_MPS: [f64; 5] = [-3.5, -1.5, 0.0, 1.5, 3.5];
/// Farthest lean that is looked for, sine: beyond 64 degrees no autopilot flies.
const MOST_LEAN: f64 = 0.9;
/// Steps to a lean, at most: five are usual. Numerical.
const STEPS: usize = 20;
/// A step to a lean that is shorter is the last. Numerical.
const LAST_STEP: f64 = 1e-10;
/// Steps of its numerical derivatives, in a lean and in m/s.
const STEP: f64 = 1e-6;
/// No flow takes more of the drag off the rotors, as a share. A bound for what no vehicle does.
const LEAST_FLOW: f64 = 0.2;

/// How much a vehicle leans in horizontal air v while it climbs at V: the horizontal part of its thrust's direction, which is
/// the drag along each axis of its body as a share of its weight, `(a + b s |v|) v_i + b (1 - s) v_i |v_i|` with `|v|` the whole
/// air speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeanLaw {
    /// Linear part (drag of the rotors, a), rad/(m/s).
    pub linear: f64,
    /// Quadratic part (drag of the body, b), rad/(m/s)².
    pub square: f64,
    /// Share of the latter that is a body's in one piece (s), which goes with the whole air speed. The rest is
    /// a box's, each face of which feels only the air along its own axis.
    pub body_share: f64,
    /// Updraft that the law holds in, m/s: climbs are relative to it.
    pub updraft_mps: f64,
    /// Fastest air that it is read for, m/s: in which the vehicle flies.
    pub fastest_mps: f64,
    /// Of a vehicle that leans far: what the drag of its rotors goes with, and the air is taken along the axes of the leaning body.
    /// `None`: along level axes.
    pub leaning: Option<Leaning>,
}

/// Drag of rotors that lean, as a share of that in a hover: `1 + p w + q w |w| - r (1 - cos)` with w the air along their axis and
/// the cosine of the lean. It goes with the thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaning {
    /// Linear part by the air along the axis (p), 1/(m/s).
    pub axial: f64,
    /// Quadratic part (q), 1/(m/s)².
    pub axial_square: f64,
    /// Part that a lean takes away, whose axis no longer carries all of the weight (r), per versine of the lean.
    pub versine: f64,
}

impl Leaning {
    fn share(self, axial_mps: f64, cos: f64) -> f64 {
        let by_air = self.axial * axial_mps + self.axial_square * axial_mps * axial_mps.abs();
        (1.0 + by_air - self.versine * (1.0 - cos)).max(LEAST_FLOW)
    }
}

/// How a lean changes with the air, rad/(m/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slopes {
    /// Along each axis (row) with the horizontal air along each (column).
    pub by_air: Matrix2<f64>,
    /// Along each axis with the climb.
    pub by_climb: [f64; 2],
}

/// The cosine of a lean.
fn cos_of(lean: Vector2<f64>) -> f64 {
    (1.0 - lean.norm_squared()).max(1.0 - MOST_LEAN * MOST_LEAN).sqrt()
}

/// Axes of a body that leans, its nose above the show's x: what it feels along each of them.
#[derive(Clone, Copy, Debug)]
struct Body {
    lean: Vector2<f64>,
    cos: f64,
    /// Cosine of its lean over that of the angle by which its nose is off level.
    nose: f64,
}

impl Body {
    fn of(lean: Vector2<f64>) -> Self {
        let cos = cos_of(lean);
        Self { lean, cos, nose: (cos * cos + lean.x * lean.x).sqrt() }
    }

    /// The part of the weight along the nose, and to the left of it, as a share.
    fn weight(self) -> Vector2<f64> {
        Vector2::new(self.lean.x, self.lean.y * self.cos) / self.nose
    }

    /// The air along the same axes, and along that of the rotors, m/s, by that along level axes.
    fn air(self, level_mps: Vector2<f64>, climb_mps: f64) -> (Vector2<f64>, f64) {
        let Self { lean, cos, nose } = self;
        let forward = (cos * level_mps.x - lean.x * climb_mps) / nose;
        let aside = lean.x * level_mps.x + cos * climb_mps;
        let left = nose * level_mps.y - lean.y * aside / nose;
        (Vector2::new(forward, left), lean.dot(&level_mps) + cos * climb_mps)
    }

    /// The other way round: by the air along its axes in a climb through the air, that along the rotors' axis and along level axes.
    fn level(self, across_mps: Vector2<f64>, climb_mps: f64) -> (f64, Vector2<f64>) {
        let Self { lean, cos, nose } = self;
        let axial_mps = (climb_mps + across_mps.dot(&self.weight())) / cos;
        let x_mps = (cos * across_mps.x - lean.x * lean.y * across_mps.y) / nose;
        (axial_mps, Vector2::new(x_mps, nose * across_mps.y) + lean * axial_mps)
    }
}

impl LeanLaw {
    /// Lean law of a vehicle's model at an air density, kg/m³, in an updraft, m/s.
    pub fn of(vehicle: &Vehicle, density: f64, updraft_mps: f64) -> Self {
        // ArduPilot's own frame leans by 23 degrees in 8 m/s of wind, and drag that goes with thrust has no form in level axes.
        let goes_with_flow = Role::RotorDragFlow.value(vehicle).is_some_and(|part| part > 0.0);
        if (vehicle.airframe.sitl.is_some() || goes_with_flow)
            && let Some(law) = Self::by_trim(vehicle, density, updraft_mps)
        {
            return law;
        }
        let of = |role: Role| role.value(vehicle).unwrap_or(0.0);
        let factor = Drag::new(&vehicle.airframe).factor_m2();
        let box_m2 = (factor.x * factor.y).sqrt() * (1.0 + of(Role::FaceDragSide));
        let body_m2 = of(Role::BodyDragSide) / 2.0;
        Self {
            linear: of(Role::RotorDrag) + of(Role::MomentumDrag) / GRAVITY,
            square: density * (box_m2 + body_m2) / (vehicle.airframe.mass_kg * GRAVITY),
            body_share: body_m2 / (box_m2 + body_m2).max(1e-9),
            updraft_mps,
            fastest_mps: FASTEST_MPS,
            leaning: None,
        }
    }

    /// The law of leaning axes that is nearest to the leans of steady flight; `None` where there are none. By the air along the
    /// axes of the body, which the trim tells, it is linear in all of its parts.
    fn by_trim(vehicle: &Vehicle, density: f64, updraft_mps: f64) -> Option<Self> {
        let mut trim = Trim::of(vehicle).ok()?;
        let density_ratio = density / SEA_LEVEL_DENSITY;
        let mut lean = |velocity_mps: Vector3<f64>| {
            let condition = Condition { velocity_mps, density_ratio, ..Condition::default() };
            let balance = trim.balance(&condition)?;
            trim.pulse_us(&balance, &condition)?;
            Some(balance.lean)
        };
        let speeds = 1..=FASTEST_MPS as u32;
        let flown = |speed: &u32| lean(Vector3::new(f64::from(*speed), 0.0, 0.0)).is_some();
        let fastest = speeds.take_while(flown).count();
        if fastest < FEWEST_SPEEDS {
            return None;
        }
        // The other frame's own drag acts along the body's axes; only a body in one piece feels the whole air.
        let is_box = vehicle.airframe.sitl.is_some()
            && Role::BodyDragSide.value(vehicle).is_none_or(|side| side == 0.0);
        let columns = if is_box { 5 } else { 6 };
        let (mut parts, mut weights) = (Vec::new(), Vec::new());
        for speed_mps in TRIM_SPEEDS_MPS {
            for turn_deg in TRIM_TURNS_DEG {
                for climb_mps in TRIM_CLIMBS_MPS {
                    let (sin, cos) = turn_deg.to_radians().sin_cos();
                    let air_mps = Vector2::new(cos, sin) * speed_mps;
                    let Some(lean) = lean(Vector3::new(air_mps.x, air_mps.y, climb_mps)) else {
                        continue;
                    };
                    let body = Body::of(lean);
                    let (across, axial_mps) = body.air(air_mps, climb_mps);
                    let whole_mps = across.norm().hypot(axial_mps);
                    for axis in 0..2 {
                        let part = across[axis];
                        let all = [
                            part,
                            part * axial_mps,
                            part * axial_mps * axial_mps.abs(),
                            part * (body.cos - 1.0),
                            part * part.abs(),
                            part * whole_mps,
                        ];
                        parts.extend(&all[..columns]);
                        weights.push(body.weight()[axis]);
                    }
                }
            }
        }
        let parts = DMatrix::from_row_slice(weights.len(), columns, &parts);
        let found = parts.svd(true, true).solve(&DVector::from_vec(weights), 1e-12).ok()?;
        let linear = found[0];
        let share = |of: f64| if linear > 1e-6 { of / linear } else { 0.0 };
        let body = found.get(5).copied().unwrap_or(0.0).max(0.0);
        let square = found[4].max(0.0) + body;
        Some(Self {
            linear,
            square,
            body_share: body / square.max(1e-9),
            updraft_mps,
            fastest_mps: fastest as f64,
            leaning: Some(Leaning {
                axial: share(found[1]),
                axial_square: share(found[2]),
                versine: share(found[3]),
            }),
        })
    }

    /// Whether it reads the wind from leans as another law does: only a body in one piece, or axes that lean, take part in
    /// the updraft.
    pub(super) fn reads_as(self, other: Self) -> bool {
        let updraft_mps = if self.feels_updraft() { self.updraft_mps } else { other.updraft_mps };
        Self { updraft_mps, ..self } == other
    }

    /// Whether a lean depends on the climb through the air.
    pub(super) fn feels_updraft(self) -> bool {
        self.body_share != 0.0 || self.leaning.is_some()
    }

    fn box_square(self) -> f64 {
        self.square * (1.0 - self.body_share)
    }

    fn body_square(self) -> f64 {
        self.square * self.body_share
    }

    /// The same with the drag of a round body besides, rad/(m/s)².
    pub(super) fn with_body(self, more: f64) -> Self {
        let square = (self.square + more).max(1e-9);
        Self { square, body_share: (self.body_square() + more) / square, ..self }
    }

    /// The lean in horizontal air, show frame.
    pub(super) fn lean(self, air_mps: [f64; 2], climb_mps: f64) -> [f64; 2] {
        let axial_mps = climb_mps - self.updraft_mps;
        if let Some(leaning) = self.leaning {
            return self.balanced(leaning, (air_mps.into(), axial_mps)).into();
        }
        let square_mps2 = air_mps[0] * air_mps[0] + air_mps[1] * air_mps[1];
        let whole_mps = (square_mps2 + axial_mps * axial_mps).sqrt();
        let linear = self.linear + self.body_square() * whole_mps;
        air_mps.map(|part| (linear + self.box_square() * part.abs()) * part)
    }

    /// What drag has more than weight along the axes of a body that leans, as a share of the weight.
    fn left_over(
        self,
        leaning: Leaning,
        (air_mps, climb_mps): (Vector2<f64>, f64),
        lean: Vector2<f64>,
    ) -> Vector2<f64> {
        let body = Body::of(lean);
        let (across_mps, axial_mps) = body.air(air_mps, climb_mps);
        let mut linear = self.linear * leaning.share(axial_mps, body.cos);
        if self.body_share != 0.0 {
            let whole_mps = (across_mps.norm_squared() + axial_mps * axial_mps).sqrt();
            linear += self.body_square() * whole_mps;
        }
        across_mps.map(|part| (linear + self.box_square() * part.abs()) * part) - body.weight()
    }

    /// Where they are in balance, by Broyden's method: each step costs one more look.
    fn balanced(self, leaning: Leaning, air: (Vector2<f64>, f64)) -> Vector2<f64> {
        let left_over = |lean: Vector2<f64>| self.left_over(leaning, air, lean);
        let within = |lean: Vector2<f64>| lean.cap_magnitude(MOST_LEAN);
        let level = left_over(Vector2::zeros());
        let mut lean = within(level / (1.0 + level.norm_squared()).sqrt());
        let mut off = left_over(lean);
        let Some(mut inverse) = differences(lean, off, left_over).try_inverse() else {
            return lean;
        };
        for _ in 0..STEPS {
            let next = within(lean - inverse * off);
            let moved = next - lean;
            let next_off = left_over(next);
            let reached = inverse * (next_off - off);
            (lean, off) = (next, next_off);
            let along = moved.dot(&reached);
            if moved.norm_squared() < LAST_STEP * LAST_STEP || along == 0.0 {
                break;
            }
            inverse += (moved - reached) * (moved.transpose() * inverse) / along;
        }
        lean
    }

    /// Change of the lean with the air at a horizontal air speed, rad/(m/s).
    pub(super) fn slope(self, speed_mps: f64) -> f64 {
        self.linear + 2.0 * self.square * speed_mps
    }

    /// The lean in horizontal air, show frame, and its changes with the air.
    pub(super) fn lean_and_slopes(self, air_mps: [f64; 2], climb_mps: f64) -> ([f64; 2], Slopes) {
        let axial_mps = climb_mps - self.updraft_mps;
        if let Some(leaning) = self.leaning {
            let (lean, slopes) = self.balance_and_slopes(leaning, (air_mps.into(), axial_mps));
            return (lean.into(), slopes);
        }
        let square_mps2 = air_mps[0] * air_mps[0] + air_mps[1] * air_mps[1];
        let whole_mps = (square_mps2 + axial_mps * axial_mps).sqrt().max(1e-6);
        let body = self.body_square();
        let by_air = Matrix2::from_fn(|row, column| {
            let turned = body / whole_mps * air_mps[row] * air_mps[column];
            let both = self.linear + body * whole_mps;
            let own = both + 2.0 * self.box_square() * air_mps[row].abs();
            turned + if row == column { own } else { 0.0 }
        });
        let by_climb = air_mps.map(|part| body * axial_mps / whole_mps * part);
        (self.lean(air_mps, climb_mps), Slopes { by_air, by_climb })
    }

    fn balance_and_slopes(
        self,
        leaning: Leaning,
        (air_mps, climb_mps): (Vector2<f64>, f64),
    ) -> (Vector2<f64>, Slopes) {
        let lean = self.balanced(leaning, (air_mps, climb_mps));
        let off = self.left_over(leaning, (air_mps, climb_mps), lean);
        let by_air = differences(air_mps, off, |air_mps| {
            self.left_over(leaning, (air_mps, climb_mps), lean)
        });
        let higher = self.left_over(leaning, (air_mps, climb_mps + STEP), lean);
        let by_climb = (higher - off) / STEP;
        let by_lean =
            differences(lean, off, |lean| self.left_over(leaning, (air_mps, climb_mps), lean));
        let turned = by_lean.try_inverse().map_or_else(Matrix2::identity, |inverse| -inverse);
        (lean, Slopes { by_air: turned * by_air, by_climb: (turned * by_climb).into() })
    }

    /// Horizontal air over ground-fixed axes by the lean of the thrust axis, m/s.
    pub(super) fn air(self, lean_rad: [f64; 2], climb_mps: f64) -> [f64; 2] {
        if let Some(leaning) = self.leaning {
            return self
                .air_of_leaning(leaning, lean_rad.into(), climb_mps - self.updraft_mps)
                .into();
        }
        let mut speed_mps: f64 = 1.0;
        let mut air_mps = [0.0; 2];
        for _ in 0..ROUNDS {
            let axial_mps = climb_mps - self.updraft_mps;
            let whole_mps = (speed_mps * speed_mps + axial_mps * axial_mps).sqrt();
            air_mps = self.air_near(lean_rad, self.linear + self.body_square() * whole_mps);
            let next_mps = air_mps[0].hypot(air_mps[1]);
            // The body's part goes with the square: the middle of two rounds is nearly the end.
            let middle_mps = (next_mps * speed_mps).sqrt();
            let near = (middle_mps - speed_mps).abs() < 1e-8 * middle_mps;
            speed_mps = middle_mps.max(1e-9);
            if self.body_share == 0.0 || near {
                break;
            }
        }
        air_mps
    }

    /// The air in which a body that leans is in balance: along its own axes it follows from the lean.
    fn air_of_leaning(self, leaning: Leaning, lean: Vector2<f64>, climb_mps: f64) -> Vector2<f64> {
        let body = Body::of(lean.cap_magnitude(MOST_LEAN));
        let (mut axial_mps, mut air_mps) = (climb_mps, Vector2::zeros());
        let mut speed_mps: f64 = 1.0;
        for _ in 0..ROUNDS {
            let rotors = self.linear * leaning.share(axial_mps, body.cos);
            let linear = rotors + self.body_square() * speed_mps.hypot(axial_mps);
            let across_mps = Vector2::from(self.air_near(body.weight().into(), linear));
            (axial_mps, air_mps) = body.level(across_mps, climb_mps);
            let middle_mps = (across_mps.norm() * speed_mps).sqrt();
            let near = (middle_mps - speed_mps).abs() < 1e-8 * middle_mps;
            speed_mps = middle_mps.max(1e-9);
            if near {
                break;
            }
        }
        air_mps.cap_magnitude(self.fastest_mps)
    }

    /// The air along each axis by the leans, with the linear part as it is there, rad/(m/s).
    fn air_near(self, lean_rad: [f64; 2], linear: f64) -> [f64; 2] {
        let square = self.box_square();
        lean_rad.map(|lean: f64| {
            let size = if square > 1e-12 {
                let root = (linear * linear + 4.0 * square * lean.abs()).sqrt();
                // Without the difference of nearly equal numbers.
                2.0 * lean.abs() / (root + linear).max(1e-12)
            } else {
                lean.abs() / linear.max(1e-6)
            };
            size.min(self.fastest_mps).copysign(lean)
        })
    }
}

/// Derivatives of two numbers by two, which are `here` at a place.
fn differences(
    at: Vector2<f64>,
    here: Vector2<f64>,
    of: impl Fn(Vector2<f64>) -> Vector2<f64>,
) -> Matrix2<f64> {
    let by = |axis: Vector2<f64>| (of(at + axis * STEP) - here) / STEP;
    Matrix2::from_columns(&[by(Vector2::x()), by(Vector2::y())])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    /// Leans of steady flight and what a law makes of them: most that the lean, sine, and the air that is read, m/s, are off by, at
    /// these air speeds, m/s, in all directions and climbs.
    fn most_off(vehicle: &Vehicle, speeds_mps: &[f64], climbs_mps: &[f64]) -> (f64, f64) {
        let law = LeanLaw::of(vehicle, SEA_LEVEL_DENSITY, 0.0);
        let mut trim = Trim::of(vehicle).unwrap();
        let mut most = (0.0_f64, 0.0_f64);
        for speed_mps in speeds_mps {
            for turn_deg in [0.0_f64, 10.0, 30.0, 45.0, 70.0, 120.0, 200.0] {
                for climb_mps in climbs_mps {
                    let (sin, cos) = turn_deg.to_radians().sin_cos();
                    let air_mps = Vector2::new(cos, sin) * *speed_mps;
                    let velocity_mps = Vector3::new(air_mps.x, air_mps.y, *climb_mps);
                    let condition = Condition { velocity_mps, ..Condition::default() };
                    let lean = trim.balance(&condition).unwrap().lean;
                    let by_law = Vector2::from(law.lean(air_mps.into(), *climb_mps));
                    let read_mps = Vector2::from(law.air(lean.into(), *climb_mps));
                    most.0 = most.0.max((by_law - lean).norm());
                    most.1 = most.1.max((read_mps - air_mps).norm());
                }
            }
        }
        most
    }

    #[test]
    fn the_firmwares_own_vehicle_leans_by_its_trim_in_any_wind() {
        let mut vehicle = builtin("arducopter-sitl").unwrap();
        let climbs_mps = [-3.5, -1.0, 0.0, 2.0, 3.5];
        let (lean, air_mps) = most_off(&vehicle, &[1.0, 3.0, 6.0, 8.0, 11.0], &climbs_mps);
        assert!(lean < 0.001 && air_mps < 0.02, "{lean}, {air_mps} m/s");
        Role::MomentumDrag.set(&mut vehicle, 0.3);
        let (lean, air_mps) = most_off(&vehicle, &[1.0, 3.0, 6.0, 8.0], &climbs_mps);
        assert!(lean < 0.0025 && air_mps < 0.04, "{lean}, {air_mps} m/s");
    }

    #[test]
    fn a_round_body_on_the_firmwares_own_vehicle_leans_by_its_trim() {
        // The largest doubles the frame's own drag.
        for (size, most_lean) in [(0.01, 0.001), (0.03, 0.001), (0.184, 0.002)] {
            let mut vehicle = builtin("arducopter-sitl").unwrap();
            Role::BodyDragTop.set(&mut vehicle, size);
            Role::BodyDragSide.set(&mut vehicle, size);
            let (lean, air_mps) = most_off(&vehicle, &[1.0, 3.0, 6.0], &[-3.5, -1.0, 0.0, 3.5]);
            assert!(lean < most_lean && air_mps < 0.02, "{size}: {lean}, {air_mps} m/s");
        }
    }

    #[test]
    fn rotors_whose_drag_goes_with_the_flow_lean_by_their_trim_in_any_wind() {
        let mut vehicle = builtin("pixel").unwrap();
        Role::RotorDrag.set(&mut vehicle, 0.008);
        Role::RotorDragFlow.set(&mut vehicle, 0.7);
        Role::BodyDragTop.set(&mut vehicle, 0.018);
        Role::BodyDragSide.set(&mut vehicle, 0.012);
        let (lean, air_mps) = most_off(&vehicle, &[2.0, 5.0, 9.0], &[-2.0, 0.0, 3.0]);
        assert!(lean < 0.005 && air_mps < 0.4, "{lean}, {air_mps} m/s");
    }

    #[test]
    fn a_law_tells_how_much_more_a_drag_of_the_rotors_leans() {
        let mut vehicle = builtin("arducopter-sitl").unwrap();
        let law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        Role::MomentumDrag.set(&mut vehicle, 0.3);
        let more = LeanLaw { linear: law.linear + 0.3 / GRAVITY, ..law };
        let mut trim = Trim::of(&vehicle).unwrap();
        for speed_mps in [3.0, 8.0, 11.0] {
            let velocity_mps = Vector3::new(speed_mps, 0.0, 0.0);
            let lean =
                trim.balance(&Condition { velocity_mps, ..Condition::default() }).unwrap().lean.x;
            let [by_law, _] = more.lean([speed_mps, 0.0], 0.0);
            assert!((by_law - lean).abs() < 0.01 * lean, "{speed_mps}: {by_law} for {lean}");
        }
    }

    #[test]
    fn slopes_are_the_changes_of_the_lean() {
        let sitl = LeanLaw::of(&builtin("arducopter-sitl").unwrap(), SEA_LEVEL_DENSITY, 1.0);
        let pixel = LeanLaw::of(&builtin("pixel").unwrap(), SEA_LEVEL_DENSITY, 1.0);
        for law in [sitl, sitl.with_body(0.002), pixel.with_body(0.002)] {
            for air_mps in [[5.0, -3.0], [-9.0, 1.0], [0.2, 0.1]] {
                for climb_mps in [-3.0, 2.0] {
                    let (_, slopes) = law.lean_and_slopes(air_mps, climb_mps);
                    let higher = law.lean(air_mps, climb_mps + 1e-4);
                    let lower = law.lean(air_mps, climb_mps - 1e-4);
                    for axis in 0..2 {
                        let off = slopes.by_climb[axis] - (higher[axis] - lower[axis]) / 2e-4;
                        assert!(off.abs() < 1e-6, "{law:?} {air_mps:?}: {slopes:?}");
                    }
                    for axis in 0..2 {
                        let at = |by_mps: f64| {
                            let mut there_mps = air_mps;
                            there_mps[axis] += by_mps;
                            law.lean(there_mps, climb_mps)
                        };
                        let (up, down) = (at(1e-4), at(-1e-4));
                        for row in 0..2 {
                            let change = (up[row] - down[row]) / 2e-4;
                            let off = slopes.by_air[(row, axis)] - change;
                            assert!(off.abs() < 1e-6, "{law:?} {air_mps:?}: {slopes:?} {change}");
                        }
                    }
                    let lean = law.lean(air_mps, climb_mps);
                    let back_mps = law.air(lean, climb_mps);
                    let off_mps = (back_mps[0] - air_mps[0]).hypot(back_mps[1] - air_mps[1]);
                    assert!(off_mps < 1e-5, "{law:?}: {back_mps:?} for {air_mps:?}");
                }
            }
        }
    }

    #[test]
    fn a_lean_that_no_vehicle_has_reads_no_wind_that_none_flies_in() {
        let law = LeanLaw::of(&builtin("arducopter-sitl").unwrap(), SEA_LEVEL_DENSITY, 0.0);
        for lean in [1.0, 3.0, 1e9] {
            let [x_mps, y_mps] = law.air([0.0, lean], 0.0);
            assert!(x_mps == 0.0 && y_mps > 12.0 && y_mps < FASTEST_MPS, "{x_mps} {y_mps}");
        }
        let found = law.lean([30.0, 0.0], 0.0);
        assert!(found[0].is_finite() && found[0] <= MOST_LEAN + 1e-9, "{found:?}");
    }
}
