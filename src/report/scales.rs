//! Scales of the air in words: the paper's error, the honest interval, and what the estimator reads.

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::statistics::result::{
    FieldStatistics, Interval, Reads, Scale, Treatment, TrueAir, Variant,
};
use crate::base::estimate::Estimate;

use super::text::{NONE, clean, count, estimate, fixed, sentence, usable};

/// A number with three significant digits.
fn rounded(value: f64) -> String {
    if !usable(value) {
        return fixed(value, 0);
    }
    let digits = if value == 0.0 { 0 } else { 2 - value.abs().log10().floor() as i32 };
    fixed(value, digits.clamp(0, 4) as usize)
}

/// An interval in words: `98 to 410`.
pub(super) fn interval(of: Interval) -> String {
    format!("{} to {}", rounded(of.low), rounded(of.high))
}

/// The value with the error of the curve fit, as the paper gives it: `145.4 ± 3.0`.
pub(super) fn paper_form(scale: &Scale) -> String {
    match scale.fit_se {
        Some(se) if usable(se) && se > 0.0 => estimate(Estimate::new(scale.value, se)),
        _ => rounded(scale.value),
    }
}

/// `reads 61 (28 to 130) where 145 is true`.
fn reads(of: Reads) -> String {
    format!(
        "{} ({}) where {} is true",
        rounded(of.median),
        interval(of.range_90),
        rounded(of.truth)
    )
}

/// `not determined (longer than 540 m)` for a scale whose number means nothing.
pub(super) fn not_determined(scale: &Scale, unit: &str) -> Option<String> {
    scale.undetermined?;
    Some(match scale.bound() {
        Some((words, bound)) => format!("not determined ({words} {} {unit})", rounded(bound)),
        None => "not determined".to_owned(),
    })
}

/// A row of the table of scales; `reads_known`: the air that `reads` speaks of has determined scales.
fn row(name: &str, unit: &str, scale: &Scale, truth: Option<f64>, reads_known: bool) -> Value {
    let told = not_determined(scale, unit);
    let known = told.is_none();
    let fit = scale.fit_se.filter(|se| known && usable(*se));
    context! {
        name,
        unit,
        value => told.unwrap_or_else(|| rounded(scale.value)),
        fit => fit.map_or(NONE.to_owned(), |se| format!("± {}", rounded(se))),
        interval => scale.interval_95.filter(|_| known).map_or(NONE.to_owned(), interval),
        reads => scale.reads.filter(|_| known && reads_known).map_or(NONE.to_owned(), reads),
        paper => scale.paper.map_or(NONE.to_owned(), estimate),
        truth => truth.map_or(NONE.to_owned(), rounded),
    }
}

/// What is known of the air that a flight was simulated in, in words.
pub(super) fn true_air_words(air: &TrueAir) -> String {
    let mut parts = Vec::new();
    if let Some(field) = &air.field {
        let lambda = if (field.lambda_y_m - field.lambda_m).abs() > 1e-9 * field.lambda_m {
            format!("λx {} m, λy {} m", rounded(field.lambda_m), rounded(field.lambda_y_m))
        } else {
            format!("λ {} m", rounded(field.lambda_m))
        };
        let (tau, sd) = (rounded(field.tau_s), rounded(field.sd_mps));
        let carried = if field.wind_mps > 0.0 {
            format!(
                " (in the moving air; carried past the drones by {} m/s of wind it is shorter)",
                rounded(field.wind_mps)
            )
        } else {
            String::new()
        };
        parts.push(format!("a field with {lambda}, τ {tau} s{carried} and σ {sd} m/s"));
    }
    for gusts in &air.gusts {
        parts.push(format!(
            "gusts ({} spectrum) of {} m/s with a length of {} m",
            clean(&gusts.spectrum),
            rounded(gusts.sd_mps),
            rounded(gusts.length_m)
        ));
    }
    parts.extend(air.beside.iter().map(|motion| clean(motion)));
    let shorter = if air.field.is_some() && !air.gusts.is_empty() {
        ". The gusts have a length of their own: estimates that know one scale only come out shorter \
         than the field's"
    } else {
        ""
    };
    format!("the true air of the simulation: {}{shorter}", parts.join(", and "))
}

fn variant(of: &Variant) -> Value {
    let or_none = |value: Option<f64>| value.map_or(NONE.to_owned(), rounded);
    let end = |value: Option<f64>, at_end: bool| {
        if at_end { "not determined".to_owned() } else { or_none(value) }
    };
    context! {
        treatment => of.treatment.words(),
        plain => of.treatment == Treatment::AsMeasured,
        lambda => or_none(of.lambda_m),
        lambda_x => or_none(of.lambda_x_m),
        lambda_y => or_none(of.lambda_y_m),
        t0 => or_none(of.t0_s),
        likelihood_lambda => end(of.likelihood_lambda_m, of.likelihood_lambda_at_end),
        likelihood_tau => end(of.likelihood_tau_s, of.likelihood_tau_at_end),
    }
}

/// What the page says about the statistics of a flight, apart from the figures. With `of_posterior`, the posterior tells
/// the scales of the air, and those of the values of each drone alone are left to the numbers.
pub(super) fn section(of: &FieldStatistics, of_posterior: bool) -> Value {
    let record = &of.record;
    context! {
        of_posterior,
        rows => if of_posterior { Vec::new() } else { rows(of) },
        words => words(of, of_posterior),
        variants => of
            .variants
            .iter()
            .filter(|_| !of_posterior)
            .map(variant)
            .collect::<Vec<_>>(),
        absent => of.absent.iter().map(|one| sentence(one)).collect::<Vec<_>>(),
        simulated => of.simulated.as_ref().map(|simulated| sentence(&simulated.words)),
        truth_known => of.true_air.as_ref().is_some_and(|air| air.field.is_some()),
        record => (record.drones > 0).then(|| format!(
            "{} over {} s, {} m to {} m apart; values are running means of {} s; their standard \
             deviation over time is {} m/s, that of the fleet's mean {} m/s; {} % are missing",
            count(record.drones, "drone"),
            fixed(record.length_s, 0),
            rounded(record.spacing_m),
            rounded(record.extent_m),
            fixed(record.running_mean_s, 0),
            rounded(record.sd_mps),
            rounded(record.common_sd_mps),
            fixed(100.0 * record.missing_share, 1),
        )),
    }
}

/// The table of scales.
fn rows(of: &FieldStatistics) -> Vec<Value> {
    let mut rows = Vec::new();
    let field = of.true_air.as_ref().and_then(|air| air.field);
    let lambda = field.map(|field| field.lambda_m);
    let lambda_y = field.map(|field| field.lambda_y_m);
    // Over all pairs there is one true length only in air that is alike in both directions.
    let any = lambda.filter(|_| lambda == lambda_y);
    let model = of.likelihood.as_ref();
    let length_known = model.is_none_or(|model| model.lambda_m.undetermined.is_none());
    let time_known = model.is_none_or(|model| model.tau_s.undetermined.is_none());
    if let Some(space) = &of.space {
        let directions = [
            ("λ, all pairs", Some(&space.all), any),
            ("λx, pairs along x", space.along_x.as_ref(), lambda),
            ("λy, pairs along y", space.along_y.as_ref(), lambda_y),
        ];
        for (name, one, truth) in directions {
            let scale = one.and_then(|one| one.lambda_m.as_ref());
            rows.extend(scale.map(|s| row(name, "m", s, truth, length_known)));
        }
        rows.extend(
            space
                .all
                .weighted_lambda_m
                .as_ref()
                .map(|s| row("λ, medians weighted", "m", s, any, length_known)),
        );
        rows.extend(
            space
                .all
                .with_nugget
                .as_ref()
                .map(|fit| row("λ, C₀ exp(−r/λ)", "m", &fit.lambda_m, any, length_known)),
        );
    }
    if let Some(time) = &of.time {
        let line = time.line.as_ref();
        // No property of the air: there is no true one.
        rows.extend(
            line.map(|line| row("t₀, zero of the line", "s", &line.t0_s, None, time_known)),
        );
    }
    if let Some(model) = &of.likelihood {
        rows.push(row("λ, maximum likelihood", "m", &model.lambda_m, any, length_known));
        let tau = field.map(|field| field.tau_s);
        rows.push(row("τ, maximum likelihood", "s", &model.tau_s, tau, time_known));
        let sd = field.map(|field| field.sd_mps);
        rows.push(row("σ of the air, maximum likelihood", "m/s", &model.sd_mps, sd, true));
    }
    rows
}

/// The sentences below the table; with `of_posterior` without those about its scales.
fn words(of: &FieldStatistics, of_posterior: bool) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut say = |words_of: &str| {
        if !words_of.trim().is_empty() {
            words.push(sentence(words_of));
        }
    };
    if let Some(air) = &of.true_air {
        say(&true_air_words(air));
    }
    if let Some(space) = of.space.as_ref().filter(|_| !of_posterior) {
        say(&space.words);
        if let Some(anisotropy) = &space.anisotropy {
            say(&anisotropy.words);
        }
    }
    if let Some(time) = of.time.as_ref().filter(|_| !of_posterior) {
        say(&time.words);
        if let Some(half) = &time.half_record {
            say(&half.words);
        }
    }
    let model = of.likelihood.iter().filter(|_| !of_posterior);
    for warning in model.flat_map(|model| &model.warnings) {
        say(warning);
    }
    if let Some(wind) = &of.wind {
        say(&wind.words);
    }
    if let Some(baseline) = &of.baseline {
        say(&baseline.words);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::statistics::result::{TrueField, TrueGusts, Undetermined};

    #[test]
    fn a_scale_tells_the_papers_error_and_the_honest_one() {
        let scale = Scale {
            value: 98.37,
            fit_se: Some(2.04),
            interval_95: Some(Interval { low: 51.2, high: 1234.6 }),
            ..Scale::default()
        };
        assert_eq!(paper_form(&scale), "98.4 ± 2.0");
        assert_eq!(interval(scale.interval_95.unwrap()), "51.2 to 1235");
        assert_eq!(paper_form(&Scale { value: 98.37, ..Scale::default() }), "98.4");
    }

    #[test]
    fn a_scale_that_is_not_determined_has_no_digits_that_mean_nothing() {
        let scale = |undetermined| Scale {
            value: 17_370.2,
            interval_95: Some(Interval { low: 17_368.4, high: 16_789_748.0 }),
            undetermined,
            ..Scale::default()
        };
        let words = |undetermined| not_determined(&scale(undetermined), "s");
        assert_eq!(words(None), None);
        assert_eq!(
            words(Some(Undetermined::Longer)).unwrap(),
            "not determined (longer than 17368 s)"
        );
        assert_eq!(words(Some(Undetermined::Unknown)).unwrap(), "not determined");
    }

    #[test]
    fn gusts_are_said_to_make_estimates_shorter_only_beside_a_field() {
        let field =
            TrueField { sd_mps: 0.5, lambda_m: 145.0, lambda_y_m: 145.0, ..TrueField::default() };
        let gusts = TrueGusts {
            spectrum: "von Karman".to_owned(),
            sd_mps: 0.2,
            length_m: 30.0,
            time_s: None,
            drift_mps: None,
        };
        let both = TrueAir { field: Some(field), gusts: vec![gusts.clone()], ..TrueAir::default() };
        assert!(true_air_words(&both).contains("come out shorter"));
        let alone = TrueAir { gusts: vec![gusts], ..TrueAir::default() };
        assert!(!true_air_words(&alone).contains("come out shorter"));
    }
}
