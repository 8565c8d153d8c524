//! Rank regression and partial rank correlations (Iman and Conover 1979; Saltelli and Marivoet 1990), with intervals
//! from a bootstrap of campaigns. They measure what is monotonic, one factor beside the others.

use nalgebra::DMatrix;

use super::blocks::Blocks;
use super::result::Uncertain;

/// Least determinant of a matrix of correlations that is inverted: below, a factor follows from the others.
const LEAST_DETERMINANT: f64 = 1e-12;

/// Rank coefficients of one factor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Coefficients {
    pub(super) regression: Option<Uncertain>,
    pub(super) partial: Option<Uncertain>,
}

/// Coefficients of all factors and R² of the regression. `scores` are the levels of each factor as numbers, in the
/// order of `outcome`.
pub(super) fn coefficients(
    scores: &[Vec<f64>],
    outcome: &[f64],
    seed: u64,
    number: u64,
) -> (Vec<Coefficients>, Option<Uncertain>) {
    let n = outcome.len();
    let mut ranked: Vec<Vec<f64>> = scores.iter().map(|scores| ranks(scores)).collect();
    // A factor without two levels says nothing, and would make the matrix singular.
    let varies: Vec<bool> = ranked.iter().map(|ranks| has_spread(ranks)).collect();
    let mut keep = varies.iter();
    ranked.retain(|_| keep.next().copied().unwrap_or(false));
    let none = || (vec![Coefficients::default(); scores.len()], None);
    let outcome = ranks(outcome);
    if ranked.is_empty() || !has_spread(&outcome) || n < ranked.len() + 3 {
        return none();
    }
    ranked.push(outcome);
    let columns = ranked.len();
    // Sums: the number, each column, and each product of two.
    let mut blocks = Blocks::new(n, 1 + columns + columns * (columns + 1) / 2);
    let middle = f64::midpoint(n as f64, 1.0);
    for campaign in 0..n {
        let values: Vec<f64> = ranked
            .iter()
            .map(|ranks| (ranks.get(campaign).copied().unwrap_or(middle) - middle) / n as f64)
            .collect();
        let products = (0..columns)
            .flat_map(|i| (i..columns).map(move |j| (i, j)))
            .map(|(i, j)| values[i] * values[j]);
        let new = std::iter::once(1.0).chain(values.iter().copied()).chain(products);
        for (sum, value) in blocks.of(campaign).iter_mut().zip(new) {
            *sum += value;
        }
    }
    let found = blocks.uncertain(seed, number, &|sums| of_sums(sums, columns));
    let get = |place: usize| found.get(place).copied().flatten();
    let mut place = 0;
    let coefficients = varies
        .iter()
        .map(|varies| {
            if !varies {
                return Coefficients::default();
            }
            place += 1;
            Coefficients { regression: get(2 * place - 2), partial: get(2 * place - 1) }
        })
        .collect();
    (coefficients, get(2 * (columns - 1)))
}

/// Coefficient and partial correlation of each factor, then R²; the outcome is the last column.
fn of_sums(sums: &[f64], columns: usize) -> Vec<Option<f64>> {
    let none = || vec![None; 2 * (columns - 1) + 1];
    let Some((n, rest)) = sums.split_first() else { return none() };
    let (means, products) = rest.split_at(columns.min(rest.len()));
    let mut covariance = DMatrix::zeros(columns, columns);
    let mut products = products.iter();
    for i in 0..columns {
        for j in i..columns {
            let product = products.next().copied().unwrap_or_default();
            let value = product / n - means[i] / n * means[j] / n;
            covariance[(i, j)] = value;
            covariance[(j, i)] = value;
        }
    }
    let sds: Vec<f64> = (0..columns).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect();
    if sds.contains(&0.0) {
        return none();
    }
    let correlation =
        DMatrix::from_fn(columns, columns, |i, j| covariance[(i, j)] / sds[i] / sds[j]);
    if correlation.determinant() < LEAST_DETERMINANT {
        return none();
    }
    let Some(inverse) = correlation.try_inverse() else { return none() };
    let last = columns - 1;
    let of_outcome = inverse[(last, last)];
    // The inverse of a matrix of correlations has the regression of each column on the others in it.
    let mut found: Vec<Option<f64>> = (0..last)
        .flat_map(|i| {
            let own = inverse[(i, last)];
            [Some(-own / of_outcome), Some(-own / (inverse[(i, i)] * of_outcome).sqrt())]
        })
        .collect();
    found.push(Some(1.0 - 1.0 / of_outcome));
    found
}

fn has_spread(ranks: &[f64]) -> bool {
    ranks.first().is_some_and(|first| ranks.iter().any(|rank| rank != first))
}

/// Ranks from 1, those of equal values their mean.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    let value = |index: &usize| values.get(*index).copied().unwrap_or_default();
    order.sort_by(|a, b| value(a).total_cmp(&value(b)));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    for equal in order.chunk_by(|a, b| value(a) == value(b)) {
        let rank = before as f64 + f64::midpoint(equal.len() as f64, 1.0);
        for index in equal {
            if let Some(place) = ranks.get_mut(*index) {
                *place = rank;
            }
        }
        before += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    const X1: [f64; 12] = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0, 5.0, 3.0, 5.0, 8.0];
    const X2: [f64; 12] = [2.0, 7.0, 1.0, 8.0, 2.0, 8.0, 1.0, 8.0, 2.0, 8.0, 4.0, 5.0];
    const Y: [f64; 12] = [1.0, 4.0, 1.0, 4.0, 2.0, 9.0, 1.0, 3.0, 5.0, 6.0, 2.0, 3.5];

    #[test]
    fn coefficients_are_numpys() {
        // rankdata of SciPy, lstsq of standardised ranks, and correlations of the residuals of each on the other.
        let (found, r2) = coefficients(&[X1.to_vec(), X2.to_vec()], &Y, 1, 0);
        let values = [
            (found[0].regression, 0.096_309_79),
            (found[1].regression, 0.732_380_53),
            (found[0].partial, 0.143_168_114),
            (found[1].partial, 0.739_953_251),
            (r2, 0.565_629_581),
        ];
        for (found, expected) in values {
            assert!((found.unwrap().value - expected).abs() < 1e-8, "{found:?} {expected}");
        }
        let of_x1 = found[0].regression.unwrap();
        assert!(of_x1.low < 0.0 && of_x1.high > 0.0, "twelve campaigns do not tell: {of_x1:?}");
    }

    #[test]
    fn a_factor_that_does_not_vary_has_no_coefficient_and_spoils_no_other() {
        let scores = [X1.to_vec(), vec![7.0; 12], X2.to_vec()];
        let (with, _) = coefficients(&scores, &Y, 1, 0);
        let (without, _) = coefficients(&[X1.to_vec(), X2.to_vec()], &Y, 1, 0);
        assert_eq!(with, [without[0], Coefficients::default(), without[1]]);
        // A factor that is another one cannot be told from it.
        let (twice, r2) = coefficients(&[X1.to_vec(), X1.to_vec()], &Y, 1, 0);
        assert_eq!((twice, r2), (vec![Coefficients::default(); 2], None));
    }

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [3.5, 1.0, 3.5, 2.0]);
    }
}
