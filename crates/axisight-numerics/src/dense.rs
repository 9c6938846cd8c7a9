//! Dense real matrices: eigenvalues with eigenvectors, and large positive definite systems.

use faer::prelude::Solve;
use faer::{MatRef, Side};
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// Eigenvalues and eigenvectors (columns) of a square real matrix, in matching order.
///
/// Returns `None` if the iteration does not converge, which means that an entry is not finite.
pub fn eigen(matrix: &DMatrix<f64>) -> Option<(Vec<C>, DMatrix<C>)> {
    let eigen = view(matrix).eigen().ok()?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let complex = |x: faer::c64| C::new(x.re, x.im);
    let n = matrix.nrows();
    Some((
        (0..n).map(|i| complex(values[i])).collect(),
        DMatrix::from_fn(n, n, |i, j| complex(vectors[(i, j)])),
    ))
}

/// Solution of `a x = b` for a symmetric positive definite `a`, of which only the lower half is
/// read.
///
/// Returns `None` if `a` is not positive definite.
pub fn solve_positive(a: &DMatrix<f64>, b: &[f64]) -> Option<Vec<f64>> {
    let right = MatRef::from_column_major_slice(b, b.len(), 1);
    let solution = view(a).llt(Side::Lower).ok()?.solve(&right);
    Some((0..b.len()).map(|i| solution[(i, 0)]).collect())
}

fn view(matrix: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_satisfy_their_equation() {
        let a = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.2, -4.0, -0.3, 0.1, 0.5, 0.0, -2.0]);
        let (values, vectors) = eigen(&a).expect("finite");
        let lifted = a.map(|x| C::new(x, 0.0));
        for (value, vector) in values.iter().zip(vectors.column_iter()) {
            assert!((&lifted * vector - vector * *value).norm() < 1e-13);
        }
        let trace: C = values.iter().sum();
        assert!((trace - a.trace()).norm() < 1e-13);
    }

    #[test]
    fn a_matrix_that_is_not_finite_has_no_eigenvalues() {
        assert!(eigen(&DMatrix::from_element(2, 2, f64::NAN)).is_none());
    }

    #[test]
    fn solves_from_the_lower_half_and_refuses_indefinite_matrices() {
        let a = DMatrix::from_row_slice(2, 2, &[4.0, f64::NAN, 2.0, 3.0]);
        // [4 2; 2 3] x = [2, 5] has x = [-0.5, 2].
        let x = solve_positive(&a, &[2.0, 5.0]).expect("positive");
        assert!((x[0] + 0.5).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
        let indefinite = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 2.0, 1.0]);
        assert!(solve_positive(&indefinite, &[1.0, 1.0]).is_none());
    }
}
