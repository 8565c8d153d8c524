//! Scales of the air in words: the paper's error, the honest interval, and what the estimator reads.

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::statistics::result::{
    FieldStatistics, Interval, Reads, Scale, Treatment, Variant,
};
use crate::base::estimate::Estimate;

use super::text::{NONE, count, estimate, fixed, sentence, usable};

/// Three significant digits.
fn rounded(value: f64) -> String {
    if !usable(value) {
        return fixed(value, 0);
    }
    let digits = if value == 0.0 { 0 } else { 2 - value.abs().log10().floor() as i32 };
    fixed(value, digits.clamp(0, 4) as usize)
}

/// `98 to 410`.
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

/// A row of the table of scales.
fn row(name: &str, unit: &str, scale: &Scale) -> Value {
    context! {
        name,
        unit,
        value => rounded(scale.value),
        fit => scale.fit_se.filter(|se| usable(*se)).map_or(NONE.to_owned(), |se| format!("± {}", rounded(se))),
        interval => scale.interval_95.map_or(NONE.to_owned(), interval),
        reads => scale.reads.map_or(NONE.to_owned(), reads),
        paper => scale.paper.map_or(NONE.to_owned(), estimate),
    }
}

fn variant(of: &Variant) -> Value {
    let or_none = |value: Option<f64>| value.map_or(NONE.to_owned(), rounded);
    context! {
        treatment => of.treatment.words(),
        plain => of.treatment == Treatment::AsMeasured,
        lambda => or_none(of.lambda_m),
        lambda_x => or_none(of.lambda_x_m),
        lambda_y => or_none(of.lambda_y_m),
        t0 => or_none(of.t0_s),
        likelihood_lambda => or_none(of.likelihood_lambda_m),
        likelihood_tau => or_none(of.likelihood_tau_s),
    }
}

/// What the page says about the statistics of a flight, apart from the figures.
pub(super) fn section(of: &FieldStatistics) -> Value {
    let mut rows = Vec::new();
    if let Some(space) = &of.space {
        let directions = [
            ("λ, all pairs", Some(&space.all)),
            ("λx, pairs along x", space.along_x.as_ref()),
            ("λy, pairs along y", space.along_y.as_ref()),
        ];
        for (name, one) in directions {
            rows.extend(one.and_then(|one| one.lambda_m.as_ref()).map(|s| row(name, "m", s)));
        }
        rows.extend(
            space.all.weighted_lambda_m.as_ref().map(|s| row("λ, medians weighted", "m", s)),
        );
        rows.extend(
            space.all.with_nugget.as_ref().map(|fit| row("λ, C₀ exp(−r/λ)", "m", &fit.lambda_m)),
        );
    }
    if let Some(time) = &of.time {
        rows.extend(time.line.as_ref().map(|line| row("t₀, zero of the line", "s", &line.t0_s)));
    }
    if let Some(model) = &of.likelihood {
        rows.push(row("λ, maximum likelihood", "m", &model.lambda_m));
        rows.push(row("τ, maximum likelihood", "s", &model.tau_s));
        rows.push(row("σ of the air, maximum likelihood", "m/s", &model.sd_mps));
    }
    let mut words: Vec<String> = Vec::new();
    let mut say = |words_of: &str| {
        if !words_of.trim().is_empty() {
            words.push(sentence(words_of));
        }
    };
    if let Some(space) = &of.space {
        say(&space.words);
        if let Some(anisotropy) = &space.anisotropy {
            say(&anisotropy.words);
        }
    }
    if let Some(time) = &of.time {
        say(&time.words);
        if let Some(half) = &time.half_record {
            say(&half.words);
        }
    }
    for warning in of.likelihood.iter().flat_map(|model| &model.warnings) {
        say(warning);
    }
    if let Some(wind) = &of.wind {
        say(&wind.words);
    }
    let record = &of.record;
    context! {
        rows,
        words,
        variants => of.variants.iter().map(variant).collect::<Vec<_>>(),
        absent => of.absent.iter().map(|one| sentence(one)).collect::<Vec<_>>(),
        simulated => of.simulated.as_ref().map(|simulated| sentence(&simulated.words)),
        record => format!(
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
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
