//! Flights of the model as it is, in the updrafts that a search tries: searches for other effects in the same flight
//! begin with the same ones.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::compare::Comparison;
use super::error::GapError;
use super::explain::Seen;
use super::gls::Start;
use super::memory::Digest;

/// What a flight of the model follows from: the comparison that tells the wind to begin with, and the updraft.
type Flight = (bool, [u64; 7]);

/// A flight of the model beside a comparison, fitted from some noise and gusts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct View(Flight, Digest);

impl View {
    /// Of the flight in an updraft, m/s, with gusts, m/s.
    pub(super) fn of(
        near: &Comparison,
        updraft_mps: f64,
        (start, gusts_mps): (&Start, f64),
    ) -> Self {
        let mut digest = Digest::new();
        start.add_to(&mut digest);
        digest.add_all(&[gusts_mps]);
        Self(flight(Some(near), updraft_mps), digest)
    }
}

/// What was flown so far with one model against the same logs.
#[derive(Debug, Default)]
pub(super) struct ModelFlights {
    flown: Mutex<BTreeMap<Flight, Comparison>>,
    likely: Mutex<BTreeMap<View, Option<f64>>>,
    seen: Mutex<BTreeMap<View, Arc<Seen>>>,
}

impl ModelFlights {
    /// The comparison in an updraft, m/s, beside one that tells the wind, if there is one; flown if it was not.
    ///
    /// # Errors
    /// Those of `fly`.
    pub(super) fn flown(
        &self,
        near: Option<&Comparison>,
        updraft_mps: f64,
        fly: impl FnOnce() -> Result<Comparison, GapError>,
    ) -> Result<Comparison, GapError> {
        let key = flight(near, updraft_mps);
        if let Some(known) = locked(&self.flown).get(&key) {
            return Ok(known.clone());
        }
        let flown = fly()?;
        locked(&self.flown).insert(key, flown.clone());
        Ok(flown)
    }

    /// How likely that flight is, nats; `None`: it cannot be flown so.
    pub(super) fn likely(&self, view: View, fit: impl FnOnce() -> Option<f64>) -> Option<f64> {
        if let Some(known) = locked(&self.likely).get(&view) {
            return *known;
        }
        let likely = fit();
        locked(&self.likely).insert(view, likely);
        likely
    }

    /// That flight as it is seen, looked at if it was not.
    ///
    /// # Errors
    /// Those of `look`.
    pub(super) fn seen(
        &self,
        view: View,
        look: impl FnOnce() -> Result<Seen, GapError>,
    ) -> Result<Arc<Seen>, GapError> {
        if let Some(known) = locked(&self.seen).get(&view) {
            return Ok(Arc::clone(known));
        }
        let seen = Arc::new(look()?);
        locked(&self.seen).insert(view, Arc::clone(&seen));
        Ok(seen)
    }
}

/// A search that panicked leaves whole entries behind.
fn locked<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

fn flight(near: Option<&Comparison>, updraft_mps: f64) -> Flight {
    let Some(near) = near else { return (false, [updraft_mps.to_bits(); 7]) };
    let [x_mps, y_mps, z_mps] = near.flown_mps;
    let [wind_x_mps, wind_y_mps] = near.wind.mean_mps;
    let near_updraft_mps = near.scene.updraft_mps;
    let of = [x_mps, y_mps, z_mps, wind_x_mps, wind_y_mps, near_updraft_mps, updraft_mps];
    (true, of.map(f64::to_bits))
}

#[cfg(test)]
mod tests {
    use super::super::noise::Hyper;
    use super::super::trial;
    use super::*;

    #[test]
    fn a_flight_is_flown_once_from_each_beginning() {
        let data = trial::data(2, |_, _| 0.0);
        let comparison = trial::comparison(&data);
        let flights = ModelFlights::default();
        let mut flown = 0;
        let mut fly = |near: Option<&Comparison>, updraft_mps: f64| {
            let count = || {
                flown += 1;
                Ok(comparison.clone())
            };
            flights.flown(near, updraft_mps, count).unwrap();
            flown
        };
        assert_eq!([fly(None, 0.0), fly(None, 0.0)], [1, 1]);
        assert_eq!([fly(Some(&comparison), 0.0), fly(Some(&comparison), 0.0)], [2, 2]);
        assert_eq!([fly(Some(&comparison), 0.5), fly(None, 0.0)], [3, 3]);
        let elsewhere = comparison.clone().in_updraft(1.0);
        assert_eq!(fly(Some(&elsewhere), 0.5), 4, "the wind is told by another comparison");
    }

    #[test]
    fn a_likelihood_is_of_one_noise() {
        let data = trial::data(2, |_, _| 0.0);
        let comparison = trial::comparison(&data);
        let flights = ModelFlights::default();
        let likely = |hyper: Hyper, gusts_mps: f64, nats: f64| {
            let view = View::of(&comparison, 0.0, (&hyper.into(), gusts_mps));
            flights.likely(view, || Some(nats))
        };
        let mut louder = Hyper::default();
        louder.0[0] += 1.0;
        assert_eq!(likely(Hyper::default(), 0.0, 1.0), Some(1.0));
        assert_eq!(likely(louder, 0.0, 2.0), Some(2.0));
        assert_eq!(likely(Hyper::default(), 0.3, 3.0), Some(3.0));
        assert_eq!(likely(Hyper::default(), 0.0, 4.0), Some(1.0));
    }
}
