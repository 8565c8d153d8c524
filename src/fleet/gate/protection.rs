//! Protection of a drone that works without the station: its fence and its failsafes.

use crate::fleet::fence::FENCE_TYPE;
use crate::fleet::messages::chars;
use crate::fleet::required::{Wanted, requirements};
use crate::link::frame::MavMessage;
use crate::mission::Plan;

/// Parameters of fences and failsafes begin so.
const GUARDS: [&str; 4] = ["FENCE_", "FS_", "BATT_FS_", "SHOW_HFENCE_"];
/// Lowest top of a fence that ArduPilot accepts, m.
const LEAST_TOP_M: f64 = 10.0;

/// Fence and failsafes that the flight of a plan needs; weaker ones are refused.
#[derive(Clone, Debug)]
pub struct Protection {
    wanted: Vec<(&'static str, Wanted)>,
}

impl Protection {
    /// Protection that a plan asks for.
    pub fn of(plan: &Plan) -> Self {
        let top_m = plan.fence.max_altitude_m.max(LEAST_TOP_M);
        let mut wanted = vec![
            ("FENCE_ALT_MAX", Wanted::AtMost(top_m as f32)),
            ("FENCE_ACTION", Wanted::AtLeast(1.0)),
            ("FENCE_TYPE", Wanted::HasBits(FENCE_TYPE as u32)),
        ];
        // What the show mode needs and what stock firmware does.
        for requirement in [true, false].into_iter().flat_map(|show| requirements(plan, show)) {
            wanted.push((requirement.name, requirement.wanted));
        }
        Self { wanted }
    }

    /// Whether a value of a parameter protects less than the plan needs, or its effect is unknown.
    pub fn is_weakened_by(&self, name: &str, value: f32) -> bool {
        let mut known = self.wanted.iter().filter(|(of, _)| *of == name).peekable();
        GUARDS.iter().any(|start| name.starts_with(start))
            && (known.peek().is_none() || !known.all(|(_, wanted)| wanted.holds(value)))
    }

    /// Whether a message does so.
    pub(super) fn is_weakened(&self, message: &MavMessage) -> bool {
        match message {
            MavMessage::PARAM_SET(set) => {
                self.is_weakened_by(&chars(&set.param_id[..]), set.param_value)
            }
            // Fewer corners than a polygon has.
            MavMessage::MISSION_COUNT(mission) => mission.count < 3,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frame::dialect;
    use crate::mission::resolve::resolve;

    #[test]
    fn a_fence_of_less_than_three_corners_is_none() {
        let plan = resolve("calibration", &[]).unwrap().flights.remove(0).plan;
        let weakened = [0, 2, 3, 4].map(|count| {
            let fence = dialect::MISSION_COUNT_DATA { count, ..Default::default() };
            Protection::of(&plan).is_weakened(&MavMessage::MISSION_COUNT(fence))
        });
        assert_eq!(weakened, [true, true, false, false]);
    }
}
