//! The effects of one simulated flight.

use nalgebra::Vector3;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::definition::{Definition, Hook, Values};
use super::error::EffectError;
use super::select::resolved;
use super::{Effect, Reference};
use crate::rng::{Purpose, stream};
use crate::vehicle::{Airframe, Vehicle};

/// Numbers that an effect may remember during a flight.
pub const MAX_STATE: usize = 8;

/// Deviations of drones from the fleet are drawn again beyond this many standard deviations.
const MOST_DEVIATION: f64 = 3.0;

/// What an effect has in one flight: its parameters and what it remembers.
#[derive(Clone, Debug)]
pub struct Own {
    /// Parameters, in the order of the definition.
    pub values: Values,
    /// What it remembers from step to step.
    pub state: [f64; MAX_STATE],
    /// This drone's deviation from the fleet, in standard deviations.
    pub deviation: f64,
    /// Chance, of this drone and effect alone.
    pub rng: Pcg64,
}

/// What there is to know before the flight.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// The fleet's mean drone at sea level.
    pub reference: &'a Reference,
    /// Where the drone stands, show frame, m.
    pub home_m: Vector3<f64>,
    /// Length of a step, s.
    pub dt_s: f64,
}

/// What there is to know at one step.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Length of the step, s.
    pub dt_s: f64,
    /// Position, show frame, m.
    pub position_m: Vector3<f64>,
    /// Height above the ground under home, m.
    pub height_m: f64,
    /// Velocity relative to the air: body axes (forward, left, up), m/s.
    pub relative_mps: Vector3<f64>,
    /// Acceleration, body axes, m/s².
    pub acceleration_mps2: Vector3<f64>,
    /// Air density as a share of sea level's.
    pub density_ratio: f64,
    /// Thrust that all rotors would have in still air at their present speed, N.
    pub thrust_n: f64,
    /// Electrical power of all rotors, W.
    pub power_w: f64,
    /// Whether the rotors turn.
    pub turning: bool,
}

/// The air around the drone.
#[derive(Clone, Copy, Debug)]
pub struct Air {
    /// Velocity, show frame, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Density as a share of sea level's.
    pub density_ratio: f64,
}

/// What effects make of the rotors' loads.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Factor on thrust; effects multiply it.
    pub thrust: f64,
    /// Torque over the torque in still air at the same speed; effects add to it.
    pub torque: f64,
    /// Further force on the body, body axes, N.
    pub force_n: Vector3<f64>,
}

impl Default for Change {
    fn default() -> Self {
        Self { thrust: 1.0, torque: 1.0, force_n: Vector3::zeros() }
    }
}

/// State of a battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Voltage under load, V.
    pub volts: f64,
    /// Open-circuit voltage, V.
    pub resting_v: f64,
    /// Current, A.
    pub amps: f64,
    /// Charge used, Ah.
    pub used_ah: f64,
    /// What is left, share of full; below 0 when it gave more than it had.
    pub charge: f64,
    /// Charge of a full battery, Ah.
    pub capacity_ah: f64,
    /// Internal resistance, ohm.
    pub resistance_ohm: f64,
    /// Whether the autopilot is told the voltage and compensates for it.
    pub compensated: bool,
}

/// An effect that a flight has beyond its vehicle's file, with its values.
pub type Extra = (&'static dyn Effect, Values);

#[derive(Clone)]
struct Part {
    effect: &'static dyn Effect,
    hooks: u8,
    own: Own,
}

/// The effects that act in one flight; none is the default and costs one comparison.
#[derive(Clone, Default)]
pub struct Active {
    parts: Vec<Part>,
    hooks: u8,
}

impl std::fmt::Debug for Active {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.parts.iter().map(|part| part.effect.definition().name)).finish()
    }
}

impl Active {
    /// The effects that a vehicle's file switches on, and its airframe as this drone has it.
    ///
    /// Drones of one fleet differ by `seed` and `drone` alone.
    ///
    /// # Errors
    /// An unknown effect or parameter, or a value out of bounds.
    pub fn start(
        vehicle: &Vehicle,
        seed: u64,
        drone: u16,
        home_m: Vector3<f64>,
        dt_s: f64,
    ) -> Result<(Self, Airframe), EffectError> {
        Self::start_with(vehicle, &[], seed, drone, home_m, dt_s)
    }

    /// The same, with effects that no library lists: they act after the vehicle's own, and their
    /// values are taken as they are.
    ///
    /// # Errors
    /// As [`Active::start`].
    pub fn start_with(
        vehicle: &Vehicle,
        extra: &[Extra],
        seed: u64,
        drone: u16,
        home_m: Vector3<f64>,
        dt_s: f64,
    ) -> Result<(Self, Airframe), EffectError> {
        let reference = Reference::of(vehicle);
        let start = Start { reference: &reference, home_m, dt_s };
        let mut airframe = vehicle.airframe;
        let mut active = Self::default();
        for (effect, values) in resolved(vehicle)?.into_iter().chain(extra.iter().copied()) {
            let definition = effect.definition();
            let named = seed ^ hash(definition.name);
            let mut own = Own {
                values,
                state: [0.0; MAX_STATE],
                deviation: deviation(definition, seed, drone),
                rng: stream(named, u64::from(drone), Purpose::Effects),
            };
            effect.start(&mut own, &start, &mut airframe);
            let hooks = definition.hooks.iter().fold(0, |mask, hook| mask | *hook as u8);
            active.hooks |= hooks;
            active.parts.push(Part { effect, hooks, own });
        }
        Ok((active, airframe))
    }

    /// Whether an effect acts here.
    #[inline]
    pub fn acts(&self, hook: Hook) -> bool {
        self.hooks & hook as u8 != 0
    }

    /// Whether an effect acts at any step of the plant.
    #[inline]
    pub fn any(&self) -> bool {
        self.hooks != 0
    }

    /// Changes the air.
    pub fn air(&mut self, now: &Now, air: &mut Air) {
        for part in with(&mut self.parts, Hook::Air) {
            part.effect.air(&mut part.own, now, air);
        }
    }

    /// Lets effects on the command path follow the flight.
    pub fn follow(&mut self, now: &Now) {
        for part in with(&mut self.parts, Hook::Command) {
            part.effect.follow(&mut part.own, now);
        }
    }

    /// What becomes of one rotor's command.
    pub fn command(&self, command: f64) -> f64 {
        let acting = self.parts.iter().filter(|part| part.hooks & Hook::Command as u8 != 0);
        acting.fold(command, |command, part| part.effect.command(&part.own, command))
    }

    /// Changes of thrust and torque, and further forces.
    pub fn loads(&mut self, now: &Now) -> Change {
        let mut change = Change::default();
        for part in with(&mut self.parts, Hook::Loads) {
            part.effect.loads(&mut part.own, now, &mut change);
        }
        change
    }

    /// Changes what the autopilot takes for its vertical speed, m/s up.
    pub fn sense(&mut self, dt_s: f64, climb_mps: &mut f64) {
        for part in with(&mut self.parts, Hook::Sense) {
            part.effect.sense(&mut part.own, dt_s, climb_mps);
        }
    }

    /// The battery, if one acts.
    pub fn battery(&self) -> Option<Reading> {
        self.parts.iter().find_map(|part| part.effect.battery(&part.own))
    }
}

fn with(parts: &mut [Part], hook: Hook) -> impl Iterator<Item = &mut Part> {
    parts.iter_mut().filter(move |part| part.hooks & hook as u8 != 0)
}

/// A drone's deviation from the fleet in an effect, in standard deviations: normal, without the
/// tails beyond three.
pub fn deviation(definition: &Definition, seed: u64, drone: u16) -> f64 {
    let mut rng = stream(seed ^ hash(definition.name), u64::from(drone), Purpose::Spread);
    loop {
        let draw: f64 = StandardNormal.sample(&mut rng);
        if draw.abs() <= MOST_DEVIATION {
            return draw;
        }
    }
}

/// FNV-1a: a name as a number that no release of a library changes.
fn hash(name: &str) -> u64 {
    name.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}
