//! Evaluation of a study: from the windows of all flights to Table I, the fitted updrafts and the
//! correlations.

use std::collections::BTreeMap;

use super::cell::{Cell, Condition};
use super::error::StudyError;
use super::fly::{CellRecord, MADE_BY};
use super::paper;
use super::regression::{Regression, regression};
use super::result::{
    ConditionResult, Evaluation, LostFlight, STUDY_RESULT_SCHEMA, StudyFlight, StudyResult,
    StudyRow, StudyWindow, WindowCount,
};
use super::template::StudyPlan;
use super::work::Flown;
use crate::analysis::calibrate::{FitOptions, Hold, Location, Weights, calibrate};
use crate::analysis::law::Symbol;
use crate::analysis::result::{Fit, Rejection, WindowStats};
use crate::base::estimate::Estimate;
use crate::flight::Indicator;

/// A cell with its record, if it was flown.
type Entry<'a> = (Cell, Option<&'a CellRecord>);

/// Fits every flight, with A and u0 held at the values of the flight without wind and updraft.
///
/// # Errors
/// [`StudyError::NoReference`] if that flight is lost or gives no law.
pub fn evaluate(study: &StudyPlan, seed: u64, flown: &Flown) -> Result<StudyResult, StudyError> {
    let cells = study.cells();
    let record = |index: usize| flown.records.get(index).and_then(Option::as_ref);
    let entries: Vec<Entry<'_>> =
        cells.iter().enumerate().map(|(index, cell)| (*cell, record(index))).collect();
    // Its tables are beside the paper's.
    let own_way = FitOptions { wide_w_counts: true, ..FitOptions::default() };
    let paper_way =
        FitOptions { location: Location::Median, weights: Weights::WindowSd, ..own_way };
    let (paper_evaluation, paper_updrafts) = evaluation(study, &entries, flown, paper_way)?;
    let (own_evaluation, own_updrafts) = evaluation(study, &entries, flown, own_way)?;
    let flights = entries
        .iter()
        .zip(paper_updrafts.iter().zip(&own_updrafts))
        .filter_map(|((cell, record), (paper, own))| {
            let record = (*record)?;
            Some(StudyFlight {
                name: cell.name(),
                condition: cell.condition,
                updraft_mps: cell.updraft_mps,
                paper_way_mps: *paper,
                own_way_mps: *own,
                saturated_share: record.saturated_share,
                windows: moving(record).map(study_window).collect(),
                warnings: record.warnings.clone(),
            })
        })
        .collect();
    let lost = flown.lost.iter().filter_map(|lost| {
        Some(LostFlight { name: cells.get(lost.cell)?.name(), reason: lost.reason.clone() })
    });
    Ok(StudyResult {
        schema: STUDY_RESULT_SCHEMA.to_owned(),
        made_by: MADE_BY.to_owned(),
        title: study.title.clone(),
        template: study.template.clone(),
        vehicle: study.vehicle.name.clone(),
        ground_amsl_m: study.plan.site.ground_amsl_m,
        seed,
        updrafts_mps: study.updrafts_mps.clone(),
        windows: count(entries.iter().filter_map(|(_, record)| *record)),
        paper_way: paper_evaluation,
        own_way: own_evaluation,
        flights,
        lost: lost.collect(),
    })
}

fn moving(record: &CellRecord) -> impl Iterator<Item = &WindowStats> {
    record.windows.iter().filter(|window| window.kind.is_leg())
}

fn study_window(window: &WindowStats) -> StudyWindow {
    StudyWindow {
        label: window.label.clone(),
        commanded_mps: window.commanded_mps,
        velocity_mps: window.velocity_mps,
        pulse_phi_us: window.effort_phi,
        rejected: window.rejected.clone(),
    }
}

fn count<'a>(records: impl Iterator<Item = &'a CellRecord>) -> WindowCount {
    let mut all = WindowCount::default();
    for window in records.flat_map(moving) {
        all.moving += 1;
        if window.rejected.is_empty() {
            all.used += 1;
        } else if window.rejected.contains(&Rejection::Saturated) {
            all.saturated += 1;
        } else {
            all.otherwise += 1;
        }
    }
    all
}

/// One way to fit: laws, correlations, and W* of each entry.
fn evaluation(
    study: &StudyPlan,
    entries: &[Entry<'_>],
    flown: &Flown,
    options: FitOptions,
) -> Result<(Evaluation, Vec<Option<Estimate>>), StudyError> {
    let (free, hold) = reference(entries, flown, &options)?;
    let held = FitOptions { hold: Some(hold), ..options };
    let updrafts: Vec<Option<Estimate>> = entries
        .iter()
        .map(|(_, record)| {
            let laws = calibrate(&(*record)?.windows, &held).ok()?;
            // A W at the edge of the searched range is none.
            let fit = laws.signed_quadratic_held.filter(|fit| fit.w_beyond_mps.is_none())?;
            value(&fit, Symbol::W)
        })
        .collect();
    let conditions: Vec<ConditionResult> = study
        .conditions
        .iter()
        .map(|&condition| of_condition(condition, entries, &updrafts))
        .collect();
    let pooled = pooled(entries, &options);
    let rows = [(Symbol::A, paper::A), (Symbol::U0, paper::U0_US), (Symbol::W, paper::W_MPS)];
    let table = rows
        .into_iter()
        .filter_map(|(parameter, paper)| {
            Some(StudyRow {
                parameter,
                unit: parameter.unit(Indicator::Pulse),
                windless: value(&free, parameter)?,
                pooled: pooled.as_ref().and_then(|fit| value(fit, parameter)),
                paper,
            })
        })
        .collect();
    let range = |of: fn(&Regression) -> f64| {
        let values = conditions.iter().filter_map(|c| c.regression.as_ref()).map(of);
        values.fold(None, |range: Option<[f64; 2]>, value| {
            let [low, high] = range.unwrap_or([value, value]);
            Some([low.min(value), high.max(value)])
        })
    };
    let (rho, p_value) = (range(|r| r.rho), range(|r| r.p_value));
    Ok((Evaluation { table, conditions, rho, p_value }, updrafts))
}

/// The free fit of the flight without wind and updraft.
fn reference(
    entries: &[Entry<'_>],
    flown: &Flown,
    options: &FitOptions,
) -> Result<(Fit, Hold), StudyError> {
    let found = entries.iter().enumerate().find(|(_, (cell, _))| cell.is_reference());
    let name = found.map_or_else(String::new, |(_, (cell, _))| cell.name());
    let fail = |reason: String| StudyError::NoReference { cell: name.clone(), reason };
    let (index, (_, record)) = found.ok_or_else(|| fail("it is not in the study".to_owned()))?;
    let record = record.ok_or_else(|| {
        let lost = flown.lost.iter().find(|lost| lost.cell == index);
        fail(lost.map_or_else(|| "it was not flown".to_owned(), |lost| lost.reason.clone()))
    })?;
    let laws = calibrate(&record.windows, options).map_err(|error| fail(error.to_string()))?;
    let hold = Hold::from_laws(&laws);
    laws.signed_quadratic
        .zip(hold)
        .ok_or_else(|| fail("the signed-quadratic law does not fit".to_owned()))
}

fn value(fit: &Fit, symbol: Symbol) -> Option<Estimate> {
    fit.parameter(symbol).map(|found| found.estimate)
}

fn of_condition(
    condition: Condition,
    entries: &[Entry<'_>],
    updrafts: &[Option<Estimate>],
) -> ConditionResult {
    let of_it =
        || entries.iter().zip(updrafts).filter(move |((cell, _), _)| cell.condition == condition);
    let points: Vec<(f64, f64)> = of_it()
        .filter_map(|((cell, _), updraft)| Some((cell.updraft_mps, (*updraft)?.value)))
        .collect();
    ConditionResult {
        condition,
        regression: regression(&points),
        at_zero_mps: of_it()
            .find(|((cell, _), _)| cell.updraft_mps == 0.0)
            .and_then(|(_, updraft)| *updraft),
        windows: count(of_it().filter_map(|((_, record), _)| *record)),
    }
}

/// The free fit to all flights without updraft. The paper flew every wind speed in six directions,
/// still air too; here still air is flown once, so that each wind speed gets the same weight.
fn pooled(entries: &[Entry<'_>], options: &FitOptions) -> Option<Fit> {
    // Wind speeds as keys: millionths.
    let key = |cell: &Cell| (cell.condition.wind_mps * 1e6).round() as i64;
    let mut by_wind: BTreeMap<i64, Vec<&CellRecord>> = BTreeMap::new();
    for (cell, record) in entries {
        if cell.updraft_mps == 0.0
            && let Some(record) = record
        {
            by_wind.entry(key(cell)).or_default().push(record);
        }
    }
    let windows: Vec<WindowStats> = by_wind
        .values()
        .flat_map(|records| {
            let widening = (records.len() as f64).sqrt();
            records.iter().flat_map(|record| moving(record)).map(move |w| widened(w, widening))
        })
        .collect();
    calibrate(&windows, options).ok()?.signed_quadratic
}

fn widened(window: &WindowStats, factor: f64) -> WindowStats {
    let mut window = window.clone();
    for stats in [&mut window.effort_phi, &mut window.velocity_mps] {
        stats.sd *= factor;
        stats.se *= factor;
    }
    window
}
