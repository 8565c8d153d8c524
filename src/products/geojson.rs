//! Drones on a map as GeoJSON (RFC 7946): points with the means of w, lines with the ways of the drones.

use serde::Serialize;

use super::on_map::{Place, Spot, bounds, spots};
use super::words::{self, iso};
use crate::analysis::result::Analysis;

#[derive(Serialize)]
struct Collection {
    #[serde(rename = "type")]
    kind: &'static str,
    title: String,
    source: String,
    bbox: [f64; 4],
    features: Vec<Feature>,
}

#[derive(Serialize)]
struct Feature {
    #[serde(rename = "type")]
    kind: &'static str,
    geometry: Geometry,
    properties: Properties,
}

#[derive(Serialize)]
#[serde(tag = "type", content = "coordinates")]
enum Geometry {
    Point(Vec<f64>),
    LineString(Vec<Vec<f64>>),
}

#[derive(Serialize)]
struct Properties {
    kind: &'static str,
    flight: String,
    drone: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    slot: Option<u16>,
    #[serde(flatten)]
    measured: Option<Measured>,
}

#[derive(Serialize)]
struct Measured {
    w_mps: f64,
    w_se_mps: Option<f64>,
    low_mps: Option<f64>,
    high_mps: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior_mps: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior_sd_mps: Option<f64>,
    u_mps: Option<f64>,
    v_mps: Option<f64>,
    utc_start: Option<String>,
    utc_end: Option<String>,
    height_agl_m: f64,
    altitude_amsl_m: Option<f64>,
    place_by: &'static str,
}

/// With so many decimals.
fn rounded(value: f64, decimals: i32) -> f64 {
    let steps = 10_f64.powi(decimals);
    // No minus before a zero.
    (value * steps).round() / steps + 0.0
}

/// Longitude and latitude, and the height above mean sea level where it is known.
fn position(place: &Place) -> Vec<f64> {
    let [lat, lon] = place.lat_lon_deg;
    let flat = [rounded(lon, 7), rounded(lat, 7)];
    flat.into_iter().chain(place.amsl_m.map(|m| rounded(m, 2))).collect()
}

fn point(spot: &Spot) -> Feature {
    let speed = |value: f64| rounded(value, 4);
    let measured = Measured {
        w_mps: speed(spot.w_mps),
        w_se_mps: spot.w_se_mps.map(speed),
        low_mps: spot.interval_mps.map(|ends| speed(ends[0])),
        high_mps: spot.interval_mps.map(|ends| speed(ends[1])),
        posterior_mps: spot.posterior_mps.map(|found| speed(found[0])),
        posterior_sd_mps: spot.posterior_mps.map(|found| speed(found[1])),
        u_mps: spot.wind_mps.map(|wind| rounded(wind[0], 3)),
        v_mps: spot.wind_mps.map(|wind| rounded(wind[1], 3)),
        utc_start: spot.utc_ms.map(|ends| iso(ends[0])),
        utc_end: spot.utc_ms.map(|ends| iso(ends[1])),
        height_agl_m: rounded(spot.place.height_m, 2),
        altitude_amsl_m: spot.place.amsl_m.map(|m| rounded(m, 2)),
        place_by: spot.place_by,
    };
    let kind = if spot.moved { "mean along a track" } else { "mean of a hover" };
    feature(spot, kind, Geometry::Point(position(&spot.place)), Some(measured))
}

/// `None`: a track of one point is none.
fn line(spot: &Spot) -> Option<Feature> {
    let track: Vec<Vec<f64>> = spot.track.iter().map(position).collect();
    (track.len() > 1).then(|| feature(spot, "track", Geometry::LineString(track), None))
}

fn feature(
    spot: &Spot,
    kind: &'static str,
    geometry: Geometry,
    measured: Option<Measured>,
) -> Feature {
    let (flight, drone, slot) = (spot.flight.clone(), spot.drone.clone(), spot.slot);
    Feature {
        kind: "Feature",
        geometry,
        properties: Properties { kind, flight, drone, slot, measured },
    }
}

/// The file; `None`: no drone has values and a place.
pub fn geojson(analysis: &Analysis) -> Option<String> {
    let spots = spots(analysis);
    let bbox = bounds(&spots)?.map(|deg| rounded(deg, 7));
    let collection = Collection {
        kind: "FeatureCollection",
        title: words::title(analysis),
        source: words::source(analysis),
        bbox,
        features: spots.iter().map(point).chain(spots.iter().filter_map(line)).collect(),
    };
    serde_json::to_string(&collection).ok().map(|text| text + "\n")
}
