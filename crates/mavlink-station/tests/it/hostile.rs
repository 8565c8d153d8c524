//! Packets that nobody sent.

use mavlink_station::ftp::Caller;
use mavlink_station::ftp::get::{Get, GetOptions};
use mavlink_station::ftp::list::List;
use mavlink_station::ftp::put::Put;
use mavlink_station::link::frame::{MavMessage, dialect};
use mavlink_station::log_protocol::get::LogGet;
use mavlink_station::log_protocol::list::LogList;
use mavlink_station::protocol::ftp::PAYLOAD;
use mavlink_station::sink::Memory;
use mavlink_station::{Conversation, S, Step};
use proptest::prelude::*;

use crate::support::drone;

const LOG: &str = "/APM/LOGS/00000001.BIN";

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
