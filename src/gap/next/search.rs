//! The shortest flight that separates well enough.
//!
//! Everything that can be flown together tells most: more flight and more contrast never take
//! information away. From there elements are left out, those first that take most time, as long as
//! every question keeps what it needs. What once could not be left out cannot be later either.

use std::collections::BTreeMap;

use super::elements::{Elements, Legs};
use super::known::{Flight, Known};
use super::predict::{Predicted, least, predict};
use super::questions::{Kind, Question};
use crate::gap::GapError;
use crate::mission::plan::Plan;
use crate::mission::resolve::resolve_text;

/// Share of the best flight's z that must be left where even that does not reach the goal. Chosen: 5 % of z
/// is 10 % of the flights.
const KEEP: f64 = 0.95;
/// The payload is worth its trouble when it raises z by this factor. Chosen as [`KEEP`].
const PAYLOAD_ADDS: f64 = 1.05;
/// What was flown did not decide, whatever its predicted z: the next flight must be this much better.
/// Chosen: at half as much again, a z of 4 becomes 6, and a chance of 50 % becomes 98 % (docs/physics.md,
/// 3.3).
const BETTER: f64 = 1.5;
/// Fast horizontal legs need a vehicle that may fly this fast, m/s.
const FAST_MPS: f64 = 6.0;

/// Demands on a proposed flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Fisher z of every question, at least.
    pub z: f64,
    /// Duration of the longest flight allowed, s.
    pub longest_s: f64,
}

/// The flight that was chosen.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Elements of the proposed flight.
    pub elements: Elements,
    /// Plan of the proposed flight.
    pub plan: Plan,
    /// Separations that the flight is predicted to reach, question by question.
    pub predicted: Predicted,
    /// Separations of the flight that was flown, by the same prediction.
    pub was: Predicted,
    /// Fisher z that is wanted of each question: the aim's, and for what the flight should have told
    /// and did not, half as much again as it had.
    pub wanted: Vec<f64>,
    /// Flights that were looked at.
    pub looked_at: usize,
}

/// Looks for the flight; `present` is the plan that was flown, whose site and fleet it keeps. `None`: not
/// even the shortest flight is short enough.
///
/// # Errors
/// The model cannot fly, or effects are not valid.
pub fn search(
    known: &Known,
    present: &Plan,
    vehicle: &str,
    questions: &[Question],
    aim: Aim,
) -> Result<Option<Choice>, GapError> {
    FlightSearch::new(known, present, vehicle, questions)?.choose(aim)
}

/// All that this fleet can fly.
fn largest(present: &Plan) -> Elements {
    let mut elements = Elements::ALL;
    elements.counter_phase = present.slots.len() > 1;
    elements.charge = present.slots.len() > 1;
    if present.limits.max_speed_xy_mps < FAST_MPS {
        elements.legs = Legs::Slow;
    }
    elements
}

/// An element that was left out: its place among those of [`Elements`], and to what.
type Left = (u8, u8);

fn left_out(from: Elements, to: Elements) -> Left {
    let places = [
        (from.payload != to.payload, 0),
        (from.low_hover != to.low_hover, 0),
        (from.heights != to.heights, 0),
        (from.legs != to.legs, to.legs as u8),
        (from.order != to.order, to.order as u8),
        (from.all_rungs != to.all_rungs, 0),
        (from.long_legs != to.long_legs, 0),
        (from.charge != to.charge, 0),
    ];
    let place = places.iter().position(|(differs, _)| *differs).unwrap_or(places.len());
    (place as u8, places.get(place).map_or(0, |(_, to)| *to))
}

struct Looked {
    elements: Elements,
    seconds: f64,
    predicted: Predicted,
    z: Vec<f64>,
}

impl Looked {
    /// How much is missing in all, in units of the goal.
    fn shortfall(&self, wanted: &[f64]) -> f64 {
        self.z.iter().zip(wanted).map(|(z, wanted)| (1.0 - z / wanted).max(0.0)).sum()
    }
}

/// A search for the next flight that keeps what it has simulated.
pub struct FlightSearch<'a> {
    known: &'a Known,
    present: &'a Plan,
    vehicle: &'a str,
    questions: &'a [Question],
    /// Separations of the flight that was flown.
    was: Predicted,
    /// Flights by what can be seen of them.
    flights: BTreeMap<Elements, Flight>,
    count: usize,
}

impl<'a> FlightSearch<'a> {
    /// Predicts what the flight that was flown separates.
    ///
    /// # Errors
    /// The model cannot fly, or effects are not valid.
    pub fn new(
        known: &'a Known,
        present: &'a Plan,
        vehicle: &'a str,
        questions: &'a [Question],
    ) -> Result<Self, GapError> {
        let flown = Flight::new(known, present.clone())?;
        let was = predict(known, &flown, (false, false), questions)?;
        let flights = BTreeMap::new();
        Ok(Self { known, present, vehicle, questions, was, flights, count: 0 })
    }

    /// The shortest flight that reaches the aim, as [`search`] looks for it. What was simulated for one aim
    /// is not simulated again for another.
    ///
    /// # Errors
    /// The model cannot fly, or effects are not valid.
    pub fn choose(&mut self, aim: Aim) -> Result<Option<Choice>, GapError> {
        self.count = 0;
        let wanted: Vec<f64> = self
            .questions
            .iter()
            .zip(&self.was)
            .map(|(question, was)| match question.kind() {
                Kind::TooSmall => aim.z,
                Kind::Class | Kind::Unknown => aim.z.max(BETTER * least(was)),
            })
            .collect();
        let mut at = self.look(largest(self.present))?;
        if at.elements.charge {
            // Full batteries fall fastest: where time is no rival, that shows the sag better.
            let full = self.look(Elements { charge: false, ..at.elements })?;
            if full.shortfall(&wanted) < at.shortfall(&wanted) {
                at = full;
            }
        }
        if at.shortfall(&wanted) > 0.0
            && self.questions.iter().any(|question| question.kind() == Kind::Class)
        {
            let loaded = self.look(Elements { payload: true, ..at.elements })?;
            let adds = |((with, without), wanted): ((&f64, &f64), &f64)| {
                without < wanted && *with > PAYLOAD_ADDS * without.max(1e-9)
            };
            if loaded.z.iter().zip(&at.z).zip(&wanted).any(adds) {
                at = loaded;
            }
        }
        while at.seconds > aim.longest_s {
            let mut best: Option<Looked> = None;
            for simpler in at.elements.simpler() {
                let other = self.look(simpler)?;
                if other.seconds >= at.seconds {
                    continue;
                }
                // What is lost for a second saved.
                let price = |one: &Looked| {
                    (one.shortfall(&wanted) - at.shortfall(&wanted)) / (at.seconds - one.seconds)
                };
                if best.as_ref().is_none_or(|best| price(&other) < price(best)) {
                    best = Some(other);
                }
            }
            match best {
                Some(best) => at = best,
                None => return Ok(None),
            }
        }
        let goals: Vec<f64> =
            at.z.iter().zip(&wanted).map(|(z, wanted)| (KEEP * z).min(*wanted)).collect();
        let mut needed: Vec<Left> = Vec::new();
        loop {
            let mut options = Vec::new();
            for simpler in at.elements.simpler() {
                let left = left_out(at.elements, simpler);
                if !needed.contains(&left) {
                    options.push((self.seconds(simpler)?, left, simpler));
                }
            }
            options.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut next = None;
            for (_, left, simpler) in options {
                let other = self.look(simpler)?;
                if other.seconds <= at.seconds
                    && other.z.iter().zip(&goals).all(|(z, goal)| z >= goal)
                {
                    next = Some(other);
                    break;
                }
                needed.push(left);
            }
            match next {
                Some(next) => at = next,
                None => break,
            }
        }
        let plan = self.flight(at.elements)?.plan().clone();
        Ok(Some(Choice {
            elements: at.elements,
            plan,
            predicted: at.predicted,
            was: self.was.clone(),
            wanted,
            looked_at: self.count,
        }))
    }

    fn plan(&self, elements: Elements) -> Result<Plan, GapError> {
        let text = elements.template("", self.present, self.vehicle, &[], &[]);
        let mission = resolve_text("next.toml", &text, &[]).map_err(Box::new)?;
        let flight = mission.flights.into_iter().next();
        flight.map(|flight| flight.plan).ok_or(GapError::NothingCommon)
    }

    fn seconds(&self, elements: Elements) -> Result<f64, GapError> {
        Ok(match self.flights.get(&elements.flown()) {
            Some(flight) => flight.plan().duration_ms,
            None => self.plan(elements)?.duration_ms,
        } as f64
            / 1000.0)
    }

    fn flight(&mut self, elements: Elements) -> Result<&Flight, GapError> {
        let flown = elements.flown();
        if !self.flights.contains_key(&flown) {
            let flight = Flight::new(self.known, self.plan(elements)?)?;
            self.flights.insert(flown, flight);
        }
        self.flights.get(&flown).ok_or(GapError::NothingCommon)
    }

    fn look(&mut self, elements: Elements) -> Result<Looked, GapError> {
        self.count += 1;
        let (known, questions) = (self.known, self.questions);
        let flight = self.flight(elements)?;
        let seconds = flight.plan().duration_ms as f64 / 1000.0;
        let predicted = predict(known, flight, (elements.charge, elements.payload), questions)?;
        let z = predicted.iter().map(|separations| least(separations)).collect();
        Ok(Looked { elements, seconds, predicted, z })
    }
}
