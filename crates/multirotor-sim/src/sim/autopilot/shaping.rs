//! Targets that a vehicle can follow: approach a moving point with limited speed, acceleration and
//! jerk, as ArduPilot's position controller does with what a show asks for.

use nalgebra::SVector;

/// Position, velocity and acceleration in N dimensions: m, m/s, m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematics<const N: usize> {
    /// Position, m.
    pub position: SVector<f64, N>,
    /// Velocity, m/s.
    pub velocity: SVector<f64, N>,
    /// Acceleration, m/s².
    pub acceleration: SVector<f64, N>,
}

/// Limits for approaching a moving point.
#[derive(Clone, Copy, Debug)]
pub struct Approach {
    /// Largest speed for correcting a position error, m/s.
    pub speed: f64,
    /// Limits for correcting a velocity error.
    pub swing: Swing,
    to_position: RootLaw,
}

/// Limits for correcting a velocity error.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    /// Largest acceleration for correcting a velocity error, m/s².
    pub acceleration: f64,
    /// Largest jerk for correcting a velocity error, m/s³.
    pub jerk: f64,
    to_velocity: RootLaw,
}

impl Swing {
    /// Limits on acceleration (m/s²) and jerk (m/s³), for steps of `dt_s`.
    pub fn new(acceleration: f64, jerk: f64, dt_s: f64) -> Self {
        let to_velocity = RootLaw::new(jerk / acceleration, jerk, dt_s);
        Self { acceleration, jerk, to_velocity }
    }
}

impl Approach {
    /// Limits on speed (m/s), acceleration (m/s²) and jerk (m/s³), for steps of `dt_s`.
    pub fn new(speed: f64, acceleration: f64, jerk: f64, dt_s: f64) -> Self {
        Self {
            speed,
            swing: Swing::new(acceleration, jerk, dt_s),
            // Half the acceleration and jerk are kept for the velocity loop inside.
            to_position: RootLaw::new(0.5 * jerk / acceleration, 0.5 * acceleration, dt_s),
        }
    }
}

impl<const N: usize> Kinematics<N> {
    /// A point at rest.
    pub fn at(position: SVector<f64, N>) -> Self {
        Self { position, velocity: SVector::zeros(), acceleration: SVector::zeros() }
    }

    /// Advances by one step at the present acceleration.
    #[inline]
    pub fn advance(&mut self, dt_s: f64) {
        self.position += (self.velocity + self.acceleration * (dt_s / 2.0)) * dt_s;
        self.velocity += self.acceleration * dt_s;
    }

    /// Advances by one step, but not away from a vehicle that is at its limit in the direction of
    /// `stuck` (zero: free): neither in position while that is ahead by `ahead`, nor in velocity
    /// while that is ahead by `faster`.
    #[inline]
    pub fn advance_within(
        &mut self,
        dt_s: f64,
        stuck: &SVector<f64, N>,
        ahead: &SVector<f64, N>,
        faster: &SVector<f64, N>,
    ) {
        if stuck.norm_squared() == 0.0 {
            return self.advance(dt_s);
        }
        let step = (self.velocity + self.acceleration * (dt_s / 2.0)) * dt_s;
        if step.dot(stuck) <= 0.0 || ahead.dot(stuck) <= 0.0 {
            self.position += step;
        }
        let gain = self.acceleration * dt_s;
        let away = gain.dot(stuck) > 0.0 && faster.dot(stuck) > 0.0;
        if !away || self.velocity.dot(stuck) < 0.0 {
            self.velocity += gain;
        }
    }

    /// Turns the acceleration towards meeting `goal` in position and velocity, within `limits`.
    #[inline]
    pub fn approach(&mut self, goal: &Self, limits: &Approach, dt_s: f64) {
        let catch_up = limits.to_position.rate(goal.position - self.position, limits.speed);
        self.approach_velocity(
            &(catch_up + goal.velocity),
            &goal.acceleration,
            &limits.swing,
            dt_s,
        );
    }

    /// Turns the acceleration towards a velocity, within the limits.
    #[inline]
    pub fn approach_velocity(
        &mut self,
        velocity: &SVector<f64, N>,
        feed_forward: &SVector<f64, N>,
        limits: &Swing,
        dt_s: f64,
    ) {
        let error = velocity - self.velocity;
        let wanted = limits.to_velocity.rate(error, limits.acceleration) + feed_forward;
        self.acceleration += limited(wanted - self.acceleration, limits.jerk * dt_s);
    }
}

impl Kinematics<1> {
    /// Turns the acceleration towards `goal` as [`Kinematics::approach`] does, with separate limits
    /// for accelerating up and down.
    pub fn approach_between(&mut self, goal: &Self, up: &Approach, down: &Approach, dt_s: f64) {
        // What brakes before a goal above is the downward acceleration.
        let brake = if goal.position.x > self.position.x { down } else { up };
        self.approach_with(goal, brake, &up.swing, &down.swing, dt_s);
    }

    /// Turns the acceleration towards `goal` as [`Kinematics::approach_between`] does, with
    /// `limits` for position errors.
    pub fn approach_with(
        &mut self,
        goal: &Self,
        limits: &Approach,
        up: &Swing,
        down: &Swing,
        dt_s: f64,
    ) {
        let catch_up = limits.to_position.rate(goal.position - self.position, limits.speed);
        let velocity = catch_up + goal.velocity;
        let swing = if velocity.x > self.velocity.x { up } else { down };
        self.approach_velocity(&velocity, &goal.acceleration, swing, dt_s);
    }
}

/// Errors below this are none, m or m/s: left to decay for ever, they would become subnormal
/// numbers, with which processors are tens of times slower.
const NOTHING: f64 = 1e-12;

/// Rate that takes an error to zero: proportional near zero, and further out what a constant
/// deceleration can still stop. Never overshoots within one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct RootLaw {
    /// Gain near zero, 1/s.
    near: f64,
    brake: f64,
    linear_to: f64,
    steps_per_s: f64,
}

impl RootLaw {
    pub(super) fn new(stiffness: f64, brake: f64, dt_s: f64) -> Self {
        let linear_to = brake / (stiffness * stiffness);
        let steps_per_s = 1.0 / dt_s;
        Self { near: stiffness.min(steps_per_s), brake, linear_to, steps_per_s }
    }

    #[inline]
    pub(super) fn rate<const N: usize>(
        &self,
        error: SVector<f64, N>,
        limit: f64,
    ) -> SVector<f64, N> {
        let square = error.norm_squared();
        if square < NOTHING * NOTHING {
            return SVector::zeros();
        }
        if square <= self.linear_to * self.linear_to {
            // Most of the time; needs no square root.
            return limited(error * self.near, limit);
        }
        self.far(error, square.sqrt(), limit)
    }

    /// Apart, so that its roots and its division are made only when they are needed.
    #[inline(never)]
    fn far<const N: usize>(
        &self,
        error: SVector<f64, N>,
        size: f64,
        limit: f64,
    ) -> SVector<f64, N> {
        let rate = (2.0 * self.brake * (size - self.linear_to / 2.0)).sqrt();
        error * (rate.min(size * self.steps_per_s).min(limit) / size)
    }
}

/// A vector cut to a length.
#[inline]
pub(super) fn limited<const N: usize>(vector: SVector<f64, N>, limit: f64) -> SVector<f64, N> {
    let square = vector.norm_squared();
    if square > limit * limit { shortened(vector, limit) } else { vector }
}

/// Rare, and said so: else the root and the division are made every time, branch-free.
#[cold]
#[inline(never)]
fn shortened<const N: usize>(vector: SVector<f64, N>, limit: f64) -> SVector<f64, N> {
    vector * (limit / vector.norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use proptest::prelude::*;

    const DT_S: f64 = 0.0025;

    #[test]
    fn a_target_does_not_leave_a_vehicle_that_can_give_no_more() {
        let mut target = Kinematics::at(Vector2::zeros());
        target.velocity.x = 1.0;
        target.acceleration = Vector2::new(2.0, 1.0);
        let (ahead, behind) = (Vector2::new(1.0, 0.0), Vector2::new(-1.0, 0.0));
        let held = target;
        target.advance_within(DT_S, &ahead, &ahead, &ahead);
        assert_eq!((target.position, target.velocity), (held.position, held.velocity));
        target.advance_within(DT_S, &ahead, &behind, &behind);
        assert!(target.position.x > 0.0 && target.velocity.x > 1.0, "it is behind: let it come");
        let mut free = held;
        free.advance_within(DT_S, &Vector2::zeros(), &ahead, &ahead);
        assert!(free.position.x > 0.0 && free.velocity.x > 1.0);
    }

    proptest! {
        #[test]
        fn meets_a_moving_goal_within_its_limits(
            x in -20.0..20.0, y in -20.0..20.0, vx in -3.5..3.5, vy in -3.5..3.5,
        ) {
            let limits = Approach::new(10.0, 5.0, 30.0, DT_S);
            let mut goal = Kinematics::at(Vector2::new(x, y));
            goal.velocity = Vector2::new(vx, vy);
            let mut target = Kinematics::at(Vector2::zeros());
            for _ in 0..8_000 {
                let before = target.acceleration;
                target.approach(&goal, &limits, DT_S);
                prop_assert!(target.acceleration.norm() <= limits.swing.acceleration * 1.5);
                prop_assert!((target.acceleration - before).norm() <= limits.swing.jerk * DT_S + 1e-12);
                target.advance(DT_S);
                goal.advance(DT_S);
            }
            prop_assert!((goal.position - target.position).norm() < 0.02);
            prop_assert!((goal.velocity - target.velocity).norm() < 0.02);
        }
    }
}
