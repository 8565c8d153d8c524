//! Vehicles with files behind a bad radio, in simulated time.

use std::collections::BTreeMap;

use mavlink_station::simulated::endpoint::Endpoint;
use mavlink_station::simulated::files::FileVehicle;
use mavlink_station::simulated::lossy::{Faults, LossyNet};
use mavlink_station::simulated::storage::MemoryStorage;
use mavlink_station::{Conversation, DroneId, NoObserver, run_all};

pub(crate) type Net = LossyNet<FileVehicle<MemoryStorage>>;

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

/// `count` vehicles with one log of `length` bytes each, sending `packets_per_s` at most.
pub(crate) fn fleet(
    count: u8,
    length: usize,
    packets_per_s: f64,
    faults: Faults,
    seed: u64,
) -> Net {
    let vehicle = |system: u8| {
        let mut storage = MemoryStorage::default();
        storage
            .put("/APM/LOGS/00000001.BIN", content(system.into(), length))
            .expect("a plain name");
        (drone(system), FileVehicle::new(storage, "/APM/LOGS", packets_per_s))
    };
    LossyNet::new((1..=count).map(vehicle).collect::<BTreeMap<_, _>>(), faults, seed)
}

/// Runs one conversation with drone 1.
pub(crate) fn one<E: Endpoint, C: Conversation>(net: &mut LossyNet<E>, conversation: C) -> C::Done {
    let conversations = BTreeMap::from([(drone(1), conversation)]);
    run_all(net, conversations, 1, &mut NoObserver)
        .expect("a simulated link stays open")
        .remove(&drone(1))
        .expect("it ends")
}
