//! Exact propagation over one step, and its correction for the ripple.
//!
//! With time in steps, `s` from 0 to 1, the torque is a polynomial `w(s) = sum_k w_k s^k / k!`, and
//! `x(1) = Phi x(0) + sum_k G_k w_k`. Here `G_k = int_0^1 e^{A h (1-s)} B h s^k / k! ds`. All these
//! matrices are blocks of one matrix exponential (Van Loan 1978, IEEE Trans. Automatic Control
//! 23(3)).
//!
//! The *prediction* uses the straight line through the torque and its slope at the start:
//! `Phi x + G_0 t_0 + G_1 d_0`. It is exact for the linear part, and its error in the motor angle
//! is of order `h^4` in the ripple.
//!
//! The *correction* uses the ripple `t_1` and its slope `d_1` at the predicted end. The cubic that
//! meets both ends (Hermite) differs from the line by `(3 e_1 - e_2) s^2 + (e_2 - 2 e_1) s^3`,
//! where `e_1 = t_1 - t_0 - d_0` and `e_2 = d_1 - d_0`. The error of the cubic is at most
//! `v'''' h^4 / 384`. The local error is `O(h^5)` and the global error `O(h^4)`, for one evaluation
//! of the ripple per step.

use super::tiles::Tiles;
use nalgebra::DMatrix;

/// Matrices of one step.
#[derive(Debug, Clone)]
pub(super) struct Propagator {
    /// Length of the step [s].
    pub(super) step: f64,
    /// `[G_0, G_1, Phi]`, to be multiplied by `[t_0, d_0, x]`.
    pub(super) predict: Tiles,
    /// Columns to be multiplied by `[e_1, e_2]`.
    pub(super) correct: Tiles,
}

impl Propagator {
    /// Matrices for `x' = a x + b w` over `step` seconds. The second half of the states must be the
    /// rates of the first half.
    pub(super) fn new(a: &DMatrix<f64>, b: &DMatrix<f64>, step: f64) -> Self {
        let (n, m) = (a.nrows(), b.ncols());
        // Rates per step instead of per second keep the powers of A h small.
        let unit = |i: usize| if i < n / 2 { 1.0 } else { step };
        let mut joint = DMatrix::zeros(n + 4 * m, n + 4 * m);
        for i in 0..n {
            for j in 0..n {
                joint[(i, j)] = a[(i, j)] * step * unit(i) / unit(j);
            }
            for j in 0..m {
                joint[(i, n + j)] = b[(i, j)] * step * unit(i);
            }
        }
        for i in 0..3 * m {
            joint[(n + i, n + m + i)] = 1.0;
        }
        let exponential = joint.exp();
        let block =
            |k: usize| DMatrix::from_fn(n, m, |i, j| exponential[(i, n + k * m + j)] / unit(i));
        let (second, third) = (block(2), block(3));
        let mut predict = DMatrix::zeros(n, 2 * m + n);
        predict.columns_mut(0, m).copy_from(&block(0));
        predict.columns_mut(m, m).copy_from(&block(1));
        for i in 0..n {
            for j in 0..n {
                predict[(i, 2 * m + j)] = exponential[(i, j)] / unit(i) * unit(j);
            }
        }
        let mut correct = DMatrix::zeros(n, 2 * m);
        let (first, last) = (&second * 6.0 - &third * 12.0, &third * 6.0 - &second * 2.0);
        correct.columns_mut(0, m).copy_from(&first);
        correct.columns_mut(m, m).copy_from(&last);
        Self {
            step,
            predict: Tiles::new(&predict),
            correct: Tiles::new(&correct),
        }
    }

    /// Fused multiply-adds of one step.
    pub(super) fn operations(&self, ripple: bool) -> usize {
        let correct = if ripple { self.correct.operations() } else { 0 };
        self.predict.operations() + correct
    }
}
