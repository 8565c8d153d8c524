//! Turbulence as tables for other programs: quantities with their intervals, spectra, covariances by distance and lag,
//! coherence by distance and frequency.
//!
//! The columns are described in `docs/products.md`.

use std::fmt::Write as _;
use std::io;

use turbulence_statistics::moments::Moment;
use turbulence_statistics::spectrum::{Band, CrossBand};

use crate::analysis::result::{Analysis, Component, Interval, Turbulence};

use super::fields::{ids, quoted};
use super::words::clean;

/// Columns of the table of quantities.
pub const QUANTITIES: [&str; 8] =
    ["flight", "drone", "slot", "quantity", "unit", "value", "low", "high"];
/// Columns of the table of spectra.
pub const SPECTRA: [&str; 9] = [
    "flight",
    "drone",
    "slot",
    "component",
    "frequency_hz",
    "density_m2ps2phz",
    "low_m2ps2phz",
    "high_m2ps2phz",
    "degrees_of_freedom",
];
/// Columns of the table of covariances between drones.
pub const PAIRS: [&str; 7] =
    ["flight", "distance_m", "pairs", "lag_s", "covariance_m2ps2", "low_m2ps2", "high_m2ps2"];
/// Columns of the table of coherence between drones.
pub const COHERENCE: [&str; 6] =
    ["flight", "distance_m", "pairs", "frequency_hz", "squared_coherence", "one_pair_from"];

/// Half the width of a normal 95 % interval, standard errors.
pub(super) const NORMAL: f64 = 1.96;

/// A table of turbulence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// Variances, fluxes, scales, dissipation: one row each.
    Quantities,
    /// Spectra of the fleet and of its drones.
    Spectra,
    /// Covariances by distance and lag.
    Pairs,
    /// Coherence by distance and frequency.
    Coherence,
}

impl Table {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Quantities, Self::Spectra, Self::Pairs, Self::Coherence];

    /// Name of its file, without the ending.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Quantities => "turbulence",
            Self::Spectra => "turbulence-spectra",
            Self::Pairs => "turbulence-pairs",
            Self::Coherence => "turbulence-coherence",
        }
    }

    fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Quantities => &QUANTITIES,
            Self::Spectra => &SPECTRA,
            Self::Pairs => &PAIRS,
            Self::Coherence => &COHERENCE,
        }
    }
}

/// Whether there is any turbulence.
pub fn any(analysis: &Analysis) -> bool {
    analysis.flights.iter().any(|flight| {
        flight.turbulence.as_ref().is_some_and(|turbulence| turbulence.vertical.is_some())
    })
}

/// Writes a table as CSV, as `fields.rs` does.
///
/// # Errors
///
/// The error of the output.
pub fn write_csv(analysis: &Analysis, table: Table, out: &mut dyn io::Write) -> io::Result<()> {
    let mut text = table.columns().join(",");
    text.push('\n');
    for (flight, id) in analysis.flights.iter().zip(ids(analysis)) {
        let Some(turbulence) = &flight.turbulence else { continue };
        match table {
            Table::Quantities => written(&mut text, &id, turbulence),
            Table::Spectra => spectra(&mut text, &id, turbulence),
            Table::Pairs => pairs(&mut text, &id, turbulence),
            Table::Coherence => coherence(&mut text, &id, turbulence),
        }
    }
    out.write_all(text.as_bytes())
}

/// Digits that no error of turbulence is smaller than.
fn value(text: &mut String, value: Option<f64>) {
    text.push(',');
    if let Some(value) = value.filter(|value| value.is_finite()) {
        let _ = if value != 0.0 && value.abs() < 1e-3 {
            write!(text, "{value:.4e}")
        } else {
            write!(text, "{value:.5}")
        };
    }
}

/// The fleet (no name) or a drone at the begin of a row.
fn whose(text: &mut String, flight: &str, drone: Option<(Option<u16>, &str)>) {
    quoted(text, flight);
    text.push(',');
    quoted(text, &drone.map(|(_, name)| clean(name)).unwrap_or_default());
    text.push(',');
    if let Some(slot) = drone.and_then(|(slot, _)| slot) {
        let _ = write!(text, "{slot}");
    }
}

/// A quantity with its 95 % interval.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Quantity {
    /// Number of the drone; `None`: the fleet.
    pub(super) drone: Option<usize>,
    pub(super) name: String,
    pub(super) unit: &'static str,
    /// Value and ends of the interval, where they are known.
    pub(super) of: [Option<f64>; 3],
}

/// Quantities of the fleet or of a drone.
struct Rows<'a> {
    all: &'a mut Vec<Quantity>,
    drone: Option<usize>,
}

impl Rows<'_> {
    fn row(&mut self, quantity: &str, unit: &'static str, of: [Option<f64>; 3]) {
        if of[0].is_some() {
            self.all.push(Quantity { drone: self.drone, name: quantity.to_owned(), unit, of });
        }
    }

    fn alone(&mut self, quantity: &str, unit: &'static str, one: Option<f64>) {
        self.row(quantity, unit, [one, None, None]);
    }

    fn interval(&mut self, quantity: &str, unit: &'static str, of: Option<Interval>) {
        let of = of.map(|of| [of.value, of.low, of.high].map(Some));
        self.row(quantity, unit, of.unwrap_or_default());
    }

    fn moment(&mut self, quantity: &str, unit: &'static str, of: Option<Moment>) {
        let of = of.map(|of| Interval { value: of.value, low: of.low, high: of.high });
        self.interval(quantity, unit, of);
    }

    fn component(&mut self, name: &str, of: Option<&Component>) {
        let Some(of) = of else { return };
        // That across the wind is zero by its definition, and rounding is none.
        let mean_mps = if of.mean_mps.abs() < 1e-9 { 0.0 } else { of.mean_mps };
        self.alone(&format!("mean_{name}"), "m s-1", Some(mean_mps));
        self.moment(&format!("variance_{name}"), "m2 s-2", of.variance);
        self.alone(&format!("variance_{name}_within_record"), "m2 s-2", Some(of.within_record));
        self.alone(&format!("noise_variance_{name}"), "m2 s-2", Some(of.noise));
        self.interval(&format!("skewness_{name}"), "1", of.skewness);
        let Some(scales) = &of.scales else { return };
        self.interval(&format!("integral_time_{name}"), "s", Some(scales.time_s));
        self.interval(&format!("integral_length_{name}"), "m", scales.length_m);
        self.alone(
            &format!("random_error_of_mean_{name}"),
            "standard deviations",
            Some(scales.mean_error),
        );
        self.alone(&format!("random_error_of_variance_{name}"), "1", Some(scales.variance_error));
        self.alone(&format!("lost_variance_{name}"), "1", Some(scales.lost));
    }
}

/// All quantities: those of the fleet, then those of each drone.
pub(super) fn quantities(found: &Turbulence) -> Vec<Quantity> {
    let mut all = Vec::new();
    let mut rows = Rows { all: &mut all, drone: None };
    rows.alone("record_length", "s", Some(found.record.length_s));
    let around = |value: f64, se: f64| Interval {
        value,
        low: value - NORMAL * se,
        high: value + NORMAL * se,
    };
    let carried = found.carried_by.map(|by| around(by.speed_mps.value, by.speed_mps.se));
    rows.interval("wind_that_carries", "m s-1", carried);
    rows.component("w", found.vertical.as_ref());
    rows.interval("updraft_fraction", "1", found.updraft_fraction);
    let convective = found.convective;
    rows.interval("convective_velocity", "m s-1", convective.map(|of| of.velocity_mps));
    rows.alone("mixed_layer_depth", "m", convective.map(|of| of.mixed_layer_depth_m));
    rows.component("u", found.along.as_ref());
    rows.component("v", found.across.as_ref());
    rows.interval("kinetic_energy", "m2 s-2", found.kinetic_energy);
    rows.interval("covariance_uw", "m2 s-2", found.flux_along);
    rows.interval("covariance_vw", "m2 s-2", found.flux_across);
    rows.interval("covariance_uv", "m2 s-2", found.along_across);
    let dissipation =
        found.dissipation.map(|of| Interval { value: of.value, low: of.low, high: of.high });
    rows.interval("dissipation", "m2 s-3", dissipation);
    rows.alone("dissipation_by_structure_function", "m2 s-3", found.dissipation_by_structure);
    rows.interval("spectral_slope", "1", found.dissipation.map(|of| around(of.slope, of.slope_se)));
    let pattern = found.advection.map(|of| around(of.speed_mps.value, of.speed_mps.se));
    rows.interval("advection_speed", "m s-1", pattern);
    for (number, drone) in found.drones.iter().enumerate() {
        let mut rows = Rows { all: &mut all, drone: Some(number) };
        rows.alone("record_length", "s", Some(drone.length_s));
        rows.moment("variance_w", "m2 s-2", drone.vertical);
        rows.interval("skewness_w", "1", drone.skewness);
        rows.moment("variance_u", "m2 s-2", drone.along);
        rows.moment("variance_v", "m2 s-2", drone.across);
        rows.interval("kinetic_energy", "m2 s-2", drone.kinetic_energy);
        rows.interval("covariance_uw", "m2 s-2", drone.flux_along);
        rows.interval("dissipation", "m2 s-3", drone.dissipation);
    }
    all
}

fn written(text: &mut String, flight: &str, found: &Turbulence) {
    for one in quantities(found) {
        let drone = one.drone.and_then(|number| found.drones.get(number));
        whose(text, flight, drone.map(|drone| (drone.slot, drone.name.as_str())));
        let _ = write!(text, ",{},{}", one.name, one.unit);
        for of in one.of {
            value(text, of);
        }
        text.push('\n');
    }
}

fn spectra(text: &mut String, flight: &str, found: &Turbulence) {
    let mut row = |drone, component: &str, of: [f64; 5]| {
        whose(text, flight, drone);
        let _ = write!(text, ",{component}");
        for one in of {
            value(text, Some(one));
        }
        text.push('\n');
    };
    let of_band =
        |band: &Band| [band.frequency_hz, band.density, band.low, band.high, band.freedom];
    for (name, component) in [("w", &found.vertical), ("u", &found.along), ("v", &found.across)] {
        for band in component.iter().flat_map(|component| &component.spectrum) {
            row(None, name, of_band(band));
        }
    }
    let of_cross = |band: &CrossBand| {
        let half = NORMAL * band.co_se;
        [band.frequency_hz, band.co, band.co - half, band.co + half, band.freedom]
    };
    for band in &found.flux_cospectrum {
        row(None, "uw", of_cross(band));
    }
    for drone in &found.drones {
        for band in &drone.spectrum {
            row(Some((drone.slot, drone.name.as_str())), "w", of_band(band));
        }
    }
}

fn pairs(text: &mut String, flight: &str, found: &Turbulence) {
    for at in &found.distances {
        for (lag, covariance) in at.by_lag.iter().enumerate() {
            quoted(text, flight);
            let _ = write!(text, ",{:.2},{},{lag}", at.distance_m, at.pairs);
            // The sampling error is that of the covariance without lag.
            let of = if lag == 0 {
                [at.covariance.value, at.covariance.low, at.covariance.high].map(Some)
            } else {
                [Some(*covariance), None, None]
            };
            for one in of {
                value(text, one);
            }
            text.push('\n');
        }
    }
}

fn coherence(text: &mut String, flight: &str, found: &Turbulence) {
    for at in &found.distances {
        for band in &at.coherence {
            quoted(text, flight);
            let _ = write!(text, ",{:.2},{}", at.distance_m, at.pairs);
            for one in [band.frequency_hz, band.coherence, band.one_pair_from] {
                value(text, Some(one));
            }
            text.push('\n');
        }
    }
}
