//! Files of a model, with errors that say what a simulation's output must be.

use std::path::{Path, PathBuf};

use super::LesError;
use crate::base::netcdf::{NetcdfError, NetcdfFile, Selection, Variable};

pub(super) use crate::base::netcdf::{is_number, listed};

/// Dimensions of a component: time, z, y and x.
pub(super) const DIMENSIONS: usize = 4;

/// An opened file.
pub(super) struct File {
    pub(super) path: PathBuf,
    nc: NetcdfFile,
}

impl File {
    pub(super) fn open(path: &Path) -> Result<Self, LesError> {
        let advice = "give a NetCDF file (classic or NetCDF-4) of a large-eddy simulation";
        let nc = NetcdfFile::open(path).map_err(|error| match error {
            NetcdfError::Open(error) => error.into(),
            NetcdfError::File { reason, .. } => LesError::of_file(
                path,
                format!("it is not NetCDF that can be read ({reason}); {advice}"),
            ),
        })?;
        Ok(Self { path: path.to_owned(), nc })
    }

    /// A variable by its name.
    pub(super) fn variable(&self, name: &str) -> Option<&Variable> {
        self.nc.variable(name)
    }

    /// Names of the variables with four dimensions, for messages.
    pub(super) fn fields(&self) -> Vec<String> {
        self.nc.names(DIMENSIONS)
    }

    /// Values of a variable with one dimension.
    pub(super) fn axis(&self, name: &str) -> Result<Vec<f64>, LesError> {
        let wrong = |reason: String| LesError::of_variable(&self.path, name, reason);
        let Some(variable) = self.variable(name) else {
            return Err(wrong(format!(
                "there is no such coordinate; name it in a mapping (map=FILE.toml); variables with one dimension are {}",
                listed(&self.nc.names(1))
            )));
        };
        if variable.ndim() != 1 {
            return Err(wrong(format!(
                "it has {} dimensions instead of one: heights that follow the ground cannot be read",
                variable.ndim()
            )));
        }
        self.nc.axis(variable).map_err(wrong)
    }

    /// Unit of a variable.
    pub(super) fn units(&self, name: &str) -> Option<String> {
        self.nc.text(name, "units")
    }

    /// Values of a block of a component at one time, NaN for what is missing by the variable's attributes.
    pub(super) fn block(
        &self,
        name: &str,
        time: usize,
        from: [usize; 3],
        count: [usize; 3],
    ) -> Result<Vec<f64>, LesError> {
        let mut selections = vec![Selection::Index(time as u64)];
        for (from, count) in from.into_iter().zip(count) {
            let start = from as u64;
            selections.push(Selection::Slice { start, end: start + count as u64, step: 1 });
        }
        self.nc
            .part(name, selections)
            .map_err(|reason| LesError::of_variable(&self.path, name, reason))
    }
}
