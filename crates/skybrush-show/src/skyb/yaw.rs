//! The yaw control block: `flags u8 | offset i16 | { duration u16 ms, delta i16 }*`, in 0.1 degrees.

use super::SkybError;
use crate::YawControl;

/// Longest entry we write, ms.
const LONGEST_MS: u64 = 60_000;
/// Latest setpoint we write, s: a day.
const LATEST_S: f64 = 86_400.0;

/// The block's body. The first setpoint's angle goes into the offset; each entry's end is rounded on
/// its own, so that rounding does not add up.
pub(crate) fn encode(program: &YawControl) -> Result<Vec<u8>, SkybError> {
    let mut body = vec![u8::from(program.auto)];
    let first_deg = program.setpoints.first().map_or(0.0, |(_, angle_deg)| *angle_deg);
    let tenths = |angle_deg: f64| (angle_deg * 10.0).round();
    let fail = |setpoint, problem| SkybError::Yaw { setpoint, problem };
    let start = tenths(program.offset_deg + first_deg);
    if !start.is_finite() || start.abs() > f64::from(i16::MAX) {
        return Err(fail(1, "the first angle is not within ±3276.7 degrees"));
    }
    body.extend((start as i16).to_le_bytes());

    let (mut at_ms, mut at_angle) = (0_u64, start as i64);
    for (i, (time_s, angle_deg)) in program.setpoints.iter().enumerate() {
        let angle = tenths(program.offset_deg + angle_deg);
        if !angle.is_finite() || angle.abs() > 1e9 {
            return Err(fail(i + 1, "the angle is not a sensible number"));
        }
        if !(0.0..=LATEST_S).contains(time_s) {
            return Err(fail(i + 1, "the time is not between 0 and 86400 s"));
        }
        let end_ms = (time_s * 1000.0).round() as u64;
        if i == 0 && end_ms == 0 {
            continue;
        }
        if end_ms <= at_ms {
            return Err(fail(i + 1, "time stands still or goes back"));
        }
        let (lasts_ms, turn) = (end_ms - at_ms, angle as i64 - at_angle);
        let parts = lasts_ms
            .div_ceil(LONGEST_MS)
            .max(turn.unsigned_abs().div_ceil(i16::MAX.unsigned_abs().into()));
        if parts > lasts_ms {
            return Err(fail(i + 1, "the turn is too fast for the format"));
        }
        let share = |total: i64, part: u64| total * part as i64 / parts as i64;
        for part in 0..parts {
            let duration = share(lasts_ms as i64, part + 1) - share(lasts_ms as i64, part);
            let delta = share(turn, part + 1) - share(turn, part);
            body.extend((duration as u16).to_le_bytes());
            body.extend((delta as i16).to_le_bytes());
        }
        (at_ms, at_angle) = (end_ms, angle as i64);
    }
    Ok(body)
}

/// The program in a block's body; `offset` is where the body starts in the file.
pub(crate) fn decode(body: &[u8], offset: usize) -> Result<YawControl, SkybError> {
    let [flags, low, high, entries @ ..] = body else {
        let (what, needed, left) = ("the yaw control header", 3, body.len());
        return Err(SkybError::Truncated { offset, what, needed, left });
    };
    let (entries, rest) = entries.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(SkybError::Truncated {
            offset: offset + body.len() - rest.len(),
            what: "a yaw control entry",
            needed: 4,
            left: rest.len(),
        });
    }
    let mut program = YawControl {
        auto: flags & 1 != 0,
        offset_deg: f64::from(i16::from_le_bytes([*low, *high])) / 10.0,
        setpoints: Vec::with_capacity(entries.len() + 1),
    };
    if !entries.is_empty() {
        program.setpoints.push((0.0, 0.0));
    }
    let (mut at_ms, mut angle) = (0_u32, 0_i32);
    for [d0, d1, a0, a1] in entries {
        at_ms += u32::from(u16::from_le_bytes([*d0, *d1]));
        angle += i32::from(i16::from_le_bytes([*a0, *a1]));
        program.setpoints.push((f64::from(at_ms) / 1000.0, f64::from(angle) / 10.0));
    }
    Ok(program)
}
