//! The figures of one width after another, drawn, finished and written.

use std::path::Path;
use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::{PaperFigures, Shown};
use crate::base::file::write_whole;
use crate::base::plain::Shown as _;
use crate::report::paper::{Drawn, PaperFigure, of_analysis, of_comparison, of_mast, of_verdict};
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::host::Host;

/// Names and characters that are listed.
const LISTED: usize = 8;

/// What became of the figures of one width.
#[derive(Default)]
struct Written {
    count: usize,
    unreadable: Vec<String>,
    too_high: Vec<String>,
    missing: Vec<char>,
}

/// Draws and writes what is shown at all widths.
pub(super) fn write(
    host: &dyn Host,
    wish: &PaperFigures,
    shown: &Shown<'_>,
) -> Result<(), WorkflowError> {
    for width_mm in &wish.widths_mm {
        let folder = wish.folder.join(format!("{width_mm}mm"));
        let drawn = match shown {
            Shown::Analysis(analysis, beside) => of_analysis(analysis, *beside, *width_mm),
            Shown::Verdict(verdict) => of_verdict(verdict, *width_mm),
            Shown::Comparison(comparison) => of_comparison(comparison, *width_mm),
            Shown::Mast(comparison) => of_mast(comparison, *width_mm),
        };
        let stopped = host.stop_flag();
        let finished = drawn
            .par_iter()
            .map(|drawn| {
                if stopped.load(Ordering::Relaxed) {
                    return Ok((String::new(), None));
                }
                Ok((drawn.name.clone(), one(drawn, &folder)?))
            })
            .collect::<Result<Vec<_>, WorkflowError>>()?;
        host.check_stop()?;
        tell(host, *width_mm, &together(finished), &folder);
    }
    Ok(())
}

/// What is told of a figure that was written.
struct Kept {
    missing: Vec<char>,
    is_too_high: bool,
}

fn one(drawn: &Drawn, folder: &Path) -> Result<Option<Kept>, WorkflowError> {
    let finished = drawn.finish().map_err(|error| WorkflowError::Failed(with_reasons(&error)))?;
    let Some(PaperFigure { svg, pdf, missing, is_too_high }) = finished else { return Ok(None) };
    write_whole(&folder.join(format!("{}.svg", drawn.name)), svg.as_bytes())?;
    write_whole(&folder.join(format!("{}.pdf", drawn.name)), &pdf)?;
    Ok(Some(Kept { missing, is_too_high }))
}

fn together(finished: Vec<(String, Option<Kept>)>) -> Written {
    let mut all = Written::default();
    for (name, kept) in finished {
        let Some(Kept { missing, is_too_high }) = kept else {
            all.unreadable.push(name);
            continue;
        };
        all.count += 1;
        all.missing.extend(missing);
        if is_too_high {
            all.too_high.push(name);
        }
    }
    all.missing.sort_unstable();
    all.missing.dedup();
    all
}

fn tell(host: &dyn Host, width_mm: f64, all: &Written, folder: &Path) {
    let figures = if all.count == 1 { "figure" } else { "figures" };
    host.say(&format!(
        "{} {figures} {width_mm} mm wide, as SVG and PDF -> {}",
        all.count,
        folder.shown()
    ));
    if !all.unreadable.is_empty() {
        host.say(&format!(
            "too wide or too high to be read at {width_mm} mm, and not written: {}",
            listed(&all.unreadable)
        ));
    }
    if !all.too_high.is_empty() {
        host.say(&format!("higher than a page at {width_mm} mm: {}", listed(&all.too_high)));
    }
    if !all.missing.is_empty() {
        let missing: Vec<String> = all.missing.iter().map(char::to_string).collect();
        host.warn(&format!(
            "the font of figures for papers lacks {}: \u{fffd} stands in their place",
            listed(&missing)
        ));
    }
}

fn listed(names: &[String]) -> String {
    let shown = names.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
