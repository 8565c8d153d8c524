//! Fields of known scales for the tests of the statistics.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use updraft::analysis::statistics::{FieldInput, FieldScales, Simulator};
use updraft::base::rng::{Purpose, stream};

/// A square grid with drones 7 m apart, as the paper flew it.
pub(crate) fn grid(side: u32) -> Vec<[f64; 2]> {
    (0..side * side).map(|i| [7.0 * f64::from(i / side), 7.0 * f64::from(i % side)]).collect()
}

/// A field as the paper fits it.
pub(crate) fn field(length_m: [f64; 2], tau_s: f64, noise_mps: f64) -> FieldScales {
    FieldScales { sd_mps: 1.0, length_m, tau_s, noise_mps }
}

/// What draws flights.
pub(crate) fn simulator(
    places_m: &[[f64; 2]],
    scales: FieldScales,
    seconds: usize,
    running_s: usize,
) -> Simulator {
    Simulator::new(places_m, scales, seconds, running_s).unwrap()
}

/// One flight, with something added to each value by drone and second.
pub(crate) fn flight(
    places_m: &[[f64; 2]],
    simulator: &Simulator,
    running_s: usize,
    seed: u64,
    add: impl Fn(usize) -> f64,
) -> FieldInput {
    let columns = simulator.flight(&mut stream(seed, 0, Purpose::Air));
    let values = |column: &[f64]| {
        column.iter().enumerate().map(|(second, value)| Some(value + add(second))).collect()
    };
    FieldInput {
        places_m: places_m.to_vec(),
        values_mps: columns.as_slice().chunks_exact(columns.nrows()).map(values).collect(),
        running_s,
    }
}
