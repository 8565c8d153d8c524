//! The HTML page of a comparison of measurement and simulation: what goes where; the words and the
//! look are in `templates/report/`, the tables in `gap_parts`.

use minijinja::context;
use minijinja::value::Value;

use crate::gap::Verdict;

use super::figures::gap::{drones, ladder, map};
use super::fill::{OPEN_LIMIT, common, fill};
use super::format::Format;
use super::gap_parts::{
    detectables, gap_rows, noise_rows, regime_rows, sensor, step_section, tiles,
};
use super::gap_words::{left_over, map_words, micro};
use super::page::Gallery;
use super::text::{clean, count, fixed, reduced, sentence};
use super::{Provenance, Report, ReportError};

const PAGE: &str = include_str!("../../templates/report/gap.html");

/// Renders the page and the figures of a verdict.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_gap(verdict: &Verdict, provenance: &Provenance) -> Result<Report, ReportError> {
    let mut figures = Gallery::default();
    let values = values(verdict, provenance, &mut figures);
    let html = fill("gap.html", PAGE, values)?;
    Ok(Report { html, figures: figures.files, data: Vec::new() })
}

/// The figures alone, drawn for a format.
#[cfg(any(feature = "paper-figures", test))]
pub(super) fn figures(verdict: &Verdict, format: Format) -> Vec<(String, String)> {
    let mut figures = Gallery::of(format);
    values(verdict, &Provenance::default(), &mut figures);
    figures.files
}

fn values(verdict: &Verdict, provenance: &Provenance, figures: &mut Gallery) -> Value {
    let map = map::figure(verdict, figures.format).map(|figure| figures.show(figure));
    let ladder = ladder::figure(verdict, figures.format).map(|figure| figures.show(figure));
    let steps: Vec<Value> = verdict
        .steps
        .iter()
        .enumerate()
        .map(|(index, step)| step_section(step, index + 1, figures))
        .collect();
    let scatter = drones::figure(verdict, figures.format).map(|figure| figures.show(figure));
    let groups: Vec<String> = verdict
        .data
        .groups
        .iter()
        .enumerate()
        .map(|(index, (name, drones))| {
            let bins = verdict.data.bins.get(index).copied().unwrap_or(0);
            format!("{} ({}, {})", clean(name), count(*drones, "drone"), count(bins, "steady bin"))
        })
        .collect();
    let mut slots = verdict.data.held_out.clone();
    slots.sort_unstable();
    let held_out: Vec<String> = slots.iter().map(u16::to_string).collect();
    let rest = &verdict.rest;
    context! {
        title => format!("Measurement and model: {}", clean(&verdict.vehicle)),
        vehicle => clean(&verdict.vehicle),
        summary => micro(&verdict.summary),
        tiles => tiles(verdict),
        cautions => sentences(&verdict.cautions),
        left_out_open => verdict.data.left_out.len() <= OPEN_LIMIT,
        left_out => verdict.data.left_out.iter().map(|reason| clean(&reason.to_string())).collect::<Vec<_>>(),
        map,
        regimes => regime_rows(verdict),
        ladder,
        steps,
        rest => context! {
            candidate => clean(&rest.candidate),
            words => left_over(rest),
            chi2 => reduced(rest.reduced_chi2),
        },
        gap => gap_rows(verdict),
        air_map => verdict.map.as_ref().map(map_words),
        sensor => sensor(verdict),
        detectables => detectables(verdict),
        scatter,
        correlation => verdict.drones.correlation.map(|value| fixed(value, 2)),
        drone_words => sentences(&verdict.drones.words),
        noise => noise_rows(verdict),
        groups,
        logs => verdict.data.logs,
        drones => verdict.data.drones,
        held_out => held_out.join(", "),
        schema => clean(&verdict.schema),
        made_by => clean(&verdict.made_by),
        seed => provenance.seed.map(|seed| seed.to_string()),
        ..common(provenance),
    }
}

/// What is said, as sentences of a page.
fn sentences(said: &[impl ToString]) -> Vec<String> {
    said.iter().map(|text| micro(&sentence(&text.to_string()))).collect()
}
