//! Conversation that downloads a file from a drone.
//!
//! Two ways of asking alternate. A *burst* is one request and hundreds of packets, until the
//! vehicle stops by itself; nothing ends it early, and what else is asked meanwhile waits behind
//! it. It is used where nothing or nearly nothing is there yet, and the next burst is asked for
//! while one still comes, so that the link does not idle for a round trip. What was lost of
//! bursts is then asked for by single *reads*, many on their way at once: each costs the downlink
//! exactly the bytes that are missing.
//!
//! A burst that falls silent may be over, lost, or still be sent into a bad link. Another burst
//! would then come on top; a single read, asked now and then, settles it.

mod ask;
mod heard;

use std::collections::VecDeque;

use super::exchange::ExchangeStep;
use super::reads::Reads;
use super::{Caller, Exchange, FtpError, answer};
use crate::budget::Budget;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{MOST_DATA, NakReason, Op, Packet};
use crate::sink::Sink;

const PIECE: u64 = MOST_DATA as u64;
/// Packets of a burst until the vehicle has shown another number.
const USUAL_BURST: u64 = 500;
/// A gap in the middle that is worth a burst, packets: a burst goes on through what is there.
const WORTH_A_BURST: u64 = 300;
/// A gap up to the end of the file that is worth a burst, packets: there it stops by itself.
const WORTH_A_TAIL: u64 = 8;
/// With more separate ranges, gaps are repaired before more is asked for.
const MOST_RANGES: usize = 50_000;
/// A burst shows its speed with so many packets.
const TELLING: u64 = 8;
/// A burst is not worth it that would keep the link for longer: nothing ends it early.
const MOST_OCCUPIED: Micros = 6 * S;
/// Reads at once, at most.
const MOST_READS: usize = 256;
/// Another station's file is given up by the vehicle after 3 s.
const BUSY_PAUSE: Micros = S;
/// The vehicle contradicts itself about the end of the file so often before it is not believed.
const MOST_LIES: u32 = 3;
/// A frame's bytes around the data.
const OVERHEAD: u64 = 30;

/// Options of a download.
#[derive(Clone, Debug)]
pub struct GetOptions {
    /// Time without an answer after which it gives up, us.
    pub patience: Micros,
    /// Size above which a file is refused, bytes.
    pub most_size: u64,
    /// Number of bytes that are read of a larger file.
    pub up_to: u64,
    /// Limit on the data rate of the link; `None`: no limit.
    pub budget: Option<Budget>,
    /// Time between two packets of a burst, us, where it is known.
    pub spacing: Option<f64>,
    /// Whether another conversation follows at once: the last reads are then asked for more than
    /// once, and the next conversation sees to it that the vehicle has closed the file.
    pub is_left: bool,
}

impl Default for GetOptions {
    fn default() -> Self {
        Self {
            patience: 60 * S,
            most_size: 2 << 30,
            up_to: u64::MAX,
            budget: None,
            spacing: None,
            is_left: false,
        }
    }
}

/// Statistics of a download.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Number of data bytes that were new.
    pub new_bytes: u64,
    /// Number of data bytes that had come before.
    pub again_bytes: u64,
    /// Number of bursts asked for.
    pub bursts: u64,
    /// Number of single reads asked for.
    pub reads: u64,
    /// Number of times that the file was opened.
    pub opened: u64,
    /// Data rate of the last burst, bytes per second; 0 without one.
    pub burst_bytes_per_s: f64,
}

/// Result of a [`Get`].
#[derive(Debug)]
pub struct Got<S> {
    /// Sink with the bytes that came, also after a failure.
    pub sink: S,
    /// Size of the file when it was first opened, bytes; all of it is in the sink.
    pub result: Result<u64, FtpError>,
    /// Statistics of the download.
    pub tally: Tally,
}

/// Conversation that downloads a file.
#[derive(Debug)]
pub struct Get<S> {
    caller: Caller,
    path: String,
    options: GetOptions,
    sink: Option<S>,
    size: Option<u64>,
    stage: Stage,
    bursts: VecDeque<Burst>,
    /// Packets of a burst, once the vehicle has shown it.
    burst_packets: Option<u64>,
    /// No range is worth a burst.
    no_bursts: bool,
    /// Time between two packets of a burst, us.
    spacing: Option<f64>,
    is_pausing: bool,
    reads: Reads,
    /// Single reads by number, for refusals, which name no offset.
    numbers: VecDeque<(u16, u64)>,
    heard: Option<Micros>,
    lies: u32,
    failures: u32,
    tally: Tally,
}

#[derive(Debug)]
enum Stage {
    /// Nothing is open; open at this time.
    Closed(Micros),
    Opening(Exchange),
    Reading,
    /// Once it is answered, or not, it is over.
    Closing(Option<Exchange>, Result<u64, FtpError>),
}

#[derive(Debug)]
struct Burst {
    sequence: u16,
    offset: u64,
    /// When asked for; of a later one, when the one before it ended.
    since: Micros,
    /// Nothing was on its way when it was asked for, so that its first packet tells the time to
    /// an answer.
    is_first: bool,
    /// Of the first packet that came: when, and its number in the burst.
    first: Option<(Micros, u64)>,
    /// Of the last one.
    heard: Option<(Micros, u64)>,
    /// Smoothed time between packets, us.
    spacing: f64,
}

impl<S: Sink> Get<S> {
    /// Downloads the file `path`, or the parts that the sink lacks.
    pub fn new(caller: Caller, path: &str, sink: S, options: GetOptions) -> Self {
        let mut reads = Reads::new(PIECE, MOST_READS, options.patience);
        reads.pace(options.spacing.unwrap_or(0.0));
        Self {
            caller,
            path: path.to_owned(),
            sink: Some(sink),
            size: None,
            stage: Stage::Closed(0),
            bursts: VecDeque::new(),
            burst_packets: None,
            no_bursts: false,
            spacing: options.spacing,
            is_pausing: false,
            reads,
            numbers: VecDeque::new(),
            heard: None,
            lies: 0,
            failures: 0,
            tally: Tally::default(),
            options,
        }
    }

    /// Statistics of the download so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Time at which the vehicle last sent anything of use, us.
    pub fn heard(&self) -> Option<Micros> {
        self.heard
    }

    /// Sink of the download, if it is not handed over yet.
    pub fn sink(&self) -> Option<&S> {
        self.sink.as_ref()
    }

    /// Ends the download, once the data on its way has come, as [`FtpError::Paused`] with what
    /// there is.
    pub fn pause(&mut self) {
        self.is_pausing = true;
    }

    fn close(&mut self, result: Result<u64, FtpError>) {
        let request = Packet::request(Op::TerminateSession);
        // The vehicle also closes it by itself, so nobody waits long for the answer.
        let exchange = Exchange::new(&self.caller, request, 2 * S);
        self.stage = Stage::Closing(Some(exchange), result);
    }

    /// The vehicle has lost the session: it booted, or somebody else took it.
    fn reopen(&mut self, at: Micros) {
        self.bursts.clear();
        self.reads.clear();
        self.numbers.clear();
        self.no_bursts = false;
        self.stage = Stage::Closed(at);
    }

    fn on_opened(&mut self, now: Micros, outcome: Result<Packet, NakReason>) {
        let what = "opening the file";
        let packet = match outcome {
            Ok(packet) => packet,
            Err(NakReason::Fail) => {
                return self.reopen(now + BUSY_PAUSE);
            }
            Err(refusal) => return self.close(Err(FtpError::Refused { what, refusal })),
        };
        let Some(size) = packet.data.get(..4).and_then(|bytes| bytes.try_into().ok()) else {
            return self.close(Err(FtpError::Nonsense { what }));
        };
        let size = u64::from(u32::from_le_bytes(size));
        let most = self.options.most_size;
        let before = self.size.unwrap_or(0).max(self.sink.as_ref().map_or(0, |s| s.have().end()));
        if size > most {
            return self.close(Err(FtpError::TooLarge { size, most }));
        }
        if size < before {
            return self.close(Err(FtpError::Changed { before, now: size }));
        }
        self.heard = Some(now);
        // A log that still grows is brought up to what it was; see the logs' room for the rest.
        self.size.get_or_insert(size.min(self.options.up_to));
        self.stage = Stage::Reading;
    }

    fn open(&mut self, now: Micros) -> Step<Got<S>> {
        let heard = *self.heard.get_or_insert(now);
        let left = (heard + self.options.patience).saturating_sub(now);
        if left == 0 {
            let seconds = self.options.patience / S;
            self.close(Err(FtpError::Silent { seconds }));
            return self.poll(now);
        }
        self.tally.opened += 1;
        self.caller.new_session();
        let request = Packet::request(Op::OpenFileRO).with_data(self.path.as_bytes());
        self.stage = Stage::Opening(Exchange::new(&self.caller, request, left));
        self.poll(now)
    }
}

impl<S: Sink> Conversation for Get<S> {
    type Done = Got<S>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match &mut self.stage {
            Stage::Closed(_) | Stage::Reading => {
                if let Some(packet) = answer(message)
                    && !matches!(self.stage, Stage::Closed(_))
                {
                    self.on_packet(now, &packet);
                }
            }
            Stage::Opening(exchange) => {
                if let Some(outcome) = exchange.on_message(now, message, &self.caller) {
                    self.on_opened(now, outcome);
                }
            }
            Stage::Closing(waiting, _) => {
                if let Some(exchange) = waiting
                    && exchange.on_message(now, message, &self.caller).is_some()
                {
                    *waiting = None;
                }
            }
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Got<S>> {
        match &mut self.stage {
            Stage::Closed(at) if now < *at => Step::Wait(*at),
            Stage::Closed(_) => self.open(now),
            Stage::Reading => self.poll_reading(now),
            Stage::Opening(exchange) => match exchange.poll(now, &self.caller) {
                ExchangeStep::Send(message) => Step::Send(message),
                ExchangeStep::Wait(until) => Step::Wait(until),
                ExchangeStep::Silent(_) => {
                    let seconds = self.options.patience / S;
                    self.close(Err(FtpError::Silent { seconds }));
                    self.poll(now)
                }
            },
            Stage::Closing(waiting, result) => {
                // Nobody waits for a vehicle that does not answer.
                let is_silent = matches!(result, Err(FtpError::Silent { .. }));
                let wish = waiting.as_mut().filter(|_| !is_silent);
                match wish.map(|exchange| exchange.poll(now, &self.caller)) {
                    Some(ExchangeStep::Send(message)) => {
                        if self.options.is_left {
                            *waiting = None;
                        }
                        Step::Send(message)
                    }
                    Some(ExchangeStep::Wait(until)) => Step::Wait(until),
                    Some(ExchangeStep::Silent(_)) | None => match self.sink.take() {
                        Some(sink) => {
                            Step::Done(Got { sink, result: result.clone(), tally: self.tally })
                        }
                        None => Step::Wait(Micros::MAX),
                    },
                }
            }
        }
    }

    fn progress(&self) -> Progress {
        let done = self.sink.as_ref().map_or(0, |sink| sink.have().total());
        Progress { done, total: self.size.unwrap_or(0) }
    }
}
