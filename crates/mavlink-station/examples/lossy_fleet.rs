//! Downloads the logs of nine vehicles over a radio that loses a fifth of all frames, in simulated
//! time: `cargo run -p mavlink-station --example lossy_fleet`. No vehicle is needed, and nothing waits.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::{Write as _, stdout};

use mavlink_station::load::LinkLoad;
use mavlink_station::log_protocol::get::LogGet;
use mavlink_station::simulated::files::FileVehicle;
use mavlink_station::simulated::lossy::{Faults, LossyNet};
use mavlink_station::simulated::storage::MemoryStorage;
use mavlink_station::simulated::transfers::Transfers;
use mavlink_station::sink::Memory;
use mavlink_station::{DroneId, MS, Micros, Net as _, NoObserver, S, run_all};

const VEHICLES: u8 = 9;
const LENGTH: usize = 200_000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut vehicles = BTreeMap::new();
    for system in 1..=VEHICLES {
        let mut storage = MemoryStorage::default();
        storage.put("/APM/LOGS/00000001.BIN", vec![system; LENGTH]).map_err(|_| "no such name")?;
        let vehicle = FileVehicle::with_transfers(storage, "/APM/LOGS", Transfers::FIRMWARE);
        vehicles.insert(DroneId { network: 0, system }, vehicle);
    }
    // All of them share 200 kB/s.
    let faults = Faults {
        loss: 0.2,
        delay: 20 * MS,
        jitter: 5 * MS,
        bytes_per_s: 200_000.0,
        ..Faults::default()
    };
    let drones: Vec<DroneId> = vehicles.keys().copied().collect();
    let mut net = LossyNet::new(vehicles, faults, 1);

    let link = LinkLoad::default();
    let download = |drone: &DroneId| {
        let patience: Micros = 60 * S;
        let get = LogGet::new(*drone, 1, LENGTH as u64, Memory::default(), patience);
        (*drone, get.on_link(Some(&link)))
    };
    let done = run_all(&mut net, drones.iter().map(download).collect(), 9, &mut NoObserver)?;

    let mut out = stdout().lock();
    for (drone, got) in &done {
        let is_whole = got.result.is_ok() && got.sink.bytes == vec![drone.system; LENGTH];
        let tally = got.tally;
        writeln!(
            out,
            "vehicle {drone}: {}, {} bytes came twice",
            if is_whole { "whole" } else { "not whole" },
            tally.again_bytes
        )?;
    }
    let time_s = net.now() as f64 / S as f64;
    let rate = (done.len() * LENGTH) as f64 / time_s / 1e3;
    writeln!(out, "{} logs in {time_s:.1} s, {rate:.0} kB/s of data", done.len())?;
    Ok(())
}
