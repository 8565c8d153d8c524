//! Drones and their ways on the globe, for maps: means with errors, and thinned tracks.

use nalgebra::Vector3;

use super::fields::ids;
use super::where_when::{Fix, WhereWhen, wrapped_deg};
use super::words::clean;
use crate::analysis::result::{Analysis, DroneUpdraft, FlightAnalysis, Trace, UpdraftMap};
use crate::base::frame::metres_per_degree;
use crate::numeric::{extent, mean};

/// A thinned track is nowhere further away from the whole one, m.
const NEAR_M: f64 = 0.5;

/// A place: latitude, longitude, degrees, height above take-off, m, and above mean sea level, m, if known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) lat_lon_deg: [f64; 2],
    pub(super) height_m: f64,
    pub(super) amsl_m: Option<f64>,
}

/// One drone of one flight, with what it measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) flight: String,
    pub(super) drone: String,
    pub(super) slot: Option<u16>,
    /// Mean place of its values.
    pub(super) place: Place,
    /// Origin of that place: `log` or `plan`.
    pub(super) place_by: &'static str,
    /// Whether the drone flew along a track.
    pub(super) moved: bool,
    /// Mean of w, m/s, up positive, with its standard error, all errors included.
    pub(super) w_mps: f64,
    pub(super) w_se_mps: Option<f64>,
    pub(super) interval_mps: Option<[f64; 2]>,
    /// The same by all drones together: mean and standard deviation.
    pub(super) posterior_mps: Option<[f64; 2]>,
    /// Mean wind towards east and north, m/s.
    pub(super) wind_mps: Option<[f64; 2]>,
    /// First and last value, ms of UTC since 1970.
    pub(super) utc_ms: Option<[i64; 2]>,
    /// Its way through the whole flight, thinned.
    pub(super) track: Vec<Place>,
}

/// All drones with values and a place.
pub(super) fn spots(analysis: &Analysis) -> Vec<Spot> {
    let of_flight = |(flight, id): (&FlightAnalysis, String)| {
        let here = WhereWhen::of(flight);
        let drones =
            flight.map.iter().flat_map(|map| map.drones.iter().map(move |drone| (map, drone)));
        drones.filter_map(|(map, drone)| spot(flight, &id, (map, drone), &here)).collect::<Vec<_>>()
    };
    analysis.flights.iter().zip(ids(analysis)).flat_map(of_flight).collect()
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Mean longitude, on the near side of the date line.
fn middle_deg(mut lons_deg: impl Iterator<Item = f64>) -> Option<f64> {
    let first = lons_deg.next()?;
    let off =
        mean(std::iter::once(0.0).chain(lons_deg.map(|lon_deg| wrapped_deg(lon_deg - first))))?;
    Some(wrapped_deg(first + off))
}

fn spot(
    flight: &FlightAnalysis,
    id: &str,
    (map, drone): (&UpdraftMap, &DroneUpdraft),
    here: &WhereWhen<'_>,
) -> Option<Spot> {
    let measured: Vec<usize> = (0..map.time_s.len())
        .filter(|index| drone.updraft_mps.get(*index).is_some_and(Option::is_some))
        .collect();
    let fixes: Vec<Fix> = measured.iter().map(|index| here.fix(drone, *index)).collect();
    let over = |get: fn(&Fix) -> Option<f64>| mean(fixes.iter().filter_map(get));
    let place = Place {
        lat_lon_deg: [
            over(|fix| Some(fix.lat_lon_deg?.0[0]))?,
            middle_deg(fixes.iter().filter_map(|fix| Some(fix.lat_lon_deg?.0[1])))?,
        ],
        height_m: over(|fix| fix.height_m)?,
        amsl_m: over(|fix| fix.amsl_m),
    };
    let winds = drone.wind.iter().flat_map(|wind| wind.east_north_mps.iter().flatten());
    let wind =
        |axis: usize| mean(winds.clone().map(|wind| wind[axis]).filter(|mps| mps.is_finite()));
    let times = measured.iter().filter_map(|index| map.time_s.get(*index));
    let zero = here.zero_of(drone);
    let times = times.filter_map(|time_s| zero?.utc_ms(*time_s));
    let utc_ms = times.clone().min().zip(times.max()).map(|(first, last)| [first, last]);
    let both = |pair: [f64; 2]| pair.iter().all(|value| value.is_finite()).then_some(pair);
    Some(Spot {
        flight: id.to_owned(),
        drone: clean(&drone.name),
        slot: drone.slot,
        place,
        place_by: fixes.iter().find_map(|fix| fix.lat_lon_deg).map_or("", |(_, by)| by.name()),
        moved: !drone.track_m.is_empty(),
        w_mps: finite(drone.mean.value)?,
        w_se_mps: finite(drone.mean.se),
        interval_mps: drone.mean_interval_mps.and_then(both),
        posterior_mps: drone.posterior_mean.and_then(|found| both([found.value, found.se])),
        wind_mps: wind(0).zip(wind(1)).map(|(east, north)| [east, north]),
        utc_ms,
        track: thinned(&track(flight, drone, here)),
    })
}

/// The way of the whole flight, from the trace of its log; where the log does not say, that of the measured seconds.
fn track(flight: &FlightAnalysis, drone: &DroneUpdraft, here: &WhereWhen<'_>) -> Vec<Place> {
    let trace = flight.drones.iter().find(|other| {
        if drone.slot.is_some() { other.slot == drone.slot } else { other.name == drone.name }
    });
    let home = drone.place.as_ref().and_then(|place| place.home_lat_lon_deg);
    let whole = trace.zip(home).map(|(log, home)| flown(&log.trace, home, here, drone));
    whole.filter(|track| track.len() > 1).unwrap_or_else(|| {
        let count = flight.map.as_ref().map_or(0, |map| map.time_s.len());
        let place = |index: usize| {
            let fix = here.fix(drone, index);
            Some(Place {
                lat_lon_deg: fix.lat_lon_deg?.0,
                height_m: fix.height_m?,
                amsl_m: fix.amsl_m,
            })
        };
        (0..count).filter_map(place).collect()
    })
}

fn flown(
    trace: &Trace,
    [lat_deg, lon_deg]: [f64; 2],
    here: &WhereWhen<'_>,
    drone: &DroneUpdraft,
) -> Vec<Place> {
    let (north_m_per_deg, east_m_per_deg) = metres_per_degree(lat_deg);
    let places = trace.moved_m.iter().zip(&trace.height_m);
    places
        .filter_map(|(moved, height_m)| {
            let [north_m, east_m] = (*moved)?;
            let lat_lon_deg = [
                lat_deg + north_m / north_m_per_deg,
                wrapped_deg(lon_deg + east_m / east_m_per_deg),
            ];
            let known = lat_lon_deg.iter().chain([height_m]).all(|value| value.is_finite());
            let amsl_m = here.amsl_m_of(drone, *height_m);
            known.then_some(Place { lat_lon_deg, height_m: *height_m, amsl_m })
        })
        .collect()
}

/// A track with fewer points that is nowhere further away than [`NEAR_M`] (Ramer, Douglas and Peucker).
fn thinned(track: &[Place]) -> Vec<Place> {
    let Some(first) = track.first() else { return Vec::new() };
    let (north_m_per_deg, east_m_per_deg) = metres_per_degree(first.lat_lon_deg[0]);
    let points: Vec<Vector3<f64>> = track
        .iter()
        .map(|place| {
            let [lat, lon] = [0, 1].map(|axis| place.lat_lon_deg[axis] - first.lat_lon_deg[axis]);
            Vector3::new(lat * north_m_per_deg, lon * east_m_per_deg, place.height_m)
        })
        .collect();
    let mut kept = vec![false; points.len()];
    let mut stretches = vec![(0, points.len() - 1)];
    while let Some((from, to)) = stretches.pop() {
        kept[from] = true;
        kept[to] = true;
        let furthest = (from + 1..to)
            .map(|index| (index, distance_m(&points[from], &points[to], &points[index])))
            .max_by(|left, right| left.1.total_cmp(&right.1));
        if let Some((index, _)) = furthest.filter(|(_, away_m)| *away_m > NEAR_M) {
            stretches.extend([(from, index), (index, to)]);
        }
    }
    track.iter().zip(kept).filter(|(_, kept)| *kept).map(|(place, _)| *place).collect()
}

/// Distance of a point from the stretch between two others, m.
fn distance_m(from: &Vector3<f64>, to: &Vector3<f64>, point: &Vector3<f64>) -> f64 {
    let way = to - from;
    let squared = way.norm_squared();
    let share =
        if squared > 0.0 { ((point - from).dot(&way) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (point - from - way * share).norm()
}

/// West, south, east and north ends of all places, degrees.
pub(super) fn bounds(spots: &[Spot]) -> Option<[f64; 4]> {
    let places = || spots.iter().flat_map(|spot| spot.track.iter().chain([&spot.place]));
    let degrees = |axis: usize| extent(places().map(|place| place.lat_lon_deg[axis]));
    let (south, north) = degrees(0)?;
    let (west, east) = degrees(1)?;
    Some([west, south, east, north])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(lat_deg: f64, height_m: f64) -> Place {
        Place { lat_lon_deg: [lat_deg, 19.0], height_m, amsl_m: None }
    }

    #[test]
    fn a_thinned_track_keeps_its_corners_and_nothing_between_them() {
        // Up 100 m, 111 m to the north, down again, and up by 40 m.
        let up = (0..=100).map(|step| place(47.0, f64::from(step)));
        let across = (1..=100).map(|step| place(47.0 + 1e-5 * f64::from(step), 100.0));
        let down = (1..=100).map(|step| place(47.001, 100.0 - f64::from(step)));
        let again = (1..=40).map(|step| place(47.001, f64::from(step)));
        let track: Vec<Place> = up.chain(across).chain(down).chain(again).collect();
        let corners = [(47.0, 0.0), (47.0, 100.0), (47.001, 100.0), (47.001, 0.0), (47.001, 40.0)]
            .map(|(lat_deg, height_m)| place(lat_deg, height_m));
        let found = thinned(&track);
        assert_eq!(found.len(), corners.len(), "{found:?}");
        for (found, corner) in found.iter().zip(corners) {
            assert!((found.lat_lon_deg[0] - corner.lat_lon_deg[0]).abs() < 1e-9);
            assert_eq!(found.height_m, corner.height_m);
        }
        // Up and down on one line: the turn is kept.
        let turn: Vec<Place> = [0.0, 50.0, 0.0].map(|height_m| place(47.0, height_m)).into();
        assert_eq!(thinned(&turn), turn);
        assert_eq!(thinned(&[]), []);
        assert_eq!(thinned(&turn[..1]), turn[..1]);
    }

    #[test]
    fn the_middle_of_both_sides_of_the_date_line_is_on_it() {
        let found = middle_deg([179.999, -179.999, 180.0].into_iter()).unwrap();
        assert!((found.abs() - 180.0).abs() < 1e-9, "{found}");
    }
}
