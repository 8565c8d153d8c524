//! Downloads a file of a vehicle by MAVFTP:
//! `cargo run -p mavlink-station --example pull_file -- udpin:0.0.0.0:14550 1 @SYS/threads.txt threads.txt`.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::{Write as _, stderr};
use std::path::Path;
use std::sync::Arc;

use mavlink_station::ftp::Caller;
use mavlink_station::ftp::get::{Get, GetOptions};
use mavlink_station::link::clock::Clock as _;
use mavlink_station::sink::Memory;
use mavlink_station::{
    DroneId, Micros, Net as _, Observer, Progress, S, Setup, Station, SystemClock, run_all,
};
use untrusted_io::file::write_whole;

/// Shows how far the download is.
struct Shown(u64);

impl Observer for Shown {
    fn on_progress(&mut self, drone: DroneId, progress: Progress, over: bool) {
        let percent = (100 * progress.done).checked_div(progress.total).unwrap_or(0);
        if percent != self.0 || over {
            self.0 = percent;
            let _ = write!(stderr(), "\rvehicle {drone}: {percent} % ");
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [address, system, remote, local] = args.as_slice() else {
        return Err("usage: pull_file ADDRESS SYSTEM REMOTE LOCAL".into());
    };
    let drone: DroneId = system.parse()?;
    let clock = Arc::new(SystemClock::start());
    // A vehicle takes numbers that it has just seen for a repetition: each run begins elsewhere.
    let caller = Caller::new(drone, (clock.unix_us() / 1_000) as u32);
    let mut station = Station::open(Setup { links: vec![address.parse()?], key: None, clock })?;
    let until: Micros = station.now() + 5 * S;
    while !station.heard().contains(&drone) {
        if station.recv(until)?.is_none() {
            return Err(format!("vehicle {drone} is not heard").into());
        }
    }

    let get = Get::new(caller, remote, Memory::default(), GetOptions::default());
    let gets = BTreeMap::from([(drone, get)]);
    let done = run_all(&mut station, gets, 1, &mut Shown(0))?.remove(&drone);
    let got = done.ok_or("the download was stopped")?;
    got.result?;
    write_whole(Path::new(local), &got.sink.bytes)?;
    let tally = got.tally;
    writeln!(stderr(), "\n{} bytes, {} came twice", got.sink.bytes.len(), tally.again_bytes)?;
    Ok(())
}
