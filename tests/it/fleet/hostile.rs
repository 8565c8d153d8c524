//! Drones that lie, and packets that nobody sent.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::BTreeMap;
use std::fs;

use crate::fleet::transfers::{content, drone};
use proptest::prelude::*;
use updraft::fleet::ftp::Caller;
use updraft::fleet::ftp::get::{Get, GetOptions};
use updraft::fleet::ftp::list::List;
use updraft::fleet::ftp::put::Put;
use updraft::fleet::log_protocol::get::LogGet;
use updraft::fleet::log_protocol::list::LogList;
use updraft::fleet::logs::manifest::{Method, Verified};
use updraft::fleet::logs::one::{OneDone, OneOptions};
use updraft::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use updraft::fleet::sink::Memory;
use updraft::link::clock::{Micros, S};
use updraft::link::conversation::{Conversation, NoObserver, Step};
use updraft::link::frame::{FrameLoss, MavMessage, dialect};
use updraft::link::traffic::{Traffic, troubles};
use updraft::protocol::ftp::{Op, PAYLOAD, Packet};
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

fn message(kind: u8, mut payload: [u8; PAYLOAD], numbers: (u32, u32, u16, u8)) -> MavMessage {
    let (ofs, size, id, count) = numbers;
    match kind % 4 {
        0 => MavMessage::LOG_DATA(dialect::LOG_DATA_DATA { ofs, id: id % 4, count, data: [3; 90] }),
        1 => MavMessage::LOG_ENTRY(dialect::LOG_ENTRY_DATA {
            time_utc: 0,
            size,
            id: id % 300,
            num_logs: (ofs % 400) as u16,
            last_log_num: id,
        }),
        _ => {
            payload[3] = 128 + payload[3] % 2;
            payload[5] %= 16;
            payload[4] %= 240;
            // Often near enough to be believed.
            payload[10] = 0;
            payload[11] = 0;
            MavMessage::FILE_TRANSFER_PROTOCOL(dialect::FILE_TRANSFER_PROTOCOL_DATA {
                target_network: 0,
                target_system: 0,
                target_component: 0,
                payload,
            })
        }
    }
}

/// Feeds a conversation messages, those about FTP with its own numbers; it must end.
fn survives<C: Conversation>(mut conversation: C, messages: &[MavMessage]) {
    let mut now = 0;
    let mut last = [0_u8; 4];
    let mut messages = messages.iter();
    for _ in 0..200_000 {
        match conversation.poll(now) {
            Step::Done(_) => return,
            Step::Wait(until) => {
                if let Some(message) = messages.next() {
                    let mut message = message.clone();
                    if let MavMessage::FILE_TRANSFER_PROTOCOL(ftp) = &mut message {
                        let number = u16::from_le_bytes([last[0], last[1]]);
                        let step = 1 + u16::from(ftp.payload[0] % 3);
                        ftp.payload[..2].copy_from_slice(&number.wrapping_add(step).to_le_bytes());
                        ftp.payload[2] = last[2];
                        if ftp.payload[6] % 4 != 0 {
                            ftp.payload[5] = last[3];
                        }
                    }
                    now += 1000;
                    conversation.on_message(now, &message);
                } else {
                    assert!(until > now, "it waits for the past");
                    now = until;
                }
            }
            Step::Send(message) => {
                if let MavMessage::FILE_TRANSFER_PROTOCOL(ftp) = &*message {
                    last = [ftp.payload[0], ftp.payload[1], ftp.payload[2], ftp.payload[3]];
                }
            }
        }
    }
    panic!("it never ends");
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 96,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]
    #[test]
    fn any_packets_are_survived(
        seeds in proptest::collection::vec(
            (any::<u8>(), any::<[u8; 32]>(), (0u32..100_000, any::<u32>(), any::<u16>(), any::<u8>())),
            0..200,
        )
    ) {
        let messages: Vec<MavMessage> = seeds
            .into_iter()
            .map(|(kind, head, numbers)| {
                let mut payload = [0; PAYLOAD];
                payload[..32].copy_from_slice(&head);
                message(kind, payload, numbers)
            })
            .collect();
        let caller = || Caller::new(drone(1), 1);
        let options = GetOptions { most_size: 200_000, ..GetOptions::default() };
        survives(Get::new(caller(), LOG, Memory::default(), options), &messages);
        survives(List::new(caller(), "/", 20 * S), &messages);
        survives(Put::new(caller(), LOG, vec![1; 3000], 20 * S), &messages);
        survives(LogGet::new(drone(1), 1, 100_000, Memory::default(), 20 * S), &messages);
        survives(LogList::new(drone(1), 20 * S), &messages);
    }
}
