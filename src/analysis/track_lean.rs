//! Leans along a track as they would be without a climb through the air.
//!
//! On a leg of known speed over ground the air comes at nearly one speed, and yet the lean changes where the air rises: the
//! rotors' drag goes with the flow through the disc, by more or less of it in each vehicle (the H-force of blade elements, Leishman
//! 2006, 5.4; none in a drag that was fitted to flights in one wind). Held against a table by lean and climb such a lean
//! is another wind, and the slope of the pulse by which the air is measured is wrong by a tenth. So what the climb does
//! to the lean is told by the track itself, and taken away: what is left is the wind's. How well the track tells it is no
//! part of the errors: what is not known of it is what is usual, some hundredths.

use super::hover::Second;
use super::running::RUNNING_S;
use crate::numeric::mean;

/// Change of the lean for each m/s of climb through the air that is usual, as a share of the lean, s/m: -0.04 with a drag of the
/// rotors alone, 0.03 to 0.06 by blade elements (the planned show drone, and the second plant of foreign worlds, at 4
/// m/s). The standard deviation of what is believed beforehand.
const LEAN_BY_CLIMB: f64 = 0.05;
/// More than so much of it is none, s/m: leans of gusts that look like a climb. Chosen.
const MOST_BY_CLIMB: f64 = 2.0 * LEAN_BY_CLIMB;
/// Drones that climb or descend by less fly level, m/s. Chosen: followed to a tenth.
const LEVEL_MPS: f64 = 0.3;

/// Whether a drone flies level in this second: what it climbs through is then the air's own motion.
pub(super) fn is_level(second: &Second) -> bool {
    second.velocity_mps.abs() < LEVEL_MPS
}

/// The seconds of a track, those of level flight with leans as they would be without the climb through the air; `climbs_mps` is
/// that climb where it is known, by the leans as they are.
pub(super) fn at_level_leans(
    seconds: &[Option<Second>],
    climbs_mps: &[Option<f64>],
) -> Vec<Option<Second>> {
    let by_climb = by_climb(seconds, climbs_mps);
    let level = |(second, climb_mps): (&Option<Second>, &Option<f64>)| {
        let factor = (1.0 - by_climb * climb_mps.unwrap_or_default()).max(0.0);
        let second = (*second)?;
        let lean_deg = second.lean_deg * if is_level(&second) { factor } else { 1.0 };
        Some(Second { lean_deg, ..second })
    };
    seconds.iter().zip(climbs_mps).map(level).collect()
}

/// Change of the lean for each m/s of climb, as a share of the lean, s/m: a line through the level seconds of each stretch, and
/// what is usual.
fn by_climb(seconds: &[Option<Second>], climbs_mps: &[Option<f64>]) -> f64 {
    let together: Vec<(&Option<Second>, &Option<f64>)> = seconds.iter().zip(climbs_mps).collect();
    let (mut squares, mut products, mut leans, mut count) = (0.0, 0.0, 0.0, 0.0);
    // Between the legs of a track are seconds without values.
    for stretch in together.chunk_by(|one, next| one.0.is_some() && next.0.is_some()) {
        let of = |(second, climb_mps): &(&Option<Second>, &Option<f64>)| {
            let second = second.filter(is_level)?;
            Some(((**climb_mps)?, second.lean_deg))
        };
        let known: Vec<(f64, f64)> = stretch.iter().filter_map(of).collect();
        let climb_mps = mean(known.iter().map(|one| one.0)).unwrap_or_default();
        let lean_deg = mean(known.iter().map(|one| one.1)).unwrap_or_default();
        for (climb, lean) in known {
            let (x, y) = (lean_deg * (climb - climb_mps), lean - lean_deg);
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
    (products / (squares + prior)).clamp(-MOST_BY_CLIMB, MOST_BY_CLIMB)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two legs through rising air, against the wind and with it: the lean changes by a share of it for each m/s of climb
    /// through the air, which falls where that rises.
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
    fn in_gusts_a_track_tells_little_and_never_more_than_rotors_do() {
        let of = |by: f64, gust_deg: f64| {
            let (seconds, climbs_mps) = track(by, gust_deg);
            by_climb(&seconds, &climbs_mps)
        };
        assert!(of(0.06, 0.0) > 0.05 && of(0.06, 1.5) < 0.03, "{}", of(0.06, 1.5));
        assert_eq!(of(0.3, 0.0), MOST_BY_CLIMB);
        assert_eq!(of(-0.3, 0.0), -MOST_BY_CLIMB);
        let (seconds, _) = track(0.06, 0.0);
        assert_eq!(by_climb(&seconds, &[None; 100]), 0.0, "no climb is known");
        assert_eq!(by_climb(&[], &[]), 0.0);
    }

    #[test]
    fn a_leg_with_the_wind_leans_little_and_counts_for_little() {
        let (mut seconds, climbs_mps) = track(0.06, 0.0);
        for second in seconds[50..].iter_mut().flatten() {
            second.lean_deg = 0.1 + 0.1 * (second.time_s * 1.7).sin();
        }
        let told = by_climb(&seconds, &climbs_mps);
        assert!(told > 0.05, "{told}");
    }

    #[test]
    fn a_drone_that_climbs_by_itself_leans_as_it_does() {
        let (mut seconds, climbs_mps) = track(0.06, 0.0);
        for second in seconds[50..].iter_mut().flatten() {
            second.velocity_mps = 2.0;
        }
        let level = at_level_leans(&seconds, &climbs_mps);
        assert_eq!(level[70], seconds[70]);
        assert!((level[20].unwrap().lean_deg - 4.0).abs() < 0.08);
    }
}
