//! Scatter of the drones' constants: a bound on the air that each met alone in its calibration.
//!
//! Air that stays for a calibration and differs from drone to drone is in their constants. Where drones' constants differ
//! less than such air would make them, there was none: a thermal that stands in the hover says nothing of the calibration.

use nalgebra::{DMatrix, DVector};

use crate::numeric::log_sum;

/// How far the constants of drones of one make may lie apart without any air, m/s, each as likely as the others: masses and
/// rotors that differ by 0.1 to 3 %. A grid.
const SPREADS_MPS: [f64; 7] = [0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28];
/// Fewer degrees of freedom say nothing. Chosen.
const FEWEST: usize = 3;

/// How constants scatter about their plane over the drones' places, whose slopes long air has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// Variance, (m/s)².
    variance: f64,
    /// Degrees of freedom.
    freedom: f64,
}

impl Scatter {
    /// Of constants at places, m; `None` for too few drones.
    pub(super) fn of(constants_mps: &[([f64; 2], f64)]) -> Option<Self> {
        let count = constants_mps.len();
        if count <= FEWEST {
            return None;
        }
        let plane = DMatrix::from_fn(count, 3, |row, column| match column {
            0 => 1.0,
            axis => constants_mps[row].0[axis - 1],
        });
        let svd = plane.clone().svd(true, true);
        let most = svd.singular_values.max();
        let rank = svd.rank(1e-9 * most);
        let freedom = count.checked_sub(rank).filter(|freedom| *freedom >= FEWEST)? as f64;
        let values = DVector::from_iterator(count, constants_mps.iter().map(|(_, mps)| *mps));
        let left = &values - &plane * svd.solve(&values, 1e-9 * most).ok()?;
        let variance = left.norm_squared() / freedom;
        variance.is_finite().then_some(Self { variance, freedom })
    }

    /// Standard deviation about the plane, m/s.
    pub(super) fn sd_mps(self) -> f64 {
        self.variance.sqrt()
    }

    /// Logarithm of the likelihood, but for a constant, where air adds so much to the variance of the drones' own
    /// constants, (m/s)².
    pub(super) fn ln_likelihood(&self, by_air: f64) -> f64 {
        log_sum(SPREADS_MPS.map(|spread| {
            let variance = spread * spread + by_air.max(0.0);
            -0.5 * self.freedom * (variance.ln() + self.variance / variance)
        }))
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;
    use crate::base::rng::{Purpose, stream};

    /// Constants of 25 drones 10 m apart.
    fn constants(sd_mps: f64, of: impl Fn([f64; 2]) -> f64) -> Vec<([f64; 2], f64)> {
        let mut rng = stream(7, 1, Purpose::Sensors);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let home_m = |index: i32| [10.0 * f64::from(index % 5), 10.0 * f64::from(index / 5)];
        let one = |home_m: [f64; 2]| (home_m, sd_mps * normal() + of(home_m));
        (0..25).map(home_m).map(one).collect()
    }

    #[test]
    fn drones_that_lie_close_together_exclude_air_that_differs_from_one_to_the_next() {
        let close = Scatter::of(&constants(0.05, |_| 0.0)).unwrap();
        let likelier = |scatter: &Scatter, one: f64, other: f64| {
            scatter.ln_likelihood(one) - scatter.ln_likelihood(other)
        };
        assert!(likelier(&close, 0.0, 0.09) > 20.0);
        assert!(likelier(&close, 0.0, 0.000_1).abs() < 0.5);
        // Drones that differ by as much as air would make them say nothing of it.
        let wide = Scatter::of(&constants(0.3, |_| 0.0)).unwrap();
        assert!(likelier(&wide, 0.0, 0.05).abs() < 1.0);
    }

    #[test]
    fn a_plane_is_of_long_air_and_not_of_drones_that_differ() {
        let level = Scatter::of(&constants(0.05, |_| 0.0)).unwrap();
        let tilted = Scatter::of(&constants(0.05, |[x, y]| 0.01 * x - 0.02 * y)).unwrap();
        assert!((level.variance / tilted.variance - 1.0).abs() < 1e-6);
        assert_eq!(level.freedom, 22.0);
        let row: Vec<_> = constants(0.05, |_| 0.0).into_iter().take(5).collect();
        assert_eq!(Scatter::of(&row).unwrap().freedom, 3.0);
        assert!(Scatter::of(&row[..4]).is_none() && Scatter::of(&[]).is_none());
    }
}
