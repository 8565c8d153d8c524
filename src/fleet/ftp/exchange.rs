//! One request and its answer.

use super::{Caller, FtpError, answer};
use crate::link::clock::{Micros, S};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{Op, Packet, Refusal};

/// Longest pause between repetitions.
const MOST_PAUSE: Micros = 3 * S;

/// A request that is repeated, with its number, until it is answered.
#[derive(Clone, Debug)]
pub struct Exchange {
    packet: Packet,
    first: Option<Micros>,
    sent: Micros,
    tries: u32,
    /// Given to the vehicle before the first repetition, beyond the link's own time.
    work: Micros,
    patience: Micros,
}

/// What an exchange wants.
pub enum Wish {
    /// Send this, and ask again.
    Send(MavMessage),
    /// Nothing until then.
    Wait(Micros),
    /// Give up.
    Silent(FtpError),
}

impl Exchange {
    /// A request; `patience` without any answer ends it.
    pub fn new(caller: &mut Caller, request: Packet, patience: Micros) -> Self {
        Self { packet: caller.number(request), first: None, sent: 0, tries: 0, work: 0, patience }
    }

    /// The vehicle may take so long for it.
    #[must_use]
    pub fn with_work(mut self, work: Micros) -> Self {
        self.work = work;
        self.patience = self.patience.max(4 * work);
        self
    }

    /// What to do now.
    pub fn poll(&mut self, now: Micros, caller: &Caller) -> Wish {
        let first = *self.first.get_or_insert(now);
        if now >= first + self.patience {
            return Wish::Silent(FtpError::Silent { seconds: self.patience / S });
        }
        let pause = caller.rtt.timeout().saturating_mul(1 << self.tries.min(6)) / 2;
        let pause = pause.max(caller.rtt.timeout()).min(MOST_PAUSE) + self.work;
        if self.tries > 0 && now < self.sent + pause {
            return Wish::Wait((self.sent + pause).min(first + self.patience));
        }
        self.tries += 1;
        self.sent = now;
        Wish::Send(caller.message(&self.packet))
    }

    /// The answer, if the message is it. The session may be another than the request's: newer
    /// vehicles give their own.
    pub fn on_message(
        &self,
        now: Micros,
        message: &MavMessage,
        caller: &mut Caller,
    ) -> Option<Result<Packet, Refusal>> {
        let packet = answer(message)?;
        let opens = matches!(self.packet.op, Op::OpenFileRO | Op::CreateFile);
        let fits = packet.sequence == self.packet.sequence.wrapping_add(1)
            && packet.request == self.packet.op
            && (opens || packet.session == self.packet.session);
        if !fits || !matches!(packet.op, Op::Ack | Op::Nak) {
            return None;
        }
        if self.tries == 1 && self.work == 0 {
            caller.rtt.add(now.saturating_sub(self.sent));
        }
        match packet.refusal() {
            Some(refusal) => Some(Err(refusal)),
            None => {
                if opens {
                    caller.session = packet.session;
                }
                Some(Ok(packet))
            }
        }
    }
}
