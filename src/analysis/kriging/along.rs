//! Covariance of means over 10 s of drones that move: each is a mean along a part of its track.

use super::covariance::{Covariance, DIFFERENCES, WINDOW};
use crate::analysis::running::RUNNING_S;

/// Drones whose velocities differ by less fly side by side, m/s: 1 m within a window.
const SIDE_BY_SIDE_MPS: f64 = 0.1;
/// Covariance of the field's means over two windows whose middles are so far apart, of drones with these
/// velocities, (m/s)².
pub(super) fn along(
    covariance: &Covariance,
    apart_m: [f64; 3],
    apart_s: f64,
    [one_mps, other_mps]: [[f64; 3]; 2],
) -> f64 {
    let moved = |one_s: f64, other_s: f64| {
        let apart_m =
            [0, 1, 2].map(|axis| apart_m[axis] + one_mps[axis] * one_s - other_mps[axis] * other_s);
        covariance.instant(apart_m, apart_s + one_s - other_s)
    };
    let is_beside = (0..3).all(|axis| (one_mps[axis] - other_mps[axis]).abs() < SIDE_BY_SIDE_MPS);
    if is_beside {
        // Only the difference of the two times counts.
        let each = DIFFERENCES.iter().map(|(at, weight)| weight * moved(at * RUNNING_S, 0.0));
        return each.sum();
    }
    let mut sum = 0.0;
    for one in WINDOW {
        for other in WINDOW {
            sum += moved(one * RUNNING_S, other * RUNNING_S);
        }
    }
    sum / (WINDOW.len() * WINDOW.len()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::{Air, Form};

    fn covariance(form: Form, drift_mps: [f64; 2]) -> Covariance {
        Covariance::new(Air {
            form,
            sd_mps: 0.5,
            length_m: 60.0,
            stretch: [0.0; 2],
            time_s: 100.0,
            drift_mps,
            gust_mps: 0.0,
            gust_s: 4.0,
            slow_mps: 0.2,
            shared_mps: 0.0,
        })
    }

    #[test]
    fn means_along_tracks_have_the_covariance_that_sums_say() {
        let east = [4.0, 0.0, 0.0];
        for form in [Form::Exponential, Form::Gaussian] {
            for drift_mps in [[0.0; 2], [1.5, -0.5]] {
                let covariance = covariance(form, drift_mps);
                for (apart_m, apart_s, velocities) in [
                    ([0.0; 3], 0.0, [east, east]),
                    ([0.0, 10.0, 0.0], 0.0, [east, east]),
                    ([-40.0, 0.0, 0.0], -10.0, [east, east]),
                    ([15.0, 10.0, 20.0], 60.0, [east, [-4.0, 0.0, 0.0]]),
                    ([30.0, 0.0, 0.0], 20.0, [east, [0.0; 3]]),
                ] {
                    let [one_mps, other_mps] = velocities;
                    let steps = 80;
                    let at =
                        |step: i32| ((f64::from(step) + 0.5) / f64::from(steps) - 0.5) * RUNNING_S;
                    let mut sum = 0.0;
                    for one in 0..steps {
                        for other in 0..steps {
                            let moved = [0, 1, 2].map(|axis| {
                                apart_m[axis] + one_mps[axis] * at(one)
                                    - other_mps[axis] * at(other)
                            });
                            sum += covariance.instant(moved, apart_s + at(one) - at(other));
                        }
                    }
                    let expected = sum / f64::from(steps * steps);
                    let found = along(&covariance, apart_m, apart_s, velocities);
                    // Of a variance of 0.29. Nodes that all windows share miss some of a rough field's edge.
                    assert!(
                        (found - expected).abs() < 4e-3,
                        "{form:?} {drift_mps:?} {apart_m:?}: {found} {expected}"
                    );
                }
            }
        }
    }
}
