//! Costly air looked up ten times a second and joined smoothly in between.
//!
//! A random field needs some hundred cosines per query, and the simulator asks 100 times a second.
//! Looking 0.2 s ahead along the drone's present velocity gives four knots, 0.1 s apart, around the
//! time asked for, and the cubic of Catmull and Rom through them. Motion of the air up to 1 Hz as
//! the drone sees it passes within 1.5 % of its amplitude; fields leave out what is faster than
//! [`HIGHEST_RADPS`](super::field::HIGHEST_RADPS).

use nalgebra::Vector3;

use super::AirSampler;

/// Time between two look-ups, s.
pub const KNOT_S: f64 = 0.1;
/// Drones do not move faster than this when looking ahead, m/s.
const FASTEST_MPS: f64 = 30.0;

/// Interpolates a function of place and time along one drone's flight.
#[derive(Debug)]
pub struct Knots<F> {
    look_up: F,
    /// Index of the interval that `values` surrounds: knots `at - 1` to `at + 2`.
    at: Option<f64>,
    values: [Vector3<f64>; 4],
    last_position_m: Vector3<f64>,
    last_time_s: f64,
}

impl<F: Fn(&Vector3<f64>, f64) -> Vector3<f64>> Knots<F> {
    /// Makes knots for a function that gives the velocity of the air.
    pub fn new(look_up: F) -> Self {
        Self {
            look_up,
            at: None,
            values: [Vector3::zeros(); 4],
            last_position_m: Vector3::zeros(),
            last_time_s: 0.0,
        }
    }

    fn fill(&mut self, interval: f64, position_m: &Vector3<f64>, time_s: f64) {
        let knot = |offset: f64| (interval + offset) * KNOT_S;
        if self.at.is_some_and(|at| at + 1.0 == interval) {
            let passed_s = time_s - self.last_time_s;
            let velocity = (position_m - self.last_position_m) / passed_s;
            let velocity = if velocity.norm() <= FASTEST_MPS { velocity } else { Vector3::zeros() };
            let next_s = knot(2.0);
            self.values.rotate_left(1);
            self.values[3] = (self.look_up)(&(position_m + velocity * (next_s - time_s)), next_s);
        } else {
            for (value, offset) in self.values.iter_mut().zip([-1.0, 0.0, 1.0, 2.0]) {
                *value = (self.look_up)(position_m, knot(offset));
            }
        }
        self.at = Some(interval);
    }
}

impl<F: Fn(&Vector3<f64>, f64) -> Vector3<f64>> AirSampler for Knots<F> {
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        let along = time_s / KNOT_S;
        let interval = along.floor();
        if self.at != Some(interval) {
            self.fill(interval, position_m, time_s);
        }
        self.last_position_m = *position_m;
        self.last_time_s = time_s;
        let u = along - interval;
        let [before, from, to, after] = &self.values;
        let bend = before * 2.0 - from * 5.0 + to * 4.0 - after;
        let twist = (from - to) * 3.0 + after - before;
        from + ((to - before) + (bend + twist * u) * u) * (0.5 * u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worst error for a wave of 1 m/s at a frequency that the drone sees.
    fn worst(frequency_hz: f64, speed_mps: f64) -> f64 {
        let truth = |place: &Vector3<f64>, time_s: f64| {
            let rate = std::f64::consts::TAU * frequency_hz;
            // Half of the phase from motion, half from time.
            let phase = rate / 2.0 * (place.x / speed_mps + time_s);
            Vector3::new(0.0, 0.0, phase.sin())
        };
        let mut knots = Knots::new(truth);
        let mut worst: f64 = 0.0;
        for step in 0..2_000 {
            let time_s = f64::from(step) * 0.01;
            let place = Vector3::new(speed_mps * time_s, 0.0, 0.0);
            let error = knots.air_velocity(&place, time_s) - truth(&place, time_s);
            // The first four knots do not know the velocity yet.
            if step > 50 {
                worst = worst.max(error.z.abs());
            }
        }
        worst
    }

    #[test]
    fn slow_air_passes_unchanged() {
        assert!(worst(0.1, 3.0) < 2e-4, "{}", worst(0.1, 3.0));
        assert!(worst(0.5, 3.0) < 4e-3, "{}", worst(0.5, 3.0));
        assert!(worst(1.0, 3.0) < 2e-2, "{}", worst(1.0, 3.0));
    }

    #[test]
    fn a_jump_in_time_starts_over() {
        let mut knots =
            Knots::new(|place: &Vector3<f64>, time_s| Vector3::repeat(place.x + time_s));
        let place = Vector3::new(3.0, 0.0, 0.0);
        for time_s in [0.0, 0.01, 100.0, -20.0, -19.99] {
            let value = knots.air_velocity(&place, time_s).x;
            assert!((value - (3.0 + time_s)).abs() < 1e-9, "{time_s}: {value}");
        }
    }
}
