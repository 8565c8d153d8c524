//! Walk through a log: message by message, over damage, with the formats that the log defines.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};

#[cfg(feature = "schemars")]
use schemars::JsonSchema;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::format::{FMT_ID, Format};
use super::letter::field_text;
use super::window::{Window, Windows};
use super::writer::MAGIC;

/// Steps of `TimeUS` forward by more than this are jumps.
const JUMP_AHEAD_US: u64 = 60_000_000;

/// The firmware's threads write a little out of order: steps back by up to this are none.
const DISORDER_US: u64 = 1_000_000;

/// Jumps kept with their place; the rest are only counted.
const KEPT_JUMPS: usize = 32;

/// What a scan met besides good messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "schemars", derive(JsonSchema))]
pub struct ScanStats {
    /// Bytes skipped because no known message started there.
    pub bad_bytes: u64,
    /// Messages whose type no FMT row defines.
    pub unknown: u64,
    /// FMT rows refused because their length does not fit their letters.
    pub rejected_formats: u64,
    /// Bytes of an unfinished message at the end of the file, and of what could not be read of it.
    pub truncated_bytes: u64,
    /// Times at which TimeUS went back (by more than a second: the firmware's threads write a
    /// little out of order) or jumped ahead by more than a minute.
    pub time_jumps: u64,
}

/// A place where `TimeUS` jumped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "schemars", derive(JsonSchema))]
pub struct TimeJump {
    /// Of the message after the jump, from the start of the file.
    pub offset_bytes: u64,
    /// Latest time before the jump.
    pub from_us: u64,
    /// Time after it.
    pub to_us: u64,
}

/// Receives the messages that it asks for.
pub(super) trait Visitor {
    /// A type was defined, or defined anew: does the visitor want its messages?
    fn defined(&mut self, id: u8, format: &Format, window: Window<'_>) -> bool;

    /// A wanted message, header included, as long as its format says; `start` is its place in the
    /// window.
    fn message(&mut self, id: u8, message: &[u8], window: Window<'_>, start: usize);

    /// The window goes: what is wanted of it must be taken now.
    fn leave(&mut self, _window: Window<'_>) {}
}

/// What the log says about units.
#[derive(Debug, Default)]
pub(super) struct Units {
    labels: BTreeMap<u8, String>,
    factors: BTreeMap<u8, f64>,
    /// Unit and multiplier letters by type.
    types: BTreeMap<u8, (Vec<u8>, Vec<u8>)>,
}

impl Units {
    /// Unit label of a field; `None` if the log does not say, or says that there is none.
    pub(super) fn label(&self, id: u8, field: usize) -> Option<&str> {
        let letter = self.types.get(&id)?.0.get(field)?;
        self.labels.get(letter).map(String::as_str).filter(|label| !label.is_empty())
    }

    /// Multiplier of a field; `None` if the log does not say, or says that there is none.
    pub(super) fn multiplier(&self, id: u8, field: usize) -> Option<f64> {
        let letter = self.types.get(&id)?.1.get(field)?;
        self.factors.get(letter).copied().filter(|&factor| factor != 0.0)
    }

    fn learn(&mut self, format: &Format, message: &[u8]) -> Option<()> {
        let letter = |label| format.bytes(message, label).and_then(|bytes| bytes.first().copied());
        match format.name.as_str() {
            "UNIT" => {
                let label = field_text(format.bytes(message, "Label")?);
                self.labels.insert(letter("Id")?, label);
            }
            "MULT" => {
                self.factors.insert(letter("Id")?, format.number(message, "Mult")?);
            }
            "FMTU" => {
                let units = format.bytes(message, "UnitIds")?.to_vec();
                let multipliers = format.bytes(message, "MultIds")?.to_vec();
                self.types.insert(letter("FmtType")?, (units, multipliers));
            }
            _ => {}
        }
        Some(())
    }
}

/// What a scan leaves behind.
#[derive(Debug)]
pub(super) struct Scan {
    /// Latest format by type byte.
    pub(super) formats: Vec<Option<Format>>,
    pub(super) units: Units,
    pub(super) stats: ScanStats,
    /// The first of them.
    pub(super) jumps: Vec<TimeJump>,
    /// FMT rows that define FMT: each file starts with one.
    pub(super) starts: u64,
}

/// What the walk needs of a type at every message.
#[derive(Clone, Copy, Default)]
struct TypeInfo {
    /// Length of the message, bytes; 0 if the type is unknown.
    length: u8,
    flags: u8,
}

const WANTED: u8 = 1;
const TIMED: u8 = 2;
const FORMAT: u8 = 4;
const UNITS: u8 = 8;

struct Walk {
    kinds: [TypeInfo; 256],
    /// Latest `TimeUS`; `None` before the first.
    latest_us: Option<u64>,
    scan: Scan,
}

/// Walks through all messages of a log.
pub(super) fn scan<V: Visitor>(bytes: &[u8], visitor: &mut V) -> Scan {
    let mut walk = Walk::new(visitor);
    let window = Window::whole(bytes);
    walk.run(window, visitor);
    visitor.leave(window);
    walk.scan
}

/// Walks through all messages of the first `size` bytes of a file; `None`: it is gone. What cannot be
/// read any more is cut off.
pub(super) fn scan_file<V: Visitor>(file: Option<File>, size: usize, visitor: &mut V) -> Scan {
    match file {
        Some(file) => scan_windows(Windows::new(file, size), visitor),
        None => scan_windows(Windows::new(io::empty(), size), visitor),
    }
}

/// Walks through windows.
pub(super) fn scan_windows<R: Read, V: Visitor>(mut windows: Windows<R>, visitor: &mut V) -> Scan {
    let mut walk = Walk::new(visitor);
    let mut done = 0;
    loop {
        let window = windows.advance(done);
        done = walk.run(window, visitor);
        visitor.leave(window);
        if window.is_last {
            let missing = window.size.saturating_sub(window.base + window.bytes.len());
            walk.scan.stats.truncated_bytes += missing as u64;
            return walk.scan;
        }
    }
}

impl Walk {
    fn new<V: Visitor>(visitor: &mut V) -> Self {
        let scan = Scan {
            formats: vec![None; 256],
            units: Units::default(),
            stats: ScanStats::default(),
            jumps: Vec::new(),
            starts: 0,
        };
        let mut walk = Self { kinds: [TypeInfo::default(); 256], latest_us: None, scan };
        walk.define(FMT_ID, Format::of_fmt(), Window::whole(&[]), visitor);
        walk
    }

    /// Walks through a window; returns where in it the next one begins.
    fn run<V: Visitor>(&mut self, window: Window<'_>, visitor: &mut V) -> usize {
        let (bytes, limit) = (window.bytes, window.limit());
        let mut position = 0;
        while position < limit
            && let Some(rest) = bytes.get(position..)
            && let Some(&[first, second, id]) = rest.first_chunk()
        {
            let kind = self.kinds[usize::from(id)];
            let length = usize::from(kind.length);
            if [first, second] == MAGIC
                && length != 0
                && let Some((message, after)) = rest.split_at_checked(length)
            {
                let followed = after.starts_with(&MAGIC) || after.is_empty();
                if followed || self.is_credible(kind, message, after) {
                    self.accept(kind, id, message, window, position, visitor);
                    position += length;
                    continue;
                }
            }
            let skipped = self.garbage(rest);
            if skipped == 0 {
                return bytes.len();
            }
            position += skipped;
        }
        if !window.is_last {
            return position;
        }
        let rest = bytes.get(position..).unwrap_or_default();
        if !rest.is_empty() && MAGIC.starts_with(&rest[..1]) {
            self.scan.stats.truncated_bytes += rest.len() as u64;
        } else {
            self.scan.stats.bad_bytes += rest.len() as u64;
        }
        bytes.len()
    }

    /// Whether to believe in a message that no other follows: not if another one starts inside of
    /// it (its tail was lost), nor if its time is out of reach (chance made its header).
    #[cold]
    fn is_credible(&self, kind: TypeInfo, message: &[u8], after: &[u8]) -> bool {
        let jumps = kind.flags & TIMED != 0 && self.jump(time_us(message)).is_some();
        !jumps && !self.hides_message(message, after)
    }

    /// Whether a message that another one or the end follows starts inside of `message`.
    fn hides_message(&self, message: &[u8], after: &[u8]) -> bool {
        let at =
            |index: usize| message.get(index).or_else(|| after.get(index - message.len())).copied();
        (1..message.len()).any(|start| {
            if at(start) != Some(MAGIC[0]) || at(start + 1) != Some(MAGIC[1]) {
                return false;
            }
            let length = at(start + 2).map_or(0, |id| self.kinds[usize::from(id)].length);
            let end = start + usize::from(length);
            let all = message.len() + after.len();
            length != 0
                && (end == all || (at(end) == Some(MAGIC[0]) && at(end + 1) == Some(MAGIC[1])))
        })
    }

    /// Bytes to skip where no message starts (counted); 0 at an unfinished message that ends the
    /// file.
    #[cold]
    fn garbage(&mut self, rest: &[u8]) -> usize {
        let stats = &mut self.scan.stats;
        if let Some(&[first, second, id]) = rest.first_chunk()
            && [first, second] == MAGIC
        {
            let length = usize::from(self.kinds[usize::from(id)].length);
            if length == 0 {
                stats.unknown += 1;
            } else if rest.len() < length && !self.hides_message(rest, &[]) {
                self.scan.stats.truncated_bytes += rest.len() as u64;
                return 0;
            }
        }
        let skipped = rest
            .iter()
            .skip(1)
            .position(|&byte| byte == MAGIC[0])
            .map_or(rest.len(), |index| index + 1)
            .min(rest.len());
        self.scan.stats.bad_bytes += skipped as u64;
        skipped
    }

    #[inline]
    fn accept<V: Visitor>(
        &mut self,
        kind: TypeInfo,
        id: u8,
        message: &[u8],
        window: Window<'_>,
        position: usize,
        visitor: &mut V,
    ) {
        if kind.flags & TIMED != 0 {
            let now_us = time_us(message);
            match self.latest_us {
                Some(latest_us) if now_us.wrapping_sub(latest_us) <= JUMP_AHEAD_US => {
                    self.latest_us = Some(now_us);
                }
                _ => self.time_step(now_us, window.base + position),
            }
        }
        if kind.flags & WANTED != 0 {
            visitor.message(id, message, window, position);
        }
        if kind.flags & (FORMAT | UNITS) != 0 {
            self.learn(kind, id, message, window, visitor);
        }
    }

    #[cold]
    fn learn<V: Visitor>(
        &mut self,
        kind: TypeInfo,
        id: u8,
        message: &[u8],
        window: Window<'_>,
        visitor: &mut V,
    ) {
        if kind.flags & FORMAT != 0 {
            match Format::from_row(message) {
                Some((id, format)) => {
                    self.scan.starts += u64::from(id == FMT_ID);
                    self.define(id, format, window, visitor);
                }
                None => self.scan.stats.rejected_formats += 1,
            }
        } else if let Some(format) = &self.scan.formats[usize::from(id)] {
            // A row without the fields that it should have teaches nothing.
            let _ = self.scan.units.learn(format, message);
        }
    }

    fn define<V: Visitor>(&mut self, id: u8, format: Format, window: Window<'_>, visitor: &mut V) {
        let slot = &mut self.scan.formats[usize::from(id)];
        if slot.as_ref() == Some(&format) {
            return;
        }
        let mut flags = if visitor.defined(id, &format, window) { WANTED } else { 0 };
        if id == FMT_ID {
            flags |= FORMAT;
        } else if matches!(format.name.as_str(), "UNIT" | "MULT" | "FMTU") {
            // Not timed: their times are those of the log's opening, not of the flight.
            flags |= UNITS;
        } else if format.is_timed() {
            flags |= TIMED;
        }
        self.kinds[usize::from(id)] = TypeInfo { length: format.length, flags };
        if slot.replace(format).is_some() {
            self.scan.units.types.remove(&id);
        }
    }

    /// The jump that a message at `now_us` would make: the time before it.
    fn jump(&self, now_us: u64) -> Option<u64> {
        let latest_us = self.latest_us?;
        let steady = now_us.saturating_sub(latest_us) <= JUMP_AHEAD_US
            && latest_us.saturating_sub(now_us) <= DISORDER_US;
        (!steady).then_some(latest_us)
    }

    #[cold]
    fn time_step(&mut self, now_us: u64, position: usize) {
        if let Some(from_us) = self.jump(now_us) {
            self.scan.stats.time_jumps += 1;
            if self.scan.jumps.len() < KEPT_JUMPS {
                let offset_bytes = position as u64;
                self.scan.jumps.push(TimeJump { offset_bytes, from_us, to_us: now_us });
            }
            self.latest_us = Some(now_us);
        } else {
            self.latest_us = self.latest_us.max(Some(now_us));
        }
    }
}

/// `TimeUS` of a timed message.
#[inline]
pub(super) fn time_us(message: &[u8]) -> u64 {
    let time = message.get(3..).and_then(|body| body.first_chunk::<8>());
    time.map_or(0, |bytes| u64::from_le_bytes(*bytes))
}
