//! Fleet tables beside the paper's values, and the words that a page and a terminal share.

use crate::analysis::law::Symbol;
use crate::analysis::result::{Analysis, DroneAnalysis, Fit, FlightAnalysis, Laws, TableRow};
use crate::analysis::table::PaperTable;
use crate::analysis::{LawKind, Warning, prefer};
use crate::base::estimate::Estimate;
use crate::flight::{self, Alignment};
use crate::mission::plan::Purpose;

use super::headline;
use super::law;
use super::text::{
    NONE, clean, count, estimate, fixed, quantity, reduced, rejection, signed, symbol, unit, usable,
};

/// Cell of a number that the data do not determine.
const UNKNOWN: &str = "not determined";
/// A reduced chi² up to this needs no explanation.
const GOOD_CHI2: f64 = 1.5;

/// A row of Table I or II in words.
pub(super) struct Comparison {
    pub(super) law: &'static str,
    pub(super) parameter: &'static str,
    pub(super) unit: String,
    /// Mean and standard deviation between drones.
    pub(super) fleet: String,
    /// Mean standard error of one drone's fit.
    pub(super) mean_se: String,
    pub(super) n: usize,
    pub(super) paper: String,
    /// Ours minus the paper's.
    pub(super) difference: String,
    /// Ours minus the paper's, in standard errors of the paper.
    pub(super) in_errors: String,
}

/// The row in words.
pub(super) fn comparison(row: &TableRow) -> Comparison {
    let paper = row.paper.filter(|paper| usable(paper.value));
    let gap = paper
        .filter(|_| row.not_compared.is_none())
        .map(|paper| row.mean - paper.value)
        .filter(|gap| usable(*gap));
    let in_errors = paper
        .filter(|paper| usable(paper.se) && paper.se > 0.0)
        .and_then(|paper| gap.map(|gap| gap / paper.se));
    let unit = unit(&row.unit);
    Comparison {
        law: row.law.name(),
        parameter: quantity(row.parameter),
        unit: if unit.is_empty() { NONE.to_owned() } else { unit },
        fleet: if row.n > 1 {
            estimate(Estimate::new(row.mean, row.sd))
        } else {
            estimate(Estimate::new(row.mean, 0.0))
        },
        mean_se: if usable(row.mean_se) && row.mean_se > 0.0 {
            significant(row.mean_se)
        } else {
            NONE.to_owned()
        },
        n: row.n,
        paper: paper.map_or_else(|| NONE.to_owned(), estimate),
        difference: gap.map_or_else(|| NONE.to_owned(), |gap| signed(gap, decimals(paper))),
        in_errors: in_errors.map_or_else(|| NONE.to_owned(), |ratio| signed(ratio, 1)),
    }
}

fn decimals(paper: Option<Estimate>) -> usize {
    paper
        .filter(|paper| paper.se > 0.0)
        .map_or(3, |paper| (1 - paper.se.log10().floor() as i32).clamp(0, 6) as usize)
}

/// A positive number with two significant digits.
fn significant(value: f64) -> String {
    fixed(value, (1 - value.log10().floor() as i32).clamp(0, 6) as usize)
}

/// A fit in one line: `A = 8.139 ± 0.012 µs/(m/s)², …`.
pub(super) fn fit_line(fit: &Fit) -> String {
    if let Some(edge) = fit.w_beyond_mps {
        let Some(beyond) = headline::beyond(fit) else {
            let edge = signed(edge, 0);
            return format!(
                "W*, A and u₀ not determined: the error of W* reaches beyond {edge} m/s"
            );
        };
        return format!("no minimum: W* {beyond} m/s, A and u₀ not determined");
    }
    let mut parts: Vec<String> = fit
        .parameters
        .iter()
        .map(|p| {
            let held = if p.held { " (held)" } else { "" };
            format!("{} = {} {}{held}", symbol(p.name), estimate(p.estimate), unit(&p.unit))
        })
        .collect();
    match fit.chi2_reduced {
        Some(chi2) => parts.push(format!("χ²/ν = {} (ν = {})", reduced(chi2), fit.dof)),
        None => parts.push("no errors: as many parameters as windows".to_owned()),
    }
    let rms = fixed(fit.rms_us, 2);
    parts.push(format!("rms {rms} {} over {}", effort_unit(fit), count(fit.points, "point")));
    parts.join(", ")
}

/// The unit of rotor effort in a fit: that of u0.
fn effort_unit(fit: &Fit) -> String {
    fit.parameter(Symbol::U0).map_or_else(String::new, |parameter| unit(&parameter.unit))
}

/// The flock's fits in words: (law, line).
pub(super) fn flock_lines(flight: &FlightAnalysis) -> Vec<(&'static str, String)> {
    let Some(laws) = &flight.flock else {
        return Vec::new();
    };
    [
        (LawKind::SignedQuadratic.name(), laws.signed_quadratic.as_ref()),
        ("signed quadratic, held", laws.of_own_vehicle()),
        (LawKind::Linear.name(), laws.linear.as_ref()),
    ]
    .into_iter()
    .filter_map(|(name, fit)| Some((name, fit_line(fit?))))
    .collect()
}

/// What had to be added to the windows' own noise, in words; `None` where nothing was asked for.
pub(super) fn scatter_line(laws: &Laws) -> Option<String> {
    let added = laws.sigma_added_us.filter(|added| usable(*added))?;
    Some(if added > 0.0 {
        format!(
            "added scatter: {} {} on every window, beyond its own noise, so that the errors above \
             hold for the better law (turbulence longer than a window, and what the law does not \
             describe); χ²/ν is from before that",
            significant(added),
            laws.linear.as_ref().map_or_else(String::new, effort_unit)
        )
    } else {
        "added scatter: none; the better law describes the windows to within their own noise"
            .to_owned()
    })
}

/// The paper's table that a flight's parameters stand beside, in words.
pub(super) fn table_heading(flight: &FlightAnalysis) -> String {
    let table = match flight.paper_table {
        Some(PaperTable::Simulation) => " beside the paper's Table I (simulation)",
        Some(PaperTable::Field) => " beside the paper's Table II (its drones in the field)",
        None => "",
    };
    format!("Fitted parameters{}", if compared(flight) { table } else { "" })
}

/// Which rows are not compared with the paper's values beside them, and why, one sentence for each
/// reason.
pub(super) fn not_compared_lines(flight: &FlightAnalysis) -> Vec<String> {
    let mut reasons: Vec<((&str, &str), Vec<&str>)> = Vec::new();
    for row in flight.table.iter().filter(|row| row.paper.is_some()) {
        let Some(reason) = row.not_compared.as_deref() else { continue };
        let (of, name) = ((row.law.name(), reason), quantity(row.parameter));
        match reasons.iter_mut().find(|(known, _)| *known == of) {
            Some((_, rows)) => rows.push(name),
            None => reasons.push((of, vec![name])),
        }
    }
    let line = |((law, reason), rows): ((&str, &str), Vec<&str>)| {
        format!("Not compared: {} of the {law} law: {}.", rows.join(", "), clean(reason))
    };
    reasons.into_iter().map(line).collect()
}

/// Whether a value of the paper stands beside any of the flight's.
pub(super) fn compared(flight: &FlightAnalysis) -> bool {
    flight.table.iter().any(|row| row.paper.is_some())
}

/// That laws are all there is; `None` where a flight measured, or nothing was found.
pub(super) fn no_measurement(analysis: &Analysis) -> Option<&'static str> {
    let laws = analysis.flights.iter().any(|flight| flight.results() > 0)
        && analysis.flights.iter().all(|flight| flight.purpose == Purpose::Calibration);
    laws.then_some(
        "No measurement flight: there are laws, but no map of the air. For a map, analyse a \
         hover or a scan in the same campaign, or another one with --hold analysis.json.",
    )
}

/// Why a flight gave nothing at all, in plain words; `None` where it gave something.
pub(super) fn nothing(flight: &FlightAnalysis) -> Option<String> {
    if flight.results() > 0 {
        return None;
    }
    let windows = || flight.drones.iter().flat_map(|drone| &drone.windows);
    let ladder = windows().any(|window| window.kind.is_leg());
    let hover = windows().any(|window| window.kind.is_hover());
    let calibration = flight.purpose == Purpose::Calibration;
    Some(
        match (calibration, ladder, hover) {
            _ if flight.drones.is_empty() => {
                "No result: no drone of this flight could be analysed."
            }
            (true, false, _) => {
                "No ladder found: this flight has no legs of constant vertical speed, so no law \
                 could be fitted."
            }
            (true, true, _) => {
                "No calibration: the ladder was found, but no law could be fitted to it \
                            (the reasons follow)."
            }
            (false, false, false) => {
                "No ladder and no hover found: nothing in this flight is steady for \
                                  long enough."
            }
            (false, true, false) => "No hover found: there is nothing to measure the air in.",
            (false, _, true) if flight.unmeasured.is_empty() => {
                "No calibration: without its laws the air cannot be measured."
            }
            (false, _, true) => {
                "No value of the air: no drone has a usable hover (the reasons follow)."
            }
        }
        .to_owned(),
    )
}

/// Which law a flight's numbers should be read from, in words; `None` without laws.
pub(super) fn better_words(flight: &FlightAnalysis) -> Option<String> {
    let laws = law::flight_laws(flight)?;
    let (linear, quadratic) = (laws.linear.as_ref(), laws.signed_quadratic.as_ref());
    let chi2 = |fit: Option<&Fit>| fit.and_then(|fit| fit.chi2_reduced).filter(|v| usable(*v));
    if let Some(words) = headline::bent_words(flight) {
        return Some(words);
    }
    let better = prefer::better_of(laws)?;
    if better == LawKind::Linear && headline::preferred(flight) == Some(LawKind::SignedQuadratic) {
        return Some(format!(
            "the signed-quadratic law is the more probable one ({})",
            flight.headline.as_ref().map_or_else(String::new, |headline| clean(&headline.reason))
        ));
    }
    let (name, this, other) = match better {
        LawKind::Linear => (better.name(), chi2(linear), chi2(quadratic)),
        LawKind::SignedQuadratic => ("signed-quadratic", chi2(quadratic), chi2(linear)),
    };
    let (this, other) = this.zip(other)?;
    let against = format!("χ²/ν {} against {}", reduced(this), reduced(other));
    if this <= GOOD_CHI2 {
        return Some(format!("the {name} law fits better ({against})"));
    }
    let (of, errors) = if flight.flock.is_some() && flight.drones.len() > 1 {
        (" of the drones' average", "the errors of an average of drones are so small that")
    } else {
        ("", "the windows' own errors are so small that")
    };
    let note = match law::vertex_mps(flight) {
        Some(_) if better == LawKind::SignedQuadratic => {
            "; its W* is the vertex of a parabola, not air"
        }
        _ => "",
    };
    Some(format!(
        "the {name} law fits better ({against}{of}, before scatter is added: {errors} neither law is \
         exact to within them{note})"
    ))
}

/// One drone's fitted parameters in words; a dash where there is none.
pub(super) struct DroneLaws {
    pub(super) a: String,
    pub(super) u0: String,
    pub(super) w: String,
    pub(super) chi2: String,
    pub(super) slope: String,
    pub(super) linear_u0: String,
    pub(super) linear_chi2: String,
    /// Scatter added to the errors of the windows, us.
    pub(super) scatter: String,
}

/// The drone's laws in words.
pub(super) fn drone_laws(drone: &DroneAnalysis) -> DroneLaws {
    let quadratic = drone.laws.as_ref().and_then(law::signed_quadratic);
    let linear = drone.laws.as_ref().and_then(|laws| laws.linear.as_ref());
    let of = |fit: Option<&Fit>, symbol| {
        fit.and_then(|fit| fit.parameter(symbol)).map_or_else(
            || NONE.to_owned(),
            |p| {
                if let Some(fit) = fit.filter(|fit| fit.w_beyond_mps.is_some()) {
                    let beyond = || headline::beyond(fit).unwrap_or_else(|| UNKNOWN.to_owned());
                    return if symbol == Symbol::W { beyond() } else { NONE.to_owned() };
                }
                if p.held { format!("{} held", estimate(p.estimate)) } else { estimate(p.estimate) }
            },
        )
    };
    let chi2 = |fit: Option<&Fit>| {
        fit.and_then(|fit| fit.chi2_reduced).map_or_else(|| NONE.to_owned(), reduced)
    };
    DroneLaws {
        a: of(quadratic, Symbol::A),
        u0: of(quadratic, Symbol::U0),
        w: of(quadratic, Symbol::W),
        chi2: chi2(quadratic),
        slope: of(linear, Symbol::Slope),
        linear_u0: of(linear, Symbol::U0),
        linear_chi2: chi2(linear),
        scatter: drone
            .laws
            .as_ref()
            .and_then(|laws| laws.sigma_added_us)
            .map_or_else(|| NONE.to_owned(), |added| fixed(added, 2)),
    }
}

/// Everything doubtful about a drone: rejected windows by reason, its warnings, its fits' warnings.
pub(super) fn flags(drone: &DroneAnalysis) -> Vec<String> {
    flags_of(drone, drone.warnings.iter())
}

/// Everything doubtful about a drone but the losses of its log, for pages that list those with the
/// logs.
pub(super) fn flags_without_losses(drone: &DroneAnalysis) -> Vec<String> {
    let is_loss = |warning: &&Warning| matches!(warning, Warning::Log(flight::Warning::Loss(_)));
    flags_of(drone, drone.warnings.iter().filter(|warning| !is_loss(warning)))
}

fn flags_of<'a>(drone: &DroneAnalysis, warnings: impl Iterator<Item = &'a Warning>) -> Vec<String> {
    let mut flags = Vec::new();
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for reason in drone.windows.iter().flat_map(|window| &window.rejected) {
        let words = rejection(*reason);
        match reasons.iter_mut().find(|(known, _)| *known == words) {
            Some((_, n)) => *n += 1,
            None => reasons.push((words, 1)),
        }
    }
    flags.extend(reasons.iter().map(|(words, n)| format!("{} {words}", count(*n, "window"))));
    flags.extend(warnings.map(|warning| clean(&warning.to_string())));
    flags.extend(drone.partial_ladder.map(|partial| {
        format!("partial ladder ({}): not included in the fleet's numbers", partial.short())
    }));
    if let Some(laws) = &drone.laws {
        let fits = [laws.signed_quadratic.as_ref(), laws.of_own_vehicle(), laws.linear.as_ref()];
        for fit in fits.into_iter().flatten() {
            flags.extend(fit.warnings.iter().map(|warning| clean(&warning.to_string())));
            if !fit.other_minima.is_empty() {
                let n = fit.other_minima.len();
                let noun = if n == 1 { "other minimum" } else { "other minima" };
                flags.push(format!("{n} {noun} nearly as good"));
            }
        }
    }
    flags.sort();
    flags.dedup();
    flags
}

/// Accepted windows over all: `28/30`; `11/30, partial` where they are a part of the fleet's ladder.
pub(super) fn windows_used(drone: &DroneAnalysis) -> String {
    let used = drone.windows.iter().filter(|window| window.rejected.is_empty()).count();
    let partial = if drone.partial_ladder.is_some() { ", partial" } else { "" };
    format!("{used}/{}{partial}", drone.windows.len())
}

/// How the drone's clock was aligned, in words.
pub(super) fn clock(drone: &DroneAnalysis) -> &'static str {
    match drone.clock.method {
        Alignment::ShowRows => "show clock",
        Alignment::GpsTime => "GPS time",
        Alignment::Plan => "plan",
        Alignment::Takeoff => "take-off",
    }
}

/// `45 of 49 drones`, or `12 drones` when none is missing.
pub(super) fn drones_of(flight: &FlightAnalysis) -> String {
    let have = flight.drones.len();
    if flight.missing.is_empty() {
        count(have, "drone")
    } else {
        format!("{have} of {}", count(have + flight.missing.len(), "drone"))
    }
}
