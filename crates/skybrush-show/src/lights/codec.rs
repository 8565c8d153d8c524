//! Bytecode to commands and back.

use super::{Command, LightError, LightStep, MAX_TICKS, Rgb, TICK_MS};

/// A program in bytecode. Step boundaries are rounded to ticks from the start, so that rounding does
/// not add up. Ends with END; when the last step fades, its colour is set for one more tick, because
/// the JavaScript player extrapolates a final fade.
///
/// ```
/// use skybrush_show::lights::{LightStep, encode};
/// let green = LightStep { duration_ms: 72_000, color: [0, 255, 0], fade: false };
/// let dim = LightStep { duration_ms: 1_000, color: [0, 0, 0], fade: true };
/// let program = encode(&[green, dim]);
/// assert_eq!(program, [4, 0, 255, 0, 0x90, 0x1c, 0x0a, 0x32, 6, 1, 0]);
/// ```
pub fn encode(steps: &[LightStep]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(steps.len() * 6 + 4);
    let mut at_ms = 0_u64;
    let ticks_at = |ms: u64| (ms + TICK_MS / 2) / TICK_MS;
    for step in steps {
        let end_ms = at_ms + u64::from(step.duration_ms);
        push_color(&mut bytes, step.color, step.fade, ticks_at(end_ms) - ticks_at(at_ms));
        at_ms = end_ms;
    }
    if let Some(last) = steps.last().filter(|step| step.fade) {
        push_color(&mut bytes, last.color, false, 1);
    }
    bytes.push(0);
    bytes
}

fn push_color(bytes: &mut Vec<u8>, color: Rgb, fade: bool, ticks: u64) {
    let base = if fade { 0x08 } else { 0x04 };
    match color {
        [0, 0, 0] => bytes.push(base + 2),
        [255, 255, 255] => bytes.push(base + 3),
        [gray, g, b] if gray == g && g == b => bytes.extend([base + 1, gray]),
        [r, g, b] => bytes.extend([base, r, g, b]),
    }
    let mut rest = ticks;
    loop {
        let low = (rest & 0x7f) as u8;
        rest >>= 7;
        if rest == 0 {
            bytes.push(low);
            return;
        }
        bytes.push(low | 0x80);
    }
}

/// The program with a final SET of non-zero duration, as the JavaScript player needs it: when the
/// last command is a fade, or a set without duration, its colour is set for one more tick. Programs
/// that end otherwise, or are broken, stay as they are.
pub fn with_final_set(bytes: &[u8]) -> Vec<u8> {
    let mut last = None;
    let mut end = 0;
    for item in Decoder::new(bytes) {
        match item {
            Ok((offset, Command::End)) => {
                end = offset;
                break;
            }
            Ok((_, Command::Nop)) => {}
            Ok((_, command)) => last = Some(command),
            Err(_) => return bytes.to_vec(),
        }
        end = bytes.len();
    }
    let Some(Command::Fade { color, .. } | Command::Set { color, ticks: 0 }) = last else {
        return bytes.to_vec();
    };
    let mut fixed = bytes[..end].to_vec();
    push_color(&mut fixed, color, false, 1);
    fixed.push(0);
    fixed
}

/// The commands with their offsets, in the order of the bytes, up to the first broken one.
///
/// # Errors
///
/// Tells where the bytecode is broken. [`Decoder`] gives the commands before that.
pub fn decode(bytes: &[u8]) -> Result<Vec<(usize, Command)>, LightError> {
    Decoder::new(bytes).collect()
}

/// Iterates over the commands of a program; stops after the first broken one.
#[derive(Clone, Debug)]
pub struct Decoder<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Decoder<'a> {
    /// A decoder at the start of a program.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Offset of the next command.
    pub(super) fn offset(&self) -> usize {
        self.at
    }

    /// Goes on at another offset.
    pub(super) fn seek(&mut self, offset: usize) {
        self.at = offset;
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        Some(u64::MAX)
    }

    fn color(&mut self, code: u8) -> Option<Rgb> {
        Some(match code & 3 {
            0 => [self.byte()?, self.byte()?, self.byte()?],
            1 => [self.byte()?; 3],
            2 => [0; 3],
            _ => [255; 3],
        })
    }

    /// The command whose code has just been read; `None` when it is cut off.
    fn arguments(&mut self, code: u8) -> Option<Command> {
        Some(match code {
            0x01 => Command::Nop,
            0x02 => Command::Sleep { ticks: self.varint()? },
            0x03 => Command::WaitUntil { ticks: self.varint()? },
            0x04..=0x07 => Command::Set { color: self.color(code)?, ticks: self.varint()? },
            0x08..=0x0b => Command::Fade { color: self.color(code)?, ticks: self.varint()? },
            0x0c => Command::LoopBegin { rounds: self.byte()? },
            0x0d => Command::LoopEnd,
            0x0e => Command::ResetClock,
            0x10 | 0x11 => Command::FromChannels {
                channels: [self.byte()?, self.byte()?, self.byte()?],
                fade: code == 0x11,
                ticks: self.varint()?,
            },
            0x12 => Command::Jump { address: self.varint()? },
            0x13 => {
                let params = self.byte()?;
                let address = if params & 0x30 == 0 { None } else { Some(self.varint()?) };
                Command::TriggeredJump { params, address }
            }
            0x14 => Command::SetPyro { mask: self.byte()? },
            0x15 => Command::SetPyroAll { mask: self.byte()? },
            _ => Command::End,
        })
    }
}

impl Iterator for Decoder<'_> {
    type Item = Result<(usize, Command), LightError>;

    fn next(&mut self) -> Option<Self::Item> {
        let offset = self.at;
        let code = self.byte()?;
        let known = matches!(code, 0x00..=0x0e | 0x10..=0x15);
        let item = if known { self.arguments(code) } else { None };
        let error = match item {
            Some(command) if command.largest() <= MAX_TICKS => return Some(Ok((offset, command))),
            Some(_) => LightError::TooLong { offset },
            None if known => LightError::CutOff { offset },
            None => LightError::UnknownCommand { offset, code },
        };
        self.at = self.bytes.len();
        Some(Err(error))
    }
}
