//! Symmetric positive definite matrices in which each unknown is coupled with few others: put in an order in which these are
//! near, the factor has entries only in a band along its diagonal (A. George and J. W. Liu, *Computer Solution of Large Sparse
//! Positive Definite Systems*, 1981, chapter 4).

use nalgebra::DMatrix;
use rayon::prelude::*;

/// Columns that are solved together.
const COLUMNS: usize = 16;

/// The Cholesky factor of a matrix, as a band.
#[derive(Clone, Debug)]
pub(crate) struct Banded {
    /// The unknown at each place of the order.
    order: Vec<usize>,
    /// Entries before the diagonal in each row.
    width: usize,
    /// The rows of the factor one after another, each with `width + 1` entries, the diagonal last.
    rows: Vec<f64>,
}

impl Banded {
    /// The factor of a matrix; `None` where it is not positive definite.
    pub(crate) fn factor(matrix: &DMatrix<f64>) -> Option<Self> {
        let n = matrix.nrows();
        let coupled: Vec<Vec<usize>> = (0..n)
            .map(|column| {
                let entries = matrix.column(column);
                let is_coupled = |row: &usize| *row != column && entries[*row] != 0.0;
                (0..n).filter(is_coupled).collect()
            })
            .collect();
        let order = order(&coupled);
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(at, unknown)| place[*unknown] = at);
        let width = (0..n)
            .flat_map(|unknown| coupled[unknown].iter().map(move |other| (unknown, *other)))
            .map(|(one, other)| place[one].abs_diff(place[other]))
            .max()
            .unwrap_or(0);
        let stride = width + 1;
        let mut rows = vec![0.0; n * stride];
        for row in 0..n {
            for column in row.saturating_sub(width)..=row {
                rows[row * stride + width - (row - column)] = matrix[(order[row], order[column])];
            }
        }
        for row in 0..n {
            let first = row.saturating_sub(width);
            let (before, rest) = rows.split_at_mut(row * stride);
            let own = &mut rest[..stride];
            for column in first..=row {
                // Both rows from the first entry that they have in common.
                let from = first.max(column.saturating_sub(width));
                let own_from = width - (row - from);
                let count = column - from;
                if column == row {
                    let squares: f64 =
                        own[own_from..own_from + count].iter().map(|of| of * of).sum();
                    let left = own[width] - squares;
                    if !(left > 0.0 && left.is_finite()) {
                        return None;
                    }
                    own[width] = left.sqrt();
                } else {
                    let other = &before[column * stride..(column + 1) * stride];
                    let other_from = width - count;
                    let product: f64 = own[own_from..own_from + count]
                        .iter()
                        .zip(&other[other_from..width])
                        .map(|(own, other)| own * other)
                        .sum();
                    let at = width - (row - column);
                    own[at] = (own[at] - product) / other[width];
                }
            }
        }
        Some(Self { order, width, rows })
    }

    /// Sum of the logarithms of the factor's diagonal: half of the logarithm of the determinant.
    pub(crate) fn ln_diagonal(&self) -> f64 {
        let stride = self.width + 1;
        self.rows.iter().skip(self.width).step_by(stride).map(|value| value.ln()).sum()
    }

    /// Solves for each column.
    pub(crate) fn solve(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        self.solved(right.ncols(), |row, column| right[(row, column)])
    }

    /// The inverse.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        self.solved(self.order.len(), |row, column| if row == column { 1.0 } else { 0.0 })
    }

    fn solved(&self, columns: usize, right: impl Fn(usize, usize) -> f64 + Sync) -> DMatrix<f64> {
        let n = self.order.len();
        let mut found = DMatrix::zeros(n, columns);
        if n == 0 {
            return found;
        }
        found.as_mut_slice().par_chunks_mut(n * COLUMNS).enumerate().for_each(|(chunk, into)| {
            let first = chunk * COLUMNS;
            let mut block = vec![[0.0; COLUMNS]; n];
            for (at, unknown) in self.order.iter().enumerate() {
                for (column, value) in block[at].iter_mut().enumerate().take(into.len() / n) {
                    *value = right(*unknown, first + column);
                }
            }
            self.solve_block(&mut block);
            for (at, unknown) in self.order.iter().enumerate() {
                for (column, own) in into.chunks_exact_mut(n).enumerate() {
                    own[*unknown] = block[at][column];
                }
            }
        });
        found
    }

    fn solve_block(&self, block: &mut [[f64; COLUMNS]]) {
        let (n, width) = (block.len(), self.width);
        let stride = width + 1;
        for row in 0..n {
            let first = row.saturating_sub(width);
            let own = &self.rows[row * stride..(row + 1) * stride];
            let (before, rest) = block.split_at_mut(row);
            let sum = &mut rest[0];
            for (factor, before) in own[width - (row - first)..width].iter().zip(&before[first..]) {
                sum.iter_mut().zip(before).for_each(|(sum, before)| *sum -= factor * before);
            }
            for sum in sum.iter_mut() {
                *sum /= own[width];
            }
        }
        for row in (0..n).rev() {
            let first = row.saturating_sub(width);
            let own = &self.rows[row * stride..(row + 1) * stride];
            let (before, rest) = block.split_at_mut(row);
            let solved = &mut rest[0];
            for solved in solved.iter_mut() {
                *solved /= own[width];
            }
            let factors = &own[width - (row - first)..width];
            for (factor, before) in factors.iter().zip(&mut before[first..]) {
                before.iter_mut().zip(&*solved).for_each(|(left, solved)| *left -= factor * solved);
            }
        }
    }
}

/// An order in which coupled unknowns are near each other: outwards from one at the edge, those with few neighbours first
/// (E. Cuthill and J. McKee 1969), reversed.
fn order(coupled: &[Vec<usize>]) -> Vec<usize> {
    let n = coupled.len();
    let mut order: Vec<usize> = Vec::with_capacity(n);
    let mut is_placed = vec![false; n];
    let mut by_degree: Vec<usize> = (0..n).collect();
    by_degree.sort_by_key(|unknown| (coupled[*unknown].len(), *unknown));
    for start in by_degree {
        if is_placed[start] {
            continue;
        }
        // The last one that is reached is farther out than where the walk began.
        let start = walk(coupled, start, &mut is_placed.clone()).last().copied().unwrap_or(start);
        order.extend(walk(coupled, start, &mut is_placed));
    }
    order.reverse();
    order
}

/// All that is reached from a start, nearest first.
fn walk(coupled: &[Vec<usize>], start: usize, is_placed: &mut [bool]) -> Vec<usize> {
    let mut reached = vec![start];
    is_placed[start] = true;
    let mut next = 0;
    while let Some(unknown) = reached.get(next).copied() {
        let mut new: Vec<usize> =
            coupled[unknown].iter().copied().filter(|other| !is_placed[*other]).collect();
        new.sort_by_key(|other| (coupled[*other].len(), *other));
        for other in &new {
            is_placed[*other] = true;
        }
        reached.extend(new);
        next += 1;
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of coupled places, numbered at random, and one that stands alone.
    fn plate(side: usize) -> DMatrix<f64> {
        let n = side * side + 1;
        let place = |index: usize| (index * 7) % n;
        let mut matrix = DMatrix::identity(n, n) * 0.7;
        let mut couple = |one: usize, other: usize, by: f64| {
            let (one, other) = (place(one), place(other));
            matrix[(one, other)] -= by;
            matrix[(other, one)] -= by;
            matrix[(one, one)] += by;
            matrix[(other, other)] += by;
        };
        for row in 0..side {
            for column in 0..side {
                let at = row * side + column;
                if column + 1 < side {
                    couple(at, at + 1, 1.0 + 0.1 * row as f64);
                }
                if row + 1 < side {
                    couple(at, at + side, 0.5);
                }
            }
        }
        matrix
    }

    #[test]
    fn it_solves_as_a_dense_factor_does() {
        let matrix = plate(9);
        let banded = Banded::factor(&matrix).unwrap();
        assert!(banded.width <= 12, "{}", banded.width);
        let dense = matrix.clone().cholesky().unwrap();
        let right =
            DMatrix::from_fn(82, 21, |row, column| (row as f64 * 0.3 + column as f64).sin());
        assert!((banded.solve(&right) - dense.solve(&right)).amax() < 1e-12);
        assert!((banded.inverse() - dense.inverse()).amax() < 1e-12);
        let ln: f64 = dense.l().diagonal().iter().map(|value| value.ln()).sum();
        assert!((banded.ln_diagonal() - ln).abs() < 1e-10);
    }

    #[test]
    fn what_is_not_positive_definite_has_no_factor() {
        let mut matrix = plate(4);
        matrix[(3, 3)] = -1.0;
        assert!(Banded::factor(&matrix).is_none());
        matrix[(3, 3)] = f64::NAN;
        assert!(Banded::factor(&matrix).is_none());
    }

    #[test]
    fn nothing_and_one_are_solved_too() {
        assert_eq!(Banded::factor(&DMatrix::zeros(0, 0)).unwrap().inverse().nrows(), 0);
        let one = Banded::factor(&DMatrix::from_element(1, 1, 4.0)).unwrap();
        assert!((one.inverse()[(0, 0)] - 0.25).abs() < 1e-15);
    }
}
