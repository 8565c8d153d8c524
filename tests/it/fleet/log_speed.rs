//! How fast logs come home, in simulated time, from vehicles that send as the firmware does.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::BTreeMap;
use std::path::Path;

use crate::fleet::transfers::{content, drone, wanted};
use updraft::fleet::logs::manifest::{Method, Verified};
use updraft::fleet::logs::one::{OneDone, OneOptions};
use updraft::fleet::logs::pull::{Outcome, PullOptions, pull};
use updraft::link::clock::{MS, Micros, S};
use updraft::link::conversation::{NoObserver, Observer, Progress};
use updraft::link::frame::MavMessage;
use updraft::link::id::DroneId;
use updraft::link::net::{Net as _, Received};
use updraft::virtual_fleet::endpoint::Endpoint;
use updraft::virtual_fleet::files::FileVehicle;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::MemoryStorage;
use updraft::virtual_fleet::transfers::Transfers;

/// A vehicle that remembers what it was asked for.
struct Asked {
    vehicle: FileVehicle<MemoryStorage>,
    /// Bytes of each LOG_REQUEST_DATA, and when it came.
    windows: Vec<(Micros, u32)>,
    bursts: usize,
    ends: usize,
    arms_at: Micros,
}

impl Endpoint for Asked {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        match message {
            MavMessage::LOG_REQUEST_DATA(asked) => self.windows.push((now, asked.count)),
            MavMessage::LOG_REQUEST_END(_) => self.ends += 1,
            MavMessage::FILE_TRANSFER_PROTOCOL(asked) => {
                self.bursts += usize::from(asked.payload[3] == 15);
            }
            _ => {}
        }
        self.vehicle.on_message(now, message, out);
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        self.vehicle.is_armed |= now >= self.arms_at;
        self.vehicle.poll(now, out)
    }
}

fn vehicle(files: &[(&str, Vec<u8>)], transfers: Transfers) -> Asked {
    let mut storage = MemoryStorage::default();
    for (name, content) in files {
        storage.put(&format!("/APM/LOGS/{name}"), content.clone()).unwrap();
    }
    let vehicle = FileVehicle::with_transfers(storage, "/APM/LOGS", transfers);
    Asked { vehicle, windows: Vec::new(), bursts: 0, ends: 0, arms_at: Micros::MAX }
}

fn fleet(
    count: u8,
    length: usize,
    transfers: Transfers,
    faults: Faults,
    seed: u64,
) -> LossyNet<Asked> {
    let one = |system: u8| {
        let log = content(system.into(), length);
        (drone(system), vehicle(&[("00000001.BIN", log)], transfers))
    };
    LossyNet::new((1..=count).map(one).collect::<BTreeMap<_, _>>(), faults, seed)
}

fn limited(bytes_per_s: f64, loss: f64) -> Faults {
    Faults { loss, delay: 20 * MS, jitter: 5 * MS, bytes_per_s, ..Faults::default() }
}

/// Of a frame of 90 data bytes (10 header, 7 + 90 payload, 2 checksum).
const DATA: f64 = 90.0 / 109.0;

fn pull_all(
    net: &mut LossyNet<Asked>,
    logs: &Path,
    count: u8,
    watch: &mut dyn Observer,
) -> BTreeMap<u8, Outcome> {
    let options = PullOptions {
        each: OneOptions { start_number: 9, ..OneOptions::default() },
        at_once: 12,
        bytes_per_s: None,
        made_by: "updraft test".to_owned(),
    };
    let done = pull(net, logs, &wanted(count), &options, watch).unwrap();
    done.into_iter().map(|(drone, outcome)| (drone.system, outcome)).collect()
}

fn one(net: &mut LossyNet<Asked>, logs: &Path) -> OneDone {
    match pull_all(net, logs, 1, &mut NoObserver).remove(&1) {
        Some(Outcome::Done(done)) => done,
        other => panic!("{other:?}"),
    }
}

/// Sees when the last byte came.
struct LastByte {
    at: Micros,
    now: Micros,
    done: BTreeMap<DroneId, u64>,
    stop_at: Micros,
}

impl LastByte {
    fn new(stop_at: Micros) -> Self {
        Self { at: 0, now: 0, done: BTreeMap::new(), stop_at }
    }

    fn s(&self) -> f64 {
        self.at as f64 / 1e6
    }
}

impl Observer for LastByte {
    fn on_message(&mut self, now: Micros, _received: &Received) {
        self.now = now;
    }

    fn on_progress(&mut self, drone: DroneId, progress: Progress, _over: bool) {
        let most = self.done.entry(drone).or_default();
        if progress.done > *most {
            *most = progress.done;
            self.at = self.now;
        }
    }

    fn stop(&mut self, now: Micros) -> bool {
        now >= self.stop_at
    }
}

#[test]
fn a_log_comes_as_fast_as_the_firmware_sends_it_and_is_proved_by_its_checksum() {
    const LENGTH: usize = 7_300_000;
    let folder = tempfile::tempdir().unwrap();
    let faults = Faults { delay: MS, ..Faults::default() };
    let mut net = fleet(1, LENGTH, Transfers::FIRMWARE, faults, 1);
    let mut watch = LastByte::new(Micros::MAX);
    let done = pull_all(&mut net, folder.path(), 1, &mut watch).remove(&1);
    let Some(Outcome::Done(done)) = done else { panic!("{done:?}") };
    assert_eq!(done.failure, None);
    let entry = &done.pulled[0];
    assert_eq!((entry.method, entry.verified), (Method::Mixed, Verified::Checksum));
    assert_eq!((entry.source.as_str(), entry.boot), ("/APM/LOGS/00000001.BIN", Some(1)));
    assert!(std::fs::read(folder.path().join("01.BIN")).unwrap() == content(1, LENGTH));
    let rate = LENGTH as f64 / watch.s();
    println!("{:.0} kB/s in {:.2} s", rate / 1e3, watch.s());
    assert!(rate >= 0.9 * 90.0 * Transfers::FIRMWARE.logs_per_s, "{rate}");
    assert!(net.vehicles[&drone(1)].ends >= 2);
}

#[test]
fn over_limited_links_with_loss_the_faster_way_is_found() {
    for (bytes_per_s, loss) in [(1e6, 0.1), (1e6, 0.2), (200e3, 0.1), (200e3, 0.2)] {
        let length = if bytes_per_s > 500e3 { 16_000_000 } else { 4_000_000 };
        let folder = tempfile::tempdir().unwrap();
        let mut net = fleet(1, length, Transfers::FIRMWARE, limited(bytes_per_s, loss), 4);
        let mut watch = LastByte::new(Micros::MAX);
        let done = pull_all(&mut net, folder.path(), 1, &mut watch).remove(&1);
        let Some(Outcome::Done(done)) = done else { panic!("{done:?}") };
        assert_eq!(done.failure, None);
        let share = length as f64 / watch.s() / (bytes_per_s * (1.0 - loss) * DATA);
        let proof_s = net.now() as f64 / 1e6 - watch.s();
        println!("{bytes_per_s} B/s, loss {loss}: {share:.3}, proved in {proof_s:.2} s");
        // With all that comes before the first window.
        assert!(share >= 0.9, "{bytes_per_s} {loss}: {share}");
        // A lost request for the checksum is noticed.
        assert!(proof_s < 4.0, "{bytes_per_s} {loss}: {proof_s}");
    }
}

/// Nine drones on one link: share of what its loss leaves that is used until the last byte of the
/// last one.
fn by_nine(bytes_per_s: f64, loss: f64, length: usize, seed: u64) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let mut net = fleet(9, length, Transfers::FIRMWARE, limited(bytes_per_s, loss), seed);
    let mut watch = LastByte::new(Micros::MAX);
    let done = pull_all(&mut net, folder.path(), 9, &mut watch);
    for (system, outcome) in &done {
        let Outcome::Done(done) = outcome else { panic!("{system}") };
        assert_eq!(done.failure, None, "{system}");
        assert_eq!(done.pulled[0].verified, Verified::Checksum);
    }
    9.0 * length as f64 / watch.s() / (bytes_per_s * (1.0 - loss) * DATA)
}

#[test]
fn nine_drones_share_a_link() {
    let cases = [
        (1e6, 0.0, 600_000, 3, 0.9),
        (1e6, 0.1, 600_000, 4, 0.85),
        (1e6, 0.1, 600_000, 1, 0.85),
        (1e6, 0.1, 1_800_000, 4, 0.9),
        (1e6, 0.2, 1_800_000, 5, 0.9),
        (1e6, 0.2, 1_800_000, 6, 0.9),
        // The drone whose first answers are lost begins late, and ends alone: with short logs that
        // is a fifth of the time.
        (200e3, 0.2, 400_000, 2, 0.75),
        (1e6, 0.2, 600_000, 2, 0.75),
    ];
    for (bytes_per_s, loss, length, seed, least) in cases {
        let share = by_nine(bytes_per_s, loss, length, seed);
        println!("nine, {bytes_per_s} B/s, loss {loss}, {length} bytes: {share:.3}");
        assert!(share >= least, "{bytes_per_s} {loss} {length}: {share}");
    }
}

#[test]
fn where_the_log_messages_are_slower_mavftp_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let transfers = Transfers { ftp_per_s: 400.0, logs_per_s: 100.0 };
    let faults = Faults { delay: 2 * MS, ..Faults::default() };
    let mut net = fleet(1, 2_000_000, transfers, faults, 1);
    let mut watch = LastByte::new(Micros::MAX);
    let done = pull_all(&mut net, folder.path(), 1, &mut watch).remove(&1);
    let Some(Outcome::Done(done)) = done else { panic!("{done:?}") };
    assert_eq!(done.failure, None);
    assert!(net.vehicles[&drone(1)].bursts > 10);
    let rate = 2_000_000.0 / watch.s();
    println!("{rate}");
    assert!(rate > 0.85 * 400.0 * 239.0, "{rate}");
}

#[test]
fn numbers_of_files_and_of_the_log_messages_differ() {
    let folder = tempfile::tempdir().unwrap();
    let files = [
        ("00000003.BIN", content(3, 200_000)),
        ("00000005.BIN", content(5, 300_000)),
        ("00000006.BIN", content(6, 300_000)),
    ];
    let faults = Faults { delay: 2 * MS, ..Faults::default() };
    let vehicles = BTreeMap::from([(drone(1), vehicle(&files, Transfers::FIRMWARE))]);
    let mut net = LossyNet::new(vehicles, faults, 1);
    let done = one(&mut net, folder.path());
    assert_eq!(done.failure, None);
    let entry = &done.pulled[0];
    assert_eq!((entry.method, entry.boot), (Method::Mixed, Some(6)));
    assert!(std::fs::read(folder.path().join("01.BIN")).unwrap() == files[2].1);
}

#[test]
fn an_interrupted_download_frees_the_drone() {
    let folder = tempfile::tempdir().unwrap();
    // Slow, so that it is in the middle of a window.
    let transfers = Transfers { ftp_per_s: 100.0, logs_per_s: 2_000.0 };
    let faults = Faults { delay: 5 * MS, ..Faults::default() };
    let mut net = fleet(1, 3_000_000, transfers, faults, 1);
    let mut watch = LastByte::new(5 * S);
    let done = pull_all(&mut net, folder.path(), 1, &mut watch);
    assert!(matches!(done[&1], Outcome::Stopped));
    let until = net.now() + 20 * MS;
    while net.recv(until).unwrap().is_some() {}
    let vehicle = &net.vehicles[&drone(1)];
    assert!(!vehicle.vehicle.logs.is_sending(), "it does not arm");
    assert_eq!(vehicle.ends, 2);
    // And goes on where it was.
    let before = vehicle.windows.iter().map(|(_, count)| u64::from(*count)).sum::<u64>();
    let done = one(&mut net, folder.path());
    assert_eq!(done.failure, None);
    let all = net.vehicles[&drone(1)].windows.iter().map(|(_, count)| u64::from(*count));
    assert!(all.sum::<u64>() < 3_200_000 + before / 4, "{before}");
}

#[test]
fn a_drone_that_is_armed_meanwhile_is_freed_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let transfers = Transfers { ftp_per_s: 100.0, logs_per_s: 1_000.0 };
    let mut net = fleet(1, 3_000_000, transfers, Faults::default(), 1);
    net.vehicles.get_mut(&drone(1)).unwrap().arms_at = 3 * S;
    let done = one(&mut net, folder.path());
    let reason = done.failure.unwrap().reason;
    assert!(reason.starts_with("the drone is armed and gives no logs"), "{reason}");
    let until = net.now() + MS;
    while net.recv(until).unwrap().is_some() {}
    assert_eq!(net.vehicles[&drone(1)].ends, 2);
}
