//! Kinds of study files, told apart by what their `schema` says.

use std::path::Path;

use serde::Deserialize;

use super::error::StudyError;
use super::sensitivity::{self, SensitivityPlan};
use super::template::{MAX_STUDY_BYTES, StudyPlan};
use crate::base::file::read_whole;
use crate::base::parse;

/// Name of the built-in sensitivity study.
const SENSITIVITY: &str = "sensitivity";

/// Beginning of the format's name in its files, of any version.
const SCHEMA: &str = "updraft.sensitivity/";

/// A study of either kind, read and resolved.
#[derive(Clone, Debug)]
pub enum AnyStudy {
    /// One drone's ladder in a list of winds and updrafts.
    Ladder(Box<StudyPlan>),
    /// Whole campaigns that differ in some factors.
    Sensitivity(Box<SensitivityPlan>),
}

/// The only key that all kinds have.
#[derive(Deserialize)]
struct Kind {
    schema: String,
}

impl AnyStudy {
    /// Reads a study: a file, or a built-in one by its name (`study`, `templates/sensitivity.toml`).
    ///
    /// # Errors
    /// [`StudyError`]: an unreadable file, or a wrong study.
    pub fn load(name: &str) -> Result<Self, StudyError> {
        let path = Path::new(name);
        if path.is_file() {
            let bytes = read_whole(path, MAX_STUDY_BYTES)?;
            let kind: Option<Kind> = parse::toml(&String::from_utf8_lossy(&bytes)).ok();
            if kind.is_some_and(|kind| kind.schema.starts_with(SCHEMA)) {
                return Ok(Self::Sensitivity(Box::new(SensitivityPlan::read(path)?)));
            }
        } else {
            let plain = name.strip_prefix("templates/").unwrap_or(name);
            if plain.strip_suffix(".toml").unwrap_or(plain) == SENSITIVITY {
                let plan = SensitivityPlan::parse(
                    &format!("templates/{SENSITIVITY}.toml"),
                    sensitivity::BUILTIN,
                )?;
                return Ok(Self::Sensitivity(Box::new(plan)));
            }
        }
        Ok(Self::Ladder(Box::new(StudyPlan::load(name)?)))
    }
}
