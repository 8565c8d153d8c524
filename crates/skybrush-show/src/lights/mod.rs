//! Light programs: the bytecode that Skybrush's LED player runs.
//!
//! Commands change the colour at once (SET) or linearly (FADE) and then wait; durations count ticks
//! of 20 ms. The end of the buffer or an unknown command ends the program, and the last colour stays
//! on. Before the first command the light is black.

mod codec;
mod player;

use std::fmt;

use thiserror::Error;

pub use codec::{Decoder, decode, encode, with_final_set};
pub use player::{Explanation, Player, color_at, explain};

/// Duration of one tick, ms: the unit of time in light programs.
pub const TICK_MS: u64 = 20;
/// Highest number of ticks of one command: about ten days, far beyond any show, far below overflow.
const MAX_TICKS: u64 = 1 << 32;

/// A colour as red, green and blue, 0 to 255 each.
pub type Rgb = [u8; 3];

/// One step of a simple program, for [`encode`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightStep {
    /// Duration of the step, ms.
    pub duration_ms: u32,
    /// Colour that the step shows, or in which its fade ends.
    pub color: Rgb,
    /// Whether the colour fades from that of the step before; otherwise it switches at once.
    pub fade: bool,
}

/// One command, as [`decode`] finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// End of the program.
    End,
    /// A command without any effect.
    Nop,
    /// Keeps the present colour for a time.
    Sleep {
        /// Time to wait, ticks of [`TICK_MS`].
        ticks: u64,
    },
    /// Waits until an instant counted from the start, or from the last clock reset.
    WaitUntil {
        /// Instant to wait for, ticks of [`TICK_MS`] since the start or the last clock reset.
        ticks: u64,
    },
    /// Shows a colour, then waits.
    Set {
        /// Colour that is shown from now on.
        color: Rgb,
        /// Time to wait afterwards, ticks of [`TICK_MS`].
        ticks: u64,
    },
    /// Fades to a colour.
    Fade {
        /// Colour in which the fade ends.
        color: Rgb,
        /// Duration of the fade, ticks of [`TICK_MS`].
        ticks: u64,
    },
    /// Start of a loop.
    LoopBegin {
        /// Number of rounds; 0 is without end.
        rounds: u8,
    },
    /// End of the innermost loop.
    LoopEnd,
    /// Sets the clock that [`Command::WaitUntil`] looks at to 0.
    ResetClock,
    /// Shows the values of three RC channels (black here), or fades to them.
    FromChannels {
        /// Numbers of the channels that give red, green and blue.
        channels: [u8; 3],
        /// Whether the colour fades to the channels' values; otherwise it jumps.
        fade: bool,
        /// Duration of the fade, or time to wait, ticks of [`TICK_MS`].
        ticks: u64,
    },
    /// Continues at another place of the program.
    Jump {
        /// Offset of the next command in the program, bytes.
        address: u64,
    },
    /// A jump when an RC channel changes, which never happens here.
    TriggeredJump {
        /// Parameter byte of the trigger, as in the program.
        params: u8,
        /// Offset of the next command in the program, bytes, if the trigger has one.
        address: Option<u64>,
    },
    /// Switches some pyro channels.
    SetPyro {
        /// Channels to switch, one bit each in bits 0 to 6; bit 7 says whether they are switched
        /// on.
        mask: u8,
    },
    /// Switches all pyro channels.
    SetPyroAll {
        /// Channels to switch on, one bit each; a cleared bit switches its channel off.
        mask: u8,
    },
}

/// Error of writing or decoding a light program.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LightError {
    /// A command that does not exist; players end the program there.
    #[error("byte {offset}: {code:#04x} is not a light command; the program ends there")]
    UnknownCommand {
        /// Offset of the command in the program, bytes.
        offset: usize,
        /// The unknown command byte.
        code: u8,
    },
    /// The program ends within a command.
    #[error("byte {offset}: the last command is cut off")]
    CutOff {
        /// Offset of the command in the program, bytes.
        offset: usize,
    },
    /// A duration or address that does not fit.
    #[error("byte {offset}: a duration or address is absurdly long")]
    TooLong {
        /// Offset of the command in the program, bytes.
        offset: usize,
    },
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
        assert_eq!(text(&[1, 0x0f]), "byte 1: 0x0f is not a light command; the program ends there");
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
