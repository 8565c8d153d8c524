//! The HTML page of a sensitivity study.

use minijinja::context;
use minijinja::value::Value;

use crate::study::sensitivity::{Influence, OutcomeResult, SensitivityResult};

use super::figures::sensitivity::figures;
use super::fill::{common, fill};
use super::format::Format;
use super::page::label;
use super::sensitivity_terminal::{
    campaigns, capital, decimals, explained, in_order, numbers, spread,
};
use super::text::{NONE, clean, fixed};
use super::{Points, Provenance, Report, ReportError};

const PAGE: &str = include_str!("../../templates/report/sensitivity.html");
/// Factors that the first sentence names.
const MOST_NAMED: usize = 3;
/// Least index, or coefficient, of a factor that it names.
const LEAST_NAMED: f64 = 0.1;

/// Renders the page and the figures of a sensitivity study.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_sensitivity(
    study: &SensitivityResult,
    points: &Points,
    provenance: &Provenance,
) -> Result<Report, ReportError> {
    let is_sobol = study.design == "sobol";
    let figures = figures(study, points, Format::PAGE);
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
        .lost_reasons
        .iter()
        .map(|lost| context! { campaigns => lost.campaigns, reason => clean(&lost.reason) })
        .collect();
    let factors: Vec<Value> = study
        .factors
        .iter()
        .map(|factor| {
            context! {
                name => clean(&factor.name),
                unit => clean(&factor.unit),
                drives => clean(&factor.drives),
                levels => clean(&factor.levels),
            }
        })
        .collect();
    let naming: Vec<Value> = study
        .naming
        .iter()
        .flatten()
        .map(|(called, campaigns)| context! { called => clean(called), campaigns })
        .collect();
    let values = context! {
        title => clean(&study.title),
        verdict => verdict(study, is_sobol),
        tiles => study.outcomes.iter().map(tile).collect::<Vec<_>>(),
        outcomes => study.outcomes.iter().map(|of| outcome(of, is_sobol)).collect::<Vec<_>>(),
        factors,
        naming,
        is_sobol,
        figures => shown,
        lost,
        lost_count => study.lost,
        campaign => clean(&study.campaign),
        vehicle => study.vehicle.as_deref().map_or_else(|| "the template's vehicle".to_owned(), clean),
        design => study.design.clone(),
        seed => study.seed.to_string(),
        schema => clean(&study.schema),
        ..common(provenance),
    };
    let html = fill("sensitivity.html", PAGE, values)?;
    let files = figures.into_iter().map(|figure| (figure.name, figure.svg)).collect();
    Ok(Report { html, figures: files, data: Vec::new() })
}

fn verdict(study: &SensitivityResult, is_sobol: bool) -> Vec<String> {
    let mut sentences = vec![format!("{}.", campaigns(study))];
    let Some(first) = study.outcomes.first() else { return sentences };
    let is_clear = |found: &&Influence| {
        found.main().is_some_and(|main| {
            main.value.abs() >= LEAST_NAMED && (main.low > 0.0 || main.high < 0.0)
        })
    };
    let named: Vec<String> = in_order(first)
        .into_iter()
        .filter(is_clear)
        .take(MOST_NAMED)
        .map(|found| {
            let value = found.main().map_or(0.0, |main| main.value);
            format!("{} ({})", clean(&found.factor), fixed(value, 2))
        })
        .collect();
    let what = if is_sobol { "total index" } else { "coefficient of ranks" };
    sentences.push(if named.is_empty() {
        format!("No factor is known to decide the {}: more campaigns would tell.", first.title)
    } else {
        format!("What decides the {}, by the {what}: {}.", first.title, named.join(", "))
    });
    sentences
}

fn tile(outcome: &OutcomeResult) -> Value {
    let number = |value: Option<f64>| {
        value.map_or_else(|| NONE.to_owned(), |v| fixed(v, decimals(outcome.sd.unwrap_or(0.0))))
    };
    let unit = if outcome.unit.is_empty() { String::new() } else { format!(" ({})", outcome.unit) };
    context! {
        label => format!("{}, mean{unit}", outcome.title),
        value => number(outcome.mean),
        note => format!("standard deviation {} over {}", number(outcome.sd), outcome.n),
    }
}

fn outcome(outcome: &OutcomeResult, is_sobol: bool) -> Value {
    let rows: Vec<Value> = in_order(outcome)
        .into_iter()
        .map(|found| {
            let (one, two) = numbers(found, is_sobol);
            context! { factor => clean(&found.factor), one, two, n => found.n }
        })
        .collect();
    context! {
        name => outcome.name.clone(),
        title => capital(&outcome.title),
        spread => spread(outcome),
        explained => explained(outcome, is_sobol).unwrap_or_default(),
        rows,
    }
}
