//! Global attributes: those of CF and of the Attribute Convention for Data Discovery (ACDD 1.3).
//!
//! Nothing in it is of the day on which the file was made: the same analysis gives the same bytes.

use netcdf_writer::NcAttrValue;

use super::NetcdfError;
use super::file::{File, text};
use crate::analysis::result::Analysis;
use crate::base::digest::sha256_of_list;
use crate::products::words::{self, clean, iso};
use crate::products::{Origin, fields};

/// Files that are named one by one; logs are told by their number and the hash of the list.
const NAMED: [&str; 5] =
    ["plan.json", "vehicle.toml", "campaign.json", "flight.json", "manifest.json"];
/// Most of them.
const MOST_NAMED: usize = 40;

/// Extent of a file's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    /// Latitude, longitude, degrees, and height above take-off, m: lowest and highest.
    pub(super) lat_deg: [f64; 2],
    pub(super) lon_deg: [f64; 2],
    pub(super) height_m: [f64; 2],
    /// First and last time, ms of UTC since 1970.
    pub(super) utc_ms: [i64; 2],
    /// Time between values, s.
    pub(super) step_s: u32,
}

/// What differs between the files.
pub(super) struct About<'a> {
    /// Added to the title.
    pub(super) title: &'a str,
    /// The file in a sentence.
    pub(super) summary: &'a str,
    /// What a reader must know.
    pub(super) comment: &'a str,
    /// Type of discrete sampling geometry; empty: a grid.
    pub(super) feature_type: &'a str,
    /// Type of data by ACDD: `trajectory`, `grid`.
    pub(super) data_type: &'a str,
    pub(super) extent: Extent,
}

/// Writes the global attributes.
pub(super) fn write(
    file: &mut File,
    about: &About<'_>,
    (analysis, origin): (&Analysis, &Origin),
) -> Result<(), NetcdfError> {
    let Extent { lat_deg, lon_deg, height_m, utc_ms: [from_ms, to_ms], step_s } = about.extent;
    let program = words::program(analysis, origin);
    let [from, to] = [iso(from_ms), iso(to_ms)];
    let command = if origin.command.is_empty() {
        String::new()
    } else {
        format!(": {}", clean(&origin.command))
    };
    let simulated = analysis.flights.iter().any(|flight| flight.simulated);
    let method = "running 10 s means of rotor effort, vertical velocity and attitude from the drones' logs; a law fitted to a \
                  calibration flight gives the air's vertical speed as the drone's own minus the speed through the air that \
                  the effort stands for; errors by docs/errors.md";
    let texts = [
        ("Conventions", "CF-1.11, ACDD-1.3".to_owned()),
        ("title", format!("{}{}", words::title(analysis), about.title)),
        ("summary", about.summary.to_owned()),
        ("institution", clean(&origin.institution)),
        ("source", words::source(analysis)),
        (
            "history",
            format!(
                "{from} to {to}: measured, by the logs' clocks; then analysed by {program}{command}"
            ),
        ),
        ("references", words::REFERENCES.to_owned()),
        ("comment", about.comment.to_owned()),
        ("method", method.to_owned()),
        ("featureType", about.feature_type.to_owned()),
        ("cdm_data_type", about.data_type.to_owned()),
        (
            "keywords",
            "vertical wind velocity, updraft, thermal, turbulence, unmanned aerial vehicle, swarm"
                .to_owned(),
        ),
        ("standard_name_vocabulary", "CF Standard Name Table v93".to_owned()),
        (
            "platform",
            if simulated { "simulated multirotor drones" } else { "multirotor drones" }.to_owned(),
        ),
        (
            "processing_level",
            "values every second or every 10 s, with standard errors and flags".to_owned(),
        ),
        ("software_version", program.clone()),
        ("product_version", program),
        ("id", origin.analysis_sha256.as_deref().map_or_else(String::new, clean)),
        ("analysis_sha256", origin.analysis_sha256.as_deref().map_or_else(String::new, clean)),
        ("inputs", named(&origin.inputs)),
        ("time_coverage_start", from),
        ("time_coverage_end", to),
        ("time_coverage_duration", format!("PT{}S", (to_ms - from_ms) / 1000)),
        ("time_coverage_resolution", format!("PT{step_s}S")),
        ("geospatial_vertical_positive", "up".to_owned()),
        ("geospatial_vertical_units", "m".to_owned()),
        ("geospatial_vertical_reference", "take-off".to_owned()),
        ("geospatial_bounds", polygon(lat_deg, lon_deg)),
        ("geospatial_bounds_crs", "EPSG:4326".to_owned()),
        ("creator_name", clean(&origin.institution)),
        ("creator_type", if origin.institution.is_empty() { "" } else { "institution" }.to_owned()),
        ("geospatial_lat_units", "degrees_north".to_owned()),
        ("geospatial_lon_units", "degrees_east".to_owned()),
    ];
    for (name, value) in texts {
        file.global(name, text(value))?;
    }
    if !origin.inputs.is_empty() {
        let files = origin.inputs.iter().map(|(path, hash)| (path.as_str(), hash.as_str()));
        file.global("inputs_sha256", text(sha256_of_list(files)))?;
        file.global("inputs_count", NcAttrValue::Ints(vec![origin.inputs.len() as i32]))?;
    }
    for (name, value) in [
        ("geospatial_lat_min", lat_deg[0]),
        ("geospatial_lat_max", lat_deg[1]),
        ("geospatial_lon_min", lon_deg[0]),
        ("geospatial_lon_max", lon_deg[1]),
        ("geospatial_vertical_min", height_m[0]),
        ("geospatial_vertical_max", height_m[1]),
    ] {
        file.global(name, NcAttrValue::Doubles(vec![value]))?;
    }
    let flights = fields::ids(analysis);
    file.global("flights", text(flights.join(", ")))
}

/// The rectangle around all values, by latitude and longitude, as well-known text.
fn polygon([south, north]: [f64; 2], [west, east]: [f64; 2]) -> String {
    let corners = [[south, west], [south, east], [north, east], [north, west], [south, west]];
    let corners: Vec<String> =
        corners.iter().map(|[lat, lon]| format!("{lat:.7} {lon:.7}")).collect();
    format!("POLYGON (({}))", corners.join(", "))
}

/// Plans, vehicles and records, one to a line as `sha256sum` writes them.
fn named(inputs: &[(String, String)]) -> String {
    let is_named =
        |path: &str| NAMED.iter().any(|name| path == *name || path.ends_with(&format!("/{name}")));
    let lines = inputs.iter().filter(|(path, _)| is_named(path)).take(MOST_NAMED);
    let lines: Vec<String> =
        lines.map(|(path, hash)| format!("{}  {}", clean(hash), clean(path))).collect();
    lines.join("\n")
}
