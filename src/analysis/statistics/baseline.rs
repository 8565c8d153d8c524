//! How long a baseline must be: the answer in minutes, from the integral time of the air.

use std::fmt::Write as _;

use super::averaging::Seconds;
use super::integral::{Known, Settling, settling};
use super::result::{Baseline, BaselineOf, Interval, NeededAverage};
use crate::numeric::mean;

/// Standard errors for which the length of an average is given, m/s.
const ERRORS_MPS: [f64; 2] = [0.1, 0.2];
/// Shorter times are none in tenths of minutes, min.
const SHORTEST_MIN: f64 = 0.05;
/// The fleet's mean counts where this share of the drones has a value.
const FEWEST_SHARE: f64 = 0.5;

/// How long averages must be over the air that a fleet met; `None` where its record does not tell.
pub(in crate::analysis) fn baseline(fleet: &[Seconds]) -> Option<Baseline> {
    let records: Vec<&[Option<f64>]> =
        fleet.iter().map(|drone| drone.values_mps.as_slice()).collect();
    let drone = of(&settling(&records)?);
    let over_fleet = (records.len() > 1).then(|| fleet_mean(&records));
    let fleet = over_fleet.and_then(|mean| settling(&[&mean])).map(|found| of(&found));
    let length_s = records.iter().map(|record| record.len()).max()? as f64;
    let mut found = Baseline { record_s: length_s, drone, fleet, words: String::new() };
    found.words = sentence(&found);
    Some(found)
}

/// Mean over the drones in each second, each about its own mean: who is missing does not shift it.
fn fleet_mean(records: &[&[Option<f64>]]) -> Vec<Option<f64>> {
    let centre: Vec<f64> =
        records.iter().map(|record| mean(record.iter().flatten()).unwrap_or_default()).collect();
    let longest = records.iter().map(|record| record.len()).max().unwrap_or_default();
    (0..longest)
        .map(|second| {
            let values: Vec<f64> = records
                .iter()
                .zip(&centre)
                .filter_map(|(record, centre)| {
                    Some(record.get(second).copied().flatten()? - centre)
                })
                .collect();
            mean(&values).filter(|_| values.len() as f64 >= FEWEST_SHARE * records.len() as f64)
        })
        .collect()
}

fn of(found: &Settling) -> BaselineOf {
    let interval = |known: Known| Interval { low: known.interval[0], high: known.interval[1] };
    let needed = |error_mps: f64| {
        let length = found.length_s(error_mps);
        NeededAverage {
            error_mps,
            minutes: length.value / 60.0,
            interval_min: Interval {
                low: length.interval[0] / 60.0,
                high: length.interval[1] / 60.0,
            },
        }
    };
    BaselineOf {
        sd_mps: found.sd_mps.value,
        sd_interval_mps: interval(found.sd_mps),
        integral_time_s: found.time_s.value,
        integral_time_interval_s: interval(found.time_s),
        is_open: found.is_open,
        needed: ERRORS_MPS.map(needed).into(),
    }
}

/// `14 min (8 to 30)`.
pub(in crate::analysis) fn minutes(needed: &NeededAverage, is_open: bool) -> String {
    let digits = |value: f64| {
        let decimals = usize::from(value < 9.95);
        format!("{value:.decimals$}")
    };
    let NeededAverage { minutes, interval_min, .. } = needed;
    if is_open && interval_min.low < SHORTEST_MIN {
        return "a time that this record does not tell".to_owned();
    }
    if !is_open && interval_min.high < SHORTEST_MIN {
        return "less than 0.1 min".to_owned();
    }
    if is_open {
        return format!("more than {} min", digits(interval_min.low));
    }
    let [low, high] = [interval_min.low, interval_min.high].map(digits);
    format!("{} min (95 %: {low} to {high})", digits(*minutes))
}

/// `14 min (95 %: 8 to 30) for 0.1 m/s, and 3.4 min (95 %: 2.1 to 7.6) for 0.2 m/s`.
fn needed(one: &BaselineOf) -> String {
    let is_told = |needed: &NeededAverage| !one.is_open || needed.interval_min.low >= SHORTEST_MIN;
    if !one.needed.iter().any(is_told) {
        let errors: Vec<String> =
            one.needed.iter().map(|needed| format!("{} m/s", needed.error_mps)).collect();
        return format!("a time that this record does not tell for {}", errors.join(" or "));
    }
    let mut text = String::new();
    let mut before = false;
    for needed in &one.needed {
        let lead = if before { ", and " } else { "" };
        // A bound that is too short for tenths of a minute follows from the one before: twice the error takes a
        // quarter of the time.
        let length = if before && !is_told(needed) {
            "a quarter of that".to_owned()
        } else {
            minutes(needed, one.is_open)
        };
        let _ = write!(text, "{lead}{length} for {} m/s", needed.error_mps);
        before = true;
    }
    text
}

/// Whether the bound of the fleet's length is none beside a drone's, which is known: it is too short to be told, or longer.
fn exceeds(fleet: &BaselineOf, drone: &BaselineOf) -> bool {
    let longer = fleet.needed.iter().zip(&drone.needed).all(|(fleet, drone)| {
        let low = fleet.interval_min.low;
        low < SHORTEST_MIN || low > drone.interval_min.high
    });
    !drone.is_open && longer
}

fn sentence(found: &Baseline) -> String {
    let drone = &found.drone;
    let Interval { low, high } = drone.integral_time_interval_s;
    let time = if drone.is_open {
        format!("longer than {low:.0} s")
    } else {
        format!("of {:.0} s (95 %: {low:.0} to {high:.0})", drone.integral_time_s)
    };
    let mut text = format!(
        "A drone's baseline needs {}: the mean over t has a standard error of σ √(2 T/t), in air of σ = {:.2} m/s \
         with an integral time T {time}",
        needed(drone),
        drone.sd_mps
    );
    if let Some(fleet) = &found.fleet {
        // The mean of all drones is no noisier than one: its record tells less of it, and not that it needs longer.
        let told = if fleet.is_open && exceeds(fleet, drone) {
            "no more than that".to_owned()
        } else {
            needed(fleet)
        };
        let _ = write!(text, "; the mean of all drones needs {told}");
    }
    let _ = write!(
        text,
        "; air that is slower than this record of {:.0} s is not in it",
        found.record_s
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::{Purpose, stream};
    use rand_distr::{Distribution as _, StandardNormal};

    /// Air of 0.5 m/s with a time of 20 s, a share of which all drones have in common.
    fn fleet(drones: u64, shared: f64) -> Vec<Seconds> {
        let series = |number: u64| -> Vec<f64> {
            let mut rng = stream(8, number, Purpose::Sensors);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let decay = (-1.0_f64 / 20.0).exp();
            let mut air = 0.5 * normal();
            (0..1200)
                .map(|_| {
                    air = decay * air + 0.5 * (1.0 - decay * decay).sqrt() * normal();
                    air
                })
                .collect()
        };
        let common = series(100);
        (0..drones)
            .map(|drone| {
                let own = series(drone);
                let both = own.iter().zip(&common).map(|(own, common)| {
                    Some((1.0 - shared).sqrt() * own + shared.sqrt() * common)
                });
                Seconds { slot: None, name: String::new(), values_mps: both.collect() }
            })
            .collect()
    }

    #[test]
    fn minutes_are_those_of_the_integral_time() {
        // 2 sigma² T / e²: 1000 s for 0.1 m/s, a quarter for 0.2.
        let found = baseline(&fleet(9, 0.0)).unwrap();
        let [tenth, fifth] = &found.drone.needed[..] else { panic!("{found:?}") };
        assert!((tenth.minutes / (1000.0 / 60.0) - 1.0).abs() < 0.3, "{found:?}");
        assert!((tenth.minutes / fifth.minutes - 4.0).abs() < 1e-9);
        assert!(tenth.interval_min.low < tenth.minutes && tenth.minutes < tenth.interval_min.high);
        let fleet_of = found.fleet.as_ref().unwrap();
        let gain = tenth.minutes / fleet_of.needed[0].minutes;
        assert!((4.0..20.0).contains(&gain), "nine drones in air of their own: {gain}");
        assert!(found.words.contains(" min (95 %: "), "{}", found.words);
    }

    #[test]
    fn every_error_has_a_length_that_can_be_understood() {
        let needed = |error_mps: f64, low: f64| NeededAverage {
            error_mps,
            minutes: 2.0 * low,
            interval_min: Interval { low, high: f64::INFINITY },
        };
        let of = |low: f64| BaselineOf {
            sd_mps: 0.1,
            sd_interval_mps: Interval { low: 0.1, high: 0.1 },
            integral_time_s: 90.0,
            integral_time_interval_s: Interval { low: 45.0, high: f64::INFINITY },
            is_open: true,
            needed: vec![needed(0.1, low), needed(0.2, low / 4.0)],
        };
        assert_eq!(
            super::needed(&of(2.0)),
            "more than 2.0 min for 0.1 m/s, and more than 0.5 min for 0.2 m/s"
        );
        assert_eq!(
            super::needed(&of(0.1)),
            "more than 0.1 min for 0.1 m/s, and a quarter of that for 0.2 m/s"
        );
        assert_eq!(
            super::needed(&of(0.01)),
            "a time that this record does not tell for 0.1 m/s or 0.2 m/s"
        );
    }

    #[test]
    fn the_mean_of_all_drones_never_needs_longer_than_a_drone() {
        let of = |is_open: bool, [low, high]: [f64; 2]| BaselineOf {
            sd_mps: 0.0,
            sd_interval_mps: Interval { low: 0.0, high: 0.0 },
            integral_time_s: 1.0,
            integral_time_interval_s: Interval { low: 1.0, high: 1.0 },
            is_open,
            needed: ERRORS_MPS
                .map(|error_mps| {
                    let interval_min = Interval { low, high };
                    NeededAverage { error_mps, minutes: low, interval_min }
                })
                .into(),
        };
        let words = |drone: BaselineOf, fleet: BaselineOf| {
            sentence(&Baseline { record_s: 589.0, drone, fleet: Some(fleet), words: String::new() })
        };
        let quiet = || of(false, [0.0, 0.001]);
        let said = words(quiet(), of(true, [0.0, 900.0]));
        assert!(
            said.contains(
                "T of 1 s (95 %: 1 to 1); the mean of all drones needs no more than that;"
            ),
            "{said}"
        );
        let said = words(quiet(), of(true, [0.3, 900.0]));
        assert!(said.contains("the mean of all drones needs no more than that;"), "{said}");
        let said = words(of(false, [1.0, 94.0]), of(true, [0.7, 900.0]));
        assert!(
            said.contains("the mean of all drones needs more than 0.7 min for 0.1 m/s"),
            "{said}"
        );
        let said = words(of(true, [0.0, 900.0]), of(true, [0.0, 900.0]));
        assert!(
            said.contains("the mean of all drones needs a time that this record does not tell"),
            "{said}"
        );
    }

    #[test]
    fn air_that_all_share_is_not_averaged_away_by_drones() {
        let found = baseline(&fleet(9, 1.0)).unwrap();
        let minutes = |of: &BaselineOf| of.needed[0].minutes;
        let gain = minutes(&found.drone) / minutes(found.fleet.as_ref().unwrap());
        assert!((0.7..1.4).contains(&gain), "{gain}");
        let alone = baseline(&fleet(1, 0.0)).unwrap();
        assert_eq!(alone.fleet, None);
        assert_eq!(baseline(&[]), None);
    }
}
