//! Words of a calibration's first line: the law that its windows prefer, and its updraft against another
//! calibration.

use crate::analysis::LawKind;
use crate::analysis::law::Symbol;
use crate::analysis::result::{BentLine, DroneAnalysis, Fit, FlightAnalysis, HeldCurve};
use crate::base::estimate::Estimate;
use crate::flight::Indicator;

use super::law;
use super::text::{NONE, clean, estimate, fixed, signed, unit, usable};

/// The bent line of a flight that is told before the paper's laws: one that bends by more than chance.
pub(super) fn bent_line(flight: &FlightAnalysis) -> Option<&BentLine> {
    flight.headline.as_ref()?.line.as_ref().filter(|line| line.is_bent() && usable(line.u0.value))
}

/// The law that a flight's numbers are read from, where its windows tell it beyond the paper's chi².
pub(super) fn preferred(flight: &FlightAnalysis) -> Option<LawKind> {
    Some(flight.headline.as_ref()?.law)
}

/// The bent line in words; `None` where another law is the headline.
pub(super) fn bent_words(flight: &FlightAnalysis) -> Option<String> {
    let line = bent_line(flight)?;
    let effort = unit(flight.indicator.unit());
    let [low, high] = line.speeds_mps;
    Some(format!(
        "the windows prefer a line that bends: u₀ = {} {effort} and A′ = {} {effort}/(m/s) in hover, {} at \
         {} m/s and {} at {} m/s",
        estimate(line.u0),
        estimate(line.slope),
        fixed(line.slope_at(low), 1),
        signed(low, 1),
        fixed(line.slope_at(high), 1),
        signed(high, 1),
    ))
}

/// Constant and slope in hover of a drone's own bent line, in words.
pub(super) fn bent_cells(flight: &FlightAnalysis, drone: &DroneAnalysis) -> [String; 2] {
    let line = drone.line.filter(|_| bent_line(flight).is_some());
    let cell = |of: fn(&BentLine) -> Estimate| {
        line.as_ref().map_or_else(|| NONE.to_owned(), |line| estimate(of(line)))
    };
    [cell(|line| line.u0), cell(|line| line.slope)]
}

/// Heads of [`bent_cells`].
pub(super) fn bent_heads(indicator: Indicator) -> [String; 2] {
    let effort = unit(indicator.unit());
    [format!("u₀ in hover ({effort})"), format!("A′ in hover ({effort}/(m/s))")]
}

/// The updraft of a flight with the calibration's own curve held, if it was.
pub(super) fn held(flight: &FlightAnalysis) -> Option<&HeldCurve> {
    law::flight_laws(flight)?.held.as_ref()
}

/// The same in words.
pub(super) fn held_words(flight: &FlightAnalysis) -> Option<String> {
    let held = held(flight)?;
    let doubt = held.doubt.as_deref().map(clean);
    let Some((w, [low, high])) = held.updraft.zip(held.interval_mps) else {
        return Some(format!(
            "against the calibration's own curve: {}",
            doubt.unwrap_or_else(|| "W is not determined".to_owned())
        ));
    };
    let doubt = doubt.map_or_else(String::new, |doubt| format!("; {doubt}"));
    let of =
        if held.calibration_w_mps.is_some() { "" } else { " relative to the calibration's air" };
    Some(format!(
        "against the calibration's own curve: W = {} m/s{of} (95 %: {} to {} m/s){doubt}",
        estimate(w),
        signed(low, 3),
        signed(high, 3),
    ))
}

/// One drone's updraft against the calibration, in words.
pub(super) fn held_cell(drone: &DroneAnalysis) -> String {
    match drone.laws.as_ref().and_then(|laws| laws.held.as_ref()) {
        Some(HeldCurve { updraft: Some(w), .. }) => estimate(*w),
        Some(_) => "not determined".to_owned(),
        None => NONE.to_owned(),
    }
}

/// Nearer to the edge of what was searched, a fit's W is the edge, m/s: two steps of the search.
const AT_EDGE_MPS: f64 = 0.1;

/// Where a fit's W lies, if it ended at the edge of what was searched: `below −8`.
pub(super) fn beyond(fit: &Fit) -> Option<String> {
    let edge = fit.w_beyond_mps?;
    let w = fit.value(Symbol::W)?;
    if (w - edge).abs() > AT_EDGE_MPS && w.abs() < edge.abs() {
        return None;
    }
    let word = if edge < 0.0 { "below" } else { "above" };
    Some(format!("{word} {}", signed(edge, 0)))
}
