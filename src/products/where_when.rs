//! Where and when the values of a flight are: UTC, latitude, longitude, heights.
//!
//! What neither log nor plan tells stays unknown.

use nalgebra::Vector3;

use crate::analysis::result::{DroneAnalysis, DroneUpdraft, FlightAnalysis};
use crate::base::frame::{Geodetic, ShowFrame};
use crate::base::time::GpsTime;
use crate::flight::Alignment;
use crate::numeric::upper_median;

/// Logs of one show whose clocks differ by less have one clock, ms: receivers deliver their time late by this or less.
const ONE_CLOCK_MS: i64 = 250;

/// Where a place on the globe comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FixBy {
    /// The drone's own log.
    Log,
    /// The plan: place in the show frame, from its origin and orientation.
    Plan,
}

impl FixBy {
    /// Name in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Log => "log",
            Self::Plan => "plan",
        }
    }
}

/// A place on the globe, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fix {
    /// Latitude and longitude, degrees, with their origin.
    pub lat_lon_deg: Option<([f64; 2], FixBy)>,
    /// Height above take-off, m.
    pub height_m: Option<f64>,
    /// Height above mean sea level, m.
    pub amsl_m: Option<f64>,
}

/// Places and times of a flight's rows.
#[derive(Clone, Debug)]
pub struct WhereWhen<'a> {
    flight: &'a FlightAnalysis,
    /// Show time 0, by most logs.
    zero: Option<GpsTime>,
    /// The plan's frame on the globe; its height is not used.
    frame: Option<ShowFrame>,
    /// Height of the ground above mean sea level, m.
    ground_m: Option<f64>,
}

impl<'a> WhereWhen<'a> {
    /// That of a flight.
    pub fn of(flight: &'a FlightAnalysis) -> Self {
        // Times that count from each drone's own take-off have no common zero.
        let starts = flight.drones.iter().filter(|drone| drone.clock.method != Alignment::Takeoff);
        let starts = starts.filter_map(|drone| drone.clock.start);
        let by_show = flight.drones.iter().any(|drone| drone.clock.method == Alignment::ShowRows);
        let zero = upper_median(starts.map(|start| start.total_ms() as f64).collect())
            .map(|ms| if by_show { whole_second_ms(ms as i64) } else { ms as i64 })
            .and_then(GpsTime::from_total_ms);
        // A show of another program may have no place, and stands at 0, 0.
        let origin =
            flight.site.and_then(|site| site.origin_deg()).filter(|origin| *origin != [0.0; 2]);
        let frame =
            origin.zip(flight.orientation_deg).map(|([lat_deg, lon_deg], orientation_deg)| {
                ShowFrame { origin: Geodetic { lat_deg, lon_deg, amsl_m: 0.0 }, orientation_deg }
            });
        let planned_m = flight.site.and_then(|site| site.ground_amsl_m);
        let logged_m = || {
            let drones = flight.map.iter().flat_map(|map| &map.drones);
            let homes = drones.filter_map(|drone| drone.place.as_ref()?.home_amsl_m);
            upper_median(homes.collect())
        };
        let ground_m = planned_m.or_else(logged_m).filter(|m| m.is_finite());
        Self { flight, zero, frame, ground_m }
    }

    /// UTC of a show time of the whole fleet, ms since 1970.
    pub fn utc_ms(&self, time_s: f64) -> Option<i64> {
        Zero::of(self.zero?).utc_ms(time_s)
    }

    /// Show time 0 of one drone: by its own log where its clock is not the fleet's.
    pub fn zero_of(&self, drone: &DroneUpdraft) -> Option<Zero> {
        let own = self.drone(drone).and_then(|found| found.clock.start);
        let common = self.zero.filter(|zero| {
            own.is_none_or(|own| (own.total_ms() - zero.total_ms()).abs() <= ONE_CLOCK_MS)
        });
        common.or(own).map(Zero::of)
    }

    /// The drone's log in the same flight.
    fn drone(&self, drone: &DroneUpdraft) -> Option<&'a DroneAnalysis> {
        self.flight.drones.iter().find(|other| {
            if drone.slot.is_some() { other.slot == drone.slot } else { other.name == drone.name }
        })
    }

    /// Place of a drone at one of the map's times.
    pub fn fix(&self, drone: &DroneUpdraft, index: usize) -> Fix {
        let place = drone.place.as_ref();
        let own = place.and_then(|place| place.lat_lon_deg.get(index).copied().flatten());
        let shown = || match drone.track_m.get(index).copied().flatten() {
            Some([x_m, y_m, _]) => Some([x_m, y_m]),
            None => drone.position_m.filter(|_| drone.track_m.is_empty()),
        };
        let lat_lon_deg = own
            .map(|deg| (deg, FixBy::Log))
            .or_else(|| Some((self.lat_lon_deg(shown()?)?, FixBy::Plan)))
            .filter(|(deg, _)| deg.iter().all(|deg| deg.is_finite()));
        let tracked = || Some(drone.track_m.get(index).copied().flatten()?[2]);
        let height_m = place
            .and_then(|place| place.height_m.get(index).copied().flatten())
            .or_else(tracked)
            .or((drone.track_m.is_empty() && place.is_none()).then_some(drone.height_m))
            .filter(|m| m.is_finite());
        let amsl_m = height_m.and_then(|height_m| self.amsl_m_of(drone, height_m));
        Fix { lat_lon_deg, height_m, amsl_m }
    }

    /// A place of the show frame (x forward, y left), degrees.
    pub fn lat_lon_deg(&self, [x_m, y_m]: [f64; 2]) -> Option<[f64; 2]> {
        let place = self.frame?.to_geodetic(Vector3::new(x_m, y_m, 0.0));
        let deg = [place.lat_deg, wrapped_deg(place.lon_deg)];
        deg.iter().all(|deg| deg.is_finite()).then_some(deg)
    }

    /// Height above mean sea level of a height above take-off, m.
    pub fn amsl_m(&self, height_m: f64) -> Option<f64> {
        Some(height_m + self.ground_m?).filter(|m| m.is_finite())
    }

    /// That of one drone: above the plan's ground, else above where its log says that it stood.
    pub fn amsl_m_of(&self, drone: &DroneUpdraft, height_m: f64) -> Option<f64> {
        let planned = self.flight.site.and_then(|site| site.ground_amsl_m);
        let logged = || drone.place.as_ref()?.home_amsl_m;
        let home_m = planned.or_else(logged).or(self.ground_m)?;
        Some(height_m + home_m).filter(|m| m.is_finite())
    }

    /// The plan's frame on the globe; `None` where the plan has none.
    pub fn frame(&self) -> Option<ShowFrame> {
        self.frame
    }
}

/// A longitude between -180 and 180 degrees, for places beyond the date line.
pub(super) fn wrapped_deg(lon_deg: f64) -> f64 {
    if lon_deg.abs() <= 180.0 { lon_deg } else { (lon_deg + 180.0).rem_euclid(360.0) - 180.0 }
}

/// The whole second that a show began on: the firmware is told its start in whole seconds of GPS time, and logs show it
/// early by what the receivers' time is late. A start that is no whole second stays as it is.
fn whole_second_ms(ms: i64) -> i64 {
    let second = (ms + 500).div_euclid(1000) * 1000;
    if (second - ms).abs() <= ONE_CLOCK_MS { second } else { ms }
}

/// Show time 0, ms of UTC since 1970.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Zero(i64);

impl Zero {
    fn of(start: GpsTime) -> Self {
        Self(start.to_unix_ms())
    }

    /// UTC of a show time, ms since 1970.
    pub fn utc_ms(self, time_s: f64) -> Option<i64> {
        let ms = (1000.0 * time_s).round();
        (ms.abs() < 1e15).then(|| self.0.saturating_add(ms as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_beyond_the_date_line_are_on_its_other_side() {
        assert_eq!(
            [179.5, -180.0, 180.5, -180.25].map(wrapped_deg),
            [179.5, -180.0, -179.5, 179.75]
        );
    }

    #[test]
    fn a_show_begins_on_a_whole_second_unless_its_logs_say_otherwise() {
        let second = 1_450_000_000_000;
        for ms in [second, second - 250, second + 120] {
            assert_eq!(whole_second_ms(ms), second);
        }
        for ms in [second + 251, second - 400, second + 500] {
            assert_eq!(whole_second_ms(ms), ms, "its start was given by hand");
        }
    }
}
