//! Sobol' indices from Saltelli's scheme: first-order ones after Saltelli et al. (2010), total ones after Jansen
//! (1999), with intervals from a bootstrap of rows.

use super::blocks::Blocks;
use super::result::Uncertain;

/// Sums of each factor: number of rows, of A and B and of their squares, and of what the two indices need.
const SUMS: usize = 5;

/// First-order and total index of one factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Indices {
    /// Rows that have all three campaigns.
    pub(super) n: usize,
    pub(super) first: Option<Uncertain>,
    pub(super) total: Option<Uncertain>,
}

/// Indices of all columns, and the sum of the first-order ones. `outcome` is that of a campaign, by its place in the
/// study: row after row, in each the campaigns of A, of B, and of A with one column of B after the other. A row that
/// lacks one of a factor's campaigns does not count for that factor.
pub(super) fn indices(
    rows: usize,
    columns: usize,
    seed: u64,
    number: u64,
    outcome: &dyn Fn(usize) -> Option<f64>,
) -> (Vec<Indices>, Option<Uncertain>) {
    let of = |row: usize, place: usize| outcome(row * (columns + 2) + place);
    // Without their mean the products of the first-order index are smaller, and so are their errors.
    let known = (0..rows).flat_map(|row| [of(row, 0), of(row, 1)]).flatten();
    let mean = crate::numeric::mean(known).unwrap_or_default();
    let mut blocks = Blocks::new(rows, SUMS * columns);
    let mut counts = vec![0; columns];
    for row in 0..rows {
        let (Some(a), Some(b)) = (of(row, 0), of(row, 1)) else { continue };
        let (a, b) = (a - mean, b - mean);
        for (column, count) in counts.iter_mut().enumerate() {
            let Some(mixed) = of(row, 2 + column) else { continue };
            let mixed = mixed - mean;
            *count += 1;
            let new = [1.0, a + b, a * a + b * b, b * (mixed - a), (a - mixed) * (a - mixed)];
            for (sum, value) in blocks.of(row).iter_mut().skip(column * SUMS).zip(new) {
                *sum += value;
            }
        }
    }
    let statistics = |sums: &[f64]| {
        let mut found: Vec<Option<f64>> = Vec::with_capacity(2 * columns + 1);
        let mut explained = Some(0.0);
        for sums in sums.chunks(SUMS) {
            let [n, values, squares, first, total] = sums else { continue };
            let variance = squares / (2.0 * n) - (values / (2.0 * n)).powi(2);
            // Nothing varies but the last bits.
            let is_there = variance > 1e-18 * squares / n && variance.is_finite();
            let first = is_there.then_some(first / n / variance);
            found.push(first);
            found.push(is_there.then_some(total / (2.0 * n) / variance));
            explained = explained.zip(first).map(|(sum, first)| sum + first);
        }
        found.push(explained);
        found
    };
    let found = blocks.uncertain(seed, number, &statistics);
    let get = |place: usize| found.get(place).copied().flatten();
    let of_column = |(column, n): (usize, &usize)| Indices {
        n: *n,
        first: get(2 * column),
        total: get(2 * column + 1),
    };
    (counts.iter().enumerate().map(of_column).collect(), get(2 * columns))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::design::{Design, Drawn, Seeds};
    use super::super::factor::{Factor, Levels, Range, Target};
    use super::*;

    fn factors(count: usize, from: f64, to: f64) -> Vec<Factor> {
        let range = Range { from, to, log: false, whole: false, levels: None };
        let factor = |i| Factor {
            name: format!("x{i}"),
            unit: String::new(),
            target: Target::LostShare,
            levels: Levels::Range(range),
        };
        (0..count).map(factor).collect()
    }

    /// Indices of a function of some numbers, by the study's own design.
    fn of_function(
        factors: &[Factor],
        samples: usize,
        function: &dyn Fn(&[f64]) -> f64,
    ) -> Vec<Indices> {
        let drawn = Drawn::new(Design::Sobol { samples }, Seeds::Same, 11, factors);
        let outcome = |index: usize| {
            let levels = drawn.item(index).levels;
            let x: Vec<f64> = levels.iter().map(|level| level.number().unwrap()).collect();
            Some(function(&x))
        };
        indices(samples, factors.len(), 11, 0, &outcome).0
    }

    fn holds(found: Uncertain, truth: f64, widest: f64) {
        assert!((found.low..=found.high).contains(&truth), "{found:?} does not hold {truth}");
        assert!(found.high - found.low < widest, "{found:?}");
    }

    #[test]
    fn ishigamis_indices_are_inside_their_intervals() {
        // Ishigami and Homma 1990 with a = 7, b = 0.1: V = a²/8 + bπ⁴/5 + b²π⁸/18 + 1/2.
        let ishigami =
            |x: &[f64]| x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin();
        let found = of_function(&factors(3, -PI, PI), 2048, &ishigami);
        let truth = [(0.3139, 0.5576), (0.4424, 0.4424), (0.0, 0.2437)];
        for (found, (first, total)) in found.iter().zip(truth) {
            holds(found.first.unwrap(), first, 0.15);
            holds(found.total.unwrap(), total, 0.15);
        }
    }

    #[test]
    fn the_g_functions_indices_are_inside_their_intervals() {
        // Saltelli and Sobol' 1995, a = (0, 1, 4.5, 9, 99, 99, 99, 99): V_i = 1/3 / (1 + a_i)².
        let a = [0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0];
        let g = |x: &[f64]| {
            x.iter().zip(a).map(|(x, a)| ((4.0 * x - 2.0).abs() + a) / (1.0 + a)).product()
        };
        let found = of_function(&factors(8, 0.0, 1.0), 4096, &g);
        let own = a.map(|a| 1.0 / 3.0 / (1.0_f64 + a).powi(2));
        let variance = own.iter().map(|v| 1.0 + v).product::<f64>() - 1.0;
        for (index, found) in found.iter().enumerate() {
            let others = own.iter().enumerate().filter(|(other, _)| *other != index);
            let total = own[index] * others.map(|(_, v)| 1.0 + v).product::<f64>() / variance;
            holds(found.first.unwrap(), own[index] / variance, 0.15);
            holds(found.total.unwrap(), total, 0.15);
        }
        // What is published: 0.716, 0.179, 0.024, 0.007, 0.0001.
        assert!((found[0].first.unwrap().value - 0.716).abs() < 0.03, "{:?}", found[0]);
        assert!((found[1].first.unwrap().value - 0.179).abs() < 0.02, "{:?}", found[1]);
    }

    #[test]
    fn lost_campaigns_take_their_row_from_their_factor_alone() {
        let outcome = |index: usize| (index != 2).then_some((index * index % 7) as f64);
        let (found, explained) = indices(50, 2, 1, 0, &outcome);
        assert_eq!(found.iter().map(|found| found.n).collect::<Vec<_>>(), [49, 50]);
        assert!(explained.is_some());
    }

    #[test]
    fn what_does_not_vary_has_no_index() {
        let (found, explained) = indices(50, 2, 1, 0, &|_| Some(0.1));
        assert!(found.iter().all(|found| found.first.is_none() && found.total.is_none()));
        assert_eq!(explained, None);
    }
}
