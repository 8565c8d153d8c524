//! Chance: p-values, many tests at once, and a scale that outliers do not move.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor, StudentsT};
use statrs::function::erf::erfc;
use statrs::function::gamma::gamma_ur;

use crate::numeric::Sorted;

/// Probability that a test at the stated level is wrong anywhere in a family. Convention.
pub const LEVEL: f64 = 0.05;

/// Variance of the median of many normal values over that of their mean.
pub(super) const MEDIAN_OVER_MEAN: f64 = std::f64::consts::FRAC_PI_2;

/// What makes [`qn`] the standard deviation of many normal values.
const QN_NORMAL: f64 = 2.2219;
/// The same for 2 to 9 values (Croux and Rousseeuw 1992).
const QN_FEW: [f64; 8] = [0.399, 0.994, 0.512, 0.844, 0.611, 0.857, 0.669, 0.872];
/// Degrees of freedom of [`qn`] for each beyond the first value: its efficiency.
const QN_EFFICIENCY: f64 = 0.8;

/// Probability of a standard normal value at least so far from 0, to either side.
pub fn two_sided(z: f64) -> f64 {
    erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// Probability of a value of Student's t at least so far from 0, to either side; `None` degrees of freedom: of a normal
/// value.
pub fn two_sided_t(t: f64, dof: Option<f64>) -> f64 {
    let Some(dof) = dof.filter(|_| t.is_finite()) else { return two_sided(t) };
    StudentsT::new(0.0, 1.0, dof).map_or(f64::NAN, |law| (2.0 * law.sf(t.abs())).min(1.0))
}

/// Probability of a chi² at least so large.
pub fn chi2_above(chi2: f64, dof: usize) -> f64 {
    if dof == 0 || !chi2.is_finite() || chi2 < 0.0 {
        return f64::NAN;
    }
    // The function takes no 0.
    if chi2 > 0.0 { gamma_ur(dof as f64 / 2.0, chi2 / 2.0) } else { 1.0 }
}

/// Probability of Fisher's F at least so large.
pub(super) fn f_above(f: f64, dof: f64, dof_of_errors: f64) -> f64 {
    if !f.is_finite() || f < 0.0 {
        return f64::NAN;
    }
    FisherSnedecor::new(dof, dof_of_errors).map_or(f64::NAN, |law| law.sf(f))
}

/// P-values corrected after Holm (1979), in the order of the values: those below a level are wrong with no more
/// than this probability, any one of them, however the tests hang together. NaN counts as no test.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).filter(|at| !p_values[*at].is_nan()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut corrected = vec![f64::NAN; p_values.len()];
    let mut largest = 0.0_f64;
    for (rank, &at) in order.iter().enumerate() {
        largest = largest.max((p_values[at] * (order.len() - rank) as f64).min(1.0));
        corrected[at] = largest;
    }
    corrected
}

/// Rousseeuw and Croux's Qn (1993): a standard deviation that half of the values cannot spoil, and that needs no
/// centre. `None` with fewer than two values.
pub fn qn(values: &[f64]) -> Option<f64> {
    let n = values.len();
    if n < 2 {
        return None;
    }
    let half = n / 2 + 1;
    let rank = half * (half - 1) / 2;
    let mut apart: Vec<f64> = Vec::with_capacity(n * (n - 1) / 2);
    for (index, a) in values.iter().enumerate() {
        apart.extend(values[index + 1..].iter().map(|b| (a - b).abs()));
    }
    let (_, found, _) = apart.select_nth_unstable_by(rank - 1, f64::total_cmp);
    let few = n as f64;
    let factor = match QN_FEW.get(n - 2) {
        Some(factor) => *factor,
        None if n.is_multiple_of(2) => few / (few + 3.8),
        None => few / (few + 1.4),
    };
    Some(QN_NORMAL * factor * *found)
}

/// Degrees of freedom of [`qn`] of so many values.
pub(super) fn qn_freedom(n: usize) -> f64 {
    (QN_EFFICIENCY * (n as f64 - 1.0)).max(1.0)
}

/// Weighted median: half of the weight lies on either side. `None` without weight.
pub fn weighted_median(values: &[(f64, f64)]) -> Option<f64> {
    let mut order: Vec<(f64, f64)> = values
        .iter()
        .copied()
        .filter(|(value, weight)| value.is_finite() && *weight > 0.0)
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let first = order.first()?.1;
    if order.iter().all(|(_, weight)| (weight - first).abs() <= 1e-12 * first) {
        let values: Vec<f64> = order.iter().map(|(value, _)| *value).collect();
        return Sorted::taken(&values).median();
    }
    let half = order.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut below = 0.0;
    for (index, (value, weight)) in order.iter().enumerate() {
        below += weight;
        if below > half {
            return Some(*value);
        }
        if below == half {
            return Some(order.get(index + 1).map_or(*value, |next| f64::midpoint(*value, next.0)));
        }
    }
    order.last().map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} is not {expected}");
    }

    /// SciPy 1.17: `2*norm.sf(z)`, `2*t.sf(t, dof)`, `chi2.sf(x, dof)`, `f.sf(x, n, m)`.
    #[test]
    fn probabilities_are_those_of_scipy() {
        close(two_sided(0.3), 0.7641771556220948);
        close(two_sided(-3.5), 0.00046525815807105003);
        close(two_sided(9.0), 2.2571768119076647e-19);
        close(two_sided_t(1.0, Some(1.0)), 0.5);
        close(two_sided_t(-3.2, Some(12.3)), 0.007418619658925526);
        close(two_sided_t(8.5, Some(19.2)), 6.206402729116239e-08);
        close(chi2_above(21.4, 9), 0.010988016145239983);
        close(chi2_above(3.0, 2), 0.22313016014842982);
        close(f_above(3.7, 2.0, 15.2), 0.0490667316956364);
        assert_eq!((chi2_above(0.0, 2), f_above(0.0, 2.0, 9.0)), (1.0, 1.0));
        assert!(chi2_above(3.0, 0).is_nan() && chi2_above(f64::NAN, 3).is_nan());
    }

    /// R 4: `p.adjust(c(0.01, 0.04, 0.03, 0.005, 0.2), "holm")`.
    #[test]
    fn holm_is_that_of_r() {
        let found = holm(&[0.01, 0.04, 0.03, 0.005, 0.2]);
        for (found, expected) in found.iter().zip([0.04, 0.09, 0.09, 0.025, 0.2]) {
            close(*found, expected);
        }
        let found = holm(&[f64::NAN, 0.03, 0.9]);
        assert!(found[0].is_nan());
        close(found[1], 0.06);
        close(found[2], 0.9);
    }

    /// By hand: of 1, 2, 4, 8 the distances are 1, 2, 3, 4, 6, 7; h is 3, so that the third counts.
    #[test]
    fn qn_is_a_low_quantile_of_distances() {
        close(qn(&[4.0, 1.0, 8.0, 2.0]).unwrap(), 2.2219 * 0.512 * 3.0);
        assert_eq!(qn(&[4.0]), None);
        let far: Vec<f64> = (0..40).map(|i| if i < 15 { 1e6 } else { f64::from(i % 7) }).collect();
        assert!(qn(&far).unwrap() < 10.0, "15 of 40 values are far out");
    }

    #[test]
    fn a_median_is_where_half_of_the_weight_is() {
        assert_eq!(weighted_median(&[(3.0, 1.0), (1.0, 1.0), (2.0, 1.0)]), Some(2.0));
        assert_eq!(weighted_median(&[(3.0, 1.0), (1.0, 1.0)]), Some(2.0));
        assert_eq!(weighted_median(&[(3.0, 5.0), (1.0, 1.0), (2.0, 1.0)]), Some(3.0));
        assert_eq!(weighted_median(&[(f64::NAN, 1.0), (1.0, 0.0)]), None);
    }

    proptest! {
        #[test]
        fn corrected_values_keep_their_order_and_never_fall(p in prop::collection::vec(0.0..1.0_f64, 1..40)) {
            let corrected = holm(&p);
            for (a, p_a) in corrected.iter().zip(&p) {
                prop_assert!(a >= p_a && *a <= 1.0);
                for (b, p_b) in corrected.iter().zip(&p) {
                    prop_assert!(p_a > p_b || a <= b);
                }
            }
        }
    }
}
