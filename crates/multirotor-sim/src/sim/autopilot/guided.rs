//! GUIDED: a ground station's orders take the show's place.
//!
//! As ArduCopter has it: after arming it waits for a take-off, climbs, and hovers until a target
//! comes. A target is a place and the velocity at which to pass it; between two the vehicle goes
//! on along the last one, and when none has come for GUID_TIMEOUT it stops there.

use nalgebra::Vector3;

use super::director::{Director, Stage};
use super::motors::{Motors, Spool};
use super::params as p;
use super::shaping::Kinematics;
use crate::sim::sensors::Estimate;

/// Targets are taken from this height on, m: before it the vehicle counts as standing.
const OFF_GROUND_M: f64 = 0.3;
/// Share of the climb at which a take-off is done.
const CLIMBED: f64 = 0.9;

/// Orders of a ground station to a guided vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guided {
    /// Height of the take-off, show frame, m; `None`: not ordered yet.
    takeoff_z_m: Option<f64>,
    /// A target that has come since the last step.
    next: Option<Kinematics<3>>,
    /// Since arming, s.
    armed_for_s: f64,
}

/// What becomes of a vehicle that waits on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waiting {
    /// Motors off, so soon after arming.
    Still,
    /// Motors turn.
    Idle,
    /// A take-off was ordered.
    TakesOff,
    /// Nobody wanted anything for too long: it disarms.
    GivesUp,
}

impl Guided {
    /// Orders a take-off to this height, show frame, m.
    fn take_off(&mut self, z_m: f64) {
        self.takeoff_z_m = Some(z_m);
    }

    /// Height of the take-off, show frame, m.
    pub(super) fn takeoff_z_m(&self) -> Option<f64> {
        self.takeoff_z_m
    }

    /// Gives the next target, show frame, m and m/s.
    fn give(&mut self, position: Vector3<f64>, velocity: Vector3<f64>) {
        self.next = Some(Kinematics { position, velocity, acceleration: Vector3::zeros() });
    }

    /// One step on the ground.
    fn wait(&mut self, dt_s: f64) -> Waiting {
        // What comes now is not kept for later.
        self.next = None;
        self.armed_for_s += dt_s;
        if self.takeoff_z_m.is_some() {
            Waiting::TakesOff
        } else if self.armed_for_s >= p::DISARM_DELAY_S {
            Waiting::GivesUp
        } else if self.armed_for_s >= p::ARMING_DELAY_S {
            Waiting::Idle
        } else {
            Waiting::Still
        }
    }

    /// Whether the climb gives way to the targets: it is done, or one has come.
    fn has_climbed(&mut self, above_home_m: f64, home_z_m: f64) -> bool {
        if above_home_m < OFF_GROUND_M {
            self.next = None;
        }
        let climb_m = self.takeoff_z_m.map_or(0.0, |z_m| z_m - home_z_m);
        self.next.is_some() || above_home_m >= CLIMBED * climb_m
    }

    /// The target that has come, once.
    fn take(&mut self) -> Option<Kinematics<3>> {
        self.next.take()
    }
}

impl Director<'_> {
    /// One step by a ground station's orders; whether the controllers start anew.
    #[cold]
    #[inline(never)]
    pub(super) fn obey(&mut self, estimate: &Estimate, motors: &mut Motors) -> bool {
        let Some(guided) = &mut self.guided else { return false };
        match self.stage {
            Stage::Wait => match guided.wait(self.dt_s) {
                Waiting::Still => {}
                Waiting::Idle => motors.spool = Spool::Idle,
                Waiting::TakesOff => {
                    self.stage = Stage::Takeoff;
                    motors.spool = Spool::Up(p::MOT_SPIN_ARM / self.spin_min);
                }
                Waiting::GivesUp => {
                    self.stage = Stage::Landed;
                    self.armed = false;
                    motors.spool = Spool::Stopped;
                }
            },
            Stage::Takeoff => {
                let above_home_m = estimate.position_m.z - self.home_m.z;
                if guided.has_climbed(above_home_m, self.home_m.z) {
                    self.stage = Stage::Performing;
                    let z_m = guided.takeoff_z_m().unwrap_or(estimate.position_m.z);
                    let above = Vector3::new(estimate.position_m.x, estimate.position_m.y, z_m);
                    // A hover is not a target: the log has none of it.
                    self.target = Kinematics::at(above);
                    self.target_age = 1;
                    return true;
                }
            }
            _ => {
                if let Some(target) = guided.take() {
                    self.target = target;
                    self.sent_m = target.position;
                    self.target_age = 0;
                } else {
                    self.target_age = self.target_age.saturating_add(1);
                    if f64::from(self.target_age) * self.dt_s > p::GUID_TIMEOUT_S {
                        self.target = Kinematics::at(self.target.position);
                    }
                    self.target.advance(self.dt_s);
                }
            }
        }
        false
    }

    /// Orders a take-off to this height above home, m; returns whether the order is accepted: the
    /// vehicle must stand armed in GUIDED.
    pub fn take_off(&mut self, above_home_m: f64) -> bool {
        match &mut self.guided {
            Some(guided) if self.stage == Stage::Wait => {
                guided.take_off(self.home_m.z + above_home_m);
                true
            }
            _ => false,
        }
    }

    /// Gives a guided vehicle its next target: position in m and velocity in m/s, show frame.
    pub fn give_target(&mut self, position_m: Vector3<f64>, velocity_mps: Vector3<f64>) {
        if let Some(guided) = &mut self.guided {
            guided.give(position_m, velocity_mps);
        }
    }
}
