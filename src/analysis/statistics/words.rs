//! The sentences of the statistics.

use super::likelihood::Fitted;
use super::result::{DistanceCorrelation, FieldRecord, FieldStatistics, Scale};

/// A half record whose t0 is below this share of the whole's shows that the length makes t0
/// (docs/physics.md, 5.5): a trend gives 0.5, air 1. Chosen between.
const HALVES: f64 = 0.65;
/// Above this share the length does not matter. Chosen.
const STAYS: f64 = 0.85;
/// p-values below this are called significant. Convention.
const SIGNIFICANT: f64 = 0.05;

/// `1 drone`, `4 drones`
pub(super) fn drones(n: usize) -> String {
    if n == 1 { "1 drone".to_owned() } else { format!("{n} drones") }
}

/// The verb of so many.
pub(super) fn are(n: usize) -> &'static str {
    if n == 1 { "is" } else { "are" }
}

/// What the simulated flights are.
pub(super) fn simulated(flights: usize, model: &Fitted, record: &FieldRecord) -> String {
    format!(
        "{flights} simulated flights of the same {} drones and {:.0} s, with the same gaps and running \
         mean, in a Gaussian field with the scales of maximum likelihood: s.d. {:.2} m/s, length {} m, \
         time {} s, independent noise {:.3} m/s",
        record.drones,
        record.length_s,
        model.sd_mps,
        end(model.lambda_m, model.length_at_end),
        end(model.tau_s, model.time_at_end),
        model.noise_mps
    )
}

/// A scale, or that it is only the end of the range that was searched.
fn end(value: f64, at_end: bool) -> String {
    let text = digits(value);
    if at_end { format!("{text} (the end of the searched range)") } else { text }
}

/// Fills in all sentences that follow from the numbers.
pub(super) fn fill(statistics: &mut FieldStatistics) {
    let record = statistics.record.clone();
    // What is said of air with scales that are not determined is said of no air.
    let model = statistics.likelihood.as_ref();
    let length_known = model.is_none_or(|model| model.lambda_m.undetermined.is_none());
    let time_known = model.is_none_or(|model| model.tau_s.undetermined.is_none());
    let determined = |one: &Option<DistanceCorrelation>| {
        let scale = one.as_ref().and_then(|one| one.lambda_m.as_ref());
        scale.is_some_and(|scale| scale.undetermined.is_none())
    };
    if let Some(space) = &mut statistics.space {
        let both = determined(&space.along_x) && determined(&space.along_y);
        space.words = space.all.lambda_m.as_ref().filter(|_| length_known).map_or_else(
            String::new,
            |scale| {
                bias(
                    scale,
                    "m",
                    &format!(
                        "a true length of {{}} m reads as {{}} m with this grid of {} m \
                and this record of {} s",
                        digits(record.extent_m),
                        digits(record.length_s)
                    ),
                )
            },
        );
        if let Some(anisotropy) = &mut space.anisotropy {
            let times = format!(
                "the length along y is {:.2} times that along x (the paper: 2.08)",
                anisotropy.ratio
            );
            anisotropy.words = match anisotropy.p_value {
                _ if !both => {
                    "the lengths along x and y are not both determined, and not compared".to_owned()
                }
                Some(p) if p < SIGNIFICANT => format!(
                    "{times}; only {} of flights in isotropic air differ as much: significant",
                    percent(p)
                ),
                Some(p) => format!(
                    "{times}; {} of flights in isotropic air differ as much: not significant",
                    percent(p)
                ),
                None => times,
            };
        }
    }
    if let Some(time) = &mut statistics.time {
        let tau = statistics.likelihood.as_ref().map(|model| model.tau_s.value);
        if let Some((line, tau)) = time.line.as_ref().zip(tau).filter(|_| time_known) {
            time.words = line.t0_s.reads.map_or_else(String::new, |reads| format!(
                "air that forgets in {} s (1/e) gives a t0 of {} s in the median of records of {} s, \
                 {} to {} s in 90 of 100",
                digits(tau), digits(reads.median), digits(record.length_s),
                digits(reads.range_90.low), digits(reads.range_90.high)
            ));
        }
        if let Some(half) = &mut time.half_record {
            let what = if half.ratio < HALVES {
                "t0 shrinks with the record: it is made by the record's length, and is no time scale of \
                 the air"
            } else if half.ratio > STAYS {
                "t0 does not shrink with the record: no sign of an effect of its length"
            } else {
                "t0 shrinks with the record, less than in proportion: its length is part of it"
            };
            let expected = half.simulated_ratio.map_or_else(String::new, |ratio| format!(
                " (in simulated flights the halves have {:.2} of it in the median, {:.2} to {:.2} in 90 \
                 of 100)",
                ratio.median, ratio.range_90.low, ratio.range_90.high
            ));
            half.words = format!(
                "halves of {} s have a t0 of {:.2} times that of the whole: {what}{expected}",
                digits(half.length_s),
                half.ratio
            );
        }
    }
}

fn bias(scale: &Scale, unit: &str, template: &str) -> String {
    let Some(reads) = scale.reads else { return String::new() };
    let mut values = [digits(reads.truth), digits(reads.median)].into_iter();
    let mut text = String::new();
    for (index, part) in template.split("{}").enumerate() {
        if index > 0 {
            text.push_str(&values.next().unwrap_or_default());
        }
        text.push_str(part);
    }
    format!(
        "{text} (median; {} to {} {unit} in 90 of 100 flights)",
        digits(reads.range_90.low),
        digits(reads.range_90.high)
    )
}

/// A scale to three digits.
pub(super) fn digits(value: f64) -> String {
    let decimals = if value.abs() >= 100.0 {
        0
    } else if value.abs() >= 10.0 {
        1
    } else {
        2
    };
    format!("{value:.decimals$}")
}

fn percent(share: f64) -> String {
    if share < 0.01 { "less than 1 %".to_owned() } else { format!("{:.0} %", 100.0 * share) }
}
