//! Random streams and coloured noise.

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

/// Purpose of a random stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Air that all drones share.
    SharedAir = 101,
    /// Gusts at one drone.
    OwnAir = 102,
    /// Waves of the spatial field.
    Field = 103,
    /// Deviations of one drone from the fleet.
    Spread = 104,
    /// Noise of the logged pulses.
    Pulses = 105,
    /// Errors of the position filter.
    Sensors = 106,
    /// Clock of one drone.
    Clock = 107,
    /// Errors of the motors' controllers and of the current.
    Telemetry = 108,
}

/// Random stream of a seed, a drone (0: all of them) and a purpose.
pub fn stream(seed: u64, drone: u16, purpose: Purpose) -> Pcg64 {
    let selector = (u128::from(drone) << 64) | u128::from(purpose as u64);
    Pcg64::new(u128::from(seed) ^ 0x517C_C1B7_2722_0A94_FE13_ABE8_FA9A_6EE0, selector)
}

/// A normal deviate.
pub fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// An Ornstein-Uhlenbeck process, stepped in time: exponentially correlated normal noise
/// (Uhlenbeck and Ornstein 1930).
#[derive(Clone, Debug)]
pub struct Coloured {
    sd: f64,
    keep: f64,
    kick: f64,
    value: f64,
    rng: Pcg64,
}

impl Coloured {
    /// A process in its steady state: standard deviation, correlation time (s) and step (s).
    pub fn new(sd: f64, time_s: f64, step_s: f64, mut rng: Pcg64) -> Self {
        let keep = (-step_s / time_s).exp();
        let value = normal(&mut rng);
        Self { sd, keep, kick: (1.0 - keep * keep).sqrt(), value, rng }
    }

    /// The value now.
    pub fn value(&self) -> f64 {
        self.sd * self.value
    }

    /// Goes on by one step, and gives the value there.
    pub fn step(&mut self) -> f64 {
        self.value = self.keep * self.value + self.kick * normal(&mut self.rng);
        self.value()
    }
}

/// An Ornstein-Uhlenbeck process over a span of time that can be asked at any moment, linear between
/// its values.
#[derive(Clone, Debug)]
pub struct Series {
    from_s: f64,
    step_s: f64,
    values: Vec<f64>,
}

impl Series {
    /// Draws a process from `from_s` to `to_s` with values every `step_s`.
    pub fn draw(sd: f64, time_s: f64, [from_s, to_s]: [f64; 2], step_s: f64, rng: Pcg64) -> Self {
        let mut process = Coloured::new(sd, time_s, step_s, rng);
        let count = ((to_s - from_s) / step_s).clamp(0.0, 1e6) as usize + 2;
        let values = (0..count).map(|_| process.step()).collect();
        Self { from_s, step_s, values }
    }

    /// The value at a time, s; beyond its ends the nearest.
    pub fn at(&self, time_s: f64) -> f64 {
        let last = self.values.len().saturating_sub(2);
        let place = ((time_s - self.from_s) / self.step_s).max(0.0);
        let index = (place as usize).min(last);
        let share = (place - index as f64).min(1.0);
        let of = |index: usize| self.values.get(index).copied().unwrap_or_default();
        of(index) * (1.0 - share) + of(index + 1) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coloured_noise_has_its_variance_and_its_memory() {
        let (sd, time_s, step_s) = (0.7, 5.0, 0.1);
        let mut process = Coloured::new(sd, time_s, step_s, stream(3, 1, Purpose::Pulses));
        let values: Vec<f64> = (0..400_000).map(|_| process.step()).collect();
        let count = values.len() as f64;
        let variance = values.iter().map(|value| value * value).sum::<f64>() / count;
        // 40,000 s of a process of 5 s: some 4,000 independent values, 2 % of the variance.
        assert!((variance / (sd * sd) - 1.0).abs() < 0.08, "{variance}");
        let lag = 50;
        let pairs = values.iter().zip(&values[lag..]);
        let covariance = pairs.map(|(now, later)| now * later).sum::<f64>() / count;
        assert!((covariance / variance - (-1.0_f64).exp()).abs() < 0.06, "{covariance}");
    }

    #[test]
    fn streams_repeat_and_differ() {
        let first = |seed, drone, purpose| normal(&mut stream(seed, drone, purpose));
        assert_eq!(first(1, 2, Purpose::OwnAir), first(1, 2, Purpose::OwnAir));
        assert_ne!(first(1, 2, Purpose::OwnAir), first(1, 3, Purpose::OwnAir));
        assert_ne!(first(1, 2, Purpose::OwnAir), first(1, 2, Purpose::Spread));
        assert_ne!(first(1, 2, Purpose::OwnAir), first(2, 2, Purpose::OwnAir));
    }

    #[test]
    fn a_series_is_continuous_and_holds_its_ends() {
        let series = Series::draw(1.0, 8.0, [-10.0, 20.0], 0.5, stream(1, 1, Purpose::OwnAir));
        assert!((series.at(3.2499) - series.at(3.2501)).abs() < 1e-3);
        assert_eq!(series.at(-50.0), series.at(-10.0));
        assert_eq!(series.at(500.0), series.at(1e6));
    }
}
