//! Made-up verdicts: one for each thing that a verdict can say.

#![allow(dead_code, reason = "each test uses its share")]

use updraft::gap::verdict::{
    DataUsed, Detectable, DroneOffset, Drones, Finding, Fitted, Gap, Interval, MapError, MapGain,
    Noise, Regime, Rest, Rival, Rung, SensorChannel, Shape, Shrink, Step, VERDICT_SCHEMA,
};
use updraft::gap::words::summary;
use updraft::gap::{Dependence, LeftOut, Verdict, Warning};
use updraft::report::Provenance;

fn around(value: f64, half: f64) -> Interval {
    Interval { value, low: value - half, high: value + half }
}

fn fitted(name: &str, unit: &str, value: f64, before: Option<f64>) -> Fitted {
    let value = around(value, 0.02 * value.abs());
    Fitted { name: name.to_owned(), unit: unit.to_owned(), value, before }
}

fn rival(name: &str, generic: bool, gain_nats: f64) -> Rival {
    Rival { name: name.to_owned(), generic, gain_nats }
}

fn step(finding: Finding, gain_nats: f64, rivals: Vec<Rival>) -> Step {
    let x: Vec<f64> = (-7..=7).map(|index| f64::from(index) / 2.0).collect();
    let us = x.iter().map(|x| 12.0 * x + x * x).collect();
    Step {
        finding,
        gain_nats,
        threshold_nats: 8.4,
        alpha: 0.005,
        size_us: 18.3,
        rivals,
        shape: Some(Shape { axis: "vertical velocity (m/s)".to_owned(), x, us }),
        in_field: None,
        form: None,
    }
}

fn regimes() -> Vec<Regime> {
    let classes = |by: &str, places: &[f64], size_us: f64| -> Vec<Regime> {
        places
            .iter()
            .enumerate()
            .map(|(index, x)| {
                let wave = (index as f64 * 1.7).sin();
                let before_us = size_us * (index as f64 - places.len() as f64 / 2.0);
                Regime {
                    by: Dependence::of(by).unwrap(),
                    label: format!("{x:+.1}"),
                    x: *x,
                    before_us: (before_us, 2.5),
                    after_us: 1.5 * wave,
                    before_mps: before_us / 55.0,
                    bins: 80,
                }
            })
            .collect()
    };
    let climbs: Vec<f64> = (-7..=7).map(|index| f64::from(index) / 2.0).collect();
    let mut regimes = classes("climb", &climbs, 6.0);
    regimes.extend(classes("height", &[10.0, 30.0, 50.0, 70.0, 90.0], 2.0));
    regimes.extend(classes("time", &[60.0, 180.0, 300.0, 420.0, 540.0], 1.0));
    regimes.extend(classes("wind", &[2.8, 3.4], 0.5));
    regimes.extend(classes("lean", &[0.4, 3.2], 0.5));
    regimes.extend(classes("voltage", &[0.35, 0.55, 0.75, 0.95], 3.0));
    regimes.extend(classes("place", &[3.0, 5.0, 8.0], 0.7));
    regimes.extend(classes("drone", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], 4.0));
    regimes
}

fn ladder(regimes: &[Regime]) -> Vec<Rung> {
    let rungs = regimes.iter().filter(|regime| regime.by == Dependence::Climb);
    rungs
        .map(|rung| {
            let measured_us = 1600.0 + 40.0 * rung.x;
            Rung {
                climb_mps: rung.x,
                measured_us,
                before_us: measured_us - rung.before_us.0,
                after_us: measured_us - rung.after_us,
                se_us: rung.before_us.1,
            }
        })
        .collect()
}

fn shrink(before: f64, after: f64) -> Shrink {
    Shrink {
        before_us: around(before + 4.0, 5.0),
        after_us: around(after + 8.0, 2.0),
        before_without_air_us: before,
        after_without_air_us: after,
        floor_us: 5.1,
        before_mps: before / 60.0,
        after_mps: (after + 8.0) / 52.0,
        chi2: ((before / 5.1).powi(2), (after / 5.1).powi(2)),
        excess_shrink: Interval { value: 0.97, low: 0.93, high: 0.99 },
        mean_us: (30.0, 3.5),
    }
}

fn seen(effect: &str, parameter: &str, unit: &str, usual: f64, z: f64) -> Detectable {
    let smallest = Some(4.0 * usual / z);
    Detectable {
        effect: effect.to_owned(),
        parameter: parameter.to_owned(),
        unit: unit.to_owned(),
        usual,
        smallest,
        usual_z: z,
        would_be_seen: z >= 5.0,
        like: Vec::new(),
        why: String::new(),
    }
}

fn detectable() -> Vec<Detectable> {
    let mut inflow = seen("rotor-inflow", "inflow_share", "", 0.5, 120.0);
    inflow.like = vec!["thrust-curve".to_owned(), "parasitic-drag".to_owned()];
    let mut flapping = seen("blade-flapping", "drag_per_weight", "s/m", 0.021, 1.5);
    flapping.like = vec!["translational-lift".to_owned()];
    let ground = Detectable {
        smallest: None,
        why: "even the largest possible size is lost in air and noise".to_owned(),
        ..seen("ground-effect", "radius_m", "m", 0.114, 0.2)
    };
    let spread = Detectable {
        parameter: String::new(),
        usual: 0.0,
        usual_z: 0.0,
        smallest: None,
        why: "a difference between drones: told from their offsets".to_owned(),
        ..seen("mass-spread", "", "", 1.0, 1.0)
    };
    vec![spread, inflow, seen("battery", "exponent", "", 1.0, 30.0), flapping, ground]
}

/// What all verdicts share; nothing was found.
pub(crate) fn nothing() -> Verdict {
    let regimes = regimes();
    let each = (1..=8).map(|slot: u16| DroneOffset {
        slot,
        offset_us: 3.0 * f64::from(slot) - 13.0,
        slope: 0.004 * f64::from(slot) - 0.018,
        held_out: slot.is_multiple_of(4),
    });
    let mut verdict = Verdict {
        map: Some(MapGain {
            flight: "hover".to_owned(),
            drones: 7,
            values: 1200,
            zero_mps: 0.42,
            common_sd_mps: 0.21,
            before: MapError { rms_mps: 0.61, bias_mps: -0.5, without_bias_mps: 0.35 },
            after: MapError { rms_mps: 0.21, bias_mps: 0.15, without_bias_mps: 0.15 },
        }),
        wind: updraft::gap::verdict::WindFound::default(),
        schema: VERDICT_SCHEMA.to_owned(),
        made_by: "updraft test".to_owned(),
        vehicle: "airsim-generic-quad".to_owned(),
        summary: String::new(),
        data: DataUsed {
            logs: 9,
            logs_sha256: String::new(),
            drones: 8,
            groups: vec![("even".to_owned(), 4), ("odd".to_owned(), 4)],
            bins: vec![146, 145],
            held_out: vec![8, 4],
            left_out: vec![LeftOut::Said("slot-9.BIN: the log ends before the ladder".to_owned())],
        },
        sensor: SensorChannel {
            bias_mps: Some(around(0.0004, 0.0003)),
            lag_s: Some(around(0.002, 0.001)),
            biased_drones: Vec::new(),
            named: false,
            in_log: false,
        },
        steps: Vec::new(),
        rest: Rest {
            gain_nats: 2.3,
            candidate: "motor-thermal".to_owned(),
            threshold_nats: 8.0,
            reduced_chi2: 0.98,
        },
        detectable: detectable(),
        noise: Noise {
            shared_air_mps: 0.2,
            shared_air_s: 40.0,
            own_air_mps: 0.01,
            gusts_mps: 0.08,
            gusts_s: 6.0,
            white_us: 0.3,
            drones_us: 8.4,
            slopes: 0.016,
            least_response: 2.8,
            gradient_mps: 0.06,
            side_gusts_mps: 0.2,
            pulse_noise_us: 0.3,
            updraft_mps: 0.0,
            updraft_half_mps: None,
        },
        drones: Drones {
            each: each.collect(),
            correlation: Some(0.91),
            words: vec!["hover pulses differ by 8.4 us from drone to drone".to_owned()],
        },
        gap: Gap { drones: Some(shrink(5.3, 5.2)), rungs: Some(shrink(5.4, 5.3)) },
        ladder: ladder(&regimes),
        regimes,
        cautions: Vec::new(),
    };
    verdict.summary = summary(&verdict);
    verdict
}

fn with(steps: Vec<Step>) -> Verdict {
    let mut verdict = nothing();
    verdict.steps = steps;
    verdict.gap = Gap { drones: Some(shrink(32.1, 5.2)), rungs: Some(shrink(33.0, 5.3)) };
    verdict.summary = summary(&verdict);
    verdict
}

/// One effect by its name.
pub(crate) fn named() -> Verdict {
    let finding = Finding::Name {
        effect: "rotor-inflow".to_owned(),
        parameters: vec![fitted("inflow_share", "", 0.398, None)],
        was_there: false,
    };
    let rivals = vec![
        rival("climb", true, 377.6),
        rival("rotor-inflow", false, 369.0),
        rival("vortex-ring", false, 83.6),
        rival("climb-time", true, 9.1),
    ];
    with(vec![step(finding, 369.0, rivals)])
}

/// A class of two, and then an effect that the model had with another size.
pub(crate) fn class() -> Verdict {
    let first = Finding::Class {
        effects: vec!["thrust-curve".to_owned(), "parasitic-drag".to_owned()],
        parameters: vec![fitted("expo", "", 0.31, None)],
    };
    let second = Finding::Name {
        effect: "battery".to_owned(),
        parameters: vec![fitted("exponent", "", 0.5, Some(1.0))],
        was_there: true,
    };
    let rivals = vec![
        rival("thrust-curve", false, 31.0),
        rival("parasitic-drag", false, 29.8),
        rival("time", true, 3.0),
    ];
    let again = vec![rival("battery", false, 15.0), rival("voltage", true, 12.2)];
    with(vec![step(first, 31.0, rivals), step(second, 15.0, again)])
}

/// Something that is not in the library, with a formula; offsets of drones cannot be told then.
pub(crate) fn unknown() -> Verdict {
    let finding = Finding::Unknown {
        depends_on: Dependence::Height,
        formula: Some("4.00 sin(2 pi h/31.2 + 0.10) us".to_owned()),
    };
    let rivals = vec![rival("height", true, 55.0), rival("ground-effect", false, 9.0)];
    let mut verdict = with(vec![step(finding, 55.0, rivals)]);
    verdict.drones = Drones::default();
    verdict.cautions = vec![Warning::Said(
        "all drones climb at the same time: what depends on climb speed is mixed with the shared air"
            .to_owned(),
    )];
    verdict
}

/// The velocity itself is off; nothing in the pulse.
pub(crate) fn sensor() -> Verdict {
    let mut verdict = nothing();
    verdict.sensor = SensorChannel {
        bias_mps: Some(around(0.112, 0.004)),
        lag_s: Some(around(0.21, 0.01)),
        biased_drones: vec![(3, -0.31)],
        named: true,
        in_log: false,
    };
    verdict.summary = summary(&verdict);
    verdict
}

/// Where a page came from.
pub(crate) fn provenance() -> Provenance {
    Provenance {
        program: "updraft test".to_owned(),
        command: "updraft gap my-campaign".to_owned(),
        seed: Some(1),
        ..Provenance::default()
    }
}
