//! Options for figures of printed papers, shared by the commands that make a report.

use std::path::PathBuf;

use clap::Args;

use super::exit::CommandError;
use crate::workflow::paper::{PaperFigures, WIDTH_RANGE_MM};

/// Where the figures go, and how wide they are.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Report")]
pub(super) struct PaperArgs {
    /// Folder for the report's figures as papers print them: SVG and PDF with their font inside, in a folder
    /// for each width (docs/report.md)
    #[arg(long, value_name = "FOLDER")]
    paper_figures: Option<PathBuf>,
    /// Widths of these figures, mm: those of one and of two columns
    #[arg(long, value_name = "MM,...", requires = "paper_figures", value_delimiter = ',',
        default_values = ["83", "171"], value_parser = width)]
    paper_widths: Vec<f64>,
}

fn width(text: &str) -> Result<f64, String> {
    let [least, most] = WIDTH_RANGE_MM;
    match text.trim().parse::<f64>() {
        Ok(mm) if (least..=most).contains(&mm) => Ok(mm),
        _ => Err(format!("a width from {least} to {most} mm")),
    }
}

impl PaperArgs {
    /// The wish, if there is one; its folder is made.
    pub(super) fn wish(&self) -> Result<Option<PaperFigures>, CommandError> {
        let Some(folder) = self.paper_figures.clone() else { return Ok(None) };
        let wish = PaperFigures { folder, widths_mm: self.paper_widths.clone() };
        wish.prepare()?;
        Ok(Some(wish))
    }
}
