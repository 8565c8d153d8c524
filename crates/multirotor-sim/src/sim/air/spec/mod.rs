//! Air asked for by name: `field:sd=0.5,lambda=145`, or a TOML file with several components.
//!
//! One text names one component; components add up. [`KINDS`] is the table of what there is.

mod build;
mod file;
mod kinds;

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

pub use build::{Air, build, towards};
pub use file::{AIR_SCHEMA, builtin_names, from_toml, load};
pub use kinds::{AirKind, KINDS, Key, Preset, Word, help_text, kind};

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
    /// In the kind's order of words.
    words: Vec<Option<String>>,
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
    /// A word is none of those that are allowed.
    #[error("{kind}: {key} is \"{}\", but must be {allowed}", plain(value))]
    NotAllowed {
        /// Name of the kind of air.
        kind: &'static str,
        /// Name of the key.
        key: &'static str,
        /// Value that was given.
        value: String,
        /// Values that are allowed, for the message.
        allowed: String,
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
        Ok(Self { kind, values: vec![None; kind.keys.len()], words: vec![None; kind.words.len()] })
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

    /// Gives a key its word; whether the kind has such a key.
    fn say(&mut self, name: &str, value: &str) -> Result<bool, AirSpecError> {
        let kind = self.kind;
        let Some(index) = kind.words.iter().position(|word| word.name == name) else {
            return Ok(false);
        };
        let word = &kind.words[index];
        // What is said must be read again as it was meant.
        let is_path = match index {
            0 => bare_word(kind, value) == (value, ""),
            _ => !value.contains(','),
        };
        let is_allowed = match word.choices {
            [] => is_path && value == value.trim() && !value.contains('\0'),
            choices => choices.contains(&value),
        };
        if !is_allowed || value.is_empty() {
            let allowed = match word.choices {
                [] => "a path without commas before keys".to_owned(),
                choices => choices.join(" or "),
            };
            return Err(AirSpecError::NotAllowed {
                kind: kind.name,
                key: word.name,
                value: value.to_owned(),
                allowed,
            });
        }
        match self.words.get_mut(index) {
            Some(slot @ None) => *slot = Some(value.to_owned()),
            _ => return Err(AirSpecError::Twice { kind: kind.name, key: word.name }),
        }
        Ok(true)
    }

    /// Checks what can only be seen when all keys are there.
    fn finished(self) -> Result<Self, AirSpecError> {
        let kind = self.kind.name;
        for (key, value) in self.kind.keys.iter().zip(&self.values) {
            if key.default == Preset::Required && value.is_none() {
                return Err(AirSpecError::Missing { kind, key: key.name, help: key.help });
            }
        }
        if let Some((word, None)) = self.kind.words.first().zip(self.words.first()) {
            return Err(AirSpecError::Missing { kind, key: word.name, help: word.help });
        }
        let given = |name| self.given(name).is_some();
        let conflict = |why| Err(AirSpecError::Conflict { kind, why });
        match kind {
            "profile" if given("alpha") && given("z0") => {
                conflict("give z0 for the log law or alpha for the power law, not both")
            }
            "les" if given("wind") && self.word("mode") != Some("advect") => {
                conflict("wind carries it with mode=advect; a replay has the model's own")
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

    /// Word of a key, if it was given.
    pub fn word(&self, name: &str) -> Option<&str> {
        let index = self.kind.words.iter().position(|word| word.name == name)?;
        self.words.get(index)?.as_deref()
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
        let rest = match spec.kind.words.first() {
            Some(first) => {
                let (bare, rest) = bare_word(spec.kind, rest);
                if !bare.is_empty() {
                    spec.say(first.name, bare)?;
                }
                rest
            }
            None => rest,
        };
        for part in rest.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let not_a_pair =
                || AirSpecError::NotAPair { kind: spec.kind.name, text: part.to_owned() };
            let (key, value) = part.split_once('=').ok_or_else(not_a_pair)?;
            if spec.say(key.trim(), value.trim())? {
                continue;
            }
            let value = value.trim().parse().map_err(|_| not_a_pair())?;
            spec.set(key.trim(), value)?;
        }
        spec.finished()
    }
}

/// The text in front of the first `KEY=` of a kind: a path, which may have commas and equals signs of its own.
fn bare_word<'a>(kind: &AirKind, text: &'a str) -> (&'a str, &'a str) {
    let is_pair = |part: &str| {
        part.split_once('=').is_some_and(|(key, _)| {
            let key = key.trim();
            kind.key(key).is_some() || kind.words.iter().any(|word| word.name == key)
        })
    };
    let mut end = 0;
    for part in text.split(',') {
        if is_pair(part) {
            break;
        }
        end += part.len() + 1;
    }
    let (bare, rest) = text.split_at(end.saturating_sub(1).min(text.len()));
    (bare.trim(), rest.trim_start_matches(','))
}

impl fmt::Display for AirSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        let mut separator = ':';
        for (index, (word, value)) in self.kind.words.iter().zip(&self.words).enumerate() {
            let Some(value) = value else { continue };
            match index {
                0 => write!(f, "{separator}{value}")?,
                _ => write!(f, "{separator}{}={value}", word.name)?,
            }
            separator = ',';
        }
        for (key, value) in self.kind.keys.iter().zip(&self.values) {
            let Some(value) = value else { continue };
            write!(f, "{separator}{}={value}", key.name)?;
            separator = ',';
        }
        Ok(())
    }
}
