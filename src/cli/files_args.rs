//! Arguments for the files that an analysis writes for other programs.

use clap::Args;

use crate::workflow::analyze::{Files, Settings};

/// Files for other programs.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Files for other programs")]
pub(super) struct FilesArgs {
    /// Write NetCDF files in the classic format (CDF-2), for programs that cannot read NetCDF-4
    #[arg(long)]
    netcdf_classic: bool,
    /// Organisation that measured, for the attributes of NetCDF files
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    institution: String,
}

impl FilesArgs {
    /// Settings with these files.
    pub(super) fn of(&self, settings: Settings) -> Settings {
        let Self { netcdf_classic, institution } = self.clone();
        Settings { files: Files { netcdf_classic, institution }, ..settings }
    }
}
