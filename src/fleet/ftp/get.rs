//! Brings a file from a drone.
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

use std::collections::VecDeque;

use super::exchange::Wish;
use super::reads::Reads;
use super::{Caller, Exchange, FtpError, answer};
use crate::fleet::budget::Budget;
use crate::fleet::sink::Sink;
use crate::link::clock::{MS, Micros, S};
use crate::link::drive::{Machine, Progress, Step};
use crate::link::frame::MavMessage;
use crate::protocol::ftp::{MOST_DATA, Op, Packet, Refusal};

const PIECE: u64 = MOST_DATA as u64;
/// Packets of a burst until the vehicle has shown another number.
const USUAL_BURST: u64 = 500;
/// A gap in the middle that is worth a burst, packets: a burst goes on through what is there.
const WORTH_A_BURST: u64 = 300;
/// A gap up to the end of the file that is worth a burst, packets: there it stops by itself.
const WORTH_A_TAIL: u64 = 8;
/// With more separate ranges, gaps are repaired before more is asked for.
const MOST_RANGES: usize = 50_000;
/// Reads at once, at most.
const MOST_READS: usize = 48;
/// Another station's file is given up by the vehicle after 3 s.
const BUSY_PAUSE: Micros = S;
/// The vehicle contradicts itself about the end of the file so often before it is not believed.
const MOST_LIES: u32 = 3;
/// A frame's bytes around the data.
const OVERHEAD: u64 = 30;

/// How a file is brought.
#[derive(Clone, Debug)]
pub struct GetOptions {
    /// Gives up after so long without an answer.
    pub patience: Micros,
    /// Refuses larger files, bytes.
    pub most_size: u64,
    /// Takes no more of a larger file, bytes.
    pub up_to: u64,
    /// What the link may be asked to carry; none: anything.
    pub budget: Option<Budget>,
}

impl Default for GetOptions {
    fn default() -> Self {
        Self { patience: 60 * S, most_size: 2 << 30, up_to: u64::MAX, budget: None }
    }
}

/// What a download cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Data bytes that were new.
    pub new_bytes: u64,
    /// Data bytes that were there already.
    pub again_bytes: u64,
    /// Bursts asked for.
    pub bursts: u64,
    /// Single reads asked for.
    pub reads: u64,
    /// How often the file was opened.
    pub opened: u64,
}

/// What is left of a [`Get`].
#[derive(Debug)]
pub struct Got<S> {
    /// With what came, also when it failed.
    pub sink: S,
    /// The file's size when it was opened first; all of it is in the sink.
    pub result: Result<u64, FtpError>,
    /// What it cost.
    pub tally: Tally,
}

/// Brings a file.
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
    /// Of the last packet: when, and its number in the burst.
    heard: Option<(Micros, u64)>,
    /// Smoothed time between packets, us.
    spacing: f64,
}

impl<S: Sink> Get<S> {
    /// Brings the file `path`, or what the sink lacks of it.
    pub fn new(caller: Caller, path: &str, sink: S, options: GetOptions) -> Self {
        Self {
            caller,
            path: path.to_owned(),
            options,
            sink: Some(sink),
            size: None,
            stage: Stage::Closed(0),
            bursts: VecDeque::new(),
            burst_packets: None,
            no_bursts: false,
            reads: Reads::new(PIECE, MOST_READS),
            numbers: VecDeque::new(),
            heard: None,
            lies: 0,
            failures: 0,
            tally: Tally::default(),
        }
    }

    /// What it has cost so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// When the vehicle said something of use last.
    pub fn heard(&self) -> Option<Micros> {
        self.heard
    }

    /// The sink, wherever the download is.
    pub fn sink(&self) -> Option<&S> {
        self.sink.as_ref()
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

    fn on_opened(&mut self, now: Micros, outcome: Result<Packet, Refusal>) {
        let what = "opening the file";
        let packet = match outcome {
            Ok(packet) => packet,
            Err(Refusal::Fail) => {
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

    fn on_packet(&mut self, now: Micros, packet: &Packet) {
        if packet.session != self.caller.session() {
            return;
        }
        match (packet.op, packet.request) {
            (Op::Ack, Op::BurstReadFile | Op::ReadFile) => self.on_data(now, packet),
            (Op::Nak, Op::BurstReadFile) => self.on_burst_refused(now, packet),
            (Op::Nak, Op::ReadFile) => self.on_read_refused(now, packet),
            _ => {}
        }
    }

    fn on_data(&mut self, now: Micros, packet: &Packet) {
        let (Some(sink), Some(size)) = (&mut self.sink, self.size) else { return };
        let offset = u64::from(packet.offset);
        let length = (packet.data.len() as u64).min(size.saturating_sub(offset));
        if packet.data.is_empty() {
            return;
        }
        self.heard = Some(now);
        match sink.put(now, offset, &packet.data[..length as usize]) {
            Ok(new) => {
                self.tally.new_bytes += new;
                self.tally.again_bytes += packet.data.len() as u64 - new;
            }
            Err(reason) => return self.close(Err(FtpError::Sink(reason))),
        }
        self.failures = 0;
        if packet.request == Op::ReadFile {
            self.on_read_answered(now, offset);
        } else {
            self.on_burst_packet(now, packet, offset + packet.data.len() as u64 >= size);
        }
    }

    /// The vehicle serves one request after another: with the answer to a read that was asked
    /// after a burst had fallen silent, the burst is over, or never was.
    fn on_read_answered(&mut self, now: Micros, offset: u64) {
        let Some(took) = self.reads.answered(now, offset) else { return };
        self.caller.add_rtt(took);
        if let Some(Burst { heard: Some((_, number)), .. }) = self.bursts.front()
            && self.burst_packets.is_none()
            && (USUAL_BURST * 9 / 10..USUAL_BURST).contains(number)
        {
            self.burst_packets = Some(USUAL_BURST);
        }
        self.bursts.clear();
    }

    fn on_burst_packet(&mut self, now: Micros, packet: &Packet, at_end: bool) {
        let number = |burst: &Burst| u64::from(packet.sequence.wrapping_sub(burst.sequence)) - 1;
        let is_of = |burst: &Burst| {
            let number = packet.sequence.wrapping_sub(burst.sequence);
            number != 0 && number <= super::NUMBERS_PER_BURST
        };
        let Some(index) = self.bursts.iter().position(is_of) else { return };
        // The vehicle serves one after another: those before it are over.
        self.bursts.drain(..index);
        let Some(burst) = self.bursts.front_mut() else { return };
        let number = number(burst);
        if let Some((at, highest)) = &mut burst.heard {
            let steps = number.saturating_sub(*highest);
            if steps > 0 {
                let each = now.saturating_sub(*at) as f64 / steps as f64;
                let weight = if burst.spacing == 0.0 { 1.0 } else { 0.1 };
                burst.spacing += (each - burst.spacing) * weight;
                (*at, *highest) = (now, number);
            }
        } else {
            if number == 0 && burst.is_first {
                self.caller.add_rtt(now.saturating_sub(burst.since));
            }
            burst.heard = Some((now, number));
        }
        if packet.burst_complete {
            self.burst_packets = Some(number + 1);
        }
        if packet.burst_complete || at_end {
            self.end_burst(now);
        }
    }

    fn on_burst_refused(&mut self, now: Micros, packet: &Packet) {
        let is_of = |burst: &Burst| {
            let number = packet.sequence.wrapping_sub(burst.sequence);
            number != 0 && number <= super::NUMBERS_PER_BURST
        };
        // A refusal that comes twice or late is of a burst that is over.
        let Some(index) = self.bursts.iter().position(is_of) else { return };
        self.heard = Some(now);
        match packet.refusal() {
            Some(Refusal::EndOfFile) => {
                self.bursts.drain(..index);
                let was_mute = self.bursts.front().is_some_and(|burst| burst.heard.is_none());
                if was_mute {
                    // Nothing where there should be something; single reads find out.
                    self.no_bursts = true;
                }
                self.end_burst(now);
            }
            Some(Refusal::UnknownCommand) => {
                self.bursts.clear();
                self.no_bursts = true;
            }
            _ => self.reopen_limited(now, packet),
        }
    }

    fn on_read_refused(&mut self, now: Micros, packet: &Packet) {
        let number = packet.sequence.wrapping_sub(1);
        let Some(index) = self.numbers.iter().position(|(of, _)| *of == number) else { return };
        let Some((_, offset)) = self.numbers.remove(index) else { return };
        self.heard = Some(now);
        self.on_read_answered(now, offset);
        match (packet.refusal(), self.size) {
            (Some(Refusal::EndOfFile), Some(said)) if offset < said => {
                self.lies += 1;
                if self.lies >= MOST_LIES {
                    self.close(Err(FtpError::SizeLies { said, ends: offset }));
                } else {
                    self.reopen(now + BUSY_PAUSE);
                }
            }
            _ => self.reopen_limited(now, packet),
        }
    }

    fn reopen_limited(&mut self, now: Micros, packet: &Packet) {
        self.failures += 1;
        match packet.refusal() {
            Some(refusal) if self.failures > 10 => {
                self.close(Err(FtpError::Refused { what: "reading", refusal }));
            }
            // The session is not the vehicle's: it booted.
            Some(Refusal::FileNotFound) => self.reopen(now),
            _ => self.reopen(now + BUSY_PAUSE),
        }
    }

    fn end_burst(&mut self, now: Micros) {
        self.bursts.pop_front();
        if let Some(next) = self.bursts.front_mut() {
            next.since = now;
        }
    }

    /// From when on the current burst's silence is suspicious.
    fn suspicious_at(&self) -> Option<Micros> {
        let burst = self.bursts.front()?;
        let timeout = self.caller.timeout();
        Some(match burst.heard {
            None => burst.since + 2 * timeout,
            Some((at, _)) => at + timeout.max((burst.spacing * 24.0) as Micros).max(150 * MS),
        })
    }

    fn burst_length(&self) -> u64 {
        self.burst_packets.unwrap_or(USUAL_BURST) * PIECE
    }

    /// Where the next burst is worth its packets.
    fn burst_start(&self) -> Option<u64> {
        let (sink, size) = (self.sink.as_ref()?, self.size?);
        if self.no_bursts || sink.have().count() > MOST_RANGES {
            return None;
        }
        // Behind what is on its way.
        let mut from = self.bursts.back().map_or(0, |burst| burst.offset + self.burst_length());
        while let Some((start, end)) = sink.have().gap(from, size) {
            let packets = (end - start).div_ceil(PIECE);
            if packets >= WORTH_A_BURST || (end == size && packets >= WORTH_A_TAIL) {
                return Some(start);
            }
            from = end;
        }
        None
    }

    fn wants_burst(&self) -> bool {
        match (self.bursts.front(), self.bursts.len()) {
            (None, _) => self.reads.is_empty(),
            // One more while one comes, once its length is known: it is served right after it.
            (Some(burst), 1) => self.burst_packets.is_some_and(|packets| {
                burst.heard.is_some_and(|heard| self.is_late(burst, heard, packets))
            }),
            _ => false,
        }
    }

    /// Whether a burst that has come this far is over before an answer could be here.
    fn is_late(&self, burst: &Burst, (at, number): (Micros, u64), packets: u64) -> bool {
        let came = number + 1;
        // The mean of a few packets says little: they come in heaps.
        let is_steady = came > packets / 8;
        let each = at.saturating_sub(burst.since) as f64 / came as f64;
        let left = packets.saturating_sub(came) as f64 * each;
        came > packets / 2 || (is_steady && left < self.caller.timeout() as f64)
    }

    fn send_burst(&mut self, now: Micros, offset: u64) -> MavMessage {
        let mut packet = Packet::request(Op::BurstReadFile);
        packet.size = MOST_DATA as u8;
        packet.offset = offset as u32;
        let packet = self.caller.number(packet);
        self.caller.skip();
        self.tally.bursts += 1;
        let spacing = self.bursts.front().map_or(0.0, |burst| burst.spacing);
        self.bursts.push_back(Burst {
            sequence: packet.sequence,
            offset,
            since: now,
            is_first: self.bursts.is_empty(),
            heard: None,
            spacing,
        });
        self.caller.message(&packet)
    }

    fn poll_reading(&mut self, now: Micros) -> Step<Got<S>> {
        let (Some(sink), Some(size)) = (&self.sink, self.size) else {
            return Step::Wait(Micros::MAX);
        };
        if sink.have().gap(0, size).is_none() {
            self.close(Ok(size));
            return self.poll(now);
        }
        let heard = *self.heard.get_or_insert(now);
        let gives_up = heard + self.options.patience;
        if now >= gives_up {
            let seconds = self.options.patience / S;
            self.close(Err(FtpError::Silent { seconds }));
            return self.poll(now);
        }
        let suspicious_at = self.suspicious_at();
        let is_silent = suspicious_at.is_some_and(|at| now >= at);
        let mut wake = gives_up.min(self.reads.expire(now, self.caller.timeout(), is_silent));
        if let Some(at) = suspicious_at.filter(|_| !is_silent) {
            wake = wake.min(at);
        }
        if !is_silent
            && self.wants_burst()
            && let Some(offset) = self.burst_start()
        {
            let length = self.burst_length().min(size - offset);
            let cost = length + length.div_ceil(PIECE) * OVERHEAD;
            match self.allowed(now, cost) {
                Ok(()) => return Step::send(self.send_burst(now, offset)),
                Err(later) => wake = wake.min(later),
            }
        } else if self.bursts.is_empty() || is_silent {
            if let Err(later) = self.allowed(now, 0) {
                return Step::Wait(wake.min(later));
            }
            let Some(sink) = &self.sink else { return Step::Wait(wake) };
            if let Some((start, end)) = self.reads.next(now, sink.have(), size, is_silent) {
                let _ = self.allowed(now, end - start + OVERHEAD);
                return Step::send(self.send_read(start, end));
            }
        }
        Step::Wait(wake)
    }

    fn allowed(&self, now: Micros, bytes: u64) -> Result<(), Micros> {
        self.options.budget.as_ref().map_or(Ok(()), |budget| budget.take(now, bytes))
    }

    fn send_read(&mut self, start: u64, end: u64) -> MavMessage {
        let mut packet = Packet::request(Op::ReadFile);
        packet.size = (end - start) as u8;
        packet.offset = start as u32;
        let packet = self.caller.number(packet);
        self.tally.reads += 1;
        if self.numbers.len() >= 2 * MOST_READS {
            self.numbers.pop_front();
        }
        self.numbers.push_back((packet.sequence, start));
        self.caller.message(&packet)
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

impl<S: Sink> Machine for Get<S> {
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
                Wish::Send(message) => Step::Send(message),
                Wish::Wait(until) => Step::Wait(until),
                Wish::Silent(_) => {
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
                    Some(Wish::Send(message)) => Step::Send(message),
                    Some(Wish::Wait(until)) => Step::Wait(until),
                    Some(Wish::Silent(_)) | None => match self.sink.take() {
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
