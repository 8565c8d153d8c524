//! Bringing logs home from a fleet behind a bad radio, in simulated time.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::Path;

use crate::fleet::transfers::{content, drone, wanted};
use updraft::fleet::logs::manifest::{Method, Shelf, Verified};
use updraft::fleet::logs::one::{OneDone, OneOptions, Which};
use updraft::fleet::logs::pull::{Outcome, PullOptions, pull};
use updraft::fleet::logs::verify::verify;
use updraft::link::clock::{MS, Micros, S};
use updraft::link::conversation::{NoObserver, Observer};
use updraft::link::frame::MavMessage;
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::virtual_fleet::endpoint::Endpoint;
use updraft::virtual_fleet::files::FileVehicle;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::MemoryStorage;

/// A vehicle to which things happen.
struct Eventful {
    vehicle: FileVehicle<MemoryStorage>,
    reboots: Vec<Micros>,
    /// Every so often, the newest log grows by 35 bytes, until then.
    grows: Option<(Micros, Micros)>,
    grown: Micros,
}

impl Endpoint for Eventful {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        self.vehicle.on_message(now, message, out);
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        if self.reboots.first().is_some_and(|at| *at <= now) {
            self.reboots.remove(0);
            self.vehicle.reboot(now, 20 * S);
        }
        if let Some((every, until)) = self.grows
            && now >= self.grown + every
            && now < until
        {
            self.grown = now;
            self.vehicle.storage.append(LOG, &[7; 35]).unwrap();
        }
        self.vehicle.poll(now, out)
    }
}

const LOG: &str = "/APM/LOGS/00000002.BIN";

fn vehicle(system: u8, length: usize) -> Eventful {
    let mut storage = MemoryStorage::default();
    storage.put("/APM/LOGS/00000001.BIN", content(1000 + u64::from(system), 5_000)).unwrap();
    storage.put(LOG, content(system.into(), length)).unwrap();
    storage.put("/APM/LOGS/LASTLOG.TXT", b"2\n".to_vec()).unwrap();
    let vehicle = FileVehicle::new(storage, "/APM/LOGS", 300.0);
    Eventful { vehicle, reboots: Vec::new(), grows: None, grown: 0 }
}

fn fleet(count: u8, faults: Faults, length: impl Fn(u8) -> usize) -> LossyNet<Eventful> {
    let vehicles: BTreeMap<_, _> =
        (1..=count).map(|system| (drone(system), vehicle(system, length(system)))).collect();
    LossyNet::new(vehicles, faults, 11)
}

fn options(start_number: u32) -> PullOptions {
    PullOptions {
        each: OneOptions { start_number, unix_s: 1_800_000_000, ..OneOptions::default() },
        at_once: 16,
        bytes_per_s: None,
        made_by: "updraft test".to_owned(),
    }
}

struct StopAt(Micros);

impl Observer for StopAt {
    fn stop(&mut self, now: Micros) -> bool {
        now >= self.0
    }
}

fn done(outcomes: &BTreeMap<DroneId, Outcome>, system: u8) -> &OneDone {
    match &outcomes[&drone(system)] {
        Outcome::Done(done) => done,
        Outcome::Stopped => panic!("{system} was stopped"),
    }
}

fn bad() -> Faults {
    Faults {
        loss: 0.2,
        repeat: 0.05,
        delay: 200 * MS,
        jitter: 50 * MS,
        bytes_per_s: 150_000.0,
        ..Faults::default()
    }
}

/// What a kill leaves: the last line of a journal is torn.
fn tear_journals(folder: &Path) -> usize {
    let mut torn = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "journal") {
            let mut file = fs::OpenOptions::new().append(true).open(&path).unwrap();
            file.write_all(b"0-4000").unwrap();
            torn += 1;
        }
    }
    torn
}

#[test]
fn all_but_the_drone_that_is_gone_come_home_whole_through_everything() {
    let length = |system: u8| 120_000 + 997 * usize::from(system);
    let mut net = fleet(49, bad(), length);
    net.vehicles.remove(&drone(13));
    net.vehicles.get_mut(&drone(3)).unwrap().reboots = vec![9 * S];
    net.vehicles.get_mut(&drone(7)).unwrap().reboots = vec![14 * S, 60 * S];
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path().join("logs");
    let wanted = wanted(49);
    for (run, stop) in [(1, 17 * S), (2, 43 * S)] {
        pull(&mut net, &logs, &wanted, &options(run), &mut StopAt(stop)).unwrap();
        assert!(tear_journals(&logs) > 0);
        println!("run {run}: {} home", Shelf::open(&logs, "").unwrap().manifest.logs.len());
    }
    let outcomes = pull(&mut net, &logs, &wanted, &options(3), &mut NoObserver).unwrap();
    println!("{} s", net.now() / S);
    // Simulated time: the link carries the logs and what is lost of them in 150 s.
    assert!(net.now() / S <= 220, "{} s", net.now() / S);
    let mut resumed = 0;
    for system in (1..=49).filter(|system| *system != 13) {
        let done = done(&outcomes, system);
        assert_eq!(done.failure, None, "{system}");
        let bytes = fs::read(logs.join(format!("{system:02}.BIN"))).unwrap();
        assert!(bytes == content(system.into(), length(system)), "{system}");
        resumed += usize::from(done.pulled.iter().any(|entry| entry.attempts > 1));
    }
    assert!(resumed > 0);
    let missing = done(&outcomes, 13).failure.clone().unwrap();
    insta::assert_snapshot!(format!("{}; {}", missing.reason, missing.advice));
    let names: Vec<String> = fs::read_dir(&logs)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| Path::new(name).extension().is_none_or(|extension| extension != "BIN"))
        .collect();
    assert_eq!(names, ["manifest.json"]);
    let shelf = Shelf::open(&logs, "").unwrap();
    assert_eq!(shelf.manifest.logs.len(), 48);
    let by_checksum = |verified| verified == Verified::Checksum;
    assert!(shelf.manifest.logs.iter().all(|entry| by_checksum(entry.verified)));
    // They are whole, but what this test made is no log.
    let checked = verify(&logs).unwrap();
    assert!(checked.iter().all(|one| one.faults.len() == 1
        && one.faults[0].to_string().starts_with("is what the drone had, but no log")));
    // Of what is there only the list is asked for; and of drones that are gone it stays.
    let before = net.carried.down;
    let outcomes = pull(&mut net, &logs, &wanted[..3], &options(4), &mut NoObserver).unwrap();
    assert_eq!(
        (&*done(&outcomes, 2).there, &done(&outcomes, 2).unchecked),
        (&["02.BIN".to_owned()][..], &None)
    );
    let heartbeats_and_lists = net.carried.down - before;
    assert!(heartbeats_and_lists < 20_000, "{heartbeats_and_lists}");
    net.vehicles.clear();
    let outcomes = pull(&mut net, &logs, &wanted[..3], &options(5), &mut NoObserver).unwrap();
    assert_eq!(done(&outcomes, 2).there, ["02.BIN"]);
    // A heartbeat may have been on its way.
    let unchecked = done(&outcomes, 2).unchecked.as_ref().unwrap();
    assert!(["no answer for 11 s", "no answer for 12 s"].iter().any(|a| unchecked.starts_with(a)));
}

fn one(net: &mut LossyNet<Eventful>, logs: &Path, options: &PullOptions) -> OneDone {
    done(&pull(net, logs, &wanted(1), options, &mut NoObserver).unwrap(), 1).clone()
}

#[test]
fn without_mavftp_the_log_messages_bring_it() {
    for faults in [Faults::default(), bad()] {
        let mut net = fleet(1, faults, |_| 150_000);
        net.vehicles.get_mut(&drone(1)).unwrap().vehicle.ftp = None;
        let folder = tempfile::tempdir().unwrap();
        let done = one(&mut net, folder.path(), &options(1));
        assert_eq!(done.failure, None);
        assert_eq!(done.pulled[0].method, Method::LogMessages);
        assert_eq!(done.pulled[0].source, "log 2");
        let reason = done.pulled[0].method_reason.as_deref();
        assert_eq!(reason, Some("MAVFTP: no answer for 12 s: is it on, and within reach?"));
        assert!(fs::read(folder.path().join("01.BIN")).unwrap() == content(1, 150_000));
        println!("log messages: {} s", net.now() / S);
    }
}

#[test]
fn a_log_that_grows_is_a_prefix_of_what_is_on_the_drone() {
    let mut net = fleet(1, bad(), |_| 300_000);
    net.vehicles.get_mut(&drone(1)).unwrap().grows = Some((S, 4_000 * S));
    let folder = tempfile::tempdir().unwrap();
    let done = one(&mut net, folder.path(), &options(1));
    let failure = done.failure.unwrap();
    assert_eq!(failure.reason, "its log still grows, and only its beginning has been downloaded");
    assert_eq!(done.pulled[0].verified, Verified::Sample);
    assert!(done.pulled[0].incomplete.is_some());
    let bytes = fs::read(folder.path().join("01.BIN")).unwrap();
    let all = net.vehicles[&drone(1)].vehicle.storage.get(LOG).unwrap();
    assert!(bytes.len() > 300_000 && all.starts_with(&bytes));
    // It stops growing while it comes: then the whole.
    let mut net = fleet(1, bad(), |_| 300_000);
    net.vehicles.get_mut(&drone(1)).unwrap().grows = Some((S, 5 * S));
    let folder = tempfile::tempdir().unwrap();
    let done = one(&mut net, folder.path(), &options(1));
    assert_eq!(done.pulled[0].verified, Verified::Checksum);
    let bytes = fs::read(folder.path().join("01.BIN")).unwrap();
    assert!(bytes == net.vehicles[&drone(1)].vehicle.storage.get(LOG).unwrap());
}

#[test]
fn a_part_of_another_log_of_the_same_name_is_begun_anew() {
    let folder = tempfile::tempdir().unwrap();
    let mut net = fleet(1, bad(), |_| 300_000);
    pull(&mut net, folder.path(), &wanted(1), &options(1), &mut StopAt(7 * S)).unwrap();
    assert!(folder.path().join("01.BIN.part").exists());
    let other = content(77, 310_000);
    net.vehicles.get_mut(&drone(1)).unwrap().vehicle.storage.put(LOG, other.clone()).unwrap();
    let done = one(&mut net, folder.path(), &options(2));
    assert_eq!(done.failure, None);
    assert!(fs::read(folder.path().join("01.BIN")).unwrap() == other);
    // And one that has shrunk.
    let folder = tempfile::tempdir().unwrap();
    let mut net = fleet(1, bad(), |_| 300_000);
    pull(&mut net, folder.path(), &wanted(1), &options(1), &mut StopAt(7 * S)).unwrap();
    net.vehicles.get_mut(&drone(1)).unwrap().vehicle.storage.put(LOG, vec![5; 999]).unwrap();
    assert_eq!(one(&mut net, folder.path(), &options(2)).failure, None);
    assert!(fs::read(folder.path().join("01.BIN")).unwrap() == vec![5; 999]);
}

#[test]
fn a_drone_has_several_logs() {
    let folder = tempfile::tempdir().unwrap();
    let mut net = fleet(1, Faults::default(), |_| 10_000);
    let mut options = options(1);
    options.each.which = Which::Number(1);
    one(&mut net, folder.path(), &options);
    assert!(fs::read(folder.path().join("01.BIN")).unwrap() == content(1001, 5_000));
    options.each.which = Which::Number(9);
    let failure = one(&mut net, folder.path(), &options).failure.unwrap();
    assert_eq!(failure.reason, "the drone has no such log, only 1, 2");
    options.each.which = Which::All;
    let done = one(&mut net, folder.path(), &options);
    assert_eq!(done.pulled.len(), 2);
    assert!(fs::read(folder.path().join("01.BIN")).unwrap() == content(1, 10_000));
    let older = folder.path().join("older/01-00000001.BIN");
    assert!(fs::read(older).unwrap() == content(1001, 5_000));
}

#[test]
fn an_armed_drone_a_foreign_file_and_a_full_card_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut net = fleet(1, Faults::default(), |_| 10_000);
    net.vehicles.get_mut(&drone(1)).unwrap().vehicle.is_armed = true;
    let armed = one(&mut net, folder.path(), &options(1)).failure.unwrap();
    net.vehicles.get_mut(&drone(1)).unwrap().vehicle.is_armed = false;
    fs::write(folder.path().join("01.BIN"), b"mine").unwrap();
    let foreign = one(&mut net, folder.path(), &options(1)).failure.unwrap();
    assert_eq!(fs::read(folder.path().join("01.BIN")).unwrap(), b"mine");
    let mut small = options(2);
    small.each.again = true;
    small.each.most_size = 9_999;
    let large = one(&mut net, folder.path(), &small).failure.unwrap();
    let lines = [armed, foreign, large].map(|f| format!("{}; {}", f.reason, f.advice));
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn a_budget_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let faults = Faults { delay: 20 * MS, ..Faults::default() };
    let mut net = fleet(4, faults, |_| 200_000);
    let options = PullOptions { bytes_per_s: Some(30_000.0), ..options(1) };
    pull(&mut net, folder.path(), &wanted(4), &options, &mut NoObserver).unwrap();
    let rate = net.carried.down as f64 / (net.now() as f64 / 1e6);
    // The last request may be served in a moment; heartbeats and lists are not counted.
    assert!((25_000.0..34_000.0).contains(&rate), "{rate}");
}
