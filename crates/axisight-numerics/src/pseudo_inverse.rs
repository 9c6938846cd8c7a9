//! Pseudo-inverse of a small wide complex matrix by one-sided Jacobi rotations.
//!
//! Demmel and Veselic (1992): the relative accuracy of every singular value depends only on the
//! scaling of the rows, so rows are first scaled to unit norm.

use nalgebra::Complex;

type C = Complex<f64>;

/// Largest number of sweeps over all pairs. Convergence is quadratic and takes five or six sweeps.
const SWEEPS: usize = 40;

/// Solver for matrices of one shape.
#[derive(Debug, Clone)]
pub struct PseudoInverse {
    rows: usize,
    columns: usize,
    /// The conjugated rows, rotated until all are orthogonal, `(row, column)`.
    turned: Vec<C>,
    /// The accumulated rotations, column by column.
    turns: Vec<C>,
    squares: Vec<f64>,
    scale: Vec<f64>,
}

impl PseudoInverse {
    /// A solver for matrices of `rows` by `columns`, with at most as many rows as columns.
    pub fn new(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            turned: vec![C::default(); rows * columns],
            turns: vec![C::default(); rows * rows],
            squares: vec![0.0; rows],
            scale: vec![0.0; rows],
        }
    }

    /// Compute `out = a^+` with shape `(columns, rows)` from `a` with shape `(rows, columns)`, both
    /// row-major.
    ///
    /// Returns the smallest and largest singular value of `a` with rows scaled to unit norm. `out`
    /// is finite only if the smallest is above zero.
    pub fn compute(&mut self, a: &[C], out: &mut [C]) -> (f64, f64) {
        let (m, e) = (self.rows, self.columns);
        for i in 0..m {
            let row = &a[i * e..(i + 1) * e];
            // Divide by the largest entry first, because squares of small numbers would underflow.
            let largest = row
                .iter()
                .map(|x| x.re.abs().max(x.im.abs()))
                .fold(0.0, f64::max);
            let norm: f64 = row.iter().map(|x| (x / largest).norm_sqr()).sum();
            let scale = 1.0 / (largest * norm.sqrt());
            self.scale[i] = if scale.is_finite() { scale } else { 0.0 };
            for (turned, x) in self.turned[i * e..(i + 1) * e].iter_mut().zip(row) {
                *turned = x.conj() * self.scale[i];
            }
            for j in 0..m {
                self.turns[i * m + j] = C::new(f64::from(u8::from(i == j)), 0.0);
            }
        }
        for _ in 0..SWEEPS {
            let mut turned = false;
            for p in 0..m {
                for q in p + 1..m {
                    turned |= self.turn(p, q);
                }
            }
            if !turned {
                break;
            }
        }
        for (i, square) in self.squares.iter_mut().enumerate() {
            *square = self.turned[i * e..(i + 1) * e]
                .iter()
                .map(Complex::norm_sqr)
                .sum();
        }
        for column in 0..e {
            for row in 0..m {
                let sum: C = (0..m)
                    .map(|s| {
                        let turned = self.turned[s * e + column] / self.squares[s];
                        turned * self.turns[s * m + row].conj()
                    })
                    .sum();
                out[column * m + row] = sum * self.scale[row];
            }
        }
        let extreme = |f: fn(f64, f64) -> f64, start| self.squares.iter().copied().fold(start, f);
        (
            extreme(f64::min, f64::INFINITY).sqrt(),
            extreme(f64::max, 0.0).sqrt(),
        )
    }

    /// Rotate vectors `p` and `q` to be orthogonal. Returns false if they already are.
    fn turn(&mut self, p: usize, q: usize) -> bool {
        let e = self.columns;
        let (above, below) = self.turned.split_at(q * e);
        let (a, b) = (&above[p * e..(p + 1) * e], &below[..e]);
        let alpha: f64 = a.iter().map(Complex::norm_sqr).sum();
        let beta: f64 = b.iter().map(Complex::norm_sqr).sum();
        let product: C = a.iter().zip(b).map(|(a, b)| a.conj() * b).sum();
        // Rows have unit norm, so nothing overflows and `hypot` is not needed.
        let size = product.norm_sqr().sqrt();
        let orthogonal = size <= f64::EPSILON * (alpha * beta).sqrt();
        if orthogonal || !size.is_finite() || size < f64::MIN_POSITIVE {
            return false;
        }
        let zeta = (beta - alpha) / (2.0 * size);
        let t = zeta.signum() / (zeta.abs() + (zeta * zeta + 1.0).sqrt());
        let c = 1.0 / (t * t + 1.0).sqrt();
        let (s, phase) = (c * t, product.conj() * (1.0 / size));
        rotate(&mut self.turned, e, (p, q), (c, s), phase);
        rotate(&mut self.turns, self.rows, (p, q), (c, s), phase);
        true
    }
}

fn rotate(vectors: &mut [C], n: usize, (p, q): (usize, usize), (c, s): (f64, f64), phase: C) {
    let (above, below) = vectors.split_at_mut(q * n);
    for (a, b) in above[p * n..(p + 1) * n].iter_mut().zip(&mut below[..n]) {
        let (x, y) = (*a, *b * phase);
        *a = x * c - y * s;
        *b = x * s + y * c;
    }
}
