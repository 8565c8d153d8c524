//! The measured fields as NetCDF by the CF conventions 1.11: a file of all drones (discrete sampling geometry, trajectories
//! as contiguous ragged arrays), and for each flight with a posterior between its drones a file of that grid,
//! and for each hover with turbulence one of that.
//!
//! Both need UTC and a place on the globe, which are coordinates there: what has neither is left out, and said.

mod file;
mod globals;
mod grid;
mod speeds;
mod trajectories;
mod turbulence;

use thiserror::Error;

use super::Origin;
use crate::analysis::result::Analysis;

/// Format of the files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// NetCDF-4, deflated.
    #[default]
    Netcdf4,
    /// NetCDF classic with 64-bit offsets (CDF-2), for readers without HDF5.
    Classic,
}

/// A NetCDF file could not be made.
#[derive(Debug, Error)]
#[error("failed to make NetCDF: {0}")]
pub struct NetcdfError(#[from] netcdf_writer::Error);

/// The files of an analysis.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Files {
    /// The drones; `None`: nothing was measured, or nothing of it has UTC and a place.
    pub drones: Option<Vec<u8>>,
    /// Flights with a posterior between their drones: name of the flight, file.
    pub grids: Vec<(String, Vec<u8>)>,
    /// Flights with turbulence: name of the flight, file.
    pub turbulence: Vec<(String, Vec<u8>)>,
    /// Sentences about the parts that are left out, with the reason.
    pub left_out: Vec<String>,
}

/// Whether there will be a file of the drones, and the flights with a file of what is between them.
pub fn expected(analysis: &Analysis) -> (bool, Vec<String>) {
    let placed =
        |row: super::fields::FieldRow| row.utc_ms.is_some() && row.fix.lat_lon_deg.is_some();
    let flights = analysis.flights.iter().zip(super::fields::ids(analysis));
    let grids = flights.filter(|(flight, _)| grid::is_placed(flight)).map(|(_, id)| id);
    (super::fields::rows(analysis).any(placed), grids.collect())
}

/// Flights that will have a file of their turbulence.
pub fn expected_turbulence(analysis: &Analysis) -> Vec<String> {
    let flights = analysis.flights.iter().zip(super::fields::ids(analysis));
    flights.filter(|(flight, _)| turbulence::is_placed(flight)).map(|(_, id)| id).collect()
}

/// Makes the files.
///
/// # Errors
/// A bug of this program, or more data than the format can hold.
pub fn files(analysis: &Analysis, origin: &Origin, format: Format) -> Result<Files, NetcdfError> {
    let mut files = Files::default();
    let (drones, left_out) = trajectories::file(analysis, origin, format)?;
    files.drones = drones;
    files.left_out.extend(left_out);
    for (flight, id) in analysis.flights.iter().zip(super::fields::ids(analysis)) {
        match grid::file((flight, &id), analysis, origin, format)? {
            grid::Made::File(bytes) => files.grids.push((id.clone(), bytes)),
            grid::Made::Unplaced(lacks) => files.left_out.push(lacks),
            grid::Made::Nothing => {}
        }
        match turbulence::file((flight, &id), analysis, origin, format)? {
            turbulence::Made::File(bytes) => files.turbulence.push((id, bytes)),
            turbulence::Made::Unplaced(lacks) => files.left_out.push(lacks),
            turbulence::Made::Nothing => {}
        }
    }
    Ok(files)
}
