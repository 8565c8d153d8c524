//! The flying body: rigid-body motion under rotors, drag and gravity.
//!
//! World axes are the show frame's (x forward, y left, z up), body axes forward, left, up. Every
//! cause of force or torque is one file that adds to [`Loads`] in body axes.

pub mod drag;
pub mod rotor;
pub mod sitl;
pub mod trim;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::air::Surroundings;
use crate::effects::{Active, Air, Change, Hook, Now, Reading};
use crate::vehicle::Airframe;
use drag::Drag;
use rotor::{LAYOUT, ROTORS, Rotors};
use sitl::Sitl;

/// Standard gravity, m/s² (AirSim's EarthUtils below 10 km).
pub const GRAVITY: f64 = 9.80665;

/// Force and torque on the body, body axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loads {
    /// Force, body axes, N.
    pub force_n: Vector3<f64>,
    /// Torque about the centre, N m.
    pub torque_nm: Vector3<f64>,
}

/// Motion of the body.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Position, show frame, m.
    pub position_m: Vector3<f64>,
    /// Velocity over ground, show frame, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Acceleration, show frame, m/s²; without gravity's reaction (0 at rest).
    pub acceleration_mps2: Vector3<f64>,
    /// Rotation from body to show frame.
    pub attitude: UnitQuaternion<f64>,
    /// Rotation from body to show frame, as a matrix.
    pub rotation: Matrix3<f64>,
    /// Angular velocity, body axes, rad/s.
    pub rate_radps: Vector3<f64>,
    /// Angular acceleration, body axes, rad/s².
    pub angular_acceleration: Vector3<f64>,
}

/// The simulated body with its rotors.
#[derive(Clone, Debug)]
pub struct Plant {
    per_mass: f64,
    inertia: Vector3<f64>,
    per_inertia: Vector3<f64>,
    dt_s: f64,
    ground_z_m: f64,
    rotors: Rotors,
    drag: Drag,
    /// Stands in for rotors and drag.
    sitl: Option<Sitl>,
    effects: Active,
    /// Torque of the rotors over that in still air, as the effects had it in the last step.
    torque: f64,
    motion: Motion,
    on_ground: bool,
    impact_mps2: f64,
}

impl Plant {
    /// A body at rest on the ground at `home_m` (show frame), heading along show x, for steps of
    /// `dt_s`.
    pub fn new(airframe: &Airframe, home_m: Vector3<f64>, dt_s: f64) -> Self {
        Self::with_effects(airframe, Active::default(), home_m, dt_s)
    }

    /// A body at rest on the ground as by [`Plant::new`], with effects.
    pub fn with_effects(
        airframe: &Airframe,
        effects: Active,
        home_m: Vector3<f64>,
        dt_s: f64,
    ) -> Self {
        let sitl = airframe.sitl.map(|frame| Sitl::new(&frame, airframe.mass_kg));
        let inertia = sitl.map_or_else(|| inertia_kgm2(airframe), |sitl| sitl.inertia_kgm2());
        Self {
            per_mass: 1.0 / airframe.mass_kg,
            inertia,
            per_inertia: inertia.map(|moment| 1.0 / moment),
            dt_s,
            ground_z_m: home_m.z,
            rotors: Rotors::new(airframe, dt_s),
            drag: Drag::new(airframe),
            sitl,
            effects,
            torque: 1.0,
            motion: Motion {
                position_m: home_m,
                velocity_mps: Vector3::zeros(),
                acceleration_mps2: Vector3::zeros(),
                attitude: UnitQuaternion::identity(),
                rotation: Matrix3::identity(),
                rate_radps: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
            },
            on_ground: true,
            impact_mps2: 0.0,
        }
    }

    /// Changes the length of the steps in flight; `airframe` must be that of the body.
    pub fn set_step(&mut self, airframe: &Airframe, dt_s: f64) {
        self.dt_s = dt_s;
        self.rotors.set_step(airframe, dt_s);
    }

    /// Present motion of the body.
    #[inline]
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Rotors of the body.
    pub fn rotors(&self) -> &Rotors {
        &self.rotors
    }

    /// Whether the body rests on the ground.
    pub fn on_ground(&self) -> bool {
        self.on_ground
    }

    /// Mean acceleration by which the ground stopped the fall in the last step, m/s² upward: what an
    /// accelerometer feels of a touchdown; 0 otherwise.
    #[inline]
    pub fn impact_mps2(&self) -> f64 {
        self.impact_mps2
    }

    /// State of the battery, if the vehicle has one.
    pub fn battery(&self) -> Option<Reading> {
        self.effects.battery()
    }

    /// Changes the vertical speed that the autopilot senses (m/s, up positive) as the effects do;
    /// `dt_s` is the time since the last call.
    #[inline]
    pub fn sense(&mut self, dt_s: f64, climb_mps: &mut f64) {
        if self.effects.acts(Hook::Sense) {
            self.effects.sense(dt_s, climb_mps);
        }
    }

    /// Changes the vertical speed that the log has (m/s, up positive) as the effects do; `dt_s` is
    /// the time since the last call.
    #[inline]
    pub fn log(&mut self, dt_s: f64, climb_mps: &mut f64) {
        if self.effects.acts(Hook::Log) {
            self.effects.log(dt_s, climb_mps);
        }
    }

    /// Advances by one step with rotor commands from 0 to 1.
    ///
    /// The velocity-Verlet scheme of AirSim's FastPhysicsEngine: drag at the velocity expected in
    /// the middle of the step, velocity with the mean of old and new acceleration.
    #[inline]
    pub fn step(&mut self, command: &[f64; ROTORS], around: &Surroundings) {
        if self.effects.any() {
            self.step_affected(command, around);
        } else {
            let air =
                Air { velocity_mps: around.air_velocity_mps, density_ratio: around.density_ratio };
            self.step_in(&air, &Change::default(), command);
        }
    }

    /// One step with effects; apart, so that the one without is compiled for factors of 1.
    #[inline(never)]
    fn step_affected(&mut self, command: &[f64; ROTORS], around: &Surroundings) {
        let now = &self.motion;
        let middle_mps = now.velocity_mps + now.acceleration_mps2 * (self.dt_s / 2.0);
        let (air, change, command) = self.affected(command, around, &middle_mps);
        self.step_in(&air, &change, &command);
    }

    /// One step in this air, with these changes of the loads.
    #[inline]
    fn step_in(&mut self, air: &Air, change: &Change, command: &[f64; ROTORS]) {
        let half_s = self.dt_s / 2.0;
        let now = &self.motion;
        let middle_mps = now.velocity_mps + now.acceleration_mps2 * half_s;
        let middle_radps = now.rate_radps + now.angular_acceleration * half_s;

        let relative = now.rotation.tr_mul(&(middle_mps - air.velocity_mps));
        let loads = self.loads(command, &relative, &middle_radps, air, change);

        let now = &self.motion;
        let mut acceleration = now.rotation * (loads.force_n * self.per_mass);
        acceleration.z -= GRAVITY;
        let spin = now.rate_radps.cross(&now.rate_radps.component_mul(&self.inertia));
        let angular = (loads.torque_nm - spin).component_mul(&self.per_inertia);

        let next = &mut self.motion;
        next.velocity_mps += (next.acceleration_mps2 + acceleration) * half_s;
        next.rate_radps += (next.angular_acceleration + angular) * half_s;
        next.acceleration_mps2 = acceleration;
        next.angular_acceleration = angular;
        next.position_m += middle_mps * self.dt_s;
        next.attitude = turned(next.attitude, middle_radps * self.dt_s);
        next.rotation = *next.attitude.to_rotation_matrix().matrix();

        self.rotors.advance(command, air.density_ratio * change.torque);
        self.rest_on_ground();
    }

    /// Loads of rotors, drag and effects, body axes, at a velocity relative to the air and turn rates.
    #[inline]
    fn loads(
        &mut self,
        command: &[f64; ROTORS],
        relative_mps: &Vector3<f64>,
        rate_radps: &Vector3<f64>,
        air: &Air,
        change: &Change,
    ) -> Loads {
        let mut loads = Loads { force_n: change.force_n, torque_nm: Vector3::zeros() };
        if let Some(sitl) = &mut self.sitl {
            let density_ratio = air.density_ratio;
            sitl.add_loads(
                command,
                relative_mps,
                rate_radps,
                density_ratio,
                &change.drag,
                &mut loads,
            );
        } else {
            self.rotors.add_loads(air.density_ratio, change, &mut loads);
            self.drag.add_loads(relative_mps, air.density_ratio, &change.drag, &mut loads);
        }
        loads
    }

    /// The air, the loads' changes and the commands as the effects make them.
    fn affected(
        &mut self,
        command: &[f64; ROTORS],
        around: &Surroundings,
        velocity_mps: &Vector3<f64>,
    ) -> (Air, Change, [f64; ROTORS]) {
        let (mut now, air) = self.meet(around, velocity_mps);
        let mut command = *command;
        if self.effects.acts(Hook::Command) {
            now.power_w = self.rotors.power_w(air.density_ratio, self.torque);
            self.effects.follow(&now);
            command = command.map(|command| self.effects.command(command));
        }
        let change = self.change(&now);
        (air, change, command)
    }

    /// What effects see at a velocity, and the air as they make it.
    fn meet(&mut self, around: &Surroundings, velocity_mps: &Vector3<f64>) -> (Now, Air) {
        let motion = &self.motion;
        let mut air =
            Air { velocity_mps: around.air_velocity_mps, density_ratio: around.density_ratio };
        let thrust_n = self.rotors.thrust_n(air.density_ratio);
        let mut now = Now {
            dt_s: self.dt_s,
            position_m: motion.position_m,
            height_m: motion.position_m.z - self.ground_z_m,
            relative_mps: motion.rotation.tr_mul(&(velocity_mps - air.velocity_mps)),
            acceleration_mps2: motion.rotation.tr_mul(&motion.acceleration_mps2),
            density_ratio: air.density_ratio,
            thrust_n,
            power_w: 0.0,
            turning: thrust_n > 0.0,
        };
        if self.effects.acts(Hook::Air) {
            self.effects.air(&now, &mut air);
            now.relative_mps = motion.rotation.tr_mul(&(velocity_mps - air.velocity_mps));
            now.density_ratio = air.density_ratio;
            now.thrust_n = self.rotors.thrust_n(air.density_ratio);
        }
        (now, air)
    }

    /// What the effects change of the loads.
    fn change(&mut self, now: &Now) -> Change {
        let mut change = Change::default();
        if self.effects.acts(Hook::Loads) {
            change = self.effects.loads(now);
        }
        self.torque = change.torque;
        change
    }

    /// The ground carries what would sink into it, and holds it level: drones stand on their legs.
    #[inline]
    fn rest_on_ground(&mut self) {
        let motion = &self.motion;
        let stood = self.on_ground;
        self.impact_mps2 = 0.0;
        self.on_ground = false;
        if motion.position_m.z <= self.ground_z_m {
            self.touch(stood);
        }
    }

    /// Is at the ground or in it; `stood`: it stood there in the step before.
    #[cold]
    #[inline(never)]
    fn touch(&mut self, stood: bool) {
        if self.motion.velocity_mps.z <= 0.0 {
            self.on_ground = true;
            self.stand(stood);
        } else {
            // The step moved it by the speed in its middle, still downwards; at its end it rises. The
            // ground does not give way meanwhile.
            self.motion.position_m.z = self.ground_z_m;
        }
    }

    /// Stands on the ground; `stood`: as in the step before.
    fn stand(&mut self, stood: bool) {
        let motion = &mut self.motion;
        if !stood {
            self.impact_mps2 = -motion.velocity_mps.z / self.dt_s;
        }
        let heading = motion.rotation * Vector3::x();
        let yaw = heading.y.atan2(heading.x);
        motion.position_m.z = self.ground_z_m;
        motion.velocity_mps = Vector3::zeros();
        motion.acceleration_mps2 = Vector3::zeros();
        motion.rate_radps = Vector3::zeros();
        motion.angular_acceleration = Vector3::zeros();
        motion.attitude = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        motion.rotation = *motion.attitude.to_rotation_matrix().matrix();
    }
}

/// An attitude turned further by a small body-axes rotation vector.
#[inline]
fn turned(attitude: UnitQuaternion<f64>, turn_rad: Vector3<f64>) -> UnitQuaternion<f64> {
    // Half angles of a control step are at most some hundredths of a radian: this series of the
    // sine and cosine is exact to the last digits there, and the normalisation does the rest.
    let half = turn_rad * 0.5;
    let square = half.norm_squared();
    let vector = half * (1.0 - square * (1.0 / 6.0));
    let step =
        Quaternion::new(1.0 - square * (0.5 - square * (1.0 / 24.0)), vector.x, vector.y, vector.z);
    let product = attitude.into_inner() * step;
    // One step of Newton's iteration for 1/norm: the product's norm is off 1 by rounding only.
    let correction = 1.5 - 0.5 * product.norm_squared();
    UnitQuaternion::new_unchecked(product * correction)
}

/// Moments of inertia about forward, left and up: the box, and the motors as points.
fn inertia_kgm2(airframe: &Airframe) -> Vector3<f64> {
    let [x, y, z] = airframe.body_m;
    let box_kg = airframe.mass_kg - ROTORS as f64 * airframe.motor_mass_kg;
    let mut inertia = Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y) * (box_kg / 12.0);
    let offset = airframe.arm_m * std::f64::consts::FRAC_1_SQRT_2;
    for (forward, left, _) in LAYOUT {
        let (px, py, pz) = (forward * offset, left * offset, airframe.rotor_z_m);
        inertia += Vector3::new(py * py + pz * pz, px * px + pz * pz, px * px + py * py)
            * airframe.motor_mass_kg;
    }
    inertia
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::air::density_ratio;
    use crate::vehicle::library::builtin;

    const DT_S: f64 = 0.0025;

    fn plant(height_m: f64) -> Plant {
        let airframe = builtin("airsim-generic-quad").unwrap().airframe;
        let mut plant = Plant::new(&airframe, Vector3::zeros(), DT_S);
        plant.motion.position_m.z = height_m;
        plant
    }

    #[test]
    fn a_body_that_turns_round_at_the_ground_does_not_sink_into_it() {
        let mut plant = plant(50.0);
        let around = Surroundings { air_velocity_mps: Vector3::zeros(), density_ratio: 1.0 };
        for _ in 0..400 {
            plant.step(&[1.0; ROTORS], &around);
        }
        plant.motion.position_m.z = 1e-7;
        plant.motion.velocity_mps = Vector3::new(0.0, 0.0, -1e-3);
        plant.motion.acceleration_mps2 = Vector3::zeros();
        plant.step(&[1.0; ROTORS], &around);
        let motion = plant.motion();
        assert!(motion.velocity_mps.z > 0.0 && !plant.on_ground(), "{motion:?}");
        assert_eq!(motion.position_m.z, 0.0);
    }

    /// Vertical acceleration in the second step of flight at a speed relative to the air and a pulse.
    fn acceleration(air_up_mps: f64, pulse_us: f64, ratio: f64) -> f64 {
        let mut plant = plant(100.0);
        let command = [(pulse_us - 1000.0) / 1000.0; 4];
        plant.rotors.settle(command[0]);
        let around = Surroundings {
            air_velocity_mps: Vector3::new(0.0, 0.0, -air_up_mps),
            density_ratio: ratio,
        };
        plant.step(&command, &around);
        plant.motion.acceleration_mps2.z
    }

    /// The pulse that keeps a steady speed relative to the air, by bisection.
    fn trim_us(air_up_mps: f64, ratio: f64) -> f64 {
        let (mut low, mut high) = (1000.0, 2000.0);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if acceleration(air_up_mps, middle, ratio) < 0.0 { low = middle } else { high = middle }
        }
        f64::midpoint(low, high)
    }

    #[test]
    fn hovers_at_airsims_command() {
        assert!((trim_us(0.0, 1.0) - 1586.600).abs() < 2e-3, "{}", trim_us(0.0, 1.0));
        // Equation (1.A) at 200 m above sea level.
        let ratio = density_ratio(200.0);
        for (speed, pulse) in [(0.0, 1598.00), (3.5, 1696.67), (-3.5, 1499.32)] {
            let trim = trim_us(speed, ratio);
            assert!((trim - pulse).abs() < 0.01, "{speed} m/s: {trim}");
        }
    }

    #[test]
    fn vertical_law_is_signed_quadratic_outside_the_dead_band() {
        let hover = trim_us(0.0, 1.0);
        for speed in [0.5, 1.0, 2.0, 3.5, 6.0] {
            for sign in [-1.0, 1.0] {
                let a = sign * (trim_us(sign * speed, 1.0) - hover) / (speed * speed);
                assert!((a - 8.0552).abs() < 3e-3, "{sign} {speed}: {a}");
            }
        }
        assert_eq!(trim_us(0.099, 1.0), hover);
        assert!(trim_us(0.11, 1.0) > hover);
    }

    #[test]
    fn falls_like_a_stone_in_vacuum() {
        let mut plant = plant(1_000.0);
        let around = Surroundings { air_velocity_mps: Vector3::zeros(), density_ratio: 0.0 };
        for _ in 0..400 {
            plant.step(&[0.0; 4], &around);
        }
        assert!((plant.motion.velocity_mps.z + GRAVITY).abs() < 0.02);
        let fallen = 1_000.0 - plant.motion.position_m.z;
        assert!((fallen - GRAVITY / 2.0).abs() < 0.05, "{fallen}");
    }

    #[test]
    fn inertia_is_box_and_motors() {
        let airframe = builtin("airsim-generic-quad").unwrap().airframe;
        let offset2 = 0.2275_f64.powi(2) / 2.0;
        let motors = 4.0 * 0.055;
        let x = 0.78 / 12.0 * (0.11_f64.powi(2) + 0.04_f64.powi(2))
            + motors * (offset2 + 0.025_f64.powi(2));
        let z = 0.78 / 12.0 * (0.18_f64.powi(2) + 0.11_f64.powi(2)) + motors * 2.0 * offset2;
        let inertia = inertia_kgm2(&airframe);
        assert!((inertia.x - x).abs() < 1e-12 && (inertia.z - z).abs() < 1e-12, "{inertia}");
    }

    #[test]
    fn attitude_stays_a_rotation_over_many_turns() {
        let mut attitude = UnitQuaternion::identity();
        let turn = Vector3::new(0.0, 0.0, std::f64::consts::TAU / 1000.0);
        for _ in 0..10_000 {
            attitude = turned(attitude, turn);
        }
        assert!(attitude.angle() < 1e-9, "{}", attitude.angle());
    }
}
