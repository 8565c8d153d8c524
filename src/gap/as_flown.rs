//! How another program's simulation answers climb, by its own logs.
//!
//! The model's file need not describe what that program flew: a plant with another drag answers climb and gusts in its
//! own way, and what is missing acts on that plant. Its logs tell how its pulse goes with the climb through the air.
//! What they have more than the model is taken up as a vertical acceleration that the model is given at that climb: it
//! then answers as the logs do, and everything that is added to it acts at the right thrust.

use nalgebra::{DMatrix, DVector};

use super::bins::BinValues;
use super::data::Data;
use super::scene::Scene;
use super::steady::{Moment, Steady};
use crate::effects::{EffectError, Signals, Supply};
use crate::numeric::{extent, mean};
use crate::vehicle::Vehicle;

/// Logs span climb when they have this many speeds, m/s apart by [`APART_MPS`]: as many as the curve has numbers,
/// and one.
const FEWEST_SPEEDS: usize = 6;
/// Speeds of a ladder are apart by more, m/s.
const APART_MPS: f64 = 0.25;
/// A model that is nearer to the logs stands for them, us: its closed forms are not nearer to its own flights.
const NEAR_US: f64 = 0.5;
/// Step of the table, m/s: that of responses.
const STEP_MPS: f64 = 0.25;
/// The table goes on beyond the logs by this, m/s, where the vehicle can fly so.
const BEYOND_MPS: f64 = 3.0;
/// Step of the derivative by the acceleration, m/s². Numerical.
const NUDGE_MPS2: f64 = 0.02;
/// Newton's method takes three steps.
const ROUNDS: usize = 8;
/// The table is as exact as this, us.
const EXACT_US: f64 = 1e-3;
/// Stronger accelerations are no difference between two vehicles that hover alike, m/s².
const MOST_MPS2: f64 = 8.0;

/// What the simulated logs have more than the model, as an acceleration by climb through the air.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AsFlown {
    first_mps: f64,
    accelerations_mps2: Vec<f64>,
}

impl AsFlown {
    /// By the simulated side and the scene of its own flight; `None` where the logs do not span climb, or where the
    /// model answers as they do.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn of(
        data: &Data,
        side: &[Vec<BinValues>],
        scene: &Scene,
        flew: &Vehicle,
    ) -> Result<Option<Self>, EffectError> {
        let closed = scene.pulses(flew)?;
        let mut points = Vec::new();
        let mut level = Vec::new();
        for (group, bins) in data.groups.iter().enumerate() {
            for (bin, _) in bins.bins.iter().enumerate().filter(|(_, bin)| !bin.is_horizontal()) {
                let more_us = side[group][bin].pulse_us - closed.at(group, 0, bin);
                let signals = scene.signals[group][bin];
                points.push((signals.climb_mps, more_us));
                level.push((signals, scene.relative_mps[group][bin]));
            }
        }
        let Some(curve) = Curve::through(&points) else { return Ok(None) };
        let Some((slowest, fastest)) = extent(points.iter().map(|(climb, _)| *climb)) else {
            return Ok(None);
        };
        if !curve.matters(slowest, fastest) {
            return Ok(None);
        }
        let middle = |of: &dyn Fn(&Signals) -> f64| {
            mean(level.iter().map(|(signals, _)| of(signals))).unwrap_or_default()
        };
        let relative = |axis: usize| {
            mean(level.iter().map(|(_, relative)| relative[axis])).unwrap_or_default()
        };
        let relative_mps = [relative(0), relative(1)];
        let signals = Signals {
            height_m: middle(&|signals| signals.height_m),
            density_ratio: middle(&|signals| signals.density_ratio),
            horizontal_mps: relative_mps[0].hypot(relative_mps[1]),
            ..Signals::default()
        };
        let mut steady = Steady::of(flew)?;
        let mut at = |climb_mps: f64| {
            let moment = Moment { signals, relative_mps }.climbing(climb_mps);
            asked_mps2(&mut steady, moment, curve.at(climb_mps, slowest, fastest))
        };
        // From the middle outwards, as far as the vehicle can fly so.
        let low = ((slowest - BEYOND_MPS) / STEP_MPS).floor() as i32;
        let high = ((fastest + BEYOND_MPS) / STEP_MPS).ceil() as i32;
        let start = (f64::midpoint(slowest, fastest) / STEP_MPS).round() as i32;
        let climb_mps = |step: i32| f64::from(step) * STEP_MPS;
        let up: Vec<f64> = (start..=high).map_while(|step| at(climb_mps(step))).collect();
        let down: Vec<f64> = (low..start).rev().map_while(|step| at(climb_mps(step))).collect();
        let first_mps = climb_mps(start) - STEP_MPS * down.len() as f64;
        let accelerations_mps2: Vec<f64> = down.into_iter().rev().chain(up).collect();
        let last_mps = first_mps + STEP_MPS * (accelerations_mps2.len() as f64 - 1.0);
        let spans = first_mps <= slowest && last_mps >= fastest;
        Ok(spans.then_some(Self { first_mps, accelerations_mps2 }))
    }

    /// How much of what the logs have more than the model goes with the climb as a unit of drag does, of which `with`
    /// was taken with one more; apart from what goes with climb itself, and with none. `None`: nothing tells.
    pub(super) fn in_units_of(&self, with: &Self) -> Option<f64> {
        let first = self.first_mps.max(with.first_mps);
        let last = |of: &Self| of.first_mps + STEP_MPS * (of.accelerations_mps2.len() as f64 - 1.0);
        let count = ((last(self).min(last(with)) - first) / STEP_MPS) as usize + 1;
        let climb_mps = |step: usize| first + STEP_MPS * step as f64;
        let rows = DMatrix::from_fn(count, 3, |step, column| {
            let climb_mps = climb_mps(step);
            match column {
                0 => 1.0,
                1 => climb_mps,
                // What the logs have more is less by what was added.
                _ => self.at(climb_mps) - with.at(climb_mps),
            }
        });
        let values = DVector::from_fn(count, |step, _| self.at(climb_mps(step)));
        let found = rows.svd(true, true).solve(&values, 1e-9).ok()?;
        Some(found[2]).filter(|share| share.is_finite())
    }

    /// The acceleration at a climb through the air, m/s²; beyond the table that at its end.
    pub(super) fn at(&self, climb_mps: f64) -> f64 {
        let last = self.accelerations_mps2.len() - 1;
        let place = ((climb_mps - self.first_mps) / STEP_MPS).clamp(0.0, last as f64);
        let low = (place.floor() as usize).min(last.saturating_sub(1));
        let high = (low + 1).min(last);
        let (low_value, high_value) = (self.accelerations_mps2[low], self.accelerations_mps2[high]);
        low_value + (place - low as f64) * (high_value - low_value)
    }
}

/// The acceleration with which a vehicle's pulse is `more_us` above its own; `None`: there is none.
fn asked_mps2(steady: &mut Steady, at: Moment, more_us: f64) -> Option<f64> {
    let mut pulse_us = |acceleration_mps2: f64| {
        let signals = Signals { acceleration_mps2, ..at.signals };
        steady.pulse_us(&Moment { signals, ..at }, Supply::Used(0.0), 0.0).ok()
    };
    let wanted_us = pulse_us(0.0)? + more_us;
    let mut asked = 0.0;
    for _ in 0..ROUNDS {
        let off_us = pulse_us(asked)? - wanted_us;
        if off_us.abs() < EXACT_US {
            break;
        }
        let slope =
            (pulse_us(asked + NUDGE_MPS2)? - pulse_us(asked - NUDGE_MPS2)?) / (2.0 * NUDGE_MPS2);
        asked -= off_us / slope;
        if asked.is_nan() || asked.abs() > MOST_MPS2 {
            return None;
        }
    }
    Some(asked)
}

/// A smooth curve of pulses over climb: a line, a square of either side, and a cube; without its value in hover,
/// which is each drone's own.
struct Curve([f64; 4]);

impl Curve {
    /// The terms at a climb.
    fn terms(climb_mps: f64) -> [f64; 4] {
        let square = climb_mps * climb_mps;
        [climb_mps, square, climb_mps * climb_mps.abs(), climb_mps * square]
    }

    fn through(points: &[(f64, f64)]) -> Option<Self> {
        let mut speeds: Vec<f64> = points.iter().map(|(climb, _)| *climb).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup_by(|next, last| *next - *last < APART_MPS);
        if speeds.len() < FEWEST_SPEEDS {
            return None;
        }
        let rows = DMatrix::from_fn(points.len(), 5, |row, column| match column {
            0 => 1.0,
            term => Self::terms(points[row].0)[term - 1],
        });
        let values = DVector::from_iterator(points.len(), points.iter().map(|(_, more)| *more));
        let found = rows.svd(true, true).solve(&values, 1e-9).ok()?;
        Some(Self([found[1], found[2], found[3], found[4]]))
    }

    /// The curve, us; beyond the logs it goes on as a line.
    fn at(&self, climb_mps: f64, slowest: f64, fastest: f64) -> f64 {
        let value = |climb_mps: f64| {
            Self::terms(climb_mps)
                .iter()
                .zip(self.0)
                .map(|(term, factor)| term * factor)
                .sum::<f64>()
        };
        let inside = climb_mps.clamp(slowest, fastest);
        let step = STEP_MPS.copysign(climb_mps - inside);
        value(inside) + (climb_mps - inside) * (value(inside) - value(inside - step)) / step
    }

    /// Whether the logs answer otherwise than the model.
    fn matters(&self, slowest: f64, fastest: f64) -> bool {
        let steps = ((fastest - slowest) / STEP_MPS) as i32;
        let places = (0..=steps).map(|step| slowest + f64::from(step) * STEP_MPS);
        let values = extent(places.map(|climb| self.at(climb, slowest, fastest)));
        values.is_some_and(|(low, high)| high - low > NEAR_US)
    }
}

#[cfg(test)]
mod tests {
    use super::super::compare::{Comparison, Simulated};
    use super::super::trial;
    use super::*;

    /// The response of drones at a climb with a side of other logs, us/(m/s).
    fn response(more_us: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let data = trial::data(2, |_, _| 0.0);
        let vehicle = trial::vehicle();
        let mut side = data.as_flown();
        for (group, bins) in side.iter_mut().enumerate() {
            for (bin, values) in bins.iter_mut().enumerate() {
                let climb_mps = data.groups[group].bins[bin].climb_mps();
                if let Some(values) = values {
                    values.pulse_us += more_us(climb_mps);
                }
            }
        }
        let simulated = Simulated::Given { values: side, flew: &vehicle, is_foreign: true };
        let comparison = Comparison::new(&data, &vehicle, &simulated, None).unwrap();
        let response = comparison.scene.response(&vehicle).unwrap();
        let bins = data.groups[0].bins.iter().zip(&response[0]);
        bins.map(|(bin, response)| (bin.climb_mps(), response.at(0.0))).collect()
    }

    #[test]
    fn drones_answer_gusts_as_the_simulated_logs_answer_climb() {
        let own = response(|_| 0.0);
        let other = response(|climb_mps| 50.0 + 6.0 * climb_mps);
        for ((climb_mps, own), (_, other)) in own.iter().zip(&other) {
            assert!((other - own - 6.0).abs() < 0.3, "{climb_mps}: {other} for {own} + 6");
        }
        let curved = response(|climb_mps| 2.0 * climb_mps * climb_mps.abs());
        for ((climb_mps, own), (_, curved)) in own.iter().zip(&curved) {
            let more = 4.0 * climb_mps.abs();
            assert!((curved - own - more).abs() < 0.8, "{climb_mps}: {curved} for {own} + {more}");
        }
    }

    #[test]
    fn what_spans_no_climb_tells_no_curve() {
        let line = |count: i32| {
            let speeds = (0..count).map(|speed| f64::from(speed) - 2.0);
            speeds.map(|climb| (climb, 3.0 * climb)).collect::<Vec<_>>()
        };
        assert!(Curve::through(&line(5)).is_none());
        let curve = Curve::through(&line(6)).unwrap();
        assert!((curve.at(2.5, -2.0, 3.0) - 7.5).abs() < 1e-6);
        assert!((curve.at(5.0, -2.0, 3.0) - 15.0).abs() < 1e-6, "and on beyond");
    }
}
