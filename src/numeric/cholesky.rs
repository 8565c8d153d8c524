//! The factor of Cholesky, block by block.

use nalgebra::{Cholesky, DMatrix, Dyn};

/// Columns that are factored together. Numerical: `nalgebra`'s own factor goes through memory once for each column, which takes
/// five times as long with a thousand of them.
const BLOCK: usize = 64;

/// The factor of a symmetric matrix of which only the lower triangle is read; `None` if it is not positive definite.
pub(crate) fn cholesky(mut matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let n = matrix.nrows();
    for first in (0..n).step_by(BLOCK) {
        let size = BLOCK.min(n - first);
        let here = (first, first);
        let factor = matrix.view(here, (size, size)).into_owned().cholesky()?.unpack();
        matrix.view_mut(here, (size, size)).copy_from(&factor);
        let (next, rest) = (first + size, n - first - size);
        if rest == 0 {
            break;
        }
        let mut inverse = DMatrix::identity(size, size);
        factor.solve_lower_triangular_mut(&mut inverse);
        let below = matrix.view((next, first), (rest, size)) * inverse.transpose();
        matrix.view_mut((next, first), (rest, size)).copy_from(&below);
        for column in (0..rest).step_by(BLOCK) {
            let width = BLOCK.min(rest - column);
            let across = below.rows(column, width).transpose();
            matrix.view_mut((next + column, next + column), (rest - column, width)).gemm(
                -1.0,
                &below.rows(column, rest - column),
                &across,
                1.0,
            );
        }
    }
    Some(Cholesky::pack_dirty(matrix))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Covariances of a smooth record with little noise.
    fn covariances(n: usize, noise: f64) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |row, column| {
            let apart = (row as f64 - column as f64) / 20.0;
            (-apart * apart).exp() + if row == column { noise } else { 0.0 }
        })
    }

    #[test]
    fn it_is_the_factor_of_any_size() {
        for n in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK, 3 * BLOCK + 17] {
            let matrix = covariances(n, 1e-4);
            let factor = cholesky(matrix.clone()).unwrap().unpack();
            assert_eq!(factor, factor.lower_triangle());
            let apart =
                (&factor * factor.transpose() - &matrix).abs().iter().copied().fold(0.0, f64::max);
            assert!(apart < 1e-12, "{n}: {apart}");
            let other = matrix.cholesky().unwrap().unpack();
            assert!((factor - other).abs().iter().all(|apart| *apart < 1e-8), "{n}");
        }
    }

    #[test]
    fn the_upper_triangle_is_not_read() {
        let matrix = covariances(2 * BLOCK + 5, 0.1);
        let lower = cholesky(matrix.lower_triangle()).unwrap().unpack();
        assert_eq!(lower, cholesky(matrix).unwrap().unpack());
    }

    #[test]
    fn what_is_not_positive_definite_has_none() {
        for place in [0, BLOCK / 2, BLOCK + 3, 2 * BLOCK + 4] {
            let mut matrix = covariances(2 * BLOCK + 5, 0.1);
            matrix[(place, place)] = -0.01;
            assert!(cholesky(matrix).is_none(), "{place}");
        }
    }
}
