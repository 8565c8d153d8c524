//! The response of the pulse to vertical air speed. It is that of the speed relative to the air: where the
//! pulse is a curved function of it, an updraft that all drones share changes how each answers its own gusts.

use super::gls::{Likelihood, Problem, Solution};
use super::noise::{GRADIENT, GUSTS, GroupPattern, Hyper, OWN, SHARED};

/// Shifts of the vertical speed that a response is computed for: this many steps to either side, to 1 m/s.
/// Beyond that the last slope is taken.
const STEPS: usize = 4;
/// One step, m/s: as strong as the gusts of a drone on a field day (docs/physics.md, 4.1). The response is
/// linear between.
const STEP_MPS: f64 = 0.25;
/// Values of a response.
const COUNT: usize = 2 * STEPS + 1;

/// Change of the pulse per vertical speed, us/(m/s), at speeds around the flown one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response([f64; COUNT]);

impl Response {
    /// Of a pulse as a function of the shift of the vertical speed, m/s.
    pub(super) fn of(mut pulse_us: impl FnMut(f64) -> f64) -> Self {
        let at: [f64; COUNT + 2] =
            std::array::from_fn(|index| pulse_us((index as f64 - STEPS as f64 - 1.0) * STEP_MPS));
        Self(std::array::from_fn(|index| (at[index + 2] - at[index]) / (2.0 * STEP_MPS)))
    }

    /// Response of a straight law: one slope at any speed, us/(m/s).
    pub(super) fn straight(slope: f64) -> Self {
        Self([slope; COUNT])
    }

    /// All its values.
    pub(super) fn values(&self) -> &[f64; COUNT] {
        &self.0
    }

    /// Response at a speed shifted by `shift_mps`, us/(m/s); held beyond the last step.
    pub(super) fn at(&self, shift_mps: f64) -> f64 {
        let place = (shift_mps / STEP_MPS + STEPS as f64).clamp(0.0, (COUNT - 1) as f64);
        let low = (place.floor() as usize).min(COUNT - 2);
        let share = place - low as f64;
        self.0[low] + share * (self.0[low + 1] - self.0[low])
    }

    /// Mean response over gusts of a standard deviation (m/s), us/(m/s): a curve that is flat in hover does
    /// respond to gusts there.
    pub(super) fn over(&self, gusts_mps: f64) -> f64 {
        self.around(0.0, gusts_mps)
    }

    /// Mean response over gusts around a shifted speed, us/(m/s).
    pub(super) fn around(&self, shift_mps: f64, gusts_mps: f64) -> f64 {
        // Two points of this distance and half of the weight have the variance of the gusts.
        let apart_mps = std::f64::consts::SQRT_2 * gusts_mps.min(MOST_GUSTS_MPS);
        let sides = self.at(shift_mps + apart_mps) + self.at(shift_mps - apart_mps);
        0.5 * self.at(shift_mps) + 0.25 * sides
    }

    /// This response plus a multiple of another.
    #[must_use]
    pub(super) fn plus(mut self, times: f64, other: &Self) -> Self {
        self.0.iter_mut().zip(other.0).for_each(|(own, other)| *own += times * other);
        self
    }
}

/// Stronger gusts are not considered, m/s: what a model lacks looks like gusts, and with gusts strong
/// enough any curve would look like what it lacks. About what the benchmark's strongest air has in all;
/// chosen.
const MOST_GUSTS_MPS: f64 = 0.5;

/// Adds a multiple of responses to others, by group and bin.
pub(super) fn add(sum: &mut [Vec<Response>], times: f64, other: &[Vec<Response>]) {
    for (own, other) in sum.iter_mut().zip(other) {
        add_to(own, times, other);
    }
}

/// Adds a multiple of responses to others, by bin of one group.
pub(super) fn add_to(sum: &mut [Response], times: f64, other: &[Response]) {
    sum.iter_mut().zip(other).for_each(|(own, other)| *own = own.plus(times, other));
}

/// Patterns that know how fast the drones moved relative to the air that all shared: by what a solution
/// leaves of the groups' means.
pub(super) fn shifted(
    groups: &[GroupPattern],
    problem: &Problem<'_>,
    solution: &Solution,
) -> Vec<GroupPattern> {
    let shared = problem.shared_mps(solution);
    let group =
        |(group, shift_mps): (&GroupPattern, Vec<f64>)| GroupPattern { shift_mps, ..group.clone() };
    groups.iter().zip(shared).map(group).collect()
}

/// Most probable noise with everything linear at its best, at the speed relative to the air that all share:
/// `groups` makes the patterns of a solution's coefficients. With the patterns it was found for.
pub(super) fn settled(
    problem: &Problem<'_>,
    start: Solution,
    groups: impl Fn(&[f64]) -> Vec<GroupPattern>,
) -> (Vec<GroupPattern>, Solution) {
    // Where a model lacks much, what it leaves is no air, and nothing is known of the speed relative to it.
    let mut best = (problem.groups.to_vec(), start.clone());
    let mut last = start;
    for _ in 0..SETTLED {
        let patterns = shifted(&groups(&last.beta), problem, &last);
        last = problem.among(&patterns).fit(&last, Likelihood::Profile);
        let more = last.log_posterior() - best.1.log_posterior();
        if more > 0.0 {
            best = (patterns, last.clone());
        }
        if more.abs() < SAME_NATS {
            break;
        }
    }
    best
}

/// Rounds in which the speed relative to the shared air settles, at most. Chosen for time.
const SETTLED: usize = 4;
/// A change of the log-posterior that is none, nats: small against the margins of naming. Chosen.
const SAME_NATS: f64 = 0.3;

/// The air that all drones share is believed up to this many times what each has for itself: what the model
/// lacks is shared, too. Field days have 1.5 (docs/physics.md, 4.1); chosen above that.
const MOST_SHARED: f64 = 2.5;

/// Standard deviation of the vertical air that a noise says a drone meets, m/s.
pub(super) fn gusts_mps(hyper: &Hyper) -> f64 {
    let own_mps = hyper.get(OWN).hypot(hyper.get(GUSTS));
    let shared_mps = hyper.get(SHARED).hypot(hyper.get(GRADIENT));
    own_mps.hypot(shared_mps.min(MOST_SHARED * own_mps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signed_square_answers_by_the_speed_relative_to_the_air() {
        let response = Response::of(|shift| 8.0 * (0.5 + shift) * f64::abs(0.5 + shift));
        assert!((response.at(0.0) - 8.0).abs() < 1e-9);
        assert!((response.at(0.3) - 12.8).abs() < 1e-9, "{}", response.at(0.3));
        assert!((response.at(9.0) - 24.0).abs() < 1e-9, "the last");
        let hover = Response::of(|shift| 8.0 * shift * shift.abs());
        assert!(hover.at(0.0) < 2.5 && hover.over(0.4) > 4.0, "{}", hover.over(0.4));
        assert!(
            (hover.around(0.5, 0.1) - 8.0).abs() < 1e-9,
            "away from the bend gusts change nothing"
        );
    }
}
