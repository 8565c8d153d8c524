//! Evaluation of a sensitivity study: from the outcomes of all campaigns to how much each factor decides.

use std::collections::BTreeMap;

use super::design::{Design, Seeds};
use super::factor::{Factor, Levels};
use super::item::Row;
use super::outcome::OutcomeColumn;
use super::ranks;
use super::result::{
    FactorResult, Influence, LostReason, OutcomeResult, SENSITIVITY_RESULT_SCHEMA,
    SensitivityResult,
};
use super::saltelli;
use super::template::SensitivityPlan;
use super::work::Gathered;
use crate::numeric::{Moments, Sorted};
use crate::study::fly::MADE_BY;

/// Name of the factor that is the seed.
pub(super) const CHANCE: &str = "chance";
/// Shares of the quantiles that are stated.
const SHARES: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];
/// Most reasons for losses that are told.
const MOST_REASONS: usize = 20;

/// Says how much of each outcome's variance comes from which factor, as far as the study is flown.
pub fn evaluate(study: &SensitivityPlan, seed: u64, gathered: &Gathered) -> SensitivityResult {
    let rows = &gathered.rows;
    let results = || rows.iter().flatten().map(|row| &row.result);
    let lost = results().filter(|result| result.is_err()).count();
    let scores = match study.design {
        Design::Sobol { .. } => Vec::new(),
        _ => scores(study, seed, rows),
    };
    let outcomes = study.outcomes.iter().enumerate();
    let naming = study.naming.is_some().then(|| {
        let mut counts = BTreeMap::new();
        for naming in results().flatten().filter_map(|outcome| outcome.naming.as_ref()) {
            *counts.entry(naming.called.to_string()).or_default() += 1;
        }
        counts
    });
    let mut factors: Vec<FactorResult> = study.factors.iter().map(factor_result).collect();
    if has_chance(study) {
        factors.push(FactorResult {
            name: CHANCE.to_owned(),
            unit: String::new(),
            drives: "seed of air, noise and losses".to_owned(),
            levels: "any".to_owned(),
            words: Vec::new(),
            log: false,
        });
    }
    SensitivityResult {
        schema: SENSITIVITY_RESULT_SCHEMA.to_owned(),
        made_by: MADE_BY.to_owned(),
        title: study.title.clone(),
        campaign: study.setup.campaign.clone(),
        vehicle: study.setup.vehicle.clone(),
        seed,
        design: study.design.name().to_owned(),
        campaigns: rows.len(),
        finished: results().count() - lost,
        lost,
        open: rows.iter().filter(|row| row.is_none()).count(),
        outcomes: outcomes
            .map(|(number, column)| {
                outcome_result(study, seed, number as u64, column, rows, &scores)
            })
            .collect(),
        factors,
        lost_reasons: lost_reasons(rows),
        naming,
    }
}

fn has_chance(study: &SensitivityPlan) -> bool {
    matches!(study.design, Design::Sobol { .. }) && study.seeds == Seeds::Each
}

/// Levels as numbers, for one factor after the other, of the campaigns with an outcome.
fn scores(study: &SensitivityPlan, seed: u64, rows: &[Option<Row>]) -> Vec<Vec<f64>> {
    let drawn = study.drawn(seed);
    let mut scores = vec![Vec::new(); study.factors.len()];
    for (index, row) in rows.iter().enumerate() {
        if !matches!(row, Some(Row { result: Ok(_), .. })) {
            continue;
        }
        let item = drawn.item(index);
        let levels = study.factors.iter().zip(&item.levels);
        for (list, (factor, level)) in scores.iter_mut().zip(levels) {
            list.push(factor.levels.score(level));
        }
    }
    scores
}

fn outcome_result(
    study: &SensitivityPlan,
    seed: u64,
    number: u64,
    column: &OutcomeColumn,
    rows: &[Option<Row>],
    scores: &[Vec<f64>],
) -> OutcomeResult {
    let value = |row: &Option<Row>| {
        let outcome = row.as_ref()?.result.as_ref().ok()?;
        (column.get)(outcome).filter(|value| value.is_finite())
    };
    let of_all: Vec<Option<f64>> = rows.iter().map(value).collect();
    let known: Vec<f64> = of_all.iter().copied().flatten().collect();
    let (influences, explained) = match study.design {
        Design::Sobol { samples } => {
            let columns = Design::columns(study.factors.len(), study.seeds);
            let outcome = |index: usize| of_all.get(index).copied().flatten();
            let (found, explained) = saltelli::indices(samples, columns, seed, number, &outcome);
            let chance = [CHANCE];
            let names = study.factors.iter().map(|factor| factor.name.as_str()).chain(chance);
            let influences = names.zip(found).map(|(name, found)| Influence {
                factor: name.to_owned(),
                n: found.n,
                first: found.first,
                total: found.total,
                ..Influence::default()
            });
            (influences.collect(), explained)
        }
        Design::Grid { .. } | Design::LatinHypercube { .. } => {
            // Of campaigns with an outcome, those that have this number.
            let has: Vec<bool> = rows
                .iter()
                .zip(&of_all)
                .filter(|(row, _)| matches!(row, Some(Row { result: Ok(_), .. })))
                .map(|(_, value)| value.is_some())
                .collect();
            let kept: Vec<Vec<f64>> = scores
                .iter()
                .map(|scores| {
                    scores.iter().zip(&has).filter(|(_, has)| **has).map(|(s, _)| *s).collect()
                })
                .collect();
            let (found, explained) = ranks::coefficients(&kept, &known, seed, number);
            let influences = study.factors.iter().zip(found).map(|(factor, found)| Influence {
                factor: factor.name.clone(),
                n: known.len(),
                regression: found.regression,
                partial: found.partial,
                ..Influence::default()
            });
            (influences.collect(), explained)
        }
    };
    let moments = Moments::of(known.iter().copied());
    let mut sorted = known;
    let sorted = Sorted::of(&mut sorted);
    OutcomeResult {
        name: column.name.to_owned(),
        unit: column.unit.to_owned(),
        title: column.title.to_owned(),
        n: sorted.values().len(),
        mean: moments.map(|moments| moments.mean),
        sd: moments.and_then(|moments| moments.deviation()),
        quantiles: SHARES.iter().filter_map(|share| sorted.quantile(*share)).collect(),
        influences,
        explained,
    }
}

fn factor_result(factor: &Factor) -> FactorResult {
    let (levels, words, log) = match &factor.levels {
        Levels::List(levels) => {
            let names: Vec<String> = levels.iter().map(ToString::to_string).collect();
            let words = if factor.levels.are_numbers() { Vec::new() } else { names.clone() };
            (names.join(", "), words, false)
        }
        Levels::Range(range) => {
            let whole = if range.whole { ", whole numbers" } else { "" };
            let log = if range.log { ", logarithmic" } else { "" };
            (format!("{} to {}{whole}{log}", range.from, range.to), Vec::new(), range.log)
        }
    };
    FactorResult {
        name: factor.name.clone(),
        unit: factor.unit.clone(),
        drives: factor.target.words(),
        levels,
        words,
        log,
    }
}

fn lost_reasons(rows: &[Option<Row>]) -> Vec<LostReason> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in rows.iter().flatten().filter_map(|row| row.result.as_ref().err()) {
        *counts.entry(reason).or_default() += 1;
    }
    let mut reasons: Vec<LostReason> = counts
        .into_iter()
        .map(|(reason, campaigns)| LostReason { reason: reason.to_owned(), campaigns })
        .collect();
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.campaigns));
    reasons.truncate(MOST_REASONS);
    reasons
}
