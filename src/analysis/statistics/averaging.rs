//! Allan deviation: how much averages over neighbouring spans of a hover differ.
//!
//! It falls with the length of the averages while they average noise and short gusts away, and rises
//! again when slow motion of the air and drift of the pulse take over. Its minimum says how well neighbouring
//! averages repeat, not how near they are to the mean of the air: in slow air it is at the shortest average.
//! How long a baseline must be is said by `super::baseline`.

use std::fmt::Write as _;

use crate::numeric::Sorted;

use super::result::{Averaging, DroneAveraging, Interval, Reached};
use super::words::digits;

/// Each averaging time is longer than the one before by about this factor.
const FACTOR: f64 = 1.25;
/// A deviation needs this many pairs of neighbouring averages.
const FEWEST_PAIRS: usize = 10;
/// The longest average is this share of the record.
const LONGEST_SHARE: usize = 3;
/// Deviations for which the shortest average is given, m/s.
const ROUND_MPS: [f64; 6] = [0.5, 0.3, 0.2, 0.1, 0.05, 0.02];

/// One drone's vertical air speed at whole seconds, m/s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label of the drone.
    pub name: String,
    /// Means over each second, not smoothed; `None` in gaps.
    pub values_mps: Vec<Option<f64>>,
}

/// Allan deviations of a fleet for averages from 1 s to a third of the record.
///
/// # Errors
///
/// The reason why there are none.
pub fn averaging(fleet: &[Seconds]) -> Result<Averaging, String> {
    let length = fleet.iter().map(|drone| drone.values_mps.len()).max().unwrap_or(0);
    if length < super::field::SHORTEST_S {
        return Err(format!(
            "no averaging times: the record has {length} s, and {} s are the least that could say \
             anything (hover longer)",
            super::field::SHORTEST_S
        ));
    }
    let mut spans: Vec<usize> = vec![1];
    while let Some(last) = spans.last().copied() {
        let next = ((last as f64 * FACTOR).round() as usize).max(last + 1);
        if next > length / LONGEST_SHARE {
            break;
        }
        spans.push(next);
    }
    let drones: Vec<DroneAveraging> = fleet
        .iter()
        .map(|drone| {
            let sums = Sums::of(&drone.values_mps);
            DroneAveraging {
                slot: drone.slot,
                name: drone.name.clone(),
                deviation_mps: spans.iter().map(|span| sums.deviation(*span)).collect(),
            }
        })
        .collect();
    let mut found = Averaging { drones, ..Averaging::default() };
    for (index, span) in spans.iter().enumerate() {
        let mut values: Vec<f64> = found
            .drones
            .iter()
            .filter_map(|drone| drone.deviation_mps.get(index).copied().flatten())
            .collect();
        // Where gaps leave few drones the median would jump.
        if values.is_empty() || 2 * values.len() < fleet.len() {
            break;
        }
        let sorted = Sorted::of(&mut values);
        let at = |share: f64| sorted.quantile(share).unwrap_or(f64::NAN);
        found.averaging_s.push(*span as f64);
        found.median_mps.push(at(0.5));
        found.quartiles_mps.push(Interval { low: at(0.25), high: at(0.75) });
    }
    let kept = found.averaging_s.len();
    for drone in &mut found.drones {
        drone.deviation_mps.truncate(kept);
    }
    if kept == 0 {
        return Err("no averaging times: gaps leave no neighbouring averages".to_owned());
    }
    let pairs = || found.averaging_s.iter().zip(&found.median_mps);
    let reached = |(averaging_s, deviation_mps): (&f64, &f64)| Reached {
        averaging_s: *averaging_s,
        deviation_mps: *deviation_mps,
    };
    found.best = pairs().min_by(|left, right| left.1.total_cmp(right.1)).map(reached);
    found.reached = ROUND_MPS
        .iter()
        .filter_map(|level| {
            let first = pairs().find(|(_, deviation)| *deviation <= level)?;
            Some(Reached { averaging_s: *first.0, deviation_mps: *level })
        })
        .collect();
    found.words = sentence(&found);
    Ok(found)
}

fn sentence(found: &Averaging) -> String {
    let (Some(best), Some(longest)) = (found.best, found.averaging_s.last()) else {
        return String::new();
    };
    let deviation = format!("{:.3} m/s", best.deviation_mps);
    let mut text = if best.averaging_s >= *longest {
        format!(
            "the longer averages are the better they repeat, up to {longest:.0} s at least, where \
             neighbouring ones differ by {deviation} (Allan deviation, median of the fleet)"
        )
    } else {
        format!(
            "averages of {:.0} s repeat best: neighbouring ones differ by {deviation} (Allan deviation, \
             median of the fleet), and longer ones by more, as the air itself changes",
            best.averaging_s
        )
    };
    // The largest round value that is not reached at once, and the smallest that is reached.
    let first = found.averaging_s.first().copied().unwrap_or(0.0);
    let late: Vec<&Reached> =
        found.reached.iter().filter(|reached| reached.averaging_s > first).collect();
    if let Some(reached) = late.last() {
        let (deviation, span) = (digits(reached.deviation_mps), digits(reached.averaging_s));
        let _ = write!(text, "; {deviation} m/s is reached with {span} s");
    }
    text
}

/// Sums and counts up to each second.
struct Sums {
    sum: Vec<f64>,
    known: Vec<usize>,
}

impl Sums {
    fn of(values: &[Option<f64>]) -> Self {
        let (mut sum, mut known) = (vec![0.0], vec![0]);
        let (mut total, mut count) = (0.0, 0);
        for value in values {
            if let Some(value) = value.filter(|value| value.is_finite()) {
                total += value;
                count += 1;
            }
            sum.push(total);
            known.push(count);
        }
        Self { sum, known }
    }

    /// Overlapping Allan deviation for averages over a span of seconds without a gap.
    fn deviation(&self, span: usize) -> Option<f64> {
        let mean = |from: usize| {
            let whole = self.known.get(from + span)? - self.known.get(from)? == span;
            whole.then_some((self.sum.get(from + span)? - self.sum.get(from)?) / span as f64)
        };
        let starts = self.sum.len().checked_sub(2 * span)?;
        let (mut squares, mut pairs) = (0.0, 0);
        for start in 0..starts {
            if let Some((one, next)) = mean(start).zip(mean(start + span)) {
                squares += (next - one).powi(2);
                pairs += 1;
            }
        }
        (pairs >= FEWEST_PAIRS).then(|| (squares / (2.0 * pairs as f64)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::{Purpose, stream};
    use rand_distr::{Distribution as _, StandardNormal};

    fn fleet(value: impl Fn(usize, f64) -> f64) -> Vec<Seconds> {
        let drone = |number: u64| {
            let mut rng = stream(5, number, Purpose::Sensors);
            let values_mps = (0..600)
                .map(|second| Some(value(second, StandardNormal.sample(&mut rng))))
                .collect();
            Seconds { slot: None, name: format!("{number}"), values_mps }
        };
        (0..20).map(drone).collect()
    }

    #[test]
    fn white_noise_falls_with_the_root_of_time() {
        let found = averaging(&fleet(|_, normal| 0.4 * normal)).unwrap();
        for (span, deviation) in found.averaging_s.iter().zip(&found.median_mps) {
            let share = deviation / (0.4 / span.sqrt());
            assert!((0.75..1.2).contains(&share), "{span} s: {share}");
        }
        assert!(found.best.unwrap().averaging_s > 100.0);
        assert!(found.words.starts_with("the longer"), "{}", found.words);
        let reached = found.reached.iter().find(|one| one.deviation_mps == 0.1).unwrap();
        assert!((14.0..20.0).contains(&reached.averaging_s), "(0.4 / 0.1)² s: {reached:?}");
    }

    #[test]
    fn a_drift_sets_the_best_time() {
        // Noise of 0.4 m/s in a second and a drift of 1 m/s in 600 s: 0.16 / t + (t / 600)² / 2 is
        // smallest at t = (0.16 * 600²)^(1/3) = 38.6 s.
        let drifting = fleet(|second, normal| 0.4 * normal + second as f64 / 600.0);
        let best = averaging(&drifting).unwrap().best.unwrap();
        assert!((25.0..60.0).contains(&best.averaging_s), "{best:?}");
        let expected = (0.16 / 38.6 + (38.6_f64 / 600.0).powi(2) / 2.0).sqrt();
        assert!((best.deviation_mps / expected - 1.0).abs() < 0.1, "{best:?} {expected}");
    }

    #[test]
    fn gaps_and_short_records_are_told() {
        let mut gappy = fleet(|_, normal| normal);
        for drone in &mut gappy {
            drone.values_mps.iter_mut().step_by(20).for_each(|value| *value = None);
        }
        let found = averaging(&gappy).unwrap();
        assert!(found.averaging_s.last().unwrap() < &20.0, "no longer span is without a gap");
        let short: Vec<Seconds> = gappy
            .into_iter()
            .map(|mut drone| {
                drone.values_mps.truncate(59);
                drone
            })
            .collect();
        insta::assert_snapshot!(averaging(&short).unwrap_err());
    }
}
