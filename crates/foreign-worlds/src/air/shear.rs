//! Wind by height above the ground.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Height at which the wind is stated, m: that of weather stations.
pub const REFERENCE_M: f64 = 10.0;
/// Below this the laws are not used, m: the roughness layer.
const LOWEST_M: f64 = 1.0;

/// How the wind grows with height (Stull 1988, sections 9.7 and 9.8).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "law")]
pub enum Shear {
    /// It does not.
    None,
    /// By a power of the height.
    Power {
        /// The exponent; 1/7 over flat land.
        exponent: f64,
    },
    /// By the logarithm of the height.
    Log {
        /// Roughness of the ground, m.
        roughness_m: f64,
    },
}

impl Shear {
    /// Wind at a height over that at the reference height.
    pub fn ratio(&self, height_m: f64) -> f64 {
        let height_m = height_m.max(LOWEST_M);
        match *self {
            Self::None => 1.0,
            Self::Power { exponent } => (height_m / REFERENCE_M).powf(exponent),
            Self::Log { roughness_m } => {
                (height_m / roughness_m).ln().max(0.0) / (REFERENCE_M / roughness_m).ln()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_one_at_the_reference_and_grow() {
        for shear in [Shear::Power { exponent: 0.14 }, Shear::Log { roughness_m: 0.03 }] {
            assert!((shear.ratio(10.0) - 1.0).abs() < 1e-12);
            assert!(shear.ratio(50.0) > 1.1 && shear.ratio(2.0) < 0.9);
        }
        // ln(50/0.03) / ln(10/0.03), by hand.
        assert!((Shear::Log { roughness_m: 0.03 }.ratio(50.0) - 1.2770).abs() < 1e-4);
    }
}
