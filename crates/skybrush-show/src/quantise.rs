//! Cost of whole units: the deviation of each drone's `.skyb` file from its trajectory, and the
//! show as it is flown with it.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::skyb::{self, Quantisation, SkybError, SkybOptions};
use super::{Show, ShowDrone};

/// The `.skyb` file of one drone, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DroneQuantisation {
    /// Label of the drone.
    pub name: String,
    /// Size of the file, bytes.
    pub file_bytes: usize,
    /// Size of its trajectory block, of 65 535 bytes.
    pub trajectory_bytes: usize,
    /// Pieces in it, after cutting long ones.
    pub pieces: usize,
    /// Size of the unit, mm.
    pub scale_mm: u8,
    /// Deviation from the trajectory.
    #[serde(flatten)]
    pub deviation: Quantisation,
}

/// The show of a drone as it is flown: written to a `.skyb` file and read back as the firmware
/// reads it.
///
/// # Errors
/// When the show does not fit into a file.
pub fn as_flown(drone: &ShowDrone) -> Result<ShowDrone, SkybError> {
    let file = skyb::write(drone, &SkybOptions::default())?;
    Ok(skyb::read(&file.bytes)?.drone)
}

/// Writes each drone's `.skyb` file in memory and reports what that costs, in the order of the drones.
/// A drone whose show does not fit has an error.
pub fn report(show: &Show, options: &SkybOptions) -> Vec<Result<DroneQuantisation, SkybError>> {
    show.drones
        .par_iter()
        .map(|drone| {
            let file = skyb::write(drone, options)?;
            Ok(DroneQuantisation {
                name: drone.name.clone(),
                file_bytes: file.bytes.len(),
                trajectory_bytes: file.trajectory_bytes,
                pieces: file.pieces,
                scale_mm: file.scale_mm,
                deviation: file.quantisation,
            })
        })
        .collect()
}

/// The largest deviation of all drones whose show fits.
pub fn worst(report: &[Result<DroneQuantisation, SkybError>]) -> Quantisation {
    report.iter().flatten().fold(Quantisation::default(), |worst, drone| worst.max(drone.deviation))
}
