//! The table `verdicts`: a row for each finding of `updraft gap`, and one for a verdict that finds nothing.

use super::table::{Column, real, text, whole};
use crate::gap::Verdict;
use crate::gap::verdict::{Finding, Fitted, Interval, Step};

/// One finding of a verdict.
#[derive(Debug, Default)]
pub struct VerdictRow {
    number: Option<i64>,
    kind: &'static str,
    effect: Option<String>,
    effects: Option<String>,
    formula: Option<String>,
    parameter: Option<String>,
    unit: Option<String>,
    value: Option<Interval>,
    before: Option<f64>,
    parameters: Option<String>,
    gain_nats: Option<f64>,
    threshold_nats: Option<f64>,
    size_us: Option<f64>,
    response: Option<Interval>,
    air_mps: Option<f64>,
    vehicle: String,
    summary: String,
    drones: i64,
    shared_air_mps: f64,
    wind_mps: f64,
    left_chi2: Option<f64>,
    made_by: String,
}

/// Rows of a verdict.
pub fn rows(verdict: &Verdict) -> Vec<VerdictRow> {
    let sensor = verdict.sensor.named.then(|| VerdictRow {
        kind: "sensor",
        effect: Some("vertical-velocity".to_owned()),
        parameter: Some("bias_mps".to_owned()),
        unit: Some("m/s".to_owned()),
        value: verdict.sensor.bias_mps,
        ..about(verdict)
    });
    let steps = verdict.steps.iter().zip(1..).map(|(step, number)| found(verdict, step, number));
    let mut rows: Vec<VerdictRow> = sensor.into_iter().chain(steps).collect();
    if rows.is_empty() {
        let kind = if verdict.is_unexplained() { "unexplained" } else { "nothing" };
        rows.push(VerdictRow { kind, ..about(verdict) });
    }
    rows
}

/// What all rows of a verdict have.
fn about(verdict: &Verdict) -> VerdictRow {
    let [x_mps, y_mps] = verdict.wind.mean_mps;
    VerdictRow {
        vehicle: verdict.vehicle.clone(),
        summary: verdict.summary.clone(),
        drones: verdict.data.drones as i64,
        shared_air_mps: verdict.noise.shared_air_mps,
        wind_mps: x_mps.hypot(y_mps),
        left_chi2: verdict.gap.rungs.as_ref().map(|rungs| rungs.chi2.1),
        made_by: verdict.made_by.clone(),
        ..VerdictRow::default()
    }
}

fn found(verdict: &Verdict, step: &Step, number: i64) -> VerdictRow {
    let none: &[Fitted] = &[];
    let (kind, effect, parameters, formula) = match &step.finding {
        Finding::Name { effect, parameters, .. } => {
            ("name", Some(effect.clone()), parameters.as_slice(), None)
        }
        Finding::Class { effects, parameters } => {
            ("class", effects.first().cloned(), parameters.as_slice(), None)
        }
        Finding::Unknown { depends_on, formula } => {
            let depends = serde_json::to_value(depends_on).ok();
            let depends = depends.and_then(|value| value.as_str().map(str::to_owned));
            ("unknown", depends, none, formula.clone())
        }
    };
    let first = parameters.first();
    let said = parameters.iter().map(|of| {
        format!(
            "{} = {} ({} to {}) {}",
            of.name, of.value.value, of.value.low, of.value.high, of.unit
        )
    });
    VerdictRow {
        number: Some(number),
        kind,
        effect,
        effects: Some(step.finding.effects().join(";")),
        formula,
        parameter: first.map(|of| of.name.clone()),
        unit: first.map(|of| of.unit.clone()),
        value: first.map(|of| of.value),
        before: first.and_then(|of| of.before),
        parameters: Some(said.collect::<Vec<_>>().join("; ")),
        gain_nats: Some(step.gain_nats),
        threshold_nats: Some(step.threshold_nats),
        size_us: Some(step.size_us),
        response: step.in_field.map(|field| field.response_us_per_mps),
        air_mps: step.in_field.and_then(|field| field.air_mps),
        ..about(verdict)
    }
}

/// Columns of the table.
pub fn columns() -> Vec<Column<VerdictRow>> {
    vec![
        whole("step", |row: &VerdictRow| row.number),
        text("kind", |row| Some(row.kind)),
        text("effect", |row| row.effect.as_deref()),
        text("effects", |row| row.effects.as_deref()),
        text("formula", |row| row.formula.as_deref()),
        text("parameter", |row| row.parameter.as_deref()),
        text("unit", |row| row.unit.as_deref()),
        real("value", |row| Some(row.value?.value)),
        real("value_low", |row| Some(row.value?.low)),
        real("value_high", |row| Some(row.value?.high)),
        real("value_before", |row| row.before),
        text("parameters", |row| row.parameters.as_deref()),
        real("size_us", |row| row.size_us),
        // Of a gain of likelihood by one parameter: so many standard errors it is from 0.
        real("z", |row| Some((2.0 * row.gain_nats?.max(0.0)).sqrt())),
        real("gain_nats", |row| row.gain_nats),
        real("threshold_nats", |row| row.threshold_nats),
        real("response_us_per_mps", |row| Some(row.response?.value)),
        real("response_low_us_per_mps", |row| Some(row.response?.low)),
        real("response_high_us_per_mps", |row| Some(row.response?.high)),
        real("air_mps", |row| row.air_mps),
        text("vehicle", |row| Some(&row.vehicle)),
        text("summary", |row| Some(&row.summary)),
        whole("drones", |row| Some(row.drones)),
        real("shared_air_mps", |row| Some(row.shared_air_mps)),
        real("wind_mps", |row| Some(row.wind_mps)),
        real("left_chi2", |row| row.left_chi2),
        text("judged_by", |row| Some(&row.made_by)),
    ]
}
