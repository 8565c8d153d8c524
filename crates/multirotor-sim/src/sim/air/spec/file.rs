//! TOML files with several components of air.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::{AirSpec, AirSpecError};
use untrusted_io::file::read_whole;
use untrusted_io::parse;

/// Name and version of the format of these files.
pub const AIR_SCHEMA: &str = "updraft.air/1";
/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Most components of a file.
const MAX_COMPONENTS: usize = 100;

/// Name and text of every file that comes with the program.
const BUILTIN: &[(&str, &str)] = &[
    ("field-day", include_str!("../../../../air/field-day.toml")),
    ("thermal-day", include_str!("../../../../air/thermal-day.toml")),
];

/// Names of the files that come with the program.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AirFile {
    schema: String,
    #[serde(rename = "title")]
    _title: String,
    air: Vec<Component>,
}

#[derive(Deserialize)]
struct Component {
    kind: String,
    #[serde(flatten)]
    keys: BTreeMap<String, toml::Value>,
}

/// The components that a text asks for: one component (`field:sd=0.5`), a TOML file, or the name of
/// a file that comes with the program (with or without `templates/air/` and `.toml`).
///
/// # Errors
/// [`AirSpecError`] says what is wrong and what is allowed.
pub fn load(text: &str) -> Result<Vec<AirSpec>, AirSpecError> {
    let plain = text.strip_prefix("templates/air/").unwrap_or(text);
    // A component may end with the name of a TOML file.
    let is_component = text
        .split_once(':')
        .and_then(|(name, _)| super::kind(name))
        .is_some_and(|kind| !kind.words.is_empty());
    let is_toml =
        !is_component && Path::new(text).extension().is_some_and(|extension| extension == "toml");
    let plain = plain.strip_suffix(".toml").unwrap_or(plain);
    if is_toml && Path::new(text).is_file() {
        let bytes = read_whole(Path::new(text), MAX_BYTES)?;
        return from_toml(&String::from_utf8_lossy(&bytes), text);
    }
    let builtin = BUILTIN.iter().find(|(name, _)| *name == plain);
    match builtin {
        Some((_, toml)) if is_toml || super::kind(plain).is_none() => from_toml(toml, text),
        _ if is_toml => {
            // Says which file and why it cannot be read.
            let bytes = read_whole(Path::new(text), MAX_BYTES)?;
            from_toml(&String::from_utf8_lossy(&bytes), text)
        }
        _ => Ok(vec![text.parse()?]),
    }
}

/// The components of a TOML text; `file` is its name for messages.
///
/// # Errors
/// [`AirSpecError`] says what is wrong and what is allowed.
pub fn from_toml(toml: &str, file: &str) -> Result<Vec<AirSpec>, AirSpecError> {
    let wrong = |reason: String| AirSpecError::Toml { file: file.to_owned(), reason };
    let parsed: AirFile = parse::toml(toml).map_err(|error| wrong(error.to_string()))?;
    if parsed.schema != AIR_SCHEMA {
        return Err(wrong(format!(
            "this program reads \"{AIR_SCHEMA}\", not \"{}\"",
            parsed.schema
        )));
    }
    if parsed.air.len() > MAX_COMPONENTS {
        return Err(wrong(format!("more than {MAX_COMPONENTS} components")));
    }
    let mut specs = Vec::new();
    for (index, component) in parsed.air.iter().enumerate() {
        let place = |reason: String| wrong(format!("component {}: {reason}", index + 1));
        let mut spec =
            AirSpec::of_kind(&component.kind).map_err(|error| place(error.to_string()))?;
        for (key, value) in &component.keys {
            if let toml::Value::String(word) = value
                && spec.say(key, word).map_err(|error| place(error.to_string()))?
            {
                continue;
            }
            let number = match value {
                toml::Value::Float(number) => *number,
                toml::Value::Integer(number) => *number as f64,
                _ => return Err(place(format!("{key} is not a number"))),
            };
            spec.set(key, number).map_err(|error| place(error.to_string()))?;
        }
        specs.push(spec.finished().map_err(|error| place(error.to_string()))?);
    }
    Ok(specs)
}
