//! The strongest and the weakest air: where, and when.

use statrs::distribution::{ContinuousCDF as _, Normal};

use crate::analysis::result::{DroneUpdraft, FlightAnalysis, UpdraftMap};
use crate::base::estimate::Estimate;
use crate::numeric::median;
use crate::report::text::{clean, fixed, signed_estimate, usable};

use super::air::compass;
use super::place::{When, day_and_time, when};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// A drone closer to the origin than this stands on it, m.
const AT_ORIGIN_M: f64 = 1.0;

/// The extremes of a map that are more than noise.
pub(super) struct Extremes {
    said: Vec<String>,
    /// The air was not the same everywhere and always.
    pub(super) varies: bool,
}

impl Extremes {
    /// Looks for them: of as many values as there are, the highest and the lowest differ by chance, too.
    pub(super) fn of(flight: &FlightAnalysis, map: &UpdraftMap) -> Self {
        let places = map.drones.iter().filter_map(|drone| {
            let mean = drone.posterior_mean.unwrap_or(drone.mean);
            usable(mean.value).then_some((mean, drone))
        });
        let when = when(flight);
        let seconds = map.drones.iter().flat_map(|drone| {
            map.time_s.iter().enumerate().filter_map(move |(index, time_s)| {
                let value = second(drone, index)?;
                usable(value.value).then_some((value, (drone, *time_s)))
            })
        });
        let shared_mps = shared_mps(map).unwrap_or(0.0);
        let mut said = Vec::new();
        let mut varies = false;
        match ends(places.clone()) {
            Some([(high, at_high), (low, at_low)])
                if differ(shared_mps, [high, low], places.count()) =>
            {
                varies = true;
                let at = |drone: &DroneUpdraft| place(flight, drone);
                said.push(format!(
                    "Over the whole time the vertical speed was largest at {} with {} m/s and smallest at {} with {} \
                     m/s.{}",
                    at(at_high),
                    signed_estimate(high),
                    at(at_low),
                    signed_estimate(low),
                    if is_shared(map) {
                        " All drones share most of these errors: differences between them are known better."
                    } else {
                        ""
                    },
                ));
            }
            Some(_) => said.push(
                "Between the drones no difference over the whole time can be told from chance."
                    .to_owned(),
            ),
            None => {}
        }
        if let Some([(high, at_high), (low, at_low)]) = ends(seconds.clone())
            // Ten seconds are about one independent value.
            && differ(shared_mps, [high, low], seconds.count() / 10)
        {
            varies = true;
            let at = |(drone, time_s): (&DroneUpdraft, f64)| {
                format!("{} at {}", label(drone), moment(when, time_s))
            };
            said.push(format!(
                "The strongest 10 s were {} m/s ({}), the weakest {} m/s ({}).",
                signed_estimate(high),
                at(at_high),
                signed_estimate(low),
                at(at_low),
            ));
        }
        Self { said, varies }
    }

    /// Sentences on both.
    pub(super) fn sentences(self) -> Vec<String> {
        self.said
    }
}

/// Whether the highest and the lowest of so many values differ by more than the errors that they do not share.
fn differ(shared_mps: f64, ends: [Estimate; 2], values: usize) -> bool {
    let own = |of: &Estimate| {
        let rest = of.se.powi(2) - shared_mps.powi(2);
        // Where the fleet's share is told otherwise than in this value's error, half of it is its own.
        if rest > 0.0 { rest.sqrt() } else { 0.5 * of.se }
    };
    // Intervals that hold all of the values at once (Bonferroni).
    let share = 0.025 / values.max(2) as f64;
    let width = Normal::standard().inverse_cdf(1.0 - share);
    let [high, low] = &ends;
    high.value - low.value > width * (own(high) + own(low))
}

/// The highest and the lowest; `None` below two.
fn ends<T: Copy>(
    values: impl Iterator<Item = (Estimate, T)> + Clone,
) -> Option<[(Estimate, T); 2]> {
    let by = |a: &(Estimate, T), b: &(Estimate, T)| a.0.value.total_cmp(&b.0.value);
    values.clone().nth(1)?;
    Some([values.clone().max_by(by)?, values.min_by(by)?])
}

/// One second's value with all of its error: the posterior's where there is one.
fn second(drone: &DroneUpdraft, index: usize) -> Option<Estimate> {
    let at = |values: &[Option<f64>]| values.get(index).copied().flatten();
    if let Some((value, se)) = at(&drone.posterior_mps).zip(at(&drone.posterior_sd_mps)) {
        return Some(Estimate::new(value, se));
    }
    let value = at(&drone.updraft_mps)?;
    let interval = drone.interval_mps.get(index).copied().flatten();
    let se = interval.map_or(f64::NAN, |[low, high]| (high - low) / (2.0 * NORMAL));
    Some(Estimate::new(value, se))
}

/// Error that all drones share, m/s: of the posterior where the drones' means are its.
fn shared_mps(map: &UpdraftMap) -> Option<f64> {
    let is_posterior = map.drones.iter().any(|drone| drone.posterior_mean.is_some());
    let fleet = map.posterior.as_ref().filter(|_| is_posterior).and_then(|map| map.fleet);
    let plain = map.common.map(|common| common.se_mps);
    fleet.map(|fleet| fleet.se).or(plain).filter(|se| usable(*se))
}

/// Whether most of a middle drone's error is the fleet's.
fn is_shared(map: &UpdraftMap) -> bool {
    let Some(shared_mps) = shared_mps(map) else { return false };
    let of = |drone: &DroneUpdraft| drone.posterior_mean.unwrap_or(drone.mean).se;
    let errors = map.drones.iter().map(of).filter(|se| usable(*se));
    median(errors.collect()).is_some_and(|one| shared_mps.powi(2) > one.powi(2) / 2.0)
}

fn label(drone: &DroneUpdraft) -> String {
    let name = clean(&drone.name);
    match drone.slot {
        Some(slot) if name.is_empty() => format!("slot {slot}"),
        _ => name,
    }
}

/// `Drone 15, 12 m north-west of the show's origin`
fn place(flight: &FlightAnalysis, drone: &DroneUpdraft) -> String {
    let where_it_is =
        drone.position_m.filter(|_| drone.track_m.is_empty()).zip(flight.orientation_deg);
    let Some(([x, y], forward_deg)) =
        where_it_is.filter(|(p, deg)| usable(p[0] + p[1]) && usable(*deg))
    else {
        return label(drone);
    };
    let distance = x.hypot(y);
    if distance < AT_ORIGIN_M {
        return format!("{} (on the show's origin)", label(drone));
    }
    let bearing = forward_deg - y.atan2(x).to_degrees();
    format!("{} ({} m {} of the show's origin)", label(drone), fixed(distance, 0), compass(bearing))
}

/// `12:03:20 UTC`, else `96 s of show time`.
pub(super) fn moment(when: Option<When>, time_s: f64) -> String {
    when.and_then(|when| when.unix_s(time_s)).map_or_else(
        || format!("{} s of show time", fixed(time_s, 0)),
        |unix_s| format!("{} UTC", day_and_time(unix_s).1),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_share_hides_no_difference() {
        let ends = [Estimate::new(0.22, 0.25), Estimate::new(-0.33, 0.25)];
        assert!(differ(0.245, ends, 21), "5 cm/s of its own each");
        assert!(!differ(0.09, ends, 21));
    }
}
