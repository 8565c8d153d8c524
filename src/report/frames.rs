//! A map of the air as a sequence of fields: which times and drones can be shown, and the scale that
//! all of them share.

use crate::analysis::result::UpdraftMap;

use super::axis;
use super::surface::Surface;
use super::text::usable;

/// The scale holds so large a share of all values; the few beyond it take its end's colour, so that
/// one gust does not bleach the rest.
const SHARE_ON_SCALE: f64 = 0.998;
/// Smallest end of the scale, m/s.
const LEAST_MPS: f64 = 0.01;

/// The fields of one flight.
pub(super) struct Frames<'a> {
    map: &'a UpdraftMap,
    /// Indices of [`UpdraftMap::time_s`] at which half of the drones or more have a value.
    pub(super) times: Vec<usize>,
    /// Places of the drones, m, [forward, left].
    pub(super) places: Vec<Option<[f64; 2]>>,
    /// Triangles between the drones that have a value at half of the times or more.
    pub(super) surface: Surface,
    /// Whether the true air is known.
    pub(super) truth_known: bool,
    /// End of the scale of estimate and truth, m/s.
    pub(super) limit_mps: f64,
    /// End of the scale of their difference, m/s.
    pub(super) difference_limit_mps: f64,
}

impl<'a> Frames<'a> {
    /// `None` if no drone has a place or there are no times.
    pub(super) fn of(map: &'a UpdraftMap) -> Option<Self> {
        let value = |drone: usize, time: usize| estimate(map, drone, time);
        let drones = map.drones.len();
        let times: Vec<usize> = (0..map.time_s.len())
            .filter(|&time| map.time_s.get(time).is_some_and(|s| usable(*s)))
            .filter(|&time| {
                let present = (0..drones).filter(|&drone| value(drone, time).is_some()).count();
                present > 0 && 2 * present >= drones
            })
            .collect();
        let places: Vec<Option<[f64; 2]>> = map
            .drones
            .iter()
            .map(|drone| drone.position_m.filter(|p| usable(p[0]) && usable(p[1])))
            .collect();
        if times.is_empty() || places.iter().all(Option::is_none) {
            return None;
        }
        let corners = places
            .iter()
            .enumerate()
            .map(|(drone, place)| {
                let present = times.iter().filter(|&&time| value(drone, time).is_some()).count();
                place.filter(|_| present > 0 && 2 * present >= times.len())
            })
            .collect();
        let mut sizes = Vec::new();
        let mut differences = Vec::new();
        for drone in 0..drones {
            for &time in &times {
                let (estimate, truth) = (value(drone, time), true_air(map, drone, time));
                sizes.extend(estimate.into_iter().chain(truth).map(f64::abs));
                differences.extend(estimate.zip(truth).map(|(w, truth)| (w - truth).abs()));
            }
        }
        Some(Self {
            map,
            times,
            places,
            surface: Surface::over(corners),
            truth_known: !differences.is_empty(),
            limit_mps: scale_end(sizes),
            difference_limit_mps: scale_end(differences),
        })
    }

    /// Show time of one of [`Frames::times`], s.
    pub(super) fn seconds(&self, time: usize) -> f64 {
        self.map.time_s.get(time).copied().unwrap_or(f64::NAN)
    }

    /// Estimate of a drone at a time, by their indices, m/s.
    pub(super) fn estimate(&self, drone: usize, time: usize) -> Option<f64> {
        estimate(self.map, drone, time)
    }

    /// Posterior mean of a drone at a time with its standard deviation, m/s.
    pub(super) fn posterior(&self, drone: usize, time: usize) -> Option<[f64; 2]> {
        let drone = self.map.drones.get(drone)?;
        let value = |of: &[Option<f64>]| of.get(time).copied().flatten().filter(|w| usable(*w));
        Some([value(&drone.posterior_mps)?, value(&drone.posterior_sd_mps)?])
    }

    /// Places of drones without a log whose air their neighbours tell, [forward, left], m.
    pub(super) fn lost(&self) -> Vec<[f64; 2]> {
        let filled = self.map.posterior.iter().flat_map(|posterior| &posterior.filled);
        let places = filled.map(|drone| drone.position_m);
        places.filter(|place| usable(place[0]) && usable(place[1])).collect()
    }

    /// The true air, m/s.
    pub(super) fn truth(&self, drone: usize, time: usize) -> Option<f64> {
        true_air(self.map, drone, time)
    }

    /// The time whose field is closest to a show time.
    pub(super) fn closest(&self, show_s: f64) -> Option<usize> {
        let distance = |time: &usize| (self.seconds(*time) - show_s).abs();
        self.times.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

fn estimate(map: &UpdraftMap, drone: usize, time: usize) -> Option<f64> {
    map.drones.get(drone)?.updraft_mps.get(time).copied().flatten().filter(|w| usable(*w))
}

fn true_air(map: &UpdraftMap, drone: usize, time: usize) -> Option<f64> {
    map.drones.get(drone)?.truth_at(time).filter(|w| usable(*w))
}

/// A round number around nearly all of these sizes.
pub(super) fn scale_end(mut sizes: Vec<f64>) -> f64 {
    sizes.sort_by(f64::total_cmp);
    let place = (SHARE_ON_SCALE * sizes.len() as f64).ceil() as usize;
    let largest = sizes.get(place.saturating_sub(1)).copied().unwrap_or(0.0).max(LEAST_MPS);
    axis::scale_end(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_ends_on_a_round_number_and_ignores_one_gust() {
        assert!((scale_end(vec![1.13; 10]) - 1.25).abs() < 1e-9);
        let mut sizes = vec![0.9; 2000];
        sizes.push(50.0);
        assert!((scale_end(sizes) - 1.0).abs() < 1e-9);
        assert!(scale_end(Vec::new()) > 0.0);
    }
}
