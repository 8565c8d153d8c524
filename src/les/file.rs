//! NetCDF files that somebody else wrote: opened without mapping them, read within bounds.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use netcdf_reader::{FileStorage, NcFile, NcOpenOptions, NcSliceInfo, NcSliceInfoElem, NcVariable};

use super::LesError;
use crate::base::file::{FileError, open_regular};
use crate::base::plain::plain;

/// Most values that are read at once, bytes as they are in the file.
const MOST_READ_BYTES: usize = 256 << 20;
/// Chunks that were unpacked last, bytes: blocks of the same chunk follow each other.
const CHUNK_CACHE_BYTES: usize = 256 << 20;
/// Most points of an axis.
const LONGEST_AXIS: u64 = 1 << 20;
/// Dimensions of a component: time, z, y and x.
pub(super) const DIMENSIONS: usize = 4;

/// An opened file.
pub(super) struct File {
    pub(super) path: PathBuf,
    nc: NcFile,
}

impl File {
    pub(super) fn open(path: &Path) -> Result<Self, LesError> {
        let advice = "give a NetCDF file (classic or NetCDF-4) of a large-eddy simulation";
        let (file, _) = open_regular(path).map_err(|error| FileError::new("open", path, error))?;
        let open = || {
            let storage = FileStorage::from_file(file)?;
            let options = NcOpenOptions {
                chunk_cache_bytes: CHUNK_CACHE_BYTES,
                max_read_bytes: MOST_READ_BYTES,
                ..NcOpenOptions::default()
            };
            NcFile::from_storage_with_options(Arc::new(storage), options)
        };
        let nc = open().map_err(|error| {
            LesError::of_file(
                path,
                format!("it is not NetCDF that can be read ({}); {advice}", said(&error)),
            )
        })?;
        Ok(Self { path: path.to_owned(), nc })
    }

    /// A variable by its name.
    pub(super) fn variable(&self, name: &str) -> Option<&NcVariable> {
        self.nc.variable(name).ok()
    }

    /// Names of the variables with four dimensions, for messages.
    pub(super) fn fields(&self) -> Vec<String> {
        let variables = self.nc.variables().unwrap_or_default();
        let fields = variables.iter().filter(|variable| variable.ndim() == DIMENSIONS);
        fields.take(20).map(|variable| plain(variable.name()).into_owned()).collect()
    }

    /// Names of the variables with one dimension.
    pub(super) fn axes(&self) -> Vec<String> {
        let variables = self.nc.variables().unwrap_or_default();
        let axes = variables.iter().filter(|variable| variable.ndim() == 1);
        axes.take(20).map(|variable| plain(variable.name()).into_owned()).collect()
    }

    /// Values of a variable with one dimension.
    pub(super) fn axis(&self, name: &str) -> Result<Vec<f64>, LesError> {
        let wrong = |reason: String| LesError::of_variable(&self.path, name, reason);
        let Some(variable) = self.variable(name) else {
            return Err(wrong(format!(
                "there is no such coordinate; name it in a mapping (map=FILE.toml); variables with one dimension are {}",
                listed(&self.axes())
            )));
        };
        match variable.shape()[..] {
            [count] if count <= LONGEST_AXIS => {}
            [count] => return Err(wrong(format!("{count} points are too many for an axis"))),
            _ => {
                return Err(wrong(format!(
                    "it has {} dimensions instead of one: heights that follow the ground cannot be read",
                    variable.ndim()
                )));
            }
        }
        let values = self
            .nc
            .read_variable_as_f64(name)
            .map_err(|error| wrong(format!("it cannot be read: {}", said(&error))))?;
        Ok(values.iter().copied().collect())
    }

    /// Unit of a variable.
    pub(super) fn units(&self, name: &str) -> Option<String> {
        let text = self.variable(name)?.attribute("units")?.value.as_string()?;
        Some(plain(text.trim().trim_matches('\0')).into_owned())
    }

    /// Values of a block of a component at one time, NaN for what is missing by the variable's attributes.
    pub(super) fn block(
        &self,
        name: &str,
        time: usize,
        from: [usize; 3],
        count: [usize; 3],
    ) -> Result<Vec<f64>, LesError> {
        let mut selections = vec![NcSliceInfoElem::Index(time as u64)];
        for (from, count) in from.into_iter().zip(count) {
            let start = from as u64;
            selections.push(NcSliceInfoElem::Slice { start, end: start + count as u64, step: 1 });
        }
        let values = self
            .nc
            .read_variable_slice_unpacked_masked(name, &NcSliceInfo { selections })
            .map_err(|error| {
                let reason = format!("it cannot be read ({}): is the file whole?", said(&error));
                LesError::of_variable(&self.path, name, reason)
            })?;
        Ok(values.iter().copied().collect())
    }
}

/// Whether a variable is of numbers.
pub(super) fn is_number(variable: &NcVariable) -> bool {
    use netcdf_reader::NcType;
    matches!(
        variable.dtype(),
        NcType::Float | NcType::Double | NcType::Short | NcType::Int | NcType::Byte
    )
}

/// Words of the reader, which may quote the file.
fn said(error: &netcdf_reader::Error) -> String {
    plain(&error.to_string()).into_owned()
}

/// Names for a message.
pub(super) fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
