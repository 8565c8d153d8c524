//! NetCDF files that somebody else wrote: opened without mapping them, read within bounds.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use netcdf_reader::{FileStorage, NcFile, NcOpenOptions, NcSliceInfo};
use thiserror::Error;

pub use netcdf_reader::{NcSliceInfoElem as Selection, NcType as Type, NcVariable as Variable};

use super::file::{FileError, open_regular};
use super::plain::{Shown as _, plain};

/// Most values that are read at once, bytes as they are in the file.
const MOST_READ_BYTES: usize = 256 << 20;
/// Chunks that were unpacked last, bytes: pieces of the same chunk follow each other.
const CHUNK_CACHE_BYTES: usize = 256 << 20;
/// Most points of an axis.
const LONGEST_AXIS: u64 = 1 << 20;
/// Names in a message.
const MOST_NAMES: usize = 20;

/// Error of reading a NetCDF file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NetcdfError {
    /// The file is not there, or cannot be opened.
    #[error(transparent)]
    Open(#[from] FileError),
    /// The file is no NetCDF.
    #[error("{}: it is not NetCDF that can be read ({reason})", path.shown())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Words of the reader.
        reason: String,
    },
}

/// An opened file.
pub struct NetcdfFile {
    /// Path of the file.
    pub path: PathBuf,
    nc: NcFile,
}

impl NetcdfFile {
    /// Opens a file, classic or NetCDF-4.
    ///
    /// # Errors
    /// [`NetcdfError`].
    pub fn open(path: &Path) -> Result<Self, NetcdfError> {
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
        let broken = |error: netcdf_reader::Error| NetcdfError::File {
            path: path.to_owned(),
            reason: said(&error),
        };
        let nc = open().map_err(broken)?;
        // A file that is cut off can often be opened: what fails are its variables.
        nc.variables().map_err(broken)?;
        Ok(Self { path: path.to_owned(), nc })
    }

    /// A variable by its name.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.nc.variable(name).ok()
    }

    /// All variables of the root group.
    pub fn variables(&self) -> &[Variable] {
        self.nc.variables().unwrap_or_default()
    }

    /// Names of the variables with this many dimensions, for messages.
    pub fn names(&self, dimensions: usize) -> Vec<String> {
        let those = self.variables().iter().filter(|variable| variable.ndim() == dimensions);
        those.take(MOST_NAMES).map(|variable| plain(variable.name()).into_owned()).collect()
    }

    /// A text attribute of a variable.
    pub fn text(&self, variable: &str, attribute: &str) -> Option<String> {
        text(self.variable(variable)?, attribute)
    }

    /// Values of a variable with one dimension, as they are in the file.
    ///
    /// # Errors
    /// The reason that they cannot be read.
    pub fn axis(&self, variable: &Variable) -> Result<Vec<f64>, String> {
        match variable.shape()[..] {
            [count] if count <= LONGEST_AXIS => {}
            [count] => return Err(format!("{count} points are too many for an axis")),
            _ => return Err(format!("it has {} dimensions instead of one", variable.ndim())),
        }
        let values = self
            .nc
            .read_variable_as_f64(variable.name())
            .map_err(|error| format!("it cannot be read: {}", said(&error)))?;
        Ok(values.iter().copied().collect())
    }

    /// Part of a variable, unpacked (`scale_factor`, `add_offset`), NaN for what is missing by its attributes. How much
    /// is asked for bounds the memory.
    ///
    /// # Errors
    /// The reason that it cannot be read.
    pub fn part(&self, name: &str, selections: Vec<Selection>) -> Result<Vec<f64>, String> {
        let values = self
            .nc
            .read_variable_slice_unpacked_masked(name, &NcSliceInfo { selections })
            .map_err(|error| format!("it cannot be read ({}): is the file whole?", said(&error)))?;
        Ok(values.iter().copied().collect())
    }
}

/// A text attribute of a variable, without what could not be printed.
pub fn text(variable: &Variable, attribute: &str) -> Option<String> {
    let value = variable.attribute(attribute)?.value.as_string()?;
    Some(plain(value.trim().trim_matches('\0')).into_owned())
}

/// Whether a variable is of numbers.
pub fn is_number(variable: &Variable) -> bool {
    matches!(
        variable.dtype(),
        Type::Float
            | Type::Double
            | Type::Byte
            | Type::Short
            | Type::Int
            | Type::UByte
            | Type::UShort
            | Type::UInt
            | Type::Int64
            | Type::UInt64
    )
}

/// Names for a message.
pub fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Words of the reader, which may quote the file.
fn said(error: &netcdf_reader::Error) -> String {
    plain(&error.to_string()).into_owned()
}
