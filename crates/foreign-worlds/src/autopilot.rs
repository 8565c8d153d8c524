//! The control loop: position to velocity to acceleration, on command and lean.

use crate::plant::GRAVITY;
use crate::vector::Vector;

/// Vertical velocity per error of height, 1/s.
const HEIGHT_PER_S: f64 = 1.0;
/// Vertical acceleration per error of velocity, 1/s.
const CLIMB_PER_S: f64 = 3.5;
/// The same per integrated error of velocity, 1/s².
const CLIMB_PER_S2: f64 = 2.5;
/// Horizontal velocity per error of position, 1/s.
const PLACE_PER_S: f64 = 0.8;
/// Horizontal acceleration per error of velocity, 1/s.
const SPEED_PER_S: f64 = 1.6;
/// The same per integrated error, 1/s².
const SPEED_PER_S2: f64 = 0.5;
/// Largest horizontal acceleration that is asked for, m/s².
const MOST_MPS2: f64 = 6.0;
/// Largest vertical acceleration that the integral asks for, m/s².
const MOST_INTEGRAL_MPS2: f64 = 4.0;
/// Smallest command in the air, 0 to 1.
const LEAST_COMMAND: f64 = 0.12;

/// Motion that the loop believes in, and the one that it is to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errand {
    /// Where it should be, show frame, m.
    pub target_m: Vector,
    /// How fast it should be, m/s.
    pub target_mps: Vector,
    /// Where it believes to be, m.
    pub position_m: Vector,
    /// How fast it believes to be, m/s.
    pub velocity_mps: Vector,
}

/// Decision of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Command to the motor controllers, 0 to 1.
    pub command: f64,
    /// Wanted direction of the thrust, show frame, length 1.
    pub up: Vector,
}

/// The loop of one drone.
#[derive(Clone, Debug)]
pub struct Autopilot {
    hover_command: f64,
    ceiling: f64,
    integral: Vector,
}

impl Autopilot {
    /// A loop that believes to hover at a command, and gives none above the ceiling.
    pub fn new(hover_command: f64, ceiling: f64) -> Self {
        Self { hover_command, ceiling, integral: [0.0; 3] }
    }

    /// Decides for one step.
    pub fn decide(&mut self, errand: &Errand, step_s: f64) -> Decision {
        let mut wanted = [0.0; 3];
        for (axis, wanted) in wanted.iter_mut().enumerate() {
            let is_up = axis == 2;
            let (place, speed, sum) = if is_up {
                (HEIGHT_PER_S, CLIMB_PER_S, CLIMB_PER_S2)
            } else {
                (PLACE_PER_S, SPEED_PER_S, SPEED_PER_S2)
            };
            let off_m = (errand.target_m[axis] - errand.position_m[axis]).clamp(-3.0, 3.0);
            let target_mps = errand.target_mps[axis] + place * off_m;
            let error_mps = target_mps - errand.velocity_mps[axis];
            let most = if is_up { MOST_INTEGRAL_MPS2 } else { MOST_MPS2 };
            self.integral[axis] =
                (self.integral[axis] + sum * error_mps * step_s).clamp(-most, most);
            *wanted = speed * error_mps + self.integral[axis];
        }
        let [x, y, up_mps2] = wanted;
        let flat = x.hypot(y);
        let share = if flat > MOST_MPS2 { MOST_MPS2 / flat } else { 1.0 };
        let (x, y) = (x * share, y * share);
        let length = (x * x + y * y + GRAVITY * GRAVITY).sqrt();
        let up = [x / length, y / length, GRAVITY / length];
        // The thrust that points aside is made up for.
        let command = self.hover_command * (1.0 + up_mps2 / GRAVITY) / up[2];
        let given = command.clamp(LEAST_COMMAND, self.ceiling);
        if given != command {
            // The integral does not grow against a limit.
            self.integral[2] *= 0.999;
        }
        Decision { command: given, up }
    }
}
