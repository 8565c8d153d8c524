//! The true motion of the air at each drone's planned place, written beside its log.
//!
//! One CSV file per drone, one row per second of show time. `up_10s_mps` is the mean updraft over
//! the 10 s around the row, which is what the analysis' running mean can see.

use std::path::Path;

use nalgebra::Vector3;
use thiserror::Error;

use super::Atmosphere;
use skybrush_show::Trajectory;
use skybrush_show::frame::ShowFrame;
use skybrush_show::trajectory::Cursor;
use untrusted_io::file::{FileError, read_whole, write_whole};
use untrusted_io::plain::Shown as _;

/// First line of a truth file. Places in the show frame; motion towards east, north and up.
pub const HEADER: &str = "time_s,x_m,y_m,z_m,east_mps,north_mps,up_mps,up_10s_mps";
/// Samples per second that the 10 s means are taken from.
pub(crate) const RATE: i64 = 10;
/// Half of the running mean, s.
pub(crate) const HALF_S: i64 = 5;
/// Largest file that is read, bytes: a day.
const MAX_BYTES: u64 = 16 << 20;

/// The updraft that one drone met, on a grid of whole seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrueUpdraft {
    /// Show time of the first value, s.
    pub first_s: i64,
    /// Mean updraft over the 10 s around each second, m/s.
    pub updraft_mps: Vec<f64>,
}

/// Error of writing or reading a truth file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TruthError {
    /// The file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line of the file is not valid.
    #[error("{file}, line {line}: {reason}; simulate again with --truth")]
    Line {
        /// Name of the file.
        file: String,
        /// Number of the line, from 1.
        line: usize,
        /// Statement of the problem with the line.
        reason: String,
    },
}

/// The truth along a trajectory as CSV text, from show time 0 to its end.
///
/// `drone` is the slot. The drone's real path differs from the planned one by its position error and
/// by the first seconds, when it still stands; in smooth air that is far below a millimetre per
/// second.
pub fn to_csv(
    atmosphere: &dyn Atmosphere,
    trajectory: &Trajectory,
    drone: u16,
    frame: &ShowFrame,
) -> String {
    let end_s = i64::try_from(trajectory.duration_ms().div_ceil(1000)).unwrap_or(0).min(86_400);
    let mut air = atmosphere.sampler(drone);
    let mut cursor = Cursor::new(trajectory);
    // Samples and their integral by the trapezoid rule, from HALF_S before the start.
    let mut samples = Vec::new();
    let mut integral = vec![0.0];
    for index in -HALF_S * RATE..=(end_s + HALF_S) * RATE {
        let time_s = index as f64 / RATE as f64;
        let position_m = cursor.state_at(time_s).position_m;
        let velocity_mps: Vector3<f64> = air.air_velocity(&position_m, time_s);
        if let (Some((_, before)), Some(sum)) = (samples.last(), integral.last()) {
            let before: &Vector3<f64> = before;
            integral.push(sum + f64::midpoint(before.z, velocity_mps.z) / RATE as f64);
        }
        samples.push((position_m, velocity_mps));
    }
    let mut text = format!("{HEADER}\n");
    let steps = (RATE * HALF_S) as usize;
    for (second, centre) in (0..=end_s).zip((steps..).step_by(RATE as usize)) {
        let Some((place, velocity)) = samples.get(centre) else { break };
        let (Some(to), Some(from)) = (integral.get(centre + steps), integral.get(centre - steps))
        else {
            break;
        };
        let mean = (to - from) / (2 * HALF_S) as f64;
        text.push_str(&row(second, place, *velocity, mean, frame));
    }
    text
}

/// One row of a truth file: a second, a place and the motion of the air there, both in the show frame, and
/// its mean updraft.
pub(crate) fn row(
    second: i64,
    place_m: &Vector3<f64>,
    velocity_mps: Vector3<f64>,
    mean_mps: f64,
    frame: &ShowFrame,
) -> String {
    let neu = frame.to_neu(velocity_mps);
    // Adding zero turns -0 into 0.
    let [x, y, z] = [place_m.x, place_m.y, place_m.z].map(|value| value + 0.0);
    let [east, north, up] = [neu.y, neu.x, neu.z].map(|value| value + 0.0);
    format!("{second},{x:.3},{y:.3},{z:.3},{east:.5},{north:.5},{up:.5},{mean_mps:.5}\n")
}

/// Writes the truth of one drone; see [`to_csv`].
///
/// # Errors
/// The file could not be written.
pub fn write(
    path: &Path,
    atmosphere: &dyn Atmosphere,
    trajectory: &Trajectory,
    drone: u16,
    frame: &ShowFrame,
) -> Result<(), FileError> {
    write_whole(path, to_csv(atmosphere, trajectory, drone, frame).as_bytes())
}

/// Reads the 10 s means of a truth file.
///
/// # Errors
/// The file cannot be read, or a line is not what [`to_csv`] writes.
pub fn read(path: &Path) -> Result<TrueUpdraft, TruthError> {
    let bytes = read_whole(path, MAX_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let wrong = |index: usize, reason: String| TruthError::Line {
        file: path.shown().to_string(),
        line: index + 1,
        reason,
    };
    let mut truth = TrueUpdraft::default();
    for (index, line) in text.lines().enumerate() {
        if index == 0 {
            if line != HEADER {
                return Err(wrong(index, format!("the first line is not \"{HEADER}\"")));
            }
            continue;
        }
        let fields: Vec<&str> = line.split(',').collect();
        let (Some(time), Some(mean), 8) = (fields.first(), fields.last(), fields.len()) else {
            return Err(wrong(index, format!("{} values instead of 8", fields.len())));
        };
        let time: i64 =
            time.parse().map_err(|_| wrong(index, format!("\"{time}\" is not a whole second")))?;
        let number = mean.parse::<f64>().ok().filter(|value| value.is_finite());
        let mean = number.ok_or_else(|| wrong(index, format!("\"{mean}\" is not a number")))?;
        if truth.updraft_mps.is_empty() {
            truth.first_s = time;
        } else if truth.first_s.checked_add(truth.updraft_mps.len() as i64) != Some(time) {
            return Err(wrong(index, format!("second {time} is out of order")));
        }
        truth.updraft_mps.push(mean);
    }
    Ok(truth)
}
