//! Figures for printed papers: SVG and PDF of the width of a column in millimetres, with their font inside.
//!
//! They are the report's figures, laid out for that width, so that their text has seven to nine points there. Other
//! programs open them: they have no script, no style sheet but the font's, and no links.

mod canonical;
mod font;
mod pdf;
mod plain;

use svg2pdf::usvg::Error as SvgError;
use thiserror::Error;

use super::format::{Format, PAGE_HEIGHT_MM};
use super::{Basemap, Beside, compare_page, gap_page, mast_page, page, turbulence_page};
use crate::analysis::result::Analysis;
use crate::compare::result::Comparison;
use crate::gap::Verdict;
use crate::mast::MastComparison;

/// A figure that was drawn for a column, before it has its font.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Name of its files, without ending: that of the same figure in the report.
    pub name: String,
    /// Its drawing; empty where it cannot be read at that width.
    svg: String,
    width_mm: f64,
}

/// A finished figure.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperFigure {
    /// SVG with the font inside.
    pub svg: String,
    /// One page with the same.
    pub pdf: Vec<u8>,
    /// Characters that its font has not, and for which its sign of a missing character stands; in order.
    pub missing: Vec<char>,
    /// Whether it is higher than a page.
    pub is_too_high: bool,
}

/// Error of finishing a figure; a bug of this program.
#[derive(Debug, Error)]
pub enum PaperError {
    /// The drawing is no SVG.
    #[error("failed to read the drawing of figure {name} (please report this as a bug)")]
    Svg {
        /// Name of the figure.
        name: String,
        /// Error of the reader of SVG.
        source: SvgError,
    },
    /// There is no PDF of it.
    #[error("failed to make a PDF of figure {name}: {reason} (please report this as a bug)")]
    Pdf {
        /// Name of the figure.
        name: String,
        /// Reason in words.
        reason: String,
    },
}

/// The figures of an analysis' report for a column of `width_mm`; a picture of the ground in WebP is not below them.
pub fn of_analysis(analysis: &Analysis, beside: Beside<'_>, width_mm: f64) -> Vec<Drawn> {
    // PDF knows no WebP.
    let is_known = |basemap: &&Basemap| !basemap.address().starts_with("data:image/webp");
    let beside = Beside { basemap: beside.basemap.filter(is_known), ..beside };
    let format = Format::column(width_mm);
    let mut figures = page::figures(analysis, beside, format);
    figures.extend(turbulence_page::figures_of(analysis, format));
    drawn(figures, width_mm)
}

/// The figures of a verdict's page for a column of `width_mm`.
pub fn of_verdict(verdict: &Verdict, width_mm: f64) -> Vec<Drawn> {
    drawn(gap_page::figures(verdict, Format::column(width_mm)), width_mm)
}

/// The figures of a comparison's page for a column of `width_mm`.
pub fn of_comparison(comparison: &Comparison, width_mm: f64) -> Vec<Drawn> {
    drawn(compare_page::figures(comparison, Format::column(width_mm)), width_mm)
}

/// The figures of a page beside a mast for a column of `width_mm`.
pub fn of_mast(comparison: &MastComparison, width_mm: f64) -> Vec<Drawn> {
    drawn(mast_page::figures(comparison, Format::column(width_mm)), width_mm)
}

fn drawn(figures: Vec<(String, String)>, width_mm: f64) -> Vec<Drawn> {
    figures.into_iter().map(|(name, svg)| Drawn { name, svg, width_mm }).collect()
}

impl Drawn {
    /// The figure with its font, as SVG and PDF; `None` where it cannot be read at its width: it is too wide, or, below
    /// each other, its parts are higher than a page.
    ///
    /// # Errors
    /// [`PaperError`], a bug of this program.
    pub fn finish(&self) -> Result<Option<PaperFigure>, PaperError> {
        if self.svg.is_empty() {
            return Ok(None);
        }
        let plain = plain::plain(&self.svg, font::has);
        let tree = pdf::tree(&self.name, &plain.svg)?;
        let height_mm = pdf::height_mm(&tree);
        let is_too_high = height_mm > PAGE_HEIGHT_MM;
        if is_too_high && Format::column(self.width_mm).is_narrow() {
            return Ok(None);
        }
        let pdf = pdf::pdf(&self.name, &tree)?;
        let svg = font::embedded(&plain.svg);
        Ok(Some(PaperFigure { svg, pdf, missing: plain.missing, is_too_high }))
    }
}
