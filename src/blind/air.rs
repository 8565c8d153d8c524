//! Air of a blind flight: a random updraft field that all drones share, gusts of each drone's own,
//! and a horizontal wind with slow gusts.

use nalgebra::Vector3;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::rng::{Purpose, stream};
use crate::sim::Atmosphere;
use crate::sim::air::{AirSampler, FieldScales, RandomField};

/// Show time from which random series are drawn, s.
const FROM_S: f64 = -180.0;
/// Duration for which random series are drawn, s.
const LENGTH_S: f64 = 2_400.0;
/// Time between two drawn values of local gusts, and of the wind's slow gusts, s.
const LOCAL_STEP_S: f64 = 0.5;
const WIND_STEP_S: f64 = 1.0;
/// Waves of the field.
const WAVES: usize = 600;
/// Stream of what all drones share (slots start at 1), and of the wind's gusts beside it.
const SHARED: u64 = 0;
const WIND: u64 = 1 << 32;

/// What the air of a flight is like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AirScales {
    /// Standard deviation of the shared updraft, m/s.
    pub shared_mps: f64,
    /// Its correlation length, m.
    pub length_m: f64,
    /// Its correlation time, s.
    pub time_s: f64,
    /// Standard deviation of each drone's own vertical gusts, m/s.
    pub local_mps: f64,
    /// Their correlation time, s.
    pub local_s: f64,
    /// Mean horizontal wind, show frame x and y, m/s.
    pub wind_mps: [f64; 2],
    /// Standard deviation of each horizontal axis' slow gusts, m/s.
    pub wind_gust_mps: f64,
    /// Their correlation time, s.
    pub wind_gust_s: f64,
    /// Steady updraft that all drones meet besides, m/s, up positive.
    #[serde(default, skip_serializing_if = "is_none")]
    pub updraft_mps: f64,
}

/// Whether there is nothing to write down.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_none(updraft_mps: &f64) -> bool {
    *updraft_mps == 0.0
}

/// Air of one blind flight.
pub struct BlindAir {
    seed: u64,
    scales: AirScales,
    field: RandomField,
    wind: [Series; 2],
}

impl BlindAir {
    /// Draws the air of a flight.
    pub fn new(scales: &AirScales, seed: u64) -> Self {
        let field = RandomField::new(
            &FieldScales {
                sd_mps: scales.shared_mps,
                length_m: Vector3::repeat(scales.length_m),
                time_s: scales.time_s,
                wind_mps: Vector3::zeros(),
                waves: WAVES,
            },
            &mut stream(seed, SHARED, Purpose::Air),
        );
        let mut rng = stream(seed, WIND, Purpose::Air);
        let mut gusts =
            || Series::draw(scales.wind_gust_mps, scales.wind_gust_s, WIND_STEP_S, &mut rng);
        Self { seed, scales: *scales, field, wind: [gusts(), gusts()] }
    }

    fn wind_mps(&self, time_s: f64) -> [f64; 2] {
        let [x, y] = &self.wind;
        let [mean_x, mean_y] = self.scales.wind_mps;
        [mean_x + x.at(time_s), mean_y + y.at(time_s)]
    }
}

impl Atmosphere for BlindAir {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        let [x, y] = self.wind_mps(time_s);
        Vector3::new(x, y, self.field.updraft_mps(position_m, time_s) + self.scales.updraft_mps)
    }

    fn sampler(&self, drone: u16) -> Box<dyn AirSampler + Send + '_> {
        let mut rng = stream(self.seed, u64::from(drone), Purpose::Air);
        let AirScales { local_mps, local_s, .. } = self.scales;
        Box::new(Sampler {
            air: self,
            field: self.field.sampler(drone),
            local: Series::draw(local_mps, local_s, LOCAL_STEP_S, &mut rng),
        })
    }
}

struct Sampler<'a> {
    air: &'a BlindAir,
    field: Box<dyn AirSampler + Send + 'a>,
    local: Series,
}

impl AirSampler for Sampler<'_> {
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        let [x, y] = self.air.wind_mps(time_s);
        let up_mps = self.local.at(time_s) + self.air.scales.updraft_mps;
        self.field.air_velocity(position_m, time_s) + Vector3::new(x, y, up_mps)
    }
}

/// An exponentially correlated random series over show time, linear between its values.
struct Series {
    step_s: f64,
    values: Vec<f64>,
}

impl Series {
    fn draw(sd: f64, time_s: f64, step_s: f64, rng: &mut Pcg64) -> Self {
        let keep = (-step_s / time_s).exp();
        let kick = (1.0 - keep * keep).sqrt();
        let mut draw = || -> f64 { StandardNormal.sample(rng) };
        let mut value: f64 = draw();
        let count = (LENGTH_S / step_s) as usize + 1;
        let values = (0..count)
            .map(|_| {
                let now = value;
                value = keep * value + kick * draw();
                sd * now
            })
            .collect();
        Self { step_s, values }
    }

    /// The value at a show time; beyond its ends the nearest.
    fn at(&self, time_s: f64) -> f64 {
        let place = ((time_s - FROM_S) / self.step_s).clamp(0.0, (self.values.len() - 1) as f64);
        let index = place as usize;
        let at = |index: usize| self.values.get(index).or(self.values.last()).copied();
        let (low, high) = (at(index).unwrap_or_default(), at(index + 1).unwrap_or_default());
        low + (high - low) * (place - index as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALES: AirScales = AirScales {
        shared_mps: 0.4,
        length_m: 145.0,
        time_s: 100.0,
        local_mps: 0.3,
        local_s: 8.0,
        wind_mps: [3.0, -2.0],
        wind_gust_mps: 0.5,
        wind_gust_s: 25.0,
        updraft_mps: 0.0,
    };

    #[test]
    fn the_updraft_has_its_variance_over_many_flights_and_drones() {
        let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
        let mut across = 0.0;
        for seed in 0..60 {
            let air = BlindAir::new(&SCALES, seed);
            for drone in 1..=8 {
                let mut sampler = air.sampler(drone);
                for time_s in [0.0, 150.0, 300.0] {
                    let velocity = sampler.air_velocity(&Vector3::new(0.0, 0.0, 50.0), time_s);
                    sum += velocity.z;
                    square += velocity.z * velocity.z;
                    across += (velocity.x - 3.0).powi(2) + (velocity.y + 2.0).powi(2);
                    count += 1.0;
                }
            }
        }
        let wanted = 0.4 * 0.4 + 0.3 * 0.3;
        assert!((square / count / wanted - 1.0).abs() < 0.2, "{}", square / count);
        assert!((sum / count).abs() < 0.12, "{}", sum / count);
        assert!((across / count / 0.5 - 1.0).abs() < 0.35, "{}", across / count);
    }

    #[test]
    fn steady_air_is_its_wind_and_its_updraft_alone() {
        let still = AirScales { shared_mps: 0.0, local_mps: 0.0, wind_gust_mps: 0.0, ..SCALES };
        let air = BlindAir::new(&AirScales { updraft_mps: 1.5, ..still }, 3);
        let place = Vector3::new(4.0, 5.0, 60.0);
        let wanted = Vector3::new(3.0, -2.0, 1.5);
        for time_s in [-20.0, 0.0, 77.7] {
            assert_eq!(air.air_velocity(&place, time_s), wanted);
            assert_eq!(air.sampler(2).air_velocity(&place, time_s), wanted);
        }
    }

    #[test]
    fn drones_have_gusts_of_their_own_and_the_same_wind() {
        let air = BlindAir::new(&SCALES, 3);
        let at = |drone| air.sampler(drone).air_velocity(&Vector3::zeros(), 10.0);
        assert_eq!(at(1), at(1));
        assert_ne!(at(1).z, at(2).z);
        assert_eq!(at(1).x, at(2).x);
    }
}
