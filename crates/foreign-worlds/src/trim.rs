//! Steady flight, found without flying it; and the balance of forces that flights integrate.

use crate::hidden::{Acting, Moment};
use crate::plant::{Flow, GRAVITY, Plant};
use crate::vector::{Axes, Vector, sum};

/// The pulse without thrust, us, and that of a full command above it: the convention of motor controllers.
pub const IDLE_US: f64 = 1000.0;
/// Pulse of a full command beyond [`IDLE_US`], us.
pub const FULL_US: f64 = 1000.0;
/// Balance is found when the acceleration that is left is below this, m/s².
const BALANCED_MPS2: f64 = 1e-10;
/// Steps of Newton's method.
const STEPS: usize = 60;
/// Largest horizontal part of the thrust's direction.
const MOST_LEAN: f64 = 0.8;

/// Surroundings of a drone at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// Velocity relative to the air, show frame, m/s; z is the climb through the air.
    pub relative_mps: Vector,
    /// Air density over sea level's.
    pub density_ratio: f64,
    /// Height above home, m.
    pub height_m: f64,
    /// Time since the motors started, s.
    pub time_s: f64,
    /// Vertical acceleration, m/s².
    pub acceleration_mps2: f64,
    /// Battery voltage over the reference.
    pub supply_ratio: f64,
    /// Whether another drone flies next to it on the left.
    pub has_left: bool,
}

impl Default for Condition {
    /// Hover in still air at sea level with a battery at its reference.
    fn default() -> Self {
        Self {
            relative_mps: [0.0; 3],
            density_ratio: 1.0,
            height_m: 40.0,
            time_s: 0.0,
            acceleration_mps2: 0.0,
            supply_ratio: 1.0,
            has_left: false,
        }
    }
}

/// A drone's body: plant, own deviation and hidden effects.
#[derive(Debug)]
pub struct Body<'a> {
    plant: &'a Plant,
    /// Thrust of this drone over the mean one's.
    thrust: f64,
    hidden: Vec<Box<dyn Acting>>,
    hover_command: f64,
}

impl<'a> Body<'a> {
    /// A drone with a thrust of its own and these effects, at a place with this density ratio.
    pub fn new(
        plant: &'a Plant,
        thrust: f64,
        hidden: Vec<Box<dyn Acting>>,
        density_ratio: f64,
    ) -> Self {
        let mut body = Self { plant, thrust: 1.0, hidden: Vec::new(), hover_command: 0.5 };
        let hover = Condition { density_ratio, ..Condition::default() };
        body.hover_command = body.steady(&hover).map_or(0.5, |steady| steady.command);
        Self { thrust, hidden, ..body }
    }

    /// Command of the mean drone in hover without hidden effects.
    pub fn hover_command(&self) -> f64 {
        self.hover_command
    }

    /// Hidden effects that act on the drone.
    pub fn hidden(&self) -> &[Box<dyn Acting>] {
        &self.hidden
    }

    /// Highest command that the controllers take.
    pub fn ceiling(&self) -> f64 {
        let each = self.hidden.iter();
        each.map(|acting| acting.ceiling(self.hover_command)).fold(1.0, f64::min)
    }

    /// Lets the effects follow the flight.
    pub fn follow(&mut self, now: &Moment, step_s: f64) {
        self.hidden.iter_mut().for_each(|acting| acting.follow(now, step_s));
    }

    /// The plant, its flow, and what effects see of a condition with the body along these axes.
    pub fn moment(&self, at: &Condition, axes: &Axes, state: f64) -> (Flow, Moment) {
        let body_mps = axes.to_body(at.relative_mps);
        let flow = Flow { relative_mps: body_mps, density_ratio: at.density_ratio };
        let loads = self.plant.loads(state, &flow);
        let moment = Moment {
            time_s: at.time_s,
            height_m: at.height_m,
            relative_mps: at.relative_mps,
            body_mps,
            acceleration_mps2: at.acceleration_mps2,
            density_ratio: at.density_ratio,
            mass_kg: self.plant.mass_kg(),
            thrust_n: loads.rotors_n[2],
            body_n: loads.body_n,
            supply_ratio: at.supply_ratio,
            hover_command: self.hover_command,
            has_left: at.has_left,
        };
        (flow, moment)
    }

    /// Acceleration of the body, show frame, m/s², with gravity.
    pub fn acceleration_mps2(&self, axes: &Axes, state: f64, flow: &Flow, now: &Moment) -> Vector {
        let loads = self.plant.loads(state, flow);
        let factor = self.hidden.iter().map(|acting| acting.thrust(now)).product::<f64>();
        let mut force = sum(loads.rotors_n.map(|part| part * factor * self.thrust), loads.body_n);
        for acting in &self.hidden {
            force = sum(force, acting.force_n(now));
        }
        let [x, y, z] = axes.to_show(force).map(|part| part / self.plant.mass_kg());
        [x, y, z - GRAVITY]
    }

    /// Command that acts on the rotors where the autopilot gives this one.
    pub fn acting_command(&self, given: f64, now: &Moment) -> f64 {
        let mut command = given;
        let mut rise_us = 0.0;
        for acting in &self.hidden {
            command = acting.command(command, now);
            rise_us += acting.pulse_us(now);
        }
        command - rise_us / FULL_US
    }

    /// Steady state under a condition; `None` where there is none.
    pub fn steady(&self, at: &Condition) -> Option<Steady> {
        let wanted = at.acceleration_mps2;
        let left = |[state, x, y]: Vector| {
            let up = [x, y, (1.0 - x * x - y * y).max(0.01).sqrt()];
            let axes = Axes::along(up);
            let (flow, now) = self.moment(at, &axes, state);
            let [ax, ay, az] = self.acceleration_mps2(&axes, state, &flow, &now);
            ([az - wanted, ax, ay], flow, now)
        };
        let largest = self.plant.largest_state();
        let mut found = [0.4 * largest, 0.0, 0.0];
        let mut rest = left(found).0;
        for _ in 0..STEPS {
            let columns = [0, 1, 2].map(|axis| {
                let step = if axis == 0 { 1e-6 * largest } else { 1e-6 };
                let mut beside = found;
                beside[axis] += step;
                let moved = left(beside).0;
                [0, 1, 2].map(|row| (moved[row] - rest[row]) / step)
            });
            let [ds, dx, dy] = solved(columns, rest)?;
            found[0] = (found[0] - ds).clamp(0.02 * largest, largest);
            found[1] -= dx;
            found[2] -= dy;
            let lean = found[1].hypot(found[2]);
            if lean > MOST_LEAN {
                found[1] *= MOST_LEAN / lean;
                found[2] *= MOST_LEAN / lean;
            }
            rest = left(found).0;
            if rest.iter().all(|part| part.abs() < BALANCED_MPS2) {
                break;
            }
        }
        if rest.iter().any(|part| part.is_nan() || part.abs() > 1e-6) {
            return None;
        }
        let (_, flow, now) = left(found);
        let command = self.given_for(self.plant.command_for(found[0], &flow), &now)?;
        Some(Steady {
            pulse_us: IDLE_US + FULL_US * command,
            command,
            lean: [found[1], found[2]],
            state: found[0],
            power_w: self.plant.power_w(found[0], &flow),
        })
    }

    /// The command that must be given for one to act.
    fn given_for(&self, wanted: f64, now: &Moment) -> Option<f64> {
        let mut given = wanted;
        for _ in 0..STEPS {
            let error = self.acting_command(given, now) - wanted;
            let step = 1e-6;
            let above = self.acting_command(given + step, now) - wanted;
            let slope = (above - error) / step;
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

/// Solution of a linear system whose matrix has these columns, by Cramer's rule.
fn solved(columns: [Vector; 3], right: Vector) -> Option<Vector> {
    let determinant = |[a, b, c]: [Vector; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
            + c[0] * (a[1] * b[2] - a[2] * b[1])
    };
    let whole = determinant(columns);
    if whole == 0.0 || !whole.is_finite() {
        return None;
    }
    Some([0, 1, 2].map(|place| {
        let mut replaced = columns;
        replaced[place] = right;
        determinant(replaced) / whole
    }))
}

/// A steady state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steady {
    /// Pulse of all rotors, us.
    pub pulse_us: f64,
    /// Command that the autopilot gives, 0 to 1.
    pub command: f64,
    /// Horizontal part of the thrust's direction, show frame: the sine of the lean, and where to.
    pub lean: [f64; 2],
    /// State of the rotors.
    pub state: f64,
    /// Electrical power of all rotors, W.
    pub power_w: f64,
}

/// Steady states of a plant with hidden effects: those of the mean drone.
#[derive(Debug)]
pub struct Trim<'a>(Body<'a>);

impl<'a> Trim<'a> {
    /// Of a plant with effects, at a place with this density ratio.
    pub fn new(plant: &'a Plant, hidden: Vec<Box<dyn Acting>>, density_ratio: f64) -> Self {
        Self(Body::new(plant, 1.0, hidden, density_ratio))
    }

    /// The steady state under a condition; `None` where there is none.
    pub fn at(&self, condition: &Condition) -> Option<Steady> {
        self.0.steady(condition)
    }
}
