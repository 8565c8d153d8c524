//! Names of the files in a campaign folder, and the list of its flights.
//!
//! A folder with one flight holds `plan.json` and its show files directly. A campaign of several
//! flights holds `campaign.json` and one such folder per flight:
//!
//! ```text
//! my-campaign/
//!   campaign.json  campaign.toml
//!   calibration/   template.toml  vehicle.toml  plan.json  show.skyc  skyb/01.skyb  show.csv.zip  logs/01.BIN
//!                  simulated/01.BIN  truth/01.csv
//!   hover/         ...
//!   study/         study.json  report/index.html
//!   analysis.json  report/index.html  fields/updraft.csv  fields/updraft.parquet
//! ```

pub mod items;
pub mod lock;
pub mod origin;
pub mod start;
pub mod write;

use std::io;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::base::crc::file_crc32;
use crate::base::file::{FileError, read_whole};
use crate::base::parse;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::mission::Plan;
use crate::mission::plan::PLAN_SCHEMA;

/// Name and version of the campaign format.
pub const CAMPAIGN_SCHEMA: &str = "updraft.campaign/1";
/// Largest JSON file of a campaign that is read, bytes: 5,000 drones need a few megabytes.
const MAX_JSON_BYTES: u64 = 256 << 20;

/// `campaign.json`: the flights of a campaign, in the order they are flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignIndex {
    /// Format name and version: `updraft.campaign/1`.
    pub schema: String,
    /// Short name.
    pub name: String,
    /// Title for people.
    pub title: String,
    /// Folder of each flight, relative to the campaign.
    pub flights: Vec<String>,
}

/// `simulated/flight.json`: how the logs beside it came to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlightRecord {
    /// Format name and version: `updraft.flight/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// Where the logs come from: `simulator`.
    pub source: String,
    /// Seed of the simulation.
    pub seed: u64,
    /// Vehicle flown.
    pub vehicle: String,
    /// SHA-256 of the vehicle's numbers.
    pub vehicle_sha256: String,
    /// True uniform motion of the air, towards east, north and up, m/s.
    pub air_mps: [f64; 3],
    /// GPS time of show time 0.
    pub start: GpsTime,
    /// Further components of the air, as `--air` takes them; then the motion is not uniform.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub air: Vec<String>,
    /// Files that components of the air were read from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub air_files: Vec<AirFile>,
    /// Whether the firmware's whole default set of messages was logged.
    pub full_logs: bool,
    /// SHA-256 of the plan that was flown.
    pub plan_sha256: String,
    /// The logs, in slot order.
    pub logs: Vec<LogRecord>,
}

/// A file that the air of a simulated flight was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AirFile {
    /// Path, as it was given.
    pub file: String,
    /// Size, bytes.
    pub bytes: u64,
    /// SHA-256 of its content.
    pub sha256: String,
}

/// One log of a [`FlightRecord`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogRecord {
    /// Slot that flew.
    pub slot: u16,
    /// File name beside the record.
    pub file: String,
    /// Size, bytes.
    pub bytes: u64,
    /// CRC-32 (that of ZIP files) of the content; absent in records of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crc32: Option<u32>,
}

impl LogRecord {
    /// Makes the record of a log from its file.
    ///
    /// # Errors
    ///
    /// If the file cannot be read.
    pub fn of(slot: u16, path: &Path) -> Result<Self, FileError> {
        let (bytes, crc32) = file_crc32(path)?;
        let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
        Ok(Self { slot, file, bytes, crc32: Some(crc32) })
    }

    /// Difference of a file from this record (size or CRC-32), in words; `None` if it has not
    /// changed.
    ///
    /// # Errors
    ///
    /// If the file cannot be read.
    pub fn difference(&self, path: &Path) -> Result<Option<String>, FileError> {
        self.difference_by(path, || file_crc32(path).map(|(_, crc32)| crc32))
    }

    /// Difference of a file from this record as by [`LogRecord::difference`], with the CRC-32 from
    /// `crc32`, which is called only if the size leaves the question open.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or the error of `crc32`.
    pub fn difference_by(
        &self,
        path: &Path,
        crc32: impl FnOnce() -> Result<u32, FileError>,
    ) -> Result<Option<String>, FileError> {
        let size = std::fs::metadata(path).map_err(|error| FileError::new("read", path, error))?;
        if size.len() != self.bytes {
            return Ok(Some(format!("it has {} bytes, not {}", size.len(), self.bytes)));
        }
        let Some(recorded) = self.crc32 else { return Ok(None) };
        Ok((crc32()? != recorded).then(|| "its bytes were changed".to_owned()))
    }
}

/// Name and version of the flight record format.
pub const FLIGHT_SCHEMA: &str = "updraft.flight/1";

/// Error of using a campaign folder.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CampaignError {
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A JSON file is not valid.
    #[error("{} is not valid: {reason}", path.shown())]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// Place and nature of the problem.
        reason: String,
    },
    /// The folder holds neither a plan nor a campaign.
    #[error("{} has neither a plan.json nor a campaign.json; make one with `updraft plan`", path.shown())]
    NoPlan {
        /// Path of the folder.
        path: PathBuf,
    },
    /// Another process is writing into the folder.
    #[error(
        "another updraft is writing into {}; wait until it has finished, or choose another folder",
        path.shown()
    )]
    Busy {
        /// Path of the folder.
        path: PathBuf,
    },
    /// The folder has items (flights, cells) of other settings or another version.
    #[error(
        "{} has items of other settings ({why}); choose another folder with -o",
        path.shown()
    )]
    OtherItems {
        /// Path of the folder.
        path: PathBuf,
        /// Difference of the items there from those asked for, in words.
        why: String,
    },
    /// The path is a file, not a folder.
    #[error("{} is not a campaign folder", path.shown())]
    NotFolder {
        /// Path that is no folder.
        path: PathBuf,
    },
    /// The folder already holds other content.
    #[error("{} already holds {what}; choose another folder or give --force", path.shown())]
    Occupied {
        /// Path of the folder.
        path: PathBuf,
        /// Name of the present content, as an object of the sentence: "a campaign".
        what: String,
    },
}

impl CampaignError {
    /// Adds to the error of a file that cannot be understood what the user can do about it; other
    /// errors stay as they are.
    #[must_use]
    pub fn with_remedy(self, remedy: &str) -> Self {
        match self {
            Self::Json { path, reason } => {
                Self::Json { path, reason: format!("{reason}; {remedy}") }
            }
            error => error,
        }
    }
}

/// Folder of one flight; its methods give the paths of the flight's files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlightFolder(pub PathBuf);

impl FlightFolder {
    /// Takes a path as the folder of a flight; nothing is checked.
    pub fn at(folder: &Path) -> Self {
        Self(folder.to_owned())
    }

    /// Path of the resolved template, `template.toml`.
    pub fn template(&self) -> PathBuf {
        self.0.join("template.toml")
    }

    /// Path of the vehicle that the flight was planned for, `vehicle.toml`.
    pub fn vehicle(&self) -> PathBuf {
        self.0.join("vehicle.toml")
    }

    /// Path of the plan, `plan.json`.
    pub fn plan(&self) -> PathBuf {
        self.0.join("plan.json")
    }

    /// Path of the compiled show, `show.skyc`.
    pub fn skyc(&self) -> PathBuf {
        self.0.join("show.skyc")
    }

    /// Path of the folder of the binary shows.
    pub fn skyb_folder(&self) -> PathBuf {
        self.0.join("skyb")
    }

    /// Path of the binary show of a slot, among `count` slots.
    pub fn skyb(&self, slot: u16, count: usize) -> PathBuf {
        self.skyb_folder().join(numbered(slot, count, "skyb"))
    }

    /// Path of the show in the CSV exchange format.
    pub fn csv(&self) -> PathBuf {
        self.0.join("show.csv.zip")
    }

    /// Path of the folder of real drones' logs; see [`origin`] for simulated ones.
    pub fn logs(&self) -> PathBuf {
        self.0.join("logs")
    }

    /// Path of the log of a slot's real drone, among `count` slots.
    pub fn log(&self, slot: u16, count: usize) -> PathBuf {
        self.logs().join(numbered(slot, count, "BIN"))
    }

    /// Path of the folder that holds the true air of simulated flights.
    pub fn truth_folder(&self) -> PathBuf {
        self.0.join("truth")
    }

    /// Path of the true air that a slot met in simulation, among `count` slots.
    pub fn truth(&self, slot: u16, count: usize) -> PathBuf {
        self.truth_folder().join(numbered(slot, count, "csv"))
    }

    /// Reads the plan.
    ///
    /// # Errors
    ///
    /// If `plan.json` is missing, unreadable or not a plan.
    pub fn read_plan(&self) -> Result<Plan, CampaignError> {
        read_plan(&self.plan())
    }
}

/// File name of a slot: two digits, more in larger fleets, so that names sort.
fn numbered(slot: u16, count: usize, extension: &str) -> String {
    let width = count.to_string().len().max(2);
    format!("{slot:0width$}.{extension}")
}

/// Path of a campaign's index, `campaign.json`.
pub fn index_path(folder: &Path) -> PathBuf {
    folder.join("campaign.json")
}

/// The flights of a campaign folder, or of a folder with one flight.
///
/// # Errors
///
/// If the folder holds neither a plan nor a campaign, or the index cannot be read.
pub fn flights(folder: &Path) -> Result<Vec<FlightFolder>, CampaignError> {
    let found = std::fs::metadata(folder).map_err(|error| FileError::new("read", folder, error))?;
    if !found.is_dir() {
        return Err(CampaignError::NotFolder { path: folder.to_owned() });
    }
    let path = index_path(folder);
    if path.is_file() {
        let index: CampaignIndex = read_json(&path)?;
        if index.schema != CAMPAIGN_SCHEMA {
            return Err(CampaignError::Json {
                path,
                reason: format!(
                    "this program reads \"{CAMPAIGN_SCHEMA}\", not \"{}\"",
                    index.schema
                ),
            });
        }
        for name in &index.flights {
            let plain = Path::new(name).components().count() == 1 && !name.starts_with('.');
            if !plain || name.contains(['/', '\\']) {
                return Err(CampaignError::Json {
                    path,
                    reason: format!("a flight's folder cannot be \"{name}\""),
                });
            }
        }
        return Ok(index.flights.iter().map(|name| FlightFolder(folder.join(name))).collect());
    }
    let flight = FlightFolder(folder.to_owned());
    if flight.plan().is_file() {
        return Ok(vec![flight]);
    }
    Err(CampaignError::NoPlan { path: folder.to_owned() })
}

/// Path of the measured fields as CSV, in the folder of an analysis.
pub fn fields_csv(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft.csv")
}

/// Path of the measured fields as Parquet, in the folder of an analysis.
pub fn fields_parquet(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft.parquet")
}

/// Path of the posterior map between the drones as CSV, in the folder of an analysis.
pub fn fields_grid_csv(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft-grid.csv")
}

/// Path of the posterior map between the drones as Parquet, in the folder of an analysis.
pub fn fields_grid_parquet(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft-grid.parquet")
}

/// Path of the drones' values as NetCDF, in the folder of an analysis.
pub fn fields_netcdf(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft.nc")
}

/// Path of the posterior map between the drones as NetCDF, in the folder of an analysis; of one flight where several
/// have one.
pub fn fields_grid_netcdf(folder: &Path, flight: Option<&str>) -> PathBuf {
    let name = match flight {
        Some(flight) => format!("{GRID_STEM}-{}.nc", file_part(flight)),
        None => format!("{GRID_STEM}.nc"),
    };
    folder.join("fields").join(name)
}

/// Path of turbulence as NetCDF, in the folder of an analysis; of one flight where several have it.
pub fn fields_turbulence_netcdf(folder: &Path, flight: Option<&str>) -> PathBuf {
    let name = match flight {
        Some(flight) => format!("{TURBULENCE_STEM}-{}.nc", file_part(flight)),
        None => format!("{TURBULENCE_STEM}.nc"),
    };
    folder.join("fields").join(name)
}

/// Begin of the names of turbulence.
const TURBULENCE_STEM: &str = "turbulence";

/// Path of a table of turbulence as CSV, in the folder of an analysis.
pub fn fields_turbulence(folder: &Path, stem: &str) -> PathBuf {
    folder.join("fields").join(format!("{stem}.csv"))
}

/// Path of the table of thermals over time, in the folder of an analysis.
pub fn fields_thermals(folder: &Path) -> PathBuf {
    folder.join("fields").join("thermals.csv")
}

/// Path of the drones on a map as GeoJSON, in the folder of an analysis.
pub fn fields_geojson(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft.geojson")
}

/// Path of the drones on a map as KML, in the folder of an analysis.
pub fn fields_kml(folder: &Path) -> PathBuf {
    folder.join("fields").join("updraft.kml")
}

/// Begin of the names of grids.
const GRID_STEM: &str = "updraft-grid";

/// A name as a part of a file's name: letters, digits, points and hyphens.
fn file_part(name: &str) -> String {
    let kept = |c: char| if c.is_alphanumeric() || c == '.' || c == '-' { c } else { '-' };
    name.chars().map(kept).collect()
}

/// Grids as NetCDF that are there, in the folder of an analysis, by name.
pub fn fields_grids_netcdf(folder: &Path) -> Vec<PathBuf> {
    netcdf_of(folder, GRID_STEM)
}

/// Turbulence as NetCDF that is there, in the folder of an analysis, by name.
pub fn fields_turbulences_netcdf(folder: &Path) -> Vec<PathBuf> {
    netcdf_of(folder, TURBULENCE_STEM)
}

fn netcdf_of(folder: &Path, stem: &str) -> Vec<PathBuf> {
    let is_one = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(stem) && name.ends_with(".nc")
    };
    let there = std::fs::read_dir(folder.join("fields")).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = there.map(|entry| entry.path()).filter(is_one).collect();
    files.sort();
    files
}

/// Path of the simulation study that belongs to a campaign.
pub fn study_folder(folder: &Path) -> PathBuf {
    folder.join("study")
}

/// Path of the results of the simulation study that a campaign may hold.
pub fn study_result(folder: &Path) -> PathBuf {
    study_folder(folder).join("study.json")
}

/// Whether a folder is a campaign or one flight of it.
pub fn is_campaign(folder: &Path) -> bool {
    index_path(folder).is_file() || FlightFolder(folder.to_owned()).plan().is_file()
}

/// Reads a JSON file; errors name the file, line and column.
///
/// # Errors
///
/// If the file cannot be read, or is not valid.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, CampaignError> {
    let bytes = read_whole(path, MAX_JSON_BYTES)?;
    parse::json(&bytes)
        .map_err(|error| CampaignError::Json { path: path.to_owned(), reason: error.to_string() })
}

/// Reads a plan's file; errors name the file and the problem.
///
/// # Errors
///
/// If the file cannot be read, or is not a plan.
pub fn read_plan(path: &Path) -> Result<Plan, CampaignError> {
    let bytes = read_whole(path, MAX_JSON_BYTES)?;
    parse_plan(&bytes).map_err(|reason| CampaignError::Json { path: path.to_owned(), reason })
}

/// Reads a plan from its JSON and checks that its parts fit together; the error says what is wrong.
///
/// # Errors
///
/// A description of the problem.
pub fn parse_plan(bytes: &[u8]) -> Result<Plan, String> {
    let plan: Plan = parse::json(bytes).map_err(|error| error.to_string())?;
    validate_plan(&plan)?;
    Ok(plan)
}

/// Serialises a value as indented JSON with a final newline.
///
/// # Errors
///
/// If the value has no form as JSON.
pub fn to_json<T: Serialize>(value: &T) -> io::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// What the types of a plan do not say by themselves.
fn validate_plan(plan: &Plan) -> Result<(), String> {
    if plan.schema != PLAN_SCHEMA {
        return Err(format!("this program reads \"{PLAN_SCHEMA}\", not \"{}\"", plan.schema));
    }
    if plan.slots.is_empty() || plan.groups.is_empty() {
        return Err("a plan needs slots and groups".to_owned());
    }
    for (index, slot) in plan.slots.iter().enumerate() {
        if usize::from(slot.slot) != index + 1 {
            return Err(format!("slot {} stands at place {}", slot.slot, index + 1));
        }
        if usize::from(slot.group) >= plan.groups.len() {
            return Err(format!(
                "slot {} is in group {}, which does not exist",
                slot.slot, slot.group
            ));
        }
        if slot.home_m.iter().any(|value| !value.is_finite()) {
            return Err(format!("the home of slot {} is not a valid position", slot.slot));
        }
    }
    for group in &plan.groups {
        let mut at_ms = 0;
        for segment in &group.segments {
            if segment.start_ms != at_ms || segment.end_ms <= segment.start_ms {
                return Err(format!(
                    "group \"{}\": segment \"{}\" runs from {} to {} ms, the one before ended at {at_ms} ms",
                    group.name, segment.label, segment.start_ms, segment.end_ms
                ));
            }
            if segment.end_ms - segment.start_ms > u64::from(u32::MAX) {
                return Err(format!("segment \"{}\" lasts longer than 49 days", segment.label));
            }
            at_ms = segment.end_ms;
            if let Some(window) = segment.window
                && (window.start_ms < segment.start_ms
                    || window.end_ms > segment.end_ms
                    || window.end_ms <= window.start_ms)
            {
                return Err(format!(
                    "group \"{}\": the window of \"{}\" is not inside it",
                    group.name, segment.label
                ));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_a_plan_says_how_to_make_one() {
        let folder = tempfile::tempdir().unwrap();
        let error = flights(folder.path()).unwrap_err().to_string();
        assert!(error.contains("updraft plan"), "{error}");
    }

    #[test]
    fn a_campaign_cannot_point_outside_of_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["../other", "/etc", "..", "a/b", "a\\b"] {
            let index = CampaignIndex {
                schema: CAMPAIGN_SCHEMA.to_owned(),
                name: "x".to_owned(),
                title: "x".to_owned(),
                flights: vec![name.to_owned()],
            };
            std::fs::write(index_path(folder.path()), to_json(&index).unwrap()).unwrap();
            assert!(flights(folder.path()).is_err(), "{name}");
        }
    }

    #[test]
    fn file_names_sort_in_large_fleets() {
        let flight = FlightFolder(PathBuf::from("x"));
        assert!(flight.log(7, 49).ends_with("07.BIN"));
        assert!(flight.skyb(7, 5000).ends_with("0007.skyb"));
    }
}
