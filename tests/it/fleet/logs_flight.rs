//! Of several logs on a drone, the one of the flight comes home: by what each says of its own time.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::fleet::transfers::drone;
use updraft::base::time::GpsTime;
use updraft::fleet::logs::manifest::{LogFlight, ManifestEntry, Method, Shelf, Verified};
use updraft::fleet::logs::one::{OneDone, OneOptions, Which};
use updraft::fleet::logs::part::sums;
use updraft::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use updraft::link::clock::MS;
use updraft::link::conversation::NoObserver;
use updraft::log::catalog::{ARM, GPS, RCOU, SHOW};
use updraft::log::{LogWriter, MessageDef, Value};
use updraft::virtual_fleet::files::FileVehicle;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::MemoryStorage;

/// GPS time of board time 0.
const BOOTED: GpsTime = GpsTime { week: 2445, tow_ms: 400_000_000 };

fn at(board_s: i64) -> GpsTime {
    GpsTime::from_total_ms(BOOTED.total_ms() + 1000 * board_s).unwrap()
}

fn row(log: &mut LogWriter<Vec<u8>>, message: &'static MessageDef, values: &[(&str, Value<'_>)]) {
    let value = |label| {
        let given = values.iter().find(|(name, _)| *name == label);
        given.map_or(Value::Int(0), |(_, value)| *value)
    };
    let row: Vec<Value<'_>> = message.fields.split(',').map(value).collect();
    log.row(message, &row).unwrap();
}

/// A log of flights that began at these board times, s; each lasts a minute.
fn log_of(starts_s: &[i64]) -> Vec<u8> {
    let mut log = LogWriter::new(Vec::new(), &[&GPS, &SHOW, &ARM, &RCOU]).unwrap();
    for start_s in starts_s {
        let time = |tick: i64| Value::Int((start_s * 10 + tick) * 100_000);
        let armed = |log: &mut LogWriter<Vec<u8>>, tick: i64, armed: i64| {
            row(log, &ARM, &[("TimeUS", time(tick)), ("ArmState", Value::Int(armed))]);
        };
        armed(&mut log, -80, 1);
        for tick in -80..600 {
            let gps = GpsTime::from_total_ms(at(*start_s).total_ms() + 100 * tick).unwrap();
            let stage = if tick < 0 { 2 } else { 4 };
            row(
                &mut log,
                &GPS,
                &[
                    ("TimeUS", time(tick)),
                    ("Status", Value::Int(3)),
                    ("GWk", Value::Int(gps.week.into())),
                    ("GMS", Value::Int(gps.tow_ms.into())),
                    ("Lat", Value::Float(-35.0)),
                    ("Lng", Value::Float(149.0)),
                ],
            );
            let clock = Value::Int(100 * tick);
            let stage = Value::Int(stage);
            row(&mut log, &SHOW, &[("TimeUS", time(tick)), ("ClockMS", clock), ("Stage", stage)]);
            row(&mut log, &RCOU, &[("TimeUS", time(tick)), ("C1", Value::Int(1500))]);
        }
        armed(&mut log, 600, 0);
    }
    log.finish().unwrap()
}

type Net = LossyNet<FileVehicle<MemoryStorage>>;

fn net(logs: &[(u32, Vec<u8>)]) -> Net {
    let mut storage = MemoryStorage::default();
    for (number, bytes) in logs {
        storage.put(&format!("/APM/LOGS/{number:08}.BIN"), bytes.clone()).unwrap();
    }
    let vehicle = FileVehicle::new(storage, "/APM/LOGS", 0.0);
    let faults = Faults { delay: 5 * MS, ..Faults::default() };
    LossyNet::new(BTreeMap::from([(drone(1), vehicle)]), faults, 5)
}

/// The flight number `number`, which began at this board time.
fn flight(number: u32, start_s: i64) -> LogFlight {
    LogFlight {
        number,
        authorized_start: Some(at(start_s)),
        gps_start: None,
        booted: None,
        show_crc32: Some(7),
    }
}

fn pulled(net: &mut Net, logs: &Path, which: Which, flight: Option<LogFlight>) -> OneDone {
    let wanted = [Wanted { drone: drone(1), slot: 1, file: "01.BIN".to_owned(), flight }];
    let options = PullOptions {
        each: OneOptions { which, ..OneOptions::default() },
        at_once: 4,
        bytes_per_s: None,
        made_by: "test".to_owned(),
    };
    let outcomes = pull(net, logs, &wanted, &options, &mut NoObserver).unwrap();
    let Outcome::Done(done) = outcomes[&drone(1)].clone() else { panic!("stopped") };
    done
}

fn file(logs: &Path, name: &str) -> Vec<u8> {
    fs::read(logs.join(name)).unwrap()
}

#[test]
fn a_later_flight_is_put_by_and_the_flights_own_log_comes() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let (early, own, late) = (log_of(&[100]), log_of(&[1000]), log_of(&[3000]));
    let mut net = net(&[(1, early), (2, own.clone()), (3, late.clone())]);
    let done = pulled(&mut net, logs, Which::Flight, Some(flight(1, 1000)));
    assert_eq!(done.failure, None);
    assert!(file(logs, "01.BIN") == own && file(logs, "older/01-00000003.BIN") == late);
    let shelf = Shelf::open(logs, "").unwrap();
    let entry = shelf.entry("01.BIN").unwrap();
    let found = LogFlight { gps_start: Some(at(1000)), booted: Some(BOOTED), ..flight(1, 1000) };
    assert_eq!((entry.boot, entry.flight.as_ref()), (Some(2), Some(&found)));
    let other = shelf.entry("older/01-00000003.BIN").unwrap().flight.as_ref().unwrap();
    assert_eq!((other.number, other.gps_start), (0, Some(at(3000))));
    // It stays, and the newer one is told.
    let again = pulled(&mut net, logs, Which::Flight, Some(flight(1, 1000)));
    assert_eq!(
        (again.there, again.newer, again.failure),
        (vec!["01.BIN".to_owned()], Some(3), None)
    );
}

#[test]
fn a_drone_that_did_not_log_the_flight_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let mut net = net(&[(1, log_of(&[100])), (2, log_of(&[1000]))]);
    let failure = pulled(&mut net, logs, Which::Flight, Some(flight(1, 9000))).failure.unwrap();
    assert!(
        failure.reason.starts_with("log 2 of the drone belongs to another flight: "),
        "{}",
        failure.reason
    );
    assert!(!logs.join("01.BIN").exists(), "another flight's log stands for this one's");
    assert!(logs.join("older/01-00000002.BIN").exists(), "and what came is kept");
    assert!(!logs.join("older/01-00000001.BIN").exists(), "older ones are not asked for");
}

#[test]
fn a_log_of_the_flight_before_makes_room_and_is_not_fetched_twice() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let (first, both) = (log_of(&[100]), log_of(&[100, 1000]));
    assert!(both.starts_with(&first));
    pulled(&mut net(&[(1, first.clone())]), logs, Which::Flight, Some(flight(1, 100)));
    assert!(file(logs, "01.BIN") == first);
    // The firmware has appended the second flight.
    let done = pulled(&mut net(&[(1, both.clone())]), logs, Which::Flight, Some(flight(2, 1000)));
    assert_eq!((&done.failure, &done.moved), (&None, &vec![logs.join("flight-1/01.BIN")]));
    assert!(file(logs, "01.BIN") == both && file(logs, "flight-1/01.BIN") == first);
    let earlier = Shelf::open(&logs.join("flight-1"), "").unwrap();
    assert_eq!(earlier.entry("01.BIN").unwrap().flight.as_ref().unwrap().number, 1);
    // A card was formatted: other logs under the same number.
    let third = log_of(&[5000]);
    let done = pulled(&mut net(&[(1, third.clone())]), logs, Which::Flight, Some(flight(3, 5000)));
    assert_eq!(done.failure, None);
    assert!(file(logs, "01.BIN") == third && file(logs, "flight-2/01.BIN") == both);
}

#[test]
fn without_a_start_a_newer_log_on_the_drone_is_never_passed_over_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let (first, second) = (log_of(&[100]), log_of(&[1000]));
    pulled(&mut net(&[(1, first.clone())]), logs, Which::Flight, None);
    let mut net = net(&[(1, first.clone()), (2, second.clone())]);
    let failure = pulled(&mut net, logs, Which::Flight, None).failure.unwrap();
    assert_eq!(
        failure.reason,
        "the drone has a newer log (number 2) than the one here (number 1), and no start was \
         recorded that says which belongs to this flight"
    );
    assert!(file(logs, "01.BIN") == first);
    assert_eq!(pulled(&mut net, logs, Which::Newest, None).failure, None);
    assert!(file(logs, "01.BIN") == second && file(logs, "flight-0/01.BIN") == first);
}

#[test]
fn a_number_that_is_asked_for_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let (first, second) = (log_of(&[100]), log_of(&[1000]));
    let mut net = net(&[(1, first.clone()), (2, second.clone())]);
    pulled(&mut net, logs, Which::Number(2), None);
    pulled(&mut net, logs, Which::Number(1), None);
    assert!(file(logs, "01.BIN") == first && file(logs, "flight-0/01.BIN") == second);
    pulled(&mut net, logs, Which::Number(2), None);
    assert!(file(logs, "01.BIN") == second && file(logs, "flight-0/01-2.BIN") == first);
    assert!(file(logs, "flight-0/01.BIN") == second, "never overwritten");
}

#[test]
fn a_log_that_nobody_knows_makes_room_for_the_flights_own() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let (strange, own) = (log_of(&[100]), log_of(&[1000]));
    fs::write(logs.join("01.BIN"), &strange).unwrap();
    let done = pulled(&mut net(&[(2, own.clone())]), logs, Which::Flight, Some(flight(1, 1000)));
    assert_eq!(done.failure, None);
    assert!(file(logs, "01.BIN") == own && file(logs, "flight-0/01.BIN") == strange);
}

#[test]
fn entries_of_older_versions_are_held_against_the_start_by_their_logs() {
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path();
    let own = log_of(&[1000]);
    fs::write(logs.join("01.BIN"), &own).unwrap();
    let found = sums(&logs.join("01.BIN")).unwrap();
    let entry = ManifestEntry {
        file: "01.BIN".to_owned(),
        slot: 1,
        drone: Some(drone(1)),
        boot: Some(2),
        source: "/APM/LOGS/00000002.BIN".to_owned(),
        size_bytes: found.size,
        sha256: found.sha256,
        method: Method::Mavftp,
        method_reason: None,
        verified: Verified::Checksum,
        incomplete: None,
        attempts: 1,
        at_unix_s: 0,
        flight: None,
    };
    Shelf::open(logs, "test").unwrap().add(entry).unwrap();
    let mut net = net(&[(2, own.clone())]);
    let done = pulled(&mut net, logs, Which::Flight, Some(flight(1, 1000)));
    assert_eq!((done.there, done.failure), (vec!["01.BIN".to_owned()], None));
    assert!(file(logs, "01.BIN") == own && !logs.join("flight-0").exists());
}
