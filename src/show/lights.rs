//! Light programs: the bytecode that Skybrush's LED player runs.
//!
//! Commands change the colour at once (SET) or linearly (FADE) and then wait; durations count ticks
//! of 20 ms. The end of the buffer or an unknown command ends the program, and the last colour stays
//! on. Before the first command the light is black.

use std::fmt;

use serde::Serialize;
use thiserror::Error;

/// One tick, ms.
pub const TICK_MS: u64 = 20;
/// Commands executed at most when a program is played; endless loops without waiting end there.
const MAX_COMMANDS: usize = 1_000_000;
/// Deepest nesting of loops.
const MAX_LOOPS: usize = 4;
/// Highest number of ticks of one command: about ten days, far beyond any show, far below overflow.
const MAX_TICKS: u64 = 1 << 32;

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// One step of a simple program, for [`encode`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightStep {
    /// How long it takes, ms.
    pub duration_ms: u32,
    /// The colour it shows or ends in.
    pub color: Rgb,
    /// Fades from the colour before instead of switching at once.
    pub fade: bool,
}

/// One command, as [`decode`] finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Ends the program.
    End,
    /// Does nothing.
    Nop,
    /// Waits.
    Sleep {
        /// Ticks.
        ticks: u64,
    },
    /// Waits until ticks after the start, or the last clock reset.
    WaitUntil {
        /// Ticks.
        ticks: u64,
    },
    /// Shows a colour, then waits.
    Set {
        /// The colour.
        color: Rgb,
        /// Ticks to wait.
        ticks: u64,
    },
    /// Fades to a colour.
    Fade {
        /// The colour.
        color: Rgb,
        /// Ticks it takes.
        ticks: u64,
    },
    /// Begins a loop.
    LoopBegin {
        /// Rounds; 0 is without end.
        rounds: u8,
    },
    /// Ends a loop.
    LoopEnd,
    /// Sets the clock that [`Command::WaitUntil`] looks at to 0.
    ResetClock,
    /// Shows the values of three RC channels (black here), or fades to them.
    FromChannels {
        /// The channels.
        channels: [u8; 3],
        /// Fades.
        fade: bool,
        /// Ticks.
        ticks: u64,
    },
    /// Goes on elsewhere.
    Jump {
        /// Offset in the program.
        address: u64,
    },
    /// Goes on elsewhere when an RC channel changes (never, here).
    TriggeredJump {
        /// Parameter byte.
        params: u8,
        /// Offset in the program, if any.
        address: Option<u64>,
    },
    /// Switches some pyro channels.
    SetPyro {
        /// Bit 7: on; other bits: which.
        mask: u8,
    },
    /// Switches all pyro channels.
    SetPyroAll {
        /// Which are on.
        mask: u8,
    },
}

/// Why a program cannot be written or understood.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LightError {
    /// A command that does not exist; players end the program there.
    #[error("byte {offset}: {code:#04x} is no light command; the program ends there")]
    UnknownCommand {
        /// Where.
        offset: usize,
        /// The byte.
        code: u8,
    },
    /// The program ends within a command.
    #[error("byte {offset}: the last command is cut off")]
    CutOff {
        /// Where the command starts.
        offset: usize,
    },
    /// A duration or address that does not fit.
    #[error("byte {offset}: a duration or address is absurdly long")]
    TooLong {
        /// Where the command starts.
        offset: usize,
    },
}

/// A program in bytecode. Step boundaries are rounded to ticks from the start, so that rounding does
/// not add up. Ends with END; when the last step fades, its colour is set for one more tick, because
/// the JavaScript player extrapolates a final fade.
///
/// ```
/// use updraft::show::lights::{LightStep, encode};
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
    let color = match last {
        Some(Command::Fade { color, .. } | Command::Set { color, ticks: 0 }) => color,
        _ => return bytes.to_vec(),
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
    /// At the start of a program.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
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

impl Command {
    /// Its duration, time or address, whichever it has.
    fn largest(self) -> u64 {
        match self {
            Self::Sleep { ticks }
            | Self::WaitUntil { ticks }
            | Self::Set { ticks, .. }
            | Self::Fade { ticks, .. }
            | Self::FromChannels { ticks, .. } => ticks,
            Self::Jump { address } | Self::TriggeredJump { address: Some(address), .. } => address,
            _ => 0,
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hex = |[r, g, b]: Rgb| format!("#{r:02x}{g:02x}{b:02x}");
        let s = |ticks: u64| format!("{:.2} s", ticks as f64 * TICK_MS as f64 / 1000.0);
        match *self {
            Self::End => write!(f, "end"),
            Self::Nop => write!(f, "nothing"),
            Self::Sleep { ticks } => write!(f, "wait {}", s(ticks)),
            Self::WaitUntil { ticks } => write!(f, "wait until {}", s(ticks)),
            Self::Set { color, ticks } => write!(f, "set {} for {}", hex(color), s(ticks)),
            Self::Fade { color, ticks } => write!(f, "fade to {} in {}", hex(color), s(ticks)),
            Self::LoopBegin { rounds: 0 } => write!(f, "repeat for ever"),
            Self::LoopBegin { rounds } => write!(f, "repeat {rounds} times"),
            Self::LoopEnd => write!(f, "end of repeat"),
            Self::ResetClock => write!(f, "reset the clock"),
            Self::FromChannels { channels, fade, ticks } => {
                let verb = if fade { "fade to" } else { "set" };
                write!(f, "{verb} the values of RC channels {channels:?} for {}", s(ticks))
            }
            Self::Jump { address } => write!(f, "jump to byte {address}"),
            Self::TriggeredJump { params, address: Some(address) } => {
                write!(f, "jump to byte {address} on a trigger of RC channel {}", params & 15)
            }
            Self::TriggeredJump { params, address: None } => {
                write!(f, "no more jumps on RC channel {}", params & 15)
            }
            Self::SetPyro { mask } => {
                let verb = if mask & 0x80 == 0 { "off" } else { "on" };
                write!(f, "pyro channels {:#09b} {verb}", mask & 0x7f)
            }
            Self::SetPyroAll { mask } => {
                write!(f, "pyro channels {:#09b} on, others off", mask & 0x7f)
            }
        }
    }
}

/// What a light program does, for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Explanation {
    /// One line per command: offset and what it does.
    pub lines: Vec<String>,
    /// What is wrong or surprising with it.
    pub problems: Vec<String>,
    /// When the program ends, ms of show time; `None`: never, or not within a million commands.
    pub ends_ms: Option<u64>,
}

/// Explains a program, at most `max_lines` lines of it.
pub fn explain(bytes: &[u8], max_lines: usize) -> Explanation {
    let mut explanation = Explanation { lines: Vec::new(), problems: Vec::new(), ends_ms: None };
    let mut count = 0;
    for item in Decoder::new(bytes) {
        match item {
            Ok((offset, command)) => {
                if count < max_lines {
                    explanation.lines.push(format!("{offset:5}  {command}"));
                }
                count += 1;
            }
            Err(error) => explanation.problems.push(error.to_string()),
        }
    }
    if count > max_lines {
        explanation.lines.push(format!("       and {} more commands", count - max_lines));
    }
    if with_final_set(bytes) != bytes {
        explanation.problems.push(
            "ends in a fade or in a set without duration: the JavaScript player (Live, Viewer) \
             shows wrong colours after it"
                .to_owned(),
        );
    }
    let mut player = Player::new(bytes);
    player.run_until(u64::MAX);
    if player.ended {
        explanation.ends_ms = Some(player.wake_ms);
    } else {
        explanation.problems.push("does not end by itself".to_owned());
    }
    explanation
}

/// Colour at a show time, as the C player shows it. For many times in ascending order use a
/// [`Player`].
pub fn color_at(bytes: &[u8], time_ms: u64) -> Rgb {
    Player::new(bytes).color_at(time_ms)
}

/// Plays a program forward in time.
#[derive(Clone, Debug)]
pub struct Player<'a> {
    decoder: Decoder<'a>,
    /// Colour that the command in force starts from and ends in.
    from: Rgb,
    to: Rgb,
    fade_ms: Option<(u64, u64)>,
    wake_ms: u64,
    clock_zero_ms: u64,
    loops: Vec<(usize, u8)>,
    commands: usize,
    ended: bool,
}

impl<'a> Player<'a> {
    /// At show time 0.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            decoder: Decoder::new(bytes),
            from: [0; 3],
            to: [0; 3],
            fade_ms: None,
            wake_ms: 0,
            clock_zero_ms: 0,
            loops: Vec::new(),
            commands: 0,
            ended: false,
        }
    }

    /// Colour at a time that is not before the one asked for last.
    pub fn color_at(&mut self, time_ms: u64) -> Rgb {
        self.run_until(time_ms);
        let Some((start_ms, end_ms)) = self.fade_ms else { return self.to };
        if time_ms >= end_ms || end_ms <= start_ms {
            return self.to;
        }
        let share = time_ms.saturating_sub(start_ms) as f64 / (end_ms - start_ms) as f64;
        let mut color = self.from;
        for (value, to) in color.iter_mut().zip(self.to) {
            let from = f64::from(*value);
            *value = (from + (f64::from(to) - from) * share).round() as u8;
        }
        color
    }

    fn run_until(&mut self, time_ms: u64) {
        while !self.ended && self.wake_ms <= time_ms && self.commands < MAX_COMMANDS {
            self.commands += 1;
            match self.decoder.next() {
                Some(Ok((_, command))) => self.execute(command),
                Some(Err(_)) | None => self.ended = true,
            }
        }
    }

    fn execute(&mut self, command: Command) {
        match command {
            Command::End => self.ended = true,
            Command::Nop
            | Command::TriggeredJump { .. }
            | Command::SetPyro { .. }
            | Command::SetPyroAll { .. } => {}
            Command::Sleep { ticks } => self.wait(ticks),
            Command::WaitUntil { ticks } => {
                let until_ms = self.clock_zero_ms.saturating_add(ticks * TICK_MS);
                self.wake_ms = self.wake_ms.max(until_ms);
            }
            Command::Set { color, ticks } => self.show(color, false, ticks),
            Command::Fade { color, ticks } => self.show(color, true, ticks),
            // Without an RC receiver the player shows black.
            Command::FromChannels { fade, ticks, .. } => self.show([0; 3], fade, ticks),
            Command::LoopBegin { rounds } => {
                // A fifth level is ignored by the player as well.
                if self.loops.len() < MAX_LOOPS {
                    self.loops.push((self.decoder.at, rounds));
                }
            }
            Command::LoopEnd => match self.loops.last_mut() {
                Some((_, 1)) => {
                    self.loops.pop();
                }
                Some((start, rounds)) => {
                    *rounds = rounds.saturating_sub(1);
                    self.decoder.at = *start;
                }
                None => {}
            },
            Command::ResetClock => self.clock_zero_ms = self.wake_ms,
            Command::Jump { address } => {
                self.loops.clear();
                self.decoder.at = usize::try_from(address).unwrap_or(usize::MAX);
            }
        }
    }

    fn show(&mut self, color: Rgb, fade: bool, ticks: u64) {
        self.from = if fade { self.to } else { color };
        self.to = color;
        let start_ms = self.wake_ms;
        self.wait(ticks);
        self.fade_ms = fade.then_some((start_ms, self.wake_ms));
    }

    fn wait(&mut self, ticks: u64) {
        self.wake_ms = self.wake_ms.saturating_add(ticks * TICK_MS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const EXAMPLE: [u8; 11] = [0x04, 0, 0xff, 0, 0x90, 0x1c, 0x0a, 0x32, 0x06, 0x01, 0x00];

    #[test]
    fn plays_the_worked_example() {
        assert_eq!(color_at(&EXAMPLE, 0), [0, 255, 0]);
        assert_eq!(color_at(&EXAMPLE, 71_999), [0, 255, 0]);
        assert_eq!(color_at(&EXAMPLE, 72_500), [0, 128, 0]);
        assert_eq!(color_at(&EXAMPLE, 80_000), [0, 0, 0]);
    }

    #[test]
    fn explains_in_words() {
        let explanation = explain(&[&EXAMPLE[..8], &[0x0c, 0, 0x0d]].concat(), 10);
        assert_eq!(
            explanation.lines,
            [
                "    0  set #00ff00 for 72.00 s",
                "    6  fade to #000000 in 1.00 s",
                "    8  repeat for ever",
                "   10  end of repeat"
            ]
        );
        assert_eq!(explanation.problems, ["does not end by itself"]);
        assert_eq!(explain(&EXAMPLE, 1).ends_ms, Some(73_020));
        assert_eq!(explain(&EXAMPLE, 1).lines[1], "       and 3 more commands");
        assert!(explain(&EXAMPLE, 1).problems.is_empty());
    }

    #[test]
    fn repeats_loops_and_waits_on_the_clock() {
        // Twice (white 20 ms, black 20 ms), then wait until 1 s, then gray.
        let program = [0x0c, 2, 7, 1, 6, 1, 0x0d, 3, 50, 5, 9, 1, 0];
        let colors: Vec<u8> =
            [0, 20, 40, 60, 80, 999, 1000, 2000].map(|t| color_at(&program, t)[0]).to_vec();
        assert_eq!(colors, [255, 0, 255, 0, 0, 0, 9, 9]);
        assert_eq!(explain(&program, 9).ends_ms, Some(1020));
    }

    #[test]
    fn says_where_a_program_is_broken() {
        let text = |bytes: &[u8]| decode(bytes).unwrap_err().to_string();
        assert_eq!(text(&[1, 0x0f]), "byte 1: 0x0f is no light command; the program ends there");
        assert_eq!(text(&[1, 4, 1, 2]), "byte 1: the last command is cut off");
        assert_eq!(text(&[2, 0x80, 0x80]), "byte 0: the last command is cut off");
        let long = [2, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255];
        assert_eq!(text(&long), "byte 0: a duration or address is absurdly long");
    }

    #[test]
    fn a_final_fade_gets_a_set() {
        assert_eq!(with_final_set(&EXAMPLE), EXAMPLE);
        assert_eq!(with_final_set(&EXAMPLE[..8]), EXAMPLE);
        assert_eq!(with_final_set(&[8, 1, 2, 3, 9, 0]), [8, 1, 2, 3, 9, 4, 1, 2, 3, 1, 0]);
        assert_eq!(with_final_set(&[7, 0, 0]), [7, 0, 7, 1, 0]);
        assert!(with_final_set(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn any_program_can_be_played(bytes in prop::collection::vec(0_u8..0x20, 0..60)) {
            let _ = explain(&bytes, 5);
            let mut player = Player::new(&bytes);
            for time_ms in [0, 7, 1000, 100_000] {
                prop_assert_eq!(player.color_at(time_ms), color_at(&bytes, time_ms));
            }
        }

        #[test]
        fn steps_are_played_as_they_were_meant(
            steps in prop::collection::vec((1_u32..100_000, any::<Rgb>(), any::<bool>()), 1..20),
        ) {
            let steps: Vec<LightStep> = steps
                .into_iter()
                .map(|(duration_ms, color, fade)| LightStep { duration_ms: duration_ms + 20, color, fade })
                .collect();
            let program = encode(&steps);
            prop_assert!(decode(&program).is_ok());
            let mut end_ms = 0;
            for step in &steps {
                end_ms += u64::from(step.duration_ms);
                // A set shows its colour in its middle, a fade at its end (both are on ticks).
                let when = if step.fade { end_ms.div_ceil(20) * 20 } else { end_ms - 11 };
                if !step.fade {
                    prop_assert_eq!(color_at(&program, when), step.color);
                }
            }
            prop_assert_eq!(color_at(&program, end_ms + 100), steps.last().unwrap().color);
        }
    }
}
