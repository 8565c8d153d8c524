//! `logs/start.json`: when a flight began whose logs do not say so themselves.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CampaignError, FlightFolder, read_json, to_json};
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::time::GpsTime;

/// Name and version of the format.
pub const START_SCHEMA: &str = "updraft.start/1";

/// The start of a flight that a station flew by streaming: stock firmware logs no show time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartRecord {
    /// Format name and version: `updraft.start/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// GPS time of show time 0 of the latest flight, by the drones' clocks.
    pub start: GpsTime,
}

impl StartRecord {
    /// A start.
    pub fn new(made_by: String, start: GpsTime) -> Self {
        Self { schema: START_SCHEMA.to_owned(), made_by, start }
    }

    /// Where it is kept.
    pub fn path(folder: &FlightFolder) -> PathBuf {
        folder.logs().join("start.json")
    }

    /// Writes it into a flight's folder, in place of an earlier one.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn write(&self, folder: &FlightFolder) -> Result<(), FileError> {
        let path = Self::path(folder);
        create_folder(&folder.logs())?;
        let json = to_json(self).map_err(|error| FileError::new("write", &path, error))?;
        write_whole(&path, &json)
    }

    /// Reads the one of a flight's folder, if there is one.
    ///
    /// # Errors
    /// When it cannot be read, or is none of this version.
    pub fn read(folder: &FlightFolder) -> Result<Option<Self>, CampaignError> {
        let path = Self::path(folder);
        if !path.exists() {
            return Ok(None);
        }
        let record: Self = read_json(&path)?;
        if record.schema != START_SCHEMA {
            let reason =
                format!("this program reads \"{START_SCHEMA}\", not \"{}\"", record.schema);
            return Err(CampaignError::Json { path, reason });
        }
        Ok(Some(record))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_is_found_again_and_one_of_another_version_is_refused() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = FlightFolder(temporary.path().to_owned());
        assert_eq!(StartRecord::read(&folder).unwrap(), None);
        let start = GpsTime { week: 2445, tow_ms: 100_000 };
        let record = StartRecord::new("updraft".to_owned(), start);
        record.write(&folder).unwrap();
        assert_eq!(StartRecord::read(&folder).unwrap(), Some(record.clone()));
        let newer = StartRecord { schema: "updraft.start/2".to_owned(), ..record };
        newer.write(&folder).unwrap();
        let error = StartRecord::read(&folder).unwrap_err().to_string();
        let wanted = "this program reads \"updraft.start/1\", not \"updraft.start/2\"";
        assert!(error.ends_with(wanted), "{error}");
    }
}
