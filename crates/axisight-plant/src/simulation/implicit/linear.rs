//! `(shift I - J) x = b`, factorized once and solved for many right-hand sides.

use nalgebra::{ComplexField, DMatrix, DVector, Dyn, LU};

/// A factorized `shift I - J`.
pub(super) struct Shifted<T: ComplexField>(LU<T, Dyn, Dyn>);

impl<T: ComplexField<RealField = f64>> Shifted<T> {
    pub(super) fn new(jacobian: &DMatrix<f64>, shift: &T) -> Self {
        let n = jacobian.nrows();
        let entry = |i: usize, j: usize| {
            let own = T::from_real(-jacobian[(i, j)]);
            if i == j { own + shift.clone() } else { own }
        };
        Self(LU::new(DMatrix::from_fn(n, n, entry)))
    }

    /// Solve in place; false if the matrix is singular.
    #[must_use]
    pub(super) fn solve(&self, b: &mut DVector<T>) -> bool {
        self.0.solve_mut(b)
    }
}
