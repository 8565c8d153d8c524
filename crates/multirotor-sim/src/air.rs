//! Density of the standard atmosphere, as AirSim computes it (EarthUtils.hpp).

/// Density at sea level, kg/m³: 101325 Pa / (287.053 J/(kg K) · 288.15 K).
pub const SEA_LEVEL_DENSITY: f64 = 101_325.0 / (GAS_CONSTANT * SEA_LEVEL_K);

const GAS_CONSTANT: f64 = 287.053;
const SEA_LEVEL_K: f64 = 288.15;
const LAPSE_K_PER_M: f64 = 6.5e-3;
/// Pressure falls with the temperature ratio to this power.
const PRESSURE_EXPONENT: f64 = 5.255_877;

/// Density at an altitude above mean sea level (m) as a share of that at sea level.
///
/// Troposphere only: AirSim's formula below 11 km, held there and at -1 km outside.
pub fn density_ratio(amsl_m: f64) -> f64 {
    let temperature_ratio = 1.0 - LAPSE_K_PER_M / SEA_LEVEL_K * amsl_m.clamp(-1_000.0, 11_000.0);
    temperature_ratio.powf(PRESSURE_EXPONENT - 1.0)
}

/// [`density_ratio`] for altitudes that change little from call to call: a power series about the
/// last altitude at which the power itself was computed, equal to it to the last digits.
#[derive(Clone, Copy, Debug)]
pub struct DensityNearby {
    amsl_m: f64,
    ratio: f64,
    /// Relative change of the temperature per metre there.
    per_m: f64,
}

/// As far as this the first neglected term, the fourth, is below the last digit.
const NEARBY_M: f64 = 2.0;

impl DensityNearby {
    /// Prepares for altitudes about this one, m above mean sea level.
    pub fn about(amsl_m: f64) -> Self {
        // Held outside of the troposphere, where the series does not know it.
        let inside = (-1_000.0 + NEARBY_M..11_000.0 - NEARBY_M).contains(&amsl_m);
        let per_m = -LAPSE_K_PER_M / (SEA_LEVEL_K - LAPSE_K_PER_M * amsl_m);
        let amsl_m = if inside { amsl_m } else { f64::NAN };
        Self { amsl_m, ratio: density_ratio(amsl_m), per_m }
    }

    /// Density as a share of that at sea level, at an altitude above mean sea level in m; see
    /// [`density_ratio`].
    #[inline]
    pub fn ratio(&mut self, amsl_m: f64) -> f64 {
        const POWER: f64 = PRESSURE_EXPONENT - 1.0;
        let away_m = amsl_m - self.amsl_m;
        if away_m.abs() < NEARBY_M {
            let x = away_m * self.per_m;
            let third = 1.0 + (POWER - 2.0) / 3.0 * x;
            let second = 1.0 + (POWER - 1.0) / 2.0 * x * third;
            return self.ratio * (1.0 + POWER * x * second);
        }
        *self = Self::about(amsl_m);
        density_ratio(amsl_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_atmosphere_tables() {
        // ICAO Doc 7488, kg/m³.
        for (amsl_m, density) in [(0.0, 1.2250), (1_000.0, 1.11164), (2_000.0, 1.00649)] {
            let here = density_ratio(amsl_m) * SEA_LEVEL_DENSITY;
            assert!((here - density).abs() < 1e-4, "{amsl_m} m: {here}");
        }
    }

    #[test]
    fn nearby_density_is_the_density() {
        for from_m in [-1_005.0, -3.0, 190.0, 2_000.0, 10_990.0] {
            let mut nearby = DensityNearby::about(from_m);
            for step in 0..2_000 {
                let amsl_m = from_m + f64::from(step) * 0.0173;
                let (near, exact) = (nearby.ratio(amsl_m), density_ratio(amsl_m));
                // Each is within 0.7e-15 of the true power, by rounding alone.
                assert!((near / exact - 1.0).abs() < 1.5e-15, "{amsl_m} m: {near} {exact}");
            }
        }
        assert!(DensityNearby::about(0.0).ratio(f64::NAN).is_nan());
    }
}
