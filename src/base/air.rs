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
}
