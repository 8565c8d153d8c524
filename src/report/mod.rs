//! Figures, tables and the HTML report.
//!
//! [`render`] turns an [`Analysis`] into one self-contained page (no network, no external fonts or
//! scripts) and its figures as single SVG files; [`write()`] puts them in a folder;
//! [`terminal_summary`] says the same in a terminal. All are pure functions of their input: equal
//! input gives equal bytes.
//!
//! Figures are drawn by the `kuva` crate; only the labelled map of the grid is our own SVG. Text from
//! logs and plans (names, warnings) is treated as hostile: it is escaped for HTML and SVG and its
//! control characters are replaced.

mod axis;
mod basemap;
mod chart;
mod cite;
mod colour;
mod compare;
mod compare_page;
mod compare_sides;
mod compare_terminal;
mod compare_words;
mod delta;
mod doubts;
mod drone_table;
mod errors;
mod explorer;
mod figures;
mod fill;
mod film;
mod fleet_air;
mod format;
mod frames;
mod gap_page;
mod gap_parts;
mod gap_terminal;
mod gap_words;
mod glance;
mod headline;
mod law;
mod legend;
mod links;
mod mast_page;
mod mast_terminal;
mod mast_words;
pub mod next_terminal;
mod notes;
mod offset_field;
mod opening;
mod page;
mod page_air;
mod page_flight;
#[cfg(feature = "paper-figures")]
pub mod paper;
mod posterior;
mod posterior_grid;
mod print_panel;
mod raster;
mod scales;
mod sensitivity_page;
#[cfg(feature = "parquet")]
pub mod sensitivity_parquet;
mod sensitivity_points;
mod sensitivity_terminal;
mod shapes;
mod sheet;
mod statistics_lines;
mod study_page;
mod study_terminal;
mod surface;
mod svg;
mod table;
mod terminal;
mod text;
mod tracks;
mod turbulence_page;
mod typographic;
mod vendor;

use std::collections::BTreeSet;
use std::path::Path;

use thiserror::Error;

use crate::analysis::result::Analysis;
use crate::base::file::{FileError, write_whole};
use crate::study::result::StudyResult;

pub use basemap::{Basemap, BasemapError, Corners, MOST_BASEMAP_BYTES};
pub use compare_page::render_comparison;
pub use compare_sides::{ComparedFiles, where_and_when};
pub use compare_terminal::comparison_summary;
pub use gap_page::render_gap;
pub use gap_terminal::gap_summary;
pub use links::PageLink;
pub use mast_page::render_mast;
pub use mast_terminal::mast_summary;
pub use page::Drawn;
pub use sensitivity_page::render_sensitivity;
pub use sensitivity_points::Points;
pub use sensitivity_terminal::sensitivity_summary;
pub use study_page::render_study;
pub use study_terminal::study_summary;
pub use terminal::terminal_summary;
pub use text::NO_EDGE;
pub use turbulence_page::{TURBULENCE_PAGE, render_turbulence};

/// Name of the page in the report's folder.
pub const PAGE_FILE: &str = "index.html";
/// Folder of the figures in the report's folder.
pub const FIGURES_FOLDER: &str = "figures";
/// Folder of data in the report's folder, for fleets whose data do not fit into the page.
pub const DATA_FOLDER: &str = "data";

/// Origin of a report, printed in it: program, command, seed, settings, input files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// Name and version of the program.
    pub program: String,
    /// Command line that made the report, as a user would type it.
    pub command: String,
    /// Seed of the simulation, if there was one.
    pub seed: Option<u64>,
    /// Date and time at which the report was made, as text; empty if the caller gives none, as the
    /// library has no clock.
    pub made_at: String,
    /// Settings of the analysis, (name, value) for people.
    pub settings: Vec<(String, String)>,
    /// Files that the analysis read.
    pub inputs: Vec<InputFile>,
    /// SHA-256 of the numbers' file, `analysis.json`, hexadecimal; `None`: not known.
    pub analysis_sha256: Option<String>,
    /// Pages and files that belong to the report.
    pub links: Vec<PageLink>,
}

/// One input file of an analysis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputFile {
    /// Path, relative to the campaign folder where possible.
    pub path: String,
    /// SHA-256 of the file's content, hexadecimal.
    pub sha256: String,
}

/// A finished report, not yet written.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The HTML page, with all figures inside.
    pub html: String,
    /// The figures: (name without `.svg`, content as SVG).
    pub figures: Vec<(String, String)>,
    /// Files of data beside the page, which it loads when a drone of a large fleet is picked: (name without `.js`,
    /// content).
    pub data: Vec<(String, String)>,
}

/// Error of making or writing a report.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The page's template failed; a bug of this program.
    #[error("failed to fill in the report's page (please report this as a bug)")]
    Page(#[from] minijinja::Error),
    /// A file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// A figure with its words.
struct Figure {
    /// Name of its file, and prefix of ids in it: letters, digits, hyphens.
    name: String,
    /// What it shows, for people who do not see it.
    title: String,
    /// Caption: what the figure shows, in full sentences.
    caption: String,
    svg: String,
}

impl Figure {
    /// A figure that cannot be read at the width that was asked for: it has no drawing.
    fn too_wide(name: String, title: String) -> Self {
        Self { name, title, caption: String::new(), svg: String::new() }
    }
}

/// Renders the page and the figures of an analysis.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render(analysis: &Analysis, provenance: &Provenance) -> Result<Report, ReportError> {
    page::render(analysis, Beside::default(), provenance)
}

/// Parts of a report beside the analysis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beside<'a> {
    /// A finished simulation study, for the paper's Fig. 2 and Table I.
    pub study: Option<&'a StudyResult>,
    /// A picture of the ground, below the maps.
    pub basemap: Option<&'a Basemap>,
}

/// Draws the sections of the report, with what there is beside the analysis.
pub fn draw(analysis: &Analysis, beside: Beside<'_>) -> Drawn {
    page::draw(analysis, beside, format::Format::default())
}

/// Renders the report with the paper's Fig. 2 and Table I from a finished simulation study.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_with_study(
    analysis: &Analysis,
    study: &StudyResult,
    provenance: &Provenance,
) -> Result<Report, ReportError> {
    page::render(analysis, Beside { study: Some(study), basemap: None }, provenance)
}

/// Writes `index.html`, `figures/*.svg` and `data/*.js` to `folder`; the page comes last, so that a folder with
/// a page is complete.
///
/// # Errors
///
/// If the folder or a file cannot be written.
pub fn write(report: &Report, folder: &Path) -> Result<(), ReportError> {
    write_named(report, folder, PAGE_FILE)
}

/// Removes the drawings of an earlier analysis from a report's folder: those that are none of `kept`, by their names. Files that
/// this program did not draw stay.
pub fn remove_other_figures(folder: &Path, kept: &BTreeSet<String>) {
    let entries = std::fs::read_dir(folder.join(FIGURES_FOLDER)).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let is_svg = path.extension().is_some_and(|extension| extension == "svg");
        let name = path.file_stem().and_then(|name| name.to_str());
        let is_other = is_svg && name.is_some_and(|name| !kept.contains(name));
        if is_other && sheet::is_drawing(&path) {
            // One that stays is linked by no page.
            let _ = std::fs::remove_file(&path);
        }
    }
}

/// [`write()`] of a page of another name beside the report.
///
/// # Errors
///
/// If the folder or a file cannot be written.
pub fn write_named(report: &Report, folder: &Path, page: &str) -> Result<(), ReportError> {
    let figures = folder.join(FIGURES_FOLDER);
    for (name, svg) in &report.figures {
        write_whole(&figures.join(format!("{name}.svg")), svg.as_bytes())?;
    }
    for (name, script) in &report.data {
        write_whole(&folder.join(DATA_FOLDER).join(format!("{name}.js")), script.as_bytes())?;
    }
    write_whole(&folder.join(page), report.html.as_bytes())?;
    Ok(())
}
