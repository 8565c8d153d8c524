//! Leans along a track as they would be without a climb through the air.
//!
//! On a leg of known speed over ground the air comes at nearly one speed, and yet the lean changes where the air rises: the
//! rotors' drag goes with the flow through the disc, by more or less of it in each vehicle (the H-force of blade elements, Leishman
//! 2006, 5.4; none in a drag that was fitted to flights in one wind). Held against a table by lean and climb such a lean
//! is another wind, and the slope of the pulse by which the air is measured is wrong by a tenth. So what the climb does
//! to the lean is told by the track itself, and taken away: what is left is the wind's.

use std::ops::Range;

use super::hover::Second;
use super::running::RUNNING_S;
use crate::numeric::mean;

/// Standard error of the change of the lean for each m/s of climb through the air, as a share of the lean, s/m: -0.04 with a
/// drag of the rotors alone, +0.03 to +0.06 by blade elements (the planned show drone, and the second plant of foreign
/// worlds, at 4 m/s).
const LEAN_BY_CLIMB: f64 = 0.05;

/// The seconds of a track with leans as they would be without the climb through the air; `climbs_mps` is that climb, where it is
/// known, by leans that are held at their mean.
pub(super) fn at_level_leans(
    seconds: &[Option<Second>],
    climbs_mps: &[Option<f64>],
) -> Vec<Option<Second>> {
    let by_climb = by_climb(seconds, climbs_mps);
    let level = |(second, climb_mps): (&Option<Second>, &Option<f64>)| {
        let factor = (1.0 - by_climb * climb_mps.unwrap_or_default()).max(0.0);
        second.map(|second| Second { lean_deg: second.lean_deg * factor, ..second })
    };
    seconds.iter().zip(climbs_mps).map(level).collect()
}

/// The seconds of a track with leans at the mean of their stretch.
pub(super) fn at_mean_leans(seconds: &[Option<Second>]) -> Vec<Option<Second>> {
    let mut found = seconds.to_vec();
    for stretch in stretches(seconds) {
        let known = || seconds[stretch.clone()].iter().flatten();
        let Some(lean_deg) = mean(known().map(|second| second.lean_deg)) else { continue };
        for second in found[stretch.clone()].iter_mut().flatten() {
            second.lean_deg = lean_deg;
        }
    }
    found
}

/// Change of the lean for each m/s of climb, as a share of the lean, s/m: a line through the seconds of each stretch, and
/// what is usual.
fn by_climb(seconds: &[Option<Second>], climbs_mps: &[Option<f64>]) -> f64 {
    let (mut squares, mut products, mut leans, mut count) = (0.0, 0.0, 0.0, 0.0);
    for stretch in stretches(seconds) {
        let known: Vec<[f64; 2]> = stretch
            .filter_map(|index| Some([climbs_mps[index]?, seconds[index].as_ref()?.lean_deg]))
            .collect();
        let n = known.len() as f64;
        let of = |axis: usize| known.iter().map(|one| one[axis]).sum::<f64>() / n;
        let (climb_mps, lean_deg) = (of(0), of(1));
        if known.len() < 2 || lean_deg <= 0.0 {
            continue;
        }
        for [climb, lean] in known {
            let (x, y) = (climb - climb_mps, lean / lean_deg - 1.0);
            squares += x * x;
            products += x * y;
            leans += y * y;
            count += 1.0;
        }
    }
    if squares <= 0.0 {
        return 0.0;
    }
    let left = (leans - products * products / squares).max(0.0) / f64::max(count - 2.0, 1.0);
    // Running means have so few values of their own.
    let prior = RUNNING_S * left / (LEAN_BY_CLIMB * LEAN_BY_CLIMB);
    products / (squares + prior)
}

/// Stretches of seconds that have values, one after the other.
fn stretches(seconds: &[Option<Second>]) -> Vec<Range<usize>> {
    let mut end = 0;
    let stretch = |part: &[Option<Second>]| {
        let start = end;
        end += part.len();
        part[0].is_some().then_some(start..end)
    };
    seconds.chunk_by(|one, next| one.is_some() == next.is_some()).filter_map(stretch).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two legs through rising air, against the wind and with it; the lean falls by a share of it for each m/s of climb.
    fn track(by_climb: f64, gust_deg: f64) -> (Vec<Option<Second>>, Vec<Option<f64>>) {
        let second = |index: usize| {
            let leg = index / 50;
            let at = index % 50;
            if at >= 40 {
                return (None, None);
            }
            let updraft_mps = 2.0 * (-((at as f64 - 20.0) / 6.0).powi(2)).exp();
            let level_deg = [4.0, 2.5][leg.min(1)] + gust_deg * (index as f64 * 1.7).sin();
            let second = Second {
                time_s: index as f64,
                pulse_us: 1500.0,
                velocity_mps: 0.0,
                lean_deg: level_deg * (1.0 - by_climb * updraft_mps),
                height_m: 60.0,
            };
            (Some(second), Some(-updraft_mps))
        };
        (0..100).map(second).unzip()
    }

    #[test]
    fn what_the_climb_does_to_the_lean_is_told_by_the_track_and_taken_away() {
        for by_climb in [-0.06, 0.0, 0.06] {
            let (seconds, climbs_mps) = track(by_climb, 0.02);
            let level = at_level_leans(&seconds, &climbs_mps);
            let [up, down] = [20, 70].map(|index| level[index].unwrap().lean_deg);
            assert!((up - 4.0).abs() < 0.08, "{by_climb}: {up}");
            assert!((down - 2.5).abs() < 0.08, "{by_climb}: {down}");
            assert_eq!(level[45], None, "between the legs");
            assert_eq!(level.len(), seconds.len());
        }
    }

    #[test]
    fn in_gusts_a_track_tells_little_and_leans_stay() {
        let (seconds, climbs_mps) = track(0.06, 0.0);
        let exact = by_climb(&seconds, &climbs_mps);
        let (gusty, climbs_mps) = track(0.06, 1.5);
        let shrunk = by_climb(&gusty, &climbs_mps);
        assert!(exact > 0.05 && shrunk < 0.5 * exact, "{exact} {shrunk}");
        let climbs_mps = vec![None; 100];
        assert_eq!(by_climb(&seconds, &climbs_mps), 0.0, "no climb is known");
    }

    #[test]
    fn each_leg_has_its_own_mean() {
        let (seconds, _) = track(0.0, 0.0);
        let means = at_mean_leans(&seconds);
        assert!((means[3].unwrap().lean_deg - 4.0).abs() < 1e-12);
        assert!((means[60].unwrap().lean_deg - 2.5).abs() < 1e-12);
        assert_eq!(means[49], None);
    }
}
