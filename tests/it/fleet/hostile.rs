//! Drones that lie.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::BTreeMap;
use std::fs;

use crate::fleet::transfers::{content, drone};
use updraft::fleet::logs::manifest::{Method, Verified};
use updraft::fleet::logs::one::{OneDone, OneOptions};
use updraft::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use updraft::link::clock::{Micros, S};
use updraft::link::conversation::NoObserver;
use updraft::link::frame::{FrameLoss, MavMessage};
use updraft::link::traffic::{Traffic, troubles};
use updraft::protocol::ftp::{Op, Packet};
use updraft::virtual_fleet::endpoint::Endpoint;
use updraft::virtual_fleet::files::FileVehicle;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::MemoryStorage;

const LOG: &str = "/APM/LOGS/00000001.BIN";

/// Changes an answer before it is sent.
type Lie = fn(&mut Packet, u64);

struct Liar {
    vehicle: FileVehicle<MemoryStorage>,
    lie: Lie,
    answers: u64,
}

impl Liar {
    fn twist(&mut self, out: &mut [MavMessage]) {
        for message in out {
            let MavMessage::FILE_TRANSFER_PROTOCOL(message) = message else { continue };
            let mut packet = Packet::from_payload(&message.payload).unwrap();
            self.answers += 1;
            (self.lie)(&mut packet, self.answers);
            message.payload = packet.to_payload();
        }
    }
}

impl Endpoint for Liar {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        self.vehicle.on_message(now, message, out);
        self.twist(out);
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        let wake = self.vehicle.poll(now, out);
        self.twist(out);
        wake
    }
}

fn pulled(lie: Lie) -> (OneDone, Option<Vec<u8>>) {
    pulled_over(0.3, lie)
}

/// Over a link on which such a share of the frames arrives twice.
fn pulled_over(repeat: f64, lie: Lie) -> (OneDone, Option<Vec<u8>>) {
    let mut storage = MemoryStorage::default();
    storage.put(LOG, content(1, 200_000)).unwrap();
    let vehicle = FileVehicle::new(storage, "/APM/LOGS", 500.0);
    let liar = Liar { vehicle, lie, answers: 0 };
    let faults = Faults { loss: 0.05, repeat, delay: 30_000, ..Faults::default() };
    let mut net = LossyNet::new(BTreeMap::from([(drone(1), liar)]), faults, 3);
    let folder = tempfile::tempdir().unwrap();
    let logs = folder.path().join("logs");
    let wanted = [Wanted { drone: drone(1), slot: 1, file: "01.BIN".to_owned(), flight: None }];
    let options = PullOptions {
        each: OneOptions { patience: 40 * S, ..OneOptions::default() },
        at_once: 4,
        bytes_per_s: None,
        made_by: "test".to_owned(),
    };
    let outcomes = pull(&mut net, &logs, &wanted, &options, &mut NoObserver).unwrap();
    let entries = fs::read_dir(folder.path()).unwrap();
    let names: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    assert!(names.iter().all(|name| *name == logs), "written elsewhere: {names:?}");
    let Outcome::Done(done) = outcomes[&drone(1)].clone() else { panic!("stopped") };
    (done, fs::read(logs.join("01.BIN")).ok())
}

#[test]
fn a_size_that_lies_is_found_out_and_the_log_messages_tell_the_truth() {
    let (done, bytes) = pulled(|packet, _| {
        if packet.request == Op::OpenFileRO && packet.op == Op::Ack {
            packet.data = 290_000_u32.to_le_bytes().to_vec();
        }
    });
    assert_eq!(done.failure, None);
    assert_eq!(done.pulled[0].method, Method::LogMessages);
    insta::assert_snapshot!(done.pulled[0].method_reason.as_deref().unwrap());
    assert!(bytes.unwrap() == content(1, 200_000));
}

#[test]
fn a_huge_size_is_refused() {
    let (done, bytes) = pulled(|packet, _| {
        if packet.request == Op::OpenFileRO && packet.op == Op::Ack {
            packet.data = u32::MAX.to_le_bytes().to_vec();
        }
    });
    insta::assert_snapshot!(done.failure.unwrap().reason);
    assert_eq!(bytes, None);
}

#[test]
fn data_at_wrong_places_is_found_out_by_the_checksum() {
    // For a while: then it is brought again, and whole.
    let (done, bytes) = pulled(|packet, answers| {
        if packet.op == Op::Ack && packet.request == Op::BurstReadFile && answers < 300 {
            packet.offset = packet.offset.wrapping_add(478);
        }
    });
    assert_eq!(done.failure, None);
    assert!(bytes.unwrap() == content(1, 200_000));
}

/// Every single read lies, always; bursts tell the truth.
fn reads_lie(packet: &mut Packet, _: u64) {
    if packet.op == Op::Ack && packet.request == Op::ReadFile {
        packet.data.iter_mut().for_each(|byte| *byte ^= 0x55);
    }
}

#[test]
fn reads_that_are_always_wrong_are_given_up_for_the_log_messages() {
    // What bursts lost is repaired by reads, so that the checksum of the whole differs each time.
    // The log is brought anew three times; then MAVFTP is not believed any more, and the log
    // messages bring it: the fifth attempt.
    let (done, bytes) = pulled_over(0.0, reads_lie);
    assert_eq!(done.failure, None);
    assert!(bytes.unwrap() == content(1, 200_000));
    let [entry] = &done.pulled[..] else { panic!("{:?}", done.pulled) };
    assert_eq!(entry.method, Method::LogMessages, "{entry:?}");
    let reason = entry.method_reason.as_deref();
    assert_eq!(reason, Some("MAVFTP: the checksum differs, 4 times"));
    assert_eq!(entry.attempts, 5);
}

#[test]
fn reads_that_are_always_wrong_do_not_matter_where_none_is_needed() {
    // Supposed, not traced: a request for a burst that arrives twice is served twice, and hardly a
    // packet is lost both times. The share of repeats and its draws decide how many attempts it takes.
    // An attempt in which none is needs no read, and its checksum is right.
    let (done, bytes) = pulled_over(0.8, reads_lie);
    assert_eq!(done.failure, None);
    assert!(bytes.unwrap() == content(1, 200_000));
    let [entry] = &done.pulled[..] else { panic!("{:?}", done.pulled) };
    assert_eq!((entry.method, entry.verified), (Method::Mixed, Verified::Checksum), "{entry:?}");
    assert!((2..=4).contains(&entry.attempts), "{entry:?}");
}

#[test]
fn names_that_lead_elsewhere_are_not_followed() {
    let (done, bytes) = pulled(|packet, _| {
        if packet.op == Op::Ack && packet.request == Op::ListDirectory {
            *packet = packet
                .clone()
                .with_data(b"F../../00000009.BIN\t10\0F/etc/00000010.BIN\t10\0F..\t1\0Fx\0");
        }
    });
    assert_eq!(bytes, None);
    assert!(done.failure.is_some() && done.pulled.is_empty());
}

#[test]
fn what_people_must_know_of_their_links_is_said_and_what_is_usual_is_not() {
    let said = |loss: FrameLoss, doubled: &[u8]| {
        let traffic = Traffic { bytes_in: 20_000, loss, ..Traffic::default() };
        let doubled = doubled.iter().map(|system| drone(*system)).collect();
        let all = troubles(&BTreeMap::from([(1, traffic)]), &doubled);
        all.into_iter().map(|trouble| trouble.text).collect::<Vec<_>>().join("\n")
    };
    let usual = FrameLoss { noise_bytes: 1_900, unknown: 40, ..FrameLoss::default() };
    assert_eq!(said(usual, &[]), "");
    let all = FrameLoss { noise_bytes: 2_100, version_1: 1, unknown: 0, unsigned: 3, forged: 2 };
    insta::assert_snapshot!(said(all, &[4]));
}
