//! Puts a small file on a vehicle, and only if it is not there already.
//!
//! One request at a time, as Skybrush Server does: show files are a few kilobytes, and what the
//! vehicle has at the end is decided by the checksum that it computes itself.

use super::command::Patience;
use super::messages::ftp;
use crate::base::crc::ap_crc32;
use crate::link::clock::Micros;
use crate::link::drive::{Machine, Progress, Step};
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::protocol::ftp::{MOST_DATA, Op, Packet, Refusal};

/// The whole file is written so often at most when its checksum is wrong.
const ROUNDS: u32 = 3;

/// A file that is not on the vehicle.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PutError {
    /// No answer.
    #[error(
        "no answer while {path} is written ({at} of {size} bytes): bring the drone nearer to the \
         radio and try again"
    )]
    Silent {
        /// The file.
        path: String,
        /// Bytes that are there.
        at: usize,
        /// Bytes of the file.
        size: usize,
    },
    /// The vehicle does not want it.
    #[error("the drone refuses to write {path} ({doing}): {refusal}{hint}")]
    Refused {
        /// The file.
        path: String,
        /// The request.
        doing: &'static str,
        /// The vehicle's answer.
        refusal: Refusal,
        /// What to do.
        hint: &'static str,
    },
    /// It is there, but is another.
    #[error(
        "{path} on the drone has checksum {is:08x}, not {wanted:08x}, after {ROUNDS} tries: \
         check its SD card"
    )]
    Checksum {
        /// The file.
        path: String,
        /// As the vehicle computes it.
        is: u32,
        /// As it must be.
        wanted: u32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Look,
    Reset,
    Create,
    Write,
    Close,
    Verify,
}

/// Puts one file.
#[derive(Clone, Debug)]
pub struct PutFile {
    drone: DroneId,
    path: String,
    bytes: Vec<u8>,
    patience: Patience,
    phase: Phase,
    at: usize,
    session: u8,
    sequence: u16,
    tries: u32,
    next: Micros,
    round: u32,
    over: Option<Result<bool, PutError>>,
}

impl PutFile {
    /// These bytes as this file. Done with whether it had to be written.
    pub fn new(drone: DroneId, path: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self {
            drone,
            path: path.into(),
            bytes,
            patience: Patience::default(),
            phase: Phase::Look,
            at: 0,
            session: 0,
            sequence: 0,
            tries: 0,
            next: 0,
            round: 0,
            over: None,
        }
    }

    fn piece(&self) -> &[u8] {
        let end = self.bytes.len().min(self.at + MOST_DATA);
        self.bytes.get(self.at..end).unwrap_or(&[])
    }

    fn request(&self) -> Packet {
        let name = self.path.as_bytes();
        let mut packet = match self.phase {
            Phase::Look | Phase::Verify => Packet::request(Op::CalcFileCRC32).with_data(name),
            Phase::Reset => Packet::request(Op::ResetSessions),
            Phase::Create => Packet::request(Op::CreateFile).with_data(name),
            Phase::Write => Packet::request(Op::WriteFile).with_data(self.piece()),
            Phase::Close => Packet::request(Op::TerminateSession),
        };
        packet.sequence = self.sequence;
        packet.session = self.session;
        packet.offset = if self.phase == Phase::Write { self.at as u32 } else { 0 };
        packet
    }

    fn go(&mut self, phase: Phase) {
        self.phase = phase;
        self.tries = 0;
        self.next = 0;
        // The answer has this plus one: two on, so that no old answer fits.
        self.sequence = self.sequence.wrapping_add(2);
    }

    fn on_refusal(&mut self, refusal: Refusal) {
        let (doing, hint) = match self.phase {
            // There is none yet.
            Phase::Look => return self.go(Phase::Reset),
            // Closed sessions are what was asked for.
            Phase::Reset => return self.go(Phase::Create),
            Phase::Close => return self.go(Phase::Verify),
            Phase::Create if refusal == Refusal::FileNotFound => {
                ("create", ": is it the show firmware, and has it an SD card?")
            }
            Phase::Create => ("create", ""),
            Phase::Write => ("write", ": is its SD card full?"),
            Phase::Verify => ("checksum", ""),
        };
        let path = self.path.clone();
        self.over = Some(Err(PutError::Refused { path, doing, refusal, hint }));
    }

    fn on_answer(&mut self, answer: &Packet) {
        let wanted = ap_crc32(&self.bytes);
        let crc = || match answer.data[..] {
            [a, b, c, d, ..] => u32::from_le_bytes([a, b, c, d]),
            _ => !wanted,
        };
        match self.phase {
            Phase::Look if crc() == wanted => self.over = Some(Ok(false)),
            Phase::Look => self.go(Phase::Reset),
            Phase::Reset => {
                self.session = 0;
                self.go(Phase::Create);
            }
            Phase::Create => {
                self.session = answer.session;
                self.at = 0;
                self.go(if self.bytes.is_empty() { Phase::Close } else { Phase::Write });
            }
            Phase::Write => {
                self.at += self.piece().len();
                self.go(if self.at < self.bytes.len() { Phase::Write } else { Phase::Close });
            }
            Phase::Close => self.go(Phase::Verify),
            Phase::Verify if crc() == wanted => self.over = Some(Ok(true)),
            Phase::Verify => {
                self.round += 1;
                if self.round >= ROUNDS {
                    let (path, is) = (self.path.clone(), crc());
                    self.over = Some(Err(PutError::Checksum { path, is, wanted }));
                } else {
                    self.go(Phase::Reset);
                }
            }
        }
    }
}

impl Machine for PutFile {
    type Done = Result<bool, PutError>;

    fn on_message(&mut self, _now: Micros, message: &MavMessage) {
        let MavMessage::FILE_TRANSFER_PROTOCOL(data) = message else { return };
        let Some(answer) = Packet::from_payload(&data.payload) else { return };
        let asked = self.request();
        let ours = answer.sequence == asked.sequence.wrapping_add(1) && answer.request == asked.op;
        if !ours || self.tries == 0 || self.over.is_some() {
            return;
        }
        match answer.refusal() {
            Some(refusal) => self.on_refusal(refusal),
            None if answer.op == Op::Ack => self.on_answer(&answer),
            None => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if let Some(over) = self.over.take() {
            return Step::Done(over);
        }
        if now < self.next {
            return Step::Wait(self.next);
        }
        if self.tries >= self.patience.tries {
            let (path, at, size) = (self.path.clone(), self.at, self.bytes.len());
            return Step::Done(Err(PutError::Silent { path, at, size }));
        }
        self.tries += 1;
        self.next = now + self.patience.every;
        Step::send(ftp(self.drone, &self.request()))
    }

    fn progress(&self) -> Progress {
        Progress { done: self.at as u64, total: self.bytes.len() as u64 }
    }
}
