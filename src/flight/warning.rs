//! Doubts about a log, and losses in it.

use std::fmt;

use crate::base::sentence::Sentence;
use crate::log::ScanStats;

/// Loss of a part of a flight or of its log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// The log ends before its flight does.
    CutOff {
        /// How high the vehicle was then, m above the ground.
        height_m: f64,
    },
    /// The reader skipped damage inside of the log. That it ends within a message is how logs end whose
    /// drone was switched off.
    Damage {
        /// Bytes that were skipped.
        bytes: u64,
        /// Message heads of unknown types.
        unknown: u64,
        /// Jumps of the board time.
        time_jumps: u64,
    },
}

impl Loss {
    /// Damage that the reader skipped, if there was any.
    pub(super) fn of(scan: &ScanStats) -> Option<Self> {
        (scan.bad_bytes > 0).then_some(Self::Damage {
            bytes: scan.bad_bytes,
            unknown: scan.unknown,
            time_jumps: scan.time_jumps,
        })
    }

    /// The loss in one phrase.
    pub fn sentence(&self) -> Sentence {
        match *self {
            Self::CutOff { height_m } => Sentence::from("the log ends in the air, ")
                .number(height_m, &format!("{height_m:.1}"))
                .words(" m above the ground; what it holds is analysed"),
            Self::Damage { bytes, unknown, time_jumps } => {
                let counted = [
                    (unknown, "message heads of unknown types"),
                    (time_jumps, "jumps of the board time"),
                ];
                let seen: Vec<String> = (counted.iter().filter(|(count, _)| *count > 0))
                    .map(|(count, what)| format!("{count} {what}"))
                    .collect();
                let seen =
                    if seen.is_empty() { String::new() } else { format!(" ({})", seen.join(", ")) };
                format!("{bytes} bytes of the log are damaged and were skipped{seen}").into()
            }
        }
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

/// Doubt about a log, in one sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// A part of the flight or of its log is lost.
    Loss(Loss),
    /// Any other doubt, in words.
    Said(String),
}

impl From<Loss> for Warning {
    fn from(loss: Loss) -> Self {
        Self::Loss(loss)
    }
}

impl From<String> for Warning {
    fn from(text: String) -> Self {
        Self::Said(text)
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Loss(loss) => loss.fmt(f),
            Self::Said(text) => f.write_str(text),
        }
    }
}
