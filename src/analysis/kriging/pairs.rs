//! Covariances between values of drones that hover, all at steps of the same length: what hangs on the time between two values is
//! computed once for each number of steps, and what two drones have in common once for each two drones.

use super::covariance::{Apart, Besides, Covariance, Spot};
use super::data::Rows;

/// Steps between two values, at most, for which the fall by time is known beforehand: those of all neighbours of one place.
const MOST_STEPS: i32 = 10;
/// The same for which there is a table of all pairs of drones: those of nearly all neighbours of one place.
const MOST_STEPS_OF_PAIRS: i32 = 3;
/// Fleets of more drones have no table of pairs: it would have more entries than their neighbours ask for. Numerical.
const MOST_DRONES: usize = 128;
/// Entries of all tables of a fleet together, at most: 32 MB.
const MOST_ENTRIES: usize = 4_000_000;

/// What values so many steps apart have in common.
struct Step<'a> {
    apart: Apart<'a>,
    besides: Besides,
    /// Of each drone's value (row) with each other's (column), (m/s)²; not a number for drones without a place. Empty where
    /// there is no table.
    of_drones: Vec<f64>,
}

/// Which steps are known beforehand.
struct Span {
    first: i32,
    last: i32,
    /// Steps to either side for which there is a table of pairs.
    of_pairs: i32,
}

/// The covariance of values, by what is known of it beforehand where that is known.
pub(super) struct Pairs<'a> {
    covariance: &'a Covariance,
    step_s: f64,
    /// The first of `steps`.
    first: f64,
    drones: usize,
    /// Empty for drones that do not hover.
    steps: Vec<Step<'a>>,
}

impl<'a> Pairs<'a> {
    /// For values and their neighbours, before and after.
    pub(super) fn of(covariance: &'a Covariance, rows: &Rows) -> Self {
        let span = Span { first: -MOST_STEPS, last: MOST_STEPS, of_pairs: MOST_STEPS_OF_PAIRS };
        Self::over(covariance, rows, &span)
    }

    /// For each value and all that are not later.
    pub(super) fn of_all(covariance: &'a Covariance, rows: &Rows) -> Self {
        let last = rows.seconds.len() as i32;
        Self::over(covariance, rows, &Span { first: 0, last, of_pairs: last })
    }

    fn over(covariance: &'a Covariance, rows: &Rows, span: &Span) -> Self {
        let step_s = match rows.seconds[..] {
            [first, second, ..] => (second - first) as f64,
            _ => 0.0,
        };
        let places_m = places(rows).filter(|_| step_s > 0.0);
        let known: Vec<i32> = places_m.iter().flat_map(|_| span.first..=span.last).collect();
        let places_m = places_m.unwrap_or_default();
        let tables = known.iter().filter(|step| step.abs() <= span.of_pairs).count();
        let is_small = places_m.len() <= MOST_DRONES
            && tables * places_m.len() * places_m.len() <= MOST_ENTRIES;
        let of_step = |step: i32| {
            let apart_s = f64::from(step) * step_s;
            let (apart, besides) = (covariance.apart(apart_s), covariance.besides(apart_s));
            let has_table = is_small && step.abs() <= span.of_pairs;
            let of_drones = if has_table { table(&places_m, &apart, &besides) } else { Vec::new() };
            Step { apart, besides, of_drones }
        };
        let steps = known.into_iter().map(of_step).collect();
        let (first, drones) = (f64::from(span.first), places_m.len());
        Self { covariance, step_s, first, drones, steps }
    }

    /// What is known of two spots beforehand; `None` if one of them moves, or if their times are no known step apart.
    fn step(&self, one: &Spot, other: &Spot) -> Option<&Step<'a>> {
        let stand = [one, other].iter().all(|spot| spot.velocity_mps == [0.0; 3]);
        let place = (one.time_s - other.time_s) / self.step_s - self.first;
        let index = place as usize;
        // What is negative, or no number, has no place.
        self.steps.get(index).filter(|_| stand && index as f64 == place)
    }

    /// As [`Covariance::of`].
    pub(super) fn of_values(&self, one: &Spot, other: &Spot) -> f64 {
        let Some(step) = self.step(one, other) else { return self.covariance.of(one, other) };
        let known = one.drone.zip(other.drone).and_then(|(one, other)| {
            let is_drone = one < self.drones && other < self.drones;
            let known = step.of_drones.get(one * self.drones + other);
            known.copied().filter(|value| is_drone && !value.is_nan())
        });
        known.unwrap_or_else(|| {
            let is_own = one.drone.is_some() && one.drone == other.drone;
            step.besides.with(step.apart.field(way_m(one.place_m, other.place_m)), is_own)
        })
    }

    /// As [`Covariance::with_air`].
    pub(super) fn with_air(&self, air: &Spot, shown: &Spot) -> f64 {
        let Some(step) = self.step(air, shown) else { return self.covariance.with_air(air, shown) };
        let field = step.apart.field(way_m(air.place_m, shown.place_m));
        let is_own = air.drone.is_some() && air.drone == shown.drone;
        if is_own { field + step.besides.gusts() } else { field }
    }
}

/// Where each drone stands, m; `None` for a drone without rows. Nothing if one of them moves, or stands at two places.
fn places(rows: &Rows) -> Option<Vec<Option<[f64; 3]>>> {
    let mut places_m = vec![None; rows.place.len()];
    for row in &rows.list {
        let spot = &row.spot;
        let known = places_m.get_mut(spot.drone?)?;
        let stays = *known.get_or_insert(spot.place_m) == spot.place_m;
        if !stays || spot.velocity_mps != [0.0; 3] {
            return None;
        }
    }
    Some(places_m)
}

fn way_m(to_m: [f64; 3], from_m: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| to_m[axis] - from_m[axis])
}

/// Of each drone with each other.
fn table(places_m: &[Option<[f64; 3]>], apart: &Apart<'_>, besides: &Besides) -> Vec<f64> {
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
    use crate::analysis::kriging::covariance::tests::air;
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

    /// 0 before second 75, 1 from second 85 on.
    fn step_at(second: u32) -> f64 {
        (f64::from(second) / 10.0 - 7.5).clamp(0.0, 1.0)
    }

    #[test]
    fn what_is_known_beforehand_is_the_covariance_bit_for_bit() {
        let hover = |index: i32| {
            drone(vec![[10.1 * f64::from(index % 3), 7.3 * f64::from(index / 3), 40.0]])
        };
        let hovers: Vec<Drone> = (0..6).map(hover).collect();
        let goes = |y: f64| drone((0..160).map(|second| [f64::from(second), y, 40.0]).collect());
        // Hovers, flies 8 m without values, and hovers again.
        let mut stops = drone((0..160).map(|second| [8.0 * step_at(second), 0.0, 40.0]).collect());
        stops.values[70..90].fill(None);
        let gone = Drone { values: vec![None; 160], ..drone(vec![[9.0, 9.0, 40.0]]) };
        let mut with_a_gap = hovers.clone();
        with_a_gap.insert(2, gone);
        let many: Vec<Drone> = (0..130).map(hover).collect();
        for drones in [hovers, with_a_gap, many, vec![goes(0.0), goes(10.0)], vec![hover(1), stops]]
        {
            let rows = Rows::of(&drones, 4, 10);
            let beside = Spot { place_m: [3.0, 4.0, 41.0], drone: None, ..rows.list[0].spot };
            let between = Spot { time_s: beside.time_s + 5.0, ..beside };
            for form in Form::ALL {
                for drift_mps in [[0.0; 2], [2.0, -1.0]] {
                    let covariance = Covariance::new(Air {
                        stretch: [0.2, 0.1],
                        drift_mps,
                        slow_mps: 0.2,
                        shared_mps: 0.1,
                        ..air(form)
                    })
                    .shown(0.1);
                    let known = [Pairs::of(&covariance, &rows), Pairs::of_all(&covariance, &rows)];
                    // Of many drones, some.
                    let every = 1 + rows.list.len() / 200;
                    let some = || rows.list.iter().step_by(every);
                    let spots = || some().map(|row| row.spot).chain([beside, between]);
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
