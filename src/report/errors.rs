//! The error budget of a map, its comparison with the truth, and the quality of its data, in words.

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::law::LawOf;
use crate::analysis::result::{CommonError, DroneUpdraft, ErrorBudget, UpdraftMap};
use crate::numeric::Sorted;

use super::doubts::doubts;
use super::figures::air::where_compared;
use super::fleet_air::fleet_air;
use super::text::{NONE, count, fixed, signed, usable};

/// A kind of error: its name, what it is, and where it stands in the drone's and the common budget.
type BudgetRow =
    (&'static str, &'static str, fn(&ErrorBudget) -> f64, Option<fn(&CommonError) -> f64>);

/// The zero of a map by a calibration.
const ZERO: &str = "slow air during the calibration that the whole fleet shared";

const KINDS: [BudgetRow; 7] = [
    ("hover", "noise of pulse and velocity in the hover", |e| e.window_mps, None),
    (
        "law",
        "the drone's mapping: noise and local air in its calibration, slope and curvature",
        |e| e.law_mps,
        Some(|c| c.law_mps),
    ),
    ("zero", ZERO, |e| e.zero_mps, Some(|c| c.zero_mps)),
    (
        "battery",
        "change of battery voltage beyond its correction, and other drift",
        |e| e.battery_mps,
        Some(|c| c.battery_mps),
    ),
    (
        "wind",
        "wind on the leaning drone beyond its correction",
        |e| e.wind_mps,
        Some(|c| c.wind_mps),
    ),
    ("density", "air density beyond its correction", |e| e.density_mps, Some(|c| c.density_mps)),
    ("velocity", "bias of the vertical velocity", |e| e.velocity_mps, None),
];

/// Budget, truth and quality of a map.
pub(super) fn section(map: &UpdraftMap) -> Value {
    let truth = map.truth.filter(|truth| truth.values > 0 && usable(truth.rms_mps)).map(|truth| {
        let percent = |share: f64| fixed(100.0 * share, 1);
        let inside = truth.inside_share.map_or_else(String::new, |values| {
            let means = truth.means_inside_share.map_or_else(String::new, |means| {
                format!(", and so do the true means of {} % of the drones", percent(means))
            });
            format!(
                "; {} % of the true values lie inside their 95 % intervals{means}",
                percent(values)
            )
        });
        let of_means = fleet_air(map).and_then(|air| air.rms_error);
        format!(
            "Estimate and truth: over {} (running means of 10 s) of {}{}, W* − W has a root mean square \
             of {} m/s and a mean of {} m/s ({} m/s without that mean){}{inside}.",
            count(truth.values, "value"),
            count(truth.drones, "drone"),
            where_compared(map),
            fixed(truth.rms_mps, 3),
            signed(truth.bias_mps, 3),
            fixed(truth.rms_without_bias_mps, 3),
            of_means.map_or_else(String::new, |rms| format!(
                "; that of means over {} has {} m/s",
                if where_compared(map).is_empty() { "the hover" } else { "them" },
                fixed(rms, 3)
            )),
        )
    });
    context! { budget => budget(map), truth, quality => doubts(map), coverage => coverage(map) }
}

fn budget(map: &UpdraftMap) -> Option<Value> {
    let known =
        |drone: &&DroneUpdraft| usable(drone.errors.total_mps) && drone.errors.total_mps > 0.0;
    let drones: Vec<&DroneUpdraft> = map.drones.iter().filter(known).collect();
    if drones.is_empty() {
        return None;
    }
    let row = |of: &dyn Fn(&ErrorBudget) -> f64, common: Option<f64>| {
        let mut values: Vec<f64> =
            drones.iter().map(|drone| of(&drone.errors)).filter(|v| usable(*v)).collect();
        let sorted = Sorted::of(&mut values);
        let words =
            |v: Option<f64>| v.filter(|v| usable(*v)).map_or(NONE.to_owned(), |v| fixed(v, 3));
        (words(sorted.nearest_quantile(0.5)), words(sorted.nearest_quantile(1.0)), words(common))
    };
    let mut rows: Vec<Value> = KINDS
        .iter()
        .map(|(name, what, of, common)| {
            let common = common.zip(map.common.as_ref()).map(|(of, common)| of(common));
            let (median, largest, common) = row(of, common);
            let what = if *name == "zero" { zero_words(map) } else { what };
            context! { name => *name, what, median, largest, common, total => false }
        })
        .collect();
    let (median, largest, common) = row(&|e| e.total_mps, map.common.map(|common| common.se_mps));
    let what = "root of the sum of squares";
    rows.push(context! { name => "all", what, median, largest, common, total => true });
    let half_width = map.common.filter(|c| usable(c.half_width_mps) && c.half_width_mps > 0.0);
    Some(context! {
        rows,
        drones => drones.len(),
        fleet => drones.len() > 1,
        half_width => half_width.map(|common| fixed(common.half_width_mps, 2)),
    })
}

/// What the zero of a map rests on.
fn zero_words(map: &UpdraftMap) -> &'static str {
    match &map.levelled {
        Some(levelled) if levelled.zero_s.is_some() => {
            "the true mean of the air over the stretch that was set to zero"
        }
        Some(_) => {
            "the level: air during the calibration's windows, and the air's density on another day"
        }
        None => ZERO,
    }
}

/// `49 drones have a value in 99.8 % of 590 s`.
fn coverage(map: &UpdraftMap) -> String {
    let cells = map.drones.len() * map.time_s.len();
    let present: usize =
        map.drones.iter().map(|drone| drone.updraft_mps.iter().flatten().count()).sum();
    let own = map.drones.iter().filter(|drone| drone.mapping == LawOf::Own).count();
    let by = match (map.drones.len(), own) {
        (1, 1) => "It is measured by its own calibration law".to_owned(),
        (1, _) => {
            "It is measured by the law of the calibration flight, not by one of its own".to_owned()
        }
        (n, own) => format!(
            "{own} through their own calibration law, {} through that of the fleet's average",
            n - own
        ),
    };
    format!(
        "{} in {} common seconds; {} % of the values are there. {by}.",
        count(map.drones.len(), "drone"),
        map.time_s.len(),
        fixed(100.0 * present as f64 / cells.max(1) as f64, 1),
    )
}
