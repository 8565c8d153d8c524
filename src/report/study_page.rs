//! The HTML page of a study.

use minijinja::context;
use minijinja::value::Value;

use crate::study::paper;
use crate::study::result::StudyResult;

use super::figures::study::{self as figure_study, rho};
use super::fill::{common, fill};
use super::format::Format;
use super::page::label;
use super::study_terminal::{ConditionWords, range_rows, windows};
use super::text::{NONE, clean, count, estimate, symbol, unit};
use super::{Provenance, Report, ReportError};

const PAGE: &str = include_str!("../../templates/report/study.html");

/// Renders the page and the figures of a study.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_study(study: &StudyResult, provenance: &Provenance) -> Result<Report, ReportError> {
    let figures = figure_study::figures(study, Format::PAGE);
    let shown: Vec<Value> = figures
        .iter()
        .map(|figure| {
            context! {
                label => label(&figure.name),
                name => figure.name.clone(),
                title => figure.title.clone(),
                caption => figure.caption.clone(),
                svg => Value::from_safe_string(figure.svg.clone()),
            }
        })
        .collect();
    let lost: Vec<Value> = study
        .lost
        .iter()
        .map(|lost| context! { name => clean(&lost.name), reason => clean(&lost.reason) })
        .collect();
    let values = context! {
        title => clean(&study.title),
        verdict => verdict(study),
        tiles => tiles(study),
        figures => shown,
        table => law_table(study),
        conditions => condition_table(study),
        ranges => ranges(study),
        windows => windows(&study.windows),
        lost,
        template => clean(&study.template),
        vehicle => clean(&study.vehicle),
        ground => study.ground_amsl_m.to_string(),
        seed => study.seed.to_string(),
        schema => clean(&study.schema),
        ..common(provenance),
    };
    let html = fill("study.html", PAGE, values)?;
    let files = figures.into_iter().map(|figure| (figure.name, figure.svg)).collect();
    Ok(Report { html, figures: files, data: Vec::new() })
}

fn verdict(study: &StudyResult) -> Vec<String> {
    let mut sentences = vec![format!(
        "{} of one drone each: the speed ladder in {} and {}.",
        count(study.flights.len(), "simulated flight"),
        count(study.paper_way.conditions.len(), "wind condition"),
        count(study.updrafts_mps.len(), "updraft"),
    )];
    if let Some([low, high]) = study.paper_way.rho {
        sentences.push(format!(
            "In every wind the fitted updraft W* follows the true one: Pearson's ρ is {} to {} \
             (paper: {} to {}).",
            rho(low),
            rho(high),
            paper::RHO[0],
            paper::RHO[1],
        ));
    }
    sentences
}

fn tiles(study: &StudyResult) -> Vec<Value> {
    let mut tiles: Vec<Value> = study
        .paper_way
        .table
        .iter()
        .map(|row| {
            context! {
                label => format!("{} in still air ({})", symbol(row.parameter), unit(&row.unit)),
                value => super::text::value_of(row.windless),
                note => format!("paper {}", estimate(row.paper)),
            }
        })
        .collect();
    if let Some([low, _]) = study.paper_way.rho {
        tiles.push(context! {
            label => "lowest ρ of a condition",
            value => rho(low),
            note => format!("paper {}", paper::RHO[0]),
        });
    }
    tiles.push(context! {
        label => "windows left out",
        value => (study.windows.moving - study.windows.used).to_string(),
        note => format!("of {}", study.windows.moving),
    });
    tiles
}

/// Table I beside the paper's values.
pub(super) fn law_table(study: &StudyResult) -> Vec<Value> {
    study
        .paper_way
        .table
        .iter()
        .map(|row| {
            let own = study.own_way.table.iter().find(|own| own.parameter == row.parameter);
            let or_none = |value: Option<_>| value.map_or_else(|| NONE.to_owned(), estimate);
            context! {
                parameter => symbol(row.parameter),
                unit => unit(&row.unit),
                paper => estimate(row.paper),
                windless => estimate(row.windless),
                pooled => or_none(row.pooled),
                own => or_none(own.map(|own| own.windless)),
                own_pooled => or_none(own.and_then(|own| own.pooled)),
            }
        })
        .collect()
}

fn condition_table(study: &StudyResult) -> Vec<Value> {
    study
        .paper_way
        .conditions
        .iter()
        .enumerate()
        .map(|(index, condition)| {
            let words = ConditionWords::of(condition);
            let own = study.own_way.conditions.get(index).map(ConditionWords::of);
            context! {
                label => words.label,
                n => words.n,
                rho => words.rho,
                p_value => words.p_value,
                slope => words.slope,
                intercept => words.intercept,
                at_zero => words.at_zero,
                unused => words.unused,
                own_rho => own.map_or_else(|| NONE.to_owned(), |own| own.rho),
            }
        })
        .collect()
}

fn ranges(study: &StudyResult) -> Vec<Value> {
    let row = |[name, n, rho, p_value]: [String; 4]| context! { name, n, rho, p_value };
    range_rows(study).map(row).into()
}
