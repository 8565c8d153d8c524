//! Reads parameters of every vehicle that is heard at an address:
//! `cargo run -p mavlink-station --example params -- udpin:0.0.0.0:14550 SYSID_THISMAV BATT_CAPACITY`.

use std::error::Error;
use std::io::{Write as _, stdout};
use std::sync::Arc;

use mavlink_station::params::ReadParams;
use mavlink_station::{Net as _, NoObserver, S, Setup, Station, SystemClock, run_all};

/// Vehicles send a heartbeat once a second.
const LISTEN: u64 = 3 * S;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let Some(address) = args.next() else {
        return Err("usage: params ADDRESS [NAME ...]".into());
    };
    let mut names: Vec<String> = args.collect();
    if names.is_empty() {
        names = ["SYSID_THISMAV", "FENCE_ENABLE", "BATT_CAPACITY"].map(str::to_owned).to_vec();
    }
    let setup =
        Setup { links: vec![address.parse()?], key: None, clock: Arc::new(SystemClock::start()) };
    let mut station = Station::open(setup)?;
    let until = station.now() + LISTEN;
    while station.recv(until)?.is_some() {}

    let reads = station.heard().into_iter();
    let reads = reads.map(|drone| (drone, ReadParams::new(drone, names.clone()))).collect();
    let mut out = stdout().lock();
    for (drone, values) in run_all(&mut station, reads, 20, &mut NoObserver)? {
        for name in &names {
            match values.get(name) {
                Some(value) => writeln!(out, "vehicle {drone}: {name} = {value}")?,
                None => writeln!(out, "vehicle {drone}: {name} was not answered")?,
            }
        }
    }
    Ok(())
}
