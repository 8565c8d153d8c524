//! Ending of a flight for each drone: a drone that never took off has not landed, nor has one that
//! is not heard.

use std::fmt::Write as _;

use super::Crew;
use crate::link::id::DroneId;

/// How a flight has ended for one drone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    /// It was seen in the air, and is on the ground and disarmed.
    Landed,
    /// It has restarted in the air: its motors stand still, and it lies where it fell.
    Fell,
    /// It is on the ground, and was not in the air.
    NeverTookOff,
    /// It is on the ground; whether it was in the air nobody has seen.
    OnGround,
    /// It has not been seen to land: in words why.
    NotSeen(String),
}

impl Ended {
    /// Whether it is on the ground for sure.
    pub(crate) fn is_down(&self) -> bool {
        !matches!(self, Self::NotSeen(_))
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Landed => f.write_str("has landed"),
            Self::Fell => f.write_str("restarted in the air and fell: look for it"),
            Self::NeverTookOff => f.write_str("never took off"),
            Self::OnGround => f.write_str("is on the ground, its flight was not seen"),
            Self::NotSeen(words) => f.write_str(words),
        }
    }
}

impl Crew<'_> {
    /// How the flight has ended for a drone.
    pub(crate) fn ended(&self, drone: DroneId) -> Ended {
        // The show's own status may be behind the heartbeat: the motors decide.
        if !self.net.is_disarmed(drone) {
            Ended::NotSeen(self.net.words(drone))
        } else if self.fell.contains(&drone) {
            Ended::Fell
        } else if self.flew.contains(&drone) {
            Ended::Landed
        } else if self.attached {
            Ended::OnGround
        } else {
            Ended::NeverTookOff
        }
    }

    /// Whether all drones of the table have landed, and the same in words.
    pub(crate) fn ends(&self) -> (bool, String) {
        let all: Vec<_> =
            self.table.drones.iter().map(|line| (line, self.ended(line.drone))).collect();
        let landed = all.iter().filter(|(_, ended)| *ended == Ended::Landed).count();
        let mut text = format!("{landed} of {} drones have landed", all.len());
        for (line, ended) in all.iter().filter(|(_, ended)| *ended != Ended::Landed) {
            let _ = write!(text, "; drone {} (slot {}) {ended}", line.drone, line.slot);
        }
        (landed == all.len(), text)
    }
}
