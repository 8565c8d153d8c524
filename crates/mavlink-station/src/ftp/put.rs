//! Conversation that uploads a file to a drone.

use std::collections::BTreeMap;

use super::exchange::ExchangeStep;
use super::{Caller, Exchange, FtpError, answer};
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{MOST_DATA, NakReason, Op, Packet};
use untrusted_io::crc::ap_crc32;

/// Pieces on their way at once; a vehicle keeps five requests.
const WINDOW: usize = 4;
/// A vehicle that loses the file (it booted, another station took it) is begun with anew so often.
const MOST_STARTS: u32 = 8;
/// Another station's file is given up by the vehicle after 3 s.
const BUSY_PAUSE: Micros = S;

/// Conversation that uploads a file and compares checksums.
#[derive(Debug)]
pub struct Put {
    caller: Caller,
    path: String,
    content: Vec<u8>,
    patience: Micros,
    starts: u32,
    stage: Stage,
    heard: Option<Micros>,
}

#[derive(Debug)]
enum Stage {
    /// Nothing is open; begin at this time.
    Begin(Micros),
    Create(Exchange),
    Write(Writing),
    Close(Exchange),
    Compare(Exchange),
    Over(Result<(), FtpError>),
}

#[derive(Debug, Default)]
struct Writing {
    /// The next piece that was never sent.
    next: usize,
    /// By number: offset, when sent, how often.
    on_way: BTreeMap<u16, (usize, Micros, u32)>,
    acknowledged: usize,
}

impl Put {
    /// Uploads `content` as the file `path`. Gives up after `patience` without an answer, us.
    pub fn new(caller: Caller, path: &str, content: Vec<u8>, patience: Micros) -> Self {
        let stage = Stage::Begin(0);
        let path = path.to_owned();
        Self { caller, path, content, patience, starts: 0, stage, heard: None }
    }

    fn ask(&mut self, op: Op) -> Exchange {
        let mut packet = Packet::request(op);
        if op != Op::TerminateSession {
            packet = packet.with_data(self.path.as_bytes());
        }
        Exchange::new(&self.caller, packet, self.patience)
    }

    /// Begins anew, or gives up.
    fn again(&mut self, at: Micros, what: &'static str, refusal: NakReason) {
        self.stage = if self.starts >= MOST_STARTS {
            Stage::Over(Err(FtpError::Refused { what, refusal }))
        } else {
            Stage::Begin(at)
        };
    }

    fn on_created(&mut self, now: Micros, outcome: Result<(), NakReason>) {
        match outcome {
            Ok(()) => self.stage = Stage::Write(Writing::default()),
            Err(refusal @ NakReason::Fail) => {
                self.again(now + BUSY_PAUSE, "creating the file", refusal);
            }
            Err(refusal) => {
                let what = "creating the file";
                self.stage = Stage::Over(Err(FtpError::Refused { what, refusal }));
            }
        }
    }

    fn on_written(&mut self, now: Micros, packet: &Packet) {
        let Stage::Write(writing) = &mut self.stage else { return };
        if packet.session != self.caller.session() || packet.request != Op::WriteFile {
            return;
        }
        let number = packet.sequence.wrapping_sub(1);
        let Some((offset, sent, tries)) = writing.on_way.remove(&number) else { return };
        self.heard = Some(now);
        if let Some(refusal) = packet.refusal() {
            if matches!(
                refusal,
                NakReason::FileNotFound | NakReason::InvalidSession | NakReason::Fail
            ) {
                self.again(now, "writing", refusal);
            } else {
                self.stage = Stage::Over(Err(FtpError::Refused { what: "writing", refusal }));
            }
            return;
        }
        if tries == 1 {
            self.caller.add_rtt(now.saturating_sub(sent));
        }
        writing.acknowledged += (self.content.len() - offset).min(MOST_DATA);
        if writing.acknowledged >= self.content.len() {
            self.stage = Stage::Close(self.ask(Op::TerminateSession));
        }
    }

    fn on_compared(&mut self, outcome: Result<Packet, NakReason>) {
        let what = "the checksum";
        let result = match outcome {
            Err(refusal) => Err(FtpError::Refused { what, refusal }),
            Ok(packet) => {
                let bytes: Option<[u8; 4]> = packet.data.get(..4).and_then(|b| b.try_into().ok());
                let right = ap_crc32(&self.content);
                match bytes.map(u32::from_le_bytes) {
                    None => Err(FtpError::Nonsense { what }),
                    Some(found) if found == right => Ok(()),
                    Some(found) => Err(FtpError::Checksum { found, right }),
                }
            }
        };
        if matches!(result, Err(FtpError::Checksum { .. })) && self.starts < 2 {
            self.stage = Stage::Begin(0);
        } else {
            self.stage = Stage::Over(result);
        }
    }

    fn poll_writing(&mut self, now: Micros) -> Option<Step<Result<(), FtpError>>> {
        let Stage::Write(writing) = &mut self.stage else { return None };
        if self.content.is_empty() {
            self.stage = Stage::Close(self.ask(Op::TerminateSession));
            return None;
        }
        let heard = *self.heard.get_or_insert(now);
        if now >= heard + self.patience {
            return Some(Step::Done(Err(FtpError::Silent { seconds: self.patience / S })));
        }
        let mut wake = heard + self.patience;
        let mut late = None;
        for (number, (offset, sent, tries)) in &mut writing.on_way {
            let pause = (self.caller.timeout() << (*tries).min(4)) / 2;
            let pause = pause.clamp(self.caller.timeout(), 3 * S);
            if now >= *sent + pause {
                *sent = now;
                *tries += 1;
                late = Some((*number, *offset));
                break;
            }
            wake = wake.min(*sent + pause);
        }
        let (number, offset) = if let Some(late) = late {
            late
        } else if writing.on_way.len() < WINDOW && writing.next < self.content.len() {
            let offset = writing.next;
            let number = self.caller.number(Packet::request(Op::WriteFile)).sequence;
            writing.on_way.insert(number, (offset, now, 1));
            writing.next = (offset + MOST_DATA).min(self.content.len());
            (number, offset)
        } else {
            return Some(Step::Wait(wake));
        };
        let end = (offset + MOST_DATA).min(self.content.len());
        let mut packet = Packet::request(Op::WriteFile).with_data(&self.content[offset..end]);
        packet.sequence = number;
        packet.session = self.caller.session();
        packet.offset = offset as u32;
        Some(Step::send(self.caller.message(&packet)))
    }
}

impl Conversation for Put {
    type Done = Result<(), FtpError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match &mut self.stage {
            Stage::Create(exchange) => {
                if let Some(outcome) = exchange.on_message(now, message, &self.caller) {
                    self.on_created(now, outcome.map(drop));
                }
            }
            Stage::Write(_) => {
                if let Some(packet) = answer(message) {
                    self.on_written(now, &packet);
                }
            }
            Stage::Close(exchange) => {
                if exchange.on_message(now, message, &self.caller).is_some() {
                    self.stage = Stage::Compare(self.ask(Op::CalcFileCRC32));
                }
            }
            Stage::Compare(exchange) => {
                if let Some(outcome) = exchange.on_message(now, message, &self.caller) {
                    self.on_compared(outcome);
                }
            }
            Stage::Begin(_) | Stage::Over(_) => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if let Stage::Begin(at) = self.stage {
            if now < at {
                return Step::Wait(at);
            }
            self.starts += 1;
            self.heard = None;
            self.caller.new_session();
            self.stage = Stage::Create(self.ask(Op::CreateFile));
        }
        if let Some(step) = self.poll_writing(now) {
            return step;
        }
        match &mut self.stage {
            Stage::Create(exchange) | Stage::Close(exchange) | Stage::Compare(exchange) => {
                match exchange.poll(now, &self.caller) {
                    ExchangeStep::Send(message) => Step::Send(message),
                    ExchangeStep::Wait(until) => Step::Wait(until),
                    ExchangeStep::Silent(error) => Step::Done(Err(error)),
                }
            }
            Stage::Over(result) => Step::Done(result.clone()),
            Stage::Begin(_) | Stage::Write(_) => Step::Wait(now + 1),
        }
    }

    fn progress(&self) -> Progress {
        let total = self.content.len() as u64;
        let done = match &self.stage {
            Stage::Begin(_) | Stage::Create(_) => 0,
            Stage::Write(writing) => writing.acknowledged as u64,
            Stage::Close(_) | Stage::Compare(_) | Stage::Over(_) => total,
        };
        Progress { done, total }
    }
}
