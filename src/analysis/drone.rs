//! One log of a flight: windows, laws and (with reference laws) the air.

use super::analyze::{AnalysisOptions, FlightInput, LogInput, MapLaw};
use super::calibrate::{self, CalibrationError, FitOptions, Hold};
use super::result::{DroneAnalysis, Fit, FlightAnalysis, Laws, Trace};
use super::stats::mean_sd;
use super::updraft::{self, DroneSeries};
use super::windows::{self, Corrected, Target};
use crate::base::causes::with_causes;
use crate::flight::{Alignment, Flight, FlightOptions};
use crate::mission::plan::{Purpose, Segment, Slot};

/// What all logs of a flight share.
pub(super) struct Shared<'a> {
    pub(super) input: &'a FlightInput<'a>,
    pub(super) options: &'a AnalysisOptions,
    pub(super) reference: Option<&'a FlightAnalysis>,
    /// The reference with its laws referred to the density at the ground, for the map.
    pub(super) map_reference: Option<&'a FlightAnalysis>,
    pub(super) planned_purpose: Option<Purpose>,
    pub(super) map_law: Option<MapLaw>,
}

/// What one log gave.
pub(super) struct One {
    pub(super) drone: DroneAnalysis,
    /// Why the log lacks the flight's end.
    pub(super) cut_off: Option<String>,
    pub(super) calibration: Result<Laws, CalibrationError>,
    pub(super) updraft: Option<(DroneSeries, &'static str)>,
}

/// Everything about one log.
pub(super) fn one(shared: &Shared<'_>, log: &LogInput, slot: Option<u16>) -> Result<One, String> {
    let Shared { input, options, .. } = shared;
    let slot: Option<(&Slot, &[Segment])> = slot.and_then(|number| {
        let plan = input.plan?;
        let slot = plan.slot(number)?;
        Some((slot, plan.segments(slot)))
    });
    let flight_options =
        FlightOptions { start: input.start, segments: slot.map(|(_, segments)| segments) };
    let flight =
        Flight::open(&log.path, flight_options).map_err(|error| with_causes(&error, ": "))?;
    let mut warnings = flight.warnings.clone();

    let targets = find_targets(&flight, slot.map(|(_, segments)| segments), &mut warnings)?;
    let corrected = windows::correct_tilt(&flight, options.windows.tilt);
    let stats = windows::measure(&flight, &corrected, &targets, &options.windows);

    let name = match slot {
        Some((slot, _)) => slot.name.clone(),
        None => log.path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    };
    let number = slot.map(|(slot, _)| slot.slot);
    let reference = shared.reference.and_then(|reference| laws_for(reference, number, &name));
    let hold = options.fit.hold.or_else(|| Hold::from_laws(reference.map(|(laws, _)| laws)?));
    let calibration = calibrate::calibrate(&stats, &FitOptions { hold, ..options.fit });
    let map_laws = shared.map_reference.and_then(|reference| laws_for(reference, number, &name));
    let updraft = map_laws.and_then(|(laws, mapping)| {
        let fit = law_fit(laws, shared.map_law?)?;
        let hover = updraft::hover(&targets)?;
        let referred = input
            .density
            .map(|density| density.refer_series(&corrected.pulse_phi_us, &flight.height_m));
        let pulse_us = referred.as_ref().unwrap_or(&corrected.pulse_phi_us);
        Some((updraft::estimate(&flight, pulse_us, hover, fit)?, mapping))
    });
    let source = input.shown(&log.path);
    let cut_off = flight.cut_off_at_m.map(|height| {
        format!(
            "the log ends in the air, {height:.1} m above the ground; what it holds is analysed"
        )
    });
    let drone = DroneAnalysis {
        slot: number,
        name,
        source,
        home_m: slot.map(|(slot, _)| [slot.home_m[0], slot.home_m[1]]),
        clock: flight.clock.clone(),
        windows: stats,
        laws: None,
        trace: trace(&flight, &corrected, options.trace_points),
        warnings,
    };
    Ok(One { drone, cut_off, calibration, updraft })
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
        return Err("the plan has no analysis windows for this slot".to_owned());
    }
    if flight.clock.method == Alignment::Takeoff {
        warnings
            .push("times count from take-off: windows may be shifted against the plan".to_owned());
    }
    windows::contradiction(flight, &targets).map_or(Ok(targets), Err)
}

/// The laws of a drone in a reference calibration: its own, else the flock's.
fn laws_for<'a>(
    reference: &'a FlightAnalysis,
    slot: Option<u16>,
    name: &str,
) -> Option<(&'a Laws, &'static str)> {
    let same = |drone: &&DroneAnalysis| match (slot, drone.slot) {
        (Some(slot), Some(other)) => slot == other,
        _ => drone.name == name,
    };
    let own = reference.drones.iter().find(same).and_then(|drone| drone.laws.as_ref());
    own.map(|laws| (laws, "own")).or_else(|| Some((reference.flock.as_ref()?, "flock")))
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
