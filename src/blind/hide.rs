//! Effects that can be hidden; their sizes are drawn log-uniformly over usual ranges.

use std::collections::BTreeMap;

use rand_distr::{Distribution as _, StandardUniform};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::scenario::{Base, Protocol};
pub use super::tables::KINDS;
use crate::base::rng::{Purpose, stream};
use crate::effects::select::{set, value_of, values_of};
use crate::effects::{Reference, Role, Signals, find};
use crate::gap::Dependence;
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
    /// Dependences by which it may be called unknown; empty in home worlds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<String>")]
    pub depends_on: Vec<Dependence>,
}

impl Hidden {
    /// True value of the parameter that states the size of the effect.
    pub fn value(&self) -> f64 {
        self.parameters.get(&self.size).copied().unwrap_or_default()
    }
}

/// An effect that can be hidden, and the range from which its size is drawn.
#[derive(Clone, Copy, Debug)]
pub struct HiddenKind {
    /// Name of the effect for `--effects`.
    pub name: &'static str,
    /// Name of the effect in the library, or of the foreign one.
    pub effect: &'static str,
    /// Whether the effect is foreign: no library lists it.
    pub foreign: bool,
    /// Parameter that states the size of the effect.
    pub size: &'static str,
    /// Smallest and largest magnitude that is drawn, in [`HiddenKind::unit`].
    pub range: (f64, f64),
    /// Unit of [`HiddenKind::range`], for people.
    pub unit: &'static str,
    /// Rule by which the value of the parameter follows from the magnitude.
    pub magnitude: Magnitude,
    /// Further parameters that are stated, in the order in which they are drawn.
    pub also: &'static [(&'static str, Also)],
    /// Bases from which the effect can be hidden.
    pub bases: &'static [Base],
}

/// Rule by which a parameter's value follows from a magnitude.
#[derive(Clone, Copy, Debug)]
pub enum Magnitude {
    /// The value is the magnitude.
    Value,
    /// The value is the magnitude, of either sign.
    EitherSign,
    /// The value is the magnitude, negative with this probability.
    Negative(f64),
    /// The magnitude is the slope of the pulse by climb at hover, us/(m/s).
    HoverSlope,
    /// The magnitude is the thrust gained in this horizontal air, m/s, as a share of the hover thrust.
    GainIn(f64),
    /// The magnitude is the thrust lost at this climb, m/s, as a share of the hover thrust.
    LossAt(f64),
    /// The magnitude is a share of the drag that the known vehicle has; its sides grow with it.
    KnownDrag,
    /// The magnitude is in radii of the rotor.
    RotorRadii,
}

/// Value of a further parameter of a hidden effect, or how it is drawn.
#[derive(Clone, Copy, Debug)]
pub enum Also {
    /// A fixed value, in the unit of the parameter.
    Is(f64),
    /// Uniform between two numbers.
    Between(f64, f64),
    /// Log-uniform between two positive numbers.
    LogBetween(f64, f64),
    /// Width of the array, m.
    ArrayWidth,
    /// Length of the flight, s.
    FlightTime,
    /// An instant, s: uniform between two shares of the flight.
    FlightShare(f64, f64),
}

/// Finds an effect that can be hidden by its name for `--effects`.
///
/// # Errors
/// An unknown name.
pub fn kind_of(name: &str) -> Result<&'static HiddenKind, BlindError> {
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
impl HiddenKind {
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
        for (name, also) in self.also {
            let value = match *also {
                Also::Is(value) => value,
                Also::Between(low, high) => between(rng, (low, high)),
                Also::LogBetween(low, high) => log_between(rng, (low, high)),
                Also::ArrayWidth => width_m,
                Also::FlightTime => flight_s,
                Also::FlightShare(low, high) => flight_s * between(rng, (low, high)),
            };
            parameters.insert((*name).to_owned(), value);
        }
        let per_thrust = Reference::of(&known).sensitivity_us();
        let pulse = |size: f64, at: &Signals| self.pulse_us(&known, size, at);
        let value = match self.magnitude {
            Magnitude::Value => magnitude,
            Magnitude::EitherSign => sign * magnitude,
            Magnitude::Negative(chance) => {
                if unit(rng) < chance {
                    -magnitude
                } else {
                    magnitude
                }
            }
            Magnitude::HoverSlope => {
                let slope = |share| {
                    let at = |climb_mps| Signals { climb_mps, ..Signals::default() };
                    Ok((pulse(share, &at(1.0))? - pulse(share, &at(-1.0))?) / 2.0)
                };
                share_for(self.range, &mut magnitude, slope)?
            }
            Magnitude::GainIn(horizontal_mps) => {
                let at = Signals { horizontal_mps, ..Signals::default() };
                share_for(self.range, &mut magnitude, |share| Ok(-pulse(share, &at)? / per_thrust))?
            }
            Magnitude::LossAt(climb_mps) => {
                let at = Signals { climb_mps, ..Signals::default() };
                share_for(self.range, &mut magnitude, |share| Ok(pulse(share, &at)? / per_thrust))?
            }
            Magnitude::KnownDrag => {
                let [top_m2, side_m2] = match Role::BodyDragTop.value(&known) {
                    Some(top_m2) => {
                        let side_m2 = Role::BodyDragSide.value(&known).unwrap_or_default();
                        [top_m2 * (1.0 + magnitude), side_m2 * (1.0 + magnitude)]
                    }
                    // AirSim's law has its drag in the airframe.
                    None => airsim_drag_m2(&known).map(|drag_m2| drag_m2 * magnitude),
                };
                if let Some(side) = Role::BodyDragSide.place() {
                    parameters.insert(side.parameter.name.to_owned(), side_m2);
                }
                top_m2
            }
            Magnitude::RotorRadii => known.airframe.rotor_diameter_m / 2.0 * magnitude,
        };
        parameters.insert(self.size.to_owned(), value);
        let hidden = Hidden {
            kind: self.name.to_owned(),
            effect: self.effect.to_owned(),
            foreign: self.foreign,
            parameters,
            size: self.size.to_owned(),
            before: value_of(&known, self.effect, self.size),
            words: format!("{magnitude:.3} {}", self.unit),
            depends_on: Vec::new(),
        };
        Ok(hidden)
    }

    /// Pulse of the effect on a vehicle when its size is this, us.
    fn pulse_us(&self, known: &Vehicle, size: f64, at: &Signals) -> Result<f64, BlindError> {
        let mut vehicle = known.clone();
        set(&mut vehicle, self.effect, self.size, size);
        let Some(found) = find(self.effect) else { return Ok(0.0) };
        Ok(found.pulse_us(&Reference::of(known), &values_of(found, &vehicle)?, at))
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Kinds and the parameters that a seed draws for them from the first base that takes them.
    const DRAWN: [(&str, &[(&str, f64)]); 18] = [
        (
            "rotor-inflow",
            &[("inflow_share", 0.387_491_042_676_855_97), ("spread", 0.051_371_649_074_628_26)],
        ),
        (
            "parasitic-drag",
            &[
                ("horizontal_m2", 0.003_259_460_331_582_528),
                ("vertical_m2", 0.066_562_627_824_686_85),
            ],
        ),
        ("battery", &[("exponent", 0.546_020_873_383_328_3)]),
        ("translational-lift", &[("inflow_share", 0.090_882_136_868_522_76)]),
        ("vortex-ring", &[("inflow_share", 0.628_924_101_296_893_1)]),
        ("thrust-curve", &[("expo", 0.554_047_706_494_753_9)]),
        (
            "motor-thermal",
            &[("drift_us", 6.621_411_054_103_023), ("time_s", 161.882_919_919_658_83)],
        ),
        ("ground-effect", &[("radius_m", 0.172_948_849_484_590_58)]),
        ("neighbour-downwash", &[("array_m", 14.0), ("strength", 2.999_507_320_908_158)]),
        ("blade-flapping", &[("drag_per_weight", 0.031_617_153_333_920_53)]),
        ("mass-spread", &[("sd", 0.032_955_615_952_742_54)]),
        ("thrust-spread", &[("sd", 0.034_082_641_494_649_81)]),
        (
            "velocity-bias",
            &[("bias_mps", -0.078_649_712_079_209_57), ("lag_s", 0.0), ("sd_mps", 0.0)],
        ),
        ("velocity-lag", &[("bias_mps", 0.0), ("lag_s", 0.197_718_464_811_836_2), ("sd_mps", 0.0)]),
        ("step", &[("at_s", 203.392_163_555_180_93), ("jump_us", 13.310_332_843_104_264)]),
        (
            "height-wave",
            &[
                ("amplitude_us", 9.926_418_056_735_182),
                ("phase_rad", 3.911_290_728_756_779),
                ("wavelength_m", 43.240_250_090_376_18),
            ],
        ),
        ("climb-time", &[("slope_us", 6.972_465_350_566_109), ("time_s", 430.0)]),
        ("heading", &[("amplitude_us", -20.711_632_671_224_12), ("knee_mps", 1.0)]),
    ];

    #[test]
    fn a_seed_hides_what_it_always_hid() {
        // Streams are keyed by the place in the list, which grows at its end only.
        assert!(KINDS.len() >= DRAWN.len());
        for (kind, (name, parameters)) in KINDS.iter().zip(DRAWN) {
            let hidden = kind.draw(7_340_032, kind.bases[0], Protocol::Paper, 14.0).unwrap();
            let drawn: Vec<(&str, f64)> =
                hidden.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
            assert_eq!((kind.name, &drawn[..]), (name, parameters));
        }
    }
}
