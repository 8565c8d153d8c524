//! A vehicle's end of MAVFTP, with the habits of ArduPilot 4.4.
//!
//! One worker serves one request after another: while it sends a burst, at most five more wait
//! and the rest is lost. One file is open at a time, under the session number of whoever opened
//! it; another session is refused until the file has been left alone for three seconds. The last
//! answer is kept, and sent again when its request comes again.

use std::collections::VecDeque;

use super::storage::{Storage, StorageError};
use super::transfers::Meter;
use crate::link::clock::{Micros, S};
use crate::link::frame::{MavMessage, Sender, dialect};
use crate::protocol::ftp::{MOST_DATA, Op, Packet};
use untrusted_io::crc::ApCrc32;

/// Number of packets in one burst.
pub const BURST: u32 = 500;
/// Requests that wait while one is served.
const WAITING: usize = 5;
/// An open file may be taken over after so long.
const IDLE: Micros = 3 * S;
/// Packets sent in one go when nothing paces them.
const AT_ONCE: usize = 32;

/// Server of MAVFTP: one session, one burst at a time, packets at a limited rate.
#[derive(Debug, Default)]
pub struct FtpServer {
    /// Largest number of packets sent per second; 0: no limit.
    pub packets_per_s: f64,
    waiting: VecDeque<(Sender, Packet)>,
    open: Option<Open>,
    burst: Option<Burst>,
    last: Option<Packet>,
    last_sent: Micros,
    meter: Meter,
}

#[derive(Debug)]
struct Open {
    session: u8,
    name: String,
    for_writing: bool,
}

#[derive(Debug)]
struct Burst {
    station: Sender,
    answer: Packet,
    size: u8,
    sent: u32,
}

impl FtpServer {
    /// A server that sends at most `packets_per_s` packets per second (0: no limit).
    pub fn new(packets_per_s: f64) -> Self {
        Self { packets_per_s, ..Self::default() }
    }

    /// Handles a message from `station`, which gets the answers; messages other than MAVFTP's are
    /// ignored.
    pub fn on_message(&mut self, station: Sender, message: &MavMessage) {
        let MavMessage::FILE_TRANSFER_PROTOCOL(message) = message else { return };
        let Some(request) = Packet::from_payload(&message.payload) else { return };
        if self.waiting.len() < WAITING {
            self.waiting.push_back((station, request));
        }
    }

    /// Serves waiting requests; returns the time at which it wants to be polled again.
    pub fn poll(
        &mut self,
        now: Micros,
        storage: &mut dyn Storage,
        out: &mut Vec<MavMessage>,
    ) -> Micros {
        for _ in 0..AT_ONCE {
            if self.burst.is_none() && self.waiting.is_empty() {
                self.meter.idle(now);
                return Micros::MAX;
            }
            if now < self.meter.next() {
                return self.meter.next();
            }
            let Some((station, answer)) = self.next_answer(now, storage) else { continue };
            self.last_sent = now;
            self.meter.count(now, self.packets_per_s);
            out.push(MavMessage::FILE_TRANSFER_PROTOCOL(dialect::FILE_TRANSFER_PROTOCOL_DATA {
                target_network: 0,
                target_system: station.system,
                target_component: station.component,
                payload: answer.to_payload(),
            }));
        }
        now
    }

    fn next_answer(&mut self, now: Micros, storage: &mut dyn Storage) -> Option<(Sender, Packet)> {
        if self.burst.is_some() {
            return self.go_on_bursting(storage);
        }
        let (station, request) = self.waiting.pop_front()?;
        if let Some(last) = &self.last
            && last.session == request.session
            && last.sequence == request.sequence.wrapping_add(1)
        {
            return Some((station, last.clone()));
        }
        let mut answer = Packet {
            sequence: request.sequence.wrapping_add(1),
            session: request.session,
            op: Op::Ack,
            request: request.op,
            ..Packet::request(Op::Ack)
        };
        match self.serve(now, &request, &mut answer, storage) {
            Ok(Served::Answer) => {}
            Ok(Served::Burst) => {
                let size = if request.size == 0 { MOST_DATA as u8 } else { request.size };
                answer.offset = request.offset;
                self.burst = Some(Burst { station, answer, size, sent: 0 });
                return self.go_on_bursting(storage);
            }
            Ok(Served::Nothing) => return None,
            Err(refused) => refused.put(&mut answer),
        }
        self.last = Some(answer.clone());
        Some((station, answer))
    }

    fn go_on_bursting(&mut self, storage: &dyn Storage) -> Option<(Sender, Packet)> {
        let burst = self.burst.as_mut()?;
        let station = burst.station;
        let mut bytes = vec![0; usize::from(burst.size).min(MOST_DATA)];
        let read = match &self.open {
            Some(open) => storage.read_at(&open.name, u64::from(burst.answer.offset), &mut bytes),
            None => Err(StorageError::NotFound),
        };
        let mut answer = burst.answer.clone();
        match read {
            Ok(0) => Refused::END.put(&mut answer),
            Err(error) => Refused::from(error).put(&mut answer),
            Ok(length) => {
                bytes.truncate(length);
                burst.sent += 1;
                burst.answer.sequence = burst.answer.sequence.wrapping_add(1);
                burst.answer.offset = burst.answer.offset.wrapping_add(length as u32);
                answer.burst_complete = burst.sent == BURST;
                answer = answer.with_data(&bytes);
            }
        }
        if answer.op == Op::Nak || answer.burst_complete {
            // What is kept is the worker's own packet, counted on after a whole burst.
            let mut kept = answer.clone();
            if answer.burst_complete {
                kept.sequence = kept.sequence.wrapping_add(1);
            }
            self.last = Some(kept);
            self.burst = None;
        }
        Some((station, answer))
    }

    fn serve(
        &mut self,
        now: Micros,
        request: &Packet,
        answer: &mut Packet,
        storage: &mut dyn Storage,
    ) -> Result<Served, Refused> {
        let is_own = self.open.as_ref().is_none_or(|open| open.session == request.session);
        let is_idle = now >= self.last_sent + IDLE;
        if !is_own {
            if matches!(request.op, Op::TerminateSession | Op::ResetSessions) {
                return Ok(Served::Answer);
            }
            if !is_idle {
                return Err(Refused::code(4));
            }
            self.open = None;
        }
        match request.op {
            Op::None => {}
            Op::TerminateSession | Op::ResetSessions => self.open = None,
            Op::ListDirectory => list(request, answer, storage)?,
            Op::OpenFileRO => {
                if self.open.is_some() && !is_idle {
                    return Err(Refused::code(1));
                }
                let name = name(request)?;
                let size = storage.size(&name)?;
                let size = u32::try_from(size).unwrap_or(u32::MAX);
                self.open = Some(Open { session: request.session, name, for_writing: false });
                *answer = answer.clone().with_data(&size.to_le_bytes());
            }
            Op::CreateFile | Op::OpenFileWO => {
                if self.open.is_some() {
                    return Err(Refused::code(1));
                }
                let name = name(request)?;
                if request.op == Op::CreateFile {
                    storage.create(&name)?;
                } else {
                    storage.size(&name)?;
                }
                self.open = Some(Open { session: request.session, name, for_writing: true });
            }
            Op::ReadFile => {
                let open = self.opened(false)?;
                let mut bytes = vec![0; usize::from(request.size).min(MOST_DATA)];
                let read = storage.read_at(&open.name, u64::from(request.offset), &mut bytes)?;
                if read == 0 {
                    return Err(Refused::END);
                }
                answer.offset = request.offset;
                *answer = answer.clone().with_data(&bytes[..read]);
            }
            Op::BurstReadFile => {
                self.opened(false)?;
                return Ok(Served::Burst);
            }
            Op::WriteFile => {
                let open = self.opened(true)?;
                storage.write_at(&open.name, u64::from(request.offset), &request.data)?;
                answer.offset = request.offset;
            }
            Op::RemoveFile => storage.remove(&name(request)?)?,
            Op::CreateDirectory => storage.create_folder(&name(request)?)?,
            Op::CalcFileCRC32 => {
                let sum = checksum(storage, &name(request)?)?;
                *answer = answer.clone().with_data(&sum.to_le_bytes());
            }
            Op::RemoveDirectory | Op::TruncateFile | Op::Rename => return Err(Refused::code(7)),
            Op::Ack | Op::Nak => return Ok(Served::Nothing),
        }
        Ok(Served::Answer)
    }

    fn opened(&self, for_writing: bool) -> Result<&Open, Refused> {
        let open = self.open.as_ref().ok_or(Refused::code(10))?;
        if open.for_writing == for_writing { Ok(open) } else { Err(Refused::code(1)) }
    }
}

enum Served {
    Answer,
    Burst,
    Nothing,
}

/// The data of a refusal.
struct Refused([u8; 2], usize);

impl Refused {
    const END: Self = Self::code(6);

    const fn code(code: u8) -> Self {
        Self([code, 0], 1)
    }

    fn put(&self, answer: &mut Packet) {
        answer.op = Op::Nak;
        answer.burst_complete = false;
        answer.data = self.0[..self.1].to_vec();
        answer.size = self.1 as u8;
    }
}

impl From<StorageError> for Refused {
    fn from(error: StorageError) -> Self {
        match error {
            StorageError::NotFound => Self::code(10),
            // EACCES.
            StorageError::BadName => Self([2, 13], 2),
            StorageError::Failed(code) => Self([2, code], 2),
        }
    }
}

fn name(request: &Packet) -> Result<String, Refused> {
    let bytes = request.data.strip_suffix(&[0]).unwrap_or(&request.data);
    if bytes.is_empty() || bytes.contains(&0) {
        return Err(Refused::code(3));
    }
    String::from_utf8(bytes.to_vec()).map_err(|_| Refused::code(3))
}

/// Names from the entry number `offset` on, as many as fit: `Fname\tsize\0` and `Dname\0`.
fn list(request: &Packet, answer: &mut Packet, storage: &dyn Storage) -> Result<(), Refused> {
    let entries = storage.list(&name(request)?)?;
    let texts = ["D.\0".to_owned(), "D..\0".to_owned()].into_iter().chain(entries.into_iter().map(
        |entry| match entry.size {
            Some(size) => format!("F{}\t{size}\0", entry.name),
            None => format!("D{}\0", entry.name),
        },
    ));
    let mut data = Vec::new();
    let fitting = texts.filter(|text| text.len() < MOST_DATA).skip(request.offset as usize);
    for text in fitting {
        if data.len() + text.len() >= MOST_DATA {
            break;
        }
        data.extend_from_slice(text.as_bytes());
    }
    if data.is_empty() {
        return Err(Refused::END);
    }
    answer.offset = request.offset;
    *answer = answer.clone().with_data(&data);
    Ok(())
}

fn checksum(storage: &dyn Storage, name: &str) -> Result<u32, StorageError> {
    let mut sum = ApCrc32::default();
    let mut bytes = vec![0; 1 << 16];
    let mut at = 0;
    storage.size(name)?;
    loop {
        let read = storage.read_at(name, at, &mut bytes)?;
        if read == 0 {
            return Ok(sum.value());
        }
        sum.update(&bytes[..read]);
        at += read as u64;
    }
}
