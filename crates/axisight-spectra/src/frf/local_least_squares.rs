//! Least squares over a few DFT lines, for the local methods.
//!
//! The method is modified Gram-Schmidt, with the right-hand sides as further columns. It is as
//! accurate for the solution as Householder reflections (Björck, 1967), does not depend on the
//! scale of a column, and leaves the orthonormal columns, which leverages and weights need.
//!
//! Normal equations would square the condition number, and a noise-free rational model is nearly
//! dependent by nature. All memory is allocated once per thread.

use nalgebra::Complex;

pub(super) type C = Complex<f64>;

/// A column counts as dependent if less than this share of its norm is left after
/// orthogonalization. Rounding of records and DFT leaves about 1e-15 to 1e-13.
pub(super) const DEPENDENT: f64 = 1e-11;

/// Complex columns of one length. Each column stores its real parts, then its imaginary parts, so
/// that plain loops become vector code.
#[derive(Debug, Clone)]
pub(super) struct Columns {
    rows: usize,
    data: Vec<f64>,
}

impl Columns {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            data: vec![0.0; 2 * rows * columns],
        }
    }

    pub(super) fn get(&self, column: usize) -> &[f64] {
        &self.data[2 * self.rows * column..2 * self.rows * (column + 1)]
    }

    pub(super) fn get_mut(&mut self, column: usize) -> &mut [f64] {
        &mut self.data[2 * self.rows * column..2 * self.rows * (column + 1)]
    }

    /// Real and imaginary parts of a column.
    pub(super) fn halves(&mut self, column: usize) -> (&mut [f64], &mut [f64]) {
        let rows = self.rows;
        self.get_mut(column).split_at_mut(rows)
    }

    pub(super) fn set(&mut self, column: usize, row: usize, value: C) {
        let rows = self.rows;
        let data = self.get_mut(column);
        data[row] = value.re;
        data[rows + row] = value.im;
    }

    /// Subtract from a column its component along an earlier, normalised column; returns the
    /// coefficient.
    pub(super) fn project(&mut self, column: usize, along: usize) -> C {
        let (before, rest) = self.data.split_at_mut(2 * self.rows * column);
        let unit = &before[2 * self.rows * along..2 * self.rows * (along + 1)];
        let target = &mut rest[..2 * self.rows];
        let part = inner(unit, target);
        add(target, -part, unit);
        part
    }

    /// Add a multiple of an earlier column to a later one.
    pub(super) fn accumulate(&mut self, column: usize, factor: C, earlier: usize) {
        let (before, rest) = self.data.split_at_mut(2 * self.rows * column);
        let source = &before[2 * self.rows * earlier..2 * self.rows * (earlier + 1)];
        add(&mut rest[..2 * self.rows], factor, source);
    }

    /// Normalise a column and return its norm. A column with a norm of at most `least` becomes
    /// zero.
    pub(super) fn normalise(&mut self, column: usize, least: f64) -> f64 {
        let data = self.get_mut(column);
        let norm = energy(data).sqrt();
        // In this form, a norm that is NaN also gives zero.
        let scale = if norm > least { 1.0 / norm } else { 0.0 };
        for v in data {
            *v *= scale;
        }
        norm * f64::from(u8::from(scale > 0.0))
    }
}

const LANES: usize = 4;

/// `a^H b` of two columns.
pub(super) fn inner(a: &[f64], b: &[f64]) -> C {
    let half = a.len() / 2;
    let ((ar, ai), (br, bi)) = (a.split_at(half), b.split_at(half));
    let mut re = [0.0; LANES];
    let mut im = [0.0; LANES];
    let chunks = half / LANES * LANES;
    for start in (0..chunks).step_by(LANES) {
        let at = start..start + LANES;
        let (p, q, s, t) = (&ar[at.clone()], &ai[at.clone()], &br[at.clone()], &bi[at]);
        for l in 0..LANES {
            re[l] += p[l] * s[l] + q[l] * t[l];
            im[l] += p[l] * t[l] - q[l] * s[l];
        }
    }
    for j in chunks..half {
        re[0] += ar[j] * br[j] + ai[j] * bi[j];
        im[0] += ar[j] * bi[j] - ai[j] * br[j];
    }
    C::new(re.iter().sum(), im.iter().sum())
}

/// `y += c x`.
pub(super) fn add(y: &mut [f64], c: C, x: &[f64]) {
    let half = x.len() / 2;
    let (yr, yi) = y.split_at_mut(half);
    let (xr, xi) = x.split_at(half);
    for (((yr, yi), xr), xi) in yr.iter_mut().zip(yi).zip(xr).zip(xi) {
        *yr += c.re * xr - c.im * xi;
        *yi += c.re * xi + c.im * xr;
    }
}

/// Sum of squared magnitudes.
pub(super) fn energy(a: &[f64]) -> f64 {
    a.iter().map(|v| v * v).sum()
}

/// The triangular factor of a Gram-Schmidt orthogonalisation, and its inverse.
#[derive(Debug, Clone)]
pub(super) struct Triangle {
    size: usize,
    upper: Vec<C>,
    inverse: Vec<C>,
}

impl Triangle {
    pub(super) fn new(size: usize) -> Self {
        Self {
            size,
            upper: vec![C::default(); size * size],
            inverse: vec![C::default(); size * size],
        }
    }

    /// Orthonormalise the leading columns in place; `norms` are their original norms. Returns false
    /// if the columns are dependent.
    pub(super) fn orthonormalise(&mut self, columns: &mut Columns, norms: &[f64]) -> bool {
        let n = self.size;
        for c in 0..n {
            for b in 0..c {
                self.upper[b * n + c] = columns.project(c, b);
            }
            let norm = columns.normalise(c, DEPENDENT * norms[c]);
            if norm <= 0.0 {
                return false;
            }
            self.upper[c * n + c] = C::new(norm, 0.0);
        }
        self.invert();
        true
    }

    fn invert(&mut self) {
        let n = self.size;
        self.inverse.fill(C::default());
        for c in 0..n {
            self.inverse[c * n + c] = C::new(1.0 / self.upper[c * n + c].re, 0.0);
            for r in (0..c).rev() {
                let sum: C = (r + 1..=c)
                    .map(|k| self.upper[r * n + k] * self.inverse[k * n + c])
                    .sum();
                self.inverse[r * n + c] = -sum / self.upper[r * n + r].re;
            }
        }
    }

    /// A row of the inverse of the triangular factor.
    pub(super) fn inverse_row(&self, row: usize) -> &[C] {
        &self.inverse[row * self.size..(row + 1) * self.size]
    }

    /// Frobenius condition number of the columns scaled to norm one, divided by its least value.
    ///
    /// The result is 1 for orthogonal columns and at most the usual condition number.
    pub(super) fn condition(&self, norms: &[f64]) -> f64 {
        let n = self.size;
        let (mut forward, mut backward) = (0.0, 0.0);
        for r in 0..n {
            for c in r..n {
                forward += self.upper[r * n + c].norm_sqr() / norms[c].powi(2);
                backward += self.inverse[r * n + c].norm_sqr() * norms[r].powi(2);
            }
        }
        (forward * backward).sqrt() / n as f64
    }
}

/// Polynomials up to `order` that are orthonormal over points on the frequency axis.
#[derive(Debug, Clone, Default)]
pub(super) struct Polynomials {
    order: usize,
    points: usize,
    values: Vec<f64>,
}

impl Polynomials {
    /// Compute the polynomials over `points`. They are also evaluated at `target`, which comes
    /// last.
    pub(super) fn build(&mut self, points: &[f64], target: f64, order: usize) {
        let (n, row) = (points.len(), points.len() + 1);
        (self.order, self.points) = (order, n);
        self.values.resize((order + 1) * row, 0.0);
        for s in 0..=order {
            let (before, rest) = self.values.split_at_mut(s * row);
            let now = &mut rest[..row];
            // Three-term recurrence: x times the last polynomial, orthogonalized twice against
            // rounding.
            for (j, v) in now.iter_mut().enumerate() {
                let x = points.get(j).copied().unwrap_or(target);
                *v = if s == 0 {
                    1.0
                } else {
                    x * before[(s - 1) * row + j]
                };
            }
            for earlier in before.chunks_exact(row).chain(before.chunks_exact(row)) {
                let part: f64 = now[..n].iter().zip(earlier).map(|(a, b)| a * b).sum();
                now.iter_mut()
                    .zip(earlier)
                    .for_each(|(a, b)| *a -= part * b);
            }
            let norm = energy(&now[..n]).sqrt();
            for v in now.iter_mut() {
                *v /= norm;
            }
        }
    }

    /// Values of polynomial `s` over the points.
    pub(super) fn over(&self, s: usize) -> &[f64] {
        let start = s * (self.points + 1);
        &self.values[start..start + self.points]
    }

    /// Value of polynomial `s` at the target.
    pub(super) fn at_target(&self, s: usize) -> f64 {
        self.values[s * (self.points + 1) + self.points]
    }

    /// Subtract from a signal (real or imaginary parts over the points) its projection on the
    /// polynomials; returns the value of the projection at the target.
    pub(super) fn remove(&self, signal: &mut [f64]) -> f64 {
        let mut value = 0.0;
        for s in 0..=self.order {
            let polynomial = self.over(s);
            let part: f64 = signal.iter().zip(polynomial).map(|(a, b)| a * b).sum();
            signal
                .iter_mut()
                .zip(polynomial)
                .for_each(|(a, b)| *a -= part * b);
            value += part * self.at_target(s);
        }
        value
    }
}
