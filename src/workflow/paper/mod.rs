//! Figures for printed papers, written beside a report.

#[cfg(feature = "paper-figures")]
mod written;

use std::path::PathBuf;

use super::error::WorkflowError;
use super::host::Host;
use crate::analysis::result::Analysis;
use crate::base::plain::Shown as _;
use crate::compare::result::Comparison;
use crate::gap::Verdict;
use crate::mast::MastComparison;
use crate::report::Beside;

/// Narrowest and widest column, mm.
pub const WIDTH_RANGE_MM: [f64; 2] = [60.0, 300.0];

/// A wish for figures of printed papers.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperFigures {
    /// Folder that they are written to; each width has a folder in it.
    pub folder: PathBuf,
    /// Widths of columns, mm, within [`WIDTH_RANGE_MM`].
    pub widths_mm: Vec<f64>,
}

/// Results whose figures are written.
#[derive(Clone, Copy, Debug)]
pub enum Shown<'a> {
    /// An analysis, with what its report has beside it.
    Analysis(&'a Analysis, Beside<'a>),
    /// A verdict on what a model lacks.
    Verdict(&'a Verdict),
    /// Campaigns side by side.
    Comparison(&'a Comparison),
    /// A campaign beside a mast.
    Mast(&'a MastComparison),
}

impl PaperFigures {
    /// Makes the folder, before the work that the figures show.
    ///
    /// # Errors
    ///
    /// If it is something else, nothing can be written to it, or the program was built without such figures.
    pub fn prepare(&self) -> Result<(), WorkflowError> {
        if !cfg!(feature = "paper-figures") {
            return Err(WorkflowError::Usage(
                "this updraft was built without figures for papers: build it with them (cargo install updraft \
                 --features paper-figures)"
                    .to_owned(),
            ));
        }
        let folder = &self.folder;
        let refused = |why: &dyn std::fmt::Display| {
            let folder = folder.shown();
            WorkflowError::Usage(format!("figures for papers cannot be written to {folder}: {why}"))
        };
        if folder.exists() && !folder.is_dir() {
            return Err(refused(&"it is not a folder"));
        }
        std::fs::create_dir_all(folder).map_err(|error| refused(&error))?;
        tempfile::tempfile_in(folder).map_err(|error| refused(&error))?;
        Ok(())
    }

    /// Writes the figures of the results as SVG and PDF, and tells which cannot be read at a width. Other files of
    /// the folder are left as they are.
    ///
    /// # Errors
    ///
    /// If a file cannot be written, or the work is stopped.
    pub fn write(&self, host: &dyn Host, shown: Shown<'_>) -> Result<(), WorkflowError> {
        #[cfg(feature = "paper-figures")]
        return written::write(host, self, &shown);
        #[cfg(not(feature = "paper-figures"))]
        {
            let _ = (host, shown);
            self.prepare()
        }
    }
}
