//! Effects that can be hidden; their sizes are drawn log-uniformly over usual ranges.

use std::collections::BTreeMap;

use rand_distr::{Distribution as _, StandardUniform};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::scenario::{Base, Protocol};
use super::vehicles::set;
use crate::base::rng::{Purpose, stream};
use crate::effects::select::{value_of, values_of};
use crate::effects::{Reference, Signals, find};
use crate::vehicle::Vehicle;

/// One hidden effect, as the true vehicle has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hidden {
    /// What was asked for, as in [`KINDS`].
    pub kind: String,
    /// Name of the effect in the library, or of the foreign one.
    pub effect: String,
    /// Whether no library lists it.
    pub foreign: bool,
    /// Its parameters that are stated.
    pub parameters: BTreeMap<String, f64>,
    /// The parameter that says how large it is.
    pub size: String,
    /// Value of that parameter in the known vehicle; absent: it does not have the effect.
    pub before: Option<f64>,
    /// How large it was drawn, in words.
    pub words: String,
}

impl Hidden {
    /// True value of the parameter that states the size of the effect.
    pub fn value(&self) -> f64 {
        self.parameters.get(&self.size).copied().unwrap_or_default()
    }
}

/// An effect that can be hidden, and the range from which its size is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Name of the effect for `--effects`.
    pub name: &'static str,
    /// Name of the effect in the library, or of the foreign one.
    pub effect: &'static str,
    /// Whether the effect is foreign: no library lists it.
    pub foreign: bool,
    /// Parameter that states the size of the effect.
    pub size: &'static str,
    /// Smallest and largest magnitude that is drawn, in [`Kind::unit`].
    pub range: (f64, f64),
    /// Unit of [`Kind::range`], for people.
    pub unit: &'static str,
    /// Bases from which the effect can be hidden.
    pub bases: &'static [Base],
}

const ANY: &[Base] = &[Base::Airsim, Base::Inflow, Base::Pixel];
/// In AirSim a hovering drone does not feel a sink of some cm/s.
const WITH_INFLOW: &[Base] = &[Base::Inflow, Base::Pixel];
const WITHOUT_INFLOW: &[Base] = &[Base::Airsim];

const fn kind(
    name: &'static str,
    effect: &'static str,
    size: &'static str,
    range: (f64, f64),
    unit: &'static str,
    bases: &'static [Base],
) -> Kind {
    Kind { name, effect, foreign: false, size, range, unit, bases }
}

const fn foreign(
    name: &'static str,
    size: &'static str,
    range: (f64, f64),
    unit: &'static str,
) -> Kind {
    Kind { name, effect: name, foreign: true, size, range, unit, bases: ANY }
}

/// Effects that can be hidden, with ranges from the literature and from the field.
pub const KINDS: &[Kind] = &[
    kind(
        "rotor-inflow",
        "rotor-inflow",
        "inflow_share",
        (8.0, 30.0),
        "us/(m/s) at hover",
        WITHOUT_INFLOW,
    ),
    kind("parasitic-drag", "parasitic-drag", "vertical_m2", (0.3, 1.0), "of the known drag", ANY),
    kind("battery", "battery", "exponent", (0.5, 1.0), "share of the sag that acts", ANY),
    kind(
        "translational-lift",
        "translational-lift",
        "inflow_share",
        (0.01, 0.1),
        "of the thrust at 5 m/s",
        ANY,
    ),
    kind(
        "vortex-ring",
        "vortex-ring",
        "inflow_share",
        (0.03, 0.12),
        "of the thrust at -3.5 m/s",
        ANY,
    ),
    kind("thrust-curve", "thrust-curve", "expo", (0.3, 0.7), "expo", ANY),
    kind("motor-thermal", "motor-thermal", "drift_us", (6.0, 20.0), "us, of either sign", ANY),
    kind("ground-effect", "ground-effect", "radius_m", (1.0, 2.0), "of the rotor's radius", ANY),
    kind(
        "neighbour-downwash",
        "neighbour-downwash",
        "strength",
        (1.0, 4.0),
        "of the momentum disc's sink",
        WITH_INFLOW,
    ),
    kind("blade-flapping", "blade-flapping", "drag_per_weight", (0.0175, 0.035), "s/m", ANY),
    kind("mass-spread", "mass-spread", "sd", (0.03, 0.06), "relative", ANY),
    kind("thrust-spread", "thrust-spread", "sd", (0.03, 0.06), "relative", ANY),
    kind("velocity-bias", "velocity-error", "bias_mps", (0.06, 0.3), "m/s, of either sign", ANY),
    // From about 0.44 s on AirSim's quad swings up and down to its motors' limits: nobody flies a show so.
    kind("velocity-lag", "velocity-error", "lag_s", (0.12, 0.4), "s", ANY),
    foreign("step", "jump_us", (8.0, 30.0), "us, of either sign"),
    foreign("height-wave", "amplitude_us", (6.0, 20.0), "us"),
    foreign("climb-time", "slope_us", (5.0, 15.0), "us/(m/s) at the end"),
    foreign("heading", "amplitude_us", (8.0, 25.0), "us, of either sign"),
];

/// Finds an effect that can be hidden by its name for `--effects`.
///
/// # Errors
/// An unknown name.
pub fn kind_of(name: &str) -> Result<&'static Kind, BlindError> {
    KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| BlindError::Unknown {
        name: name.to_owned(),
        known: KINDS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", "),
    })
}

/// A number drawn uniformly from 0 to 1.
pub(super) fn unit(rng: &mut Pcg64) -> f64 {
    StandardUniform.sample(rng)
}

/// Uniform between two numbers.
pub(super) fn between(rng: &mut Pcg64, (low, high): (f64, f64)) -> f64 {
    low + (high - low) * unit(rng)
}

/// Log-uniform between two positive numbers.
pub(super) fn log_between(rng: &mut Pcg64, (low, high): (f64, f64)) -> f64 {
    (low * (high / low).powf(unit(rng))).clamp(low, high)
}

/// Largest share of the inflow that is drawn: beyond it rotors are windmills.
const MOST_SHARE: f64 = 0.8;
/// Smallest share of the inflow that is drawn.
const LEAST_SHARE: f64 = 0.005;
/// Speed at which translational lift is stated, m/s.
const LIFT_MPS: f64 = 5.0;
/// Climb at which the vortex ring is stated, m/s.
const RING_MPS: f64 = -3.5;

impl Kind {
    /// Draws the size of the effect and its other parameters.
    ///
    /// # Errors
    /// When the base does not take it.
    pub fn draw(
        &'static self,
        seed: u64,
        base: Base,
        protocol: Protocol,
        width_m: f64,
    ) -> Result<Hidden, BlindError> {
        if !self.bases.contains(&base) {
            let name = self.name.to_owned();
            return Err(BlindError::NotEligible { name, base: base.name() });
        }
        let known = base.known()?;
        // Each kind has a stream of its own: what else is hidden does not change it.
        let place = KINDS.iter().position(|kind| kind.name == self.name).unwrap_or(0);
        let rng = &mut stream(seed, 1 + place as u64, Purpose::Hidden);
        let mut magnitude = log_between(rng, self.range);
        let sign = if unit(rng) < 0.5 { -1.0 } else { 1.0 };
        let flight_s = protocol.length_s();
        let mut parameters = BTreeMap::new();
        let mut also = |name: &str, value: f64| {
            parameters.insert(name.to_owned(), value);
        };
        let value = match self.name {
            "rotor-inflow" => {
                also("spread", between(rng, super::scenario::INFLOW_SPREAD));
                let slope = |share| {
                    let at = |climb_mps| Signals { climb_mps, ..Signals::default() };
                    let pulse = |climb| pulse_us(&known, self.effect, share, &at(climb));
                    Ok((pulse(1.0)? - pulse(-1.0)?) / 2.0)
                };
                share_for(self.range, &mut magnitude, slope)?
            }
            "translational-lift" => {
                let at = Signals { horizontal_mps: LIFT_MPS, ..Signals::default() };
                let per_thrust = Reference::of(&known).sensitivity_us();
                let saved = |share| Ok(-pulse_us(&known, self.effect, share, &at)? / per_thrust);
                share_for(self.range, &mut magnitude, saved)?
            }
            "vortex-ring" => {
                let at = Signals { climb_mps: RING_MPS, ..Signals::default() };
                let per_thrust = Reference::of(&known).sensitivity_us();
                let lost = |share| Ok(pulse_us(&known, self.effect, share, &at)? / per_thrust);
                share_for(self.range, &mut magnitude, lost)?
            }
            "parasitic-drag" => {
                let had = |parameter| value_of(&known, "parasitic-drag", parameter);
                if let Some(vertical_m2) = had("vertical_m2") {
                    let side_m2 = had("horizontal_m2").unwrap_or_default();
                    also("horizontal_m2", side_m2 * (1.0 + magnitude));
                    vertical_m2 * (1.0 + magnitude)
                } else {
                    // AirSim's law has its drag in the airframe.
                    let [vertical_m2, side_m2] = airsim_drag_m2(&known);
                    also("horizontal_m2", side_m2 * magnitude);
                    vertical_m2 * magnitude
                }
            }
            "motor-thermal" => {
                also("time_s", log_between(rng, (60.0, 200.0)));
                // Warm magnets usually win over warm windings.
                if unit(rng) < 0.7 { -magnitude } else { magnitude }
            }
            "ground-effect" => known.airframe.rotor_diameter_m / 2.0 * magnitude,
            "neighbour-downwash" => {
                also("array_m", width_m);
                magnitude
            }
            "velocity-bias" => {
                also("lag_s", 0.0);
                also("sd_mps", 0.0);
                sign * magnitude
            }
            "velocity-lag" => {
                also("bias_mps", 0.0);
                also("sd_mps", 0.0);
                magnitude
            }
            "step" => {
                also("at_s", flight_s * between(rng, (0.3, 0.7)));
                sign * magnitude
            }
            "height-wave" => {
                also("wavelength_m", log_between(rng, (25.0, 60.0)));
                also("phase_rad", between(rng, (0.0, std::f64::consts::TAU)));
                magnitude
            }
            "climb-time" => {
                also("time_s", flight_s);
                magnitude
            }
            "heading" => {
                also("knee_mps", 1.0);
                sign * magnitude
            }
            _ => magnitude,
        };
        also(self.size, value);
        let hidden = Hidden {
            kind: self.name.to_owned(),
            effect: self.effect.to_owned(),
            foreign: self.foreign,
            parameters,
            size: self.size.to_owned(),
            before: value_of(&known, self.effect, self.size),
            words: format!("{magnitude:.3} {}", self.unit),
        };
        Ok(hidden)
    }
}

/// Pulse of an effect of the library with this share of inflow, us.
fn pulse_us(
    known: &Vehicle,
    effect: &str,
    share: f64,
    signals: &Signals,
) -> Result<f64, BlindError> {
    let mut vehicle = known.clone();
    set(&mut vehicle, effect, "inflow_share", share);
    let Some(found) = find(effect) else { return Ok(0.0) };
    Ok(found.pulse_us(&Reference::of(known), &values_of(found, &vehicle)?, signals))
}

/// The share of inflow that has this magnitude. A magnitude that no share of a rotor has is drawn
/// again within those that there are: its place in the range is kept.
fn share_for(
    (low, high): (f64, f64),
    magnitude: &mut f64,
    size: impl Fn(f64) -> Result<f64, BlindError>,
) -> Result<f64, BlindError> {
    let most = size(MOST_SHARE)?;
    if most < high {
        let place = (*magnitude / low).ln() / (high / low).ln();
        *magnitude = low * (most.max(low) / low).powf(place);
    }
    let (mut below, mut above) = (LEAST_SHARE, MOST_SHARE);
    for _ in 0..60 {
        let middle = f64::midpoint(below, above);
        if size(middle)? < *magnitude { below = middle } else { above = middle }
    }
    Ok(f64::midpoint(below, above))
}

/// AirSim's drag of the body box and the discs as drag coefficient times area: from above, from the
/// side, m².
fn airsim_drag_m2(vehicle: &Vehicle) -> [f64; 2] {
    let frame = &vehicle.airframe;
    let [length, width, height] = frame.body_m;
    let discs_m2 = 4.0 * std::f64::consts::PI * frame.rotor_diameter_m.powi(2);
    let sides_m2 = 4.0 * std::f64::consts::PI * frame.rotor_diameter_m * frame.rotor_height_m;
    let coefficient = frame.drag_coefficient;
    [coefficient * (length * width + discs_m2), coefficient * (width * height + sides_m2)]
}
