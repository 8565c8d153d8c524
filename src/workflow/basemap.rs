//! The picture of the ground below a report's map: read, and held against the plans before anything else is done.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::WorkflowError;
use super::find::Work;
use crate::base::causes::with_causes;
use crate::base::file::read_whole;
use crate::base::parse;
use crate::base::plain::Shown as _;
use crate::mission::Plan;
use crate::report::{Basemap, BasemapError, Corners, MOST_BASEMAP_BYTES};

/// Largest file that is read, to say how large it is.
const MOST_READ_BYTES: u64 = 40 * MOST_BASEMAP_BYTES as u64;
/// Largest file with corners, bytes.
const MOST_CORNERS_BYTES: u64 = 10_000;

/// What stands in the file beside a picture.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Beside {
    /// Latitude and longitude, degrees.
    south_west: [f64; 2],
    north_east: [f64; 2],
    /// Whose picture it is.
    credit: Option<String>,
}

/// Reads a picture. Its corners are these, else those in the file of its name with `.json` behind it.
///
/// # Errors
///
/// If a file cannot be read, or does not hold what it should.
pub fn read_basemap(path: &Path, corners: Option<Corners>) -> Result<Basemap, WorkflowError> {
    let bytes = read_whole(path, MOST_READ_BYTES)?;
    let beside = beside(path);
    let known = beside.is_file().then(|| read_beside(&beside)).transpose()?;
    let (corners, credit) = match (corners, known) {
        (Some(corners), known) => (corners, known.and_then(|(_, credit)| credit)),
        (None, Some(known)) => known,
        (None, None) => {
            return Err(WorkflowError::Usage(format!(
                "where is {}? Give its corners with --basemap-corners \"LAT,LON LAT,LON\" (south-west, \
                 north-east), or write them into {} (docs/basemap.md)",
                path.shown(),
                beside.shown()
            )));
        }
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Basemap::new(&name, bytes, corners, credit).map_err(|error| about(path, &error))
}

/// Refuses a picture that shows none of the places where the drones of these plans stand.
///
/// # Errors
///
/// If it shows none, or there is no plan to tell.
pub fn shows_a_plan<'a>(
    path: &Path,
    basemap: &Basemap,
    plans: impl IntoIterator<Item = &'a Plan>,
) -> Result<(), WorkflowError> {
    let shows = |plan: &Plan| {
        let homes = plan.slots.iter().map(|slot| [slot.home_m[0], slot.home_m[1]]);
        basemap.shows(&plan.site.frame(), homes).map_err(|error| about(path, &error))
    };
    let told: Vec<Result<(), WorkflowError>> = plans.into_iter().map(shows).collect();
    if told.is_empty() {
        return Err(WorkflowError::Usage(
            "a basemap needs the plan, which says where the drones stood: give it with --plan"
                .to_owned(),
        ));
    }
    if told.iter().any(Result::is_ok) { Ok(()) } else { told.into_iter().collect() }
}

/// Refuses a picture that shows nothing of what is to be analysed.
///
/// # Errors
///
/// As [`shows_a_plan`].
pub fn shows_work(path: &Path, basemap: &Basemap, work: &Work) -> Result<(), WorkflowError> {
    shows_a_plan(path, basemap, work.flights.iter().filter_map(|flight| flight.plan.as_ref()))
}

fn about(path: &Path, error: &BasemapError) -> WorkflowError {
    WorkflowError::Usage(match error {
        BasemapError::Corners(reason) => format!("{}: {reason}", path.shown()),
        error => format!("{} {error}", path.shown()),
    })
}

/// `field.png.json`.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".json");
    path.with_file_name(name)
}

fn read_beside(path: &Path) -> Result<(Corners, Option<String>), WorkflowError> {
    let bytes = read_whole(path, MOST_CORNERS_BYTES)?;
    let found: Beside = parse::json(&bytes).map_err(|error| {
        WorkflowError::Usage(format!(
            "{} does not hold the corners of a picture, as {{\"south_west\": [47.4721, 19.0603], \
             \"north_east\": [47.4745, 19.0640]}}: {}",
            path.shown(),
            with_causes(&error, ": ")
        ))
    })?;
    let corners = Corners::new(found.south_west, found.north_east);
    Ok((corners.map_err(|error| about(path, &error))?, found.credit))
}
