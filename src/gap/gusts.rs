//! Likelihood of leans that gusts change along both axes, and what lasts in proportion: a wind that grows with height, or
//! a law of another form. A filter of few states, as [`super::filter`] has it for any number, without what that costs. A
//! law is fitted in thousands of evaluations.

/// The leans of one moment along one axis, as the gusts and the growth of the wind change them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<const N: usize> {
    /// Lean less the law's, rad.
    pub off: f64,
    /// Change of it by either gust, rad/(m/s), and by what lasts.
    pub looks_at: [f64; N],
    /// Variance of what is the lean's own, rad².
    pub variance: f64,
}

/// Gusts along both axes and what lasts, as far as the leans so far tell them.
#[derive(Clone, Debug)]
pub(super) struct Gusts<const N: usize> {
    gust_variance: f64,
    state: [f64; N],
    covariance: [[f64; N]; N],
    log_det: f64,
    chi2: f64,
}

impl<const N: usize> Gusts<N> {
    /// Of such standard deviations: of the gusts along either axis, m/s, and of each thing that lasts.
    pub(super) fn new(sizes: [f64; N]) -> Self {
        let mut covariance = [[0.0; N]; N];
        for (place, size) in sizes.iter().enumerate() {
            covariance[place][place] = size * size;
        }
        let gust_variance = covariance[0][0];
        Self { gust_variance, state: [0.0; N], covariance, log_det: 0.0, chi2: 0.0 }
    }

    /// Takes in the leans of the next moment, until which so much is left of the gusts.
    pub(super) fn see(&mut self, decay: f64, seen: [Seen<N>; 2]) {
        let fresh = self.gust_variance * (1.0 - decay * decay);
        for gust in 0..2 {
            self.state[gust] *= decay;
            for other in 0..N {
                self.covariance[gust][other] *= decay;
                self.covariance[other][gust] *= decay;
            }
            self.covariance[gust][gust] += fresh;
        }
        let mut variances = 1.0;
        for Seen { off, looks_at, variance } in seen {
            let cross = self.covariance.map(|row| dot(row, looks_at));
            let total = variance + dot(cross, looks_at);
            let innovation = off - dot(self.state, looks_at);
            let share = innovation / total;
            for row in 0..N {
                self.state[row] += cross[row] * share;
                for column in 0..N {
                    self.covariance[row][column] -= cross[row] * cross[column] / total;
                }
            }
            variances *= total;
            self.chi2 += innovation * share;
        }
        self.log_det += variances.ln();
    }

    /// Minus the logarithm of the likelihood of what was seen, without its constant, nats.
    pub(super) fn misfit_nats(&self) -> f64 {
        0.5 * (self.log_det + self.chi2)
    }
}

fn dot<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    (1..N).fold(a[0] * b[0], |sum, place| sum + a[place] * b[place])
}

#[cfg(test)]
mod tests {
    use super::super::filter::{Filter, LooksAt, Observation, State};
    use super::*;

    #[test]
    fn the_likelihood_is_that_of_the_general_filter() {
        let (gust_mps, growth, scale_s) = (0.7, 0.2, 25.0);
        let times_s: [f64; 5] = [0.0, 3.0, 3.0, 40.0, 41.5];
        let looks = |moment: usize, axis: usize| {
            [1.3, 0.4, 0.9].map(|turns| 0.02 * (turns * (3 * moment + axis) as f64 + 0.3).sin())
        };
        let off = |moment: usize, axis: usize| 0.01 * ((2 * moment + axis) as f64).cos();
        let mut gusts = Gusts::new([gust_mps, gust_mps, growth]);
        let (mut observations, mut series) = (Vec::new(), Vec::new());
        for (moment, time_s) in times_s.into_iter().enumerate() {
            let before_s = times_s[moment.saturating_sub(1)];
            let variance = 1e-5 * (1 + moment) as f64;
            gusts.see(
                (-(time_s - before_s) / scale_s).exp(),
                [0, 1].map(|axis| Seen {
                    off: off(moment, axis),
                    looks_at: looks(moment, axis),
                    variance,
                }),
            );
            for axis in 0..2 {
                let looks_at: LooksAt = looks(moment, axis).into_iter().enumerate().collect();
                observations.push(Observation { time_s, looks_at, noise: variance });
                series.push(off(moment, axis));
            }
        }
        let gust = State { variance: gust_mps * gust_mps, time_s: scale_s };
        let shear = State { variance: growth * growth, time_s: f64::INFINITY };
        let filter = Filter::new(vec![gust, gust, shear], observations);
        let chi2: f64 = filter.whiten(&series).iter().map(|white| white * white).sum();
        let general = 0.5 * (filter.log_det + chi2);
        assert!((gusts.misfit_nats() - general).abs() < 1e-9, "{} {general}", gusts.misfit_nats());
    }
}
