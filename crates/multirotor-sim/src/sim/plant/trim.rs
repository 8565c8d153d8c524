//! Trim: steady flight without flying it.
//!
//! [`Trim`] finds the state in which the plant's own loads balance: thrust, lean, and with them the pulse, the
//! rotors' speed and the current. It calls the very functions that [`Plant::step`] integrates, effects included, so
//! what a vehicle answers to climb, wind, density, height, charge and time is written down in one place.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::rotor::ROTORS;
use super::{GRAVITY, Plant};
use crate::effects::{Active, Air, Definition, EffectError, Hook, Now, Settled, Supply};
use crate::sim::air::Surroundings;
use crate::sim::flight::STEP_S;
use crate::vehicle::Vehicle;

/// Balance is found when the acceleration that is left is below this, m/s².
const BALANCED_MPS2: f64 = 1e-9;
/// AirSim's drag jumps at the end of its dead band: beside a jump this much may be left, m/s².
const BESIDE_A_JUMP_MPS2: f64 = 5e-3;
/// Newton's method takes four steps from a hover and Broyden's seven; beside a jump it takes more.
const STEPS: usize = 24;
/// Steps of the wind in which a far lean is approached. Numerical: 2.5 m/s each in the strongest that is flown.
const WINDS: u32 = 8;
/// Step of the numerical derivatives, share of full thrust and of one.
const STEP: f64 = 1e-6;
/// The lean's horizontal part is kept below this: beyond 64 degrees no autopilot flies.
const MOST_LEAN: f64 = 0.9;
/// Share of full thrust beyond which no balance is looked for: more than any effect takes away.
const MOST_OUTPUT: f64 = 4.0;
/// Current and voltage of a battery find each other in a few steps: a step changes one by some percent of the other.
const SUPPLY_STEPS: usize = 12;
/// Places at which the mean over gusts is taken, in standard deviations from -4 to 4.
const GUST_PLACES: i32 = 16;

/// One steady moment of flight; the default is a hover in still air at sea level, 100 m above ground, with a
/// full battery and cold motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// Velocity over ground, show frame, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Velocity of the air, show frame, m/s.
    pub air_mps: Vector3<f64>,
    /// Acceleration, show frame, m/s².
    pub acceleration_mps2: Vector3<f64>,
    /// Air density as a share of sea level's.
    pub density_ratio: f64,
    /// Position, show frame, m; height counts from the ground at home.
    pub position_m: Vector3<f64>,
    /// Heading of the vehicle's nose about the show's z, rad; 0 is along the show's x.
    pub heading_rad: f64,
    /// Time since the motors started, s.
    pub time_s: f64,
    /// State of the battery.
    pub supply: Supply,
    /// Drones next to this one in the array, 0 to 8; `None`: as its home has it.
    pub neighbours: Option<f64>,
}

impl Default for Condition {
    fn default() -> Self {
        Self {
            velocity_mps: Vector3::zeros(),
            air_mps: Vector3::zeros(),
            acceleration_mps2: Vector3::zeros(),
            density_ratio: 1.0,
            position_m: Vector3::new(0.0, 0.0, 100.0),
            heading_rad: 0.0,
            time_s: 0.0,
            supply: Supply::Used(0.0),
            neighbours: None,
        }
    }
}

impl Condition {
    fn is_finite(&self) -> bool {
        let vectors = self.velocity_mps + self.air_mps + self.acceleration_mps2 + self.position_m;
        (vectors.sum() + self.density_ratio + self.heading_rad + self.time_s).is_finite()
    }

    fn around(&self, gust_mps: f64) -> Surroundings {
        let air_velocity_mps = self.air_mps + Vector3::new(0.0, 0.0, gust_mps);
        Surroundings { air_velocity_mps, density_ratio: self.density_ratio }
    }
}

/// The forces of a steady state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Share of full thrust that the rotors give.
    output: f64,
    /// Horizontal part of the thrust's direction, show frame: the sine of the lean, and where to.
    pub lean: Vector2<f64>,
    /// Command that reaches the rotors, 0 to 1.
    command: f64,
    /// Electrical power of all rotors, W.
    pub power_w: f64,
}

/// Steady state of a vehicle: its pulse, lean, rotor speed and current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trimmed {
    /// Pulse width of all rotors, us; it may lie beyond what the autopilot gives.
    pub pulse_us: f64,
    /// Horizontal part of the thrust's direction, show frame: the sine of the lean, and where to.
    pub lean: Vector2<f64>,
    /// Rotor speed, rad/s.
    pub rotor_radps: f64,
    /// Electrical power of all rotors, W.
    pub power_w: f64,
    /// Current out of the battery, A, if the vehicle has one.
    pub current_a: Option<f64>,
}

/// Steady states of one drone.
///
/// ```
/// use multirotor_sim::nalgebra::Vector3;
/// use multirotor_sim::sim::plant::trim::{Condition, Trim};
/// use multirotor_sim::vehicle::library::builtin;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut trim = Trim::of(&builtin("pixel")?)?;
/// let hover = trim.at(&Condition::default()).ok_or("it cannot hover")?;
/// let climb = Condition { velocity_mps: Vector3::new(0.0, 0.0, 2.0), ..Condition::default() };
/// let climb = trim.at(&climb).ok_or("it cannot climb")?;
/// assert!(climb.pulse_us > hover.pulse_us + 30.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Trim {
    plant: Plant,
    hover_output: f64,
    /// Inverse of the derivatives at a hover, from which a search begins that follows none.
    inverse_at_hover: Option<Matrix3<f64>>,
    /// Whether a search begins where the last one ended, and where that is.
    follows: bool,
    last: Option<Beginning>,
    gust_sd_mps: f64,
}

/// Where a quasi-Newton search begins: a state, and the inverse of the derivatives there.
#[derive(Clone, Copy, Debug)]
struct Beginning {
    at: Unknown,
    inverse: Matrix3<f64>,
}

/// The end of a search for a balance.
#[derive(Clone, Copy, Debug)]
struct Ended {
    at: Unknown,
    balances: bool,
    /// Inverse of the derivatives, as a quasi-Newton search left it.
    inverse: Option<Matrix3<f64>>,
}

/// What the forces are found for: share of full thrust, and the lean.
type Unknown = Vector3<f64>;

impl Trim {
    /// Steady states of the fleet's mean drone.
    ///
    /// # Errors
    /// An unknown effect or parameter, or a value out of bounds.
    pub fn of(vehicle: &Vehicle) -> Result<Self, EffectError> {
        Self::deviating(vehicle, Vector3::zeros(), |_| 0.0)
    }

    /// Steady states of a drone that stands at `home_m` (show frame) and deviates from the fleet by so many
    /// standard deviations of each effect.
    ///
    /// # Errors
    /// As [`Trim::of`].
    pub fn deviating(
        vehicle: &Vehicle,
        home_m: Vector3<f64>,
        deviation: impl Fn(&Definition) -> f64,
    ) -> Result<Self, EffectError> {
        // Steady states have no step; effects that state their memory per step want one.
        let (effects, airframe) = Active::start_deviating(vehicle, deviation, home_m, STEP_S)?;
        let plant = Plant::with_effects(&airframe, effects, home_m, STEP_S);
        let gust_sd_mps = plant.effects.gust_sd_mps();
        // From a third of full thrust, as most multirotors hover, to where this one does.
        let mut trim = Self {
            plant,
            hover_output: 0.35,
            inverse_at_hover: None,
            follows: false,
            last: None,
            gust_sd_mps,
        };
        let hover = Condition::default();
        trim.settle(&hover);
        let at = trim.balanced(&hover);
        trim.hover_output = at.x;
        let left = trim.left_over(&hover, &at);
        trim.inverse_at_hover = trim.inverse_at(&hover, &at, &left);
        Ok(trim)
    }

    /// Steady states for conditions that follow each other closely: each search begins with the state found last, and
    /// from a hover where that leads nowhere. What is found is as exact, and the same but for its last
    /// digits; where the vehicle can hardly fly, a state may be found that is too far from a hover.
    #[must_use]
    pub fn following(self) -> Self {
        Self { follows: true, last: None, ..self }
    }

    /// The steady state under a condition; `None` where the forces do not balance at up to four times the rotors'
    /// full thrust, or no pulse makes the rotors do it.
    pub fn at(&mut self, condition: &Condition) -> Option<Trimmed> {
        let balance = self.balance(condition)?;
        let pulse_us = self.pulse_us(&balance, condition)?;
        Some(Trimmed {
            pulse_us,
            lean: balance.lean,
            rotor_radps: self.plant.rotors.speed_radps(balance.output),
            power_w: balance.power_w,
            current_a: self.plant.battery().map(|battery| battery.amps),
        })
    }

    /// The balance of forces under a condition, whatever the supply; `None` where there is none.
    pub fn balance(&mut self, condition: &Condition) -> Option<Balance> {
        // Checked here, as the drag's dead band would take NaN for no wind.
        if !condition.is_finite() {
            return None;
        }
        self.settle(condition);
        let found = self.balanced(condition);
        let left_mps2 = self.left_over(condition, &found).norm();
        if left_mps2.is_nan() || left_mps2 > BESIDE_A_JUMP_MPS2 {
            return None;
        }
        if self.gust_sd_mps != 0.0 {
            // The torque is that between the gusts.
            self.left_over_in(condition, &found, 0.0);
        }
        let density_ratio = self.met(condition).0.density_ratio;
        let (output, torque) = (found.x, self.plant.torque);
        let command = match self.plant.sitl {
            Some(_) => output,
            None => self.plant.rotors.command_for(output, density_ratio * torque),
        };
        let power_w = self.plant.rotors.power_w(density_ratio, torque);
        Some(Balance { output, lean: found.yz(), command, power_w })
    }

    /// Pulse width of all rotors for a balance, us: what time, supply and controllers make of it. `None`: no
    /// pulse does it.
    pub fn pulse_us(&mut self, balance: &Balance, condition: &Condition) -> Option<f64> {
        self.settle(condition);
        Some(1000.0 + 1000.0 * self.given_for(balance, condition)?)
    }

    fn settle(&mut self, condition: &Condition) {
        let Condition { time_s, supply, neighbours, .. } = *condition;
        self.plant.effects.settle(&Settled { time_s, supply, neighbours });
    }

    /// Broyden's method from the last state and from a hover, where that finds no balance Newton's, and where the lean is too far from a hover for
    /// that, Newton's from wind to wind.
    fn balanced(&mut self, condition: &Condition) -> Unknown {
        let hover = Vector3::new(self.hover_output, 0.0, 0.0);
        let from_hover = self.inverse_at_hover.map(|inverse| Beginning { at: hover, inverse });
        for Beginning { at, inverse } in self.last.into_iter().chain(from_hover) {
            let ended = self.nearest(condition, at, Some(inverse));
            if ended.balances {
                self.last = ended
                    .inverse
                    .filter(|_| self.follows)
                    .map(|inverse| Beginning { at: ended.at, inverse });
                return ended.at;
            }
        }
        let Ended { at: found, balances, .. } = self.nearest(condition, hover, None);
        if balances {
            return found;
        }
        let mut from = hover;
        for step in 1..=WINDS {
            let share = f64::from(step) / f64::from(WINDS);
            let in_less =
                |speed: Vector3<f64>| speed.component_mul(&Vector3::new(share, share, 1.0));
            let velocity_mps = in_less(condition.velocity_mps);
            let air_mps = in_less(condition.air_mps);
            let less = Condition { velocity_mps, air_mps, ..*condition };
            let there = self.nearest(&less, from, None);
            if !there.balances {
                return found;
            }
            from = there.at;
        }
        from
    }

    /// The best state that was seen from one on, and whether it balances: by steps of a quasi-Newton method that begins
    /// with an inverse of the derivatives, or by Newton's.
    fn nearest(
        &mut self,
        condition: &Condition,
        from: Unknown,
        mut inverse: Option<Matrix3<f64>>,
    ) -> Ended {
        let mut at = from;
        let mut left = self.left_over(condition, &at);
        let (mut best, mut least) = (at, left.norm());
        for _ in 0..STEPS {
            let quasi = inverse.is_some();
            let Some(known) = inverse.or_else(|| self.inverse_at(condition, &at, &left)) else {
                break;
            };
            let was = at;
            at -= known * left;
            at.x = at.x.clamp(0.0, MOST_OUTPUT);
            let lean = at.yz().norm();
            if lean > MOST_LEAN {
                at.y *= MOST_LEAN / lean;
                at.z *= MOST_LEAN / lean;
            }
            let before = left;
            left = self.left_over(condition, &at);
            let norm = left.norm();
            if norm < least {
                (best, least) = (at, norm);
            }
            if norm.is_nan() || norm < BALANCED_MPS2 {
                break;
            }
            if quasi {
                // It gets no nearer: it is not for this state.
                if norm > before.norm() {
                    break;
                }
                inverse = updated(&known, &(at - was), &(left - before));
            }
        }
        Ended { at: best, balances: least < BALANCED_MPS2, inverse }
    }

    /// Inverse of the derivatives of what is left by the unknowns.
    fn inverse_at(
        &mut self,
        condition: &Condition,
        at: &Unknown,
        left: &Vector3<f64>,
    ) -> Option<Matrix3<f64>> {
        let columns = [0, 1, 2].map(|index| {
            let mut beside = *at;
            beside[index] += STEP;
            (self.left_over(condition, &beside) - left) / STEP
        });
        Matrix3::from_columns(&columns).try_inverse()
    }

    /// Acceleration beyond the condition's, m/s²: its mean over the gusts that effects bring.
    fn left_over(&mut self, condition: &Condition, at: &Unknown) -> Vector3<f64> {
        if self.gust_sd_mps == 0.0 {
            return self.left_over_in(condition, at, 0.0);
        }
        let (mut sum, mut weights) = (Vector3::zeros(), 0.0);
        for place in -GUST_PLACES..=GUST_PLACES {
            let deviation = f64::from(place) * 4.0 / f64::from(GUST_PLACES);
            let weight = (-deviation * deviation / 2.0).exp();
            sum += self.left_over_in(condition, at, deviation * self.gust_sd_mps) * weight;
            weights += weight;
        }
        sum / weights
    }

    fn left_over_in(&mut self, condition: &Condition, at: &Unknown, gust_mps: f64) -> Vector3<f64> {
        let plant = &mut self.plant;
        let rotation = leaning(at.yz(), condition.heading_rad);
        plant.motion.rotation = rotation;
        plant.motion.position_m = condition.position_m;
        plant.motion.velocity_mps = condition.velocity_mps;
        plant.motion.acceleration_mps2 = condition.acceleration_mps2;
        plant.rotors.settle(at.x);
        let around = condition.around(gust_mps);
        let (now, air) = plant.meet(&around, &condition.velocity_mps);
        let change = plant.change(&now);
        let relative = rotation.tr_mul(&(condition.velocity_mps - air.velocity_mps));
        let loads = plant.loads(&[at.x; ROTORS], &relative, &Vector3::zeros(), &air, &change);
        let mut acceleration = rotation * (loads.force_n * plant.per_mass);
        acceleration.z -= GRAVITY;
        acceleration - condition.acceleration_mps2
    }

    /// What effects see under a condition, and the air as they make it.
    fn met(&mut self, condition: &Condition) -> (Now, Air) {
        self.plant.meet(&condition.around(0.0), &condition.velocity_mps)
    }

    /// The command that the autopilot must give for a balance, 0 to 1.
    fn given_for(&mut self, balance: &Balance, condition: &Condition) -> Option<f64> {
        let wanted = balance.command;
        if !self.plant.effects.acts(Hook::Command) {
            return Some(wanted);
        }
        self.plant.rotors.settle(balance.output);
        let (mut now, _) = self.met(condition);
        (now.dt_s, now.power_w) = (0.0, balance.power_w);
        for _ in 0..SUPPLY_STEPS {
            self.plant.effects.follow(&now);
        }
        let effects = &self.plant.effects;
        // The way from command to rotor rises with the command: Newton's method on its inverse.
        let mut given = wanted;
        for _ in 0..STEPS {
            let error = effects.command(given) - wanted;
            let slope =
                (effects.command(given + STEP) - effects.command(given - STEP)) / (2.0 * STEP);
            if slope.is_nan() || slope <= 0.0 {
                return None;
            }
            given -= error / slope;
            if error.abs() < 1e-13 {
                break;
            }
        }
        given.is_finite().then_some(given)
    }
}

/// Inverse of derivatives with what a step showed of them: Broyden's update by the formula of Sherman and Morrison.
/// `None`: it has no inverse.
fn updated(
    inverse: &Matrix3<f64>,
    step: &Vector3<f64>,
    change: &Vector3<f64>,
) -> Option<Matrix3<f64>> {
    let reached = inverse * change;
    let along = step.dot(&reached);
    (along.abs() > f64::MIN_POSITIVE)
        .then(|| inverse + (step - reached) * (step.transpose() * inverse) / along)
}

/// Rotation from body to show frame of a vehicle whose thrust points along `lean` horizontally, with its nose
/// on a heading.
fn leaning(lean: Vector2<f64>, heading_rad: f64) -> Matrix3<f64> {
    let up = Vector3::new(lean.x, lean.y, (1.0 - lean.norm_squared()).max(0.0).sqrt());
    let (sin, cos) = heading_rad.sin_cos();
    // The nose stays above its heading, and at right angles to the thrust.
    let nose = Vector3::new(cos, sin, -(up.x * cos + up.y * sin) / up.z).normalize();
    Matrix3::from_columns(&[nose, up.cross(&nose), up])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::select::{choose, values_of};
    use crate::effects::{Reference, Signals, find};
    use crate::vehicle::library::builtin;

    fn trim(name: &str, effect: &str) -> Trim {
        let mut vehicle = builtin(name).unwrap();
        choose(&mut vehicle, effect).unwrap();
        Trim::of(&vehicle).unwrap()
    }

    fn climbing(climb_mps: f64) -> Condition {
        Condition { velocity_mps: Vector3::new(0.0, 0.0, climb_mps), ..Condition::default() }
    }

    #[test]
    fn quick_steps_find_the_balance_that_newtons_method_finds() {
        let vehicles = ["airsim-generic-quad", "pixel", "phantom4", "arducopter-sitl"];
        let (mut all, mut quick) = (0, 0);
        for name in vehicles {
            let mut vehicle = builtin(name).unwrap();
            for effect in ["rotor-inflow", "blade-flapping", "translational-lift"] {
                vehicle.effects.entry(effect.to_owned()).or_default().on = true;
            }
            // Not every vehicle takes them all.
            let with = Trim::of(&vehicle);
            let mut trim = with.or_else(|_| Trim::of(&builtin(name).unwrap())).unwrap();
            for step in 0..400_u32 {
                let part = |by: u32, most: f64| most * (f64::from(step * by % 401) / 200.0 - 1.0);
                let velocity_mps = Vector3::new(part(37, 6.0), part(91, 6.0), part(11, 5.0));
                let condition = Condition { velocity_mps, ..Condition::default() };
                trim.settle(&condition);
                let hover = Vector3::new(trim.hover_output, 0.0, 0.0);
                let Ended { at: newton, balances, .. } = trim.nearest(&condition, hover, None);
                let found = trim.balanced(&condition);
                all += 1;
                let inverse = trim.inverse_at_hover;
                quick += usize::from(trim.nearest(&condition, hover, inverse).balances);
                if balances {
                    assert!(
                        (found - newton).amax() < 1e-8,
                        "{name} {velocity_mps}: {found} {newton}"
                    );
                }
            }
        }
        assert!(20 * quick > 19 * all, "{quick} of {all}");
    }

    #[test]
    fn a_search_that_follows_another_finds_what_one_from_a_hover_finds() {
        let effects = ["rotor-inflow", "vortex-ring", "blade-flapping", "translational-lift"];
        for name in ["airsim-generic-quad", "pixel", "phantom4", "arducopter-sitl"] {
            let mut vehicle = builtin(name).unwrap();
            for effect in effects {
                vehicle.effects.entry(effect.to_owned()).or_default().on = true;
            }
            let with = Trim::of(&vehicle);
            let mut alone = with.or_else(|_| Trim::of(&builtin(name).unwrap())).unwrap();
            let mut following = alone.clone().following();
            let mut more = 0;
            for step in 0..2000_u32 {
                let part = |by: u32, most: f64| most * (f64::from(step * by % 401) / 200.0 - 1.0);
                // Both jumps and small steps, into descents in which the wake comes back.
                let slow = f64::from(step).sin();
                let wide = if step % 7 == 0 { 6.0 } else { 0.5 };
                let velocity_mps = Vector3::new(
                    part(37, wide) + 4.0 * slow,
                    part(91, wide),
                    part(11, wide) + 5.0 * (0.01 * f64::from(step)).sin(),
                );
                let condition = Condition { velocity_mps, ..Condition::default() };
                let (one, other) = (alone.at(&condition), following.at(&condition));
                let Some(one) = one else {
                    more += usize::from(other.is_some());
                    continue;
                };
                let other = other.unwrap_or_else(|| panic!("{name} {velocity_mps}"));
                assert!(
                    (one.pulse_us - other.pulse_us).abs() < 1e-6,
                    "{name} {velocity_mps}: {one:?} {other:?}"
                );
            }
            // Where a vehicle can hardly fly, a search from near finds what one from a hover does not.
            assert!(more < 40, "{name}: {more}");
        }
    }

    #[test]
    fn a_charge_and_its_voltage_at_rest_ask_for_the_same_pulse() {
        let mut trim = trim("pixel", "battery");
        let used = Condition { supply: Supply::Used(1.5), ..Condition::default() };
        let pulse_us = trim.at(&used).unwrap().pulse_us;
        let resting_v = trim.plant.battery().unwrap().resting_v;
        let rested = Condition { supply: Supply::Resting(resting_v), ..used };
        assert!((trim.at(&rested).unwrap().pulse_us - pulse_us).abs() < 1e-9);
        let full_us = trim.at(&Condition::default()).unwrap().pulse_us;
        assert!(pulse_us > full_us + 5.0, "{pulse_us} after {full_us}");
    }

    #[test]
    fn gusts_bend_the_mean_as_their_closed_form_says_and_leave_the_power() {
        let vehicle = builtin("airsim-generic-quad").unwrap();
        let mut calm = Trim::of(&vehicle).unwrap();
        let mut gusty = trim("airsim-generic-quad", "turbulence");
        let effect = find("turbulence").unwrap();
        let values = values_of(effect, &vehicle).unwrap();
        for climb_mps in [-3.0, -0.4, 0.0, 0.4, 3.0] {
            let at = climbing(climb_mps);
            let bent_us = gusty.at(&at).unwrap().pulse_us - calm.at(&at).unwrap().pulse_us;
            let signals = Signals { climb_mps, ..Signals::default() };
            let closed_us = effect.pulse_us(&Reference::of(&vehicle), &values, &signals);
            assert!((bent_us - closed_us).abs() < 0.1, "{climb_mps}: {bent_us}, {closed_us}");
        }
        let at = Condition::default();
        let calm_w = trim("pixel", "turbulence=off").at(&at).unwrap().power_w;
        let gusty_w = trim("pixel", "turbulence.sigma_mps=1.0").at(&at).unwrap().power_w;
        assert!((gusty_w / calm_w - 1.0).abs() < 0.02, "{gusty_w} W in gusts, {calm_w} W without");
    }

    #[test]
    fn a_place_in_the_array_is_given_or_that_of_its_home() {
        let mut trim = trim("airsim-generic-quad", "neighbour-downwash");
        let mut climb_us = |neighbours| {
            let at = Condition { neighbours, ..climbing(2.0) };
            trim.at(&at).unwrap().pulse_us
        };
        let (home_us, alone_us, home_again_us) =
            (climb_us(None), climb_us(Some(0.0)), climb_us(None));
        assert!(home_us > alone_us + 1.0, "{home_us} at home, {alone_us} alone");
        assert_eq!(home_us, home_again_us);
    }

    #[test]
    fn a_lean_into_strong_wind_is_found_step_by_step() {
        for name in ["airsim-generic-quad", "pixel", "phantom4", "arducopter-sitl"] {
            let mut trim = Trim::of(&builtin(name).unwrap()).unwrap();
            let mut lean = 0.0;
            for half_mps in 1..=36 {
                let wind_mps = 0.5 * f64::from(half_mps);
                let velocity_mps = Vector3::new(wind_mps, 0.0, -1.0);
                let at = trim.at(&Condition { velocity_mps, ..Condition::default() });
                let at = at.unwrap_or_else(|| panic!("{name} in {wind_mps} m/s"));
                assert!(
                    at.lean.x > lean && at.lean.x < lean + 0.05,
                    "{name} in {wind_mps} m/s: {at:?}"
                );
                lean = at.lean.x;
            }
        }
    }

    #[test]
    fn what_no_thrust_balances_has_no_steady_state() {
        let mut trim = trim("airsim-generic-quad", "battery=off");
        assert!(trim.at(&climbing(4.0)).is_some());
        assert_eq!(trim.at(&climbing(60.0)), None);
        assert_eq!(trim.at(&climbing(f64::NAN)), None);
    }
}
