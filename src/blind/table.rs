//! Table of many outcomes: the metrics, beside the demands on them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::interval::{clopper_pearson, median, power};
use super::metrics::{has_z, is_named, metrics};
use super::scenario::Base;
use super::score::{Called, Outcome};
use super::series::Settings;
use super::tables::{FOREIGN_KINDS, KINDS};
use super::worlds::Worlds;

/// Name and version of the format of a table.
pub const TABLE_SCHEMA: &str = "updraft.blind-table/1";
/// Bins of Fisher z.
const BINS: &[(f64, f64)] =
    &[(0.0, 2.0), (2.0, 3.0), (3.0, 4.0), (4.0, 5.0), (5.0, 6.0), (6.0, 8.0), (8.0, f64::INFINITY)];

/// The whole table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Table {
    /// Format name and version: `updraft.blind-table/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// What was flown.
    pub settings: Settings,
    /// Flights without a verdict.
    pub lost: usize,
    /// All flights, then each protocol, then each air of each.
    pub groups: Vec<Group>,
    /// Each thing that was hidden.
    pub effects: Vec<EffectRow>,
}

/// Flights that are looked at together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Group {
    /// Which.
    pub label: String,
    /// How many.
    pub flights: usize,
    /// What is measured.
    pub metrics: Vec<Metric>,
    /// Naming against Fisher z.
    pub power: Vec<PowerBin>,
}

/// What is demanded of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Demand {
    /// At least this.
    AtLeast {
        /// The bound.
        bound: f64,
    },
    /// At most this, as observed.
    AtMost {
        /// The bound.
        bound: f64,
    },
    /// At most this, at the upper end of the interval.
    UpperAtMost {
        /// The bound.
        bound: f64,
    },
    /// Between two.
    Within {
        /// The lower bound.
        low: f64,
        /// The upper bound.
        high: f64,
    },
}

/// One metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Metric {
    /// What it is.
    pub name: String,
    /// Its value; absent: there is nothing to measure it with.
    pub value: Option<f64>,
    /// 95 % interval (Clopper-Pearson), of rates.
    pub interval: Option<(f64, f64)>,
    /// How many of how many, of rates; how many values, else.
    pub counts: (usize, usize),
    /// What is demanded at least.
    pub acceptance: Demand,
    /// What one may hope for.
    pub moonshot: Demand,
}

/// Naming in a bin of Fisher z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PowerBin {
    /// From this z ...
    pub from: f64,
    /// ... to this; absent: no end.
    pub to: Option<f64>,
    /// Hidden effects in it.
    pub count: usize,
    /// Named, alone or in their class.
    pub named: usize,
    /// 95 % interval of the rate.
    pub interval: (f64, f64),
    /// Mean of Phi(z - 4) over them: the best that can be had.
    pub best: Option<f64>,
}

/// What became of one kind of hidden effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectRow {
    /// The protocol.
    pub protocol: String,
    /// What was hidden.
    pub kind: String,
    /// How often.
    pub count: usize,
    /// Named alone (off-library: unknown, with the right dependence).
    pub named: usize,
    /// In its class.
    pub in_class: usize,
    /// Unknown.
    pub unknown: usize,
    /// Not seen.
    pub silent: usize,
    /// Median of |fit/truth - 1|.
    pub error: Option<f64>,
}

impl Demand {
    /// Amount by which a metric misses the demand, in the metric's unit: 0 if it is
    /// met, `None` if the metric has no value.
    pub fn missed_by(&self, metric: &Metric) -> Option<f64> {
        let value = metric.value?;
        let by = match *self {
            Self::AtLeast { bound } => bound - value,
            Self::AtMost { bound } => value - bound,
            Self::UpperAtMost { bound } => metric.interval.map_or(value, |(_, high)| high) - bound,
            Self::Within { low, high } => (low - value).max(value - high),
        };
        // What is no number is not met.
        Some(if by <= 0.0 { 0.0 } else { by })
    }

    /// Whether a metric may have missed the demand by chance: its 95 % interval reaches the
    /// demanded value.
    pub fn may_be_chance(&self, metric: &Metric) -> bool {
        let Some((from, to)) = metric.interval else { return false };
        match *self {
            Self::AtLeast { bound } => to >= bound,
            Self::AtMost { bound } | Self::UpperAtMost { bound } => from <= bound,
            Self::Within { low, high } => to >= low && from <= high,
        }
    }
}

/// Makes the table from the outcomes of `settings`; `lost` flights have no verdict.
pub fn table(settings: &Settings, outcomes: &[Outcome], lost: usize, made_by: &str) -> Table {
    let all: Vec<&Outcome> = outcomes.iter().collect();
    let mut groups = vec![group("all", &all)];
    if settings.worlds.iter().any(|worlds| !worlds.is_home()) {
        for worlds in &settings.worlds {
            let of: Vec<_> = all.iter().copied().filter(|one| one.cell.worlds == *worlds).collect();
            groups.push(group(worlds.name(), &of));
            // No file is a plant of blades: something is missing where nothing is hidden.
            for (base, name) in [(Base::Airsim, "thrust law"), (Base::Pixel, "blades")] {
                let of: Vec<_> = of.iter().copied().filter(|one| one.cell.base == base).collect();
                if !worlds.is_home() {
                    groups.push(group(&format!("{}, {name}", worlds.name()), &of));
                }
            }
        }
    }
    for protocol in &settings.protocols {
        let of: Vec<_> = all.iter().copied().filter(|one| one.cell.protocol == *protocol).collect();
        groups.push(group(protocol.name(), &of));
        for air in &settings.airs {
            let of: Vec<_> = of.iter().copied().filter(|one| one.cell.air == *air).collect();
            groups.push(group(&format!("{}, {}", protocol.name(), air.name()), &of));
        }
    }
    groups.retain(|group| group.flights > 0);
    Table {
        schema: TABLE_SCHEMA.to_owned(),
        made_by: made_by.to_owned(),
        settings: settings.clone(),
        lost,
        groups,
        effects: effects(settings, outcomes),
    }
}

fn group(label: &str, outcomes: &[&Outcome]) -> Group {
    Group {
        label: label.to_owned(),
        flights: outcomes.len(),
        metrics: metrics(outcomes),
        power: BINS.iter().map(|bin| power_bin(*bin, outcomes)).collect(),
    }
}

fn power_bin((from, to): (f64, f64), outcomes: &[&Outcome]) -> PowerBin {
    let hidden = outcomes.iter().flat_map(|one| &one.hidden);
    let of: Vec<_> = hidden.filter(|one| !one.foreign && has_z(one, from, to)).collect();
    let named = of.iter().filter(|one| is_named(one)).count();
    let best: f64 = of.iter().filter_map(|one| one.z).map(|z| power(z.abs())).sum();
    PowerBin {
        from,
        to: to.is_finite().then_some(to),
        count: of.len(),
        named,
        interval: clopper_pearson(named, of.len()),
        best: (!of.is_empty()).then(|| best / of.len() as f64),
    }
}

/// All that can be hidden: where, its name, and whether no library lists it.
fn kinds() -> impl Iterator<Item = (Worlds, &'static str, bool)> {
    let home = KINDS.iter().map(|kind| (Worlds::Home, kind.name, kind.foreign));
    let foreign =
        FOREIGN_KINDS.iter().map(|kind| (Worlds::Foreign, kind.name, kind.like.is_none()));
    home.chain(foreign)
}

fn effects(settings: &Settings, outcomes: &[Outcome]) -> Vec<EffectRow> {
    let mut rows = Vec::new();
    for protocol in &settings.protocols {
        for (worlds, name, is_foreign) in kinds() {
            let flights = outcomes
                .iter()
                .filter(|one| one.cell.protocol == *protocol && one.cell.worlds == worlds);
            let of: Vec<_> =
                flights.flat_map(|one| &one.hidden).filter(|one| one.kind == name).collect();
            let called = |called| of.iter().filter(|one| one.called == called).count();
            // What no library has is right to be unknown.
            let right = called(Called::Named);
            let (named, recognised) = if is_foreign { (0, right) } else { (right, 0) };
            let errors: Vec<f64> =
                of.iter().filter_map(|one| one.relative_error).map(f64::abs).collect();
            if !of.is_empty() {
                rows.push(EffectRow {
                    protocol: protocol.name().to_owned(),
                    kind: if worlds.is_home() {
                        name.to_owned()
                    } else {
                        format!("{name} (foreign)")
                    },
                    count: of.len(),
                    named,
                    in_class: called(Called::InClass),
                    unknown: called(Called::Unknown) + recognised,
                    silent: called(Called::Silent),
                    error: median(&errors),
                });
            }
        }
    }
    rows
}
