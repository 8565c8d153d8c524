//! Horizontal wind that grows with height above ground: logarithmic or power law.

use nalgebra::Vector3;

use super::Atmosphere;

/// The laws end at the top of the boundary layer: above, the wind is that of this height, m.
const TOP_M: f64 = 1_000.0;

/// Law of the growth of wind speed with height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindLaw {
    /// `U(z) = U_h ln(z/z0) / ln(h/z0)`, neutral surface layer (Stull 1988, ch. 9.7); calm below z0.
    Log {
        /// Roughness length z0, m: 0.03 for short grass.
        roughness_m: f64,
    },
    /// `U(z) = U_h (z/h)^alpha`; 1/7 is the customary value over open land.
    Power {
        /// Exponent alpha, without unit.
        alpha: f64,
    },
}

/// Wind of constant direction with a law of height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindProfile {
    /// Wind at the reference height, show frame, m/s.
    pub reference_mps: Vector3<f64>,
    /// Reference height above ground (show z = 0), m.
    pub reference_height_m: f64,
    /// Law by which the speed grows with height.
    pub law: WindLaw,
}

impl WindProfile {
    /// Wind speed at a height as a share of that at the reference height.
    pub fn ratio(&self, height_m: f64) -> f64 {
        let height_m = height_m.min(TOP_M);
        match self.law {
            WindLaw::Log { roughness_m } if height_m > roughness_m => {
                (height_m / roughness_m).ln() / (self.reference_height_m / roughness_m).ln()
            }
            WindLaw::Log { .. } => 0.0,
            WindLaw::Power { alpha } => (height_m.max(0.0) / self.reference_height_m).powf(alpha),
        }
    }
}

impl Atmosphere for WindProfile {
    fn air_velocity(&self, position_m: &Vector3<f64>, _time_s: f64) -> Vector3<f64> {
        self.reference_mps * self.ratio(position_m.z)
    }
}
