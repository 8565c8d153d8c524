//! The colour that the show manager shows and logs.

use crate::sim::autopilot::Autopilot;
use crate::sim::autopilot::director::Stage;
use crate::sim::autopilot::motors::Spool;
use skybrush_show::lights::{Player, Rgb};

/// Green at the medium brightness of SHOW_PRE_LIGHTS 2.
const GREEN: Rgb = [0, 127, 0];
const DIM_GREEN: Rgb = [0, 64, 0];
const ORANGE: Rgb = [255, 128, 0];
/// Eighths of a second in which a green light is on, the first in the highest bit: before the motors
/// spin, and while they do.
const FLASHES: u8 = 0b1010_0000;
const BLINKS: u8 = 0b1100_1100;
/// The firmware's second of lights begins half a second off the show's.
const SECOND_SHIFT_MS: i64 = 500;

/// The light of one drone.
#[derive(Clone, Debug)]
pub(super) struct Lights<'a> {
    program: Player<'a>,
}

impl<'a> Lights<'a> {
    /// With a light program; an empty one is black.
    pub(super) fn new(program: &'a [u8]) -> Self {
        Self { program: Player::new(program) }
    }

    /// Colour at a show time, ms; times must not go back.
    pub(super) fn color(&mut self, pilot: &Autopilot<'_>, time_ms: i64) -> Rgb {
        match pilot.director.stage {
            Stage::Returning | Stage::Landing => ORANGE,
            Stage::Landed => DIM_GREEN,
            Stage::Wait | Stage::Takeoff | Stage::Performing => u64::try_from(time_ms).map_or_else(
                |_| waiting(pilot.motors.spool, time_ms),
                |time_ms| self.program.color_at(time_ms),
            ),
        }
    }
}

/// Colour before the show's start.
fn waiting(spool: Spool, time_ms: i64) -> Rgb {
    let pattern = if spool == Spool::Stopped { FLASHES } else { BLINKS };
    let eighth = (time_ms + SECOND_SHIFT_MS).rem_euclid(1000) / 125;
    if pattern & (0x80 >> eighth) == 0 { [0; 3] } else { GREEN }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_in_green_as_the_firmware_does() {
        // From the firmware's log of a short flight.
        for (time_ms, spool, on) in [
            (-6_530, Spool::Stopped, false),
            (-6_480, Spool::Stopped, true),
            (-6_370, Spool::Stopped, false),
            (-6_240, Spool::Stopped, true),
            (-5_900, Spool::Stopped, false),
            (-4_990, Spool::Idle, true),
            (-4_740, Spool::Idle, false),
            (-4_490, Spool::Idle, true),
            (-4_240, Spool::Idle, false),
        ] {
            assert_eq!(waiting(spool, time_ms) == GREEN, on, "{time_ms} ms");
        }
    }
}
