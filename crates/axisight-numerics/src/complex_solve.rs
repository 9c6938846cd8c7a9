//! Small dense complex systems, many at a time. Singular systems are reported.

use nalgebra::Complex;

type C = Complex<f64>;

/// Smallest pivot that counts as non-zero, for rows scaled to one.
///
/// Rounding leaves about 1e-15 of a dependent row. Simulated records raise this a hundredfold.
const SMALLEST_PIVOT: f64 = 1e-12;

/// Solver with scratch memory for systems of one size.
#[derive(Debug, Clone)]
pub struct SmallSolver {
    n: usize,
    matrix: Vec<C>,
    right: Vec<C>,
}

impl SmallSolver {
    /// A solver for square matrices of `n` rows.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            matrix: vec![C::default(); n * n],
            right: vec![C::default(); n * n],
        }
    }

    /// Compute `out = y u^-1`, all row-major `(n, n)`.
    ///
    /// Returns false and leaves `out` unchanged if `u` is singular to working precision or an entry
    /// is not finite.
    pub fn right_divide(&mut self, y: &[C], u: &[C], out: &mut [C]) -> bool {
        let n = self.n;
        // `x u = y` is the same system as `u' x' = y'`.
        for i in 0..n {
            for j in 0..n {
                self.matrix[j * n + i] = u[i * n + j];
                self.right[j * n + i] = y[i * n + j];
            }
        }
        let solved = self.eliminate();
        if solved {
            for i in 0..n {
                for j in 0..n {
                    out[i * n + j] = self.right[j * n + i];
                }
            }
        }
        solved
    }

    /// Compute `out = a^-1`, row-major `(n, n)`; returns false as [`SmallSolver::right_divide`]
    /// does.
    pub fn invert(&mut self, a: &[C], out: &mut [C]) -> bool {
        let n = self.n;
        self.matrix.copy_from_slice(a);
        for i in 0..n {
            for j in 0..n {
                self.right[i * n + j] = C::new(f64::from(u8::from(i == j)), 0.0);
            }
        }
        let solved = self.eliminate();
        if solved {
            out.copy_from_slice(&self.right);
        }
        solved
    }

    /// Gauss-Jordan elimination with partial pivoting on rows scaled to their largest entry.
    fn eliminate(&mut self) -> bool {
        let n = self.n;
        for row in 0..n {
            let entries = &self.matrix[row * n..(row + 1) * n];
            let scale = entries.iter().map(|c| c.norm()).fold(0.0, f64::max);
            let finite = entries.iter().all(|c| c.re.is_finite() && c.im.is_finite());
            if !finite || scale < f64::MIN_POSITIVE {
                return false;
            }
            for j in 0..n {
                self.matrix[row * n + j] /= scale;
                self.right[row * n + j] /= scale;
            }
        }
        for column in 0..n {
            let (mut pivot, mut size) = (column, 0.0);
            for row in column..n {
                let norm = self.matrix[row * n + column].norm();
                if norm > size {
                    (pivot, size) = (row, norm);
                }
            }
            if size <= SMALLEST_PIVOT {
                return false;
            }
            for j in 0..n {
                self.matrix.swap(pivot * n + j, column * n + j);
                self.right.swap(pivot * n + j, column * n + j);
            }
            let inverse = C::new(1.0, 0.0) / self.matrix[column * n + column];
            for j in 0..n {
                self.matrix[column * n + j] *= inverse;
                self.right[column * n + j] *= inverse;
            }
            for row in (0..n).filter(|r| *r != column) {
                let factor = self.matrix[row * n + column];
                for j in 0..n {
                    let (m, r) = (self.matrix[column * n + j], self.right[column * n + j]);
                    self.matrix[row * n + j] -= factor * m;
                    self.right[row * n + j] -= factor * r;
                }
            }
        }
        self.right
            .iter()
            .all(|c| c.re.is_finite() && c.im.is_finite())
    }
}
