//! All drones: one trajectory for each drone of each flight.

use netcdf_writer::NcAttrValue;

use super::file::{File, floats, longest, text};
use super::globals::{self, About, Extent};
use super::{Format, NetcdfError};
use crate::analysis::result::Analysis;
use crate::numeric::extent;
use crate::products::Origin;
use crate::products::fields::{FILLED, FieldRow, rows};

/// Half of the time that a value is a mean of, s.
const HALF_S: f64 = 5.0;
/// Flags of a value, each a bit from the lowest on; the names are those of the tables.
const FLAGS: [&str; 10] = [
    "saturation",
    "low_battery",
    "gap",
    "incomplete",
    "manoeuvre",
    "misaligned",
    "drift",
    "no_voltage",
    "beyond_ladder",
    FILLED,
];

/// Coordinates of all values along trajectories.
const COORDINATES: &str = "time lat lon height";

/// Bits of a row's flags.
fn bits(row: &FieldRow) -> i16 {
    let bit = |name: &str| FLAGS.iter().position(|flag| *flag == name).map_or(0, |bit| 1 << bit);
    row.flags.split(';').map(bit).fold(0, |bits: i16, bit| bits | bit)
}

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
    observations(&mut file, &rows, &trajectories, extent.is_amsl)?;
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
    let amsl = extent(rows.iter().filter_map(|row| row.fix.amsl_m));
    let height = amsl.or_else(|| extent(rows.iter().filter_map(|row| row.fix.height_m)))?;
    Some(Extent {
        lat_deg: [lat.0, lat.1],
        lon_deg: [lon.0, lon.1],
        height_m: [height.0, height.1],
        is_amsl: amsl.is_some(),
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
    let slot = [("long_name", text("slot number of the drone in the plan")), ("units", text("1"))];
    file.variable("slot", &[instance], &slot, (&slots, Some(-1)))?;
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
    is_amsl: bool,
) -> Result<(), NetcdfError> {
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
    let of_show = [
        ("long_name", text("show time: since the start of the flight's show")),
        ("units", text("s")),
    ];
    file.variable("show_time", &[obs], &of_show, (&show, None))?;
    let index: Vec<i32> = (0_i32..)
        .zip(trajectories)
        .flat_map(|(index, one)| std::iter::repeat_n(index, one.count))
        .collect();
    let of_index = [
        ("long_name", text("number of the trajectory, from 0: for selecting")),
        ("units", text("1")),
    ];
    file.variable("trajectory_index", &[obs], &of_index, (&index, None))?;

    for value in values(rows) {
        let mut attributes = vec![("long_name", text(value.long_name)), ("units", text("m s-1"))];
        attributes.extend(
            (!value.standard_name.is_empty()).then(|| ("standard_name", text(value.standard_name))),
        );
        attributes.push(("coordinates", text(coordinates.as_str())));
        attributes.extend(
            (!value.ancillary.is_empty()).then(|| ("ancillary_variables", text(value.ancillary))),
        );
        attributes.extend(value.is_mean.then(|| ("cell_methods", text("time: mean"))));
        file.variable(value.name, &[obs], &attributes, (&floats(rows, value.get), Some(f32::NAN)))?;
    }
    let masks: Vec<i16> = (0..FLAGS.len()).map(|bit| 1 << bit).collect();
    let attributes = [
        ("standard_name", text("quality_flag")),
        ("long_name", text("doubts about w; 0: none")),
        ("flag_masks", NcAttrValue::Shorts(masks)),
        ("flag_meanings", text(FLAGS.join(" "))),
        ("coordinates", text(coordinates)),
    ];
    let flags: Vec<i16> = rows.iter().map(bits).collect();
    file.variable("w_flag", &[obs], &attributes, (&flags, None))
}

/// Attributes of a time of UTC.
pub(super) fn time_attributes(bounds: &str) -> Vec<(&'static str, NcAttrValue)> {
    vec![
        ("standard_name", text("time")),
        ("long_name", text("UTC in the middle of the 10 s that values are means of")),
        ("units", text("seconds since 1970-01-01T00:00:00Z")),
        ("calendar", text("standard")),
        ("units_metadata", text("leap_seconds: none")),
        ("axis", text("T")),
        ("bounds", text(bounds)),
    ]
}

/// A speed of each second.
struct Speed {
    name: &'static str,
    standard_name: &'static str,
    long_name: &'static str,
    ancillary: &'static str,
    is_mean: bool,
    get: fn(&FieldRow) -> Option<f64>,
}

/// The speeds that any row has.
fn values(rows: &[FieldRow]) -> Vec<Speed> {
    let speed = |name, standard_name, long_name, get| Speed {
        name,
        standard_name,
        long_name,
        ancillary: "",
        is_mean: false,
        get,
    };
    let mean = |speed: Speed, ancillary| Speed { ancillary, is_mean: true, ..speed };
    let w = "upward_air_velocity";
    let all = [
        mean(speed("w", w, "vertical air speed, up positive", |row| row.w_mps), "w_se w_flag"),
        speed(
            "w_se",
            "upward_air_velocity standard_error",
            "standard error of w, all errors included",
            |row| row.w_se_mps,
        ),
        speed("w_noise", "", "standard error of w from the drone's own noise alone", |row| {
            row.sd_mps
        }),
        mean(
            speed(
                "w_posterior",
                w,
                "vertical air speed by all drones, seconds and the calibration together",
                |row| row.posterior_mps,
            ),
            "w_posterior_se",
        ),
        speed(
            "w_posterior_se",
            "upward_air_velocity standard_error",
            "standard deviation of w_posterior, all errors included",
            |row| row.posterior_sd_mps,
        ),
        mean(
            speed(
                "w_true",
                w,
                "true vertical air speed of the simulation, or by instruments beside the drone",
                |row| row.truth_mps,
            ),
            "",
        ),
        mean(
            speed("u", "eastward_wind", "wind towards true east, by the drone's lean", |row| {
                Some(row.wind_mps?[0])
            }),
            "u_se",
        ),
        speed(
            "u_se",
            "eastward_wind standard_error",
            "standard error of u, from drag and trim",
            |row| Some(row.wind_se_mps?[0]),
        ),
        mean(
            speed("v", "northward_wind", "wind towards true north, by the drone's lean", |row| {
                Some(row.wind_mps?[1])
            }),
            "v_se",
        ),
        speed(
            "v_se",
            "northward_wind standard_error",
            "standard error of v, from drag and trim",
            |row| Some(row.wind_se_mps?[1]),
        ),
    ];
    // The first two and the wind are always there, so that programs find them; others only with values.
    let always = ["w", "w_se", "u", "u_se", "v", "v_se"];
    let used =
        |one: &Speed| always.contains(&one.name) || rows.iter().any(|row| (one.get)(row).is_some());
    all.into_iter().filter(used).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::result::Quality;

    #[test]
    fn each_flag_of_an_analysis_has_its_bit() {
        // A new kind of doubt must get a bit, at the end.
        let all = [
            Quality::Saturation,
            Quality::LowBattery,
            Quality::Gap,
            Quality::Incomplete,
            Quality::Manoeuvre,
            Quality::Misaligned,
            Quality::Drift,
            Quality::NoVoltage,
            Quality::BeyondLadder,
        ];
        for (bit, quality) in all.into_iter().enumerate() {
            let name = serde_json::to_value(quality).unwrap();
            assert_eq!(name.as_str(), Some(FLAGS[bit]));
        }
    }
}
