//! Place and wind beside the vertical air speed, at the seconds of the map: where a drone was on the globe, and the
//! horizontal wind that it leans against.
//!
//! The wind is that of the map's own means over 10 s: the drag of the vehicle turns the mean lean into the flow that meets
//! it, the heading turns that flow to north, and its own way over ground is added. Errors are those of the drag and of a
//! trim that is no lean; both stay the same through a flight, so that changes of the wind are better known than it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::result::UpdraftMap;
use super::running::{RUNNING_S, Running};
use super::statistics::tilt_wind::{LeanDrag, MeanLean, TRIM_DEG};
use super::updraft::DroneSeries;
use crate::flight::{Flight, PlaceBy, Series};
use crate::numeric::{mean, upper_median};

/// Channels are not joined over longer silences than this, s, and places, which receivers may tell once a second.
/// Chosen.
const GAP_S: f64 = 1.0;
const PLACE_GAP_S: f64 = 3.0;
/// Half of the time that a place is a mean of, s.
const HALF_S: f64 = 0.5;
/// Steps in which values are kept: 1 cm on the globe, 1 mm, 1 mm/s.
const STEPS_PER_DEG: f64 = 1e7;
const STEPS_PER_M: f64 = 1e3;

/// Where a drone was on the globe, by its own log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DronePlace {
    /// Origin of the place.
    pub by: PlaceBy,
    /// Latitude and longitude at each of [`UpdraftMap::time_s`], degrees; null where the log does not say.
    pub lat_lon_deg: Vec<Option<[f64; 2]>>,
    /// Height above home at the same times, m.
    pub height_m: Vec<Option<f64>>,
    /// Latitude and longitude where the log begins, which [`super::result::Trace::moved_m`] counts from, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub home_lat_lon_deg: Option<[f64; 2]>,
    /// Height of home above mean sea level, m; absent: the log does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub home_amsl_m: Option<f64>,
}

/// Horizontal wind on a drone, as running 10 s means by its lean.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneWindSeries {
    /// Towards true east and true north at each of [`UpdraftMap::time_s`], m/s; null where it is not known.
    pub east_north_mps: Vec<Option<[f64; 2]>>,
    /// Standard errors of both, from drag and trim: the same in sign through the flight, m/s.
    pub se_mps: Vec<Option<[f64; 2]>>,
}

/// Both at a drone's own seconds, before the fleet's common times are known.
#[derive(Clone, Debug, Default)]
pub(super) struct Beside {
    first_s: i64,
    place: Option<DronePlace>,
    wind: Option<DroneWindSeries>,
}

impl Beside {
    /// What a log tells at the seconds that have been measured.
    pub(super) fn of(flight: &Flight, series: &DroneSeries, drag: LeanDrag<'_>) -> Self {
        let count = series.updraft_mps.len();
        let times = (0..count).map(|index| (series.first_s + index as i64) as f64);
        let wind = Leans::of(flight, series).wind(times.clone(), drag);
        Self { first_s: series.first_s, place: place(flight, times), wind }
    }

    /// Writes it to the drones of a map, which are in the same order.
    pub(super) fn add<'a>(map: &mut UpdraftMap, all: impl Iterator<Item = &'a Self>) {
        let times: Vec<i64> = map.time_s.iter().map(|time_s| *time_s as i64).collect();
        for (drone, own) in map.drones.iter_mut().zip(all) {
            drone.place = own.place.as_ref().map(|place| DronePlace {
                lat_lon_deg: own.spread(&place.lat_lon_deg, &times),
                height_m: own.spread(&place.height_m, &times),
                ..place.clone()
            });
            drone.wind = own.wind.as_ref().map(|wind| DroneWindSeries {
                east_north_mps: own.spread(&wind.east_north_mps, &times),
                se_mps: own.spread(&wind.se_mps, &times),
            });
        }
    }

    fn spread<T: Copy>(&self, values: &[Option<T>], times: &[i64]) -> Vec<Option<T>> {
        let value = |time: &i64| {
            let index = usize::try_from(time - self.first_s).ok()?;
            values.get(index).copied().flatten()
        };
        times.iter().map(value).collect()
    }
}

fn rounded(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps
}

/// `None`: the log knows neither a place nor a height.
fn place(flight: &Flight, times: impl Iterator<Item = f64> + Clone) -> Option<DronePlace> {
    let height_m: Vec<Option<f64>> = times
        .clone()
        .map(|time_s| Some(rounded(around(&flight.height_m, time_s)?, STEPS_PER_M)))
        .collect();
    let Some(globe) = &flight.place else {
        let known = height_m.iter().any(Option::is_some);
        return known.then(|| DronePlace { height_m, ..DronePlace::default() });
    };
    let degrees = |of: fn(&Series, f64) -> Option<f64>, time_s: f64| {
        let place = [of(&globe.lat_deg, time_s)?, of(&globe.lon_deg, time_s)?];
        Some(place.map(|deg| rounded(deg, STEPS_PER_DEG)))
    };
    let begins_s = flight.north_m.time_s.first().copied();
    // What a filter's height drifts by against the receiver's is the same at all heights.
    let homes = globe.amsl_m.time_s.iter().zip(&globe.amsl_m.value);
    let homes = homes.filter_map(|(time, amsl_m)| Some(amsl_m - flight.height_m.at(*time, GAP_S)?));
    Some(DronePlace {
        by: globe.by,
        lat_lon_deg: times.map(|time_s| degrees(around, time_s)).collect(),
        height_m,
        home_lat_lon_deg: begins_s.and_then(|begins_s| degrees(nearest, begins_s)),
        home_amsl_m: upper_median(homes.collect()).map(|amsl_m| rounded(amsl_m, STEPS_PER_M)),
    })
}

/// Mean over the second around a time, else what lies between the samples beside it.
fn around(series: &Series, time_s: f64) -> Option<f64> {
    // A longitude that jumps at the date line has no mean.
    let values = series.between(time_s - HALF_S, time_s + HALF_S);
    let jumps = values.windows(2).any(|pair| (pair[0] - pair[1]).abs() > 180.0);
    if jumps {
        values.first().copied()
    } else {
        mean(values).or_else(|| series.at(time_s, PLACE_GAP_S))
    }
}

/// Value at a time, or the first one after it if it is near.
fn nearest(series: &Series, time_s: f64) -> Option<f64> {
    let next = series.time_s.partition_point(|time| *time < time_s);
    let near = series.time_s.get(next).is_some_and(|time| time - time_s <= PLACE_GAP_S);
    series.value.get(next).copied().filter(|_| near)
}

/// Running means of a drone's attitude.
struct Leans<'a> {
    roll: Running<'a>,
    pitch: Running<'a>,
    flight: &'a Flight,
    /// Whether each second counts: a drone that moves leans into a change of its speed, too.
    counts: Vec<bool>,
    moves: bool,
}

impl<'a> Leans<'a> {
    fn of(flight: &'a Flight, series: &DroneSeries) -> Self {
        let moves = !series.moved_m.is_empty();
        let half = RUNNING_S / 2.0;
        let from_s = series.first_s as f64 - half;
        let to_s = from_s + series.updraft_mps.len() as f64 + RUNNING_S;
        let running = |series| Running::new(series, from_s, to_s);
        Self {
            roll: running(&flight.roll_rad),
            pitch: running(&flight.pitch_rad),
            flight,
            counts: series.updraft_mps.iter().map(|w| !moves || w.is_some()).collect(),
            moves,
        }
    }

    /// `None`: the wind is not known in any second.
    fn wind(
        &self,
        times: impl Iterator<Item = f64>,
        drag: LeanDrag<'_>,
    ) -> Option<DroneWindSeries> {
        let seconds = times.zip(&self.counts);
        let found: Vec<Option<[[f64; 2]; 2]>> =
            seconds.map(|(time_s, counts)| self.second(time_s, drag).filter(|_| *counts)).collect();
        let part = |index: usize| {
            let two = |one: [[f64; 2]; 2]| one[index].map(|mps| rounded(mps, STEPS_PER_M));
            found.iter().map(|one| one.map(two)).collect()
        };
        found
            .iter()
            .any(Option::is_some)
            .then(|| DroneWindSeries { east_north_mps: part(0), se_mps: part(1) })
    }

    /// Wind towards east and north, and its standard errors, m/s.
    fn second(&self, time_s: f64, drag: LeanDrag<'_>) -> Option<[[f64; 2]; 2]> {
        let share = drag.share()?;
        let (roll, pitch) = (self.roll.mean(time_s)?, self.pitch.mean(time_s)?);
        let [sin, cos] = self.heading(time_s)?;
        let [east_mps, north_mps] = self.over_ground_mps(time_s)?;
        let leaning = MeanLean::forward_right_of(roll, pitch);
        // A flow from ahead is a wind towards behind.
        let to_north =
            |[ahead, right]: [f64; 2]| [-(ahead * sin + right * cos), right * sin - ahead * cos];
        let flow = |lean: [f64; 2]| to_north(drag.flow(lean));
        let wind = flow(leaning);
        let trim = TRIM_DEG.to_radians().tan();
        let by_trim = |axis: usize| {
            let off = |trim: f64| {
                let mut lean = leaning;
                lean[axis] += trim;
                flow(lean)
            };
            let (more, less) = (off(trim), off(-trim));
            [(more[0] - less[0]) / 2.0, (more[1] - less[1]) / 2.0]
        };
        let (forward, right) = (by_trim(0), by_trim(1));
        let se = |axis: usize| {
            let squares =
                forward[axis].powi(2) + right[axis].powi(2) + (share * wind[axis]).powi(2);
            squares.sqrt()
        };
        let found = [[wind[0] + east_mps, wind[1] + north_mps], [se(0), se(1)]];
        found.iter().flatten().all(|mps| mps.is_finite()).then_some(found)
    }

    /// Sine and cosine of the mean heading around a time.
    fn heading(&self, time_s: f64) -> Option<[f64; 2]> {
        let half = RUNNING_S / 2.0;
        let headings = self.flight.yaw_deg.between(time_s - half, time_s + half);
        let (sin, cos) = headings.iter().fold((0.0, 0.0), |(sin, cos), heading| {
            let (one, other) = heading.to_radians().sin_cos();
            (sin + one, cos + other)
        });
        let size = f64::hypot(sin, cos);
        (size > 0.0).then(|| [sin / size, cos / size])
    }

    /// Mean velocity towards east and north; where a drone that stays has no positions, none.
    fn over_ground_mps(&self, time_s: f64) -> Option<[f64; 2]> {
        let half = RUNNING_S / 2.0;
        let speed = |series: &Series| {
            let (from, to) = (series.at(time_s - half, GAP_S)?, series.at(time_s + half, GAP_S)?);
            Some((to - from) / RUNNING_S)
        };
        let known = speed(&self.flight.east_m).zip(speed(&self.flight.north_m));
        known.map(|(east, north)| [east, north]).or((!self.moves).then_some([0.0; 2]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Place;

    /// A minute at 10 Hz, as each of the values says.
    fn series(value: impl Fn(f64) -> f64) -> Series {
        let time_s: Vec<f64> = (0..600).map(|index| f64::from(index) / 10.0).collect();
        Series { value: time_s.iter().map(|time_s| value(*time_s)).collect(), time_s }
    }

    fn measured(moves: bool) -> DroneSeries {
        DroneSeries {
            first_s: 10,
            updraft_mps: vec![Some(0.0), None, Some(0.0)],
            mean: crate::base::estimate::Estimate::new(0.0, 0.1),
            systematic_mps: 0.0,
            tilt_deg: 0.0,
            height_m: 50.0,
            measured: None,
            moved_m: if moves { vec![Some([0.0; 3]); 3] } else { Vec::new() },
            levelled: None,
        }
    }

    const DRAG: LeanDrag<'static> = LeanDrag::Faces(38.2);

    /// A wind of 8 m/s from ahead and 6 m/s from the right.
    fn leaning(heading_deg: f64) -> Flight {
        let tangent = |mps: f64| (mps / 38.2_f64).powi(2);
        let (pitch, roll) = (-tangent(8.0).atan(), tangent(6.0).atan());
        Flight {
            roll_rad: series(|_| roll),
            pitch_rad: series(|_| pitch),
            yaw_deg: series(|_| heading_deg),
            ..Flight::default()
        }
    }

    fn wind(flight: &Flight, moves: bool) -> DroneWindSeries {
        Beside::of(flight, &measured(moves), DRAG).wind.unwrap()
    }

    #[test]
    fn wind_blows_away_from_where_a_drone_leans_to() {
        // Nose to the north: from ahead is towards south, from the right towards west.
        let found = wind(&leaning(0.0), false);
        let [east, north] = found.east_north_mps[0].unwrap();
        assert!((east + 6.0).abs() < 0.02 && (north + 8.0).abs() < 0.02, "{east} {north}");
        // Nose to the east: from ahead is towards west, from the right towards north.
        let found = wind(&leaning(90.0), false);
        let [east, north] = found.east_north_mps[0].unwrap();
        assert!((east + 8.0).abs() < 0.02 && (north - 6.0).abs() < 0.02, "{east} {north}");
        // U = 38.2 sqrt(tangent): 0.2 degrees of trim are 0.32 m/s of 8 and 0.424 m/s of 6; the drag is known to 8 %.
        let [se_east, se_north] = found.se_mps[0].unwrap();
        assert!((se_east - f64::hypot(0.32, 0.64)).abs() < 0.002, "{se_east}");
        assert!((se_north - f64::hypot(0.424, 0.48)).abs() < 0.002, "{se_north}");
    }

    #[test]
    fn a_drone_that_flies_with_the_wind_tells_it_too() {
        let mut flight = leaning(0.0);
        flight.east_m = series(|time_s| 3.0 * time_s);
        flight.north_m = series(|_| 0.0);
        let found = wind(&flight, true);
        let [east, _] = found.east_north_mps[0].unwrap();
        assert!((east + 3.0).abs() < 0.02, "{east}");
        assert_eq!(found.east_north_mps[1], None, "its speed changed: the lean is not the wind's");
        flight.east_m = Series::default();
        assert!(Beside::of(&flight, &measured(true), DRAG).wind.is_none());
    }

    #[test]
    fn without_drag_or_heading_there_is_no_wind() {
        let flight = leaning(0.0);
        assert!(Beside::of(&flight, &measured(false), LeanDrag::Unknown).wind.is_none());
        let unaware = Flight { yaw_deg: Series::default(), ..flight };
        assert!(Beside::of(&unaware, &measured(false), DRAG).wind.is_none());
    }

    #[test]
    fn a_place_is_that_of_the_second_and_home_is_below_it() {
        let globe = Place {
            by: PlaceBy::Filter,
            lat_deg: series(|time_s| 47.0 + 1e-5 * time_s),
            lon_deg: series(|_| 19.0),
            amsl_m: series(|time_s| 190.0 + time_s),
        };
        let flight = Flight {
            place: Some(globe),
            height_m: series(|time_s| time_s),
            north_m: series(|_| 0.0),
            ..Flight::default()
        };
        let place = Beside::of(&flight, &measured(false), DRAG).place.unwrap();
        assert_eq!(place.lat_lon_deg[1], Some([47.000_109_5, 19.0]), "10.5 s to 11.4 s");
        assert_eq!(place.height_m[1], Some(10.95));
        assert_eq!((place.home_lat_lon_deg, place.home_amsl_m), (Some([47.0, 19.0]), Some(190.0)));
        let nowhere = Flight { place: None, ..flight };
        let place = Beside::of(&nowhere, &measured(false), DRAG).place.unwrap();
        assert_eq!((place.lat_lon_deg.len(), place.height_m[1]), (0, Some(10.95)));
        assert!(Beside::of(&Flight::default(), &measured(false), DRAG).place.is_none());
    }
}
