//! Writer of a flight's folder: template, vehicle, plan and the show in its three formats.

use std::collections::BTreeSet;

use rayon::prelude::*;
use thiserror::Error;

use super::{CAMPAIGN_SCHEMA, CampaignError, CampaignIndex, FlightFolder, index_path, to_json};
use crate::base::file::{FileError, create_folder, sweep_partial, write_whole};
use crate::mission::resolve::{Mission, ResolvedFlight};
use crate::show::{Show, csv, skyb, skyc};

/// Error of making or writing the files of a flight.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The show does not fit into a `.skyb` file.
    #[error("{drone} does not fit into a .skyb file")]
    Skyb {
        /// Label of the drone.
        drone: String,
        /// Reason why its show does not fit.
        #[source]
        source: skyb::SkybError,
    },
    /// The show does not fit into a `.skyc` file.
    #[error("the show does not fit into a .skyc file")]
    Skyc(#[from] skyc::SkycError),
    /// The show does not fit into the CSV format.
    #[error("the show does not fit into the CSV format")]
    Csv(#[from] csv::CsvError),
    /// Content has no form as JSON or TOML.
    #[error("failed to write {what} as text: {reason}")]
    Text {
        /// Name of the content, for the message.
        what: &'static str,
        /// Reason why it has no text form.
        reason: String,
    },
}

/// Contents of the files of one flight, made but not yet written.
#[derive(Clone, Debug)]
pub struct FlightFiles {
    template: Vec<u8>,
    vehicle: Vec<u8>,
    plan: Vec<u8>,
    skyc: Vec<u8>,
    csv: Vec<u8>,
    skyb: Vec<skyb::SkybFile>,
}

impl FlightFiles {
    /// Makes the contents, drones in parallel; the bytes do not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// If the show does not fit into one of the formats.
    pub fn of(flight: &ResolvedFlight, show: &Show) -> Result<Self, WriteError> {
        let text = |what, reason: String| WriteError::Text { what, reason };
        let skyb = show
            .drones
            .par_iter()
            .map(|drone| {
                skyb::write(drone, &skyb::SkybOptions::default())
                    .map_err(|source| WriteError::Skyb { drone: drone.name.clone(), source })
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            template: flight.template_text.clone().into_bytes(),
            vehicle: toml::to_string(&flight.vehicle)
                .map_err(|error| text("the vehicle", error.to_string()))?
                .into_bytes(),
            plan: to_json(&flight.plan).map_err(|error| text("the plan", error.to_string()))?,
            skyc: skyc::write(show)?,
            csv: csv::write(show, &csv::CsvOptions::default())?,
            skyb,
        })
    }

    /// Content of the compiled show, a `.skyc` file.
    pub fn skyc(&self) -> &[u8] {
        &self.skyc
    }

    /// Content of the plan's JSON file.
    pub fn plan(&self) -> &[u8] {
        &self.plan
    }

    /// Contents of the binary shows, in slot order.
    pub fn skyb(&self) -> &[skyb::SkybFile] {
        &self.skyb
    }

    /// Writes all files; the plan last, so that a folder with a plan is complete.
    ///
    /// # Errors
    ///
    /// If the folder or a file cannot be written.
    pub fn write(&self, folder: &FlightFolder) -> Result<(), WriteError> {
        create_folder(&folder.skyb_folder())?;
        sweep_partial(&folder.0)?;
        sweep_partial(&folder.skyb_folder())?;
        write_whole(&folder.template(), &self.template)?;
        write_whole(&folder.vehicle(), &self.vehicle)?;
        write_whole(&folder.skyc(), &self.skyc)?;
        write_whole(&folder.csv(), &self.csv)?;
        let count = self.skyb.len();
        self.skyb.par_iter().enumerate().try_for_each(|(index, file)| {
            write_whole(&folder.skyb((index + 1) as u16, count), &file.bytes)
        })?;
        remove_others(folder, count)?;
        write_whole(&folder.plan(), &self.plan)?;
        Ok(())
    }
}

/// Removes binary shows of slots that an earlier plan in this folder had: they would be uploaded.
fn remove_others(folder: &FlightFolder, count: usize) -> Result<(), FileError> {
    let place = folder.skyb_folder();
    let fail = |source| FileError::new("clean", &place, source);
    let wanted: BTreeSet<_> = (1..=count).map(|slot| folder.skyb(slot as u16, count)).collect();
    for entry in std::fs::read_dir(&place).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        let slot = path.file_stem().and_then(|stem| stem.to_str()?.parse::<u16>().ok());
        let ours = slot.is_some() && path.extension().is_some_and(|extension| extension == "skyb");
        if ours && !wanted.contains(&path) {
            std::fs::remove_file(&path).map_err(|error| FileError::new("remove", &path, error))?;
        }
    }
    Ok(())
}

/// Folders of the flights of a mission below `root`: `root` itself for a single flight.
pub fn folders(root: &std::path::Path, mission: &Mission) -> Vec<FlightFolder> {
    if mission.campaign_text.is_none() {
        return vec![FlightFolder(root.to_owned())];
    }
    mission.flights.iter().map(|flight| FlightFolder(root.join(&flight.plan.name))).collect()
}

/// Writes the index of a campaign of several flights, after its flights.
///
/// # Errors
///
/// If the file cannot be written.
pub fn write_index(root: &std::path::Path, mission: &Mission) -> Result<(), WriteError> {
    let Some(text) = &mission.campaign_text else { return Ok(()) };
    let index = CampaignIndex {
        schema: CAMPAIGN_SCHEMA.to_owned(),
        name: mission.name.clone(),
        title: mission.title.clone(),
        flights: mission.flights.iter().map(|flight| flight.plan.name.clone()).collect(),
    };
    write_whole(&root.join("campaign.toml"), text.as_bytes())?;
    let json = to_json(&index)
        .map_err(|error| WriteError::Text { what: "the index", reason: error.to_string() })?;
    write_whole(&index_path(root), &json)?;
    Ok(())
}
