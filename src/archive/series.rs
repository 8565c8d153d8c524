//! The series of an `analysis.json`, one drone at a time: however many drones a map has, one of them is in memory.

use std::fmt;
use std::io::Read;

use serde::de::{DeserializeSeed, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::slim::{Flag, Span};
use crate::base::parse;

/// Seconds that a series may have: twelve days.
const MOST_SECONDS: usize = 1 << 20;

/// A list of as many values as a series may have; null and absent are empty.
#[derive(Debug)]
pub struct Values<T>(Vec<T>);

impl<T> Default for Values<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: Copy> Values<Option<T>> {
    /// Value at a second, if there is one.
    pub fn at(&self, index: usize) -> Option<T> {
        self.0.get(index).copied().flatten()
    }

    /// Whether there are none at all.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Values<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Bounded<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Bounded<T> {
            type Value = Values<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of at most {MOST_SECONDS} values")
            }

            fn visit_unit<E>(self) -> Result<Self::Value, E> {
                Ok(Values::default())
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut values = Vec::new();
                while let Some(value) = list.next_element()? {
                    if values.len() == MOST_SECONDS {
                        return Err(A::Error::invalid_length(MOST_SECONDS + 1, &self));
                    }
                    values.push(value);
                }
                Ok(Values(values))
            }
        }
        deserializer.deserialize_any(Bounded(std::marker::PhantomData))
    }
}

/// One drone of a map with its series, or a place of the plan without a log.
#[derive(Debug, Deserialize)]
pub struct Series {
    /// Number of the drone's slot.
    #[serde(default)]
    pub slot: Option<u16>,
    /// Label; absent: a place without a log.
    #[serde(default)]
    pub name: Option<String>,
    /// Position in the show frame, m.
    #[serde(default)]
    pub position_m: Option<[Option<f64>; 2]>,
    /// Track of a drone that moved, m.
    #[serde(default)]
    pub track_m: Values<Option<[f64; 3]>>,
    /// Height above home, m.
    #[serde(default)]
    pub height_m: Option<f64>,
    /// Running estimate, m/s.
    #[serde(default)]
    pub updraft_mps: Values<Option<f64>>,
    /// Statistical error of the estimate, m/s.
    #[serde(default)]
    pub sd_mps: Values<Option<f64>>,
    /// 95 % interval of the true value, m/s.
    #[serde(default)]
    pub interval_mps: Values<Option<[f64; 2]>>,
    /// Posterior mean, m/s.
    #[serde(default)]
    pub posterior_mps: Values<Option<f64>>,
    /// Standard deviation of the posterior, m/s.
    #[serde(default)]
    pub posterior_sd_mps: Values<Option<f64>>,
    /// Doubts by stretches of time.
    #[serde(default)]
    pub quality: Vec<Flag>,
    /// True air, m/s.
    #[serde(default)]
    pub truth_mps: Values<Option<f64>>,
}

/// Taker of one drone after the other: index of the flight, times (show time, s) and series. An error ends the walk.
pub type Taker<'a> = dyn FnMut(usize, &[f64], Series) -> Result<(), String> + 'a;

/// Walks through the maps of an analysis; `spans`: the seconds of each flight's map, for files whose times stand behind the
/// drones.
///
/// # Errors
/// The words of what is wrong with the JSON, or of the taker.
pub fn walk(reader: impl Read, spans: &[Span], take: &mut Taker<'_>) -> Result<(), String> {
    let mut at = At { flight: 0, time_s: Vec::new(), spans, take };
    parse::json_from(reader, Walk { place: Place::Analysis, at: &mut at })
        .map_err(|error| error.to_string())
}

/// Where a walk is.
struct At<'a, 'b> {
    flight: usize,
    time_s: Vec<f64>,
    spans: &'a [Span],
    take: &'a mut Taker<'b>,
}

/// Parts of an analysis that lead to series.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Analysis,
    Flights,
    Flight,
    Map,
    Posterior,
    Drones,
}

impl Place {
    /// The place behind a key of this one.
    fn behind(self, key: &str) -> Option<Self> {
        match (self, key) {
            (Self::Analysis, "flights") => Some(Self::Flights),
            (Self::Flight, "map") => Some(Self::Map),
            (Self::Map, "posterior") => Some(Self::Posterior),
            (Self::Map, "drones") | (Self::Posterior, "filled") => Some(Self::Drones),
            _ => None,
        }
    }
}

struct Walk<'w, 'a, 'b> {
    place: Place,
    at: &'w mut At<'a, 'b>,
}

impl<'de> DeserializeSeed<'de> for Walk<'_, '_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Walk<'_, '_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a part of an analysis")
    }

    /// No map, no posterior.
    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<String>()? {
            if let Some(place) = self.place.behind(&key) {
                map.next_value_seed(Walk { place, at: &mut *self.at })?;
            } else if self.place == Place::Map && key == "time_s" {
                self.at.time_s = map.next_value::<Values<f64>>()?.0;
            } else {
                map.next_value::<IgnoredAny>()?;
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        match self.place {
            Place::Flights => loop {
                let seed = Walk { place: Place::Flight, at: &mut *self.at };
                if list.next_element_seed(seed)?.is_none() {
                    break;
                }
                self.at.flight += 1;
                self.at.time_s.clear();
            },
            Place::Drones => {
                let At { flight, time_s, spans, take } = &mut *self.at;
                let span = spans.get(*flight).copied().unwrap_or_default();
                if time_s.is_empty() && span.count > 0 {
                    let span = Some(span).filter(|span| span.count <= MOST_SECONDS);
                    *time_s = span.and_then(|span| span.times_s()).ok_or_else(|| {
                        A::Error::custom("the times of a map must stand before its drones")
                    })?;
                }
                while let Some(series) = list.next_element::<Series>()? {
                    take(*flight, time_s, series).map_err(A::Error::custom)?;
                }
            }
            _ => while list.next_element::<IgnoredAny>()?.is_some() {},
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{"schema": "updraft.analysis/1", "flights": [
        {"name": "calibration", "map": null, "drones": [{"slot": 9}]},
        {"name": "hover", "map": {"law": "linear", "time_s": [10, 11], "drones": [
            {"slot": 1, "name": "Drone 1", "updraft_mps": [0.5, null], "truth_mps": null},
            {"slot": 2, "name": "Drone 2", "updraft_mps": [1, 2], "track_m": [[1, 2, 3], null]}],
            "posterior": {"fleet": null, "filled": [{"slot": 3, "posterior_mps": [7, 8]}]}}}]}"#;

    #[test]
    fn drones_come_one_by_one_with_their_flight_and_times() {
        let mut seen = Vec::new();
        walk(TEXT.as_bytes(), &[], &mut |flight, time_s, series| {
            assert_eq!(time_s, [10.0, 11.0]);
            seen.push((flight, series.slot, series.updraft_mps.at(1), series.posterior_mps.at(0)));
            Ok(())
        })
        .unwrap();
        let expected = [
            (1, Some(1), None, None),
            (1, Some(2), Some(2.0), None),
            (1, Some(3), None, Some(7.0)),
        ];
        assert_eq!(seen, expected);
    }

    #[test]
    fn drones_before_their_times_and_endless_series_are_refused() {
        let text = r#"{"flights": [{"map": {"drones": [{"updraft_mps": [1]}], "time_s": [5]}}]}"#;
        let uneven = Span { ends_s: Some([5.0, 9.0]), count: 2, is_uneven: true };
        let error = walk(text.as_bytes(), &[uneven], &mut |_, _, _| Ok(())).unwrap_err();
        assert!(error.starts_with("the times of a map must stand before"), "{error}");
        let span = Span { ends_s: Some([5.0, 6.0]), count: 2, is_uneven: false };
        let mut seen = Vec::new();
        walk(text.as_bytes(), &[span], &mut |_, time_s, _| {
            seen.extend_from_slice(time_s);
            Ok(())
        })
        .unwrap();
        assert_eq!(seen, [5.0, 6.0]);
        let long = format!(
            r#"{{"flights": [{{"map": {{"time_s": [0{}]}}}}]}}"#,
            ",0".repeat(MOST_SECONDS)
        );
        let error = walk(long.as_bytes(), &[], &mut |_, _, _| Ok(())).unwrap_err();
        assert!(error.starts_with("invalid length 1048577"), "{error}");
    }
}
