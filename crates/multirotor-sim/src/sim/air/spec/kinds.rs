//! Kinds of air that can be asked for by name: their keys, units, bounds and defaults.

/// A key of a [`AirKind`], with its unit, bounds and default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Name of the key, as in `sd=0.5`.
    pub name: &'static str,
    /// Unit of the value; empty for plain numbers.
    pub unit: &'static str,
    /// Value when the key is not given.
    pub default: Preset,
    /// Smallest and largest value allowed, in the key's unit.
    pub range: (f64, f64),
    /// Meaning of the key, for people.
    pub help: &'static str,
}

/// Value of a key that is not given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preset {
    /// No value: the key must be given.
    Required,
    /// This value, in the key's unit.
    Value(f64),
    /// A value that depends on other keys, as the words say.
    Derived(&'static str),
}

/// A kind of air and its keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirKind {
    /// Name of the kind, as in `field:sd=0.5`.
    pub name: &'static str,
    /// Description of the kind of air, for people.
    pub help: &'static str,
    /// Keys that the kind takes.
    pub keys: &'static [Key],
    /// Keys whose values are words. The first is required, and may be given without its key, in front.
    pub words: &'static [Word],
}

/// A key whose value is a word: a path, or one of several names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// Name of the key.
    pub name: &'static str,
    /// Meaning of the key, and what it is without a value, for people.
    pub help: &'static str,
    /// Values that are allowed; empty: any text.
    pub choices: &'static [&'static str],
}

const fn key(
    name: &'static str,
    unit: &'static str,
    default: Preset,
    range: (f64, f64),
    help: &'static str,
) -> Key {
    Key { name, unit, default, range, help }
}

use Preset::{Derived, Required, Value};

const SPEED: (f64, f64) = (0.0, 30.0);
const DEGREES: (f64, f64) = (-360.0, 360.0);
const LENGTH: (f64, f64) = (1.0, 1e6);
const MEAN_WIND: Preset = Derived("the mean wind");

const WIND: Key = key("wind", "m/s", MEAN_WIND, SPEED, "speed at which it is carried along");
const FROM: Key = key("from", "deg", Value(270.0), DEGREES, "where the wind comes from");
const MODES: Key = key("modes", "", Value(600.0), (50.0, 20_000.0), "number of waves");
const W_STAR: Key = key("w_star", "m/s", Value(2.0), (0.0, 10.0), "convective velocity scale w*");
const ZI: Key = key("zi", "m", Value(1_400.0), (100.0, 6_000.0), "height of the inversion");

/// Kinds of air, in the order of the help text.
pub const KINDS: &[AirKind] = &[
    AirKind { name: "still", help: "no motion", keys: &[], words: &[] },
    AirKind {
        name: "uniform",
        help: "the same everywhere and always",
        keys: &[
            key("east", "m/s", Value(0.0), (-30.0, 30.0), "velocity towards east"),
            key("north", "m/s", Value(0.0), (-30.0, 30.0), "velocity towards north"),
            key("up", "m/s", Value(0.0), (-20.0, 20.0), "velocity upwards"),
        ],
        words: &[],
    },
    AirKind {
        name: "wind",
        help: "the same horizontal wind everywhere and always",
        keys: &[key("speed", "m/s", Required, SPEED, "wind speed"), FROM],
        words: &[],
    },
    AirKind {
        name: "profile",
        help: "wind that grows with height: logarithmic, or a power law if alpha is given",
        keys: &[
            key("speed", "m/s", Required, SPEED, "speed at the reference height"),
            FROM,
            key("height", "m", Value(10.0), (2.0, 1_000.0), "reference height above ground"),
            key("z0", "m", Value(0.03), (1e-5, 0.99), "roughness length of the log law"),
            key("alpha", "", Derived("the log law"), (0.0, 0.6), "exponent of the power law"),
        ],
        words: &[],
    },
    AirKind {
        name: "drone-constant",
        help: "a separate constant updraft for each drone",
        keys: &[key("sd", "m/s", Required, (0.0, 10.0), "standard deviation between drones")],
        words: &[],
    },
    AirKind {
        name: "thermals",
        help: "thermals after Allen (2006), drifting with the wind",
        keys: &[
            W_STAR,
            ZI,
            key("n", "", Value(3.0), (1.0, 1_000.0), "thermals in the repeating square"),
            key("x", "m", Derived("random"), (-1e5, 1e5), "show x of the first one at time 0"),
            key("y", "m", Derived("random"), (-1e5, 1e5), "show y of the first one at time 0"),
            WIND,
            FROM,
        ],
        words: &[],
    },
    AirKind {
        name: "lenschow",
        help: "convective turbulence that grows with height (Lenschow 1980), as a random field",
        keys: &[
            W_STAR,
            ZI,
            key(
                "height",
                "m",
                Value(100.0),
                (1.0, 5_000.0),
                "height at which lambda and tau apply",
            ),
            key("lambda", "m", Derived("0.28 zi sqrt(height/zi)"), LENGTH, "correlation length"),
            key("tau", "s", Derived("lambda / sd at height"), LENGTH, "correlation time"),
            WIND,
            FROM,
            MODES,
        ],
        words: &[],
    },
    AirKind {
        name: "field",
        help: "random vertical velocity with exponential correlations",
        keys: &[
            key("sd", "m/s", Value(0.5), (0.0, 10.0), "standard deviation"),
            key("lambda", "m", Value(145.0), LENGTH, "correlation length along show x"),
            key("lambda_y", "m", Derived("lambda"), LENGTH, "along show y"),
            key("lambda_z", "m", Derived("lambda"), LENGTH, "along the vertical"),
            key("tau", "s", Value(186.0), LENGTH, "correlation time in the moving air"),
            WIND,
            FROM,
            MODES,
        ],
        words: &[],
    },
    AirKind {
        name: "les",
        help: "output of a large-eddy simulation (NetCDF): les:FILE.nc,...",
        keys: LES_KEYS,
        words: &[
            Word { name: "file", help: "PALM, MicroHH, CM1, or any with a map", choices: &[] },
            Word {
                name: "map",
                help: "TOML file with the names of its variables [known models]",
                choices: &[],
            },
            Word {
                name: "mode",
                help: "replay: as it went on; advect: one time, carried by the wind [replay]",
                choices: &["replay", "advect"],
            },
        ],
    },
    AirKind { name: "dryden", help: "gusts with the Dryden spectrum", keys: GUST_KEYS, words: &[] },
    AirKind {
        name: "von-karman",
        help: "gusts with the von Karman spectrum",
        keys: GUST_KEYS,
        words: &[],
    },
];

const GUST_KEYS: &[Key] = &[
    key("sd", "m/s", Value(0.5), (0.0, 10.0), "standard deviation of each axis"),
    key(
        "length",
        "m",
        Value(50.0),
        LENGTH,
        "integral length; near the ground about the height above it",
    ),
    WIND,
    FROM,
    MODES,
];

const LES_KEYS: &[Key] = &[
    key("start", "s", Derived("its first"), (-1e9, 1e12), "the model's time at show time 0"),
    key("x", "m", Derived("the middle"), (-1e7, 1e7), "the model's x at the show's origin"),
    key("y", "m", Derived("the middle"), (-1e7, 1e7), "the model's y at the show's origin"),
    key("ground", "m", Value(0.0), (-1e3, 1e4), "the model's height at the show's ground"),
    key("x_towards", "deg", Value(90.0), DEGREES, "compass direction of the model's x axis"),
    key("repeat", "", Value(1.0), (0.0, 1.0), "1: repeated in x and y; 0: ends at its edges"),
    key("wind", "m/s", Derived("the model's own"), SPEED, "advect: speed at which it is carried"),
    FROM,
];

/// Kind of air by its name; `None` if there is none.
pub fn kind(name: &str) -> Option<&'static AirKind> {
    KINDS.iter().find(|kind| kind.name == name)
}

impl AirKind {
    /// Key of this kind by its name; `None` if it has none.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// Names of the kind's keys, for messages.
    pub fn key_names(&self) -> String {
        let words = self.words.iter().map(|word| word.name);
        words.chain(self.keys.iter().map(|key| key.name)).collect::<Vec<_>>().join(", ")
    }
}

/// Table of all kinds and keys as text, for `--help` and the documentation.
pub fn help_text() -> String {
    use std::fmt::Write as _;
    let mut text = String::new();
    for kind in KINDS {
        let _ = writeln!(text, "  {:<15} {}", kind.name, kind.help);
        for word in kind.words {
            let _ = writeln!(text, "    {:<13} {}", word.name, word.help);
        }
        for key in kind.keys {
            let unit = if key.unit.is_empty() { String::new() } else { format!(" {}", key.unit) };
            let default = match key.default {
                Required => "required".to_owned(),
                Value(value) => format!("{value}{unit}"),
                Derived(words) => words.to_owned(),
            };
            let _ = writeln!(text, "    {:<13} {} [{default}]", key.name, key.help);
        }
    }
    text
}
