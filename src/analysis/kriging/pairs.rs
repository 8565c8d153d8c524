//! Covariances between values of drones that hover, all at steps of the same length: what hangs on the time between two values is
//! computed once for each number of steps, and what two drones have in common once for each two drones.

use super::covariance::{Apart, Besides, Covariance, Spot};
use super::data::Rows;

/// Steps between two values, at most, for which the fall by time is known beforehand: those of all neighbours of one place.
const MOST_STEPS: i32 = 10;
/// The same for which all pairs of drones are: those of nearly all neighbours of one place.
const MOST_STEPS_OF_PAIRS: i32 = 3;
/// More drones have more pairs than their neighbours ask for. Numerical.
const MOST_DRONES: usize = 128;

/// What values so many steps apart have in common.
struct Step<'a> {
    apart: Apart<'a>,
    besides: Besides,
    /// Of each drone's value (row) with each other's (column), (m/s)²; none for many steps.
    of_drones: Vec<f64>,
}

/// The covariance of values, by what is known of it beforehand where that is known.
pub(super) struct Pairs<'a> {
    covariance: &'a Covariance,
    step_s: f64,
    most_steps: f64,
    drones: usize,
    /// From the most steps back to the most ahead; none for drones that move.
    steps: Vec<Step<'a>>,
}

impl<'a> Pairs<'a> {
    /// Between the values of rows, and places around them, for all that are neighbours.
    pub(super) fn of(covariance: &'a Covariance, rows: &Rows) -> Self {
        Self::of_steps(covariance, rows, MOST_STEPS, MOST_STEPS_OF_PAIRS)
    }

    /// The same for all values.
    pub(super) fn of_all(covariance: &'a Covariance, rows: &Rows) -> Self {
        let most = rows.seconds.len() as i32;
        Self::of_steps(covariance, rows, most, most)
    }

    fn of_steps(covariance: &'a Covariance, rows: &Rows, most: i32, most_of_pairs: i32) -> Self {
        let mut places_m = vec![None; rows.place.len()];
        for row in &rows.list {
            if let Some(place_m) = row.spot.drone.and_then(|drone| places_m.get_mut(drone)) {
                *place_m = Some(row.spot.place_m);
            }
        }
        let stands = |row: &super::data::Row| row.spot.velocity_mps == [0.0; 3];
        let step_s = match rows.seconds[..] {
            [first, second, ..] => (second - first) as f64,
            _ => 0.0,
        };
        let is_known = step_s > 0.0 && rows.list.iter().all(stands);
        let steps = if is_known { -most..=most } else { 1..=0 };
        let of_step = |step: i32| {
            let apart_s = f64::from(step) * step_s;
            let (apart, besides) = (covariance.apart(apart_s), covariance.besides(apart_s));
            let is_asked = step.abs() <= most_of_pairs && places_m.len() <= MOST_DRONES;
            let of_drones = if is_asked { all(&places_m, &apart, &besides) } else { Vec::new() };
            Step { apart, besides, of_drones }
        };
        let steps = steps.map(of_step).collect();
        Self { covariance, step_s, most_steps: f64::from(most), drones: places_m.len(), steps }
    }

    /// Of values so many seconds apart; `None` if that is no step.
    fn step(&self, apart_s: f64) -> Option<&Step<'a>> {
        let steps = apart_s / self.step_s + self.most_steps;
        let index = steps as usize;
        // What is negative, or no number, has no place.
        if index as f64 == steps { self.steps.get(index) } else { None }
    }

    /// As [`Covariance::of`].
    pub(super) fn of_values(&self, one: &Spot, other: &Spot) -> f64 {
        let Some(step) = self.step(one.time_s - other.time_s) else {
            return self.covariance.of(one, other);
        };
        let known = one.drone.zip(other.drone).and_then(|(one, other)| {
            let is_one = one < self.drones && other < self.drones;
            step.of_drones.get(one * self.drones + other).filter(|_| is_one)
        });
        known.copied().unwrap_or_else(|| {
            let is_own = one.drone.is_some() && one.drone == other.drone;
            step.besides.with(step.apart.field(way_m(one.place_m, other.place_m)), is_own)
        })
    }

    /// As [`Covariance::with_air`].
    pub(super) fn with_air(&self, air: &Spot, shown: &Spot) -> f64 {
        match self.step(air.time_s - shown.time_s) {
            Some(step) => {
                let field = step.apart.field(way_m(air.place_m, shown.place_m));
                let is_own = air.drone.is_some() && air.drone == shown.drone;
                if is_own { field + step.besides.gusts() } else { field }
            }
            None => self.covariance.with_air(air, shown),
        }
    }
}

fn way_m(to_m: [f64; 3], from_m: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| to_m[axis] - from_m[axis])
}

/// Of each drone with each other; drones without a place have none that anybody asks for.
fn all(places_m: &[Option<[f64; 3]>], apart: &Apart<'_>, besides: &Besides) -> Vec<f64> {
    let mut found = Vec::with_capacity(places_m.len() * places_m.len());
    for (one, to_m) in places_m.iter().enumerate() {
        for (other, from_m) in places_m.iter().enumerate() {
            found.push(to_m.zip(*from_m).map_or(f64::NAN, |(to_m, from_m)| {
                besides.with(apart.field(way_m(to_m, from_m)), one == other)
            }));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::{Air, Form};
    use crate::analysis::kriging::data::{Drone, Value};

    fn drone(place_m: Vec<[f64; 3]>) -> Drone {
        let value = Value {
            updraft_mps: 0.0,
            law: [0.0; crate::analysis::shape::PARAMETERS],
            doubts_mps: [0.0; crate::analysis::corrections::DOUBTS],
            own_mps: 0.0,
            noise_mps: 0.1,
        };
        Drone { place_m, values: vec![Some(value); 160], ..Drone::default() }
    }

    #[test]
    fn what_is_known_beforehand_is_the_covariance_bit_for_bit() {
        let hover = |index: i32| {
            drone(vec![[10.1 * f64::from(index % 3), 7.3 * f64::from(index / 3), 40.0]])
        };
        let hovers: Vec<Drone> = (0..6).map(hover).collect();
        let goes = |y: f64| drone((0..160).map(|second| [f64::from(second), y, 40.0]).collect());
        for drones in [hovers, vec![goes(0.0), goes(10.0)]] {
            let rows = Rows::of(&drones, 4, 10);
            let beside = Spot { place_m: [3.0, 4.0, 41.0], drone: None, ..rows.list[0].spot };
            let between = Spot { time_s: beside.time_s + 5.0, ..beside };
            for form in Form::ALL {
                for drift_mps in [[0.0; 2], [2.0, -1.0]] {
                    let covariance = Covariance::new(Air {
                        form,
                        sd_mps: 0.5,
                        length_m: 60.0,
                        stretch: [0.2, 0.1],
                        time_s: 80.0,
                        drift_mps,
                        gust_mps: 0.3,
                        gust_s: 6.0,
                        slow_mps: 0.2,
                        shared_mps: 0.1,
                    })
                    .shown(0.1);
                    let known = [Pairs::of(&covariance, &rows), Pairs::of_all(&covariance, &rows)];
                    let spots = || rows.list.iter().map(|row| row.spot).chain([beside, between]);
                    for one in spots() {
                        for other in spots() {
                            for pairs in &known {
                                let expected = covariance.of(&one, &other);
                                assert_eq!(pairs.of_values(&one, &other), expected);
                                let expected = covariance.with_air(&one, &other);
                                assert_eq!(pairs.with_air(&one, &other), expected);
                            }
                        }
                    }
                }
            }
        }
    }
}
