//! The table `seconds`: a row for each drone and second of each map.

use std::sync::Arc;

use super::flights::Flown;
use super::series::Series;
use super::slim::flags;
use super::table::{Column, real, text, time, whole};

/// Stands among the flags of a drone without a log, whose air its neighbours tell.
const FILLED: &str = "filled";

/// One drone in one second.
#[derive(Debug)]
pub struct SecondRow {
    flight: Arc<str>,
    site: Option<Arc<str>>,
    drone: Arc<str>,
    airframe: Option<Arc<str>>,
    slot: Option<u16>,
    time_s: f64,
    utc_ms: Option<i64>,
    place_m: [Option<f64>; 3],
    place_deg: Option<[f64; 2]>,
    w_mps: Option<f64>,
    sd_mps: Option<f64>,
    interval_mps: Option<[f64; 2]>,
    posterior_mps: Option<f64>,
    posterior_sd_mps: Option<f64>,
    flags: String,
    truth_mps: Option<f64>,
}

/// Rows of one drone.
pub fn rows<'a>(
    flown: &Flown<'a>,
    time_s: &'a [f64],
    series: &'a Series,
) -> impl Iterator<Item = SecondRow> {
    let shared = |text: &str| Arc::<str>::from(text);
    let flight = shared(&flown.flight.name);
    let site = flown.site.as_deref().map(shared);
    let airframe = series.slot.and_then(|slot| flown.origin.airframes.get(&slot));
    let airframe = airframe.map(|name| shared(name));
    let slot = series.slot.unwrap_or_default();
    let drone = series.name.as_deref().map_or_else(|| shared(&format!("slot {slot}")), shared);
    let [x_m, y_m] = series.position_m.unwrap_or_default();
    let z_m = if series.name.is_some() { series.height_m } else { flown.height_m() };
    let origin = flown.origin.clone();
    let to_deg = move |place: [Option<f64>; 3]| {
        let place = origin.place(place[0]?, place[1]?)?;
        Some([place.lat_deg, place.lon_deg])
    };
    let still_deg = to_deg([x_m, y_m, z_m]);
    let utc_of = flown.origin.clone();
    time_s.iter().enumerate().map(move |(index, &time_s)| {
        let (place_m, place_deg) = if series.track_m.is_empty() {
            ([x_m, y_m, z_m], still_deg)
        } else {
            let place_m = series.track_m.at(index).map_or([None; 3], |at: [f64; 3]| at.map(Some));
            (place_m, to_deg(place_m))
        };
        SecondRow {
            flight: Arc::clone(&flight),
            site: site.clone(),
            drone: Arc::clone(&drone),
            airframe: airframe.clone(),
            slot: series.slot,
            time_s,
            utc_ms: utc_of.utc_ms(time_s),
            place_m,
            place_deg,
            w_mps: series.updraft_mps.at(index),
            sd_mps: series.sd_mps.at(index),
            interval_mps: series.interval_mps.at(index),
            posterior_mps: series.posterior_mps.at(index),
            posterior_sd_mps: series.posterior_sd_mps.at(index),
            flags: match series.name {
                Some(_) => flags(&series.quality, Some(time_s)),
                None => FILLED.to_owned(),
            },
            truth_mps: series.truth_mps.at(index),
        }
    })
}

/// Columns of the table.
pub fn columns() -> Vec<Column<SecondRow>> {
    vec![
        text("flight", |row: &SecondRow| Some(&row.flight)),
        text("site", |row| row.site.as_deref()),
        whole("slot", |row| row.slot.map(i64::from)),
        text("drone", |row| Some(&row.drone)),
        text("airframe", |row| row.airframe.as_deref()),
        real("time_s", |row| Some(row.time_s)),
        time("utc", |row| row.utc_ms),
        real("x_m", |row| row.place_m[0]),
        real("y_m", |row| row.place_m[1]),
        real("z_m", |row| row.place_m[2]),
        real("latitude_deg", |row| row.place_deg.map(|place| place[0])),
        real("longitude_deg", |row| row.place_deg.map(|place| place[1])),
        real("w_mps", |row| row.w_mps),
        real("sd_mps", |row| row.sd_mps),
        real("low_mps", |row| row.interval_mps.map(|ends| ends[0])),
        real("high_mps", |row| row.interval_mps.map(|ends| ends[1])),
        real("posterior_mps", |row| row.posterior_mps),
        real("posterior_sd_mps", |row| row.posterior_sd_mps),
        text("flags", |row| Some(&row.flags)),
        real("truth_mps", |row| row.truth_mps),
    ]
}
