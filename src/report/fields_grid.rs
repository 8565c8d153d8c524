//! The posterior between the drones as a table for other programs: one row for each known cell and time.
//!
//! The columns are described in `docs/fields.md`.

use std::fmt::Write as _;
use std::io;

use crate::analysis::result::{Analysis, PosteriorGrid};

use super::fields::{ids, number, quoted};

/// Names of the columns, in the order of the file.
pub const COLUMNS: [&str; 7] = ["flight", "time_s", "x_m", "y_m", "z_m", "w_mps", "sd_mps"];

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
}

/// All known cells: flight by flight, time by time, along y, then along x.
pub fn rows(analysis: &Analysis) -> impl Iterator<Item = GridRow> + '_ {
    analysis.flights.iter().zip(ids(analysis)).flat_map(|(flight, id)| {
        let posterior = flight.map.as_ref().and_then(|map| map.posterior.as_ref());
        let grid = posterior.and_then(|posterior| posterior.grid.as_ref());
        grid.into_iter().flat_map(move |grid| cells(id.clone(), grid))
    })
}

fn cells(flight: String, grid: &PosteriorGrid) -> impl Iterator<Item = GridRow> + '_ {
    grid.time_s.iter().enumerate().flat_map(move |(time, &time_s)| {
        let flight = flight.clone();
        grid.y_m.iter().enumerate().flat_map(move |(row, &y_m)| {
            let flight = flight.clone();
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
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}
