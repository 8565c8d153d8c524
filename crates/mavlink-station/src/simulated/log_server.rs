//! A vehicle's end of MAVLink's log messages (LOG_REQUEST_LIST and so on), as ArduPilot 4.4's.
//!
//! Refused while armed. One list or one download at a time for all links; a request that comes
//! meanwhile is dropped, without a word.

use std::collections::BTreeMap;

use super::storage::Storage;
use super::transfers::Meter;
use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, dialect};

/// Data bytes in one LOG_DATA.
const PIECE: u32 = 90;
/// Packets sent in one go when nothing paces them.
const AT_ONCE: usize = 32;

/// Server of the MAVLink log messages (`LOG_REQUEST_LIST`, `LOG_REQUEST_DATA`), with packets at a
/// limited rate.
#[derive(Debug)]
pub struct LogServer {
    /// Largest number of packets sent per second; 0: no limit.
    pub packets_per_s: f64,
    folder: String,
    sending: Option<Sending>,
    warned: bool,
    meter: Meter,
}

#[derive(Debug)]
enum Sending {
    List { next: u16, last: u16 },
    Data { id: u16, name: String, offset: u32, remaining: u32 },
}

impl LogServer {
    /// Serves the logs in a folder (`/APM/LOGS` on an autopilot, `logs` in its simulator), at most
    /// `packets_per_s` packets per second (0: no limit).
    pub fn new(folder: &str, packets_per_s: f64) -> Self {
        Self {
            packets_per_s,
            folder: folder.to_owned(),
            sending: None,
            warned: false,
            meter: Meter::default(),
        }
    }

    /// Whether a list or a download is being sent; an autopilot does not arm meanwhile.
    pub fn is_sending(&self) -> bool {
        self.sending.is_some()
    }

    /// Logs as the firmware numbers them: id 1 is the oldest file, one that is missing counts, and
    /// there are as many as the number of the newest file, those beyond it without bytes.
    fn logs(&self, storage: &dyn Storage) -> Vec<(String, u32)> {
        let entries = storage.list(&self.folder).unwrap_or_default();
        let files: BTreeMap<u16, (String, u32)> = entries
            .into_iter()
            .filter_map(|entry| {
                let (stem, end) = entry.name.rsplit_once('.')?;
                let number = stem.parse().ok().filter(|_| end.eq_ignore_ascii_case("bin"))?;
                let size = u32::try_from(entry.size?).unwrap_or(u32::MAX);
                Some((number, (format!("{}/{}", self.folder, entry.name), size)))
            })
            .collect();
        let first_last = files.first_key_value().zip(files.last_key_value());
        let Some(((&oldest, _), (&newest, _))) = first_last else { return Vec::new() };
        let file = |id: u16| files.get(&(oldest.saturating_add(id))).cloned().unwrap_or_default();
        (0..newest).map(file).collect()
    }

    /// Handles a message; those other than the log messages are ignored.
    pub fn on_message(
        &mut self,
        message: &MavMessage,
        is_armed: bool,
        storage: &dyn Storage,
        out: &mut Vec<MavMessage>,
    ) {
        if !matches!(
            message,
            MavMessage::LOG_REQUEST_LIST(_)
                | MavMessage::LOG_REQUEST_DATA(_)
                | MavMessage::LOG_REQUEST_END(_)
        ) {
            return;
        }
        if is_armed {
            if !self.warned {
                self.warned = true;
                out.push(MavMessage::STATUSTEXT(dialect::STATUSTEXT_DATA {
                    severity: dialect::MavSeverity::MAV_SEVERITY_ERROR,
                    text: "Disarm for log download".into(),
                    ..Default::default()
                }));
            }
            return;
        }
        self.warned = false;
        match message {
            MavMessage::LOG_REQUEST_END(_) => self.sending = None,
            _ if self.sending.is_some() => {}
            MavMessage::LOG_REQUEST_LIST(wanted) => {
                let count = self.logs(storage).len() as u16;
                let (next, last) = match count {
                    0 => (0, 0),
                    count => (wanted.start.max(1), wanted.end.min(count)),
                };
                self.sending = Some(Sending::List { next, last });
            }
            MavMessage::LOG_REQUEST_DATA(wanted) => {
                let logs = self.logs(storage);
                let index = usize::from(wanted.id).wrapping_sub(1);
                let Some((name, size)) = logs.get(index).cloned() else { return };
                self.sending = Some(Sending::Data {
                    id: wanted.id,
                    name,
                    offset: wanted.ofs,
                    remaining: size.saturating_sub(wanted.ofs).min(wanted.count),
                });
            }
            _ => {}
        }
    }

    /// Sends the requested packets; returns the time at which it wants to be polled again.
    pub fn poll(
        &mut self,
        now: Micros,
        is_armed: bool,
        storage: &dyn Storage,
        out: &mut Vec<MavMessage>,
    ) -> Micros {
        if is_armed {
            return Micros::MAX;
        }
        for _ in 0..AT_ONCE {
            if self.sending.is_none() {
                self.meter.idle(now);
                return Micros::MAX;
            }
            if now < self.meter.next() {
                return self.meter.next();
            }
            self.meter.count(now, self.packets_per_s);
            self.step(storage, out);
        }
        now
    }

    fn step(&mut self, storage: &dyn Storage, out: &mut Vec<MavMessage>) {
        let logs = match &self.sending {
            Some(Sending::List { .. }) => self.logs(storage),
            _ => Vec::new(),
        };
        let is_over = match &mut self.sending {
            None => return,
            Some(Sending::List { next, last }) => {
                let size = usize::from(*next).checked_sub(1).and_then(|index| logs.get(index));
                out.push(MavMessage::LOG_ENTRY(dialect::LOG_ENTRY_DATA {
                    time_utc: 0,
                    size: size.map_or(0, |(_, size)| *size),
                    id: *next,
                    num_logs: logs.len() as u16,
                    last_log_num: *last,
                }));
                let is_over = *next >= *last;
                *next = next.saturating_add(1);
                is_over
            }
            Some(Sending::Data { id, name, offset, remaining }) => {
                let mut data = [0; PIECE as usize];
                let want = (*remaining).min(PIECE) as usize;
                let read = storage.read_at(name, u64::from(*offset), &mut data[..want]);
                let count = read.unwrap_or(0) as u32;
                out.push(MavMessage::LOG_DATA(dialect::LOG_DATA_DATA {
                    ofs: *offset,
                    id: *id,
                    count: count as u8,
                    data,
                }));
                *offset = offset.wrapping_add(count);
                *remaining -= count.min(*remaining);
                count < PIECE || *remaining == 0
            }
        };
        if is_over {
            self.sending = None;
        }
    }
}
