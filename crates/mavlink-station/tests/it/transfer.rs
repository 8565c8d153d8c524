//! File transfer with drones over a bad radio, in simulated time.

#![expect(clippy::unwrap_used, reason = "a simulated link stays open")]

use crate::support::{content, drone, fleet, one};
use mavlink_station::ftp::get::{Get, GetOptions};
use mavlink_station::ftp::list::List;
use mavlink_station::ftp::put::Put;
use mavlink_station::ftp::sum::Sum;
use mavlink_station::ftp::{Caller, FtpError};
use mavlink_station::simulated::lossy::Faults;
use mavlink_station::simulated::storage::Storage as _;
use mavlink_station::sink::Memory;
use mavlink_station::{MS, Net as _, NoObserver, S, run_all};
use untrusted_io::crc::ap_crc32;

const LOG: &str = "/APM/LOGS/00000001.BIN";

fn bad() -> Faults {
    Faults { loss: 0.2, repeat: 0.05, delay: 200 * MS, jitter: 30 * MS, ..Faults::default() }
}

fn get() -> Get<Memory> {
    Get::new(Caller::new(drone(1), 7), LOG, Memory::default(), GetOptions::default())
}

#[test]
fn a_file_comes_whole_over_a_bad_link() {
    for length in [0, 1, 238, 239, 240, 10_000, 239 * 500, 400_000] {
        let mut net = fleet(1, length, 400.0, bad(), 5);
        let got = one(&mut net, get());
        assert_eq!(got.result, Ok(length as u64), "{length}");
        assert!(got.sink.bytes == content(1, length), "{length}");
        // What came twice: repeats of the radio (5 %), and what was asked for in vain.
        let again = got.tally.again_bytes as f64 / length.max(10_000) as f64;
        assert!(again < 0.12, "{length}: {again} {:?}", got.tally);
    }
}

#[test]
fn over_a_good_link_nothing_is_asked_for_twice() {
    let mut net = fleet(1, 500_000, 400.0, Faults { delay: 50 * MS, ..Faults::default() }, 1);
    let got = one(&mut net, get());
    assert_eq!(got.result, Ok(500_000));
    assert_eq!((got.tally.again_bytes, got.tally.reads, got.tally.opened), (0, 0, 1));
    assert_eq!(got.tally.bursts, 5);
    // 2093 packets at 400 per second, and a few round trips.
    assert!(net.now() < 6 * S, "{} s", net.now() / S);
}

/// Share of a link's capacity that carried useful bytes, of what the loss leaves.
fn efficiency(drones: u8, loss: f64) -> (f64, f64) {
    const CAPACITY: f64 = 100_000.0;
    let length = if drones == 1 { 4_800_000 } else { 800_000 };
    let faults = Faults {
        loss,
        delay: 20 * MS,
        jitter: 5 * MS,
        bytes_per_s: CAPACITY,
        queue: 300 * MS,
        ..Faults::default()
    };
    // More than the link carries, as vehicles on a fast radio do.
    let pps = if drones == 1 { 500.0 } else { 200.0 };
    let mut net = fleet(drones, length, pps, faults, 3);
    let conversations = (1..=drones)
        .map(|system| {
            let caller = Caller::new(drone(system), 7);
            (drone(system), Get::new(caller, LOG, Memory::default(), GetOptions::default()))
        })
        .collect();
    let done = run_all(&mut net, conversations, 3, &mut NoObserver).unwrap();
    let useful: u64 = done.values().map(|got| got.tally.new_bytes).sum();
    let again: u64 = done.values().map(|got| got.tally.again_bytes).sum();
    assert_eq!(useful, length as u64 * u64::from(drones));
    // Of a frame of 239 data bytes (10 header, 3 + 12 payload, 2 checksum).
    let payload = 239.0 / 266.0;
    let took_s = net.now() as f64 / 1e6;
    let share = useful as f64 / took_s / (CAPACITY * (1.0 - loss) * payload);
    (share, again as f64 / useful as f64)
}

#[test]
fn a_limited_link_is_used_to_nine_tenths_of_what_its_loss_leaves() {
    let mut worst: f64 = 1.0;
    for (drones, loss) in
        [(1, 0.0), (12, 0.0), (12, 0.01), (12, 0.1), (12, 0.2), (1, 0.01), (1, 0.1), (1, 0.2)]
    {
        let (share, again) = efficiency(drones, loss);
        println!("{drones} drones, loss {loss}: {share:.3} used, {again:.3} again");
        worst = worst.min(share);
    }
    assert!(worst >= 0.9, "{worst}");
}

#[test]
fn a_file_is_put_whole_over_a_bad_link() {
    for length in [0, 1, 239, 5_000] {
        let mut net = fleet(1, 10, 400.0, bad(), 5);
        let vehicle = net.vehicles.get_mut(&drone(1)).unwrap();
        vehicle.storage.create_folder("collmot").unwrap();
        let content = content(9, length);
        let path = "/collmot/show.skyb";
        let put = Put::new(Caller::new(drone(1), 1), path, content.clone(), 60 * S);
        assert_eq!(one(&mut net, put), Ok(()));
        assert_eq!(net.vehicles[&drone(1)].storage.get(path), Some(&content[..]));
    }
}

#[test]
fn before_its_folder_is_there_a_put_says_so() {
    let mut net = fleet(1, 10, 400.0, Faults::default(), 5);
    let put = Put::new(Caller::new(drone(1), 1), "/collmot/show.skyb", vec![1], 60 * S);
    let error = one(&mut net, put).unwrap_err();
    assert_eq!(error.to_string(), "creating the file was refused: no such file");
}

#[test]
fn a_folder_is_listed_over_a_bad_link() {
    let mut net = fleet(1, 10, 400.0, bad(), 5);
    let vehicle = net.vehicles.get_mut(&drone(1)).unwrap();
    for number in 2..60 {
        vehicle.storage.put(&format!("APM/LOGS/{number:08}.BIN"), vec![0; number]).unwrap();
    }
    let list = one(&mut net, List::new(Caller::new(drone(1), 1), "/APM/LOGS", 60 * S)).unwrap();
    assert_eq!(list.len(), 59);
    assert_eq!((list[58].name.as_str(), list[58].size), ("00000059.BIN", Some(59)));
    let sum = one(&mut net, Sum::new(Caller::new(drone(1), 2), LOG, 10, 60 * S));
    assert_eq!(sum, Ok(ap_crc32(&content(1, 10))));
}

#[test]
fn a_vehicle_that_is_gone_or_lies_is_named_so() {
    let mut net = fleet(1, 10_000, 400.0, bad(), 5);
    net.vehicles.clear();
    let silent = one(&mut net, get()).result.unwrap_err();
    assert_eq!(silent.to_string(), "no answer for 60 s: is it on, and within reach?");
    let mut net = fleet(1, 10_000, 400.0, Faults::default(), 5);
    let options = GetOptions { most_size: 9_999, ..GetOptions::default() };
    let get = Get::new(Caller::new(drone(1), 7), LOG, Memory::default(), options);
    let error = one(&mut net, get).result.unwrap_err();
    assert_eq!(error, FtpError::TooLarge { size: 10_000, most: 9_999 });
}
