//! Reader of `.skyb` files.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use super::units::{to_m, value_count};
use super::{BlockKind, MAGIC, MAX_FILE, SkybError, TRAJECTORY_HEADER, yaw};
use crate::bezier::{Scalar, path_through};
use crate::{Extras, Segment, SegmentPath, ShowDrone, Trajectory};
use untrusted_io::crc::ApCrc32;
use untrusted_io::plain::plain;

/// Contents of a `.skyb` file.
#[derive(Clone, Debug, PartialEq)]
pub struct SkybContents {
    /// The show of this drone. Its name is empty: the file has none.
    pub drone: ShowDrone,
    /// Version of the file format, 1 or 2.
    pub version: u8,
    /// Whether the file has a checksum (which then is right).
    pub has_crc: bool,
    /// Size of the unit, mm; 0 only for an empty trajectory.
    pub scale_mm: u8,
    /// The comment block, if any; bytes that are not UTF-8 are replaced.
    pub comment: Option<String>,
    /// Timed events (pyro), in the order of the file.
    pub events: Vec<Event>,
    /// Whether there is a return-to-home plan (not decoded: its layout depends on the firmware).
    pub has_rth_plan: bool,
    /// Whether the trajectory block itself carries yaw (flag and codes in the pieces). The fork
    /// ignores it; it is read past and not kept.
    pub has_trajectory_yaw: bool,
    /// All blocks, in the order of the file.
    pub blocks: Vec<BlockInfo>,
}

/// Kind and place of a block in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct BlockInfo {
    /// Kind of the block.
    pub kind: BlockKind,
    /// Offset of its body in the file.
    pub offset: usize,
    /// Size of its body, bytes.
    pub bytes: usize,
    /// Whether the block is used: only the first one of each kind is.
    pub used: bool,
}

/// One record of the event list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Event {
    /// Show time of the event, ms.
    pub time_ms: u32,
    /// Type of the event; 1 is pyro.
    pub kind: u8,
    /// Subtype: the pyro channel.
    pub subtype: u8,
    /// Payload, as it is in the file.
    pub payload: [u8; 4],
}

/// The kind of event that fires pyro.
const PYRO: u8 = 1;

/// Reads a `.skyb` file of version 1 or 2.
///
/// Of each block type the first one counts, as in the firmware; unknown types are skipped. Axes of
/// different degree in one piece are brought to the highest of them, which is exact.
///
/// # Errors
///
/// [`SkybError`] with the offset of what is broken: wrong magic, version or checksum, blocks or
/// pieces that are cut off, pieces that last 0 ms, scale 0 with pieces, no trajectory. The firmware's
/// library would accept pieces of 0 ms; they make velocities infinite, so they are refused here.
pub fn read(bytes: &[u8]) -> Result<SkybContents, SkybError> {
    if bytes.len() > MAX_FILE {
        return Err(SkybError::TooLarge(bytes.len()));
    }
    let (version, has_crc, first) = header(bytes)?;
    let blocks = list_blocks(bytes, first)?;
    let body = |kind: BlockKind| {
        let block = blocks.iter().find(|block| block.kind == kind)?;
        Some((bytes.get(block.offset..block.offset + block.bytes)?, block.offset))
    };

    let (block, offset) = body(BlockKind::Trajectory).ok_or(SkybError::NoTrajectory)?;
    let flown = trajectory(block, offset)?;
    let yaw = body(BlockKind::Yaw).map(|(block, offset)| yaw::decode(block, offset)).transpose()?;
    let events = body(BlockKind::Events)
        .map(|(block, offset)| events(block, offset))
        .transpose()?
        .unwrap_or_default();
    let lights = body(BlockKind::Lights).map(|(block, _)| block.to_vec()).unwrap_or_default();
    let comment = body(BlockKind::Comment)
        .map(|(block, _)| plain(&String::from_utf8_lossy(block)).into_owned());
    let has_rth_plan = body(BlockKind::RthPlan).is_some();
    let pyro_events = events.iter().filter(|event| event.kind == PYRO).count();
    let extras = Extras { pyro_events, has_rth_plan, ..Extras::default() };
    Ok(SkybContents {
        drone: ShowDrone {
            trajectory: flown.trajectory,
            lights,
            yaw,
            extras,
            ..ShowDrone::default()
        },
        version,
        has_crc,
        scale_mm: flown.scale_mm,
        comment,
        events,
        has_rth_plan,
        has_trajectory_yaw: flown.has_yaw,
        blocks,
    })
}

/// Version, whether there is a checksum, and where the blocks start.
fn header(bytes: &[u8]) -> Result<(u8, bool, usize), SkybError> {
    let Some((magic, rest)) = bytes.split_first_chunk::<4>() else {
        return Err(SkybError::BadMagic { found: bytes.to_vec() });
    };
    if *magic != MAGIC {
        return Err(SkybError::BadMagic { found: magic.to_vec() });
    }
    let cut_off = |needed| SkybError::Truncated {
        offset: 4,
        what: "the file header",
        needed,
        left: rest.len(),
    };
    match rest {
        [] => Err(cut_off(1)),
        [1, ..] => Ok((1, false, 5)),
        [2] => Err(cut_off(2)),
        [2, features, ..] if features & 1 == 0 => Ok((2, false, 6)),
        [2, _, a, b, c, d, blocks @ ..] => {
            let stored = u32::from_le_bytes([*a, *b, *c, *d]);
            let mut crc = ApCrc32::default();
            crc.update(&bytes[..6]);
            crc.update(&[0; 4]);
            crc.update(blocks);
            let computed = crc.value();
            if stored != computed {
                return Err(SkybError::BadCrc { stored, computed });
            }
            Ok((2, true, 10))
        }
        [2, ..] => Err(cut_off(6)),
        [other, ..] => Err(SkybError::BadVersion(*other)),
    }
}

fn list_blocks(bytes: &[u8], first: usize) -> Result<Vec<BlockInfo>, SkybError> {
    let mut blocks = Vec::new();
    let mut seen = [false; 256];
    let mut at = first;
    while let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
        let [code, low, high, body @ ..] = rest else {
            let (what, needed, left) = ("a block header", 3, rest.len());
            return Err(SkybError::Truncated { offset: at, what, needed, left });
        };
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        let kind = BlockKind::from_code(*code);
        let offset = at + 3;
        if body.len() < length {
            let (what, needed, left) = (block_text(kind), length, body.len());
            return Err(SkybError::Truncated { offset, what, needed, left });
        }
        let seen = &mut seen[usize::from(*code)];
        let used = !*seen && !matches!(kind, BlockKind::Unknown(_));
        *seen = true;
        blocks.push(BlockInfo { kind, offset, bytes: length, used });
        at = offset + length;
    }
    Ok(blocks)
}

fn block_text(kind: BlockKind) -> &'static str {
    match kind {
        BlockKind::Trajectory => "the trajectory block",
        BlockKind::Lights => "the light program block",
        BlockKind::Comment => "the comment block",
        BlockKind::RthPlan => "the RTH plan block",
        BlockKind::Yaw => "the yaw control block",
        BlockKind::Events => "the event list block",
        BlockKind::Unknown(_) => "a block of unknown type",
    }
}

struct Flown {
    trajectory: Trajectory,
    scale_mm: u8,
    has_yaw: bool,
}

fn trajectory(body: &[u8], offset: usize) -> Result<Flown, SkybError> {
    if body.is_empty() {
        return Ok(Flown { trajectory: Trajectory::default(), scale_mm: 0, has_yaw: false });
    }
    let Some((header, _)) = body.split_first_chunk::<TRAJECTORY_HEADER>() else {
        return Err(SkybError::Truncated {
            offset,
            what: "the trajectory header",
            needed: TRAJECTORY_HEADER,
            left: body.len(),
        });
    };
    let [scale, x0, x1, y0, y1, z0, z1, ..] = *header;
    let scale_mm = scale & 0x7f;
    let mut has_yaw = scale & 0x80 != 0;
    if scale_mm == 0 && body.len() > TRAJECTORY_HEADER {
        return Err(SkybError::ZeroScale { offset });
    }
    let mut units = [[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes);
    let start_m = Vector3::from(units.map(|unit| to_m(unit, scale_mm)));
    let mut segments = Vec::with_capacity(body.len() / 9);
    let mut at = TRAJECTORY_HEADER;
    while let Some(rest) = body.get(at..).filter(|rest| !rest.is_empty()) {
        let place = offset + at;
        let [codes, low, high, values @ ..] = rest else {
            let (what, needed, left) = ("the header of a piece", 3, rest.len());
            return Err(SkybError::Truncated { offset: place, what, needed, left });
        };
        let duration_ms = u32::from(u16::from_le_bytes([*low, *high]));
        let codes = [0, 2, 4, 6].map(|shift| codes >> shift & 3);
        let needed = codes.iter().map(|code| value_count(*code) * 2).sum();
        if values.len() < needed {
            let (what, left) = ("a piece", values.len());
            return Err(SkybError::Truncated { offset: place + 3, what, needed, left });
        }
        if duration_ms == 0 {
            return Err(SkybError::ZeroDuration { offset: place, piece: segments.len() + 1 });
        }
        has_yaw |= codes[3] != 0;
        let path = piece([codes[0], codes[1], codes[2]], values, &mut units, scale_mm);
        segments.push(Segment { duration_ms, path });
        at += 3 + needed;
    }
    Ok(Flown { trajectory: Trajectory { start_m, segments }, scale_mm, has_yaw })
}

/// One piece; `units` goes from its start to its end.
fn piece(codes: [u8; 3], values: &[u8], units: &mut [i16; 3], scale_mm: u8) -> SegmentPath {
    let degree = match codes.iter().max() {
        Some(0) | None => return SegmentPath::Hold,
        Some(1) => 1,
        Some(2) => 3,
        Some(_) => 7,
    };
    let (mut values, _) = values.as_chunks::<2>();
    let mut points = [Vector3::zeros(); 7];
    for (axis, (code, unit)) in codes.iter().zip(units.iter_mut()).enumerate() {
        let (own, later) = values.split_at(value_count(*code).min(values.len()));
        values = later;
        let start = *unit;
        let own = own.iter().map(|pair| i16::from_le_bytes(*pair));
        if let Some(last) = own.clone().next_back() {
            *unit = last;
        }
        let curve = Scalar::new(std::iter::once(start).chain(own).map(|u| to_m(u, scale_mm)));
        // A constant axis must stay exactly constant, which weighted means might not keep.
        let curve = if *code == 0 {
            Scalar::new(std::iter::repeat_n(to_m(start, scale_mm), degree + 1))
        } else {
            curve.elevated(degree)
        };
        for (point, value) in points.iter_mut().zip(&curve.points()[1..]) {
            point[axis] = *value;
        }
    }
    path_through(&points[..degree]).unwrap_or(SegmentPath::Hold)
}

fn events(body: &[u8], offset: usize) -> Result<Vec<Event>, SkybError> {
    let (records, rest) = body.as_chunks::<10>();
    if !rest.is_empty() {
        return Err(SkybError::Truncated {
            offset: offset + body.len() - rest.len(),
            what: "an event",
            needed: 10,
            left: rest.len(),
        });
    }
    let event = |record: &[u8; 10]| {
        let [t0, t1, t2, t3, kind, subtype, payload @ ..] = *record;
        Event { time_ms: u32::from_le_bytes([t0, t1, t2, t3]), kind, subtype, payload }
    };
    Ok(records.iter().map(event).collect())
}
