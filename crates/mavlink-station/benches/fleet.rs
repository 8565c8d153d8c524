//! File transfer: `cargo bench -p mavlink-station`.
//!
//! CPU for a megabyte, with frames encoded and decoded on both ends, over a link without limits.

use std::collections::BTreeMap;

use divan::Bencher;
use divan::counter::BytesCount;
use mavlink_station::ftp::Caller;
use mavlink_station::ftp::get::{Get, GetOptions};
use mavlink_station::simulated::files::FileVehicle;
use mavlink_station::simulated::lossy::{Faults, LossyNet};
use mavlink_station::simulated::storage::MemoryStorage;
use mavlink_station::sink::Memory;
use mavlink_station::{DroneId, NoObserver, run_all};

const SIZE: usize = 1_000_000;
const LOG: &str = "/APM/LOGS/00000001.BIN";

fn main() {
    divan::main();
}

#[divan::bench(args = [0.0, 0.2])]
fn get_a_megabyte(bencher: Bencher<'_, '_>, loss: f64) {
    let drone = DroneId { network: 0, system: 1 };
    bencher
        .counter(BytesCount::new(SIZE))
        .with_inputs(|| {
            let mut storage = MemoryStorage::default();
            storage.put(LOG, vec![7; SIZE]).expect("a plain name");
            let vehicle = FileVehicle::new(storage, "/APM/LOGS", 0.0);
            LossyNet::new(
                BTreeMap::from([(drone, vehicle)]),
                Faults { loss, ..Faults::default() },
                1,
            )
        })
        .bench_values(|mut net| {
            let get =
                Get::new(Caller::new(drone, 1), LOG, Memory::default(), GetOptions::default());
            let conversations = BTreeMap::from([(drone, get)]);
            run_all(&mut net, conversations, 1, &mut NoObserver)
                .expect("a simulated link stays open")
        });
}
