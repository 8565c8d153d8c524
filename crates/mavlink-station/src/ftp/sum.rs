//! Conversation that asks for the checksum of a drone's file.

use super::exchange::ExchangeStep;
use super::{Caller, Exchange, FtpError};
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{Op, Packet};

/// A slow card of an autopilot, bytes per second.
const SLOWEST: u64 = 200_000;

/// Conversation that asks for the checksum of a whole file ([`untrusted_io::crc::ap_crc32`]).
#[derive(Debug)]
pub struct Sum {
    caller: Caller,
    exchange: Exchange,
    over: Option<Result<u32, FtpError>>,
}

impl Sum {
    /// Asks for the checksum of the file `path`, which has about `size` bytes.
    pub fn new(caller: Caller, path: &str, size: u64, patience: Micros) -> Self {
        let request = Packet::request(Op::CalcFileCRC32).with_data(path.as_bytes());
        let work = size.saturating_mul(S) / SLOWEST;
        let exchange = Exchange::new(&caller, request, patience).with_work(work);
        Self { caller, exchange, over: None }
    }
}

impl Conversation for Sum {
    type Done = Result<u32, FtpError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let what = "the checksum";
        match self.exchange.on_message(now, message, &self.caller) {
            None => {}
            Some(Err(refusal)) => self.over = Some(Err(FtpError::Refused { what, refusal })),
            Some(Ok(packet)) => {
                let sum: Option<[u8; 4]> = packet.data.get(..4).and_then(|b| b.try_into().ok());
                self.over = Some(sum.map(u32::from_le_bytes).ok_or(FtpError::Nonsense { what }));
            }
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        if let Some(over) = &self.over {
            return Step::Done(over.clone());
        }
        match self.exchange.poll(now, &self.caller) {
            ExchangeStep::Send(message) => Step::Send(message),
            ExchangeStep::Wait(until) => Step::Wait(until),
            ExchangeStep::Silent(error) => Step::Done(Err(error)),
        }
    }
}
