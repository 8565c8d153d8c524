//! Drones, and contents of files that can be told apart.

use mavlink_station::DroneId;

pub(crate) fn drone(system: u8) -> DroneId {
    DroneId { network: 0, system }
}

/// Bytes that repeat nowhere, another sequence for each seed.
pub(crate) fn content(seed: u64, length: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    (0..length)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 24) as u8
        })
        .collect()
}
