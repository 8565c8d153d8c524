//! Tables of the benchmark: which effects are hidden, how large, from which base, and which of them
//! cannot be told apart.
//!
//! This is the only place outside the effects' own files that names effects. A new line in [`ON_REQUEST`]
//! lets the benchmark hide one more, and one in [`KINDS`] lets every table hide it. It goes to the end, as
//! the random streams are keyed by the place in the list.

use super::hide::{Also, HiddenKind, Magnitude};
use super::scenario::{Base, INFLOW_SPREAD};

const ANY: &[Base] = &[Base::Airsim, Base::Inflow, Base::Pixel, Base::Phantom4, Base::Sitl];
/// The frame of ArduPilot's simulator has a thrust of its own, which what acts on rotors does not change.
const WITH_ROTORS: &[Base] = &[Base::Airsim, Base::Inflow, Base::Pixel, Base::Phantom4];
/// In AirSim a hovering drone does not feel a sink of some cm/s.
const WITH_INFLOW: &[Base] = &[Base::Inflow, Base::Pixel, Base::Phantom4];
const WITHOUT_INFLOW: &[Base] = &[Base::Airsim];
/// Bases whose airframe has a drag of its own.
const WITH_FACES: &[Base] = &[Base::Airsim, Base::Inflow];

/// An effect of the library that is hidden from any base, its size the magnitude itself.
const fn library(
    name: &'static str,
    size: &'static str,
    range: (f64, f64),
    unit: &'static str,
) -> HiddenKind {
    HiddenKind {
        name,
        effect: name,
        foreign: false,
        size,
        range,
        unit,
        magnitude: Magnitude::Value,
        also: &[],
        bases: ANY,
    }
}

/// An effect of no library, as [`library`].
const fn foreign(
    name: &'static str,
    size: &'static str,
    range: (f64, f64),
    unit: &'static str,
) -> HiddenKind {
    HiddenKind { foreign: true, ..library(name, size, range, unit) }
}

/// Effects that can be hidden, with ranges from the literature and from the field.
pub const KINDS: &[HiddenKind] = &[
    HiddenKind {
        magnitude: Magnitude::HoverSlope,
        also: &[("spread", Also::Between(INFLOW_SPREAD.0, INFLOW_SPREAD.1))],
        bases: WITHOUT_INFLOW,
        ..library("rotor-inflow", "inflow_share", (8.0, 30.0), "us/(m/s) at hover")
    },
    HiddenKind {
        magnitude: Magnitude::KnownDrag,
        ..library("parasitic-drag", "vertical_m2", (0.3, 1.0), "of the known drag")
    },
    library("battery", "exponent", (0.5, 1.0), "share of the sag that acts"),
    HiddenKind {
        magnitude: Magnitude::GainIn(5.0),
        bases: WITH_ROTORS,
        ..library("translational-lift", "inflow_share", (0.01, 0.1), "of the thrust at 5 m/s")
    },
    HiddenKind {
        magnitude: Magnitude::LossAt(-3.5),
        bases: WITH_ROTORS,
        ..library("vortex-ring", "inflow_share", (0.03, 0.12), "of the thrust at -3.5 m/s")
    },
    library("thrust-curve", "expo", (0.3, 0.7), "expo"),
    HiddenKind {
        // Warm magnets usually win over warm windings.
        magnitude: Magnitude::Negative(0.7),
        also: &[("time_s", Also::LogBetween(60.0, 200.0))],
        ..library("motor-thermal", "drift_us", (6.0, 20.0), "us, of either sign")
    },
    HiddenKind {
        magnitude: Magnitude::RotorRadii,
        bases: WITH_ROTORS,
        ..library("ground-effect", "radius_m", (1.0, 2.0), "of the rotor's radius")
    },
    HiddenKind {
        also: &[("array_m", Also::ArrayWidth)],
        bases: WITH_INFLOW,
        ..library("neighbour-downwash", "strength", (1.0, 4.0), "of the momentum disc's sink")
    },
    HiddenKind {
        bases: WITH_ROTORS,
        ..library("blade-flapping", "drag_per_weight", (0.0175, 0.035), "s/m")
    },
    library("mass-spread", "sd", (0.03, 0.06), "relative"),
    HiddenKind { bases: WITH_ROTORS, ..library("thrust-spread", "sd", (0.03, 0.06), "relative") },
    HiddenKind {
        name: "velocity-bias",
        magnitude: Magnitude::EitherSign,
        also: &[("lag_s", Also::Is(0.0)), ("sd_mps", Also::Is(0.0))],
        ..library("velocity-error", "bias_mps", (0.06, 0.3), "m/s, of either sign")
    },
    // From about 0.44 s on AirSim's quad swings up and down to its motors' limits: nobody flies a show so.
    HiddenKind {
        name: "velocity-lag",
        also: &[("bias_mps", Also::Is(0.0)), ("sd_mps", Also::Is(0.0))],
        ..library("velocity-error", "lag_s", (0.12, 0.4), "s")
    },
    HiddenKind {
        magnitude: Magnitude::EitherSign,
        also: &[("at_s", Also::FlightShare(0.3, 0.7))],
        ..foreign("step", "jump_us", (8.0, 30.0), "us, of either sign")
    },
    HiddenKind {
        also: &[
            ("wavelength_m", Also::LogBetween(25.0, 60.0)),
            ("phase_rad", Also::Between(0.0, std::f64::consts::TAU)),
        ],
        ..foreign("height-wave", "amplitude_us", (6.0, 20.0), "us")
    },
    HiddenKind {
        also: &[("time_s", Also::FlightTime)],
        ..foreign("climb-time", "slope_us", (5.0, 15.0), "us/(m/s) at the end")
    },
    HiddenKind {
        magnitude: Magnitude::EitherSign,
        also: &[("knee_mps", Also::Is(1.0))],
        ..foreign("heading", "amplitude_us", (8.0, 25.0), "us, of either sign")
    },
];

/// Effects that are hidden only where they are asked for by name: they came after the tables that are
/// compared with one another, in which each of [`KINDS`] has its turn. This list, too, grows at its end.
pub const ON_REQUEST: &[HiddenKind] = &[
    HiddenKind {
        bases: WITH_FACES,
        ..library("face-drag", "top", (0.3, 1.0), "of the airframe's own drag")
    },
    library("momentum-drag", "per_s", (0.15, 0.4), "1/s"),
    HiddenKind {
        magnitude: Magnitude::AtTheEnd,
        ..library("response-drift", "slope_us", (3.0, 12.0), "us/(m/s) at the end, of either sign")
    },
    HiddenKind {
        name: "battery-overcompensated",
        magnitude: Magnitude::Negative(1.0),
        ..library("battery", "exponent", (0.2, 0.6), "share of the sag that is too much")
    },
    HiddenKind {
        name: "log-lag",
        also: &[
            ("bias_mps", Also::Is(0.0)),
            ("sd_mps", Also::Is(0.0)),
            ("log_only", Also::Is(1.0)),
        ],
        ..library("velocity-error", "lag_s", (0.12, 0.9), "s, of the log alone")
    },
    HiddenKind {
        name: "log-bias",
        magnitude: Magnitude::EitherSign,
        also: &[("lag_s", Also::Is(0.0)), ("sd_mps", Also::Is(0.0)), ("log_only", Also::Is(1.0))],
        ..library(
            "velocity-error",
            "bias_mps",
            (0.06, 1.9),
            "m/s, of either sign, of the log alone",
        )
    },
];

/// Foreign effects, and what the library has for them to first order: naming that is no mistake.
pub const ALIKE: &[(&str, &str)] = &[("climb-time", "response-drift")];

/// An effect that can be hidden in foreign worlds.
#[derive(Clone, Copy, Debug)]
pub struct ForeignKind {
    /// Name of the effect for `--effects`, as the crate `foreign-worlds` has it.
    pub name: &'static str,
    /// Name of the library's effect that is the right answer; `None`: the library has none.
    pub like: Option<&'static str>,
    /// Parameter of the library's effect that states its size, where both have one form.
    pub size: Option<&'static str>,
    /// Bases from which it can be hidden: AirSim's stands for the thrust law, the show drone's for
    /// blades.
    pub bases: &'static [Base],
}

const BOTH: &[Base] = &[Base::Airsim, Base::Pixel];
const LAW: &[Base] = &[Base::Airsim];

const fn like(
    name: &'static str,
    like: &'static str,
    size: Option<&'static str>,
    bases: &'static [Base],
) -> ForeignKind {
    ForeignKind { name, like: Some(like), size, bases }
}

const fn unlike(name: &'static str) -> ForeignKind {
    ForeignKind { name, like: None, size: None, bases: BOTH }
}

/// Effects that can be hidden in foreign worlds.
pub const FOREIGN_KINDS: &[ForeignKind] = &[
    // Blades have an inflow of their own.
    like("inflow", "rotor-inflow", None, LAW),
    like("base-drag", "face-drag", Some("top"), LAW),
    like("body-drag", "parasitic-drag", None, BOTH),
    like("hub-force", "blade-flapping", Some("drag_per_weight"), LAW),
    like("voltage", "battery", Some("exponent"), BOTH),
    like("warming", "motor-thermal", Some("drift_us"), BOTH),
    like("vortex-dip", "vortex-ring", None, BOTH),
    like("lift", "translational-lift", None, BOTH),
    like("curve", "thrust-curve", Some("expo"), BOTH),
    like("log-lag", "velocity-error", Some("lag_s"), BOTH),
    like("log-bias", "velocity-error", Some("bias_mps"), BOTH),
    like("loop-lag", "velocity-error", Some("lag_s"), BOTH),
    like("momentum-drag", "momentum-drag", Some("per_s"), BOTH),
    like("drift", "response-drift", None, BOTH),
    unlike("icing"),
    unlike("hysteresis"),
    unlike("ceiling"),
    unlike("height-response"),
    unlike("heading-wake"),
    unlike("oscillation"),
    unlike("side-wake"),
];

/// Classes of effects that the paper's protocol cannot tell apart, fixed in advance; an effect may be in
/// several. Shared drift of the air belongs to the first, but is never named: the noise model explains it.
pub const CLASSES: &[&[&str]] = &[
    &["battery", "motor-thermal"],
    &["translational-lift", "tilt-formula", "blade-flapping", "momentum-drag"],
    &["parasitic-drag", "face-drag", "thrust-curve"],
    &["vortex-ring", "parasitic-drag", "face-drag", "thrust-curve"],
    &["mass-spread", "thrust-spread"],
];

/// Effect that is hidden in a pair with each of the others.
pub const FIRST_OF_PAIRS: &str = "rotor-inflow";

/// Further sets of effects that are hidden together.
pub const TOGETHER: &[&[&str]] = &[
    &["battery", "parasitic-drag"],
    &["battery", "translational-lift"],
    &["battery", "thrust-curve"],
    &["battery", "velocity-bias"],
    &["motor-thermal", "vortex-ring"],
    &["blade-flapping", "velocity-lag"],
    &["rotor-inflow", "battery", "translational-lift"],
    &["rotor-inflow", "battery", "parasitic-drag"],
    &["rotor-inflow", "vortex-ring", "velocity-bias"],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blind::foreign;
    use crate::effects;

    #[test]
    fn every_foreign_kind_is_in_the_crate_and_answers_to_the_library() {
        let names: Vec<_> = FOREIGN_KINDS.iter().map(|kind| kind.name).collect();
        let known: Vec<_> = foreign_worlds::hidden::KINDS.iter().map(|kind| kind.name).collect();
        assert_eq!(names, known);
        for kind in FOREIGN_KINDS {
            let like = kind.like.map(|name| effects::find(name).unwrap().definition());
            if let Some(size) = kind.size {
                assert!(like.unwrap().parameter(size).is_some(), "{}", kind.name);
            }
        }
    }

    #[test]
    fn every_name_is_an_effect_and_every_parameter_its() {
        for kind in KINDS.iter().chain(ON_REQUEST) {
            let library = || effects::find(kind.effect).map(effects::Effect::definition);
            let own = if kind.foreign {
                foreign::find(kind.effect).map(|one| one.effect.definition())
            } else {
                library()
            };
            let own = own.unwrap_or_else(|| panic!("{}", kind.effect));
            for name in kind.also.iter().map(|(name, _)| *name).chain([kind.size]) {
                assert!(own.parameter(name).is_some(), "{}.{name}", kind.effect);
            }
        }
        for (foreign_one, name) in ALIKE {
            assert!(foreign::find(foreign_one).is_some() && effects::find(name).is_some());
        }
        for name in CLASSES.concat() {
            assert!(effects::find(name).is_some(), "{name}");
        }
        for name in TOGETHER.concat().into_iter().chain([FIRST_OF_PAIRS]) {
            assert!(KINDS.iter().any(|kind| kind.name == name), "{name}");
        }
    }
}
