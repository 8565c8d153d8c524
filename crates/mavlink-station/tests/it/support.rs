//! Vehicles with files behind a bad radio, in simulated time.

use std::collections::BTreeMap;

use mavlink_station::simulated::endpoint::Endpoint;
use mavlink_station::simulated::files::FileVehicle;
use mavlink_station::simulated::lossy::{Faults, LossyNet};
use mavlink_station::simulated::storage::MemoryStorage;
use mavlink_station::{Conversation, NoObserver, run_all};

pub(crate) use crate::content::{content, drone};

pub(crate) type Net = LossyNet<FileVehicle<MemoryStorage>>;

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
