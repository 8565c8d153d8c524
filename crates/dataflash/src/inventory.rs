//! Contents of a log: every message type with its count, fields and times, and who wrote it.

#[cfg(feature = "schemars")]
use schemars::JsonSchema;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::format::{Field, Format};
use super::letter::field_text;
use super::scan::{Scan, ScanStats, TimeJump, Units, Visitor, time_us};
use super::window::Window;

/// Texts of the firmware kept for finding its name.
const KEPT_TEXTS: usize = 32;

/// Names that the firmware's first texts start with.
const FIRMWARES: [&str; 6] =
    ["ArduCopter", "ArduPlane", "ArduRover", "ArduSub", "APM:Copter", "Blimp"];

/// Summary of a log.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "schemars", derive(JsonSchema))]
pub struct Inventory {
    /// Size of the log.
    pub size_bytes: u64,
    /// Earliest `TimeUS`, microseconds since the boot, except of parameters: they are written as of
    /// a time long before.
    pub start_us: Option<u64>,
    /// Latest `TimeUS`.
    pub end_us: Option<u64>,
    /// From the earliest to the latest time.
    pub duration_s: Option<f64>,
    /// Firmware with its version: `ArduCopter V4.4.4 (fa59fb4a)`.
    pub firmware: Option<String>,
    /// Kind of vehicle: the firmware's name without its version.
    pub vehicle: Option<String>,
    /// Logs in this file, one after another (each boot starts a new one).
    pub boots: u64,
    /// Message types defined, logged or not.
    pub defined: u64,
    /// Message types that were logged, by name; a name that was defined anew comes twice.
    pub messages: Vec<MessageInventory>,
    /// Damage.
    pub stats: ScanStats,
    /// The first of the places where time jumped; all are counted in `stats`.
    pub time_jumps: Vec<TimeJump>,
}

/// One message type of a log.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "schemars", derive(JsonSchema))]
pub struct MessageInventory {
    /// `ATT`.
    pub name: String,
    /// Messages.
    pub count: u64,
    /// All of them together, headers included.
    pub bytes: u64,
    /// Earliest `TimeUS`, for messages that have it.
    pub first_us: Option<u64>,
    /// Latest `TimeUS`.
    pub last_us: Option<u64>,
    /// Its fields.
    pub fields: Vec<FieldInventory>,
}

impl MessageInventory {
    /// Mean rate between the earliest and the latest message, Hz, all instances together; `None` if
    /// they give none.
    pub fn rate_hz(&self) -> Option<f64> {
        let span_us = self.last_us?.checked_sub(self.first_us?)?;
        (span_us > 0 && self.count > 1).then(|| (self.count - 1) as f64 * 1e6 / span_us as f64)
    }
}

/// One field of a message type.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "schemars", derive(JsonSchema))]
pub struct FieldInventory {
    /// `DesRoll`.
    pub label: String,
    /// Format letter.
    pub letter: char,
    /// Unit label, if the log gives one.
    pub unit: Option<String>,
    /// Multiplier, if the log gives one; see [`super::Column::multiplier`].
    pub multiplier: Option<f64>,
}

/// The inventory of a log of `size_bytes` whose messages were counted.
pub(super) fn take(size_bytes: u64, count: &Count, scan: Scan) -> Inventory {
    let firmware = count.firmware();
    let messages = count.messages(&scan.units);
    let spans = || messages.iter().filter(|message| message.name != "PARM");
    let start_us = spans().filter_map(|message| message.first_us).min();
    let end_us = spans().filter_map(|message| message.last_us).max();
    let span_us = start_us.zip(end_us).and_then(|(start, end)| end.checked_sub(start));
    Inventory {
        size_bytes,
        start_us,
        end_us,
        duration_s: span_us.map(|span_us| span_us as f64 / 1e6),
        vehicle: firmware.as_deref().and_then(|name| name.split(' ').next()).map(str::to_owned),
        firmware,
        boots: scan.starts.max(1),
        defined: scan.formats.iter().flatten().count() as u64,
        messages,
        stats: scan.stats,
        time_jumps: scan.jumps,
    }
}

/// What was counted of one definition.
struct Tally {
    id: u8,
    format: Format,
    is_timed: bool,
    /// MSG and VER rows are looked into.
    is_told: bool,
    count: u64,
    span_us: Option<(u64, u64)>,
}

impl Tally {
    fn new(id: u8, format: &Format) -> Self {
        Self {
            id,
            is_timed: format.is_timed()
                && !matches!(format.name.as_str(), "UNIT" | "MULT" | "FMTU"),
            is_told: matches!(format.name.as_str(), "MSG" | "VER"),
            format: format.clone(),
            count: 0,
            span_us: None,
        }
    }
}

/// Counts all messages.
pub(super) struct Count {
    tallies: Vec<Tally>,
    /// The latest tally of each type byte.
    current: [Option<usize>; 256],
    texts: Vec<String>,
    version: Option<String>,
}

impl Default for Count {
    fn default() -> Self {
        Self { tallies: Vec::new(), current: [None; 256], texts: Vec::new(), version: None }
    }
}

impl Visitor for Count {
    fn defined(&mut self, id: u8, format: &Format, _window: Window<'_>) -> bool {
        let current = &mut self.current[usize::from(id)];
        match current.and_then(|index| self.tallies.get_mut(index)) {
            Some(unused) if unused.count == 0 => *unused = Tally::new(id, format),
            _ => {
                *current = Some(self.tallies.len());
                self.tallies.push(Tally::new(id, format));
            }
        }
        true
    }

    fn message(&mut self, id: u8, message: &[u8], _window: Window<'_>, _start: usize) {
        let current = self.current[usize::from(id)];
        let Some(tally) = current.and_then(|index| self.tallies.get_mut(index)) else { return };
        tally.count += 1;
        if tally.is_timed {
            let now_us = time_us(message);
            let (first, last) = tally.span_us.unwrap_or((now_us, now_us));
            tally.span_us = Some((first.min(now_us), last.max(now_us)));
        }
        if tally.is_told {
            let text = |label| tally.format.bytes(message, label).map(field_text);
            if self.texts.len() < KEPT_TEXTS {
                self.texts.extend(text("Message"));
            }
            if self.version.is_none() {
                self.version = text("FWS").filter(|version| !version.is_empty());
            }
        }
    }
}

impl Count {
    /// VER says it best; older firmware says it in its first texts.
    fn firmware(&self) -> Option<String> {
        let is_name = |text: &&String| FIRMWARES.iter().any(|name| text.starts_with(name));
        self.version.as_ref().or_else(|| self.texts.iter().find(is_name)).cloned()
    }

    fn messages(&self, units: &Units) -> Vec<MessageInventory> {
        let mut messages = Vec::new();
        for (index, tally) in self.tallies.iter().enumerate().filter(|(_, tally)| tally.count > 0) {
            // FMTU rows tell of the latest definition of a type byte.
            let is_current = self.current[usize::from(tally.id)] == Some(index);
            let field = |(index, field): (usize, &Field)| FieldInventory {
                label: field.label.clone(),
                letter: char::from(field.byte),
                unit: units.label(tally.id, index).filter(|_| is_current).map(str::to_owned),
                multiplier: units.multiplier(tally.id, index).filter(|_| is_current),
            };
            messages.push(MessageInventory {
                name: tally.format.name.clone(),
                count: tally.count,
                bytes: tally.count * u64::from(tally.format.length),
                first_us: tally.span_us.map(|(first, _)| first),
                last_us: tally.span_us.map(|(_, last)| last),
                fields: tally.format.fields.iter().enumerate().map(field).collect(),
            });
        }
        messages.sort_by(|a, b| a.name.cmp(&b.name));
        messages
    }
}
