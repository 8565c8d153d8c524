//! Options for the picture of the ground below a report's map, shared by `analyze` and `run`.

use std::path::PathBuf;

use clap::Args;

use super::exit::CommandError;
use crate::report::{Basemap, Corners};
use crate::workflow::basemap::read_basemap;

/// The picture and where it lies.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Report")]
pub(super) struct BasemapArgs {
    /// Picture of the ground below the report's map: PNG, JPEG or WebP, north up (docs/basemap.md)
    #[arg(long, value_name = "FILE")]
    pub(super) basemap: Option<PathBuf>,
    /// South-west and north-east corner of the picture, degrees [default: from FILE.json]
    #[arg(long, value_name = "LAT,LON LAT,LON", requires = "basemap", allow_hyphen_values = true)]
    basemap_corners: Option<Corners>,
}

impl BasemapArgs {
    /// The picture, if one was given.
    pub(super) fn read(&self) -> Result<Option<Basemap>, CommandError> {
        let read = |path: &PathBuf| read_basemap(path, self.basemap_corners);
        self.basemap.as_ref().map(read).transpose()
    }
}
