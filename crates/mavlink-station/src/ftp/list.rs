//! Conversation that lists a folder of a drone.

use super::exchange::ExchangeStep;
use super::{Caller, Exchange, FtpError};
use crate::link::clock::Micros;
use crate::link::conversation::{Conversation, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{NakReason, Op, Packet};
use untrusted_io::plain::acts;

/// No folder has more names.
const MOST_NAMES: usize = 20_000;

/// An entry of a folder: a file or a folder in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Name without the path to it; never `.`, `..` or with a slash.
    pub name: String,
    /// Size of the file, bytes; `None` for a folder.
    pub size: Option<u64>,
}

/// Conversation that lists a folder.
#[derive(Debug)]
pub struct List {
    caller: Caller,
    folder: String,
    patience: Micros,
    exchange: Exchange,
    /// Entries so far, those that are not kept too.
    seen: u32,
    names: Vec<Listed>,
    over: Option<Result<(), FtpError>>,
}

impl List {
    /// Lists the entries of `folder`.
    pub fn new(caller: Caller, folder: &str, patience: Micros) -> Self {
        let exchange = Exchange::new(&caller, request(folder, 0), patience);
        let folder = folder.to_owned();
        Self { caller, folder, patience, exchange, seen: 0, names: Vec::new(), over: None }
    }

    fn take(&mut self, data: &[u8]) {
        for entry in data.split(|byte| *byte == 0).filter(|entry| !entry.is_empty()) {
            self.seen += 1;
            let Ok(text) = std::str::from_utf8(entry) else { continue };
            let (name, size) = match (text.strip_prefix('F'), text.strip_prefix('D')) {
                (Some(file), _) => {
                    let Some((name, size)) = file.split_once('\t') else { continue };
                    let Ok(size) = size.parse() else { continue };
                    (name, Some(size))
                }
                (None, Some(folder)) => (folder, None),
                (None, None) => continue,
            };
            let is_plain = !matches!(name, "" | "." | "..")
                && !name.contains(['/', '\\', ':'])
                && !name.contains(acts);
            if is_plain && self.names.len() < MOST_NAMES {
                self.names.push(Listed { name: name.to_owned(), size });
            }
        }
    }
}

fn request(folder: &str, offset: u32) -> Packet {
    let mut packet = Packet::request(Op::ListDirectory).with_data(folder.as_bytes());
    packet.offset = offset;
    packet
}

impl Conversation for List {
    type Done = Result<Vec<Listed>, FtpError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let what = "the list of files";
        match self.exchange.on_message(now, message, &self.caller) {
            None => {}
            Some(Err(NakReason::EndOfFile)) => self.over = Some(Ok(())),
            Some(Err(refusal)) => self.over = Some(Err(FtpError::Refused { what, refusal })),
            Some(Ok(packet)) => {
                let before = self.seen;
                self.take(&packet.data);
                if self.seen == before || self.seen as usize > MOST_NAMES {
                    self.over = Some(Err(FtpError::Nonsense { what }));
                    return;
                }
                let request = request(&self.folder, self.seen);
                self.exchange = Exchange::new(&self.caller, request, self.patience);
            }
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        match self.over.take() {
            Some(Ok(())) => return Step::Done(Ok(std::mem::take(&mut self.names))),
            Some(Err(error)) => return Step::Done(Err(error)),
            None => {}
        }
        match self.exchange.poll(now, &self.caller) {
            ExchangeStep::Send(message) => Step::Send(message),
            ExchangeStep::Wait(until) => Step::Wait(until),
            ExchangeStep::Silent(error) => Step::Done(Err(error)),
        }
    }
}
