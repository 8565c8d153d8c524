//! One MAVFTP request and its answer.

use super::{Caller, FtpError, answer};
use crate::link::clock::{MS, Micros, S};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{NakReason, Op, Packet};

/// Longest pause between repetitions.
const MOST_PAUSE: Micros = 3 * S;

/// Longest pause at least: where many share a link, its queue alone can hold an answer that long.
const LEAST_PAUSE: Micros = 2_500 * MS;
/// A request is repeated so often within its patience, at least, unless the link itself is slower.
const TRIES: Micros = 12;

/// Before any answer has come: a short link must not wait for its first loss as long as a long one.
const FIRST_PAUSE: Micros = 500 * MS;

/// A vehicle gives up a session of somebody else when it has been idle for 3 s.
const BUSY: Micros = 3_300 * MS;
/// After one of ours was closed.
const SHORT_BUSY: Micros = 20 * MS;

/// A request with its number, repeated until it is answered.
#[derive(Clone, Debug)]
pub(super) struct Exchange {
    packet: Packet,
    first: Option<Micros>,
    sent: Micros,
    tries: u32,
    /// Given to the vehicle before the first repetition, beyond the link's own time.
    work: Micros,
    patience: Micros,
    /// The vehicle holds another session open: ask again then.
    not_before: Micros,
    /// Sessions of earlier runs or conversations, to be closed first.
    stale: Option<u8>,
    close_first: Option<u8>,
}

/// Next action of an exchange.
pub(super) enum ExchangeStep {
    /// Send this message, and poll again.
    Send(Box<MavMessage>),
    /// Wait until this time, us.
    Wait(Micros),
    /// Give up, with this error.
    Silent(FtpError),
}

impl Exchange {
    /// Makes a request; `patience` without any answer, us, ends it.
    pub(super) fn new(caller: &Caller, request: Packet, patience: Micros) -> Self {
        Self {
            packet: caller.number(request),
            first: None,
            sent: 0,
            tries: 0,
            work: 0,
            patience,
            not_before: 0,
            stale: None,
            close_first: None,
        }
    }

    /// Sets the time that the vehicle may need for the request itself, us.
    #[must_use]
    pub(super) fn with_work(mut self, work: Micros) -> Self {
        self.work = work;
        self.patience = self.patience.max(4 * work);
        self
    }

    /// Next action at time `now`.
    pub(super) fn poll(&mut self, now: Micros, caller: &Caller) -> ExchangeStep {
        let first = *self.first.get_or_insert(now);
        if now >= first + self.patience {
            return ExchangeStep::Silent(FtpError::Silent { seconds: self.patience / S });
        }
        if let Some(session) = self.close_first.take() {
            let mut packet = caller.number(Packet::request(Op::TerminateSession));
            packet.session = session;
            return ExchangeStep::Send(Box::new(caller.message(&packet)));
        }
        if now < self.not_before {
            return ExchangeStep::Wait(self.not_before.min(first + self.patience));
        }
        let timeout = caller.timeout();
        let (timeout, tries) = if caller.knows_rtt() {
            (timeout, self.tries)
        } else {
            (timeout.min(FIRST_PAUSE), self.tries.saturating_sub(1))
        };
        let pause = timeout.saturating_mul(1 << tries.min(6)) / 2;
        let most = MOST_PAUSE.min(self.patience / TRIES).max(LEAST_PAUSE).max(timeout);
        // While it works it keeps what is asked again, and answers it with the answer.
        // Which may be soon, so that a request or an answer that was lost is not noticed late.
        let work = self.work.min(MOST_PAUSE) / 8 * Micros::from(self.tries.min(8));
        let pause = pause.max(timeout).min(most) + work;
        if self.tries > 0 && now < self.sent + pause {
            return ExchangeStep::Wait((self.sent + pause).min(first + self.patience));
        }
        self.tries += 1;
        self.sent = now;
        ExchangeStep::Send(Box::new(caller.message(&self.packet)))
    }

    /// Answer to the request, if the message is one. Its session may differ from the request's:
    /// newer vehicles assign their own.
    pub(super) fn on_message(
        &mut self,
        now: Micros,
        message: &MavMessage,
        caller: &Caller,
    ) -> Option<Result<Packet, NakReason>> {
        let packet = answer(message)?;
        if packet.request == Op::BurstReadFile && packet.session != self.packet.session {
            self.stale = Some(packet.session);
        }
        let opens = matches!(self.packet.op, Op::OpenFileRO | Op::CreateFile);
        let fits = packet.sequence == self.packet.sequence.wrapping_add(1)
            && packet.request == self.packet.op
            && (opens || packet.session == self.packet.session);
        if !fits || !matches!(packet.op, Op::Ack | Op::Nak) {
            return None;
        }
        if self.tries == 1 && self.work == 0 {
            caller.add_rtt(now.saturating_sub(self.sent));
        }
        match packet.refusal() {
            Some(NakReason::InvalidSession | NakReason::NoSessionsAvailable) => {
                self.wait_for_other(now, caller);
                None
            }
            Some(refusal) => Some(Err(refusal)),
            None => {
                if opens {
                    caller.opened(packet.session);
                }
                if self.packet.op == Op::TerminateSession {
                    caller.closed();
                }
                Some(Ok(packet))
            }
        }
    }

    /// The vehicle holds a file open, for another session. If that was ours it is closed;
    /// otherwise the vehicle gives it up when it has not sent anything for a while, and each of
    /// its refusals begins that time anew.
    fn wait_for_other(&mut self, now: Micros, caller: &Caller) {
        let ours = self.stale.take().or(caller.left_open());
        self.close_first = ours.filter(|session| *session != self.packet.session);
        let pause = if self.close_first.is_some() { SHORT_BUSY } else { BUSY };
        caller.closed();
        self.not_before = now + pause;
        self.tries = 0;
        self.packet = caller.number(self.packet.clone());
    }
}
