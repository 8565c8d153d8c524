//! Thermals over time as a table for other programs: a row for each thermal and time.
//!
//! The columns are described in `docs/products.md`.

use std::fmt::Write as _;
use std::io;

use super::fields::{ids, quoted};
use super::where_when::WhereWhen;
use super::words::iso;
use crate::analysis::result::{Analysis, DroneUpdraft, FlightAnalysis, Thermal, UpdraftMap};
use crate::base::estimate::Estimate;
use crate::numeric::{extent, mean};

/// Columns of the table.
pub const COLUMNS: [&str; 21] = [
    "flight",
    "thermal",
    "utc",
    "time_s",
    "x_m",
    "y_m",
    "x_se_m",
    "y_se_m",
    "latitude_deg",
    "longitude_deg",
    "height_agl_m",
    "is_over_fleet",
    "radius_m",
    "radius_se_m",
    "peak_mps",
    "peak_se_mps",
    "flux_m3ps",
    "flux_se_m3ps",
    "sink",
    "sink_se",
    "log_odds",
];
/// Time between rows, s.
const STEP_S: f64 = 10.0;

/// Whether there is any thermal.
pub fn any(analysis: &Analysis) -> bool {
    analysis
        .flights
        .iter()
        .any(|flight| flight.map.as_ref().is_some_and(|map| !map.thermals.is_empty()))
}

/// Writes the table as CSV.
///
/// # Errors
///
/// The error of the output.
pub fn write_csv(analysis: &Analysis, out: &mut dyn io::Write) -> io::Result<()> {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for (flight, id) in analysis.flights.iter().zip(ids(analysis)) {
        let Some(map) = &flight.map else { continue };
        for (number, thermal) in map.thermals.iter().enumerate() {
            rows(&mut text, (&id, number + 1), thermal, (flight, map));
        }
    }
    out.write_all(text.as_bytes())
}

/// Places that drones have at a time, m.
fn fleet_m(map: &UpdraftMap, index: usize) -> Option<[(f64, f64); 2]> {
    let place = |drone: &DroneUpdraft| {
        let tracked = drone.track_m.get(index).copied().flatten();
        tracked.map(|[x_m, y_m, _]| [x_m, y_m]).or(drone.position_m)
    };
    let places: Vec<[f64; 2]> = map.drones.iter().filter_map(place).collect();
    let along = |axis: usize| extent(places.iter().map(|place| place[axis]));
    Some([along(0)?, along(1)?])
}

fn rows(
    text: &mut String,
    (id, number): (&str, usize),
    thermal: &Thermal,
    (flight, map): (&FlightAnalysis, &UpdraftMap),
) {
    let here = WhereWhen::of(flight);
    let height_m = mean(map.drones.iter().map(|drone| drone.height_m));
    let mut next_s = f64::NEG_INFINITY;
    for (index, time_s) in map.time_s.iter().copied().enumerate() {
        if time_s < next_s {
            continue;
        }
        next_s = time_s + STEP_S - 1e-6;
        let after_s = time_s - thermal.time_s;
        // Place and drift are independent at the time of the best known place.
        let [x, y] = [0, 1].map(|axis| {
            let (core, drift) = (thermal.core_m[axis], thermal.drift_mps[axis]);
            Estimate::new(core.value + drift.value * after_s, core.se.hypot(drift.se * after_s))
        });
        let is_over = fleet_m(map, index).map(|[along_x, along_y]| {
            let within = |(low, high): (f64, f64), m: f64| (low..=high).contains(&m);
            within(along_x, x.value) && within(along_y, y.value)
        });
        let place = here.lat_lon_deg([x.value, y.value]);
        quoted(text, id);
        let utc = here.utc_ms(time_s).map(iso).unwrap_or_default();
        let _ = write!(text, ",{number},{utc},{time_s:.1}");
        let is_over = is_over.map(f64::from);
        for (value, decimals) in [
            (Some(x.value), 2),
            (Some(y.value), 2),
            (Some(x.se), 2),
            (Some(y.se), 2),
            (place.map(|deg| deg[0]), 7),
            (place.map(|deg| deg[1]), 7),
            (height_m, 2),
            (is_over, 0),
            (Some(thermal.radius_m.value), 2),
            (Some(thermal.radius_m.se), 2),
            (Some(thermal.peak_mps.value), 4),
            (Some(thermal.peak_mps.se), 4),
            (Some(thermal.flux_m3ps.value), 2),
            (Some(thermal.flux_m3ps.se), 2),
            (Some(thermal.sink.value), 3),
            (Some(thermal.sink.se), 3),
            (Some(thermal.log_odds), 2),
        ] {
            text.push(',');
            if let Some(value) = value.filter(|value| value.is_finite()) {
                let _ = write!(text, "{value:.decimals$}");
            }
        }
        text.push('\n');
    }
}
