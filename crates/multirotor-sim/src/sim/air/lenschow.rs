//! Turbulence of the convective boundary layer: a random field whose strength grows with height.
//!
//! Lenschow, Wyngaard & Pennell 1980 (J. Atmos. Sci. 37, 1313): `sd² = 1.8 w*² (z/zi)^(2/3)
//! (1 - 0.8 z/zi)²`. Integral scale of w after Lenschow & Stankov 1986 (J. Atmos. Sci. 43, 1198):
//! `L = 0.28 zi (z/zi)^(1/2)`.

use nalgebra::Vector3;
use rand::Rng;

use super::{AirSampler, Atmosphere, FieldScales, Knots, RandomField};

/// Standard deviation of vertical velocity at a height, m/s. Zero at the ground and above 1.25 zi.
pub fn convective_sd_mps(w_star_mps: f64, zi_m: f64, height_m: f64) -> f64 {
    let z = (height_m / zi_m).clamp(0.0, 1.25);
    1.8_f64.sqrt() * w_star_mps * z.cbrt() * (1.0 - 0.8 * z)
}

/// Integral length of vertical velocity at a height, m.
pub fn convective_length_m(zi_m: f64, height_m: f64) -> f64 {
    0.28 * zi_m * (height_m / zi_m).max(0.0).sqrt()
}

/// A random field of unit strength, scaled with height.
#[derive(Clone, Debug)]
pub struct Lenschow {
    field: RandomField,
    w_star_mps: f64,
    zi_m: f64,
}

impl Lenschow {
    /// Draws the field. `scales.sd_mps` is not used: the strength follows from the convective
    /// velocity `w_star_mps` and the inversion height `zi_m`.
    pub fn new<R: Rng>(w_star_mps: f64, zi_m: f64, scales: &FieldScales, rng: &mut R) -> Self {
        let field = RandomField::new(&FieldScales { sd_mps: 1.0, ..*scales }, rng);
        Self { field, w_star_mps, zi_m }
    }
}

impl Atmosphere for Lenschow {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        let sd_mps = convective_sd_mps(self.w_star_mps, self.zi_m, position_m.z);
        Vector3::new(0.0, 0.0, sd_mps * self.field.updraft_mps(position_m, time_s))
    }

    fn sampler(&self, _drone: u16) -> Box<dyn AirSampler + Send + '_> {
        Box::new(Knots::new(|position_m: &Vector3<f64>, time_s| {
            self.air_velocity(position_m, time_s)
        }))
    }
}
