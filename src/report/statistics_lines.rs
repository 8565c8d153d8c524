//! The statistics of a hover in a few lines, beside the paper's values.

use crate::analysis::RUNNING_S;
use crate::analysis::result::FlightAnalysis;
use crate::analysis::statistics::result::{FieldStatistics, Scale};

use super::posterior;
use super::scales::{not_determined, true_air_words};
use super::text::{clean, p_value};

/// Where the scales of values of each drone alone are, when the posterior tells those of the air.
const ELSEWHERE: &str = "Correlations of each drone's values alone, over distance and over time, are in the report's figure, \
                         and curves fitted to them in analysis.json.";

/// Length, time scale, and the two directions; or why there is nothing of the kind. Beside the scales of a posterior,
/// only where they are.
pub(super) fn statistics_lines(flight: &FlightAnalysis) -> Vec<String> {
    let Some(statistics) = &flight.statistics else { return Vec::new() };
    let mut lines: Vec<String> = [length(statistics), time(statistics), directions(statistics)]
        .into_iter()
        .flatten()
        .collect();
    let has_scales = !lines.is_empty();
    // Two sets of scales with intervals would contradict each other: they are of different things.
    if has_scales && flight.map.as_ref().is_some_and(posterior::tells_scales) {
        lines = vec![ELSEWHERE.to_owned()];
    }
    if !has_scales {
        lines.extend(statistics.absent.first().map(|reason| clean(reason)));
    }
    lines.extend(statistics.baseline.as_ref().map(|baseline| clean(&baseline.words)));
    lines.extend(statistics.true_air.as_ref().filter(|_| has_scales).map(true_air_words));
    lines
}

fn length(statistics: &FieldStatistics) -> Option<String> {
    let space = statistics.space.as_ref()?;
    let scale = space.all.lambda_m.as_ref()?;
    let model = statistics.likelihood.as_ref();
    let likelihood = model.map_or_else(String::new, |model| {
        format!("; of maximum likelihood: {}", value(&model.lambda_m, "m"))
    });
    Some(format!("correlation length λ {}{likelihood}", with_paper(scale, "m")))
}

fn time(statistics: &FieldStatistics) -> Option<String> {
    let scale = &statistics.time.as_ref()?.line.as_ref()?.t0_s;
    let model = statistics.likelihood.as_ref();
    let likelihood = model.map_or_else(String::new, |model| {
        format!("; correlation time of maximum likelihood: {}", value(&model.tau_s, "s"))
    });
    // Running means of noise cross zero where they no longer overlap.
    let of_means = if scale.undetermined.is_none() && scale.value <= RUNNING_S {
        format!(
            "; running means of {RUNNING_S:.0} s have such a crossing of themselves, in noise too"
        )
    } else {
        String::new()
    };
    Some(format!("zero crossing t₀ {}{of_means}{likelihood}", with_paper(scale, "s")))
}

fn directions(statistics: &FieldStatistics) -> Option<String> {
    let space = statistics.space.as_ref()?;
    let along_x = space.along_x.as_ref()?.lambda_m.as_ref()?;
    let along_y = space.along_y.as_ref()?.lambda_m.as_ref()?;
    let determined = [along_x, along_y].iter().all(|scale| scale.undetermined.is_none());
    let differ = space
        .anisotropy
        .as_ref()
        .and_then(|found| found.p_value)
        .filter(|_| determined)
        .map_or_else(String::new, |p| {
            let significant = if p < 0.05 { "significant" } else { "not significant" };
            format!("; the difference is {significant} ({})", p_value(p))
        });
    Some(format!(
        "λ along x {}, along y {}{differ}",
        with_paper(along_x, "m"),
        with_paper(along_y, "m")
    ))
}

/// `152 m (95 %: 66 to 340 m; paper 145.4 ± 3.0)`.
fn with_paper(scale: &Scale, unit: &str) -> String {
    let own = value(scale, unit);
    let Some(paper) = scale.paper else { return own };
    match own.strip_suffix(')') {
        Some(open) => format!("{open}; paper {paper})"),
        None => format!("{own} (paper {paper})"),
    }
}

fn value(scale: &Scale, unit: &str) -> String {
    if let Some(words) = not_determined(scale, unit) {
        return words;
    }
    let digits = |value: f64| {
        let decimals = usize::from(value.abs() < 100.0);
        format!("{value:.decimals$}")
    };
    let own = format!("{} {unit}", digits(scale.value));
    match scale.interval_95 {
        Some(interval) => {
            format!("{own} (95 %: {} to {} {unit})", digits(interval.low), digits(interval.high))
        }
        None => own,
    }
}
