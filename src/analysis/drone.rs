//! One log of a flight: windows, laws and (with reference laws) the air.

use super::aware::Aware;
use super::calibrate::{self, CalibrationError, FitOptions, Hold};
use super::hover::Hover;
use super::input::{FlightInput, LogInput, TruthSeries};
use super::offset::OffsetMap;
use super::options::{AnalysisOptions, MapLaw};
use super::result::{DroneAnalysis, Fit, FlightAnalysis, Laws, Trace, WindowStats};
use super::statistics::HoverSeen;
use super::stats::mean_sd;
use super::steps::steady;
use super::track;
use super::updraft::{self, DroneSeries, Lean, RUNNING_S, Running};
use super::windows::{self, Corrected, Target};
use crate::base::causes::with_causes;
use crate::base::plain::plain;
use crate::flight::{Alignment, Flight, FlightOptions, table};
use crate::mission::plan::{Kind, Purpose, Segment, Slot};

/// What all logs of a flight share.
pub(super) struct Shared<'a> {
    pub(super) input: &'a FlightInput<'a>,
    pub(super) options: &'a AnalysisOptions,
    pub(super) reference: Option<&'a FlightAnalysis>,
    /// The reference with its laws referred to the density at the ground, for the map.
    pub(super) map_reference: Option<&'a FlightAnalysis>,
    pub(super) planned_purpose: Option<Purpose>,
    pub(super) map_law: Option<MapLaw>,
    /// The calibration with what it tells about errors, for the map.
    pub(super) aware: Option<Aware<'a>>,
}

/// What one log gave.
pub(super) struct One {
    pub(super) drone: DroneAnalysis,
    /// What the log lacks: one phrase for each, in the words of the drone's warnings.
    pub(super) losses: Vec<String>,
    /// Bytes of the log that its reader skipped.
    pub(super) skipped_bytes: u64,
    pub(super) calibration: Result<Laws, CalibrationError>,
    /// The air, with the mapping used; or why there is none. `None` without reference laws.
    pub(super) updraft: Option<Result<(DroneSeries, &'static str), String>>,
    /// Its hover, for the statistics.
    pub(super) hover: HoverSeen,
    /// What something beside the drone measured of the air.
    pub(super) truth: Option<TruthSeries>,
}

/// Everything about one log.
pub(super) fn one(shared: &Shared<'_>, log: &LogInput, slot: Option<u16>) -> Result<One, String> {
    let Shared { input, options, .. } = shared;
    let slot: Option<(&Slot, &[Segment])> = slot.and_then(|number| {
        let plan = input.plan?;
        let slot = plan.slot(number)?;
        Some((slot, plan.segments(slot)))
    });
    let flight_options = FlightOptions {
        start: input.start,
        indicator: options.indicator,
        segments: slot.map(|(_, segments)| segments),
    };
    let flight = match &log.table {
        Some(mapping) => {
            table::read(&log.path, mapping).map_err(|error| with_causes(&error, ": "))?
        }
        None => {
            Flight::open(&log.path, flight_options).map_err(|error| with_causes(&error, ": "))?
        }
    };
    let mut warnings = flight.warnings.clone();

    let targets = match &log.table {
        Some(mapping) if flight.desired_up_mps.is_none() => steady(&flight, &mapping.steps),
        _ => find_targets(&flight, slot.map(|(_, segments)| segments), &mut warnings)?,
    };
    let elsewhere = elsewhere(&flight, &targets);
    warnings.extend(elsewhere.clone());
    let corrected = windows::correct_tilt(&flight, &options.windows);
    let mut stats = windows::measure(&flight, &corrected, &targets, &options.windows);
    let offset = options
        .offset
        .is_subtracted(input.true_updraft_mps)
        .then(|| OffsetMap::subtract(&mut stats, options.fit.location))
        .flatten();

    let name = match slot {
        Some((slot, _)) => slot.name.clone(),
        None => plain(&log.path.file_stem().unwrap_or_default().to_string_lossy()).into_owned(),
    };
    let number = slot.map(|(slot, _)| slot.slot);
    let reference = shared.reference.and_then(|reference| laws_for(reference, number, &name));
    let hold = options.fit.hold.or_else(|| Hold::from_laws(reference.map(|(laws, _, _)| laws)?));
    let calibration = calibrate::calibrate(&stats, &FitOptions { hold, ..options.fit });
    let seen = Seen { flight: &flight, corrected: &corrected, targets: &targets, windows: &stats };
    let updraft = shared.map_reference.map(|reference| match &elsewhere {
        Some(reason) => Err(reason.clone()),
        None => measure(shared, &seen, reference, number, &name),
    });
    let source = input.shown(&log.path);
    let drone = DroneAnalysis {
        slot: number,
        name,
        source,
        home_m: slot.map(|(slot, _)| [slot.home_m[0], slot.home_m[1]]),
        clock: flight.clock.clone(),
        windows: stats,
        offset,
        laws: None,
        partial_ladder: None,
        trace: trace(&flight, &corrected, options.trace_points),
        warnings,
    };
    let (losses, skipped_bytes) = (flight.losses(), flight.scan.bad_bytes);
    let hover = HoverSeen::of(&flight, &corrected, &targets);
    let truth = true_air(&flight, &targets);
    Ok(One { drone, losses, skipped_bytes, calibration, updraft, hover, truth })
}

/// That none of the windows lies in the time that the log speaks of.
fn elsewhere(flight: &Flight, targets: &[Target]) -> Option<String> {
    let (from, to) = flight.velocity_up_mps.span()?;
    let (first, last) = (targets.first()?, targets.last()?);
    let apart = targets.iter().all(|target| target.end_s < from || target.start_s > to);
    apart.then(|| {
        format!(
            "its log runs from {from:.0} to {to:.0} s of show time, and the plan's windows lie between \
             {:.0} and {:.0} s: the drone's clock jumped or was set wrong, or the log is of another \
             start; nothing of the plan is in it",
            first.start_s, last.end_s
        )
    })
}

/// The true air over the hover as the map sees it: means over the 10 s around each second.
fn true_air(flight: &Flight, targets: &[Target]) -> Option<TruthSeries> {
    let (truth, hover) = (flight.truth_up_mps.as_ref()?, updraft::hover(targets)?);
    let running = Running::new(truth, hover.start_s, hover.end_s);
    let half = RUNNING_S / 2.0;
    let (first_s, last_s) =
        ((hover.start_s + half).ceil() as i64, (hover.end_s - half).floor() as i64);
    let means: Option<Vec<f64>> =
        (first_s..=last_s).map(|time| running.mean(time as f64)).collect();
    Some(TruthSeries { first_s, updraft_mps: means? })
}

/// What one log showed.
struct Seen<'a> {
    flight: &'a Flight,
    corrected: &'a Corrected,
    targets: &'a [Target],
    windows: &'a [WindowStats],
}

/// The air over one drone's hover, or why it cannot be measured.
fn measure(
    shared: &Shared<'_>,
    seen: &Seen<'_>,
    reference: &FlightAnalysis,
    slot: Option<u16>,
    name: &str,
) -> Result<(DroneSeries, &'static str), String> {
    let Shared { input, .. } = shared;
    let (laws, mapping, calibration) = laws_for(reference, slot, name)
        .ok_or("the calibration has no law for it (neither its own nor the flock's)")?;
    let fit = shared
        .map_law
        .and_then(|law| law_fit(laws, law))
        .ok_or("the calibration has no fit of the law that the map uses")?;
    let looked = track::measuring(seen.targets);
    let hover = *looked.first().ok_or("no hover was found in the flight")?;
    if looked.iter().any(|target| target.kind == Kind::Horizontal) {
        let aware = shared.aware.as_ref().ok_or(
            "the drone moved, and a track is measured with a law that knows its errors: this \
             calibration allows none, or the paper's way was asked for",
        )?;
        let along = track::look(seen.flight, &looked, &shared.options.windows);
        let measured = aware.measure(seen.flight, &along, slot, name)?;
        let mapping = if measured.is_own { mapping } else { FLOCK };
        let systematic_mps = 2.0 * measured.errors.wind_mps;
        return Ok((track::series(seen.flight, &along, measured, systematic_mps), mapping));
    }
    if let Some(aware) = &shared.aware {
        let seconds = Hover::of(seen.flight, hover, &shared.options.windows);
        let measured = aware.measure(seen.flight, &seconds, slot, name)?;
        let mapping = if measured.is_own { mapping } else { FLOCK };
        let systematic_mps = 2.0 * measured.errors.wind_mps;
        let series = updraft::with_errors(seen.flight, hover, measured, systematic_mps);
        return Ok((series, mapping));
    }
    let window = seen.windows.iter().find(|window| {
        window.kind.is_hover() && window.start_s == hover.start_s && window.end_s == hover.end_s
    });
    if let Some(window) = window.filter(|window| !window.rejected.is_empty()) {
        let reasons: Vec<&str> = window.rejected.iter().map(|reason| reason.words()).collect();
        return Err(format!(
            "the hover from {:.0} to {:.0} s was rejected: {}",
            hover.start_s,
            hover.end_s,
            reasons.join(", ")
        ));
    }
    let length_s = hover.end_s - hover.start_s;
    if length_s < RUNNING_S {
        return Err(format!(
            "the hover is too short: its window has {length_s:.0} s, the running mean needs \
             {RUNNING_S:.0} s"
        ));
    }
    let leveled = input.leaning.map(|leaning| leaning.level_series(seen.flight, seen.corrected));
    let pulse_us = leveled.as_ref().unwrap_or(&seen.corrected.pulse_phi_us);
    let referred =
        input.density.map(|density| density.refer_series(pulse_us, &seen.flight.height_m));
    let pulse_us = referred.as_ref().unwrap_or(pulse_us);
    let lean = Lean { leaning: input.leaning, calibration };
    let series = updraft::estimate(seen.flight, pulse_us, hover, fit, lean)
        .ok_or("the hover has no 10 s without a gap in the log")?;
    Ok((series, mapping))
}

/// Windows from the plan's segments, checked against what was flown, or from the log itself.
fn find_targets(
    flight: &Flight,
    segments: Option<&[Segment]>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Target>, String> {
    let Some(segments) = segments else {
        if flight.desired_up_mps.is_none() {
            return Err("without a plan the windows come from the log's desired velocity, and it \
                        has none (GUIP, PSCD or CTUN); give the plan"
                .to_owned());
        }
        return Ok(windows::inferred(flight));
    };
    let targets = windows::planned(segments);
    if targets.is_empty() {
        return Err("the plan has no analysis windows for this slot: its legs and hovers are too \
                    short for one"
            .to_owned());
    }
    if flight.clock.method == Alignment::Takeoff {
        warnings
            .push("times count from take-off: windows may be shifted against the plan".to_owned());
    }
    windows::contradiction(flight, &targets)
        .or_else(|| track::contradiction(flight, segments))
        .map_or(Ok(targets), Err)
}

/// Mapping of a drone that has none of its own: `DroneUpdraft::mapping`.
pub(super) const FLOCK: &str = "flock";

/// A drone in a reference calibration: of the same slot, else of the same name.
pub(super) fn same_drone<'a>(
    reference: &'a FlightAnalysis,
    slot: Option<u16>,
    name: &str,
) -> Option<&'a DroneAnalysis> {
    let same = |drone: &&DroneAnalysis| match (slot, drone.slot) {
        (Some(slot), Some(other)) => slot == other,
        _ => drone.name == name,
    };
    reference.drones.iter().find(same)
}

/// The laws of a drone in a reference calibration, and its windows there: its own, else the flock's
/// with those of the first drone. A law of a part of the ladder stands only where there is no flock's.
fn laws_for<'a>(
    reference: &'a FlightAnalysis,
    slot: Option<u16>,
    name: &str,
) -> Option<(&'a Laws, &'static str, &'a [WindowStats])> {
    let whole = |drone: &DroneAnalysis| drone.partial_ladder.is_none() || reference.flock.is_none();
    let own = same_drone(reference, slot, name).filter(|drone| whole(drone));
    if let Some((drone, laws)) = own.and_then(|drone| Some((drone, drone.laws.as_ref()?))) {
        return Some((laws, "own", &drone.windows));
    }
    let first = reference.drones.iter().find(|drone| drone.laws.is_some() && whole(drone));
    Some((reference.flock.as_ref()?, FLOCK, first.map_or(&[][..], |drone| &drone.windows)))
}

pub(super) fn law_fit(laws: &Laws, law: MapLaw) -> Option<&Fit> {
    match law {
        MapLaw::Linear => laws.linear.as_ref(),
        MapLaw::SignedQuadratic => laws.signed_quadratic.as_ref(),
    }
}

/// Traces for figures: means over equal time steps.
fn trace(flight: &Flight, corrected: &Corrected, points: usize) -> Trace {
    let Some((start, end)) = flight.velocity_up_mps.span() else { return Trace::default() };
    let step = ((end - start) / points.max(1) as f64).max(0.1);
    let mut trace = Trace::default();
    for index in 0..points {
        let (from, to) = (start + index as f64 * step, start + (index + 1) as f64 * step);
        let mean = |values: &[f64]| (!values.is_empty()).then(|| mean_sd(values).0);
        let (Some(height), Some(velocity), Some(pulse)) = (
            mean(flight.height_m.between(from, to)),
            mean(flight.velocity_up_mps.between(from, to)),
            mean(corrected.pulse_phi_us.between(from, to)),
        ) else {
            continue;
        };
        trace.time_s.push(f64::midpoint(from, to));
        trace.height_m.push(height);
        trace.velocity_mps.push(velocity);
        trace.pulse_phi_us.push(pulse);
    }
    trace
}
