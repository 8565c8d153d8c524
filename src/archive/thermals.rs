//! The table `thermals`: a row for each thermal of each flight, with the wind that it was in.

use super::flights::Flown;
use super::slim::Thermal;
use super::table::{Column, real, text, time, truth, whole};
use crate::base::frame::Geodetic;

/// One thermal of one flight.
#[derive(Debug)]
pub struct ThermalRow<'a> {
    flown: &'a Flown<'a>,
    /// Counted from 1 in its flight, the most certain first.
    number: i64,
    thermal: &'a Thermal,
}

/// Rows of a flight.
pub fn rows<'a>(flown: &'a Flown<'a>) -> impl Iterator<Item = ThermalRow<'a>> {
    let thermals = flown.map().map(|map| map.thermals.as_slice()).unwrap_or_default();
    thermals.iter().zip(1..).map(|(thermal, number)| ThermalRow { flown, number, thermal })
}

impl ThermalRow<'_> {
    fn place(&self) -> Option<Geodetic> {
        let [x, y] = &self.thermal.core_m;
        self.flown.origin.place(x.value?, y.value?)
    }
}

/// Columns of the table.
pub fn columns<'a>() -> Vec<Column<ThermalRow<'a>>> {
    vec![
        text("flight", |row: &ThermalRow<'_>| Some(row.flown.flight.name.as_str())),
        whole("thermal", |row| Some(row.number)),
        truth("simulated", |row| row.flown.origin.simulated),
        text("site", |row| row.flown.site.as_deref()),
        real("time_s", |row| row.thermal.time_s),
        time("utc", |row| row.flown.origin.utc_ms(row.thermal.time_s?)),
        real("x_m", |row| row.thermal.core_m[0].value),
        real("x_se_m", |row| row.thermal.core_m[0].error()),
        real("y_m", |row| row.thermal.core_m[1].value),
        real("y_se_m", |row| row.thermal.core_m[1].error()),
        real("latitude_deg", |row| Some(row.place()?.lat_deg)),
        real("longitude_deg", |row| Some(row.place()?.lon_deg)),
        real("height_m", |row| row.flown.height_m()),
        real("radius_m", |row| row.thermal.radius_m.value),
        real("radius_se_m", |row| row.thermal.radius_m.error()),
        real("peak_mps", |row| row.thermal.peak_mps.value),
        real("peak_se_mps", |row| row.thermal.peak_mps.error()),
        real("flux_m3ps", |row| row.thermal.flux_m3ps.value),
        real("flux_se_m3ps", |row| row.thermal.flux_m3ps.error()),
        real("sink", |row| row.thermal.sink.value),
        real("sink_se", |row| row.thermal.sink.error()),
        real("drift_x_mps", |row| row.thermal.drift_mps[0].value),
        real("drift_x_se_mps", |row| row.thermal.drift_mps[0].error()),
        real("drift_y_mps", |row| row.thermal.drift_mps[1].value),
        real("drift_y_se_mps", |row| row.thermal.drift_mps[1].error()),
        real("log_odds", |row| row.thermal.log_odds),
        real("wind_mps", |row| row.flown.wind_speed().value),
        real("wind_se_mps", |row| row.flown.wind_speed().error()),
        real("wind_from_deg", |row| row.flown.wind()?.from_deg),
    ]
}
