//! Effects that can be hidden; their sizes are drawn log-uniformly over usual ranges.

use std::collections::BTreeMap;

use rand_distr::{Distribution as _, StandardUniform};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::scenario::{Base, Protocol};
pub use super::tables::{KINDS, ON_REQUEST};
use crate::base::rng::{Purpose, stream};
use crate::effects::select::{set, value_of, values_of};
use crate::effects::{Reference, Role, Signals, find};
use crate::gap::Dependence;
use crate::sim::plant::sitl::Sitl;
use crate::vehicle::Vehicle;

/// One hidden effect, as the true vehicle has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hidden {
    /// What was asked for, as in [`KINDS`] or [`ON_REQUEST`].
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
    /// The value is what grows to the magnitude, of either sign, by the end of the flight: per time that the effect counts by.
    AtTheEnd,
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
    kinds().find(|kind| kind.name == name).ok_or_else(|| BlindError::Unknown {
        name: name.to_owned(),
        known: kinds().map(|kind| kind.name).collect::<Vec<_>>().join(", "),
    })
}

/// Everything that can be hidden: what each table hides, and what it hides on request.
pub fn kinds() -> impl Iterator<Item = &'static HiddenKind> {
    KINDS.iter().chain(ON_REQUEST)
}

/// Streams of [`ON_REQUEST`] begin here, so that [`KINDS`] can grow.
const FIRST_ON_REQUEST: u64 = 1_000;

/// Random stream of a kind by its place in its list: what else is hidden does not change it.
fn stream_of(name: &str) -> u64 {
    let place =
        |list: &[HiddenKind]| list.iter().position(|kind| kind.name == name).map(|at| at as u64);
    let on_request = || place(ON_REQUEST).map(|at| FIRST_ON_REQUEST + at);
    1 + place(KINDS).or_else(on_request).unwrap_or(0)
}

/// Time that an effect counts its change by, where it has one, s.
pub(super) fn counted_by_s(effect: &str, known: &Vehicle) -> Option<f64> {
    let effect = find(effect)?;
    effect.definition().parameter("time_s").map(|parameter| (parameter.default)(known))
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

/// Sizes that may be asked for go this far below and above the usual range, as factors.
const SIZES_BELOW: f64 = 10.0;
const SIZES_ABOVE: f64 = 3.0;
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
        self.draw_sized(seed, base, protocol, width_m, None)
    }

    /// Draws the effect's other parameters, and its size if it is not given, in
    /// [`HiddenKind::unit`].
    ///
    /// # Errors
    /// When the base does not take it, or not in this size.
    pub fn draw_sized(
        &'static self,
        seed: u64,
        base: Base,
        protocol: Protocol,
        width_m: f64,
        size: Option<f64>,
    ) -> Result<Hidden, BlindError> {
        if !self.bases.contains(&base) {
            let name = self.name.to_owned();
            return Err(BlindError::NotEligible { name, base: base.name() });
        }
        let known = base.known()?;
        let rng = &mut stream(seed, stream_of(self.name), Purpose::Hidden);
        let mut magnitude = log_between(rng, self.range);
        let mut sign = if unit(rng) < 0.5 { -1.0 } else { 1.0 };
        if let Some(size) = size {
            (magnitude, sign) = (self.allowed(size)?, size.signum());
        }
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
        let value = match self.magnitude {
            Magnitude::Value => magnitude,
            Magnitude::EitherSign => sign * magnitude,
            Magnitude::AtTheEnd => {
                sign * magnitude * counted_by_s(self.effect, &known).unwrap_or(flight_s) / flight_s
            }
            // What is always negative is so with whichever sign it is asked for: its name says it.
            Magnitude::Negative(chance) if size.is_some() && chance >= 1.0 => -magnitude,
            Magnitude::Negative(_) if size.is_some() => sign * magnitude,
            Magnitude::Negative(chance) => {
                if unit(rng) < chance {
                    -magnitude
                } else {
                    magnitude
                }
            }
            Magnitude::HoverSlope | Magnitude::GainIn(_) | Magnitude::LossAt(_) => {
                self.share_for(size, &mut magnitude, |share| self.magnitude_of(&known, share))?
            }
            Magnitude::KnownDrag => {
                let [top_m2, side_m2] = match Role::BodyDragTop.value(&known) {
                    Some(top_m2) => {
                        let side_m2 = Role::BodyDragSide.value(&known).unwrap_or_default();
                        [top_m2 * (1.0 + magnitude), side_m2 * (1.0 + magnitude)]
                    }
                    // Other laws have their drag in the airframe.
                    None => airframe_drag_m2(&known).map(|drag_m2| drag_m2 * magnitude),
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
            words: self.words(magnitude, value),
            depends_on: Vec::new(),
        };
        Ok(hidden)
    }

    /// Size in words: where it can be of either sign, with the one that it has.
    fn words(&self, magnitude: f64, value: f64) -> String {
        match self.magnitude {
            Magnitude::Negative(chance) if chance >= 1.0 => format!("{magnitude:.3} {}", self.unit),
            Magnitude::EitherSign | Magnitude::Negative(_) | Magnitude::AtTheEnd => {
                let signed = magnitude.copysign(value);
                format!("{signed:+.3} {}", self.unit.replace(", of either sign", ""))
            }
            _ => format!("{magnitude:.3} {}", self.unit),
        }
    }

    /// Magnitude of a share of the inflow on a vehicle, in [`HiddenKind::unit`]; of other parameters it is the value itself.
    fn magnitude_of(&self, known: &Vehicle, size: f64) -> Result<f64, BlindError> {
        let per_thrust = Reference::of(known).sensitivity_us();
        let pulse = |at: &Signals| self.pulse_us(known, size, at);
        let climbing = |climb_mps| Signals { climb_mps, ..Signals::default() };
        Ok(match self.magnitude {
            Magnitude::HoverSlope => (pulse(&climbing(1.0))? - pulse(&climbing(-1.0))?) / 2.0,
            Magnitude::GainIn(horizontal_mps) => {
                -pulse(&Signals { horizontal_mps, ..Signals::default() })? / per_thrust
            }
            Magnitude::LossAt(climb_mps) => pulse(&climbing(climb_mps))? / per_thrust,
            _ => size,
        })
    }

    /// The size that does as much in the form in which the effect was hidden as `size` does in another `form`, a parameter with
    /// its value; `None`: it is the same form, or sizes do not depend on it.
    pub(super) fn as_large(
        &self,
        known: &Vehicle,
        form: (&str, f64),
        hidden: &Hidden,
        size: f64,
    ) -> Option<f64> {
        let is_share = matches!(
            self.magnitude,
            Magnitude::HoverSlope | Magnitude::GainIn(_) | Magnitude::LossAt(_)
        );
        let parameter = find(self.effect)?.definition().parameter(form.0).filter(|_| is_share)?;
        let own = value_of(known, self.effect, form.0);
        let true_form = hidden.parameters.get(form.0).copied().or(own);
        let true_form = true_form.unwrap_or_else(|| (parameter.default)(known));
        if true_form == form.1 {
            return None;
        }
        let with = |value: f64| {
            let mut vehicle = known.clone();
            set(&mut vehicle, self.effect, form.0, value);
            vehicle
        };
        let magnitude = self.magnitude_of(&with(form.1), size).ok()?;
        let in_true_form = with(true_form);
        share_of(magnitude, (0.0, 1.0), |share| self.magnitude_of(&in_true_form, share)).ok()
    }

    /// Pulse of the effect on a vehicle when its size is this, us.
    fn pulse_us(&self, known: &Vehicle, size: f64, at: &Signals) -> Result<f64, BlindError> {
        let mut vehicle = known.clone();
        set(&mut vehicle, self.effect, self.size, size);
        let Some(found) = find(self.effect) else { return Ok(0.0) };
        Ok(found.pulse_us(&Reference::of(known), &values_of(found, &vehicle)?, at))
    }

    /// Magnitude of a size that somebody asks for, if it is one that makes sense.
    fn allowed(&self, size: f64) -> Result<f64, BlindError> {
        let (low, high) = self.range;
        let (least, most) = (low / SIZES_BELOW, high * SIZES_ABOVE);
        let has_sign = matches!(
            self.magnitude,
            Magnitude::EitherSign | Magnitude::Negative(_) | Magnitude::AtTheEnd
        );
        let magnitude = if has_sign { size.abs() } else { size };
        if (least..=most).contains(&magnitude) {
            return Ok(magnitude);
        }
        Err(self.not_of_size(size, least, most))
    }

    fn not_of_size(&self, size: f64, least: f64, most: f64) -> BlindError {
        BlindError::Size { name: self.name, size, least, most, unit: self.unit }
    }

    /// The share of inflow that has this magnitude. A magnitude that no share of a rotor has is drawn
    /// again within those that there are, its place in the range kept; one that was `asked` for is
    /// refused.
    fn share_for(
        &self,
        asked: Option<f64>,
        magnitude: &mut f64,
        size: impl Fn(f64) -> Result<f64, BlindError>,
    ) -> Result<f64, BlindError> {
        let most = size(MOST_SHARE)?;
        let (low, high) = self.range;
        if let Some(asked) = asked {
            let least = size(LEAST_SHARE)?;
            if !(least..=most).contains(&asked) {
                return Err(self.not_of_size(asked, least, most));
            }
        } else if most < high {
            let place = (*magnitude / low).ln() / (high / low).ln();
            *magnitude = low * (most.max(low) / low).powf(place);
        }
        share_of(*magnitude, (LEAST_SHARE, MOST_SHARE), size)
    }
}

/// The share of inflow between two that has a magnitude; the nearer end, if none has.
fn share_of(
    magnitude: f64,
    (mut below, mut above): (f64, f64),
    size: impl Fn(f64) -> Result<f64, BlindError>,
) -> Result<f64, BlindError> {
    for _ in 0..60 {
        let middle = f64::midpoint(below, above);
        if size(middle)? < magnitude { below = middle } else { above = middle }
    }
    Ok(f64::midpoint(below, above))
}

/// Drag of an airframe as drag coefficient times area, from above and from the side, m²: that of AirSim's
/// body box and discs, or of the frame of ArduPilot's simulator.
fn airframe_drag_m2(vehicle: &Vehicle) -> [f64; 2] {
    let frame = &vehicle.airframe;
    if let Some(sitl) = &frame.sitl {
        return [Sitl::new(sitl, frame.mass_kg).drag_area_m2(); 2];
    }
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

    #[test]
    fn what_is_hidden_on_request_is_drawn_from_its_own_stream_within_its_range() {
        let streams: std::collections::BTreeSet<u64> =
            kinds().map(|kind| stream_of(kind.name)).collect();
        assert_eq!(streams.len(), kinds().count());
        for kind in ON_REQUEST {
            for (seed, base) in (0..20).flat_map(|seed| kind.bases.iter().map(move |b| (seed, *b)))
            {
                let hidden = kind.draw(seed, base, Protocol::Paper, 14.0).unwrap();
                // What grows is stated for the time that the effect counts by, and drawn by the end of the flight.
                let by_the_end = match kind.magnitude {
                    Magnitude::AtTheEnd => {
                        let known = base.known().unwrap();
                        Protocol::Paper.length_s() / counted_by_s(kind.effect, &known).unwrap()
                    }
                    _ => 1.0,
                };
                let magnitude = by_the_end * hidden.value().abs();
                assert!((kind.range.0..=kind.range.1).contains(&magnitude), "{hidden:?}");
                let mut vehicle = base.known().unwrap();
                for (name, value) in &hidden.parameters {
                    set(&mut vehicle, kind.effect, name, *value);
                }
                values_of(find(kind.effect).unwrap(), &vehicle).unwrap();
            }
        }
        let draw = |name: &str| {
            kind_of(name).unwrap().draw(7, Base::Airsim, Protocol::Paper, 14.0).unwrap().value()
        };
        assert!(draw("battery-overcompensated") < 0.0);
        for size in [0.5, -0.5] {
            let kind = kind_of("battery-overcompensated").unwrap();
            let hidden =
                kind.draw_sized(7, Base::Airsim, Protocol::Paper, 14.0, Some(size)).unwrap();
            assert_eq!(hidden.value(), -0.5, "asked for as {size}");
            assert!(hidden.words.starts_with("0.500 share"), "{}", hidden.words);
        }
        let drift = kind_of("response-drift").unwrap();
        let sized =
            drift.draw_sized(7, Base::Airsim, Protocol::Enhanced, 14.0, Some(-9.0)).unwrap();
        let of_600_s = -9.0 * 600.0 / Protocol::Enhanced.length_s();
        assert!((sized.value() - of_600_s).abs() < 1e-12, "{sized:?}");
        assert_eq!(sized.words, "-9.000 us/(m/s) at the end");
        assert!(!sized.parameters.contains_key("time_s"), "the model's own");
    }
}
