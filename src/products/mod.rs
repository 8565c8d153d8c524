//! Files for other programs: the measured fields and the turbulence of an analysis as tables, as NetCDF by the CF conventions, and on
//! maps (KML, GeoJSON).
//!
//! All are pure functions of the analysis and of its [`Origin`]: equal input gives equal bytes. Quantities, formulas and
//! errors are described in `docs/fields.md` and `docs/products.md`.

pub mod fields;
pub mod fields_grid;
#[cfg(feature = "parquet")]
pub mod fields_parquet;
pub mod geojson;
pub mod kml;
#[cfg(feature = "netcdf")]
pub mod netcdf;
mod on_map;
pub mod thermals;
pub mod turbulence;
mod where_when;
mod words;

use crate::analysis::result::Analysis;

pub use where_when::{Fix, FixBy, WhereWhen, Zero};
pub use words::{clean, iso};

/// Whether drones can be put on a map: any has a value and a place.
pub fn has_map(analysis: &Analysis) -> bool {
    fields::rows(analysis).any(|row| row.w_mps.is_some() && row.fix.lat_lon_deg.is_some())
}

/// How an analysis came to be, for the files' own words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Name and version of the program.
    pub program: String,
    /// Command line that made the analysis, as a user would type it.
    pub command: String,
    /// Organisation that measured; empty: not stated.
    pub institution: String,
    /// Files that were read: path, SHA-256 in hexadecimal.
    pub inputs: Vec<(String, String)>,
    /// SHA-256 of `analysis.json`, hexadecimal; `None`: not known.
    pub analysis_sha256: Option<String>,
}
