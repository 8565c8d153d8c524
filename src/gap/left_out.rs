//! Reasons for leaving a log or a drone out of a comparison, and their sentences.

use std::fmt;

use crate::base::names::together;
use crate::base::said::said_in_files;

/// Reason why a log or a drone is not in a comparison, or only in part. In `verdict.json` it stands as its
/// sentence.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum LeftOut {
    /// Nothing in the drone's log is steady flight of the plan.
    NoSteadyFlight {
        /// Slot of the drone.
        slot: u16,
    },
    /// Too few of the steady bins can be used.
    FewBins {
        /// Slot of the drone.
        slot: u16,
        /// Number of bins that can be used.
        usable: usize,
        /// Number of steady bins.
        bins: usize,
    },
    /// The log is of another flight than nearly all others.
    OtherFlight {
        /// Slot of the drone.
        slot: u16,
    },
    /// The pulse never changes.
    ConstantPulse {
        /// Slot of the drone.
        slot: u16,
        /// Value of the pulse, us.
        pulse_us: f64,
    },
    /// A reason in the words of the log's reader, or as it was read from a file.
    Said(String),
}

said_in_files!(LeftOut);

impl From<String> for LeftOut {
    fn from(text: String) -> Self {
        Self::Said(text)
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSteadyFlight { slot } => {
                write!(f, "slot {slot}: no steady flight of the plan in its log")
            }
            Self::FewBins { slot, usable, bins } => write!(
                f,
                "slot {slot}: only {usable} of {bins} steady bins are usable (gaps in the log, motors at \
                 a limit, carried away by the wind, or another flight)"
            ),
            Self::OtherFlight { slot } => {
                write!(f, "slot {slot}: its log is of another flight than nearly all others")
            }
            Self::ConstantPulse { slot, pulse_us } => write!(
                f,
                "slot {slot}: its pulse is {pulse_us:.0} us in the whole flight: no rotor flies so"
            ),
            Self::Said(text) => f.write_str(text),
        }
    }
}

/// These reasons, one line for each; slots with the same reason share one: `slots 1-12, 14 and 16: no steady flight ...`.
pub fn said_together(reasons: &[LeftOut]) -> Vec<String> {
    let lines: Vec<String> = reasons.iter().map(ToString::to_string).collect();
    together("slot", lines.iter().map(String::as_str))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_with_one_reason_are_one_line() {
        let mut reasons: Vec<_> =
            (1..=12).chain([16, 14]).map(|slot| LeftOut::NoSteadyFlight { slot }).collect();
        reasons.insert(3, LeftOut::ConstantPulse { slot: 13, pulse_us: 1500.0 });
        reasons.push(LeftOut::Said("x.BIN: empty".to_owned()));
        assert_eq!(
            said_together(&reasons),
            [
                "slots 1-12, 14 and 16: no steady flight of the plan in its log",
                "slot 13: its pulse is 1500 us in the whole flight: no rotor flies so",
                "x.BIN: empty",
            ]
        );
    }
}
