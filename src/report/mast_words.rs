//! Sentences and cells of a comparison with a mast, for the page and the terminal.

use turbulence_statistics::Moment;

use crate::base::estimate::Estimate;
use crate::mast::result::{Average, MastComparison, MastDrone, MastFlight, Matched};
use crate::products::iso;

use super::text::{NONE, clean, count, fixed, signed, signed_estimate};

/// Title of page and summary.
pub(super) fn title(of: &MastComparison) -> String {
    let campaign = if of.campaign.is_empty() { "Campaign" } else { &of.campaign };
    let mast = if of.mast.is_empty() { "the mast" } else { &of.mast };
    format!("{} against {}", clean(campaign), clean(mast))
}

/// When a flight was, and what it is compared with.
pub(super) fn when(flight: &MastFlight) -> String {
    let [from, to] = flight.span_ms.map(iso);
    let (day, from) = from.split_once('T').unwrap_or(("", &from));
    let to = to.split_once('T').map_or(to.as_str(), |(_, to)| to);
    let short = |time: &str| time.split('.').next().unwrap_or_default().to_owned();
    format!(
        "{day} {} to {} UTC, {}, ten-second means in {}",
        short(from),
        short(to),
        count(flight.drones.len(), "drone"),
        count(flight.fleet.count, "common second")
    )
}

/// What was found, a sentence each.
pub(super) fn sentences(flight: &MastFlight) -> Vec<String> {
    let fleet = &flight.fleet;
    let bias = Estimate::new(fleet.bias_mps, fleet.bias_se_mps);
    let stated = match fleet.stated_se_mps {
        Some(se) => {
            let beyond = fleet.bias_mps.abs() > 1.96 * se.hypot(fleet.bias_se_mps);
            let within = if beyond { "more than that" } else { "within that" };
            format!(
                ", and state a standard error of {} m/s for it: the bias is {within} (95 %)",
                fixed(se, 2)
            )
        }
        None => String::new(),
    };
    let mut all = vec![format!(
        "In the mean the drones say {} m/s more than the mast (± is the sampling of these seconds){stated}.",
        signed_estimate(bias)
    )];
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
        all.push(format!(
            "Variance of ten-second means: {} (m/s)² by the drones, {} (m/s)² by the mast, whose values as they are have \
             {} (m/s)².",
            variance(drones),
            variance(mast),
            fixed(flight.mast_variance_all, 3)
        ));
    }
    if let Some([shift_s, correlation]) = flight.best_shift {
        let better = fleet.correlation.is_none_or(|now| correlation > now + 0.02);
        if better && shift_s != 0.0 {
            let which = if shift_s > 0.0 { "later" } else { "earlier" };
            all.push(format!(
                "The records agree best with the drones {} s {which} than the mast (correlation {}): air that is carried \
                 from one to the other, or clocks that differ.",
                fixed(shift_s.abs(), 0),
                signed(correlation, 2)
            ));
        }
    }
    if let Some([east, north]) = &flight.wind {
        all.push(format!(
            "Wind by the drones' leans less the mast's: {} m/s towards east and {} m/s towards north; root mean square {} \
             and {} m/s.",
            signed_estimate(Estimate::new(east.bias_mps, east.bias_se_mps)),
            signed_estimate(Estimate::new(north.bias_mps, north.bias_se_mps)),
            fixed(east.rms_mps, 2),
            fixed(north.rms_mps, 2)
        ));
    }
    all
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

/// Rows of the table of averages; the first is that of ten seconds.
pub(super) fn averages(flight: &MastFlight) -> Vec<Vec<String>> {
    let nearest = flight.drones.first().map(|drone| drone.matched);
    let first = nearest.map(|nearest| Average { length_s: 10.0, fleet: flight.fleet, nearest });
    let cells = |of: &Matched| {
        let bias = signed_estimate(Estimate::new(of.bias_mps, of.bias_se_mps));
        [bias, fixed(of.rms_mps, 2), correlation(of)]
    };
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
        signed_estimate(Estimate::new(of.matched.bias_mps, of.matched.bias_se_mps)),
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
