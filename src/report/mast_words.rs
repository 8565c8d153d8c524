//! Sentences and cells of a comparison with a mast, for the page and the terminal.

use turbulence_statistics::Moment;

use crate::base::estimate::Estimate;
use crate::mast::result::{
    Average, MastComparison, MastDrone, MastFlight, MastPeriod, Matched, PeriodVariance,
};
use crate::products::iso;

use super::text::{NONE, clean, count, fixed, signed, signed_estimate};

/// Title of page and summary.
pub(super) fn title(of: &MastComparison) -> String {
    let campaign = if of.campaign.is_empty() { "Campaign" } else { &of.campaign };
    let mast = if of.mast.is_empty() { "the mast" } else { &of.mast };
    format!("{} against {}", clean(campaign), clean(mast))
}

/// Means that are compared.
pub(super) fn means(flight: &MastFlight) -> String {
    if flight.periods.is_empty() {
        "ten-second means".to_owned()
    } else {
        format!("means over {} s", fixed(flight.mean_s, 0))
    }
}

/// Number of means that are compared.
pub(super) fn means_in(flight: &MastFlight) -> String {
    count(flight.fleet.count, if flight.periods.is_empty() { "second" } else { "mean" })
}

/// A mean difference with the error of its sampling, if that is known.
fn bias(of: &Matched) -> String {
    of.bias_se_mps.map_or_else(
        || signed(of.bias_mps, 2),
        |se| signed_estimate(Estimate::new(of.bias_mps, se)),
    )
}

/// When a flight was, and what it is compared with.
pub(super) fn when(flight: &MastFlight) -> String {
    let [from, to] = flight.span_ms.map(iso);
    let (day, from) = from.split_once('T').unwrap_or(("", &from));
    let to = to.split_once('T').map_or(to.as_str(), |(_, to)| to);
    let short = |time: &str| time.split('.').next().unwrap_or_default().to_owned();
    let what = if flight.periods.is_empty() {
        format!("{} in {}", means(flight), count(flight.fleet.count, "common second"))
    } else {
        format!("{} common {}", flight.fleet.count, means(flight))
    };
    format!(
        "{day} {} to {} UTC, {}, {what}",
        short(from),
        short(to),
        count(flight.drones.len(), "drone"),
    )
}

/// What was found, a sentence each.
pub(super) fn sentences(flight: &MastFlight) -> Vec<String> {
    let fleet = &flight.fleet;
    let stated = match (fleet.stated_se_mps, fleet.bias_se_mps) {
        (Some(se), sampling) => {
            let beyond = fleet.bias_mps.abs() > 1.96 * se.hypot(sampling.unwrap_or(0.0));
            let within = if beyond { "more than" } else { "within" };
            let what = if sampling.is_some() { "the two together" } else { "that" };
            format!(
                ", and state a standard error of {} m/s for it: the bias is {within} {what} (95 %)",
                fixed(se, 2)
            )
        }
        _ => String::new(),
    };
    let sampled = match fleet.bias_se_mps {
        Some(_) if flight.periods.is_empty() => " (± is the sampling of these seconds)".to_owned(),
        Some(_) => format!(" (± is the sampling of these {})", means(flight)),
        None => format!(" (in {}, too few to tell their scatter)", means_in(flight)),
    };
    let mut all = vec![format!(
        "In the mean the drones say {} m/s more than the mast{sampled}{stated}.",
        bias(fleet)
    )];
    if flight.is_posterior {
        all.push(
            "The drones' values are those of the posterior, all drones together; variances, spectra and coherence are of each \
             drone's own values."
                .to_owned(),
        );
    }
    let follows = match (fleet.correlation, fleet.slope) {
        (Some(r), Some(slope)) => {
            format!(", correlation {}, slope {} (drones on mast)", signed(r, 2), fixed(slope, 2))
        }
        _ => String::new(),
    };
    all.push(format!(
        "Root mean square difference of the fleet's mean {} m/s, {} m/s without the bias{follows}.",
        fixed(fleet.rms_mps, 2),
        fixed(fleet.sd_mps, 2)
    ));
    if let (Some(drones), Some(mast)) = (&flight.drone_variance, &flight.mast_variance) {
        let as_they_are = flight.mast_variance_all.map_or_else(String::new, |all| {
            format!(", whose values as they are have {} (m/s)²", fixed(all, 3))
        });
        all.push(format!(
            "Variance of ten-second means: {} (m/s)² by the drones, {} (m/s)² by the mast{as_they_are}.",
            variance(drones),
            variance(mast),
        ));
    }
    if let Some(of) = &flight.period_variance {
        all.push(period_variance(of, flight));
    }
    if let Some([shift_s, correlation]) = flight.best_shift {
        let better = fleet.correlation.is_none_or(|now| correlation > now + 0.02);
        if better && shift_s != 0.0 {
            let which = if shift_s > 0.0 { "later" } else { "earlier" };
            all.push(format!(
                "The records agree best with the drones {} s {which} than the mast (correlation {}): air that is carried \
                 from one to the other, or clocks that differ{}.",
                fixed(shift_s.abs(), 0),
                signed(correlation, 2),
                if flight.periods.is_empty() { "" } else { ", or times of the mast that mark another end of its means" }
            ));
        }
    }
    if let Some([east, north]) = &flight.wind {
        all.push(format!(
            "Wind by the drones' leans less the mast's: {} m/s towards east and {} m/s towards north; root mean square {} \
             and {} m/s.",
            bias(east),
            bias(north),
            fixed(east.rms_mps, 2),
            fixed(north.rms_mps, 2)
        ));
    }
    all
}

/// Variances within the means of a slow mast.
fn period_variance(of: &PeriodVariance, flight: &MastFlight) -> String {
    let error = of.difference_se.map_or_else(String::new, |se| {
        format!(", difference {}", signed_estimate(Estimate::new(of.drones - of.mast, se)))
    });
    let part = if of.is_slow_part {
        "; the drones' is that of their ten-second means alone, which lack the faster eddies"
    } else {
        ""
    };
    format!(
        "Variance of w within {}, mean of {}: {} (m/s)² by the drones, {} (m/s)² by the mast{error}{part}.",
        means(flight),
        of.count,
        fixed(of.drones, 3),
        fixed(of.mast, 3)
    )
}

/// Heads of the table of a slow mast's means.
pub(super) const PERIOD_HEADS: [&str; 6] = [
    "middle, UTC",
    "mast, m/s",
    "drones, m/s",
    "nearest, m/s",
    "var(w) mast, (m/s)²",
    "var(w) drones, (m/s)²",
];

/// Rows of that table.
pub(super) fn periods(flight: &MastFlight) -> Vec<Vec<String>> {
    let known = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| NONE.to_owned(), |value| fixed(value, decimals))
    };
    let row = |of: &MastPeriod| {
        let middle = iso(of.middle_ms);
        let time = middle.split_once('T').map_or(middle.as_str(), |(_, time)| time);
        vec![
            time.split('.').next().unwrap_or_default().trim_end_matches('Z').to_owned(),
            signed(of.mast_mps, 2),
            signed(of.fleet_mps, 2),
            of.nearest_mps.map_or_else(|| NONE.to_owned(), |w| signed(w, 2)),
            known(of.mast_variance, 3),
            known(of.drone_variance.filter(|_| of.mast_variance.is_some()), 3),
        ]
    };
    flight.periods.iter().map(row).collect()
}

/// A variance with its 95 % interval.
pub(super) fn variance(of: &Moment) -> String {
    format!("{} (95 %: {} to {})", fixed(of.value, 3), fixed(of.low, 3), fixed(of.high, 3))
}

/// Heads of the table of averages.
pub(super) const AVERAGE_HEADS: [&str; 8] = [
    "average",
    "number",
    "bias, m/s",
    "rms, m/s",
    "correlation",
    "bias, nearest",
    "rms, nearest",
    "correlation, nearest",
];

/// Rows of the table of averages; the first is that of the means that are compared.
pub(super) fn averages(flight: &MastFlight) -> Vec<Vec<String>> {
    let nearest = flight.drones.first().map(|drone| drone.matched);
    let first =
        nearest.map(|nearest| Average { length_s: flight.mean_s, fleet: flight.fleet, nearest });
    let cells = |of: &Matched| [bias(of), fixed(of.rms_mps, 2), correlation(of)];
    first
        .iter()
        .chain(&flight.averages)
        .map(|row| {
            let head = [format!("{} s", fixed(row.length_s, 0)), row.fleet.count.to_string()];
            head.into_iter().chain(cells(&row.fleet)).chain(cells(&row.nearest)).collect()
        })
        .collect()
}

/// Heads of the table of drones.
pub(super) const DRONE_HEADS: [&str; 9] = [
    "drone",
    "distance, m",
    "above, m",
    "bias, m/s",
    "stated se, m/s",
    "rms, m/s",
    "correlation",
    "mast inside",
    "variance, (m/s)²",
];

/// Cells of a drone's row.
pub(super) fn drone(of: &MastDrone) -> Vec<String> {
    let known = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| NONE.to_owned(), |value| fixed(value, decimals))
    };
    vec![
        clean(&of.drone),
        known(of.distance_m, 0),
        known(of.above_m, 0),
        bias(&of.matched),
        known(of.matched.stated_se_mps, 2),
        fixed(of.matched.rms_mps, 2),
        correlation(&of.matched),
        format!("{} %", fixed(100.0 * of.inside_share, 0)),
        of.variance.as_ref().map_or_else(|| NONE.to_owned(), |of| fixed(of.value, 3)),
    ]
}

fn correlation(of: &Matched) -> String {
    of.correlation.map_or_else(|| NONE.to_owned(), |r| signed(r, 2))
}
