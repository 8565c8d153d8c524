//! Wind from the leans of the fleet.

use nalgebra::{DMatrix, DVector, Matrix2, Vector3};

use super::bins::{Bin, BinValues};
use super::data::{Data, Group};
use super::filter::{Filter, LooksAt, Observation, State};
use super::lean_fit::{Body, Fitted, Point, fit, fit_body, hovering_wind};
use super::lean_misfit;
use crate::base::air::SEA_LEVEL_DENSITY;
use crate::effects::Role;
use crate::numeric::Moments;
use crate::sim::plant::drag::Drag;
use crate::sim::plant::trim::{Condition, Trim};
use crate::vehicle::Vehicle;

/// Standard gravity, m/s².
pub(super) const GRAVITY: f64 = 9.80665;
/// Below this slope of the lean a bin's own lean says less than the flight's mean wind, rad/(m/s): noise of
/// the attitude of 0.1 degrees would be 0.4 m/s. Chosen.
const LEAST_SLOPE: f64 = 0.004;
/// Rounds of the air speed by a lean, at most: each takes away half of the error or more. Numerical.
const ROUNDS: usize = 40;
/// A law is made to fit the trim at every whole speed up to this, m/s: a leg of 6 m/s into 8 m/s of wind.
const LAW_SPEEDS_MPS: usize = 14;
/// And at as many of them at least.
const FEWEST_LAW_SPEEDS: usize = 6;
/// Air speed at which a diagonal wind tells a body in one piece from a box, m/s: where drag is most of the lean.
const BODY_SPEED_MPS: f64 = 8.0;
/// Air speed at which the load of climbs is read from the trim, m/s: a usual wind.
const LOAD_SPEED_MPS: f64 = 4.0;
/// Climb at which it is read, m/s: the fastest rung of a ladder.
const LOAD_CLIMB_MPS: f64 = 3.5;
/// Steps in which the slower of two air speeds is looked for, m/s. Numerical: two roots of a law are farther apart.
const SPEED_STEP_MPS: f64 = 0.5;
/// No descent takes more of the weight off the rotors, as a share.
const LEAST_LOAD: f64 = 0.3;
/// Fastest wind that is believed, m/s: no small multirotor holds its place in more.
const FASTEST_MPS: f64 = 25.0;

/// Lean of a vehicle in horizontal air v, along each axis of its body, while it climbs at V: `(a + b s sqrt(v² + V²)
/// + c v²) v_i + b (1 - s) v_i |v_i|`, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeanLaw {
    /// Linear part (blade flapping, a), rad/(m/s).
    pub linear: f64,
    /// Quadratic part (drag, b), rad/(m/s)².
    pub square: f64,
    /// Share of the drag that is a body's in one piece (s), which goes with the whole air speed. The rest is
    /// a box's, each face of which feels only the air along its own axis.
    pub body_share: f64,
    /// Cubic part of the lean (c), rad/(m/s)³: whoever leans far has to pull more.
    pub cube: f64,
    /// Updraft that the law holds in, m/s: climbs are relative to it.
    pub updraft_mps: f64,
    /// Fastest air that it is read for, m/s: in which the vehicle flies.
    pub fastest_mps: f64,
    /// Load of the rotors in a climb, as far as it is known: `1 + p V + q V|V|` of the weight (p, q). Who pulls
    /// more leans less in the same wind.
    pub load: [f64; 2],
}

impl LeanLaw {
    /// Lean law of a vehicle's model at an air density, kg/m³, in an updraft, m/s.
    pub fn of(vehicle: &Vehicle, density: f64, updraft_mps: f64) -> Self {
        // The law has the very form of the other frames' drag, and no part for what this one's does with thrust.
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
            cube: 0.0,
            updraft_mps,
            fastest_mps: FASTEST_MPS,
            load: [0.0; 2],
        }
    }

    /// The law that is nearest to the leans of steady flight; `None` where there is none.
    fn by_trim(vehicle: &Vehicle, density: f64, updraft_mps: f64) -> Option<Self> {
        let mut trim = Trim::of(vehicle).ok()?;
        let density_ratio = density / SEA_LEVEL_DENSITY;
        let mut lean_rad = |[x_mps, y_mps, climb_mps]: [f64; 3]| {
            let velocity_mps = Vector3::new(x_mps, y_mps, climb_mps);
            let condition = Condition { velocity_mps, density_ratio, ..Condition::default() };
            let balance = trim.balance(&condition)?;
            trim.pulse_us(&balance, &condition)?;
            Some(balance.lean.x.asin())
        };
        let speeds = (1..=FASTEST_MPS as u32).map(f64::from);
        let mut leans: Vec<(f64, f64)> =
            speeds.map_while(|speed| Some((speed, lean_rad([speed, 0.0, 0.0])? / speed))).collect();
        if leans.len() < FEWEST_LAW_SPEEDS {
            return None;
        }
        let fastest_mps = leans.len() as f64;
        leans.truncate(LAW_SPEEDS_MPS);
        let powers = DMatrix::from_fn(leans.len(), 3, |row, power| leans[row].0.powi(power as i32));
        let per_speed = DVector::from_iterator(leans.len(), leans.iter().map(|(_, lean)| *lean));
        let found = powers.svd(true, true).solve(&per_speed, 1e-12).ok()?;
        let (linear, square, cube) = (found[0], found[1], found[2]);
        // Along a diagonal a box's faces each feel their part of the speed, and a body in one piece feels all of it.
        let part_mps = BODY_SPEED_MPS * std::f64::consts::FRAC_1_SQRT_2;
        let diagonal = lean_rad([part_mps, part_mps, 0.0])? / part_mps
            - lean_rad([BODY_SPEED_MPS, 0.0, 0.0])? / BODY_SPEED_MPS;
        let of_box = square * (part_mps - BODY_SPEED_MPS);
        // The other frame's drag acts along the body's axes.
        let is_box = vehicle.airframe.sitl.is_some();
        let body_share =
            if is_box { 0.0 } else { (1.0 - diagonal / of_box.min(-1e-9)).clamp(0.0, 1.0) };
        let load = [0.0; 2];
        let still = Self { linear, square, body_share, cube, updraft_mps: 0.0, fastest_mps, load };
        let mut less = |climb_mps: f64| {
            let [level, _] = still.lean([LOAD_SPEED_MPS, 0.0], climb_mps);
            Some(level / lean_rad([LOAD_SPEED_MPS, 0.0, climb_mps])? - 1.0)
        };
        let (up, down) = (less(LOAD_CLIMB_MPS)?, less(-LOAD_CLIMB_MPS)?);
        // What is odd in the climb at its half tells the line from the square.
        let odd = 0.5 * (up - down);
        let half = 0.5 * (less(0.5 * LOAD_CLIMB_MPS)? - less(-0.5 * LOAD_CLIMB_MPS)?);
        let straight = (4.0 * half - odd) / LOAD_CLIMB_MPS;
        let bent = (odd / LOAD_CLIMB_MPS - straight) / LOAD_CLIMB_MPS;
        Some(Self { load: [straight, bent], updraft_mps, ..still })
    }

    /// Whether it reads the wind from leans as another law does: only a body in one piece, or rotors that carry more or
    /// less in a climb, lean otherwise in another updraft.
    pub(super) fn reads_as(self, other: Self) -> bool {
        let feels_updraft = self.body_share != 0.0 || self.load != [0.0; 2];
        let updraft_mps = if feels_updraft { self.updraft_mps } else { other.updraft_mps };
        Self { updraft_mps, ..self } == other
    }

    /// What the rotors carry in a climb over ground, as a share of hover in still air.
    fn load(self, climb_mps: f64) -> f64 {
        let [linear, square] = self.load;
        let climb_mps = climb_mps - self.updraft_mps;
        (1.0 + linear * climb_mps + square * climb_mps * climb_mps.abs()).max(LEAST_LOAD)
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
        let square_mps2 = air_mps[0] * air_mps[0] + air_mps[1] * air_mps[1];
        let whole_mps = (square_mps2 + axial_mps * axial_mps).sqrt();
        let linear = self.linear + self.body_square() * whole_mps + self.cube * square_mps2;
        let load = self.load(climb_mps);
        air_mps.map(|part| (linear + self.box_square() * part.abs()) * part / load)
    }

    /// Change of the lean with the air at a horizontal air speed, rad/(m/s).
    fn slope(self, speed_mps: f64) -> f64 {
        self.linear + (2.0 * self.square + 3.0 * self.cube * speed_mps) * speed_mps
    }

    /// Change of each axis' lean with each axis' air, rad/(m/s).
    pub(super) fn slopes(self, air_mps: [f64; 2], climb_mps: f64) -> Matrix2<f64> {
        let axial_mps = climb_mps - self.updraft_mps;
        let square_mps2 = air_mps[0] * air_mps[0] + air_mps[1] * air_mps[1];
        let whole_mps = (square_mps2 + axial_mps * axial_mps).sqrt().max(1e-6);
        let body = self.body_square();
        let load = self.load(climb_mps);
        Matrix2::from_fn(|row, column| {
            let turned = (body / whole_mps + 2.0 * self.cube) * air_mps[row] * air_mps[column];
            let both = self.linear + body * whole_mps + self.cube * square_mps2;
            let own = both + 2.0 * self.box_square() * air_mps[row].abs();
            (turned + if row == column { own } else { 0.0 }) / load
        })
    }

    /// Horizontal air over ground-fixed axes by the lean of the thrust axis, m/s.
    pub(super) fn air(self, lean_rad: [f64; 2], climb_mps: f64) -> [f64; 2] {
        let lean_rad = lean_rad.map(|lean| lean * self.load(climb_mps));
        let mut speed_mps: f64 = 1.0;
        let mut air_mps = [0.0; 2];
        for _ in 0..ROUNDS {
            air_mps = self.air_near(lean_rad, climb_mps, speed_mps);
            let next_mps = air_mps[0].hypot(air_mps[1]);
            // The body's part goes with the square: the middle of two rounds is nearly the end.
            let middle_mps = (next_mps * speed_mps).sqrt();
            let near = (middle_mps - speed_mps).abs() < 1e-8 * middle_mps;
            speed_mps = middle_mps.max(1e-9);
            if self.body_share == 0.0 && self.cube == 0.0 || near {
                break;
            }
        }
        if speed_mps < self.fastest_mps { air_mps } else { self.slowest_air(lean_rad, climb_mps) }
    }

    /// The air by leans where a law that bends down again at high speeds has two, or none: the slower one, or the one at
    /// which it leans most.
    fn slowest_air(self, lean_rad: [f64; 2], climb_mps: f64) -> [f64; 2] {
        let lacks_mps = |speed_mps: f64| {
            let [x_mps, y_mps] = self.air_near(lean_rad, climb_mps, speed_mps);
            x_mps.hypot(y_mps) - speed_mps
        };
        let (mut nearest_mps, mut least_mps) = (self.fastest_mps, f64::INFINITY);
        let steps = (self.fastest_mps / SPEED_STEP_MPS) as u32;
        for speed_mps in (1..=steps).map(|step| SPEED_STEP_MPS * f64::from(step)) {
            let there_mps = lacks_mps(speed_mps);
            if there_mps < least_mps {
                (nearest_mps, least_mps) = (speed_mps, there_mps);
            }
            if there_mps <= 0.0 {
                break;
            }
        }
        if least_mps > 0.0 {
            let [x_rad, y_rad] = lean_rad;
            let lean = x_rad.hypot(y_rad).max(1e-12);
            return lean_rad.map(|part| part / lean * nearest_mps);
        }
        let (mut low_mps, mut high_mps) = (nearest_mps - SPEED_STEP_MPS, nearest_mps);
        for _ in 0..ROUNDS {
            let middle_mps = f64::midpoint(low_mps, high_mps);
            if lacks_mps(middle_mps) > 0.0 { low_mps = middle_mps } else { high_mps = middle_mps }
        }
        self.air_near(lean_rad, climb_mps, high_mps)
    }

    /// The air by leans of an unloaded law whose bent parts are taken at a speed.
    fn air_near(self, lean_rad: [f64; 2], climb_mps: f64, speed_mps: f64) -> [f64; 2] {
        let axial_mps = climb_mps - self.updraft_mps;
        let whole_mps = (speed_mps * speed_mps + axial_mps * axial_mps).sqrt();
        let linear =
            self.linear + self.body_square() * whole_mps + self.cube * speed_mps * speed_mps;
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

/// The horizontal air as the leans of a flight show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    /// Mean wind, show frame, the direction it blows to, m/s; of several flights that of all together.
    pub mean_mps: [f64; 2],
    /// Where the logs are of several flights: the mean wind of that which each group flew in, m/s; empty otherwise.
    pub of_groups_mps: Vec<[f64; 2]>,
    /// Standard error of the mean wind along either axis, m/s.
    pub mean_se_mps: f64,
    /// That of each group's own mean wind, m/s; empty: they share one.
    pub of_groups_se_mps: Vec<f64>,
    /// Air speed of each group's drones in each bin, show frame, m/s.
    pub air_mps: Vec<Vec<[f64; 2]>>,
    /// Lean law that the flight's horizontal legs showed; `None` if it has none, so that the
    /// model's was taken.
    pub measured: Option<Measured>,
}

/// A lean law measured by horizontal legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Most probable law.
    pub law: LeanLaw,
    /// Standard error of the law's linear part, rad/(m/s).
    pub linear_se: f64,
    /// Minus the logarithm of its posterior density, but for a constant, nats.
    pub misfit_nats: f64,
}

/// Finds the wind. Horizontal legs at known speeds measure the lean law as well.
///
/// `flown` is the simulated side with the air that it was flown in: legs are short, and what a lean
/// still lacks of its steady value there lacks in the simulator, too.
pub(super) fn wind(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> Wind {
    wind_by(data, law, law, flown)
}

/// The wind that a law reads where the simulated side was flown by another: what a lean lacks of its steady value is
/// the other's.
pub(super) fn wind_by(
    data: &Data,
    law: LeanLaw,
    flown_law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> Wind {
    let leans = settled_leans(data, flown_law, flown);
    let MeanWind { mean_mps, law, legs } = MeanWind::of(data, &leans, law, flown.is_some());
    let of_groups_mps = of_flights(data, &leans, law);
    let air_mps = data
        .groups
        .iter()
        .zip(&leans)
        .enumerate()
        .map(|(index, (group, leans))| {
            let mean_mps = of_groups_mps.get(index).copied().unwrap_or(mean_mps);
            let air = |(bin, lean): (&Bin, &[f64; 2])| {
                let steady = [bin.velocity_mps[0] - mean_mps[0], bin.velocity_mps[1] - mean_mps[1]];
                let tells = law.slope(steady[0].hypot(steady[1])) > LEAST_SLOPE;
                if tells { law.air(*lean, bin.climb_mps()) } else { steady }
            };
            let raw: Vec<[f64; 2]> = group.bins.iter().zip(leans).map(air).collect();
            smooth(group, &raw)
        })
        .collect();
    let doubt_mps = |mean_mps: &[f64; 2]| {
        let speed_mps = mean_mps[0].hypot(mean_mps[1]);
        let law_mps = legs.as_ref().map_or(LAW_DOUBT * speed_mps, |legs| {
            legs.mean_se_mps.hypot(LEGS_DOUBT * speed_mps).min(LAW_DOUBT * speed_mps)
        });
        LEAST_DOUBT_MPS.hypot(law_mps)
    };
    let mean_se_mps = doubt_mps(&mean_mps);
    let of_groups_se_mps = of_groups_mps.iter().map(doubt_mps).collect();
    let measured =
        legs.map(|legs| Measured { law, linear_se: legs.linear_se, misfit_nats: legs.misfit_nats });
    Wind { mean_mps, of_groups_mps, mean_se_mps, of_groups_se_mps, air_mps, measured }
}

/// The mean wind of the flight that each group flew in, by a law, m/s; empty: there is one flight.
fn of_flights(data: &Data, leans: &[Vec<[f64; 2]>], law: LeanLaw) -> Vec<[f64; 2]> {
    if data.flights().len() < 2 {
        return Vec::new();
    }
    let of_group = |group: &Group| {
        let is_own = |other: &Group| other.flight == group.flight;
        let own = data.groups.iter().zip(leans).filter(|(other, _)| is_own(other));
        hovering_wind(&points(own), law)
    };
    data.groups.iter().map(of_group).collect()
}

/// Standard error along an axis with which the leans of a flight that is yet to be flown will tell a mean wind, m/s.
pub(super) fn told_within_mps(data: &Data, mean_mps: [f64; 2]) -> f64 {
    let share = if data.has_legs() { LEGS_DOUBT } else { LAW_DOUBT };
    LEAST_DOUBT_MPS.hypot(share * mean_mps[0].hypot(mean_mps[1]))
}

/// Mean of the wind that [`wind`] finds, show frame, m/s.
pub(super) fn mean_wind(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> [f64; 2] {
    mean_wind_by(data, law, law, flown)
}

/// As [`mean_wind`], by a law other than the one by which the simulated side was flown.
pub(super) fn mean_wind_by(
    data: &Data,
    law: LeanLaw,
    flown_law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> [f64; 2] {
    MeanWind::of(data, &settled_leans(data, flown_law, flown), law, flown.is_some()).mean_mps
}

/// Mean leans of each group, by bin, less what they lack of their steady values, rad.
fn settled_leans(
    data: &Data,
    law: LeanLaw,
    flown: Option<(&[Vec<BinValues>], [f64; 3])>,
) -> Vec<Vec<[f64; 2]>> {
    data.groups
        .iter()
        .enumerate()
        .map(|(index, group)| {
            let lean = |bin: usize| {
                let mean = |axis: usize| group.mean(bin, |values| values.lean_rad[axis]);
                let unsettled = flown.and_then(|(side, [x_mps, y_mps, updraft_mps])| {
                    let there = LeanLaw { updraft_mps, ..law };
                    let values = side.get(index)?.get(bin)?;
                    let velocity = group.bins[bin].velocity_mps;
                    let air = [velocity[0] - x_mps, velocity[1] - y_mps];
                    let steady = there.lean(air, velocity[2]);
                    Some([values.lean_rad[0] - steady[0], values.lean_rad[1] - steady[1]])
                });
                let [x, y] = unsettled.unwrap_or_default();
                [mean(0) - x, mean(1) - y]
            };
            (0..group.bins.len()).map(lean).collect()
        })
        .collect()
}

/// The mean lean of groups in each bin.
fn points<'a>(groups: impl Iterator<Item = (&'a Group, &'a Vec<[f64; 2]>)>) -> Vec<Point> {
    let of_group = |(group, leans): (&Group, &Vec<[f64; 2]>)| -> Vec<Point> {
        let height_m = |bin: usize| group.mean(bin, |values| values.height_m);
        let each = group.bins.iter().zip(leans).enumerate();
        each.map(|(place, (bin, lean))| Point::of(bin, height_m(place), *lean)).collect()
    };
    groups.flat_map(of_group).collect()
}

/// Whether there are legs enough to fit a law to.
fn moves(points: &[Point]) -> bool {
    points.iter().filter(|point| point.moves).count() >= FEWEST_MOVING
}

/// A round body that the model lacks, by the legs that measured a law from the model's; `None`: there are none. `flown` is as
/// in [`wind`].
pub(super) fn body(
    data: &Data,
    law: LeanLaw,
    flown: (&[Vec<BinValues>], [f64; 3]),
    measured: &Measured,
) -> Option<Body> {
    let leans = settled_leans(data, law, Some(flown));
    let points = points(data.groups.iter().zip(&leans));
    moves(&points).then(|| fit_body(points, law, measured.misfit_nats))
}

/// How unlikely the leans are by a vehicle's law in the updraft that it holds in, nats, but for a constant. `flown` is as in
/// [`wind`].
pub(super) fn misfit_nats(data: &Data, law: LeanLaw, flown: (&[Vec<BinValues>], [f64; 3])) -> f64 {
    let leans = settled_leans(data, law, Some(flown));
    lean_misfit::misfit_nats(points(data.groups.iter().zip(&leans)), law)
}

/// The mean of the wind with the law of the lean that it was read by.
struct MeanWind {
    mean_mps: [f64; 2],
    law: LeanLaw,
    /// What horizontal legs said of both.
    legs: Option<Fitted>,
}

impl MeanWind {
    fn of(data: &Data, leans: &[Vec<[f64; 2]>], law: LeanLaw, is_flown: bool) -> Self {
        let points = points(data.groups.iter().zip(leans));
        if moves(&points) && is_flown {
            let legs = fit(points, law);
            return Self { mean_mps: legs.mean_mps, law: legs.law, legs: Some(legs) };
        }
        Self { mean_mps: hovering_wind(&points, law), law, legs: None }
    }
}

/// Least error of the wind that leans show, m/s: the trim of an attitude, some tenths of a degree, on a
/// drone that leans by 1 to 2 degrees per m/s. Chosen.
const LEAST_DOUBT_MPS: f64 = 0.1;
/// Error of that wind as a share of it, where horizontal legs measured the law. Chosen; the drag of AirSim's
/// sides differs by as much.
pub(super) const LEGS_DOUBT: f64 = 0.08;
/// The error where only the model's law is known. Chosen: bodies may differ from the model by some tenths.
const LAW_DOUBT: f64 = 0.3;

/// Time scales of gusts that are tried, s: half, once and twice the 25 s of the benchmark's horizontal
/// gusts.
const GUST_S: [f64; 3] = [12.0, 25.0, 60.0];
/// Shares of the variance that are tried as scatter rather than gusts, from almost none to almost all. A
/// grid.
const SCATTER: [f64; 5] = [0.02, 0.08, 0.2, 0.45, 0.8];

/// The air as it most probably was: a regressor with scatter of its own would be fitted too small.
/// What the drone flies itself is known and is left out of the smoothing.
fn smooth(group: &Group, raw: &[[f64; 2]]) -> Vec<[f64; 2]> {
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
fn smoothed(group: &Group, values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let Some(moments) = Moments::of(values) else { return Vec::new() };
    let (mean, variance) = (moments.mean, moments.population_variance());
    if variance < 1e-6 || count < 4 {
        return values.to_vec();
    }
    let times: Vec<f64> = group.bins.iter().map(Bin::middle_s).collect();
    let rest: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let filter = |time_s: f64, share: f64| {
        let seen = |time_s: &f64| Observation {
            time_s: *time_s,
            looks_at: LooksAt::from_slice(&[(0, 1.0)]),
            noise: variance * share,
        };
        let gusts = State { variance: variance * (1.0 - share), time_s };
        Filter::new(vec![gusts], times.iter().map(seen).collect())
    };
    let mut best: Option<(f64, State, Filter)> = None;
    for time_s in GUST_S {
        for share in SCATTER {
            let filter = filter(time_s, share);
            let chi2: f64 = filter.whiten(&rest).iter().map(|value| value * value).sum();
            let likelihood = -0.5 * (chi2 + filter.log_det);
            if best.as_ref().is_none_or(|(most, ..)| likelihood > *most) {
                best = Some((likelihood, filter.states[0], filter));
            }
        }
    }
    let Some((_, gusts, filter)) = best else { return values.to_vec() };
    // What is in a bin itself comes once.
    let weighed = filter.weigh(&rest);
    let mut smooth = vec![mean; count];
    for (forward, has_own) in [(true, true), (false, false)] {
        let (mut heard, mut before_s) = (0.0, None);
        for step in 0..count {
            let bin = if forward { step } else { count - 1 - step };
            let apart_s = before_s.map_or(0.0, |before_s: f64| (times[bin] - before_s).abs());
            before_s = Some(times[bin]);
            heard *= (-apart_s / gusts.time_s).exp();
            smooth[bin] += gusts.variance * (heard + if has_own { weighed[bin] } else { 0.0 });
            heard += weighed[bin];
        }
    }
    smooth
}

/// Fewest bins of horizontal flight that measure a lean law: two numbers from two headings.
const FEWEST_MOVING: usize = 4;

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;
    use crate::vehicle::library::builtin;

    #[test]
    fn a_smooth_series_is_its_mean_over_gusts_and_scatter() {
        let data = trial::data(1, |_, _| 0.0);
        let group = &data.groups[0];
        let times: Vec<f64> = group.bins.iter().map(Bin::middle_s).collect();
        let count = times.len();
        let values: Vec<f64> = (0..count)
            .map(|bin| 3.0 + (0.2 * bin as f64).sin() + 0.3 * (7.7 * bin as f64).sin())
            .collect();
        let moments = Moments::of(&values).unwrap();
        let rest = DVector::from_iterator(count, values.iter().map(|value| value - moments.mean));
        let variance = moments.population_variance();
        let mut best = (f64::NEG_INFINITY, DVector::zeros(count));
        for time_s in GUST_S {
            for share in SCATTER {
                let gusts = DMatrix::from_fn(count, count, |a, b| {
                    (1.0 - share) * variance * (-(times[a] - times[b]).abs() / time_s).exp()
                });
                let whole = &gusts + DMatrix::identity(count, count) * share * variance;
                let factor = whole.cholesky().unwrap();
                let weighed = factor.solve(&rest);
                let likelihood = -0.5 * (rest.dot(&weighed) + factor.ln_determinant());
                if likelihood > best.0 {
                    best = (likelihood, gusts * weighed);
                }
            }
        }
        for (value, expected) in smoothed(group, &values).iter().zip(best.1.iter()) {
            let off = value - moments.mean - expected;
            assert!(off.abs() < 1e-9, "{value} {expected}");
        }
    }

    #[test]
    fn what_a_side_lacks_of_its_steady_lean_is_lacking_by_its_own_law() {
        let vehicle = trial::vehicle();
        let flown_law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        let law = LeanLaw { linear: flown_law.linear + 0.03, ..flown_law };
        let wind_mps = [3.0, -1.0];
        let mut data = trial::data(2, |_, _| 0.0);
        for group in &mut data.groups {
            for drone in &mut group.measured {
                for (bin, value) in group.bins.iter().zip(drone) {
                    value.lean_rad = flown_law.lean([-wind_mps[0], -wind_mps[1]], bin.climb_mps());
                }
            }
        }
        // Simulated in the same wind, and steady: the other law reads the leans as they are.
        let side: Vec<Vec<BinValues>> =
            data.groups.iter().map(|group| group.measured[0].clone()).collect();
        let flown = Some((side.as_slice(), [wind_mps[0], wind_mps[1], 0.0]));
        let read = mean_wind_by(&data, law, flown_law, flown);
        let as_they_are = mean_wind(&data, law, None);
        let off_mps = (read[0] - as_they_are[0]).hypot(read[1] - as_they_are[1]);
        assert!(off_mps < 1e-6, "{read:?} for {as_they_are:?}");
        let own = mean_wind(&data, flown_law, flown);
        assert!((own[0] - wind_mps[0]).abs() < 0.1, "{own:?}");
        assert!(own[0] - read[0] > 0.5, "who leans more leans so in less wind: {read:?}");
    }

    #[test]
    fn each_flight_has_the_wind_that_its_own_leans_show() {
        let law = LeanLaw::of(&trial::vehicle(), SEA_LEVEL_DENSITY, 0.0);
        let mut data = trial::data(1, |_, _| 0.0);
        data.groups.push(data.groups[0].clone());
        let winds_mps = [[0.0, 0.0], [4.0, -3.0]];
        for (group, [x_mps, y_mps]) in data.groups.iter_mut().zip(winds_mps) {
            for (bin, value) in group.bins.iter().zip(&mut group.measured[0]) {
                value.lean_rad = law.lean([-x_mps, -y_mps], bin.climb_mps());
            }
        }
        let together = wind(&data, law, None);
        assert!(together.of_groups_mps.is_empty() && together.of_groups_se_mps.is_empty());
        data.groups[1].flight = 1;
        let apart = wind(&data, law, None);
        for (group, [x_mps, y_mps]) in winds_mps.into_iter().enumerate() {
            let [own_x_mps, own_y_mps] = apart.of_groups_mps[group];
            assert!((own_x_mps - x_mps).hypot(own_y_mps - y_mps) < 1e-6, "{apart:?}");
        }
        let [calm_mps, windy_mps] = [0, 1].map(|group: usize| apart.of_groups_se_mps[group]);
        assert!(calm_mps == LEAST_DOUBT_MPS && windy_mps > 1.4, "{calm_mps} {windy_mps}");
    }

    #[test]
    fn rotors_whose_drag_goes_with_the_flow_lean_by_their_trim_in_any_wind() {
        let mut vehicle = builtin("pixel").unwrap();
        Role::RotorDrag.set(&mut vehicle, 0.008);
        Role::RotorDragFlow.set(&mut vehicle, 0.7);
        Role::BodyDragTop.set(&mut vehicle, 0.018);
        Role::BodyDragSide.set(&mut vehicle, 0.012);
        let law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        let mut trim = Trim::of(&vehicle).unwrap();
        for speed_mps in [2.0, 5.0, 9.0] {
            for turn_deg in [0.0_f64, 20.0, 45.0] {
                for climb_mps in [-2.0, 0.0, 3.0] {
                    let (sin, cos) = turn_deg.to_radians().sin_cos();
                    let velocity_mps = Vector3::new(cos * speed_mps, sin * speed_mps, climb_mps);
                    let condition = Condition { velocity_mps, ..Condition::default() };
                    let lean = trim.balance(&condition).unwrap().lean;
                    let [x_mps, y_mps] = law.air([lean.x, lean.y], climb_mps);
                    let off_mps = (x_mps - velocity_mps.x).hypot(y_mps - velocity_mps.y);
                    let place = (speed_mps, turn_deg, climb_mps);
                    assert!(off_mps < 0.1 + 0.1 * speed_mps, "{place:?}: {x_mps} {y_mps}");
                }
            }
        }
    }

    #[test]
    fn of_two_air_speeds_that_lean_alike_the_slower_is_meant() {
        let vehicle = builtin("arducopter-sitl").unwrap();
        let law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        let mut trim = Trim::of(&vehicle).unwrap();
        for climb_mps in [-3.5, 0.0, 3.5] {
            let mut before_mps = 0.0;
            for speed_mps in [6.0, 8.0, 10.0, 12.0, 14.0] {
                let velocity_mps = Vector3::new(speed_mps, 0.0, climb_mps);
                let at = Condition { velocity_mps, ..Condition::default() };
                // Heavier by a gust than the steady lean.
                let lean_rad = 1.05 * trim.balance(&at).unwrap().lean.x.asin();
                let [read_mps, _] = law.air([lean_rad, 0.0], climb_mps);
                assert!(
                    read_mps > before_mps && (read_mps - speed_mps).abs() < 3.0,
                    "{speed_mps} at {climb_mps}: {read_mps} after {before_mps}"
                );
                before_mps = read_mps;
            }
        }
        // More than it ever leans: the speed at which it leans most, never the fastest that is believed.
        let [x_mps, y_mps] = law.air([0.0, 3.0], 0.0);
        assert!(x_mps == 0.0 && y_mps > 12.0 && y_mps < FASTEST_MPS, "{x_mps} {y_mps}");
    }

    #[test]
    fn the_wind_of_the_firmwares_own_vehicle_is_read_from_its_leans() {
        let vehicle = builtin("arducopter-sitl").unwrap();
        let law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        let mut trim = Trim::of(&vehicle).unwrap();
        for speed_mps in [1.0, 3.0, 5.0, 8.0] {
            let velocity_mps = Vector3::new(speed_mps, 0.0, 0.0);
            let level = Condition { velocity_mps, ..Condition::default() };
            let lean_rad = trim.balance(&level).unwrap().lean.x.asin();
            let [read_mps, _] = law.air([lean_rad, 0.0], 0.0);
            let doubt_mps = LEAST_DOUBT_MPS.hypot(LAW_DOUBT * speed_mps);
            assert!((read_mps - speed_mps).abs() < 0.2 * doubt_mps, "{speed_mps}: {read_mps}");
            // Climbing, its drag weighs on the rotors: it leans by 14 degrees at -3.5 m/s and by 10 at 3.5.
            for climb_mps in [-3.5, -1.0, 2.0, 3.5] {
                let velocity_mps = Vector3::new(speed_mps, 0.0, climb_mps);
                let climbing = Condition { velocity_mps, ..Condition::default() };
                let lean_rad = trim.balance(&climbing).unwrap().lean.x.asin();
                let [read_mps, _] = law.air([lean_rad, 0.0], climb_mps);
                let off_mps = read_mps - speed_mps;
                let most_mps = 0.1 + 0.3 * doubt_mps;
                assert!(off_mps.abs() < most_mps, "{speed_mps}, {climb_mps}: {read_mps}");
                let back_rad = law.lean([read_mps, 0.0], climb_mps)[0];
                assert!((back_rad - lean_rad).abs() < 1e-6, "{back_rad} for {lean_rad}");
            }
        }
    }
}
