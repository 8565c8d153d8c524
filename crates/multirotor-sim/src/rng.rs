//! Random streams: one for each (seed, drone, purpose), independent of thread count and order.
//!
//! The numbers that follow a seed are part of what the simulator promises, and they hang on more than
//! the seed:
//!
//! * on the number of each [`Purpose`];
//! * for effects, on the effect's name ([`crate::effects::active`] mixes its hash into the seed), so
//!   that effects can be added and reordered freely, but not renamed;
//! * for parts of the air, on the name of the flight and the place of the part in its specification;
//! * wherever `drone` counts something else (the parts of a benchmark, simulated flights), on the place
//!   in that list, so that such lists only grow at their end.
//!
//! Tests pin the first draws of each: renaming, renumbering or reordering turns them red.

use rand_pcg::Pcg64;

/// Purpose of a random stream. Each has numbers of its own, so that a new consumer does not shift those of
/// another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Sensor noise of one vehicle.
    Sensors = 1,
    /// Manufacturing spread of one vehicle.
    Spread = 2,
    /// Motion of the air.
    Air = 3,
    /// Resampling in statistics.
    Resampling = 4,
    /// Chance within an effect, such as gusts.
    Effects = 5,
    /// Faults of a simulated radio link.
    Link = 6,
    /// Logs that a simulated campaign loses.
    Losses = 7,
    /// Choice of the hidden physics of a blind flight.
    Hidden = 8,
    /// Campaigns of a study: the levels of its factors.
    Design = 9,
}

/// The random stream of one drone and purpose: the generator PCG XSL RR 128/64 (O'Neill 2014), of which
/// drone and purpose select the sequence and the seed the place in it. Its output is stable across
/// releases.
pub fn stream(seed: u64, drone: u64, purpose: Purpose) -> Pcg64 {
    let selector = (u128::from(drone) << 64) | u128::from(purpose as u64);
    Pcg64::new(u128::from(seed) ^ 0x9E37_79B9_7F4A_7C15_F39C_C060_5CED_C834, selector)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng as _;

    #[test]
    fn first_draws_of_each_purpose_are_pinned() {
        let purposes = [
            (Purpose::Sensors, 1_094_595_014_111_599_031_u64),
            (Purpose::Spread, 8_794_811_414_775_087_508),
            (Purpose::Air, 6_999_452_854_233_234_891),
            (Purpose::Resampling, 16_114_580_854_388_305_728),
            (Purpose::Effects, 9_989_586_353_499_086_556),
            (Purpose::Link, 13_064_133_372_313_075_978),
            (Purpose::Losses, 15_892_548_217_100_850_607),
            (Purpose::Hidden, 2_891_771_322_711_400_073),
            (Purpose::Design, 15_551_438_536_731_458_224),
        ];
        let drawn = purposes.map(|(purpose, _)| (purpose, stream(7, 3, purpose).next_u64()));
        assert_eq!(drawn, purposes);
    }

    #[test]
    fn streams_repeat_and_differ() {
        let first = stream(7, 3, Purpose::Sensors).next_u64();
        assert_eq!(first, stream(7, 3, Purpose::Sensors).next_u64());
        assert_ne!(first, stream(7, 3, Purpose::Air).next_u64());
        assert_ne!(first, stream(7, 4, Purpose::Sensors).next_u64());
        assert_ne!(first, stream(8, 3, Purpose::Sensors).next_u64());
    }
}
