//! Air asked for by name: `field:sd=0.5,lambda=145`, or a TOML file with several components.
//!
//! One text names one component; components add up. [`KINDS`] is the table of what there is.

mod build;
mod file;
mod kinds;

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

pub use build::{Air, build};
pub use file::{AIR_SCHEMA, builtin_names, from_toml, load};
pub use kinds::{AirKind, KINDS, Key, Preset, help_text, kind};

use untrusted_io::file::FileError;
use untrusted_io::plain::plain;

/// One component of the air: its kind and the keys that were given.
///
/// Its text ([`fmt::Display`]) is what [`FromStr`] reads.
#[derive(Clone, Debug, PartialEq)]
pub struct AirSpec {
    kind: &'static AirKind,
    /// In the kind's order of keys; `None`: not given.
    values: Vec<Option<f64>>,
}

/// Error of a text that does not specify any air.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AirSpecError {
    /// The kind of air does not exist.
    #[error(
        "there is no kind of air \"{}\"; the kinds are {known}; or give a .toml file of several \
         ({builtin})",
        plain(name)
    )]
    UnknownKind {
        /// Name as asked for.
        name: String,
        /// Names of the kinds that exist, for the message.
        known: String,
        /// Names of the files that come with the program.
        builtin: String,
    },
    /// The kind has no such key.
    #[error("{kind} has no \"{}\"; {allowed}", plain(key))]
    UnknownKey {
        /// Name of the kind of air.
        kind: &'static str,
        /// Name of the key.
        key: String,
        /// Keys that the kind takes, for the message.
        allowed: String,
    },
    /// The text is not of the form `key=number`.
    #[error("{kind}: \"{}\" is not KEY=NUMBER", plain(text))]
    NotAPair {
        /// Name of the kind of air.
        kind: &'static str,
        /// Text that was read instead of a pair.
        text: String,
    },
    /// A key is given twice.
    #[error("{kind}: {key} is given twice")]
    Twice {
        /// Name of the kind of air.
        kind: &'static str,
        /// Name of the key.
        key: &'static str,
    },
    /// A value is outside of its bounds.
    #[error("{kind}: {key} is {value}, but must be from {low} to {high}{unit}")]
    OutOfRange {
        /// Name of the kind of air.
        kind: &'static str,
        /// Name of the key.
        key: &'static str,
        /// Value that was given.
        value: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
        /// Unit of the bounds, with a space before it.
        unit: String,
    },
    /// A key that the kind requires is missing.
    #[error("{kind} needs {key} ({help})")]
    Missing {
        /// Name of the kind of air.
        kind: &'static str,
        /// Name of the key.
        key: &'static str,
        /// Meaning of the key, for people.
        help: &'static str,
    },
    /// The keys do not go together.
    #[error("{kind}: {why}")]
    Conflict {
        /// Name of the kind of air.
        kind: &'static str,
        /// Reason why the values do not fit together.
        why: &'static str,
    },
    /// A file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file is not valid.
    #[error("{}: {reason}", plain(file))]
    Toml {
        /// Name of the file.
        file: String,
        /// Place and nature of the problem.
        reason: String,
    },
}

impl AirSpec {
    /// A component of a kind without any key given.
    ///
    /// # Errors
    /// [`AirSpecError::UnknownKind`].
    fn of_kind(name: &str) -> Result<Self, AirSpecError> {
        let kind = kind(name).ok_or_else(|| AirSpecError::UnknownKind {
            name: name.to_owned(),
            known: KINDS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", "),
            builtin: builtin_names().collect::<Vec<_>>().join(", "),
        })?;
        Ok(Self { kind, values: vec![None; kind.keys.len()] })
    }

    /// Kind of air that is specified.
    pub fn kind(&self) -> &'static AirKind {
        self.kind
    }

    /// Gives a key its value.
    fn set(&mut self, name: &str, value: f64) -> Result<(), AirSpecError> {
        let kind = self.kind;
        let Some(index) = kind.keys.iter().position(|key| key.name == name) else {
            let allowed = if kind.keys.is_empty() {
                "it has no keys".to_owned()
            } else {
                format!("it has {}", kind.key_names())
            };
            return Err(AirSpecError::UnknownKey {
                kind: kind.name,
                key: name.to_owned(),
                allowed,
            });
        };
        let key = &kind.keys[index];
        let (low, high) = key.range;
        if !(low..=high).contains(&value) {
            let unit = if key.unit.is_empty() { String::new() } else { format!(" {}", key.unit) };
            return Err(AirSpecError::OutOfRange {
                kind: kind.name,
                key: key.name,
                value,
                low,
                high,
                unit,
            });
        }
        match self.values.get_mut(index) {
            Some(slot @ None) => *slot = Some(value),
            _ => return Err(AirSpecError::Twice { kind: kind.name, key: key.name }),
        }
        Ok(())
    }

    /// Checks what can only be seen when all keys are there.
    fn finished(self) -> Result<Self, AirSpecError> {
        let kind = self.kind.name;
        for (key, value) in self.kind.keys.iter().zip(&self.values) {
            if key.default == Preset::Required && value.is_none() {
                return Err(AirSpecError::Missing { kind, key: key.name, help: key.help });
            }
        }
        let given = |name| self.given(name).is_some();
        let conflict = |why| Err(AirSpecError::Conflict { kind, why });
        match kind {
            "profile" if given("alpha") && given("z0") => {
                conflict("give z0 for the log law or alpha for the power law, not both")
            }
            "thermals" if given("x") != given("y") => conflict("give both x and y, or none"),
            _ if self.kind.key("wind").is_some() && given("from") && !given("wind") => {
                conflict("from says nothing without wind")
            }
            _ => Ok(self),
        }
    }

    /// Value of a key, if it was given.
    pub fn given(&self, name: &str) -> Option<f64> {
        let index = self.kind.keys.iter().position(|key| key.name == name)?;
        *self.values.get(index)?
    }

    /// Value of a key, or its default; zero for keys that have neither.
    pub fn value(&self, name: &str) -> f64 {
        let default = match self.kind.key(name).map(|key| key.default) {
            Some(Preset::Value(value)) => value,
            _ => 0.0,
        };
        self.given(name).unwrap_or(default)
    }
}

impl FromStr for AirSpec {
    type Err = AirSpecError;

    fn from_str(text: &str) -> Result<Self, AirSpecError> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let mut spec = Self::of_kind(name.trim())?;
        for part in rest.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let not_a_pair =
                || AirSpecError::NotAPair { kind: spec.kind.name, text: part.to_owned() };
            let (key, value) = part.split_once('=').ok_or_else(not_a_pair)?;
            let value = value.trim().parse().map_err(|_| not_a_pair())?;
            spec.set(key.trim(), value)?;
        }
        spec.finished()
    }
}

impl fmt::Display for AirSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        let given = self.kind.keys.iter().zip(&self.values);
        let given = given.filter_map(|(key, value)| Some((key.name, (*value)?)));
        for (index, (name, value)) in given.enumerate() {
            write!(f, "{}{name}={value}", if index == 0 { ':' } else { ',' })?;
        }
        Ok(())
    }
}
