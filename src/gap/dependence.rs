//! Dependences: the quantities that a residual may depend on.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::effects::{Signal, find};

/// Quantity along which a residual is held apart, or on which a free shape depends.
///
/// Files have the names of [`Dependence::name`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dependence {
    /// Vertical air speed, m/s.
    #[default]
    Climb,
    /// Height above ground, m.
    Height,
    /// Time since the motors started, s.
    Time,
    /// Horizontal air speed, m/s.
    Wind,
    /// Lean into the wind, degrees.
    Lean,
    /// Charge of the battery by its voltage at rest, share.
    Voltage,
    /// Drones next to one in the array.
    Place,
    /// Slot of a drone.
    Drone,
    /// Direction of the oncoming air against the nose.
    Heading,
    /// Instant from which the residual is another.
    Step,
    /// Product of vertical air speed and time.
    ClimbTime,
    /// Product of vertical air speed and height.
    ClimbHeight,
}

impl Dependence {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Climb => "climb",
            Self::Height => "height",
            Self::Time => "time",
            Self::Wind => "wind",
            Self::Lean => "lean",
            Self::Voltage => "voltage",
            Self::Place => "place",
            Self::Drone => "drone",
            Self::Heading => "heading",
            Self::Step => "step",
            Self::ClimbTime => "climb-time",
            Self::ClimbHeight => "climb-height",
        }
    }

    /// Dependence of a name in files; `None` for another word.
    pub fn of(name: &str) -> Option<Self> {
        ALL.into_iter().find(|one| one.name() == name)
    }

    /// Whether an effect that depends on a signal may depend on this.
    pub(super) fn is_of(self, signal: Signal) -> bool {
        match self {
            Self::Climb => signal == Signal::Climb,
            Self::ClimbTime => matches!(signal, Signal::Climb | Signal::Time),
            Self::ClimbHeight => {
                matches!(signal, Signal::Climb | Signal::Height | Signal::Density)
            }
            Self::Height => matches!(signal, Signal::Height | Signal::Density),
            Self::Time | Self::Step => matches!(signal, Signal::Time | Signal::ChargeUsed),
            Self::Wind | Self::Lean | Self::Heading => {
                matches!(signal, Signal::Horizontal | Signal::Tilt)
            }
            Self::Voltage => signal == Signal::ChargeUsed,
            Self::Place => signal == Signal::Neighbours,
            Self::Drone => signal == Signal::Drone,
        }
    }

    /// Whether an effect may show in this: by a signal of its own or, if it has none, by what the model says of the climb.
    pub(super) fn may_show(self, effect: &str) -> bool {
        let signals = signals_of(effect);
        let has_own = signals.iter().any(|signal| self.is_of(*signal));
        has_own || matches!(signals, [Signal::ModelIncrement]) && self.is_of(Signal::Climb)
    }

    /// Whether it is how the air meets a drone.
    pub(super) fn is_of_air(self) -> bool {
        matches!(self, Self::Climb | Self::Wind | Self::Lean | Self::Heading)
    }

    /// Whether drones are held apart, not moments of a flight.
    pub fn is_of_drones(self) -> bool {
        matches!(self, Self::Place | Self::Drone)
    }
}

/// Signals that an effect of the library depends on.
pub(super) fn signals_of(effect: &str) -> &'static [Signal] {
    find(effect).map_or(&[], |effect| effect.definition().signals)
}

/// The signal that an effect feels by one of its own: the model's increments are those of climb.
fn felt_as(signal: Signal) -> Signal {
    if signal == Signal::ModelIncrement { Signal::Climb } else { signal }
}

/// Whether an effect depends on nothing but how the air meets a drone.
pub(super) fn is_of_air(effect: &str) -> bool {
    let is = |signal: &Signal| {
        matches!(felt_as(*signal), Signal::Climb | Signal::Horizontal | Signal::Tilt)
    };
    let signals = signals_of(effect);
    !signals.is_empty() && signals.iter().all(is)
}

/// Whether an effect depends on the climb.
pub(super) fn depends_on_climb(effect: &str) -> bool {
    signals_of(effect).iter().any(|signal| felt_as(*signal) == Signal::Climb)
}

/// Whether two effects depend on a common signal.
pub(super) fn depend_on_the_same(one: &str, other: &str) -> bool {
    let is_shared =
        |signal: &Signal| signals_of(other).iter().any(|one| felt_as(*one) == felt_as(*signal));
    signals_of(one).iter().any(is_shared)
}

/// Whether an effect depends on nothing that another does not depend on as well; a drone tilts as it meets the wind.
pub(super) fn depends_on_no_more(one: &str, than: &str) -> bool {
    let of = |signal: Signal| match felt_as(signal) {
        Signal::Tilt => Signal::Horizontal,
        signal => signal,
    };
    let is_shared =
        |signal: &Signal| signals_of(than).iter().any(|other| of(*other) == of(*signal));
    signals_of(one).iter().all(is_shared)
}

const ALL: [Dependence; 12] = [
    Dependence::Climb,
    Dependence::Height,
    Dependence::Time,
    Dependence::Wind,
    Dependence::Lean,
    Dependence::Voltage,
    Dependence::Place,
    Dependence::Drone,
    Dependence::Heading,
    Dependence::Step,
    Dependence::ClimbTime,
    Dependence::ClimbHeight,
];

impl fmt::Display for Dependence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_the_names() {
        for one in ALL {
            assert_eq!(serde_json::to_value(one).unwrap(), one.name());
            assert_eq!(Dependence::of(one.name()), Some(one));
        }
        assert_eq!(Dependence::of("Climb"), None);
    }
}
