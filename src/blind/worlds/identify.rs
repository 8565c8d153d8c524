//! Identification: the vehicle's file whose steady flight is nearest to a foreign plant's.

use foreign_worlds::air::AirSettings;
use foreign_worlds::plant::density_ratio;
use foreign_worlds::{Condition as Foreign, World};
use nalgebra::{DMatrix, DVector, Vector3};

use super::draw::TOP_M;
use crate::blind::error::BlindError;
use crate::blind::scenario::{Cell, Protocol};
use crate::effects::Role;
use crate::sim::plant::trim::{Condition, Trim};
use crate::vehicle::{RotorLaw, Vehicle, library};

/// Climbs over ground at which the two are compared, m/s: the ladders', and gusts.
const CLIMBS_MPS: [f64; 7] = [-4.0, -2.7, -1.3, 0.0, 1.3, 2.7, 4.0];
/// Shares of the strongest wind at which they are: near the ground it is 0.4 of that aloft.
const WINDS: [f64; 3] = [0.4, 0.7, 1.0];
/// Speeds of horizontal legs into the strongest wind, and with it, m/s.
const LEGS_MPS: [f64; 4] = [-6.0, -3.0, 3.0, 6.0];
/// Climbs over ground in horizontal legs, m/s: gusts.
const IN_LEGS_MPS: [f64; 3] = [-1.0, 0.0, 1.0];
/// Shares of these speeds up to which is fitted, each from where the one before ended: ways that may end in different
/// places, of which the best is taken.
const WAYS: [&[f64]; 3] = [&[1.0], &[0.7, 1.0], &[0.4, 0.7, 1.0]];
/// Heights above sea level, m.
const AMSL_M: [f64; 2] = [195.0, 265.0];
/// A lean of this weighs as much as 1 us, rad: what an attitude filter is good for.
const LEAN_RAD: f64 = 2e-3;
/// Steps of the search.
const STEPS: usize = 40;
/// Factor of the damping (Marquardt 1963).
const DAMPING: f64 = 10.0;
/// Step of the numerical derivatives, in logarithms.
const DIFFERENCE: f64 = 1e-4;
/// A step that gains less than this, the sum of the squared differences in us, ends the search.
const ENOUGH: f64 = 1e-2;

/// A vehicle that was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Identified {
    /// Vehicle in the form of the built-in one.
    pub vehicle: Vehicle,
    /// Largest difference of the pulses over the flown range, us, without the mean.
    pub largest_us: f64,
    /// Root mean square of the differences, us.
    pub rms_us: f64,
}

/// What is fitted: positive numbers, by their logarithms.
#[derive(Clone, Copy, Debug)]
enum Fitted {
    Thrust,
    Power,
    Resistance,
    Of(Role),
}

const FITTED: [Fitted; 10] = [
    Fitted::Thrust,
    Fitted::Power,
    Fitted::Resistance,
    Fitted::Of(Role::InflowShare),
    Fitted::Of(Role::BodyDragTop),
    Fitted::Of(Role::BodyDragSide),
    Fitted::Of(Role::RotorDrag),
    Fitted::Of(Role::WindLift),
    Fitted::Of(Role::WindLiftSquare),
    Fitted::Of(Role::RotorDragFlow),
];

/// Where the search begins, and between which bounds each is kept: near where it ends for the middle of the plants
/// that are drawn. From elsewhere it may end in a lesser place.
const BOUNDS: [(f64, f64, f64); 10] = [
    (1.45, 0.5, 3.0),
    (4.5, 0.2, 10.0),
    (1.0, 0.2, 5.0),
    (0.4, 0.02, 0.95),
    (0.018, 1e-4, 0.5),
    (0.012, 1e-4, 0.5),
    (0.007, 1e-4, 0.1),
    (0.47, 0.01, 0.95),
    (0.09, 0.001, 1.0),
    (0.72, 0.001, 1.0),
];

fn with(vehicle: &Vehicle, at: &DVector<f64>) -> Vehicle {
    let mut found = vehicle.clone();
    for ((what, log), (_, low, high)) in FITTED.iter().zip(at).zip(BOUNDS) {
        let value = log.exp().clamp(low, high);
        match what {
            Fitted::Thrust => found.airframe.thrust_coefficient *= value,
            Fitted::Power => found.airframe.power_coefficient *= value,
            Fitted::Resistance => {
                if let RotorLaw::Motor(motor) = &mut found.airframe.rotor {
                    motor.resistance_ohm *= value;
                }
            }
            Fitted::Of(role) => role.set(&mut found, value),
        }
    }
    found
}

/// One moment at which the two are compared, and what the plant does there: pulse and lean.
struct Point {
    condition: Condition,
    pulse_us: f64,
    lean: f64,
}

/// Horizontal and vertical speeds relative to the air that flights of a world meet, m/s.
fn speeds_mps(air: &AirSettings, has_legs: bool) -> Vec<[f64; 2]> {
    let [x, y] = air.wind_mps;
    let gusts = 1.0 + air.gust_share.hypot(air.own_gust_share);
    let strongest_mps = x.hypot(y) * air.shear.ratio(TOP_M) * gusts;
    let ladder = CLIMBS_MPS.iter().flat_map(|climb_mps| {
        WINDS.map(|share| [share * strongest_mps, climb_mps - air.updraft_mps])
    });
    let legs = IN_LEGS_MPS.iter().flat_map(|climb_mps| {
        LEGS_MPS.map(|leg_mps| [(strongest_mps + leg_mps).abs(), climb_mps - air.updraft_mps])
    });
    ladder.chain(legs.filter(|_| has_legs)).collect()
}

fn points(world: &World, has_legs: bool, share: f64) -> Vec<Point> {
    let World { plant, air, .. } = world;
    let mut points = Vec::new();
    for amsl_m in AMSL_M {
        let density = density_ratio(amsl_m);
        let trim = foreign_worlds::Trim::new(plant, Vec::new(), density);
        for [horizontal_mps, climb_mps] in speeds_mps(air, has_legs) {
            let horizontal_mps = share * horizontal_mps;
            let relative_mps = [horizontal_mps, 0.0, climb_mps];
            let at = Foreign { relative_mps, density_ratio: density, ..Foreign::default() };
            let Some(steady) = trim.at(&at) else { continue };
            let condition = Condition {
                velocity_mps: Vector3::new(horizontal_mps, 0.0, climb_mps),
                density_ratio: density,
                ..Condition::default()
            };
            points.push(Point { condition, pulse_us: steady.pulse_us, lean: steady.lean[0] });
        }
    }
    points
}

/// Differences of pulses (us) and leans (weighed) of a vehicle from the plant's; `None` where it does not fly.
fn differences(vehicle: &Vehicle, points: &[Point]) -> Option<DVector<f64>> {
    let mut trim = Trim::of(vehicle).ok()?;
    let mut found = Vec::with_capacity(2 * points.len());
    for point in points {
        let steady = trim.at(&point.condition)?;
        found.push(steady.pulse_us - point.pulse_us);
        found.push((steady.lean.x - point.lean) / LEAN_RAD);
    }
    Some(DVector::from_vec(found))
}

/// The place nearest to a start where the vehicle is most like the plant, and what is left there; `None`: it does not
/// fly at the start.
fn nearest(
    form: &Vehicle,
    points: &[Point],
    start: DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let mut at = start;
    let mut left = differences(&with(form, &at), points)?;
    let mut damping = 1e-2;
    for _ in 0..STEPS {
        let mut slopes = DMatrix::zeros(left.len(), at.len());
        for place in 0..at.len() {
            let mut beside = at.clone();
            beside[place] += DIFFERENCE;
            let Some(moved) = differences(&with(form, &beside), points) else { continue };
            slopes.set_column(place, &((moved - &left) / DIFFERENCE));
        }
        let (normal, right) = (slopes.transpose() * &slopes, slopes.transpose() * &left);
        let mut gained = 0.0;
        for _ in 0..8 {
            let mut damped = normal.clone();
            for place in 0..at.len() {
                damped[(place, place)] += damping * normal[(place, place)] + 1e-6;
            }
            let Some(step) = damped.cholesky().map(|factor| factor.solve(&right)) else { break };
            let mut tried = &at - step;
            for (log, (_, low, high)) in tried.iter_mut().zip(BOUNDS) {
                *log = log.clamp(low.ln(), high.ln());
            }
            let moved = differences(&with(form, &tried), points);
            let better = moved.filter(|moved| moved.norm_squared() < left.norm_squared());
            if let Some(moved) = better {
                gained = left.norm_squared() - moved.norm_squared();
                (at, left) = (tried, moved);
                damping /= DAMPING;
                break;
            }
            damping *= DAMPING;
        }
        if gained < ENOUGH {
            break;
        }
    }
    Some((at, left))
}

/// Fits a built-in vehicle's form to what a world's plant does in that world's air, by Levenberg's and Marquardt's
/// method: as a crew would who has flown it there before.
///
/// # Errors
/// If the built-in vehicle is not valid or cannot fly what the plant flies.
pub fn identify(world: &World, cell: &Cell) -> Result<Identified, BlindError> {
    let mut form = library::builtin(cell.base.vehicle_name())?;
    form.effects.clear();
    form.airframe.mass_kg = world.plant.mass_kg();
    let has_legs = cell.protocol == Protocol::Enhanced;
    let start = DVector::from_iterator(BOUNDS.len(), BOUNDS.iter().map(|(start, ..)| start.ln()));
    let by_way_of = |shares: &[f64]| {
        let mut found = (start.clone(), DVector::zeros(0));
        for share in shares {
            found = nearest(&form, &points(world, has_legs, *share), found.0)?;
        }
        Some(found)
    };
    let ways = WAYS.iter().filter_map(|shares| by_way_of(shares));
    let nearest = ways.min_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()));
    let (at, left) = nearest.ok_or(BlindError::Text {
        what: "the known vehicle",
        reason: "no steady flight of its form is like the plant's".to_owned(),
    })?;
    let pulses: Vec<f64> = left.iter().step_by(2).copied().collect();
    let count = pulses.len().max(1) as f64;
    // Each drone's own level is free in every comparison.
    let mean = pulses.iter().sum::<f64>() / count;
    let off = || pulses.iter().map(|pulse| pulse - mean);
    Ok(Identified {
        vehicle: with(&form, &at),
        largest_us: off().map(f64::abs).fold(0.0, f64::max),
        rms_us: (off().map(|off| off * off).sum::<f64>() / count).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::draw;
    use super::*;
    use crate::blind::worlds::{Worlds, known};
    use crate::blind::{AirClass, Base};

    fn cell(protocol: Protocol, base: Base) -> Cell {
        Cell {
            worlds: Worlds::Foreign,
            protocol,
            air: AirClass::Calm,
            base,
            hidden: Vec::new(),
            side: 3,
            columns: None,
        }
    }

    #[test]
    fn a_thrust_law_is_exactly_a_vehicles_file() {
        let cell = cell(Protocol::Enhanced, Base::Airsim);
        let world = draw::world(3, &cell).unwrap();
        let vehicle = known::vehicle(&world, &cell).unwrap().vehicle;
        let left = differences(&vehicle, &points(&world, true, 1.0)).unwrap();
        // Below 0.1 m/s AirSim's faces feel nothing.
        assert!(left.amax() < 0.1, "{left}");
    }

    #[test]
    fn blades_are_near_a_vehicles_file() {
        // These left 0.3 to 0.9 us (rms), up to 2.7 us (largest): the forms differ. Without the part of the rotors'
        // drag that goes with the flow through the disc it was 4 to 5 and 11 to 16 us.
        for (seed, protocol) in
            [(1, Protocol::Paper), (13, Protocol::Paper), (2, Protocol::Enhanced)]
        {
            let cell = cell(protocol, Base::Pixel);
            let found = known::vehicle(&draw::world(seed, &cell).unwrap(), &cell).unwrap();
            assert!(found.rms_us < 1.0, "{} {}", found.rms_us, found.largest_us);
            assert!(found.largest_us > 0.0);
        }
    }
}
