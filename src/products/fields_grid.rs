//! The posterior between the drones as a table for other programs: one row for each known cell and time.
//!
//! The columns are described in `docs/fields.md`.

use std::fmt::Write as _;
use std::io;

use crate::analysis::result::{Analysis, DroneWindSeries, PosteriorGrid, UpdraftMap};
use crate::numeric::mean;

use super::fields::{ids, number, quoted};
use super::where_when::WhereWhen;
use super::words::iso;

/// Names of the columns, in the order of the file.
pub const COLUMNS: [&str; 16] = [
    "flight",
    "time_s",
    "x_m",
    "y_m",
    "z_m",
    "w_mps",
    "sd_mps",
    "utc",
    "latitude_deg",
    "longitude_deg",
    "height_agl_m",
    "altitude_amsl_m",
    "u_mps",
    "u_se_mps",
    "v_mps",
    "v_se_mps",
];

/// One cell at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct GridRow {
    /// Name of the flight.
    pub flight: String,
    /// Show time in the middle of the 10 s, s.
    pub time_s: f64,
    /// Show frame, forward, m.
    pub x_m: f64,
    /// Show frame, left, m.
    pub y_m: f64,
    /// Height above home, m.
    pub z_m: f64,
    /// Posterior mean of the vertical air speed, m/s, up positive.
    pub w_mps: f64,
    /// Standard deviation of that air, all origins of error included, m/s.
    pub sd_mps: f64,
    /// UTC of the middle of the 10 s, ms since 1970, if the logs have a clock.
    pub utc_ms: Option<i64>,
    /// Latitude and longitude, degrees, if the plan has a place.
    pub lat_lon_deg: Option<[f64; 2]>,
    /// Height above mean sea level, m, if it is known.
    pub amsl_m: Option<f64>,
    /// Horizontal wind of the fleet at that time, if it is known.
    pub wind: Option<FleetWind>,
}

/// Horizontal wind of a fleet at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FleetWind {
    /// Mean over the drones, towards east and north, m/s.
    pub east_north_mps: [f64; 2],
    /// Standard errors of both, m/s: the drones' mean one, as what they do not know of their drag is the same.
    pub se_mps: [f64; 2],
}

impl FleetWind {
    /// That of a map at a show time; `None` where no drone knows its wind.
    pub(super) fn at(map: &UpdraftMap, time_s: f64) -> Option<Self> {
        let index = map.time_s.iter().position(|time| (time - time_s).abs() < 0.5)?;
        let winds = || map.drones.iter().filter_map(|drone| drone.wind.as_ref());
        let over = |of: fn(&DroneWindSeries) -> &[Option<[f64; 2]>], axis: usize| {
            let values =
                winds().filter_map(|wind| Some(of(wind).get(index).copied().flatten()?[axis]));
            mean(values.filter(|mps| mps.is_finite()))
        };
        let both =
            |of: fn(&DroneWindSeries) -> &[Option<[f64; 2]>]| Some([over(of, 0)?, over(of, 1)?]);
        Some(Self {
            east_north_mps: both(|wind| &wind.east_north_mps)?,
            se_mps: both(|wind| &wind.se_mps)?,
        })
    }
}

impl GridRow {
    /// Values of the columns after UTC, with the decimals of the CSV.
    pub(super) fn more(&self) -> [(Option<f64>, usize); 8] {
        let degrees = |axis: usize| (self.lat_lon_deg.map(|deg| deg[axis]), 7);
        let wind = |of: fn(&FleetWind) -> f64| (self.wind.as_ref().map(of), 3);
        [
            degrees(0),
            degrees(1),
            (Some(self.z_m), 2),
            (self.amsl_m, 2),
            wind(|wind| wind.east_north_mps[0]),
            wind(|wind| wind.se_mps[0]),
            wind(|wind| wind.east_north_mps[1]),
            wind(|wind| wind.se_mps[1]),
        ]
    }
}

/// All known cells: flight by flight, time by time, along y, then along x.
pub fn rows(analysis: &Analysis) -> impl Iterator<Item = GridRow> + '_ {
    analysis.flights.iter().zip(ids(analysis)).flat_map(|(flight, id)| {
        flight.map.iter().flat_map(move |map| {
            let grid = map.posterior.iter().filter_map(|posterior| posterior.grid.as_ref());
            let (id, here) = (id.clone(), WhereWhen::of(flight));
            grid.flat_map(move |grid| cells(id.clone(), (map, grid), here.clone()))
        })
    })
}

fn cells<'a>(
    flight: String,
    (map, grid): (&'a UpdraftMap, &'a PosteriorGrid),
    here: WhereWhen<'a>,
) -> impl Iterator<Item = GridRow> + 'a {
    let amsl_m = here.amsl_m(grid.height_m);
    grid.time_s.iter().enumerate().flat_map(move |(time, &time_s)| {
        let (flight, here) = (flight.clone(), here.clone());
        let (utc_ms, wind) = (here.utc_ms(time_s), FleetWind::at(map, time_s));
        grid.y_m.iter().enumerate().flat_map(move |(row, &y_m)| {
            let (flight, here) = (flight.clone(), here.clone());
            grid.x_m.iter().enumerate().filter_map(move |(column, &x_m)| {
                let value = |of: &[Vec<Vec<Option<f64>>>]| {
                    let value = of.get(time)?.get(row)?.get(column).copied().flatten();
                    value.filter(|value| value.is_finite())
                };
                Some(GridRow {
                    flight: flight.clone(),
                    time_s,
                    x_m,
                    y_m,
                    z_m: grid.height_m,
                    w_mps: value(&grid.updraft_mps)?,
                    sd_mps: value(&grid.sd_mps)?,
                    utc_ms,
                    lat_lon_deg: here.lat_lon_deg([x_m, y_m]),
                    amsl_m,
                    wind,
                })
            })
        })
    })
}

/// Whether there is any known cell.
pub fn any(analysis: &Analysis) -> bool {
    rows(analysis).next().is_some()
}

/// Writes the cells as CSV, as `fields.rs` does.
///
/// # Errors
///
/// The error of the output.
pub fn write_csv(analysis: &Analysis, out: &mut dyn io::Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    let mut line = String::new();
    for row in rows(analysis) {
        line.clear();
        quoted(&mut line, &row.flight);
        let _ = write!(line, ",{}", row.time_s);
        for (value, decimals) in
            [(row.x_m, 2), (row.y_m, 2), (row.z_m, 2), (row.w_mps, 4), (row.sd_mps, 4)]
        {
            number(&mut line, Some(value), decimals);
        }
        let _ = write!(line, ",{}", row.utc_ms.map(iso).unwrap_or_default());
        for (value, decimals) in row.more() {
            number(&mut line, value, decimals);
        }
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}
