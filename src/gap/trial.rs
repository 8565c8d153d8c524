//! A small fleet on a short ladder, for tests that take no time.

use super::bins::{Bin, BinValues};
use super::compare::{Comparison, Simulated};
use super::data::{Data, Group};
use super::gls::Start;
use super::noise::GroupPattern;
use super::response::Response;
use super::search::Ranked;
use super::verdict::{Finding, Rival, Step};
use crate::effects::{Model, Signals, find};
use crate::mission::plan::SegmentKind;
use crate::vehicle::Vehicle;
use crate::vehicle::library::builtin;

/// Climbs of the ladder's rungs, m/s; each has two bins.
const RUNGS_MPS: [f64; 8] = [0.0, 1.0, -1.0, 0.0, 2.0, -2.0, 3.0, -3.0];
/// Length of a bin, s.
const BIN_S: f64 = 3.0;

/// The vehicle of these flights.
pub(super) fn vehicle() -> Vehicle {
    builtin("airsim-generic-quad").unwrap()
}

/// The ladder's bins.
pub(super) fn ladder() -> Vec<Bin> {
    let bin = |index: usize| {
        let climb_mps = RUNGS_MPS[index / 2];
        let kind = match climb_mps {
            0.0 => SegmentKind::Hover,
            climb if climb > 0.0 => SegmentKind::LegUp,
            _ => SegmentKind::LegDown,
        };
        let start_s = 10.0 * (index / 2) as f64 + BIN_S * (index % 2) as f64;
        let velocity_mps = [0.0, 0.0, climb_mps];
        Bin { kind, start_s, end_s: start_s + BIN_S, velocity_mps, segment: index / 2 }
    };
    (0..2 * RUNGS_MPS.len()).map(bin).collect()
}

/// Drones that fly the ladder in still air as the model says, and what else there is in their pulses, us, by
/// drone and bin.
pub(super) fn data(drones: usize, more_us: impl Fn(usize, &Bin) -> f64) -> Data {
    let (bins, model) = (ladder(), Model::of(&vehicle()).unwrap());
    let values = |drone: usize, bin: &Bin| {
        let climb_mps = bin.climb_mps();
        let signals =
            Signals { climb_mps, height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
        BinValues {
            pulse_us: model.pulse_us(&signals) + more_us(drone, bin),
            climb_mps,
            height_m: 30.0,
            lean_rad: [0.0; 2],
            resting_v: f64::NAN,
            loaded_v: f64::NAN,
            power_w: f64::NAN,
            carried_away: false,
        }
    };
    let measured =
        (0..drones).map(|drone| bins.iter().map(|bin| values(drone, bin)).collect()).collect();
    let group = Group {
        name: "all".to_owned(),
        bins: bins.clone(),
        slots: (1..=drones as u16).collect(),
        place_m: (0..drones).map(|drone| [10.0 * drone as f64, 0.0]).collect(),
        neighbours: vec![0.0; drones],
        measured,
        armed_s: 0.0,
        flight: 0,
    };
    Data { groups: vec![group], ..Data::default() }
}

/// The same against the model's closed forms.
pub(super) fn comparison(data: &Data) -> Comparison {
    Comparison::new(data, &vehicle(), &Simulated::Closed, None).unwrap()
}

/// Two groups whose bins interleave, at several heights.
pub(super) fn patterns() -> Vec<GroupPattern> {
    let group = |drones: usize, first_s: f64| GroupPattern {
        drones,
        time_s: (0..6).map(|bin| first_s + 20.0 * f64::from(bin)).collect(),
        height_m: (0..6).map(|bin| 10.0 + 15.0 * f64::from(bin)).collect(),
        response: (0..6).map(|bin| Response::straight(15.0 + 2.0 * f64::from(bin))).collect(),
        offset: Vec::new(),
        slope_us: (0..6).map(|bin| 12.0 * f64::from(bin % 3) - 9.0).collect(),
        ..GroupPattern::default()
    };
    vec![group(3, 0.0), group(2, 8.0)]
}

/// Pulses of their drones that are no noise of any kind, us.
pub(super) fn pulses(patterns: &[GroupPattern]) -> Vec<Vec<Vec<f64>>> {
    let value = |group: usize, drone: usize, bin: usize| {
        5.0 * ((7 * group + 3 * drone + 1) as f64 * (bin as f64 + 1.7)).sin()
    };
    let bins = |group: usize, drone: usize| {
        (0..patterns[group].time_s.len()).map(|bin| value(group, drone, bin)).collect()
    };
    let drones =
        |group: usize| (0..patterns[group].drones).map(|drone| bins(group, drone)).collect();
    (0..patterns.len()).map(drones).collect()
}

/// A candidate with what it gains, nats.
pub(super) fn ranked(candidate: usize, gain: f64) -> Ranked {
    Ranked {
        candidate,
        variant: 0,
        gain,
        plain: gain,
        beta: 1.0,
        size_us: 3.0,
        range_us: 3.0,
        noise: Start::default(),
        fitted: true,
    }
}

/// A finding that gained so much, with rivals; one that is no effect of the library is a free shape.
pub(super) fn step(finding: Finding, gain_nats: f64, rivals: &[(&str, f64)]) -> Step {
    let rival = |(name, gain_nats): &(&str, f64)| Rival {
        name: (*name).to_owned(),
        generic: find(name).is_none(),
        gain_nats: *gain_nats,
    };
    Step {
        finding,
        gain_nats,
        threshold_nats: 8.0,
        alpha: 0.005,
        size_us: 5.0,
        rivals: rivals.iter().map(rival).collect(),
        shape: None,
        in_field: None,
        form: None,
    }
}

/// A new effect that is named alone.
pub(super) fn name(effect: &str) -> Finding {
    Finding::Name { effect: effect.to_owned(), parameters: Vec::new(), was_there: false }
}
