//! Director of the show: stages, their timing, and goals for the controllers (the fork's show
//! mode).

use nalgebra::{Vector1, Vector3};

use super::filter::LowPass;
use super::guided::Guided;
use super::motors::{Motors, Spool};
use super::params as p;
use super::shaping::{Kinematics, RootLaw};
use super::vertical::Goal;
use crate::sim::sensors::Estimate;
use skybrush_show::Trajectory;
use skybrush_show::trajectory::Cursor;

/// Stages of a show flight, with the firmware's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Stage {
    /// Armed, waiting for the take-off time.
    Wait = 2,
    /// Climb to SHOW_TAKEOFF_ALT.
    Takeoff = 3,
    /// Flight along the trajectory.
    Performing = 4,
    /// Return to the place of the take-off, after an abort.
    Returning = 5,
    /// Descent to the ground where the trajectory ended.
    Landing = 7,
    /// On the ground, motors off.
    Landed = 8,
}

/// Way in which a show is left before its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abort {
    /// Landing at the present place.
    Land,
    /// Return to the place of the take-off, not below RTL_ALT, and landing there.
    Return,
}

impl Abort {
    /// Number of the autopilot's mode for this way.
    pub fn mode(self) -> u8 {
        match self {
            Self::Land => 9,
            Self::Return => 6,
        }
    }
}

/// Way home.
#[derive(Clone, Copy, Debug)]
struct Return {
    height_m: f64,
    is_high: bool,
    /// How long it has been there, s.
    there_s: f64,
}

/// State of the landing detector after the show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Touchdown {
    /// In the air, or not yet taken off.
    None,
    /// Touchdown is suspected (EV 17).
    Maybe,
    /// Touchdown is declared (EV 18).
    Complete,
}

/// Time for which the motors must be at their lower limit to suspect, and to declare a landing, s.
const LAND_MAYBE_S: f64 = 0.2;
const LAND_COMPLETE_S: f64 = 1.0;
/// A vehicle that has landed accelerates by no more than this, m/s².
const LAND_ACCELERATION: f64 = 1.0;
/// A vehicle has returned when it is this close (m) and this slow (m/s).
const RETURNED_M: f64 = 1.0;
const RETURNED_MPS: f64 = 0.5;
/// From landing declared to disarming, s.
const DISARM_AFTER_S: f64 = 0.5;

/// Take-off time that firmware 4.4 derives from a trajectory, show time s: the first instant of a
/// 1/16 s grid at which it is SHOW_TAKEOFF_ALT above its start, less the time a climb at `speed_up`
/// needs, and not before 0. `None` when it never gets there.
pub fn takeoff_time_s(trajectory: &Trajectory, speed_up_mps: f64) -> Option<f64> {
    let height_m = trajectory.start_m.z + p::SHOW_TAKEOFF_ALT;
    let last = trajectory.duration_ms() * 16 / 1000 + 1;
    let mut cursor = Cursor::new(trajectory);
    let reached = (0..=last)
        .map(|step| step as f64 / 16.0)
        .find(|&time_s| cursor.state_at(time_s).position_m.z >= height_m)?;
    Some((reached - p::SHOW_TAKEOFF_ALT / speed_up_mps).max(0.0))
}

/// Goals that the director sets for the controllers.
#[derive(Clone, Copy, Debug)]
pub struct Goals {
    /// Goal of the vertical axis.
    pub vertical: Goal,
    /// Goal of the horizontal axes; `None`: come to a stop.
    pub horizontal: Option<Kinematics<2>>,
    /// Whether the controllers start anew from the present motion.
    pub restart: bool,
}

/// The show mode of one drone. Fields that are logged are public.
#[derive(Clone, Debug)]
pub struct Director<'a> {
    /// Present stage of the show.
    pub stage: Stage,
    /// Whether the motors are armed.
    pub armed: bool,
    /// State of the landing detector.
    pub touchdown: Touchdown,
    /// Last target of the show (with the velocity as sent), show frame.
    pub target: Kinematics<3>,
    /// Position of the last target as it was sent, show frame, m.
    pub sent_m: Vector3<f64>,
    /// Steps since the last target; 0 in the step that made one.
    pub target_age: u32,
    /// Take-off time, show time, s.
    pub takeoff_s: f64,
    /// End of the trajectory, show time, s.
    pub end_s: f64,
    /// Way in which the show was left before its end, if it was.
    pub aborted: Option<Abort>,
    /// Orders of a ground station, which take the show's place; `None` if the vehicle flies the
    /// show.
    pub guided: Option<Guided>,
    way_home: Return,
    cursor: Cursor<'a>,
    pub(super) home_m: Vector3<f64>,
    above_floor: bool,
    at_limit_s: f64,
    landed_s: f64,
    feed_forward: f64,
    pub(super) spin_min: f64,
    land_acceleration: [LowPass; 3],
    to_land_alt: RootLaw,
    steps_per_target: u32,
    pub(super) dt_s: f64,
}

impl<'a> Director<'a> {
    /// A director of an armed vehicle that waits at home. `None` if the trajectory never rises to
    /// SHOW_TAKEOFF_ALT.
    pub fn new(
        trajectory: &'a Trajectory,
        home_m: Vector3<f64>,
        settings: &crate::vehicle::Autopilot,
        dt_s: f64,
    ) -> Option<Self> {
        let takeoff_s = takeoff_time_s(trajectory, settings.wpnav_speed_up_mps)?;
        Some(Self::taking_off_at(takeoff_s, trajectory, home_m, settings, dt_s))
    }

    /// A director of an armed vehicle that waits at home for a ground station's orders; the
    /// trajectory is not flown.
    pub fn guided(
        trajectory: &'a Trajectory,
        home_m: Vector3<f64>,
        settings: &crate::vehicle::Autopilot,
        dt_s: f64,
    ) -> Self {
        Self {
            guided: Some(Guided::default()),
            end_s: f64::INFINITY,
            ..Self::taking_off_at(0.0, trajectory, home_m, settings, dt_s)
        }
    }

    fn taking_off_at(
        takeoff_s: f64,
        trajectory: &'a Trajectory,
        home_m: Vector3<f64>,
        settings: &crate::vehicle::Autopilot,
        dt_s: f64,
    ) -> Self {
        let steps_per_target = (1.0 / (dt_s * f64::from(p::SHOW_CTRL_RATE))).round() as u32;
        Self {
            stage: Stage::Wait,
            armed: true,
            touchdown: Touchdown::None,
            target: Kinematics::at(home_m),
            sent_m: home_m,
            target_age: 0,
            takeoff_s,
            end_s: trajectory.duration_ms() as f64 / 1000.0,
            aborted: None,
            guided: None,
            way_home: Return { height_m: home_m.z + p::RTL_ALT, is_high: false, there_s: 0.0 },
            cursor: Cursor::new(trajectory),
            home_m,
            above_floor: false,
            at_limit_s: 0.0,
            landed_s: 0.0,
            feed_forward: settings.show_vel_ff_gain,
            spin_min: settings.mot_spin_min.max(p::MOT_SPIN_ARM),
            land_acceleration: [LowPass::new(p::LAND_ACCEL_FLT, dt_s); 3],
            to_land_alt: RootLaw::new(settings.psc_posz_p, p::WPNAV_ACCEL_Z, dt_s),
            steps_per_target,
            dt_s,
        }
    }

    /// Advances by one step through the stages; returns the goals.
    #[inline]
    pub fn update(&mut self, time_s: f64, estimate: &Estimate, motors: &mut Motors) -> Goals {
        let mut restart = false;
        match self.stage {
            Stage::Wait | Stage::Takeoff | Stage::Performing if self.guided.is_some() => {
                restart = self.obey(estimate, motors);
            }
            Stage::Wait => self.wait(time_s, motors),
            Stage::Takeoff => {
                let height_m = estimate.position_m.z - self.home_m.z;
                let show_m = self.cursor.state_at(time_s).position_m.z - self.home_m.z;
                if height_m >= p::TAKEOFF_DONE * p::SHOW_TAKEOFF_ALT && show_m >= height_m {
                    self.stage = Stage::Performing;
                    restart = true;
                    self.sample(time_s);
                } else if time_s >= self.end_s {
                    self.stage = Stage::Landing;
                }
            }
            Stage::Performing if time_s >= self.end_s => self.stage = Stage::Landing,
            Stage::Performing => {
                self.target_age += 1;
                if self.target_age >= self.steps_per_target {
                    self.sample(time_s);
                } else {
                    self.target.advance(self.dt_s);
                }
            }
            Stage::Returning => self.go_home(estimate),
            Stage::Landing => self.land(estimate, motors),
            Stage::Landed => motors.spool = Spool::Stopped,
        }
        self.goals(estimate, restart)
    }

    /// Leaves the show; on the ground the motors stop.
    pub fn abort(&mut self, how: Abort, position_m: Vector3<f64>) {
        match self.stage {
            Stage::Landed => return,
            Stage::Wait => {
                self.stage = Stage::Landed;
                self.armed = false;
            }
            _ if how == Abort::Land || self.touchdown != Touchdown::None => {
                self.stage = Stage::Landing;
            }
            _ => {
                self.stage = Stage::Returning;
                let height_m = position_m.z.max(self.home_m.z + p::RTL_ALT);
                self.way_home = Return { height_m, is_high: false, there_s: 0.0 };
            }
        }
        self.aborted = Some(how);
    }

    fn go_home(&mut self, estimate: &Estimate) {
        let way = &mut self.way_home;
        way.is_high |= estimate.position_m.z >= way.height_m - 0.5;
        let from_home_m = (estimate.position_m.xy() - self.home_m.xy()).norm();
        let is_there =
            from_home_m <= RETURNED_M && estimate.velocity_mps.xy().norm() <= RETURNED_MPS;
        if way.is_high && (is_there || way.there_s > 0.0) {
            way.there_s += self.dt_s;
            if way.there_s >= p::RTL_LOIT_TIME_S {
                self.stage = Stage::Landing;
            }
        }
    }

    /// Number of the stage as it is reported: an aborted show is off, as another mode flies.
    pub fn told(&self) -> u8 {
        if self.aborted.is_some() || self.guided.is_some() { 0 } else { self.stage as u8 }
    }

    fn wait(&mut self, time_s: f64, motors: &mut Motors) {
        if time_s >= self.takeoff_s {
            self.stage = Stage::Takeoff;
            motors.spool = Spool::Up(p::MOT_SPIN_ARM / self.spin_min);
        } else if time_s >= self.takeoff_s - p::ARM_BEFORE_TAKEOFF_S + p::ARMING_DELAY_S {
            motors.spool = Spool::Idle;
        }
    }

    /// Evaluates the trajectory as the fork does at SHOW_CTRL_RATE.
    #[inline(never)]
    fn sample(&mut self, time_s: f64) {
        let mut state = self.cursor.state_at(time_s);
        // Altitudes are sent as whole centimetres, cut off; the addition is for fractions such as
        // 0.07, which binary numbers cannot have.
        state.position_m.z = (state.position_m.z * 100.0 + 1e-6).trunc() / 100.0;
        let floor_m = self.home_m.z + p::SHOW_TAKEOFF_ALT;
        self.above_floor |= state.position_m.z > floor_m;
        self.target = Kinematics {
            position: state.position_m,
            velocity: state.velocity_mps * self.feed_forward,
            acceleration: Vector3::zeros(),
        };
        if !self.above_floor {
            self.target.position.z = floor_m;
            self.target.velocity.z = 0.0;
        }
        self.sent_m = self.target.position;
        self.target_age = 0;
    }

    #[inline(never)]
    fn land(&mut self, estimate: &Estimate, motors: &mut Motors) {
        let mut square = 0.0;
        for (filter, sample) in
            self.land_acceleration.iter_mut().zip(estimate.acceleration_mps2.iter())
        {
            square += filter.apply(*sample).powi(2);
        }
        let still = square <= LAND_ACCELERATION.powi(2) && estimate.velocity_mps.z.abs() < 1.0;
        self.at_limit_s =
            if motors.limits.lower && still { self.at_limit_s + self.dt_s } else { 0.0 };
        let seen = match self.at_limit_s {
            limit_s if limit_s >= LAND_COMPLETE_S => Touchdown::Complete,
            limit_s if limit_s >= LAND_MAYBE_S => Touchdown::Maybe,
            _ => Touchdown::None,
        };
        self.touchdown = self.touchdown.max(seen);
        if self.touchdown == Touchdown::Complete {
            self.landed_s += self.dt_s;
            if self.landed_s >= DISARM_AFTER_S {
                self.stage = Stage::Landed;
                self.armed = false;
                motors.spool = Spool::Stopped;
            }
        }
    }

    #[inline]
    fn goals(&self, estimate: &Estimate, restart: bool) -> Goals {
        let floor_m = match &self.guided {
            Some(guided) => guided.takeoff_z_m().unwrap_or(self.home_m.z),
            None => self.home_m.z + p::SHOW_TAKEOFF_ALT,
        };
        let floor = Kinematics::at(Vector1::new(floor_m));
        match self.stage {
            Stage::Wait | Stage::Landed | Stage::Takeoff => {
                Goals { vertical: Goal::Follow(floor), horizontal: None, restart }
            }
            Stage::Performing => {
                let Kinematics { position, velocity, acceleration } = self.target;
                Goals {
                    vertical: Goal::Follow(Kinematics {
                        position: Vector1::new(position.z),
                        velocity: Vector1::new(velocity.z),
                        acceleration: Vector1::new(acceleration.z),
                    }),
                    horizontal: Some(Kinematics {
                        position: position.xy(),
                        velocity: velocity.xy(),
                        acceleration: acceleration.xy(),
                    }),
                    restart,
                }
            }
            Stage::Returning => {
                let way = &self.way_home;
                Goals {
                    vertical: Goal::Follow(Kinematics::at(Vector1::new(way.height_m))),
                    horizontal: way.is_high.then(|| Kinematics::at(self.home_m.xy())),
                    restart,
                }
            }
            Stage::Landing => {
                let high_m = estimate.position_m.z - self.home_m.z - p::LAND_ALT_LOW;
                let speed = self.to_land_alt.rate(Vector1::new(high_m.max(0.0)), p::WPNAV_SPEED_DN);
                let speed = speed.x.max(p::LAND_SPEED);
                Goals { vertical: Goal::Land(speed), horizontal: None, restart }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skybrush_show::{Segment, SegmentPath};

    fn climb(speed_mps: f64, to_m: f64) -> Trajectory {
        let duration_ms = (to_m / speed_mps * 1000.0) as u32;
        let path = SegmentPath::Line(Vector3::new(0.0, 0.0, to_m));
        Trajectory { start_m: Vector3::zeros(), segments: vec![Segment { duration_ms, path }] }
    }

    #[test]
    fn takeoff_times_are_the_firmwares() {
        // Measured on the firmware: 1 m/s climb 2.045 s, 2 m/s climb 0.795 s.
        let [slow, fast] =
            [1.0, 2.0].map(|speed| takeoff_time_s(&climb(speed, 20.0), 5.5).unwrap());
        assert!((slow - 2.045).abs() < 1e-3 && (fast - 0.795).abs() < 1e-3, "{slow} {fast}");
        assert_eq!(takeoff_time_s(&climb(5.0, 20.0), 5.5), Some(0.5 - 2.5 / 5.5));
        assert_eq!(takeoff_time_s(&climb(1.0, 2.4), 5.5), None, "never high enough");
    }
}
