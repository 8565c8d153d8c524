//! Playing a light program, and explaining it.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Command, Decoder, Rgb, TICK_MS, with_final_set};

/// Commands executed at most when a program is played; endless loops without waiting end there.
const MAX_COMMANDS: usize = 1_000_000;
/// Deepest nesting of loops.
const MAX_LOOPS: usize = 4;

/// A light program in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Explanation {
    /// One line per command: offset and what it does.
    pub lines: Vec<String>,
    /// Faults and surprises of the program, one sentence each.
    pub problems: Vec<String>,
    /// End of the program, ms of show time; `None` if it does not end within a million commands.
    pub ends_ms: Option<u64>,
}

/// Explains a program, at most `max_lines` lines of it.
pub fn explain(bytes: &[u8], max_lines: usize) -> Explanation {
    let mut explanation = Explanation { lines: Vec::new(), problems: Vec::new(), ends_ms: None };
    let (mut count, mut jumps) = (0, false);
    for item in Decoder::new(bytes) {
        match item {
            Ok((offset, command)) => {
                if count < max_lines {
                    explanation.lines.push(format!("{offset:5}  {command}"));
                }
                count += 1;
                jumps |= matches!(command, Command::Jump { .. } | Command::TriggeredJump { .. });
                // What follows the end is never played, unless something jumps there.
                if command == Command::End && !jumps {
                    break;
                }
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
    /// A player at show time 0.
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

    /// Colour at a show time, which must not be before that of the call before.
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
                    self.loops.push((self.decoder.offset(), rounds));
                }
            }
            Command::LoopEnd => match self.loops.last_mut() {
                Some((_, 1)) => {
                    self.loops.pop();
                }
                Some((start, rounds)) => {
                    *rounds = rounds.saturating_sub(1);
                    self.decoder.seek(*start);
                }
                None => {}
            },
            Command::ResetClock => self.clock_zero_ms = self.wake_ms,
            Command::Jump { address } => {
                self.loops.clear();
                self.decoder.seek(usize::try_from(address).unwrap_or(usize::MAX));
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
