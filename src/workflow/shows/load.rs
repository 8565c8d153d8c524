//! Search for the shows behind a path: a campaign, a show file of any kind, a folder of binary
//! shows.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::base::file::{FileError, read_whole};
use crate::base::plain::Shown as _;
use crate::base::plain::plain;
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::mission::Plan;
use crate::show::{Show, csv, skyb, skyc};
use crate::vehicle::{Vehicle, VehicleError, library};

/// Largest show file that is read, bytes.
pub(super) const MAX_SHOW_BYTES: u64 = 256 << 20;
/// Largest binary show that is read, bytes.
pub(crate) const MAX_SKYB_BYTES: u64 = 4 << 20;

/// Error of reading a show.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The campaign folder cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The campaign's vehicle cannot be used.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// A `.skyc` file is not valid.
    #[error("{} is not a usable .skyc file", path.shown())]
    Skyc {
        /// Path of the file.
        path: PathBuf,
        /// Reason why it cannot be read.
        #[source]
        source: skyc::SkycError,
    },
    /// A `.skyb` file is not valid.
    #[error("{} is not a usable .skyb file", path.shown())]
    Skyb {
        /// Path of the file.
        path: PathBuf,
        /// Reason why it cannot be read.
        #[source]
        source: skyb::SkybError,
    },
    /// A show in CSV is not valid.
    #[error("{} is not a usable CSV show", path.shown())]
    Csv {
        /// Path of the file.
        path: PathBuf,
        /// Reason why it cannot be read.
        #[source]
        source: csv::CsvError,
    },
    /// The path is no file of a kind that holds a show.
    #[error("{} is not a campaign folder, .skyc, .skyb or zipped CSV show", path.shown())]
    Unknown {
        /// Path that was given.
        path: PathBuf,
    },
}

/// A show with the plan it is checked against.
#[derive(Clone, Debug)]
pub(crate) struct Loaded {
    /// Where it came from.
    pub(crate) path: PathBuf,
    /// The show.
    pub(crate) show: Show,
    /// Its plan; recovered from the show itself when it has none.
    pub(crate) plan: Plan,
    /// The vehicle that is to fly it.
    pub(crate) vehicle: Vehicle,
    /// How the campaign's files differ from its plan, one sentence each.
    pub(crate) mismatches: Vec<String>,
}

/// Loads the shows behind a path; `vehicle` gives limits to shows that bring none.
pub(crate) fn load_shows(path: &Path, vehicle: &Vehicle) -> Result<Vec<Loaded>, LoadError> {
    if path.is_dir() {
        if campaign::is_campaign(path) {
            return campaign::flights(path)?.iter().map(load_flight).collect();
        }
        let mut files = Vec::new();
        let fail = |source| FileError::new("read", path, source);
        for entry in std::fs::read_dir(path).map_err(fail)? {
            let file = entry.map_err(fail)?.path();
            if has_extension(&file, "skyb") {
                files.push(file);
            }
        }
        files.sort();
        if files.is_empty() {
            return Err(CampaignError::NoPlan { path: path.to_owned() }.into());
        }
        let mut show = Show::default();
        for file in &files {
            show.drones.push(read_skyb(file)?);
        }
        return Ok(vec![foreign(path, show, vehicle)]);
    }
    let show = read_show(path)?;
    Ok(vec![foreign(path, show, vehicle)])
}

/// Reads one show file by its ending.
pub(crate) fn read_show(path: &Path) -> Result<Show, LoadError> {
    if has_extension(path, "skyc") {
        read_skyc(path)
    } else if has_extension(path, "skyb") {
        Ok(Show { drones: vec![read_skyb(path)?], ..Show::default() })
    } else if has_extension(path, "zip") {
        let bytes = read_whole(path, MAX_SHOW_BYTES)?;
        csv::read(&bytes).map_err(|source| LoadError::Csv { path: path.to_owned(), source })
    } else {
        std::fs::metadata(path).map_err(|error| FileError::new("read", path, error))?;
        Err(LoadError::Unknown { path: path.to_owned() })
    }
}

pub(crate) fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

fn read_skyc(path: &Path) -> Result<Show, LoadError> {
    let bytes = read_whole(path, MAX_SHOW_BYTES)?;
    skyc::read(&bytes).map_err(|source| LoadError::Skyc { path: path.to_owned(), source })
}

fn read_skyb(path: &Path) -> Result<crate::show::ShowDrone, LoadError> {
    let bytes = read_whole(path, MAX_SKYB_BYTES)?;
    let contents =
        skyb::read(&bytes).map_err(|source| LoadError::Skyb { path: path.to_owned(), source })?;
    let mut drone = contents.drone;
    if drone.name.is_empty() {
        drone.name =
            path.file_stem().map_or_else(String::new, |stem| plain(&stem.to_string_lossy()).into());
    }
    Ok(drone)
}

fn foreign(path: &Path, show: Show, vehicle: &Vehicle) -> Loaded {
    let plan = Plan::of_show(&show, vehicle);
    Loaded { path: path.to_owned(), show, plan, vehicle: vehicle.clone(), mismatches: Vec::new() }
}

/// A flight of a campaign: the show is what its files say, the limits are its plan's.
fn load_flight(folder: &FlightFolder) -> Result<Loaded, LoadError> {
    let plan = folder.read_plan()?;
    let show = read_skyc(&folder.skyc())?;
    let planned = plan.to_show();
    let mut mismatches = Vec::new();
    if show.drones.len() == planned.drones.len() {
        for (here, there) in show.drones.iter().zip(&planned.drones) {
            if let Some(how) = here.trajectory.difference(&there.trajectory, 0.001) {
                mismatches.push(format!("show.skyc: {} does not fly the plan: {how}", there.name));
            }
        }
        for (slot, there) in plan.slots.iter().zip(&planned.drones) {
            let path = folder.skyb(slot.slot, plan.slots.len());
            let bytes = read_whole(&path, MAX_SKYB_BYTES)?;
            let contents = skyb::read(&bytes)
                .map_err(|source| LoadError::Skyb { path: path.clone(), source })?;
            let unit_m = f64::from(contents.scale_mm) / 1000.0;
            if let Some(how) = contents.drone.trajectory.difference(&there.trajectory, unit_m) {
                mismatches.push(format!("{} does not fly the plan: {how}", path.shown()));
            }
        }
    } else {
        mismatches.push(format!(
            "show.skyc has {} drones, the plan {}",
            show.drones.len(),
            planned.drones.len()
        ));
    }
    let vehicle = library::load(&folder.vehicle().to_string_lossy())?;
    Ok(Loaded { path: folder.0.clone(), show, plan, vehicle, mismatches })
}
