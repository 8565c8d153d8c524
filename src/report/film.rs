//! Figure 5 as a film: the data that the page's script draws.
//!
//! Values are whole mm/s in 16 bits, base64, one time after the other; long flights and big fleets
//! are thinned in time, so that the page stays small.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::analysis::result::UpdraftMap;

use super::colour::diverging;
use super::explorer::pick;
use super::frames::Frames;
use super::posterior_grid::GridField;
use super::text::shortened;

/// Most values of one field over all times: 0.5 MB in the page.
const MOST_VALUES: usize = 200_000;
/// Largest number of times in a film.
const MOST_TIMES: usize = 3_600;
/// Stands for no value.
const NONE: i16 = i16::MIN;
/// Steps of the colour scale.
pub(super) const COLOURS: u32 = 40;

/// What the script reads.
#[derive(Serialize)]
struct Data {
    /// Show time of each frame, s.
    times: Vec<f64>,
    names: Vec<String>,
    /// By which the drones are picked, all over the page.
    picks: Vec<String>,
    /// [forward, left], m.
    places: Vec<Option<[f64; 2]>>,
    /// Corners of the triangles, three by three.
    triangles: Vec<usize>,
    /// Ends of the scales, m/s.
    limit: f64,
    difference_limit: f64,
    /// From the lower end of the scale to the upper one.
    colours: Vec<String>,
    /// Base64 of little-endian 16-bit mm/s, time by time, drone by drone.
    estimate: String,
    truth: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior: Option<Posterior>,
}

/// The same drones and times in the posterior, and the air between them.
#[derive(Serialize)]
struct Posterior {
    /// As the estimate.
    values: String,
    sd: String,
    /// Drones without a log, [forward, left], m.
    lost: Vec<[f64; 2]>,
    field: Option<Field>,
}

/// The air on a grid.
#[derive(Serialize)]
struct Field {
    /// Forward and left, m.
    x: Vec<f64>,
    y: Vec<f64>,
    /// Show times, s.
    times: Vec<f64>,
    /// Base64 of little-endian 16-bit mm/s, time by time, along y, then along x.
    values: String,
}

/// A film in the page.
pub(super) struct Film {
    /// JSON for a `<script type="application/json">`.
    pub(super) json: String,
    /// Seconds between frames.
    pub(super) step_s: f64,
    /// Frames.
    pub(super) frames: usize,
    /// Whether the posterior is in it.
    pub(super) posterior: bool,
}

/// The film of a map; `None` with fewer than two times. `field` is the posterior between the drones.
pub(super) fn film(
    map: &UpdraftMap,
    frames: &Frames<'_>,
    field: Option<&GridField<'_>>,
) -> Option<Film> {
    let drones = map.drones.len();
    let chosen = thinned(&frames.times, drones);
    if chosen.len() < 2 {
        return None;
    }
    let encoded = |value: &dyn Fn(usize, usize) -> Option<f64>| {
        coded(chosen.iter().flat_map(|&time| (0..drones).map(move |drone| value(drone, time))))
    };
    let round = |value: f64, unit: f64| (value / unit).round() * unit;
    let centimetres = |v: f64| (v * 100.0).round() / 100.0;
    let data = Data {
        times: chosen.iter().map(|&time| round(frames.seconds(time), 0.5)).collect(),
        names: map.drones.iter().map(|drone| shortened(&drone.name, 32)).collect(),
        picks: map.drones.iter().map(|drone| pick(drone.slot, &drone.name)).collect(),
        places: frames.places.iter().map(|place| place.map(|p| p.map(centimetres))).collect(),
        triangles: frames.surface.triangles().iter().flatten().copied().collect(),
        limit: frames.limit_mps,
        difference_limit: frames.difference_limit_mps,
        colours: (0..=COLOURS)
            .map(|i| diverging(2.0 * f64::from(i) / f64::from(COLOURS) - 1.0))
            .collect(),
        estimate: encoded(&|drone, time| frames.estimate(drone, time)),
        truth: frames.truth_known.then(|| encoded(&|drone, time| frames.truth(drone, time))),
        posterior: map.posterior.as_ref().map(|_| {
            let part = |part: usize| {
                encoded(&|drone, time| frames.posterior(drone, time).map(|found| found[part]))
            };
            let lost = frames.lost().into_iter().map(|place| place.map(centimetres)).collect();
            Posterior { values: part(0), sd: part(1), lost, field: field.map(field_data) }
        }),
    };
    let posterior = data.posterior.is_some();
    let span = data.times.last()? - data.times.first()?;
    let step_s = span / (chosen.len() - 1) as f64;
    // `<` could end the script that holds the data.
    let json = serde_json::to_string(&data).ok()?.replace('<', "\\u003c");
    Some(Film { json, step_s, frames: chosen.len(), posterior })
}

/// Every few of these times, so that the values of so many drones fit into the page.
pub(super) fn thinned(times: &[usize], drones: usize) -> Vec<usize> {
    let most = (MOST_VALUES / drones.max(1)).clamp(2, MOST_TIMES);
    let stride = times.len().div_ceil(most).max(1);
    times.iter().copied().step_by(stride).collect()
}

/// The grid, thinned in time as the frames are.
fn field_data(field: &GridField<'_>) -> Field {
    let grid = field.grid();
    let most = (MOST_VALUES / (grid.x_m.len() * grid.y_m.len()).max(1)).max(2);
    let stride = grid.time_s.len().div_ceil(most).max(1);
    let fields = grid.updraft_mps.iter().step_by(stride);
    Field {
        x: grid.x_m.clone(),
        y: grid.y_m.clone(),
        times: grid.time_s.iter().copied().step_by(stride).collect(),
        values: coded(fields.flatten().flatten().copied()),
    }
}

/// Base64 of little-endian 16-bit mm/s.
fn coded(values: impl Iterator<Item = Option<f64>>) -> String {
    let mut bytes = Vec::new();
    for value in values {
        let value = value.filter(|mps| mps.is_finite()).map_or(NONE, |mps| {
            (1000.0 * mps).round().clamp(f64::from(NONE + 1), f64::from(i16::MAX)) as i16
        });
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    STANDARD.encode(bytes)
}
