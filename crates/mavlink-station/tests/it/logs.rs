//! How well the log messages use a link, with vehicles that send as the firmware does.

use std::collections::BTreeMap;

use mavlink_station::link::frame::MavMessage;
use mavlink_station::log_protocol::get::LogGet;
use mavlink_station::simulated::endpoint::Endpoint;
use mavlink_station::simulated::files::FileVehicle;
use mavlink_station::simulated::lossy::{Faults, LossyNet};
use mavlink_station::simulated::storage::MemoryStorage;
use mavlink_station::simulated::transfers::Transfers;
use mavlink_station::sink::Memory;
use mavlink_station::{MS, Micros, Net as _, S};

use crate::support::{content, drone, one};

/// A vehicle that remembers what it was asked for.
struct Asked {
    vehicle: FileVehicle<MemoryStorage>,
    /// Bytes of each LOG_REQUEST_DATA.
    windows: Vec<u32>,
}

impl Endpoint for Asked {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        if let MavMessage::LOG_REQUEST_DATA(asked) = message {
            self.windows.push(asked.count);
        }
        self.vehicle.on_message(now, message, out);
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        self.vehicle.poll(now, out)
    }
}

fn vehicle(length: usize, transfers: Transfers, faults: Faults, seed: u64) -> LossyNet<Asked> {
    let mut storage = MemoryStorage::default();
    storage.put("/APM/LOGS/00000001.BIN", content(1, length)).expect("a plain name");
    let vehicle = FileVehicle::with_transfers(storage, "/APM/LOGS", transfers);
    let vehicles = BTreeMap::from([(drone(1), Asked { vehicle, windows: Vec::new() })]);
    LossyNet::new(vehicles, faults, seed)
}

fn limited(bytes_per_s: f64, loss: f64) -> Faults {
    Faults { loss, delay: 20 * MS, jitter: 5 * MS, bytes_per_s, ..Faults::default() }
}

/// Of a frame of 90 data bytes (10 header, 7 + 90 payload, 2 checksum).
const DATA: f64 = 90.0 / 109.0;

/// Share of what the link's loss leaves, bytes that came again per
/// byte.
fn by_log_messages(bytes_per_s: f64, loss: f64, length: usize) -> (f64, f64) {
    let mut net = vehicle(length, Transfers::FIRMWARE, limited(bytes_per_s, loss), 5);
    let get = LogGet::new(drone(1), 1, length as u64, Memory::default(), 60 * S);
    let got = one(&mut net, get);
    assert_eq!(got.result, Ok(length as u64));
    assert!(got.sink.bytes == content(1, length));
    let took_s = net.now() as f64 / 1e6;
    let share = length as f64 / took_s / (bytes_per_s * (1.0 - loss) * DATA);
    (share, got.tally.again_bytes as f64 / length as f64)
}

#[test]
fn the_log_messages_use_nine_tenths_of_what_a_links_loss_leaves() {
    let mut worst: f64 = 1.0;
    for (bytes_per_s, length) in [(1e6, 8_000_000), (200e3, 3_000_000)] {
        for loss in [0.0, 0.1, 0.2] {
            let (share, again) = by_log_messages(bytes_per_s, loss, length);
            println!("{bytes_per_s} B/s, loss {loss}: {share:.3} used, {again:.3} again");
            worst = worst.min(share);
        }
    }
    assert!(worst >= 0.9, "{worst}");
}

#[test]
fn a_serial_radio_is_never_asked_for_more_than_it_carries_in_a_second() {
    // 57,600 baud; the vehicle waits while its port is full.
    let transfers = Transfers::both(5_760.0 / 109.0);
    let faults = Faults { delay: 60 * MS, jitter: 20 * MS, ..Faults::default() };
    for loss in [0.0, 0.1] {
        let mut net = vehicle(150_000, transfers, Faults { loss, ..faults }, 2);
        let get = LogGet::new(drone(1), 1, 150_000, Memory::default(), 60 * S);
        let got = one(&mut net, get);
        assert!(got.result.is_ok());
        let most = net.vehicles[&drone(1)].windows.iter().copied().max().unwrap_or_default();
        let share = 150_000.0 / (net.now() as f64 / 1e6) / (5_760.0 * DATA * (1.0 - loss));
        println!("loss {loss}: {most} bytes at once, {share:.3} used");
        assert!((1_000..=5_760).contains(&most), "{most}");
        assert!(share > 0.85, "{share}");
    }
}

#[test]
fn windows_suit_a_short_queue() {
    // What has to wait for longer is lost: a window that takes 450 ms would be cut each time.
    let faults = Faults { queue: 200 * MS, ..limited(1e6, 0.0) };
    let mut net = vehicle(8_000_000, Transfers::FIRMWARE, faults, 3);
    let get = LogGet::new(drone(1), 1, 8_000_000, Memory::default(), 60 * S);
    assert!(one(&mut net, get).result.is_ok());
    let share = 8_000_000.0 / (net.now() as f64 / 1e6) / (1e6 * DATA);
    println!("queue of 200 ms: {share:.3}");
    assert!(share > 0.9, "{share}");
}
