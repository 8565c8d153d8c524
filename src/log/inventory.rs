//! What is in a log: every message type with its count, fields and times, and who wrote it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::format::Format;
use super::letter::field_text;
use super::scan::{ScanStats, TimeJump, Units, Visitor, scan, time_us};

/// Texts of the firmware kept for finding its name.
const KEPT_TEXTS: usize = 32;

/// Summary of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Inventory {
    /// Size of the log.
    pub size_bytes: u64,
    /// Earliest `TimeUS`, microseconds since the boot.
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
    /// Message types that were logged, by name.
    pub messages: Vec<MessageInventory>,
    /// Damage.
    pub stats: ScanStats,
    /// The first of the places where time jumped; all are counted in `stats`.
    pub time_jumps: Vec<TimeJump>,
}

/// One message type of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MessageInventory {
    /// `ATT`.
    pub name: String,
    /// Messages.
    pub count: u64,
    /// All of them together, headers included.
    pub bytes: u64,
    /// First `TimeUS`, for messages that have it.
    pub first_us: Option<u64>,
    /// Last `TimeUS`.
    pub last_us: Option<u64>,
    /// Fields of the latest definition.
    pub fields: Vec<FieldInventory>,
}

impl MessageInventory {
    /// Mean rate between the first and the last message (all instances together).
    pub fn rate_hz(&self) -> Option<f64> {
        let span_us = self.last_us?.checked_sub(self.first_us?)?;
        (span_us > 0 && self.count > 1).then(|| (self.count - 1) as f64 * 1e6 / span_us as f64)
    }
}

/// One field of a message type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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

/// Takes the inventory of a log's bytes.
pub(super) fn take(bytes: &[u8]) -> Inventory {
    let mut count = Count::default();
    let scan = scan(bytes, &mut count);
    let mut messages: Vec<MessageInventory> = Vec::new();
    for (id, (tally, format)) in count.tallies.iter().zip(&scan.formats).enumerate() {
        let Some(format) = format else { continue };
        if tally.count == 0 {
            continue;
        }
        messages.push(MessageInventory {
            name: format.name.clone(),
            count: tally.count,
            bytes: tally.bytes,
            first_us: tally.span_us.map(|(first, _)| first),
            last_us: tally.span_us.map(|(_, last)| last),
            fields: fields(id as u8, format, &scan.units),
        });
    }
    messages.sort_by(|a, b| a.name.cmp(&b.name));
    let range = count.range_us;
    let firmware = count.firmware();
    Inventory {
        size_bytes: bytes.len() as u64,
        start_us: range.map(|(start, _)| start),
        end_us: range.map(|(_, end)| end),
        duration_s: range.map(|(start, end)| (end - start) as f64 / 1e6),
        vehicle: firmware.as_deref().and_then(|name| name.split(' ').next()).map(str::to_owned),
        firmware,
        boots: scan.starts.max(1),
        defined: scan.formats.iter().flatten().count() as u64,
        messages,
        stats: scan.stats,
        time_jumps: scan.jumps,
    }
}

fn fields(id: u8, format: &Format, units: &Units) -> Vec<FieldInventory> {
    let inventory = |(index, field): (usize, &super::format::Field)| FieldInventory {
        label: field.label.clone(),
        letter: char::from(field.byte),
        unit: units.label(id, index).map(str::to_owned),
        multiplier: units.multiplier(id, index),
    };
    format.fields.iter().enumerate().map(inventory).collect()
}

#[derive(Clone, Default)]
struct Tally {
    timed: bool,
    /// Offset of the text, for MSG.
    text: Option<usize>,
    /// The latest definition, kept for VER alone.
    version: Option<Format>,
    count: u64,
    bytes: u64,
    span_us: Option<(u64, u64)>,
}

struct Count {
    /// By type byte.
    tallies: Vec<Tally>,
    range_us: Option<(u64, u64)>,
    texts: Vec<String>,
    version: Option<String>,
}

impl Default for Count {
    fn default() -> Self {
        let tallies = vec![Tally::default(); 256];
        Self { tallies, range_us: None, texts: Vec::new(), version: None }
    }
}

impl Visitor for Count {
    fn defined(&mut self, id: u8, format: &Format) -> bool {
        let tally = &mut self.tallies[usize::from(id)];
        tally.timed = format.is_timed();
        tally.text = match format.name.as_str() {
            "MSG" => format.field("Message").map(|(_, field)| field.offset),
            _ => None,
        };
        tally.version = (format.name == "VER").then(|| format.clone());
        true
    }

    fn message(&mut self, id: u8, message: &[u8]) {
        let tally = &mut self.tallies[usize::from(id)];
        tally.count += 1;
        tally.bytes += message.len() as u64;
        if tally.timed {
            let now_us = time_us(message);
            let (first, _) = tally.span_us.unwrap_or((now_us, now_us));
            tally.span_us = Some((first, now_us));
            let (start, end) = self.range_us.unwrap_or((now_us, now_us));
            self.range_us = Some((start.min(now_us), end.max(now_us)));
        }
        if let Some(offset) = tally.text
            && self.texts.len() < KEPT_TEXTS
        {
            self.texts.push(field_text(message.get(offset..).unwrap_or_default()));
        }
        if self.version.is_none()
            && let Some(format) = &tally.version
        {
            self.version = format.bytes(message, "FWS").map(field_text);
        }
    }
}

impl Count {
    /// VER says it best; older firmware says it in its first texts.
    fn firmware(&self) -> Option<String> {
        let named = |text: &&String| {
            ["ArduCopter", "ArduPlane", "ArduRover", "ArduSub", "Blimp", "Rover", "CMCopter"]
                .iter()
                .any(|name| text.starts_with(name))
        };
        self.version
            .as_ref()
            .filter(|text| !text.is_empty())
            .or_else(|| self.texts.iter().find(named))
            .cloned()
    }
}
