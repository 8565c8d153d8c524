//! Conversation that puts a file on a vehicle, unless it is there already.

use super::ftp::put::Put;
use super::ftp::sum::Sum;
use super::ftp::{Caller, FtpError};
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::frame::MavMessage;
use untrusted_io::crc::ap_crc32;

/// Given up after so long without an answer.
const PATIENCE: Micros = 30 * S;

#[derive(Debug)]
enum Phase {
    Look(Sum),
    Put(Put),
}

/// Conversation that puts one file on a vehicle, after comparing the checksum of the file there.
#[derive(Debug)]
pub struct PutFile {
    caller: Caller,
    path: &'static str,
    content: Vec<u8>,
    phase: Phase,
}

impl PutFile {
    /// Puts this content on the vehicle as the file `path`. The result is whether it had to be
    /// written.
    pub fn new(caller: Caller, path: &'static str, content: Vec<u8>) -> Self {
        let size = content.len() as u64;
        let phase = Phase::Look(Sum::new(caller.another(), path, size, PATIENCE));
        Self { caller, path, content, phase }
    }
}

impl Conversation for PutFile {
    type Done = Result<bool, FtpError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match &mut self.phase {
            Phase::Look(sum) => sum.on_message(now, message),
            Phase::Put(put) => put.on_message(now, message),
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if let Phase::Look(sum) = &mut self.phase {
            match sum.poll(now) {
                Step::Send(message) => return Step::Send(message),
                Step::Wait(until) => return Step::Wait(until),
                Step::Done(Ok(sum)) if sum == ap_crc32(&self.content) => {
                    return Step::Done(Ok(false));
                }
                Step::Done(Err(error @ FtpError::Silent { .. })) => {
                    return Step::Done(Err(error));
                }
                // Another file, or none.
                Step::Done(_) => {
                    let content = std::mem::take(&mut self.content);
                    let caller = self.caller.another();
                    self.phase = Phase::Put(Put::new(caller, self.path, content, PATIENCE));
                }
            }
        }
        match &mut self.phase {
            Phase::Put(put) => match put.poll(now) {
                Step::Send(message) => Step::Send(message),
                Step::Wait(until) => Step::Wait(until),
                Step::Done(done) => Step::Done(done.map(|()| true)),
            },
            Phase::Look(_) => Step::Wait(now),
        }
    }

    fn progress(&self) -> Progress {
        match &self.phase {
            Phase::Look(_) => Progress::default(),
            Phase::Put(put) => put.progress(),
        }
    }
}
