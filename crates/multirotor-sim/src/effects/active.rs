//! Effects in one simulated flight.

use std::fmt;

use nalgebra::Vector3;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::definition::{Definition, Hook, Values};
use super::error::EffectError;
use super::select::resolved;
use super::{Effect, Reference};
use crate::rng::{Purpose, stream};
use crate::vehicle::{Airframe, Vehicle};

/// Deviations of drones from the fleet are drawn again beyond this many standard deviations.
const MOST_DEVIATION: f64 = 3.0;

/// Inputs of an effect before the flight.
#[derive(Clone, Debug)]
pub struct Start<'a> {
    /// Parameters of the effect, in the order of the definition.
    pub values: &'a Values,
    /// Deviation of this drone from the fleet, in standard deviations of the effect.
    pub deviation: f64,
    /// Random stream of this drone and effect alone.
    pub rng: Pcg64,
    /// Fleet's mean drone at sea level.
    pub reference: &'a Reference,
    /// Position of the drone before take-off, show frame, m.
    pub home_m: Vector3<f64>,
    /// Length of a step, s.
    pub dt_s: f64,
}

/// An effect in the flight of one drone: what it remembers, and how it acts at 400 Hz.
///
/// Only the methods that the definition's [`Hook`]s name are called; the others keep their empty
/// default. They run at every step of 2.5 ms and must not allocate.
pub trait InFlight: Copies + fmt::Debug + Send + Sync {
    /// Changes the air around the drone ([`Hook::Air`]).
    fn air(&mut self, _now: &Now, _air: &mut Air) {}

    /// Follows the flight once per step, before the commands ([`Hook::Command`]).
    fn follow(&mut self, _now: &Now) {}

    /// Command that one rotor gets in place of `command`, both 0..1 ([`Hook::Command`]).
    fn command(&self, command: f64) -> f64 {
        command
    }

    /// Changes thrust and torque, adds forces ([`Hook::Loads`]).
    fn loads(&mut self, _now: &Now, _change: &mut Change) {}

    /// Changes what the autopilot takes for its vertical speed, m/s up, `dt_s` after its last look
    /// ([`Hook::Sense`]).
    fn sense(&mut self, _dt_s: f64, _climb_mps: &mut f64) {}

    /// Changes what the log has for the vertical speed, m/s up, `dt_s` after its last look; the autopilot
    /// flies by what it was before ([`Hook::Log`]).
    fn log(&mut self, _dt_s: f64, _climb_mps: &mut f64) {}

    /// State of the battery, if the effect is one.
    fn battery(&self) -> Option<Reading> {
        None
    }

    /// Puts its memory where a steady flight has it, and leaves chance out: from then on the effect answers
    /// as it does in the mean ([`crate::sim::plant::trim`]). What has neither memory nor chance needs none.
    fn settle(&mut self, _at: &Settled) {}

    /// Standard deviation of vertical gusts that a settled effect leaves to whoever takes their mean, m/s.
    fn gust_sd_mps(&self) -> f64 {
        0.0
    }
}

/// State of slow processes in steady flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Time since the motors started, s.
    pub time_s: f64,
    /// State of the battery.
    pub supply: Supply,
    /// Drones next to this one in the array, 0 to 8; `None`: as its home has it.
    pub neighbours: Option<f64>,
}

/// State of a battery from which its voltage under load follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Supply {
    /// Charge drawn since take-off, Ah.
    Used(f64),
    /// Voltage at rest, V, whatever the battery's own discharge curve says.
    Resting(f64),
}

/// Copying of an effect in flight; every [`InFlight`] that is `Clone` has it.
pub trait Copies {
    /// A copy with its memory as it is now.
    fn copied(&self) -> Box<dyn InFlight>;
}

impl<T: InFlight + Clone + 'static> Copies for T {
    fn copied(&self) -> Box<dyn InFlight> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn InFlight> {
    fn clone(&self) -> Self {
        (**self).copied()
    }
}

/// Inputs of an effect at one step.
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

/// Changes that effects make to the rotors' loads.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Factor on thrust; effects multiply it.
    pub thrust: f64,
    /// Torque over the torque in still air at the same speed; effects add to it.
    pub torque: f64,
    /// Factors on the drag that the airframe itself has along forward, left and up; effects multiply
    /// them.
    pub drag: Vector3<f64>,
    /// Further force on the body, body axes, N.
    pub force_n: Vector3<f64>,
}

impl Default for Change {
    fn default() -> Self {
        Self { thrust: 1.0, torque: 1.0, drag: Vector3::repeat(1.0), force_n: Vector3::zeros() }
    }
}

/// State of a battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Voltage under load, V.
    pub volts: f64,
    /// Open-circuit voltage of the whole battery, V.
    pub resting_v: f64,
    /// Current of motors and avionics, A.
    pub amps: f64,
    /// Charge drawn since take-off, Ah.
    pub used_ah: f64,
    /// Charge that is left, as a share of full; below 0 when the battery gave more than it had.
    pub charge: f64,
    /// Charge of a full battery, Ah.
    pub capacity_ah: f64,
    /// Internal resistance with leads, ohm.
    pub resistance_ohm: f64,
    /// Whether the autopilot is told the voltage and compensates for it.
    pub compensated: bool,
}

/// An effect that a flight has beyond its vehicle's file, with its values.
pub type Extra = (&'static dyn Effect, Values);

#[derive(Clone)]
struct Part {
    hooks: u8,
    acting: Box<dyn InFlight>,
    name: &'static str,
}

/// The effects that act in one flight; none is the default and costs one comparison.
#[derive(Clone, Default)]
pub struct Active {
    parts: Vec<Part>,
    hooks: u8,
}

impl fmt::Debug for Active {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.parts.iter().map(|part| part.name)).finish()
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

    /// As [`Active::start`], with effects that no library lists: they act after the vehicle's own, and
    /// their values are not checked.
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
        let own = |definition: &Definition| {
            (deviation(definition, seed, drone), chance(definition, seed, drone))
        };
        Self::start_as(vehicle, extra, own, home_m, dt_s)
    }

    /// As [`Active::start`], for a drone whose deviations from the fleet are given, in standard deviations
    /// of each effect; chance is that of no drone.
    ///
    /// # Errors
    /// As [`Active::start`].
    pub fn start_deviating(
        vehicle: &Vehicle,
        deviation: impl Fn(&Definition) -> f64,
        home_m: Vector3<f64>,
        dt_s: f64,
    ) -> Result<(Self, Airframe), EffectError> {
        let own = |definition: &Definition| (deviation(definition), chance(definition, 0, 0));
        Self::start_as(vehicle, &[], own, home_m, dt_s)
    }

    fn start_as(
        vehicle: &Vehicle,
        extra: &[Extra],
        own: impl Fn(&Definition) -> (f64, Pcg64),
        home_m: Vector3<f64>,
        dt_s: f64,
    ) -> Result<(Self, Airframe), EffectError> {
        let reference = Reference::of(vehicle);
        let mut airframe = vehicle.airframe;
        let mut active = Self::default();
        for (effect, values) in resolved(vehicle)?.into_iter().chain(extra.iter().copied()) {
            let definition = effect.definition();
            let (deviation, rng) = own(definition);
            let start =
                Start { values: &values, deviation, rng, reference: &reference, home_m, dt_s };
            let Some(acting) = effect.start(&start, &mut airframe) else { continue };
            let hooks = definition.hooks.iter().fold(0, |mask, hook| mask | *hook as u8);
            active.hooks |= hooks;
            active.parts.push(Part { hooks, acting, name: definition.name });
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

    /// Changes the air around the drone.
    pub fn air(&mut self, now: &Now, air: &mut Air) {
        for part in with(&mut self.parts, Hook::Air) {
            part.acting.air(now, air);
        }
    }

    /// Lets effects on the command path follow the flight.
    pub fn follow(&mut self, now: &Now) {
        for part in with(&mut self.parts, Hook::Command) {
            part.acting.follow(now);
        }
    }

    /// Command that one rotor gets in place of `command`, both 0..1.
    pub fn command(&self, command: f64) -> f64 {
        let acting = self.parts.iter().filter(|part| part.hooks & Hook::Command as u8 != 0);
        acting.fold(command, |command, part| part.acting.command(command))
    }

    /// Changes of thrust and torque, and further forces.
    pub fn loads(&mut self, now: &Now) -> Change {
        let mut change = Change::default();
        for part in with(&mut self.parts, Hook::Loads) {
            part.acting.loads(now, &mut change);
        }
        change
    }

    /// Changes what the autopilot takes for its vertical speed, m/s up.
    pub fn sense(&mut self, dt_s: f64, climb_mps: &mut f64) {
        for part in with(&mut self.parts, Hook::Sense) {
            part.acting.sense(dt_s, climb_mps);
        }
    }

    /// Changes what the log has for the vertical speed, m/s up.
    pub fn log(&mut self, dt_s: f64, climb_mps: &mut f64) {
        for part in with(&mut self.parts, Hook::Log) {
            part.acting.log(dt_s, climb_mps);
        }
    }

    /// Puts the memory of all effects where a steady flight has it; see [`InFlight::settle`].
    pub fn settle(&mut self, at: &Settled) {
        for part in &mut self.parts {
            part.acting.settle(at);
        }
    }

    /// Standard deviation of the vertical gusts that settled effects leave out, m/s.
    pub fn gust_sd_mps(&self) -> f64 {
        self.parts.iter().map(|part| part.acting.gust_sd_mps().powi(2)).sum::<f64>().sqrt()
    }

    /// The battery, if one acts.
    pub fn battery(&self) -> Option<Reading> {
        self.parts.iter().find_map(|part| part.acting.battery())
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

/// The random stream of one drone and effect, for what happens during the flight.
fn chance(definition: &Definition, seed: u64, drone: u16) -> Pcg64 {
    stream(seed ^ hash(definition.name), u64::from(drone), Purpose::Effects)
}

/// FNV-1a: a name as a number that no release of a library changes.
fn hash(name: &str) -> u64 {
    name.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[cfg(test)]
mod tests {
    use rand::Rng as _;

    use super::super::LIBRARY;
    use super::*;

    /// Deviation of drone 3 under seed 7 for each effect, and the first number of its stream.
    const DRAWS: [(&str, f64, u64); 21] = [
        ("mass-spread", -0.063_823_343_466_044_15, 325_346_737_122_288_009),
        ("thrust-spread", 2.666_399_345_796_056, 5_479_058_648_760_249_280),
        ("air-density", 0.759_942_189_982_168_9, 14_439_030_494_600_378_327),
        ("turbulence", 0.303_914_799_219_393_6, 12_207_963_024_589_837_921),
        ("neighbour-downwash", -0.230_658_292_572_197_17, 15_335_683_801_052_301_791),
        ("thrust-curve", 0.407_090_556_830_227_55, 14_458_061_969_385_231_259),
        ("motor-thermal", -0.905_745_029_546_533_2, 16_004_134_536_043_060_479),
        ("battery", -0.588_286_263_749_746_1, 8_942_325_488_124_258_209),
        ("pulse-noise", -0.268_648_624_219_961_55, 7_388_021_891_317_039_778),
        ("rotor-inflow", -0.494_508_823_137_220_17, 3_014_171_728_495_088_284),
        ("vortex-ring", -0.827_028_263_018_044_4, 10_427_928_058_194_456_216),
        ("translational-lift", -0.091_642_293_540_451_49, 10_567_096_808_043_295_592),
        ("ground-effect", -0.544_046_891_695_008_3, 7_166_232_599_593_086_703),
        ("blade-flapping", -1.241_054_591_525_546, 5_335_166_919_643_654_586),
        ("momentum-drag", 1.351_224_193_992_771_6, 12_702_732_446_352_242_684),
        ("face-drag", -0.672_551_663_380_650_5, 18_130_604_132_095_981_021),
        ("parasitic-drag", 0.440_599_538_625_699_84, 10_695_362_410_491_381_301),
        ("response-drift", -0.271_991_150_726_748_57, 7_559_973_124_267_518_155),
        ("added-mass", -0.583_631_245_189_050_4, 14_067_041_122_870_747_768),
        ("velocity-error", 2.781_867_786_157_109_3, 5_020_864_049_965_810_683),
        ("tilt-formula", -0.325_747_776_748_847_8, 16_620_499_787_810_606_892),
    ];

    #[test]
    fn random_streams_are_pinned_by_name() {
        let drawn: Vec<(&str, f64, u64)> = LIBRARY
            .iter()
            .map(|effect| effect.definition())
            // An effect that is new has no numbers to keep yet.
            .filter(|definition| DRAWS.iter().any(|(name, ..)| *name == definition.name))
            .map(|definition| {
                let first = chance(definition, 7, 3).next_u64();
                (definition.name, deviation(definition, 7, 3), first)
            })
            .collect();
        assert_eq!(drawn, DRAWS);
    }

    #[test]
    fn a_copy_goes_on_like_the_original() {
        let mut vehicle = crate::vehicle::library::builtin("pixel").unwrap();
        for effect in LIBRARY {
            super::super::select::choose(&mut vehicle, effect.definition().name).unwrap();
        }
        let (mut one, _) = Active::start(&vehicle, 7, 3, Vector3::zeros(), 0.0025).unwrap();
        let now = Now {
            dt_s: 0.0025,
            position_m: Vector3::new(0.0, 0.0, 20.0),
            height_m: 20.0,
            relative_mps: Vector3::new(2.0, 0.0, -4.0),
            acceleration_mps2: Vector3::new(0.0, 0.0, 0.3),
            density_ratio: 0.98,
            thrust_n: 4.0,
            power_w: 60.0,
            turning: true,
        };
        let step = |active: &mut Active| {
            let mut air = Air { velocity_mps: Vector3::zeros(), density_ratio: 0.98 };
            let mut climb_mps = 1.0;
            active.air(&now, &mut air);
            active.follow(&now);
            active.sense(0.0025, &mut climb_mps);
            let change = active.loads(&now);
            (air.velocity_mps, active.command(0.5), change.thrust, climb_mps)
        };
        let first = step(&mut one);
        let mut two = one.clone();
        let (next, copied) = (step(&mut one), step(&mut two));
        assert_eq!(next, copied);
        assert_ne!(first, next, "nothing is remembered");
        assert_eq!(one.battery(), two.battery());
    }
}
