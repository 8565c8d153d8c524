//! All drones: one trajectory for each drone of each flight.

use super::file::{Attribute, File, floats, longest, text};
use super::globals::{self, About, Extent};
use super::{Format, NetcdfError, speeds};
use crate::analysis::result::Analysis;
use crate::numeric::extent;
use crate::products::Origin;
use crate::products::fields::{FieldRow, rows};

/// Half of the time that a value is a mean of, s.
const HALF_S: f64 = 5.0;
/// Coordinates of all values along trajectories.
const COORDINATES: &str = "time lat lon height";

/// Rows in a row of one drone.
struct Trajectory {
    flight: String,
    drone: String,
    slot: Option<u16>,
    place_by: &'static str,
    count: usize,
}

/// Rows with UTC and a place, their trajectories, and how many rows have no UTC, and no place.
fn placed(analysis: &Analysis) -> (Vec<FieldRow>, Vec<Trajectory>, [usize; 2]) {
    let (mut kept, mut trajectories): (Vec<FieldRow>, Vec<Trajectory>) = (Vec::new(), Vec::new());
    let mut lacks = [0; 2];
    for row in rows(analysis) {
        lacks[0] += usize::from(row.utc_ms.is_none());
        lacks[1] += usize::from(row.fix.lat_lon_deg.is_none());
        if row.utc_ms.is_none() || row.fix.lat_lon_deg.is_none() {
            continue;
        }
        match trajectories.last_mut() {
            Some(last)
                if last.flight == row.flight
                    && last.drone == row.drone
                    && last.slot == row.slot =>
            {
                last.count += 1;
            }
            _ => trajectories.push(Trajectory {
                flight: row.flight.clone(),
                drone: row.drone.clone(),
                slot: row.slot,
                place_by: row.place_by(),
                count: 1,
            }),
        }
        kept.push(row);
    }
    (kept, trajectories, lacks)
}

/// Why rows are left out.
fn words(kept: usize, [no_time, no_place]: [usize; 2]) -> Option<String> {
    let why = match (no_time > 0, no_place > 0) {
        (false, false) => return None,
        (true, false) => "have no UTC (no GPS time in the log)",
        (false, true) => "have no place on the globe (none in the log, and no origin in the plan)",
        (true, true) => "have no UTC or no place on the globe",
    };
    let (who, file) = if kept == 0 {
        ("The values", "there is no NetCDF file of the drones")
    } else {
        ("Some values", "the NetCDF file of the drones is without them")
    };
    Some(format!("{who} {why}: {file}; the tables in fields/ have all of them"))
}

/// The file, if any row can be in it, and what is left out.
pub(super) fn file(
    analysis: &Analysis,
    origin: &Origin,
    format: Format,
) -> Result<(Option<Vec<u8>>, Option<String>), NetcdfError> {
    let (rows, trajectories, lacks) = placed(analysis);
    let left_out = words(rows.len(), lacks);
    let Some(extent) = extent_of(&rows) else { return Ok((None, left_out)) };
    let mut file = File::new(format);
    let about = About {
        title: "",
        summary: "Vertical air speed second by second at each drone of a swarm, as running 10 s means, with standard errors \
                  and flags; with the horizontal wind that the drones lean against, where their drag is known.",
        comment: "w is up positive. w_se holds all errors, those that all drones share as well: it does not fall with the \
                  root of the number of values; w_noise is the drone's own noise alone. Errors of u and v are those of the \
                  vehicle's drag and of its trim, the same in sign through a flight. Values of neighbouring seconds share \
                  most of their 10 s.",
        feature_type: "trajectory",
        data_type: "Trajectory",
        extent,
    };
    globals::write(&mut file, &about, (analysis, origin))?;
    instances(&mut file, &trajectories)?;
    observations(&mut file, &rows, &trajectories)?;
    Ok((Some(file.finish()?), left_out))
}

/// `None`: there are no rows.
fn extent_of(rows: &[FieldRow]) -> Option<Extent> {
    let (low_ms, high_ms) = (
        rows.iter().filter_map(|row| row.utc_ms).min()?,
        rows.iter().filter_map(|row| row.utc_ms).max()?,
    );
    let degrees =
        |axis: usize| extent(rows.iter().filter_map(|row| Some(row.fix.lat_lon_deg?.0[axis])));
    let (lat, lon) = (degrees(0)?, degrees(1)?);
    let height = extent(rows.iter().filter_map(|row| row.fix.height_m))?;
    Some(Extent {
        lat_deg: [lat.0, lat.1],
        lon_deg: [lon.0, lon.1],
        height_m: [height.0, height.1],
        utc_ms: [low_ms, high_ms],
        step_s: 1,
    })
}

/// Variables that each trajectory has one value of.
fn instances(file: &mut File, trajectories: &[Trajectory]) -> Result<(), NetcdfError> {
    let instance = file.dimension("trajectory", trajectories.len())?;
    let of = |get: fn(&Trajectory) -> String| trajectories.iter().map(get).collect::<Vec<_>>();
    let ids = of(|one| format!("{}/{}", one.flight, one.drone));
    let named = [
        ("trajectory_id", "flight and drone", ids, Some("trajectory_id")),
        ("flight", "name of the flight", of(|one| one.flight.clone()), None),
        ("drone", "label of the drone", of(|one| one.drone.clone()), None),
        (
            "place_by",
            "where latitude and longitude come from: the drone's log, or the plan",
            of(|one| one.place_by.to_owned()),
            None,
        ),
    ];
    for (name, long_name, values, role) in named {
        let length = file.dimension(&format!("{name}_strlen"), longest(&values))?;
        let mut attributes = vec![("long_name", text(long_name))];
        attributes.extend(role.map(|role| ("cf_role", text(role))));
        file.texts(name, [instance, length], &attributes, &values)?;
    }
    let slots: Vec<i32> = trajectories.iter().map(|one| one.slot.map_or(-1, i32::from)).collect();
    let slot = beside("slot number of the drone in the plan", "1");
    let unplanned = slots.contains(&-1).then_some(-1);
    file.variable("slot", &[instance], &slot, (&slots, unplanned))?;
    let counts: Vec<i32> = trajectories.iter().map(|one| one.count as i32).collect();
    let attributes = [
        ("long_name", text("number of observations of the trajectory")),
        ("sample_dimension", text("obs")),
        ("units", text("1")),
    ];
    file.variable("row_size", &[instance], &attributes, (&counts, None))
}

/// Variables that each second has one value of.
fn observations(
    file: &mut File,
    rows: &[FieldRow],
    trajectories: &[Trajectory],
) -> Result<(), NetcdfError> {
    let is_amsl = rows.iter().any(|row| row.fix.amsl_m.is_some());
    let obs = file.dimension("obs", rows.len())?;
    let ends = file.dimension("bound", 2)?;
    let seconds = |row: &FieldRow| row.utc_ms.unwrap_or_default() as f64 / 1000.0;
    let time_s: Vec<f64> = rows.iter().map(seconds).collect();
    let bounds: Vec<f64> = time_s.iter().flat_map(|s| [s - HALF_S, s + HALF_S]).collect();
    file.variable("time", &[obs], &time_attributes("time_bounds"), (&time_s, None))?;
    file.variable("time_bounds", &[obs, ends], &[], (&bounds, None))?;
    let degrees = |axis: usize| -> Vec<f64> {
        rows.iter().map(|row| row.fix.lat_lon_deg.map_or(f64::NAN, |(deg, _)| deg[axis])).collect()
    };
    for (name, standard, units, axis, at) in
        [("lat", "latitude", "degrees_north", "Y", 0), ("lon", "longitude", "degrees_east", "X", 1)]
    {
        let attributes = [
            ("standard_name", text(standard)),
            ("long_name", text(format!("{standard} (WGS 84)"))),
            ("units", text(units)),
            ("axis", text(axis)),
        ];
        file.variable(name, &[obs], &attributes, (&degrees(at), None))?;
    }
    let vertical = |standard: &str, long_name: &str, is_axis: bool| {
        let mut attributes = vec![
            ("standard_name", text(standard)),
            ("long_name", text(long_name)),
            ("units", text("m")),
            ("positive", text("up")),
        ];
        attributes.extend(is_axis.then(|| ("axis", text("Z"))));
        attributes
    };
    let height = vertical("height", "height above take-off", !is_amsl);
    file.variable(
        "height",
        &[obs],
        &height,
        (&floats(rows, |row| row.fix.height_m), Some(f32::NAN)),
    )?;
    let coordinates = if is_amsl {
        let alt = vertical(
            "altitude",
            "height above mean sea level (the receiver's geoid, or the plan's)",
            true,
        );
        file.variable("alt", &[obs], &alt, (&floats(rows, |row| row.fix.amsl_m), Some(f32::NAN)))?;
        format!("{COORDINATES} alt")
    } else {
        COORDINATES.to_owned()
    };
    let show: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
    let of_show = beside("show time: since the start of the flight's show", "s");
    file.variable("show_time", &[obs], &of_show, (&show, None))?;
    let index: Vec<i32> = (0_i32..)
        .zip(trajectories)
        .flat_map(|(index, one)| std::iter::repeat_n(index, one.count))
        .collect();
    let of_index = beside("number of the trajectory, from 0: for selecting", "1");
    file.variable("trajectory_index", &[obs], &of_index, (&index, None))?;

    for speed in speeds::of(rows) {
        let attributes = speed.attributes(&coordinates);
        file.variable(speed.name, &[obs], &attributes, (&floats(rows, speed.get), Some(f32::NAN)))?;
    }
    let flags: Vec<i16> = rows.iter().map(speeds::bits).collect();
    file.variable("w_flag", &[obs], &speeds::flag_attributes(&coordinates), (&flags, None))
}

/// Attributes of a number that goes with the others.
pub(super) fn beside(long_name: &str, units: &str) -> Vec<Attribute<'static>> {
    vec![
        ("long_name", text(long_name)),
        ("units", text(units)),
        ("coverage_content_type", text("auxiliaryInformation")),
    ]
}

/// Attributes of a time of UTC.
pub(super) fn time_attributes(bounds: &str) -> Vec<Attribute<'static>> {
    vec![
        ("standard_name", text("time")),
        ("long_name", text("UTC (middle of the 10 s of a mean)")),
        ("units", text("seconds since 1970-01-01T00:00:00Z")),
        ("calendar", text("standard")),
        ("units_metadata", text("leap_seconds: none")),
        ("axis", text("T")),
        ("bounds", text(bounds)),
    ]
}
