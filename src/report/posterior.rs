//! Words of a posterior map: the same ones on the page and in a terminal.

use crate::analysis::result::{AirScales, PosteriorMap, PosteriorScale, UpdraftMap};
use crate::base::estimate::Estimate;

use super::text::{clean, count, estimate, fixed, share, signed, usable, value_of};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// Most slots that are named.
const MOST_SLOTS: usize = 12;

/// The fleet's mean with its error, where it is a number.
pub(super) fn fleet(map: &UpdraftMap) -> Option<Estimate> {
    let fleet = map.posterior.as_ref()?.fleet?;
    (usable(fleet.value) && usable(fleet.se)).then_some(fleet)
}

/// Whether the posterior tells the scales of the air, or why it has none: then no other scales are told as those of the
/// air.
pub(super) fn tells_scales(map: &UpdraftMap) -> bool {
    let told =
        |posterior: &PosteriorMap| posterior.scales.is_some() || posterior.no_scales.is_some();
    map.posterior.as_ref().is_some_and(told)
}

/// `95 %: −0.16 to +0.02 m/s`
pub(super) fn interval(of: Estimate) -> String {
    let decimals = of.decimals().unwrap_or(3);
    let at = |sds: f64| signed(of.value + sds * of.se, decimals);
    format!("95 %: {} to {} m/s", at(-NORMAL), at(NORMAL))
}

/// Why there is none of few values.
const TOO_FEW: &str = "No posterior map: it takes three drones that hover, and 24 values in all that share no second.";
/// Why there is none otherwise.
const NOTHING_FITS: &str = "No posterior map: no air that the model knows fits these values with what their calibration says of the zero.";
/// Drones that a posterior of a hover takes, and seconds of values in all, of which one in ten shares none with the next.
const FEWEST: (usize, usize) = (3, 240);

/// Why a map has no posterior.
fn no_posterior(map: &UpdraftMap) -> &'static str {
    let seconds = map.drones.iter().map(|drone| drone.updraft_mps.iter().flatten().count());
    let with_values: Vec<usize> = seconds.filter(|seconds| *seconds > 0).collect();
    let enough_drones = map.is_scan() || with_values.len() >= FEWEST.0;
    if enough_drones && with_values.iter().sum::<usize>() >= FEWEST.1 {
        NOTHING_FITS
    } else {
        TOO_FEW
    }
}

/// The posterior in a headline; `None` without one.
pub(super) fn headline(map: &UpdraftMap) -> Option<String> {
    let fleet = fleet(map)?;
    let filled =
        filled(map.posterior.as_ref()?).map_or_else(String::new, |words| format!(", {words}"));
    Some(format!(
        "posterior mean of the fleet {} m/s ({}){filled}",
        value_of(fleet),
        interval(fleet)
    ))
}

/// All that is to be said, sentence by sentence; empty for the paper's own estimate.
pub(super) fn sentences(map: &UpdraftMap) -> Vec<String> {
    let Some(posterior) = map.posterior.as_ref() else {
        let is_plain = map.common.is_none();
        return if is_plain { Vec::new() } else { vec![no_posterior(map).to_owned()] };
    };
    let mut sentences = Vec::new();
    if let Some(fleet) = fleet(map) {
        sentences.push(format!(
            "Posterior map, of all drones, seconds and the calibration together: mean of the fleet {} m/s ({}).",
            estimate(fleet),
            interval(fleet),
        ));
    }
    if let Some(words) = filled(posterior) {
        let slots: Vec<String> =
            posterior.filled.iter().take(MOST_SLOTS).map(|drone| drone.slot.to_string()).collect();
        let more = posterior.filled.len() - slots.len();
        let more = if more == 0 { String::new() } else { format!(" and {more} more") };
        let noun = if posterior.filled.len() == 1 { "slot" } else { "slots" };
        sentences.push(format!(
            "Without values of their own: {words} ({noun} {}{more}).",
            slots.join(", ")
        ));
    }
    match (&posterior.scales, &posterior.no_scales) {
        (Some(scales), _) => sentences.push(scale_words(scales)),
        (None, Some(why)) => sentences.push(format!("No scales of the air: {}.", clean(why))),
        (None, None) => {}
    }
    if usable(posterior.uniform_probability) {
        sentences.push(format!(
            "Probability of an updraft that is everywhere and always the same: {}.",
            percent(posterior.uniform_probability)
        ));
    }
    sentences.extend(truth(map, posterior));
    sentences
}

/// `3 lost drones filled from their neighbours`
fn filled(posterior: &PosteriorMap) -> Option<String> {
    let n = posterior.filled.len();
    let whose = if n == 1 { "its" } else { "their" };
    (n > 0).then(|| format!("{} filled from {whose} neighbours", count(n, "lost drone")))
}

/// Slow air is told where it has this share of the field's strength. Convention.
const SLOW_SHARE: f64 = 0.5;

fn scale_words(scales: &AirScales) -> String {
    let speed = scales.drift_mps[0].hypot(scales.drift_mps[1]);
    let drift = if usable(speed) && speed >= 0.05 {
        format!(", drifting at {} m/s", fixed(speed, 1))
    } else {
        String::new()
    };
    let slow = scales.slow_mps;
    let slow = if usable(slow) && slow >= SLOW_SHARE * scales.sd_mps && slow >= 0.05 {
        format!("; slow air besides, which stays, of {} m/s", fixed(slow, 2))
    } else {
        String::new()
    };
    format!(
        "Scales of the air by likelihood: length {}, time {}, of a field ({} correlation) of {} m/s{drift}{slow}; gusts of \
         each drone's own of {} m/s over {} s.",
        scale(scales.length_m, "m"),
        scale(scales.time_s, "s"),
        clean(&scales.form),
        fixed(scales.sd_mps, 2),
        fixed(scales.gust_mps, 2),
        fixed(scales.gust_s, usize::from(scales.gust_s < 10.0)),
    )
}

/// `22 m (95 %: 18 to 26 m)`: as many digits as the interval supports.
fn scale(of: PosteriorScale, unit: &str) -> String {
    let [low, high] = of.interval;
    let half = Estimate::new(of.value, (high - low) / (2.0 * NORMAL));
    let decimals = half.decimals().unwrap_or(1);
    format!(
        "{} {unit} (95 %: {} to {} {unit})",
        fixed(of.value, decimals),
        fixed(low, decimals),
        fixed(high, decimals)
    )
}

fn percent(share: f64) -> String {
    if share < 0.01 {
        "less than 1 %".to_owned()
    } else if share > 0.99 {
        "more than 99 %".to_owned()
    } else {
        format!("{} %", fixed(100.0 * share, 0))
    }
}

/// The posterior against the true air, and against the best that any linear estimate can do.
fn truth(map: &UpdraftMap, posterior: &PosteriorMap) -> Vec<String> {
    let Some(truth) = posterior.truth.filter(|truth| truth.values > 0 && usable(truth.rms_mps))
    else {
        return Vec::new();
    };
    let plain = map.truth.filter(|plain| plain.values > 0 && usable(plain.rms_mps));
    let plain = plain.map_or_else(String::new, |plain| {
        let closer = if plain.rms_mps < truth.rms_mps { ", which is closer here" } else { "" };
        format!(" (each drone alone: {} m/s{closer})", fixed(plain.rms_mps, 3))
    });
    let mut sentences = vec![format!(
        "Posterior against the true air: rms error {} m/s{plain}, mean {} m/s, {} m/s without that mean; {} % of {} and \
         {} % of {} lie inside their 95 % intervals.",
        fixed(truth.rms_mps, 3),
        signed(truth.bias_mps, 3),
        fixed(truth.rms_without_bias_mps, 3),
        share(truth.inside_share),
        count(truth.values, "true value"),
        share(truth.means_inside_share),
        count(truth.drones, "true mean"),
    )];
    let limit = truth.limit_rms_mps.filter(|limit| usable(*limit) && *limit > 0.0);
    if let Some((limit, own)) = limit.zip(truth.at_limit_rms_mps.filter(|own| usable(*own))) {
        sentences.push(format!(
            "At one second in ten: rms error {} m/s; the best linear estimate with the true covariances has {} m/s: \
             ratio {}.",
            fixed(own, 3),
            fixed(limit, 3),
            fixed(own / limit, 2),
        ));
        if let Some(se) = truth.limit_se_mps.filter(|se| usable(*se)) {
            sentences.push(format!(
                "That estimate's own standard error of the mean over all drones and seconds is {} m/s.",
                fixed(se, 3)
            ));
        }
    }
    sentences
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::result::FilledDrone;

    fn map() -> UpdraftMap {
        let check = |rms: f64| {
            serde_json::json!({
                "drones": 9, "values": 900, "rms_mps": rms, "bias_mps": 0.01,
                "rms_without_bias_mps": rms, "inside_share": 0.953, "means_inside_share": 1.0,
                "limit_rms_mps": 0.05, "at_limit_rms_mps": 0.052, "limit_se_mps": 0.047,
            })
        };
        serde_json::from_value(serde_json::json!({
            "law": "linear", "time_s": [], "drones": [], "truth": check(0.16),
            "posterior": {
                "fleet": { "value": -0.0709, "se": 0.0447 },
                "scales": {
                    "form": "Gaussian", "sd_mps": 0.237,
                    "length_m": { "value": 21.77, "interval": [18.13, 26.14] },
                    "time_s": { "value": 13.56, "interval": [10.3, 17.85] },
                    "drift_mps": [-0.007, -1.01], "gust_mps": 0.055, "gust_s": 27.7,
                },
                "zero_shift_mps": 0.04, "uniform_probability": 0.0087, "truth": check(0.054),
            }
        }))
        .unwrap()
    }

    #[test]
    fn the_words_have_as_many_digits_as_the_errors_support() {
        let words = sentences(&map());
        assert_eq!(
            words,
            [
                "Posterior map, of all drones, seconds and the calibration together: mean of the fleet −0.071 ± 0.045 \
                 m/s (95 %: −0.159 to +0.017 m/s).",
                "Scales of the air by likelihood: length 21.8 m (95 %: 18.1 to 26.1 m), time 13.6 s (95 %: 10.3 to \
                 17.9 s), of a field (Gaussian correlation) of 0.24 m/s, drifting at 1.0 m/s; gusts of each drone's \
                 own of 0.06 m/s over 28 s.",
                "Probability of an updraft that is everywhere and always the same: less than 1 %.",
                "Posterior against the true air: rms error 0.054 m/s (each drone alone: 0.160 m/s), mean +0.010 m/s, \
                 0.054 m/s without that mean; 95.3 % of 900 true values and 100.0 % of 9 true means lie inside their \
                 95 % intervals.",
                "At one second in ten: rms error 0.052 m/s; the best linear estimate with the true covariances has \
                 0.050 m/s: ratio 1.04.",
                "That estimate's own standard error of the mean over all drones and seconds is 0.047 m/s.",
            ]
        );
    }

    #[test]
    fn lost_drones_and_missing_scales_are_said() {
        let mut map = map();
        let posterior = map.posterior.as_mut().unwrap();
        posterior.scales = None;
        posterior.no_scales = Some("a thermal\u{1b}[31m passed".to_owned());
        posterior.truth = None;
        posterior.filled = (1..15)
            .map(|slot| FilledDrone {
                slot,
                position_m: [0.0; 2],
                posterior_mps: Vec::new(),
                posterior_sd_mps: Vec::new(),
            })
            .collect();
        let words = sentences(&map);
        assert_eq!(
            words[1],
            "Without values of their own: 14 lost drones filled from their neighbours (slots 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12 \
             and 2 more)."
        );
        assert_eq!(words[2], "No scales of the air: a thermal␛[31m passed.");
        assert_eq!(
            headline(&map).unwrap(),
            "posterior mean of the fleet −0.071 m/s (95 %: −0.159 to +0.017 m/s), 14 lost drones filled from their \
             neighbours"
        );
        map.posterior = None;
        assert!(sentences(&map).is_empty() && headline(&map).is_none());
    }

    #[test]
    fn a_posterior_that_is_farther_from_the_truth_says_so() {
        let mut map = map();
        map.truth.as_mut().unwrap().rms_mps = 0.05;
        let words = sentences(&map).join(" ");
        assert!(words.contains("(each drone alone: 0.050 m/s, which is closer here)"), "{words}");
    }
}
