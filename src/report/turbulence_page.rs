//! The page of turbulence beside the report: one section for each flight that has it.

use minijinja::context;
use minijinja::value::Value;
use turbulence_statistics::moments::Moment;

use crate::analysis::result::{
    Analysis, CarriedByWhat, Component, FlightAnalysis, Interval, Turbulence,
};

use super::figures::turbulence::figures;
use super::fill::{common, fill};
#[cfg(any(feature = "paper-figures", test))]
use super::format::Format;
use super::page::{Gallery, flight_key};
use super::text::{clean, count, estimate, fixed, sentence};
use super::{Provenance, Report, ReportError};

const PAGE: &str = include_str!("../../templates/report/turbulence.html");
/// Name of the page in the report's folder.
pub const TURBULENCE_PAGE: &str = "turbulence.html";
/// Significant digits that values are told with.
const DIGITS: i32 = 3;

/// Renders the page and its figures; `None` where no flight has anything to tell of turbulence.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_turbulence(
    analysis: &Analysis,
    provenance: &Provenance,
) -> Result<Option<Report>, ReportError> {
    let mut gallery = Gallery::default();
    let flights = sections(analysis, &mut gallery);
    if flights.is_empty() {
        return Ok(None);
    }
    let title = clean(&analysis.title);
    let values = context! {
        title => if title.trim().is_empty() { "Turbulence".to_owned() } else { format!("Turbulence: {title}") },
        simulated => analysis.flights.iter().filter(|one| one.turbulence.is_some()).all(|one| one.simulated),
        flights,
        schema => clean(&analysis.schema),
        made_by => clean(&analysis.made_by),
        ..common(provenance),
    };
    let html = fill(TURBULENCE_PAGE, PAGE, values)?;
    Ok(Some(Report { html, figures: gallery.files, data: Vec::new() }))
}

/// The figures of the page alone, drawn for a format.
#[cfg(any(feature = "paper-figures", test))]
pub(super) fn figures_of(analysis: &Analysis, format: Format) -> Vec<(String, String)> {
    let mut gallery = Gallery::of(format);
    sections(analysis, &mut gallery);
    gallery.files
}

/// Sections of the flights that have something to tell; their figures are put into `gallery`, too.
fn sections(analysis: &Analysis, gallery: &mut Gallery) -> Vec<Value> {
    let flights = analysis.flights.iter().enumerate();
    let told = flights.filter_map(|(index, flight)| {
        let found = flight.turbulence.as_ref()?;
        Some(section(flight, &flight_key(analysis, index), found, gallery))
    });
    told.collect()
}

/// A value with as many decimals as three significant digits need.
fn digits(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 {
        return format!("{value:.2e}").replace('-', "−");
    }
    let before = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    fixed(value, usize::try_from(DIGITS - 1 - before).unwrap_or(0).min(4))
}

fn range(low: f64, high: f64) -> String {
    format!("{} to {}", digits(low), if high.is_finite() { digits(high) } else { "∞".to_owned() })
}

/// One row of the fleet's table.
fn row(name: &str, symbol: &str, of: [f64; 3], unit: &str, note: String) -> Value {
    let [value, low, high] = of;
    context! { name, symbol, value => digits(value), range => range(low, high), unit, note }
}

fn ends(of: &Interval) -> [f64; 3] {
    [of.value, of.low, of.high]
}

fn moment_ends(of: &Moment) -> [f64; 3] {
    [of.value, of.low, of.high]
}

fn section(flight: &FlightAnalysis, key: &str, found: &Turbulence, gallery: &mut Gallery) -> Value {
    let shown: Vec<Value> = figures(flight, key, found, gallery.format)
        .into_iter()
        .map(|figure| gallery.show(figure))
        .collect();
    let record = &found.record;
    context! {
        key,
        name => clean(&flight.name),
        simulated => flight.simulated,
        record => format!(
            "{} of {} s in blocks of {} s, from {} to {} s of the show",
            count(record.drones, "record"),
            fixed(record.length_s, 0),
            record.step_s,
            fixed(record.from_s, 0),
            fixed(record.to_s, 0),
        ),
        wind => wind(found),
        rows => fleet_rows(found),
        scales => scale_rows(found),
        figures => shown,
        distances => found.distances.iter().map(|at| context! {
            distance => fixed(at.distance_m, 1),
            pairs => at.pairs,
            covariance => digits(at.covariance.value),
            range => range(at.covariance.low, at.covariance.high),
            correlation => at.correlation.map(|value| fixed(value, 2)),
        }).collect::<Vec<_>>(),
        drones => drone_rows(found),
        absent => found.absent.iter().map(|text| sentence(text)).collect::<Vec<_>>(),
    }
}

/// What carries the eddies past, and how fast the pattern moves.
fn wind(found: &Turbulence) -> Vec<String> {
    let mut sentences = Vec::new();
    if let Some(wind) = &found.carried_by {
        let towards =
            wind.towards_deg.map_or_else(String::new, |deg| format!(" towards {}°", fixed(deg, 0)));
        let by = match wind.by {
            CarriedByWhat::Lean => "by the lean of the drones",
            CarriedByWhat::Advection => {
                "by the lags at which pairs of drones are alike, known better than by their lean"
            }
        };
        sentences.push(format!("Eddies pass at {} m/s{towards}: {by}.", estimate(wind.speed_mps)));
    }
    if let Some(pattern) = &found.advection {
        let against = pattern.over_lean.map_or_else(String::new, |ratio| {
            let turned = pattern
                .turned_deg
                .map_or_else(String::new, |deg| format!(", turned by {}°", fixed(deg, 0)));
            format!(" This is {} of the wind by the lean{turned}.", estimate(ratio))
        });
        sentences.push(format!(
            "The pattern of w passes the fleet at {} m/s, from {}.{against}",
            estimate(pattern.speed_mps),
            count(pattern.pairs, "pair"),
        ));
    }
    sentences
}

fn fleet_rows(found: &Turbulence) -> Vec<Value> {
    let mut rows = Vec::new();
    for (name, symbol, of) in [
        ("Variance of w, up", "σ²w", &found.vertical),
        ("Variance of u, along the wind", "σ²u", &found.along),
        ("Variance of v, across the wind", "σ²v", &found.across),
    ] {
        let Some(of) = of else { continue };
        match &of.variance {
            Some(variance) => {
                let note = noted(of, variance);
                rows.push(row(name, symbol, moment_ends(variance), "m²/s²", note));
            }
            None => rows.push(context! {
                name => format!("{name}, within the record alone"),
                symbol,
                value => digits(of.within_record),
                range => "not known",
                unit => "m²/s²",
                note => "the record is too short for its eddies",
            }),
        }
    }
    let mut interval = |name: &str, symbol: &str, of: &Option<Interval>, unit: &str, note: &str| {
        if let Some(of) = of {
            rows.push(row(name, symbol, ends(of), unit, note.to_owned()));
        }
    };
    let skewness = |of: &Option<Component>| of.as_ref().and_then(|of| of.skewness);
    interval("Skewness of w", "S", &skewness(&found.vertical), "", "");
    interval(
        "Updraft fraction",
        "",
        &found.updraft_fraction,
        "",
        "share of time and drones above the drone's mean",
    );
    if let Some(of) = &found.convective {
        let note = format!(
            "of a mixed layer of {} m, {} m up, by the profile of Lenschow and others (1980); its depth and its scatter are not \
             in the interval",
            fixed(of.mixed_layer_depth_m, 0),
            fixed(of.height_m, 0)
        );
        interval("Convective velocity scale", "w*", &Some(of.velocity_mps), "m/s", &note);
    }
    interval(
        "Turbulent kinetic energy",
        "e",
        &found.kinetic_energy,
        "m²/s²",
        "half the sum of the variances",
    );
    interval(
        "Momentum flux along the wind",
        "u′w′",
        &found.flux_along,
        "m²/s²",
        "below zero: downwards",
    );
    interval("Momentum flux across the wind", "v′w′", &found.flux_across, "m²/s²", "");
    interval("Covariance of u and v", "u′v′", &found.along_across, "m²/s²", "");
    if let Some(of) = &found.dissipation {
        let structure = found.dissipation_by_structure.map_or_else(String::new, |value| {
            format!("; by the structure function {}", digits(value))
        });
        let note = format!(
            "{} to {} Hz, where the slope is {} ± {}{structure}",
            digits(of.from_hz),
            digits(of.to_hz),
            fixed(of.slope, 2),
            fixed(1.96 * of.slope_se, 2),
        );
        rows.push(row("Dissipation", "ε", [of.value, of.low, of.high], "m²/s³", note));
    }
    rows
}

/// What was taken off and added to a variance.
fn noted(of: &Component, variance: &Moment) -> String {
    format!(
        "noise {} taken off, {} that the mean took added; scale known to {} %",
        digits(of.noise),
        digits(variance.systematic),
        fixed(100.0 * of.scale_se, 1)
    )
}

fn scale_rows(found: &Turbulence) -> Vec<Value> {
    [("w", &found.vertical), ("u", &found.along), ("v", &found.across)]
        .into_iter()
        .filter_map(|(name, of)| {
            let scales = of.as_ref()?.scales.as_ref()?;
            Some(context! {
                name,
                time => digits(scales.time_s.value),
                time_range => range(scales.time_s.low, scales.time_s.high),
                length => scales.length_m.as_ref().map(|of| digits(of.value)),
                length_range => scales.length_m.as_ref().map(|of| range(of.low, of.high)),
                mean_error => fixed(scales.mean_error, 2),
                variance_error => fixed(100.0 * scales.variance_error, 0),
                lost => fixed(100.0 * scales.lost, 1),
                needed => fixed(scales.for_a_tenth_s / 60.0, 0),
            })
        })
        .collect()
}

fn drone_rows(found: &Turbulence) -> Vec<Value> {
    let moment = |of: &Option<Moment>| {
        of.as_ref().map(|of| {
            context! {
                value => digits(of.value), range => range(of.low, of.high),
            }
        })
    };
    let interval = |of: &Option<Interval>| {
        of.as_ref().map(|of| {
            context! {
                value => digits(of.value), range => range(of.low, of.high),
            }
        })
    };
    found
        .drones
        .iter()
        .map(|drone| {
            context! {
                name => clean(&drone.name),
                length => fixed(drone.length_s, 0),
                w => moment(&drone.vertical),
                skewness => interval(&drone.skewness),
                u => moment(&drone.along),
                v => moment(&drone.across),
                energy => interval(&drone.kinetic_energy),
                flux => interval(&drone.flux_along),
                dissipation => interval(&drone.dissipation),
            }
        })
        .collect()
}
