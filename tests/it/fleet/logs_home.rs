//! Logs that still grow, and what is at home held against what the drone has.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::fleet::transfers::{content, drone};
use updraft::fleet::logs::manifest::{ManifestEntry, Method, Shelf, Verified};
use updraft::fleet::logs::one::{OneDone, OneOptions};
use updraft::fleet::logs::part::sums;
use updraft::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use updraft::fleet::logs::verify::verify;
use updraft::link::clock::{MS, Micros, S};
use updraft::link::conversation::NoObserver;
use updraft::link::frame::MavMessage;
use updraft::link::net::Net as _;
use updraft::virtual_fleet::endpoint::Endpoint;
use updraft::virtual_fleet::files::FileVehicle;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::MemoryStorage;

const LOG: &str = "/APM/LOGS/00000002.BIN";
/// What a growing log gets at once, bytes.
const PIECE: usize = 4096;

/// A vehicle that is armed for a while, and whose log grows for a while, by whole pieces, at
/// MAVFTP as well.
struct Logging {
    vehicle: FileVehicle<MemoryStorage>,
    armed: (Micros, Micros),
    grows: (Micros, Micros),
    /// Between two pieces.
    every: Micros,
    grown: Micros,
}

impl Endpoint for Logging {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        self.vehicle.on_message(now, message, out);
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        self.vehicle.is_armed = (self.armed.0..self.armed.1).contains(&now);
        while self.grown + self.every <= now.min(self.grows.1) {
            self.grown += self.every;
            if self.grown >= self.grows.0 {
                self.vehicle.storage.append(LOG, &content(self.grown, PIECE)).unwrap();
            }
        }
        self.vehicle.poll(now, out).min(self.grown + self.every)
    }
}

type Net = LossyNet<Logging>;

fn net() -> Net {
    let mut storage = MemoryStorage::default();
    storage.put("/APM/LOGS/00000001.BIN", content(9, 5_000)).unwrap();
    storage.put(LOG, content(1, 20_000)).unwrap();
    let vehicle = FileVehicle::new(storage, "/APM/LOGS", 0.0);
    let logging = Logging { vehicle, armed: (0, 0), grows: (0, 0), every: S, grown: 0 };
    let faults = Faults { delay: 5 * MS, ..Faults::default() };
    LossyNet::new(BTreeMap::from([(drone(1), logging)]), faults, 5)
}

fn logging(net: &mut Net) -> &mut Logging {
    net.vehicles.get_mut(&drone(1)).unwrap()
}

fn on_drone(net: &Net) -> Vec<u8> {
    net.vehicles[&drone(1)].vehicle.storage.get(LOG).unwrap().to_vec()
}

fn pull_again(net: &mut Net, logs: &Path, start_number: u32) -> OneDone {
    let wanted = [Wanted { drone: drone(1), slot: 1, file: "01.BIN".to_owned(), flight: None }];
    let options = PullOptions {
        each: OneOptions { start_number, ..OneOptions::default() },
        at_once: 4,
        bytes_per_s: None,
        made_by: "test".to_owned(),
    };
    let outcomes = pull(net, logs, &wanted, &options, &mut NoObserver).unwrap();
    let Outcome::Done(done) = outcomes[&drone(1)].clone() else { panic!("stopped") };
    done
}

fn home(logs: &Path) -> Vec<u8> {
    fs::read(logs.join("01.BIN")).unwrap()
}

fn is_whole(net: &Net, logs: &Path) -> bool {
    let shelf = Shelf::open(logs, "").unwrap();
    let entry = shelf.entry("01.BIN").unwrap();
    home(logs) == on_drone(net) && entry.incomplete.is_none()
}

/// Lets time pass.
fn rest(net: &mut Net, until: Micros) {
    while net.recv(until).unwrap().is_some() {}
}

#[test]
fn the_open_log_of_a_drone_that_arms_is_never_whole() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let mut net = net();
    // Its last heartbeat says disarmed; its log stays as it is for long enough to be compared.
    logging(&mut net).armed = (200 * MS, 30 * S);
    logging(&mut net).grows = (S, 45 * S);
    let failure = pull_again(&mut net, logs, 1).failure.unwrap();
    let said = format!("{}; {}", failure.reason, failure.advice);
    assert_eq!(said, "the drone is armed and gives no logs until it has landed; then run again");
    assert!(!logs.join("01.BIN").exists(), "a beginning was published");
    // Armed all the time, then disarmed, with the 15 s that the firmware writes on.
    assert!(pull_again(&mut net, logs, 2).failure.is_some());
    rest(&mut net, 31 * S);
    let done = pull_again(&mut net, logs, 3);
    assert_eq!((done.failure, done.pulled[0].verified), (None, Verified::Checksum));
    assert!(is_whole(&net, logs) && on_drone(&net).len() > 20_000 + 40 * PIECE);
}

#[test]
fn a_log_that_grows_after_disarming_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let mut net = net();
    (logging(&mut net).grows, logging(&mut net).every) = ((0, 8 * S), 1500 * MS);
    let done = pull_again(&mut net, folder.path(), 1);
    assert_eq!(done.failure, None);
    assert!(is_whole(&net, folder.path()) && on_drone(&net).len() == 20_000 + 5 * PIECE);
}

#[test]
fn a_log_that_grows_on_is_marked_and_continued_by_the_next_pull() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let mut net = net();
    logging(&mut net).vehicle.storage.put(LOG, content(1, 900_000)).unwrap();
    logging(&mut net).grows = (0, 40 * S);
    assert!(pull_again(&mut net, logs, 1).failure.is_some());
    let beginning = home(logs);
    assert!(on_drone(&net).starts_with(&beginning) && !is_whole(&net, logs));
    let fault = verify(logs).unwrap()[0].faults[0].to_string();
    assert!(fault.starts_with("is not known to be whole: the drone's log still grew"), "{fault}");
    rest(&mut net, 50 * S);
    let before = net.carried.down;
    assert_eq!(pull_again(&mut net, logs, 2).failure, None);
    let came = net.carried.down - before;
    assert!(is_whole(&net, logs) && came < 300_000, "{came}");
}

#[test]
fn a_log_that_is_longer_on_the_drone_is_continued() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let mut net = net();
    logging(&mut net).vehicle.storage.put(LOG, content(1, 500_000)).unwrap();
    assert_eq!(pull_again(&mut net, logs, 1).failure, None);
    // A later log is of another flight.
    let storage = &mut logging(&mut net).vehicle.storage;
    storage.put("/APM/LOGS/00000003.BIN", content(3, 900)).unwrap();
    let done = pull_again(&mut net, logs, 2);
    assert_eq!((&done.there[..], done.unchecked), (&["01.BIN".to_owned()][..], None));
    let reason = done.failure.unwrap().reason;
    assert!(reason.starts_with("the drone has a newer log (number 3)"), "{reason}");
    logging(&mut net).vehicle.storage.append(LOG, &content(4, 7_000)).unwrap();
    let before = net.carried.down;
    let done = pull_again(&mut net, logs, 3);
    assert_eq!((done.newer, done.pulled.len()), (Some(3), 1));
    let came = net.carried.down - before;
    assert!(is_whole(&net, logs) && came < 40_000, "{came}");
    // The same number, but another log: what is home stays.
    let ours = home(logs);
    logging(&mut net).vehicle.storage.put(LOG, content(5, 600_000)).unwrap();
    let done = pull_again(&mut net, logs, 4);
    assert_eq!(
        done.unchecked.unwrap(),
        "the drone's log is a different one (--again downloads it)"
    );
    assert!(home(logs) == ours && !logs.join("01.BIN.part").exists());
}

#[test]
fn a_log_that_was_damaged_at_home_is_set_aside_and_brought_again() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let mut net = net();
    for (number, damage) in [(1, vec![7; 20_000]), (2, vec![7; 100])] {
        pull_again(&mut net, logs, number * 2);
        fs::write(logs.join("01.BIN"), &damage).unwrap();
        assert!(!verify(logs).unwrap()[0].faults.is_empty());
        let done = pull_again(&mut net, logs, number * 2 + 1);
        assert_eq!((done.failure, done.pulled.len()), (None, 1));
        assert!(is_whole(&net, logs));
        let aside = logs.join(format!("older/01-damaged-{number}.BIN"));
        assert!(fs::read(aside).unwrap() == damage);
    }
}

/// What an import left.
fn imported(logs: &Path, bytes: &[u8], incomplete: Option<&str>) {
    fs::write(logs.join("01.BIN"), bytes).unwrap();
    let sums = sums(&logs.join("01.BIN")).unwrap();
    let entry = ManifestEntry {
        file: "01.BIN".to_owned(),
        slot: 1,
        drone: None,
        boot: None,
        source: "card/cut.BIN".to_owned(),
        size_bytes: sums.size,
        sha256: sums.sha256,
        method: Method::Import,
        method_reason: None,
        verified: Verified::Copy,
        incomplete: incomplete.map(str::to_owned),
        attempts: 1,
        at_unix_s: 0,
        flight: None,
    };
    Shelf::open(logs, "test").unwrap().add(entry).unwrap();
}

#[test]
fn an_imported_beginning_is_replaced_by_the_drones_longer_log() {
    let cut = "it ends in the air";
    for incomplete in [Some(cut), None] {
        let folder = tempfile::tempdir().unwrap();
        let mut net = net();
        imported(folder.path(), &content(1, 20_000)[..15_000], incomplete);
        let done = pull_again(&mut net, folder.path(), 1);
        assert_eq!((done.failure, done.pulled.len()), (None, 1));
        assert!(is_whole(&net, folder.path()));
    }
    // Of another log: a whole one stays, a beginning is set aside.
    let folder = tempfile::tempdir().unwrap();
    let (logs, mut net) = (folder.path(), net());
    imported(logs, &content(8, 15_000), None);
    assert!(pull_again(&mut net, logs, 1).unchecked.is_some());
    assert!(home(logs) == content(8, 15_000));
    imported(logs, &content(8, 15_000), Some(cut));
    assert_eq!(pull_again(&mut net, logs, 2).failure, None);
    assert!(is_whole(&net, logs));
    assert!(fs::read(logs.join("older/01-other-1.BIN")).unwrap() == content(8, 15_000));
}
