//! One log, three clients, one after the other: `cargo bench --bench pull_log -- ADDRESS...`, such as
//! `tcp:127.0.0.1:5770`, where a drone of real firmware answers.
//!
//! A plain client asks for the whole log by one LOG_REQUEST_DATA and for each gap by another; then
//! ours; then, where `UPDRAFT_PYTHON` names a Python that has it, pymavlink's MAVFTP. Time is from
//! the first request to the last byte.

#![expect(clippy::expect_used, reason = "a measurement that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "a table for people")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use updraft::fleet::intervals::Intervals;
use updraft::fleet::log_protocol::list::{Entry, LogList};
use updraft::fleet::log_protocol::{data_message, end_message};
use updraft::fleet::logs::one::OneOptions;
use updraft::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use updraft::link::clock::{Clock, MS, Micros, S};
use updraft::link::conversation::{NoObserver, Observer, Progress, run_all};
use updraft::link::frame::MavMessage;
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::link::station::{Setup, Station};

struct Wall(Instant);

impl Clock for Wall {
    fn now(&self) -> Micros {
        self.0.elapsed().as_micros() as Micros
    }

    #[expect(clippy::disallowed_methods, reason = "real sockets need a real clock")]
    fn unix_us(&self) -> u64 {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        since.map_or(0, |since| since.as_micros() as u64)
    }
}

fn main() {
    let addresses: Vec<String> =
        std::env::args().skip(1).filter(|text| text != "--bench").collect();
    if addresses.is_empty() {
        println!("give the addresses of drones: tcp:127.0.0.1:5770");
        return;
    }
    println!("drone  client            bytes   time s     kB/s");
    for address in &addresses {
        if let Some((drone, source)) = with_station(address) {
            by_pymavlink(address, drone, &source);
        }
    }
    if addresses.len() > 1 {
        together(&addresses);
    }
}

#[expect(clippy::disallowed_methods, reason = "real sockets need a real clock")]
fn station(addresses: &[String]) -> (Station, Vec<DroneId>) {
    let links = addresses.iter().map(|text| text.parse().expect("an address")).collect();
    let clock: Arc<dyn Clock> = Arc::new(Wall(Instant::now()));
    let mut station = Station::open(Setup { links, key: None, clock }).expect("a link");
    let until = station.now() + 20 * S;
    while station.heard().len() < addresses.len() && station.now() < until {
        let next = station.now() + 50 * MS;
        let _ = station.recv(next).expect("a link");
    }
    let heard = station.heard();
    (station, heard)
}

/// The plain client and ours; returns the log's path on the drone.
fn with_station(address: &str) -> Option<(DroneId, String)> {
    let (mut station, heard) = station(&[address.to_owned()]);
    let drone = *heard.first()?;
    let list = BTreeMap::from([(drone, LogList::new(drone, 20 * S))]);
    let listed = run_all(&mut station, list, 1, &mut NoObserver).expect("a link").remove(&drone)?;
    let log = listed.ok()?.into_iter().rfind(|log| log.size > 0)?;
    let (bytes, took) = by_a_plain_client(&mut station, drone, log);
    tell(drone, "plain", bytes, took);
    let folder = tempfile::tempdir().expect("a folder");
    let (bytes, took, source) = by_ours(&mut station, &[drone], folder.path());
    tell(drone, "updraft", bytes, took);
    Some((drone, source))
}

fn by_a_plain_client(station: &mut Station, drone: DroneId, log: Entry) -> (u64, Micros) {
    let begun = station.now();
    let mut have = Intervals::default();
    let mut last = begun;
    while let Some((start, end)) = have.gap(0, log.size) {
        let (ofs, count) = (start as u32, (end - start) as u32);
        station.send(drone, &data_message(drone, log.id, ofs, count)).expect("a link");
        // Until it falls silent, or all of this has come.
        loop {
            let until = station.now() + 300 * MS;
            let Some(received) = station.recv(until).expect("a link") else { break };
            if let MavMessage::LOG_DATA(data) = received.message {
                let at = u64::from(data.ofs);
                have.insert(at, at + u64::from(data.count));
                last = station.now();
            } else if station.now() > last + 300 * MS {
                break;
            }
            if have.contains(start, end) {
                break;
            }
        }
    }
    station.send(drone, &end_message(drone)).expect("a link");
    (have.total(), last - begun)
}

/// Sees when the last byte came; what follows proves the log.
struct LastByte {
    clock: Instant,
    at: Micros,
    done: BTreeMap<DroneId, u64>,
}

impl Observer for LastByte {
    fn on_progress(&mut self, drone: DroneId, progress: Progress, _over: bool) {
        let most = self.done.entry(drone).or_default();
        if progress.done > *most {
            *most = progress.done;
            self.at = self.clock.elapsed().as_micros() as Micros;
        }
    }
}

#[expect(clippy::disallowed_methods, reason = "a measurement")]
fn by_ours(station: &mut Station, drones: &[DroneId], folder: &Path) -> (u64, Micros, String) {
    let wanted: Vec<Wanted> = (1..)
        .zip(drones)
        .map(|(slot, drone)| Wanted {
            drone: *drone,
            slot,
            file: format!("{slot:03}.BIN"),
            flight: None,
        })
        .collect();
    let each = OneOptions { start_number: std::process::id(), ..OneOptions::default() };
    let options = PullOptions { each, at_once: 12, bytes_per_s: None, made_by: "bench".to_owned() };
    let mut last = LastByte { clock: Instant::now(), at: 0, done: BTreeMap::new() };
    let done = pull(station, folder, &wanted, &options, &mut last).expect("a link");
    let mut bytes = 0;
    let mut source = String::new();
    for outcome in done.into_values() {
        let Outcome::Done(done) = outcome else { continue };
        assert_eq!(done.failure, None);
        for entry in done.pulled {
            bytes += entry.size_bytes;
            source = entry.source;
        }
    }
    (bytes, last.at, source)
}

fn together(addresses: &[String]) {
    let (mut station, drones) = station(addresses);
    let folder = tempfile::tempdir().expect("a folder");
    let (bytes, took, _) = by_ours(&mut station, &drones, folder.path());
    println!(
        "{:>5}  updraft, together{bytes:>6} {:>8.2} {:>8.0}",
        drones.len(),
        s(took),
        kb(bytes, took)
    );
}

fn by_pymavlink(address: &str, drone: DroneId, source: &str) {
    let Some(python) = std::env::var_os("UPDRAFT_PYTHON") else { return };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/pull_log.py");
    let folder = tempfile::tempdir().expect("a folder");
    let local = folder.path().join("log.BIN");
    let mut run = Command::new(python);
    run.args([script, address, &drone.system.to_string(), source]).arg(&local);
    let output = run.output().expect("a Python");
    let text = String::from_utf8_lossy(&output.stdout);
    let took = text.lines().last().and_then(|line| line.split(' ').next()?.parse::<f64>().ok());
    let bytes = std::fs::metadata(&local).map_or(0, |about| about.len());
    tell(drone, "pymavlink MAVFTP", bytes, (took.unwrap_or(0.0) * 1e6) as Micros);
}

fn s(took: Micros) -> f64 {
    took as f64 / 1e6
}

fn kb(bytes: u64, took: Micros) -> f64 {
    bytes as f64 / 1e3 / s(took).max(1e-3)
}

fn tell(drone: DroneId, client: &str, bytes: u64, took: Micros) {
    println!(
        "{:>5}  {client:<16}{bytes:>8} {:>8.2} {:>8.0}",
        drone.system,
        s(took),
        kb(bytes, took)
    );
}
