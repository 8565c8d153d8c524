//! Place of the vehicle on the globe, as its own log has it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Series;
use super::channels::Messages;

/// Origin of a place on the globe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlaceBy {
    /// The position filter (POS): satellites and inertial sensors together.
    #[default]
    Filter,
    /// The first satellite receiver (GPS), as it is.
    Receiver,
}

/// Place of the vehicle over time.
#[derive(Clone, Debug, Default)]
pub struct Place {
    /// Origin of the place.
    pub by: PlaceBy,
    /// Latitude, degrees, north positive.
    pub lat_deg: Series,
    /// Longitude, degrees, east positive.
    pub lon_deg: Series,
    /// Height above mean sea level, m, by the geoid of the receiver; empty if the log has none.
    pub amsl_m: Series,
}

impl Place {
    /// The best that the messages have, over board time: the filter's, else the receiver's.
    pub(super) fn of(messages: &Messages) -> Option<Self> {
        [PlaceBy::Filter, PlaceBy::Receiver].into_iter().find_map(|by| {
            let mut place = Self { by, ..Self::default() };
            let rows = match by {
                PlaceBy::Filter => messages.filter_places(),
                PlaceBy::Receiver => messages.receiver_places(),
            };
            for (time_s, [lat_deg, lon_deg, amsl_m]) in rows {
                if place.lat_deg.time_s.last().is_some_and(|last| time_s <= *last) {
                    continue;
                }
                place.lat_deg.push(time_s, lat_deg);
                place.lon_deg.push(time_s, lon_deg);
                if amsl_m.is_finite() {
                    place.amsl_m.push(time_s, amsl_m);
                }
            }
            (!place.lat_deg.is_empty()).then_some(place)
        })
    }

    /// The same with each of its channels changed.
    pub(super) fn map(self, change: impl Fn(Series) -> Series) -> Self {
        Self {
            by: self.by,
            lat_deg: change(self.lat_deg),
            lon_deg: change(self.lon_deg),
            amsl_m: change(self.amsl_m),
        }
    }
}

impl Series {
    /// Adds a sample at the end.
    fn push(&mut self, time_s: f64, value: f64) {
        self.time_s.push(time_s);
        self.value.push(value);
    }
}
