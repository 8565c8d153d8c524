//! Analysis of one log of a flight: windows, laws and (with reference laws) the air.

use super::aware::Aware;
use super::beside::Beside;
use super::budget::QualityFlag;
use super::calibrate::{self, CalibrationError, FitOptions, Hold};
use super::cause::Cause;
use super::caution::steep;
use super::corrections::Corrections;
use super::held_hover;
use super::hover::Hover;
use super::input::{AtHand, FlightInput, LogInput, TruthSeries};
use super::law::{LawKind, LawOf};
use super::levelled;
use super::map_statistics::HoverSeen;
use super::offset::OffsetMap;
use super::options::AnalysisOptions;
use super::reference::laws_for;
use super::result::{DroneAnalysis, FlightAnalysis, Laws, Trace, WindowStats};
use super::running::{GAP_S, RUNNING_S, Running};
use super::statistics::tilt_wind::LeanDrag;
use super::stats::mean_sd;
use super::steps::{steady, steady_across_holes};
use super::track;
use super::turbulence::Records;
use super::updraft::{self, DroneSeries, Lean};
use super::warning::Warning;
use super::windows::{self, Corrected, Target};
use crate::base::causes::with_causes;
use crate::base::plain::{Shown as _, plain};
use crate::flight::{Alignment, Flight, FlightOptions, Loss, Series, table};
use crate::mission::plan::{Purpose, Segment, Slot};

/// Stretches without values that are told one by one.
const MOST_STRETCHES: usize = 4;

/// What all logs of a flight share.
pub(super) struct Shared<'a> {
    pub(super) input: &'a FlightInput<'a>,
    pub(super) options: &'a AnalysisOptions,
    pub(super) reference: Option<&'a FlightAnalysis>,
    /// The reference with its laws referred to the density at the ground, for the map.
    pub(super) map_reference: Option<&'a FlightAnalysis>,
    pub(super) planned_purpose: Option<Purpose>,
    pub(super) map_law: Option<LawKind>,
    pub(super) corrections: Corrections<'a>,
    /// The calibration with what it tells about errors, for the map.
    pub(super) aware: Option<Aware<'a>>,
}

impl<'a> Shared<'a> {
    /// What makes the drones lean in wind.
    pub(super) fn drag(&self) -> LeanDrag<'a> {
        match (self.input.leaning, self.corrections.lean_table) {
            (Some(leaning), _) => LeanDrag::Faces(leaning.drag_speed_mps),
            (None, Some(table)) => LeanDrag::Table(table),
            (None, None) => LeanDrag::Unknown,
        }
    }
}

/// What one log gave.
pub(super) struct One {
    pub(super) drone: DroneAnalysis,
    /// What the log lacks.
    pub(super) losses: Vec<Loss>,
    /// Bytes of the log that its reader skipped.
    pub(super) skipped_bytes: u64,
    pub(super) calibration: Result<Laws, CalibrationError>,
    /// The air, with the mapping used; or why there is none. `None` without reference laws.
    pub(super) updraft: Option<Result<(DroneSeries, LawOf), Cause>>,
    /// Its hover, for the statistics.
    pub(super) hover: HoverSeen,
    /// Place of its first fix: (latitude, longitude), degrees.
    pub(super) first_fix_deg: Option<(f64, f64)>,
    /// What something beside the drone measured of the air.
    pub(super) truth: Option<TruthSeries>,
}

/// Everything about one log.
pub(super) fn one(shared: &Shared<'_>, log: &LogInput, slot: Option<u16>) -> Result<One, Cause> {
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
    let unusable = |error: &dyn std::error::Error| {
        let said = with_causes(error, ": ");
        Cause::of_log(&said, &log.path.shown().to_string(), &input.shown(&log.path))
    };
    let opened;
    let flight = match (&log.at_hand, &log.table) {
        (Some(AtHand(flight)), _) => &**flight,
        (None, Some(mapping)) => {
            opened = table::read(&log.path, mapping).map_err(|error| unusable(&error))?;
            &opened
        }
        (None, None) => {
            opened = Flight::open(&log.path, flight_options).map_err(|error| unusable(&error))?;
            &opened
        }
    };
    let mut warnings: Vec<Warning> = flight.warnings.iter().cloned().map(Warning::Log).collect();

    let targets = match &log.table {
        Some(mapping) if flight.desired_up_mps.is_none() => steady(flight, &mapping.steps),
        _ => find_targets(flight, slot.map(|(_, segments)| segments), &mut warnings)?,
    };
    let elsewhere = elsewhere(flight, &targets);
    if let Some(cause @ Cause::EndsBefore { .. }) = elsewhere {
        return Err(cause);
    }
    warnings.extend(elsewhere.clone().map(Warning::NothingOfPlan));
    let corrected = windows::correct_tilt(flight, &options.windows);
    let mut stats = windows::measure(flight, &corrected, &targets, &options.windows);
    let offset = options
        .offset
        .is_subtracted(input.true_updraft_mps)
        .then(|| OffsetMap::subtract(&mut stats, options.fit.location))
        .flatten();

    let name = match slot {
        Some((slot, _)) => slot.name.clone(),
        None => plain(&log.path.file_stem().unwrap_or_default().to_string_lossy()).into_owned(),
    };
    if log.table.is_some() {
        warnings.extend(steep(flight, &name));
    }
    let number = slot.map(|(slot, _)| slot.slot);
    let reference = shared.reference.and_then(|reference| laws_for(reference, number, &name));
    let hold = options.fit.hold.or_else(|| Hold::from_laws(reference.map(|(laws, _, _)| laws)?));
    let calibration = calibrate::calibrate(&stats, &FitOptions { hold, ..options.fit });
    let mut of_air = match (slot, &log.table) {
        (Some((_, segments)), None) => windows::of_air(segments),
        (_, Some(mapping)) if flight.desired_up_mps.is_none() => {
            steady_across_holes(flight, &mapping.steps)
        }
        _ => targets.clone(),
    };
    let truth = true_air(flight, &of_air);
    let left = held_hover::end_where_left(flight, &mut of_air);
    let seen = Seen { flight, corrected: &corrected, targets: &of_air, windows: &stats };
    let measures = shared.planned_purpose != Some(Purpose::Calibration);
    let mut updraft = match (input.level.filter(|_| measures), shared.map_reference, &elsewhere) {
        (None, None, _) => None,
        (_, _, Some(reason)) => Some(Err(reason.clone())),
        (Some(level), ..) => {
            Some(levelled::measure(shared, level, flight, &of_air, (number, &name)))
        }
        (None, Some(reference), None) => Some(measure(shared, &seen, reference, number, &name)),
    };
    if let Some(Ok((series, _))) = &mut updraft
        && let Some(measured) = &mut series.measured
    {
        measured.quality.extend(left);
        warnings.extend(truth.as_ref().and_then(truth_in_part));
        if input.level.is_some() {
            warnings.extend(shorter_hovers(&of_air));
            warnings.extend(silent_stretches(&measured.quality));
        }
    }
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
        line: None,
        partial_ladder: None,
        trace: trace(flight, &corrected, options.trace_points),
        warnings,
    };
    let (losses, skipped_bytes) = (flight.losses(), flight.scan.bad_bytes);
    let beside = match &updraft {
        Some(Ok((series, _))) => Beside::of(flight, series, shared.drag()),
        _ => Beside::default(),
    };
    let mut hover = HoverSeen::of(flight, &corrected, &of_air);
    hover.beside = beside;
    if let Some(Ok((series, _))) = &updraft {
        hover.records = Records::of(shared, flight, series, (number, &drone.name));
    }
    let first_fix_deg = flight.first_fix_deg;
    Ok(One { drone, losses, skipped_bytes, calibration, updraft, hover, first_fix_deg, truth })
}

/// That none of the windows lies in the time that the log speaks of.
fn elsewhere(flight: &Flight, targets: &[Target]) -> Option<Cause> {
    let (from, to) = flight.velocity_up_mps.span()?;
    let (first, last) = (targets.first()?, targets.last()?);
    let apart = targets.iter().all(|target| target.end_s < from || target.start_s > to);
    let (log_s, plan_s) = ([from, to], [first.start_s, last.end_s]);
    // The clock of a log that reaches into its show is right: the flight was short, or its log is.
    let is_short = (0.0..first.start_s).contains(&to);
    apart.then_some(if is_short {
        let height_m = flight.cut_off_at_m;
        Cause::EndsBefore { end_s: to, first_s: first.start_s, height_m }
    } else {
        Cause::OtherTime { log_s, plan_s }
    })
}

/// The true air over the hover as the map sees it: means over the 10 s around each second.
fn true_air(flight: &Flight, targets: &[Target]) -> Option<TruthSeries> {
    let (truth, hover) = (flight.truth_up_mps.as_ref()?, updraft::hover(targets)?);
    let running = Running::new(truth, hover.start_s, hover.end_s);
    let half = RUNNING_S / 2.0;
    let (first_s, last_s) =
        ((hover.start_s + half).ceil() as i64, (hover.end_s - half).floor() as i64);
    let updraft_mps =
        (first_s..=last_s).map(|time| running.mean(time as f64).unwrap_or(f64::NAN)).collect();
    Some(TruthSeries { first_s, updraft_mps })
}

/// That the true air is not known in all seconds of the hover.
fn truth_in_part(truth: &TruthSeries) -> Option<Warning> {
    let [known, of] = truth.known();
    let compared = match known {
        0 => "nothing is compared with it".to_owned(),
        _ => "the others are not compared with it".to_owned(),
    };
    (known < of).then(|| {
        let text = format!(
            "truth: its means over {RUNNING_S:.0} s are known in {known} of {of} s of the hover, as a silence of more than \
             {GAP_S:.0} s leaves none: {compared}"
        );
        Warning::Log(text.into())
    })
}

/// The stretches of a hover that have no value, with the reason of each.
fn silent_stretches(quality: &[QualityFlag]) -> Option<Warning> {
    let all: Vec<&str> = quality
        .iter()
        .filter(|flag| flag.flag.excludes())
        .map(|flag| flag.reason.as_str())
        .collect();
    let more = match all.len().saturating_sub(MOST_STRETCHES) {
        0 => String::new(),
        more => format!("; {more} more stretches are in the report"),
    };
    let told: Vec<&str> = all.iter().take(MOST_STRETCHES).copied().collect();
    let text = format!("hover: {}{more}", told.join("; "));
    (!all.is_empty()).then(|| Warning::Log(text.into()))
}

/// That a map is of the longest hover alone, where there are others that could have values.
fn shorter_hovers(targets: &[Target]) -> Option<Warning> {
    let longest = updraft::hover(targets)?;
    let of = |target: &Target| format!("{:.0} to {:.0} s", target.start_s, target.end_s);
    let others: Vec<String> = targets
        .iter()
        .filter(|target| target.kind.is_hover() && *target != longest)
        .filter(|target| target.end_s - target.start_s >= RUNNING_S)
        .map(of)
        .collect();
    let text = format!(
        "hover: of several the longest alone is measured, from {}; not used: from {} (a climb or a descent, or another \
         height behind a hole of the table, ends a hover)",
        of(longest),
        others.join(", from ")
    );
    (!others.is_empty()).then(|| Warning::Log(text.into()))
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
) -> Result<(DroneSeries, LawOf), Cause> {
    let Shared { input, .. } = shared;
    let (laws, mapping, calibration) = laws_for(reference, slot, name).ok_or(Cause::NoLaw)?;
    let fit = shared.map_law.and_then(|law| laws.of(law)).ok_or(Cause::NoFit)?;
    let looked = track::measuring(seen.targets, |target| track::height_m(seen.flight, target));
    let hover = *looked.first().ok_or(Cause::NoHover)?;
    if track::is_track(&looked) {
        let aware = shared.aware.as_ref().ok_or(Cause::TrackWithoutErrors)?;
        let along = track::look(seen.flight, &looked, &shared.options.windows);
        let measured = aware.measure(seen.flight, &along, slot, name)?;
        let mapping = if measured.is_own { mapping } else { LawOf::Flock };
        let systematic_mps = 2.0 * measured.errors.wind_mps;
        return Ok((track::series(seen.flight, &along, measured, systematic_mps), mapping));
    }
    if let Some(aware) = &shared.aware {
        let seconds = Hover::of(seen.flight, hover, &shared.options.windows);
        let measured = aware.measure(seen.flight, &seconds, slot, name)?;
        let mapping = if measured.is_own { mapping } else { LawOf::Flock };
        let systematic_mps = 2.0 * measured.errors.wind_mps;
        let series = updraft::with_errors(seen.flight, hover, measured, systematic_mps);
        return Ok((series, mapping));
    }
    let window = seen.windows.iter().find(|window| {
        window.kind.is_hover() && window.start_s == hover.start_s && window.end_s == hover.end_s
    });
    if let Some(window) = window.filter(|window| !window.rejected.is_empty()) {
        return Err(Cause::Rejected {
            track: false,
            from_to_s: [hover.start_s, hover.end_s],
            reasons: window.rejected.iter().map(|reason| reason.words()).collect(),
        });
    }
    let length_s = hover.end_s - hover.start_s;
    if length_s < RUNNING_S {
        return Err(Cause::TooShort { length_s });
    }
    let leveled = input.leaning.map(|leaning| leaning.level_series(seen.flight, seen.corrected));
    let pulse_us = leveled.as_ref().unwrap_or(&seen.corrected.effort);
    let referred =
        input.density.map(|density| density.refer_series(pulse_us, &seen.flight.height_m));
    let pulse_us = referred.as_ref().unwrap_or(pulse_us);
    let lean = Lean { leaning: input.leaning, calibration };
    let series = updraft::estimate(seen.flight, pulse_us, hover, fit, lean).ok_or(Cause::Gaps)?;
    Ok((series, mapping))
}

/// Windows from the plan's segments, checked against what was flown, or from the log itself.
fn find_targets(
    flight: &Flight,
    segments: Option<&[Segment]>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Target>, Cause> {
    let Some(segments) = segments else {
        if flight.desired_up_mps.is_none() {
            return Err(Cause::NoCommands);
        }
        return Ok(windows::inferred(flight));
    };
    let targets = windows::planned(segments);
    if targets.is_empty() {
        return Err(Cause::NoWindows);
    }
    if flight.clock.method == Alignment::Takeoff {
        warnings.push(Warning::TakeoffClock);
    }
    windows::contradiction(flight, &targets)
        .or_else(|| track::contradiction(flight, segments))
        .map_or(Ok(targets), Err)
}

/// Traces for figures: means over equal time steps.
fn trace(flight: &Flight, corrected: &Corrected, points: usize) -> Trace {
    let Some((start, end)) = flight.velocity_up_mps.span() else { return Trace::default() };
    let step = ((end - start) / points.max(1) as f64).max(0.1);
    let mut trace = Trace::default();
    let home = |series: &Series| series.value.first().copied();
    let home = home(&flight.north_m).zip(home(&flight.east_m));
    for index in 0..points {
        let (from, to) = (start + index as f64 * step, start + (index + 1) as f64 * step);
        let mean = |values: &[f64]| (!values.is_empty()).then(|| mean_sd(values).0);
        let (Some(height), Some(velocity), Some(pulse)) = (
            mean(flight.height_m.between(from, to)),
            mean(flight.velocity_up_mps.between(from, to)),
            mean(corrected.effort.between(from, to)),
        ) else {
            continue;
        };
        trace.time_s.push(f64::midpoint(from, to));
        trace.height_m.push(height);
        trace.velocity_mps.push(velocity);
        trace.pulse_phi_us.push(pulse);
        let moved = |series: &Series| mean(series.between(from, to));
        let place = moved(&flight.north_m).zip(moved(&flight.east_m)).zip(home);
        trace.moved_m.push(place.map(|((north, east), home)| {
            [north - home.0, east - home.1].map(|m| (m * 100.0).round() / 100.0)
        }));
    }
    if trace.moved_m.iter().all(Option::is_none) {
        trace.moved_m.clear();
    }
    trace
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::plan::SegmentKind;

    /// Why a log from and to these times, s, that ends at this height, holds nothing of a window from 47 to 156 s.
    fn why(from_s: f64, to_s: f64, cut_off_at_m: Option<f64>) -> Option<String> {
        let velocity_up_mps = Series { time_s: vec![from_s, to_s], value: vec![0.0; 2] };
        let flight = Flight { velocity_up_mps, cut_off_at_m, ..Flight::default() };
        let window = Target {
            kind: SegmentKind::Hover,
            label: "hover".to_owned(),
            start_s: 47.0,
            end_s: 156.0,
            commanded_mps: 0.0,
        };
        elsewhere(&flight, &[window]).map(|cause| cause.to_string())
    }

    #[test]
    fn a_log_that_ends_before_the_first_window_has_no_wrong_clock() {
        assert_eq!(
            why(-6.0, 13.0, Some(27.3)).unwrap(),
            "the log ends in the air, 27.3 m above the ground, 13.0 s after the show's start, before the plan's \
             first window (from 47 s): there is nothing to measure in it"
        );
        assert_eq!(
            why(-6.0, 40.0, None).unwrap(),
            "the flight ends 40.0 s after the show's start, before the plan's first window (from 47 s): there is \
             nothing to measure in it"
        );
        for (from_s, to_s) in [(3594.0, 3682.0), (-3606.0, -3518.0)] {
            let said = why(from_s, to_s, None).unwrap();
            assert!(said.contains("the drone's clock jumped or was set wrong"), "{said}");
        }
        assert_eq!(why(-6.0, 60.0, Some(20.0)), None, "a part of the window is there");
    }
}
