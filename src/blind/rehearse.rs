//! Rehearsal of a proposed flight: a simulation with a known answer, to see whether the search
//! would find it.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::air::AirScales;
use super::error::BlindError;
use super::explain::Explain;
use super::fly::{Flown, Setting, fly_into};
use super::scenario::BatteryTruth;
use super::vehicles::{KNOWN_THRUST_SPREAD, hover_a, report_battery};
use crate::effects::Role;
use crate::effects::select::set;
use crate::gap::Verdict;
use crate::gap::next::elements::{PAYLOAD_EVERY, PAYLOAD_KG, lowest_charge};
use crate::gap::next::known::charge_of;
use crate::gap::next::predict::z_of;
use crate::gap::next::result::Verified;
use crate::gap::next::{Elements, Question, Separation, Sought};
use crate::gap::verdict::{Finding, Noise};
use crate::mission::resolve::ResolvedFlight;
use crate::numeric;
use crate::vehicle::Vehicle;

/// Time scale and relative strength of the wind's own gusts.
const WIND_GUST: (f64, f64) = (25.0, 0.15);
/// Correlation length of the updraft, m.
const LENGTH_M: f64 = 145.0;
/// Cells and internal resistance of the batteries that the logs report.
const CELLS: f64 = 3.0;
const RESISTANCE_OHM: f64 = 0.03;

/// A proposed flight with the air and noise to rehearse it in.
#[derive(Clone, Copy, Debug)]
pub struct Rehearsal<'a> {
    /// Plan of the flight, with its template.
    pub flight: &'a ResolvedFlight,
    /// Elements that the flight is made of: payloads, charges, legs.
    pub elements: Elements,
    /// Noise and air as they were estimated from the logs.
    pub noise: &'a Noise,
    /// Mean horizontal wind, show frame, m/s.
    pub wind_mps: [f64; 2],
    /// Seed of all that is random.
    pub seed: u64,
}

/// A possible answer to the question of a proposed flight: an effect of some size.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Name of the effect.
    pub effect: String,
    /// Parameter that states the size of the effect.
    pub parameter: String,
    /// Value of the parameter, in its own unit.
    pub size: f64,
    /// The vehicle without it, which is held against the logs.
    pub without: Vehicle,
    /// From what the flight shall tell it (an empty name: from nothing), and the Fisher z that was predicted.
    pub from: Vec<(String, f64)>,
}

/// Possible answers to a question that the simulator can fly. `model` has the effects that were
/// found; the sizes are those at which the answers look alike.
pub fn answers(question: &Question, model: &Vehicle, predicted: &[Separation]) -> Vec<Answer> {
    let size_of = |effect: &str| {
        let found = predicted.iter().find(|one| one.from == effect || one.from.is_empty());
        found.and_then(|one| one.size)
    };
    let answer = |effect: &str, size: f64, without: &Vehicle, from: Vec<(String, f64)>| {
        Some(Answer {
            effect: effect.to_owned(),
            parameter: parameter(effect)?.to_owned(),
            size,
            without: without.clone(),
            from,
        })
    };
    let from_all = || predicted.iter().map(|one| (one.from.clone(), one.z)).collect();
    match &question.sought {
        Sought::Shape { .. } => Vec::new(),
        Sought::Seen { effect } => size_of(effect)
            .and_then(|size| answer(effect, size, model, from_all()))
            .into_iter()
            .collect(),
        Sought::Apart { effects, size } => {
            let [first, others @ ..] = &effects[..] else { return Vec::new() };
            let mut without = model.clone();
            let before = size.as_ref().and_then(|(name, _, before)| Some((name, (*before)?)));
            match before {
                Some((name, before)) => set(&mut without, first, name, before),
                None => {
                    without.effects.remove(first);
                }
            }
            let own = size.as_ref();
            let own = own.and_then(|(_, value, _)| answer(first, *value, &without, from_all()));
            let rivals = others.iter().filter_map(|other| {
                let one = predicted.iter().find(|one| one.from == *other)?;
                answer(other, one.size?, &without, vec![(first.clone(), one.z)])
            });
            own.into_iter().chain(rivals).collect()
        }
    }
}

/// The parameter that says how large an effect is.
fn parameter(effect: &str) -> Option<&'static str> {
    match crate::effects::find(effect)?.definition().sought {
        crate::effects::Sought::Shape { size, .. } => Some(size),
        crate::effects::Sought::No(_) => None,
    }
}

/// Flies the proposed flight with one answer into `folder`.
///
/// # Errors
/// As [`super::fly::fly`].
pub fn fly_answer(
    rehearsal: &Rehearsal<'_>,
    answer: &Answer,
    folder: &Path,
    stop: Option<&AtomicBool>,
) -> Result<Flown, BlindError> {
    let plan = &rehearsal.flight.plan;
    let noise = rehearsal.noise;
    let wind_mps = rehearsal.wind_mps;
    let air = AirScales {
        shared_mps: noise.shared_air_mps,
        length_m: LENGTH_M,
        time_s: noise.shared_air_s.max(1.0),
        local_mps: noise.gusts_mps.hypot(noise.own_air_mps),
        local_s: noise.gusts_s.max(1.0),
        wind_mps,
        wind_gust_mps: WIND_GUST.1 * wind_mps[0].hypot(wind_mps[1]),
        wind_gust_s: WIND_GUST.0,
        updraft_mps: 0.0,
    };
    let setting = Setting {
        plan,
        template_text: &rehearsal.flight.template_text,
        known: &answer.without,
        air: &air,
        seed: rehearsal.seed,
        extra: &[],
        missing: &[],
    };
    let vehicle_of = |slot: u16| Ok(drone(rehearsal, answer, slot));
    fly_into(folder, &setting, &vehicle_of, stop)
}

/// The vehicle of one slot.
fn drone(rehearsal: &Rehearsal<'_>, answer: &Answer, slot: u16) -> Vehicle {
    let plan = &rehearsal.flight.plan;
    let place = plan.slots.iter().position(|one| one.slot == slot).unwrap_or(0);
    let mut vehicle = answer.without.clone();
    let spread = Role::ThrustSpread;
    if !vehicle.effects.keys().any(|name| spread.is_of(name)) {
        spread.set(&mut vehicle, KNOWN_THRUST_SPREAD);
    }
    let charge = if rehearsal.elements.charge {
        charge_of(place, plan.slots.len(), lowest_charge(plan))
    } else {
        1.0
    };
    if Role::BatteryCharge.is_on(&vehicle) {
        Role::BatteryCharge.set(&mut vehicle, charge);
    } else {
        let capacity_ah = hover_a(&vehicle, CELLS) * plan.limits.endurance_s / 3600.0;
        let battery = BatteryTruth { cells: CELLS, capacity_ah, resistance_ohm: RESISTANCE_OHM };
        report_battery(&mut vehicle, &battery, charge);
    }
    if rehearsal.elements.payload && place.is_multiple_of(PAYLOAD_EVERY) {
        vehicle.airframe.mass_kg += PAYLOAD_KG;
    }
    set(&mut vehicle, &answer.effect, &answer.parameter, answer.size);
    vehicle
}

/// Flies one answer, searches it, and checks whether the search named it. The flight's folder is
/// removed again.
///
/// # Errors
///
/// As [`fly_answer`]; [`BlindError::Explain`] if the search fails.
pub fn rehearse(
    rehearsal: &Rehearsal<'_>,
    answer: &Answer,
    folder: &Path,
    search: &dyn Explain,
    stop: Option<&AtomicBool>,
) -> Result<Verified, BlindError> {
    fly_answer(rehearsal, answer, folder, stop)?;
    let found = search.explain(folder);
    // What was made here goes, whatever came of it.
    let _ = std::fs::remove_dir_all(folder);
    let verdict =
        found.map_err(|source| BlindError::Explain { flight: folder.to_owned(), source })?;
    Ok(told(answer, &verdict))
}

fn told(answer: &Answer, verdict: &Verdict) -> Verified {
    let found: Vec<String> = verdict
        .steps
        .iter()
        .map(|step| match &step.finding {
            Finding::Unknown { depends_on, .. } => format!("unknown, depends on {depends_on}"),
            finding => finding.effects().join(" or "),
        })
        .collect();
    let told = found.len() == 1 && found[0] == answer.effect;
    let predicted_z = numeric::least(answer.from.iter().map(|(_, z)| *z)).unwrap_or_default();
    let reached_z = reached_z(answer, verdict);
    let truth = answer.effect.clone();
    Verified { truth, size: answer.size, found, told, predicted_z, reached_z }
}

/// Fisher z with which the first step of a verdict tells an answer from what it must be told from. From nothing: its size
/// over its standard error. From another effect: the root of twice the lead of its log-likelihood, negative where the
/// other one leads; rivals that are too far behind for the verdict's list do not count. `None` where the verdict
/// does not say.
fn reached_z(answer: &Answer, verdict: &Verdict) -> Option<f64> {
    let step = verdict.steps.first()?;
    let gain_nats = |name: &str| {
        let best = step.finding.effects().first().is_some_and(|first| *first == name);
        let rival = || step.rivals.iter().find(|rival| rival.name == name);
        if best { Some(step.gain_nats) } else { rival().map(|rival| rival.gain_nats) }
    };
    let z = |from: &str| {
        if from.is_empty() {
            return size_z(answer, &step.finding);
        }
        let lead_nats = gain_nats(&answer.effect)? - gain_nats(from)?;
        Some((2.0 * lead_nats.abs()).sqrt().copysign(lead_nats))
    };
    numeric::least(answer.from.iter().filter_map(|(from, _)| z(from)))
}

/// The size of an answer over its standard error, if a finding has it first.
fn size_z(answer: &Answer, finding: &Finding) -> Option<f64> {
    let (Finding::Name { parameters, .. } | Finding::Class { parameters, .. }) = finding else {
        return None;
    };
    finding.effects().first().filter(|first| **first == answer.effect)?;
    let size = parameters.iter().find(|fitted| fitted.name == answer.parameter)?;
    Some(z_of(size.value, size.before.unwrap_or(0.0))).filter(|z| z.is_finite())
}
