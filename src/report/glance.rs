//! The numbers that matter, at the top of the page, and a sentence of statistics for each flight.

use std::fmt::Write as _;

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::law::Symbol;
use crate::analysis::result::{Analysis, FlightAnalysis, UpdraftMap};
use crate::analysis::table::{Quantity, TableLaw};
use crate::analysis::{LawKind, prefer};
use crate::base::estimate::Estimate;

use super::compare::{better_words, drones_of, flags};
use super::figures::air;
use super::fleet_air::fleet_air;
use super::headline;
use super::law;
use super::opening::SUMMED_FLIGHTS;
use super::page::capitalised;
use super::posterior;
use super::text::{clean, count, decimal_places, error_of, fixed, signed, unit, usable, value_of};

/// Label of a W* that is none.
const VERTEX: &str = "vertex of the fitted parabola, no air speed";

/// The numbers at a glance.
pub(super) fn tiles(analysis: &Analysis) -> Vec<Value> {
    let mut tiles = Vec::new();
    let mut tile = |value: String, label: String, note: String| {
        tiles.push(context! { value, label, note });
    };
    let logs = |flights: &[FlightAnalysis]| {
        let have: usize = flights.iter().map(|flight| flight.drones.len()).sum();
        let missing: usize = flights.iter().map(|flight| flight.missing.len()).sum();
        let note =
            if missing == 0 { "none missing".to_owned() } else { format!("{missing} missing") };
        (format!("{have}/{}", have + missing), note)
    };
    if analysis.flights.len() > SUMMED_FLIGHTS {
        let (value, note) = logs(&analysis.flights);
        tile(value, format!("logs, {}", count(analysis.flights.len(), "flight")), note);
    } else {
        for flight in &analysis.flights {
            let (value, note) = logs(std::slice::from_ref(flight));
            tile(value, format!("drones, {}", clean(&flight.name)), note);
        }
    }
    let mut fitted = analysis.flights.iter().map(fleet_values).filter(|values| !values.is_empty());
    if let (Some(values), None) = (fitted.next(), fitted.next()) {
        for (label, of, unit) in values {
            tile(value_of(of), label, format!("± {} {unit}", error_of(of)));
        }
    }
    for flight in &analysis.flights {
        if let Some(w) = headline::held(flight).and_then(|held| held.updraft) {
            let label = format!("W against the calibration, {}", clean(&flight.name));
            tile(value_of(w), label, format!("± {} m/s", error_of(w)));
        }
    }
    if let Some((rms, fits)) = fit_error(analysis) {
        let note = format!("m/s, {}", count(fits, "fit"));
        tile(fixed(rms, 3), "rms of W* − true W".to_owned(), note);
    }
    for flight in &analysis.flights {
        for (value, label, note) in air_tiles(flight) {
            tile(value, label, note.replace("95 %", "95\u{a0}%"));
        }
    }
    tiles
}

/// An error that is so much larger than another is told with its reason.
const WIDER: f64 = 1.5;

/// Tiles of a map: all drones together where there is a posterior, and then each drone alone beside it.
fn air_tiles(flight: &FlightAnalysis) -> Vec<(String, String, String)> {
    let Some((map, air)) = flight.map.as_ref().and_then(|map| Some((map, fleet_air(map)?))) else {
        return Vec::new();
    };
    let mut tiles = Vec::new();
    let name = clean(&flight.name);
    let together = posterior::fleet(map);
    if let Some(fleet) = together {
        tiles.push((
            signed(fleet.value, decimal_places(fleet)),
            format!("mean vertical air speed, {name}: all drones together"),
            format!("± {} m/s; {}", error_of(fleet), posterior::interval(fleet)),
        ));
    }
    let spread = air.spread_words().map_or_else(String::new, |spread| format!("; {spread}"));
    let whose = if together.is_some() { ": each drone alone, averaged" } else { "" };
    let wider = if together.is_some_and(|fleet| fleet.se > WIDER * air.error.se) {
        "; the wider interval counts: it has the calibration's air, too"
    } else {
        ""
    };
    tiles.push((
        signed(air.mean, decimal_places(Estimate::new(air.mean, air.error.se))),
        format!("mean vertical air speed, {name}{whose}"),
        format!("{}{spread}{wider}", air.error.words(2)),
    ));
    if let Some(alone) = air.rms_error {
        // Of values over 10 s it is another number, which the text below the map tells.
        let of = if air.n == 1 {
            "of the drone's mean".to_owned()
        } else {
            format!("of the means of {} places", air.n)
        };
        let label = format!("rms error {of}{}", air::where_compared(map));
        let against = if flight.simulated { "simulated air" } else { "instrument's values" };
        tiles.push(match together.and_then(|_| together_error(map)) {
            Some(error) => (
                fixed(error, 2),
                format!("{label}: all drones together"),
                format!("m/s, against the {against}; each drone alone: {}", fixed(alone, 2)),
            ),
            None => (fixed(alone, 2), label, format!("m/s, against the {against}")),
        });
    }
    tiles
}

/// Root mean square over drones of the posterior's mean minus the true mean, m/s.
fn together_error(map: &UpdraftMap) -> Option<f64> {
    let squares = map.drones.iter().filter_map(|drone| {
        let error = drone.posterior_mean?.value - air::mean_truth(drone)?;
        usable(error).then_some(error * error)
    });
    air::mean(squares).map(f64::sqrt)
}

/// Root mean square of fitted minus true updraft over all fits of several calibrations, and their
/// number.
fn fit_error(analysis: &Analysis) -> Option<(f64, usize)> {
    let calibrations: Vec<&FlightAnalysis> = analysis
        .flights
        .iter()
        .filter(|flight| flight.true_updraft_mps.is_some() && flight.map.is_none())
        .collect();
    if calibrations.len() < 2 {
        return None;
    }
    let errors = || {
        calibrations.iter().flat_map(|flight| {
            let truth = flight.true_updraft_mps.unwrap_or(f64::NAN);
            flight.drones.iter().filter_map(move |drone| {
                let fit = law::signed_quadratic(drone.laws.as_ref()?);
                let error = fit.filter(|fit| fit.w_beyond_mps.is_none())?.value(Symbol::W)? - truth;
                usable(error).then_some(error * error)
            })
        })
    };
    air::mean(errors()).map(|mean| (mean.sqrt(), errors().count()))
}

/// The fleet's parameters for the tiles: from its table, else from the laws of the flight.
fn fleet_values(flight: &FlightAnalysis) -> Vec<(String, Estimate, String)> {
    if let Some(line) = headline::bent_line(flight) {
        let unit = unit(&Symbol::Slope.unit(flight.indicator));
        return vec![("A′ in hover, line that bends".to_owned(), line.slope, unit)];
    }
    let laws = law::flight_laws(flight);
    let vertex = law::vertex_mps(flight).is_some();
    // The numbers of the law that describes the flight; the other one's would only mislead.
    let better = headline::preferred(flight)
        .or_else(|| laws.and_then(prefer::better_of))
        .unwrap_or(LawKind::SignedQuadratic);
    let (table_law, wanted): (_, &[(Symbol, &str)]) = match better {
        LawKind::Linear => (TableLaw::Linear, &[(Symbol::Slope, "A′, linear law")]),
        LawKind::SignedQuadratic => (
            TableLaw::SignedQuadratic,
            &[(Symbol::A, "A, quadratic law"), (Symbol::W, "W* in the fits")],
        ),
    };
    wanted
        .iter()
        .filter_map(|&(symbol, label)| {
            let of_row = Quantity::Parameter(symbol);
            let row = flight
                .table
                .iter()
                .find(|row| row.law == table_law && row.parameter == of_row && row.n > 1)
                .map(|row| (Estimate::new(row.mean, row.sd), unit(&row.unit)));
            let own = || {
                let fit = law::fit_of(laws?, better).filter(|fit| fit.w_beyond_mps.is_none())?;
                let found = fit.parameter(symbol)?;
                Some((found.estimate, unit(&found.unit)))
            };
            let (of, unit) = row.or_else(own)?;
            let label = if vertex && symbol == Symbol::W { VERTEX } else { label };
            usable(of.value).then(|| (label.to_owned(), of, unit))
        })
        .collect()
}

/// A flight in a sentence of statistics, below its heading.
pub(super) fn summary(flight: &FlightAnalysis) -> String {
    let mut text = format!("{} analysed", capitalised(&drones_of(flight)));
    let fitted = flight.drones.iter().filter(|drone| drone.laws.is_some()).count();
    if fitted > 0 {
        let _ = write!(text, ", laws fitted for {fitted}");
    }
    if let Some(words) = better_words(flight) {
        let _ = write!(text, ", {words}");
    }
    if let Some(words) = headline::held_words(flight) {
        let _ = write!(text, ", {words}");
    }
    if let Some(air) = flight.map.as_ref().and_then(fleet_air) {
        let _ = if air.n == 1 {
            write!(text, ", vertical air speed {} m/s", signed(air.mean, 2))
        } else {
            write!(
                text,
                ", vertical air speed from {} to {} m/s over the grid (each drone alone)",
                signed(air.lowest, 2),
                signed(air.highest, 2),
            )
        };
    }
    if let Some(words) = flight.map.as_ref().and_then(posterior::headline) {
        let _ = write!(text, ", {words}");
    }
    let noted = flight.drones.iter().filter(|drone| !flags(drone).is_empty()).count();
    if noted > 0 {
        let _ = write!(text, ", {} with notes", count(noted, "drone"));
    }
    if !flight.unmeasured.is_empty() {
        let _ = write!(
            text,
            ", {} without a value in the map",
            count(flight.unmeasured.len(), "drone")
        );
    }
    text.push('.');
    text
}
