//! The flight of one drone along given targets.

use std::collections::VecDeque;
use std::io::{self, Write};

use crate::air::Air;
use crate::autopilot::{Autopilot, Decision, Errand};
use crate::battery::Battery;
use crate::hidden::VelocityError;
use crate::plant::density_ratio;
use crate::random::{Coloured, Purpose, normal, stream};
use crate::record::{Record, Row};
use crate::trim::{Body, Condition};
use crate::vector::{Axes, Vector, norm, scaled, sum};
use crate::world::World;

/// Length of a step, s.
const STEP_S: f64 = 0.005;
/// The log begins so long before the first target that leaves the ground, s.
const LOG_BEFORE_S: f64 = 6.0;
/// Motors start so long before it, s.
const MOTORS_BEFORE_S: f64 = 4.0;
/// The log goes on so long after touchdown, s.
const LOG_AFTER_S: f64 = 2.0;
/// Time constant with which the vehicle follows the wanted lean, s.
const LEAN_S: f64 = 0.12;
/// Speed of the landing after the last target, m/s.
const LANDING_MPS: f64 = 0.5;
/// Longest landing, s: a drone that takes longer is taken to have landed.
const LONGEST_LANDING_S: f64 = 60.0;
/// Command of motors that idle on the ground.
const IDLE_COMMAND: f64 = 0.1;
/// Power of everything but the motors, W.
const AVIONICS_W: f64 = 3.0;
/// Time constant of the acceleration that effects see, s: what shakes faster is no change of motion.
const ACCELERATION_S: f64 = 0.3;

/// Where a drone should be at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Position, show frame, m.
    pub position_m: Vector,
    /// Velocity, m/s.
    pub velocity_mps: Vector,
}

/// Place of the show frame on the globe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Latitude of the origin, degrees.
    pub lat_deg: f64,
    /// Longitude of the origin, degrees.
    pub lon_deg: f64,
    /// Height of show z = 0 above sea level, m.
    pub amsl_m: f64,
    /// Degrees clockwise from north to the show's x.
    pub orientation_deg: f64,
}

/// One drone of a flight.
#[derive(Clone, Copy)]
pub struct Drone<'a> {
    /// Number of its slot, from 1: the key of its random streams.
    pub slot: u16,
    /// Place on the ground, show frame, m.
    pub home_m: Vector,
    /// Whether another drone flies next to it on the left.
    pub has_left: bool,
    /// Charge of its battery, 0 to 1.
    pub charge: f64,
    /// Where it should be at a show time, s.
    pub target: &'a dyn Fn(f64) -> Target,
    /// When it leaves the ground, show time, s.
    pub takeoff_s: f64,
    /// When its last target ends, show time, s: it lands from there.
    pub end_s: f64,
    /// Place of the show.
    pub site: Site,
    /// GPS week and milliseconds in it at show time 0.
    pub start: (i64, i64),
}

/// Outcome of a drone's flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flown {
    /// Largest distance from its target in the air, m.
    pub farthest_m: f64,
    /// When it stood on the ground again, show time, s.
    pub landed_s: f64,
}

/// Span of show time that a flight's air must cover, s.
pub fn span_s(takeoff_s: f64, end_s: f64) -> [f64; 2] {
    [takeoff_s - LOG_BEFORE_S, end_s + LONGEST_LANDING_S + LOG_AFTER_S]
}

/// Thrust of a drone over the mean one's.
pub fn own_thrust(world: &World, slot: u16) -> f64 {
    let deviation = normal(&mut stream(world.seed, slot, Purpose::Spread));
    1.0 + world.thrust_spread * deviation.clamp(-3.0, 3.0)
}

/// What a drone believes of its motion.
struct Estimate {
    velocity_error: Coloured,
    height_error: Coloured,
    errors: VelocityError,
    /// Velocities that the filter gave, newest first; one a step.
    past_mps: VecDeque<f64>,
}

impl Estimate {
    fn new(world: &World, slot: u16, errors: VelocityError) -> Self {
        let noise = &world.noise;
        let rng = |part: u64| stream(world.seed ^ (part << 40), slot, Purpose::Sensors);
        Self {
            velocity_error: Coloured::new(noise.velocity_mps, noise.velocity_s, STEP_S, rng(0)),
            height_error: Coloured::new(noise.height_m, noise.height_s, STEP_S, rng(1)),
            errors,
            past_mps: VecDeque::new(),
        }
    }

    /// Takes the true motion; what the loop gets: position and velocity.
    fn follow(&mut self, position_m: Vector, velocity_mps: Vector) -> (Vector, Vector) {
        let climb_mps = velocity_mps[2] + self.velocity_error.step();
        let height_m = position_m[2] + self.height_error.step();
        let longest_s = self.errors.loop_lag_s + self.errors.log_lag_s;
        self.past_mps.push_front(climb_mps);
        self.past_mps.truncate((longest_s / STEP_S).round() as usize + 1);
        let late_mps = self.late(self.errors.loop_lag_s);
        let [x, y, _] = position_m;
        let [u, v, _] = velocity_mps;
        ([x, y, height_m], [u, v, late_mps])
    }

    fn late(&self, lag_s: f64) -> f64 {
        let back = (lag_s / STEP_S).round() as usize;
        let found = self.past_mps.get(back).or(self.past_mps.back());
        found.copied().unwrap_or_default()
    }

    /// The vertical velocity as the log has it.
    fn logged_mps(&self) -> f64 {
        self.late(self.errors.loop_lag_s + self.errors.log_lag_s) + self.errors.log_bias_mps
    }
}

/// Flies a drone in this air and writes its log.
///
/// # Errors
/// When the log cannot be written.
pub fn fly<W: Write>(world: &World, air: &Air, drone: &Drone<'_>, out: W) -> io::Result<Flown> {
    let home_ratio = density_ratio(drone.site.amsl_m + drone.home_m[2]);
    let mut body =
        Body::new(&world.plant, own_thrust(world, drone.slot), world.acting(), home_ratio);
    let errors = body.hidden().iter().map(|acting| acting.velocity()).fold(
        VelocityError::default(),
        |sum, one| VelocityError {
            loop_lag_s: sum.loop_lag_s + one.loop_lag_s,
            log_lag_s: sum.log_lag_s + one.log_lag_s,
            log_bias_mps: sum.log_bias_mps + one.log_bias_mps,
        },
    );
    let mut estimate = Estimate::new(world, drone.slot, errors);
    let mut around = air.around(drone.slot);
    let mut autopilot = Autopilot::new(body.hover_command(), body.ceiling());
    let mut battery = Battery::new(&world.battery, drone.charge);
    let mut record = Record::new(world, drone, out)?;
    let from_s = drone.takeoff_s - LOG_BEFORE_S;
    let motors_s = drone.takeoff_s - MOTORS_BEFORE_S;
    let mut position_m = drone.home_m;
    let mut velocity_mps = [0.0; 3];
    let (mut state, mut smooth_mps2, mut farthest_m) = (0.0, 0.0, 0.0_f64);
    let mut up = [0.0, 0.0, 1.0];
    let mut landed_s: Option<f64> = None;
    let mut step: u64 = 0;
    loop {
        let time_s = from_s + step as f64 * STEP_S;
        let target = target_at(drone, time_s);
        let turning = time_s >= motors_s && landed_s.is_none();
        let flying = time_s >= drone.takeoff_s && landed_s.is_none();
        let (believed_m, believed_mps) = estimate.follow(position_m, velocity_mps);
        let errand = Errand {
            target_m: target.position_m,
            target_mps: target.velocity_mps,
            position_m: believed_m,
            velocity_mps: believed_mps,
        };
        let decision = if flying {
            autopilot.decide(&errand, STEP_S)
        } else {
            let command = if turning { IDLE_COMMAND } else { 0.0 };
            Decision { command, up: [0.0, 0.0, 1.0] }
        };
        let air_mps = around.velocity_mps(position_m, time_s);
        let at = Condition {
            relative_mps: [0, 1, 2].map(|axis| velocity_mps[axis] - air_mps[axis]),
            density_ratio: density_ratio(drone.site.amsl_m + position_m[2]),
            height_m: position_m[2] - drone.home_m[2],
            time_s: time_s - motors_s,
            acceleration_mps2: smooth_mps2,
            supply_ratio: battery.ratio(),
            has_left: drone.has_left,
        };
        // The lean follows what is wanted.
        up = sum(up, scaled(sum(decision.up, scaled(up, -1.0)), STEP_S / LEAN_S));
        up = scaled(up, 1.0 / norm(up));
        let axes = Axes::along(up);
        let (flow, now) = body.moment(&at, &axes, state);
        body.follow(&now, STEP_S);
        let acting = body.acting_command(decision.command, &now).clamp(0.0, 1.0);
        let power_w = if turning { world.plant.power_w(state, &flow) } else { 0.0 };
        battery.give(power_w + AVIONICS_W, STEP_S);
        let mut acceleration = body.acceleration_mps2(&axes, state, &flow, &now);
        if turning {
            state = (state + world.plant.rate(state, acting, &flow) * STEP_S).max(0.0);
        } else {
            state = 0.0;
        }
        let row = Row {
            time_s,
            is_armed: turning,
            is_flying: flying,
            errand: &errand,
            position_m: believed_m,
            velocity_mps: [velocity_mps[0], velocity_mps[1], estimate.logged_mps()],
            command: decision.command,
            up,
            wanted_up: decision.up,
            rotor_radps: world.plant.rotor_radps(state),
            battery: &battery,
        };
        record.row(step, STEP_S, &row)?;
        if flying {
            let off = [0, 1, 2].map(|axis| position_m[axis] - target.position_m[axis]);
            if time_s < drone.end_s {
                farthest_m = farthest_m.max(norm(off));
            }
        }
        if position_m[2] <= drone.home_m[2] && velocity_mps[2] <= 0.0 {
            // The ground carries it.
            velocity_mps = [0.0; 3];
            position_m[2] = drone.home_m[2];
            if acceleration[2] <= 0.0 || time_s > drone.end_s {
                acceleration = [0.0; 3];
            }
            if flying && time_s > drone.end_s {
                landed_s = Some(time_s);
            }
        }
        smooth_mps2 += (acceleration[2] - smooth_mps2) * STEP_S / ACCELERATION_S;
        velocity_mps = sum(velocity_mps, scaled(acceleration, STEP_S));
        position_m = sum(position_m, scaled(velocity_mps, STEP_S));
        if landed_s.is_none() && time_s > drone.end_s + LONGEST_LANDING_S {
            landed_s = Some(time_s);
        }
        if landed_s.is_some_and(|at_s| time_s > at_s + LOG_AFTER_S) {
            break;
        }
        step += 1;
    }
    record.finish()?;
    Ok(Flown { farthest_m, landed_s: landed_s.unwrap_or_default() })
}

/// The target at a show time: on the ground before take-off, downwards after the end.
fn target_at(drone: &Drone<'_>, time_s: f64) -> Target {
    if time_s < drone.takeoff_s {
        return Target { position_m: drone.home_m, velocity_mps: [0.0; 3] };
    }
    if time_s <= drone.end_s {
        return (drone.target)(time_s);
    }
    let mut last = (drone.target)(drone.end_s);
    last.position_m[2] -= LANDING_MPS * (time_s - drone.end_s);
    Target { position_m: last.position_m, velocity_mps: [0.0, 0.0, -LANDING_MPS] }
}
