//! Many small complex matrices at a time: several in lock-step, one per lane.
//!
//! LU with partial pivoting on rows scaled by powers of two (so that scaling rounds nothing),
//! the forward and back substitutions of LAPACK's `gesv`, hence its residuals: column `j` of
//! the inverse solves `A x = e_j`. Exchanges of rows are selections lane by lane.

use super::SmallSolver;
use crate::scalar::{Lanes, Scalar};
use nalgebra::Complex;
use rayon::prelude::*;
use std::array::from_fn;

type C = Complex<f64>;

/// Matrices in lock-step: one register of four doubles for each part of each entry.
const LANES: usize = 4;
type V = Lanes<LANES>;

/// Matrices of one parallel task: enough to hide the hand-over, few enough for the cache.
const TASK: usize = 512;

/// Largest size with a kernel of its own.
const LARGEST: usize = 8;

/// Shapes that do not fit together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: expected {expected} numbers, got {got}")]
pub struct BatchShapeError {
    /// Argument.
    pub field: &'static str,
    /// Numbers it should hold.
    pub expected: usize,
    /// Numbers it holds.
    pub got: usize,
}

fn check(field: &'static str, got: usize, expected: usize) -> Result<(), BatchShapeError> {
    if got == expected {
        return Ok(());
    }
    Err(BatchShapeError {
        field,
        expected,
        got,
    })
}

/// Inverses of `count` row-major matrices of `n` rows into `out`; true for each that is
/// singular to working precision or not finite. Those inverses are NaN.
///
/// Singular means that a pivot is at most `4 n 2^-52` of the largest entry of its column, rows
/// scaled to about one: units of rows and columns do not matter. Works on the threads of the
/// current pool; the result does not depend on their number.
///
/// # Errors
/// [`BatchShapeError`] where `matrices` or `out` do not hold `count n n` numbers.
pub fn invert_batch(
    matrices: &[C],
    n: usize,
    count: usize,
    out: &mut [C],
) -> Result<Vec<bool>, BatchShapeError> {
    check("matrices", matrices.len(), count * n * n)?;
    check("out", out.len(), count * n * n)?;
    let mut singular = vec![false; count];
    if n == 0 {
        return Ok(singular);
    }
    let task = TASK * n * n;
    out.par_chunks_mut(task)
        .zip(matrices.par_chunks(task))
        .zip(singular.par_chunks_mut(TASK))
        .for_each(|((out, a), singular)| match n {
            1 => invert_some::<1>(a, out, singular),
            2 => invert_some::<2>(a, out, singular),
            3 => invert_some::<3>(a, out, singular),
            4 => invert_some::<4>(a, out, singular),
            5 => invert_some::<5>(a, out, singular),
            6 => invert_some::<6>(a, out, singular),
            7 => invert_some::<7>(a, out, singular),
            LARGEST => invert_some::<LARGEST>(a, out, singular),
            _ => invert_large(n, a, out, singular),
        });
    Ok(singular)
}

/// `Y U^-1` for `count` pairs, `y` of shape `(count, rows, n)` and `u` of `(count, n, n)`, into
/// `out`; flags and threads as for [`invert_batch`].
///
/// # Errors
/// [`BatchShapeError`] where `y`, `u` or `out` do not have these shapes.
pub fn right_divide_batch(
    y: &[C],
    u: &[C],
    (rows, n): (usize, usize),
    count: usize,
    out: &mut [C],
) -> Result<Vec<bool>, BatchShapeError> {
    check("u", u.len(), count * n * n)?;
    check("y", y.len(), count * rows * n)?;
    check("out", out.len(), count * rows * n)?;
    let mut singular = vec![false; count];
    if n == 0 || rows == 0 {
        return Ok(singular);
    }
    out.par_chunks_mut(TASK * rows * n)
        .zip(y.par_chunks(TASK * rows * n))
        .zip(u.par_chunks(TASK * n * n))
        .zip(singular.par_chunks_mut(TASK))
        .for_each(|(((out, y), u), singular)| match n {
            1 => divide_some::<1>(y, u, rows, out, singular),
            2 => divide_some::<2>(y, u, rows, out, singular),
            3 => divide_some::<3>(y, u, rows, out, singular),
            4 => divide_some::<4>(y, u, rows, out, singular),
            5 => divide_some::<5>(y, u, rows, out, singular),
            6 => divide_some::<6>(y, u, rows, out, singular),
            7 => divide_some::<7>(y, u, rows, out, singular),
            LARGEST => divide_some::<LARGEST>(y, u, rows, out, singular),
            _ => divide_large(n, y, u, rows, out, singular),
        });
    Ok(singular)
}

const NAN: C = C::new(f64::NAN, f64::NAN);

fn invert_large(n: usize, a: &[C], out: &mut [C], singular: &mut [bool]) {
    let mut solver = SmallSolver::new(n);
    let matrices = a.chunks_exact(n * n).zip(out.chunks_exact_mut(n * n));
    for ((a, out), singular) in matrices.zip(singular) {
        *singular = !solver.invert(a, out);
        if *singular {
            out.fill(NAN);
        }
    }
}

fn divide_large(n: usize, y: &[C], u: &[C], rows: usize, out: &mut [C], singular: &mut [bool]) {
    let mut solver = SmallSolver::new(n);
    let (mut inverse, nothing) = (vec![C::default(); n * n], C::default());
    let matrices = u.chunks_exact(n * n).zip(y.chunks_exact(rows * n));
    let results = out.chunks_exact_mut(rows * n).zip(singular);
    for ((u, y), (out, singular)) in matrices.zip(results) {
        *singular = !solver.invert(u, &mut inverse);
        if *singular {
            out.fill(NAN);
            continue;
        }
        for (i, out) in out.iter_mut().enumerate() {
            let (row, column) = (i / n, i % n);
            *out = (0..n).fold(nothing, |sum, k| {
                sum + y[row * n + k] * inverse[k * n + column]
            });
        }
    }
}

/// A complex number per lane.
#[derive(Clone, Copy)]
struct Pair {
    re: V,
    im: V,
}

impl Pair {
    const ZERO: Self = Self {
        re: Lanes([0.0; LANES]),
        im: Lanes([0.0; LANES]),
    };

    #[inline(always)]
    fn times(self, b: Self) -> Self {
        Self {
            re: self.im.fnma(b.im, self.re * b.re),
            im: self.re.fma(b.im, self.im * b.re),
        }
    }

    /// `self - a b`.
    #[inline(always)]
    fn minus_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.fma(b.im, a.re.fnma(b.re, self.re)),
            im: a.im.fnma(b.re, a.re.fnma(b.im, self.im)),
        }
    }

    #[inline(always)]
    fn scaled(self, factor: V) -> Self {
        Self {
            re: self.re * factor,
            im: self.im * factor,
        }
    }

    /// Squared modulus.
    #[inline(always)]
    fn square(self) -> V {
        self.re.fma(self.re, self.im * self.im)
    }

    #[inline(always)]
    fn recip(self) -> Self {
        let factor = self.square().recip();
        Self {
            re: self.re * factor,
            im: -(self.im * factor),
        }
    }

    /// Entry `entry` of four matrices.
    #[inline(always)]
    fn gather(matrices: &[&[C]; LANES], entry: usize) -> Self {
        let [a, b, c, d] = matrices.map(|m| m[entry]);
        Self {
            re: Lanes([a.re, b.re, c.re, d.re]),
            im: Lanes([a.im, b.im, c.im, d.im]),
        }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> C {
        C::new(self.re.0[lane], self.im.0[lane])
    }
}

/// Exchange two numbers in the lanes where `when > 0`.
#[inline(always)]
fn exchange(when: V, a: &mut V, b: &mut V) {
    (*a, *b) = (when.if_positive(*b, *a), when.if_positive(*a, *b));
}

/// The power of two at or below a positive number, inverted; other numbers give zero,
/// infinity or NaN, which end in a flag.
#[inline(always)]
fn inverse_power_of_two(x: V) -> V {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    Lanes(x.0.map(|x| f64::from_bits(x.to_bits() & EXPONENT))).recip()
}

/// `P D A = L U`: U above the diagonal, L below (its diagonal is one), the inverses of the
/// diagonal of U on it. Lives in one place and is filled anew for each group of matrices.
struct Factors<const N: usize> {
    lu: [[Pair; N]; N],
    /// Scale of the row that has come to each place.
    scale: [V; N],
    /// Which row has come to each place.
    row: [V; N],
    /// Above zero where the matrix is singular or a result is not finite.
    bad: V,
}

impl<const N: usize> Factors<N> {
    const EMPTY: Self = Self {
        lu: [[Pair::ZERO; N]; N],
        scale: [Lanes([0.0; LANES]); N],
        row: [Lanes([0.0; LANES]); N],
        bad: Lanes([0.0; LANES]),
    };

    /// Factor what stands in `lu`.
    #[inline(always)]
    fn factor(&mut self) {
        // Largest square of each column.
        let mut square_of = [V::zero(); N];
        for i in 0..N {
            let mut largest = V::zero();
            for j in 0..N {
                let entry = self.lu[i][j];
                largest = entry.re.magnitude_or(entry.im.magnitude_or(largest));
            }
            let scale = inverse_power_of_two(largest);
            for j in 0..N {
                self.lu[i][j] = self.lu[i][j].scaled(scale);
                square_of[j] = self.lu[i][j].square().magnitude_or(square_of[j]);
            }
            (self.scale[i], self.row[i]) = (scale, V::constant(i as f64));
        }
        self.bad = V::zero();
        for k in 0..N {
            self.pivot(k);
            let threshold = square_of[k] * (4.0 * N as f64 * f64::EPSILON).powi(2);
            let above = self.lu[k][k].square() - threshold;
            self.bad = above.if_positive(self.bad, V::one());
            let inverse = self.lu[k][k].recip();
            self.lu[k][k] = inverse;
            for i in k + 1..N {
                let factor = self.lu[i][k].times(inverse);
                self.lu[i][k] = factor;
                for j in k + 1..N {
                    self.lu[i][j] = self.lu[i][j].minus_product(factor, self.lu[k][j]);
                }
            }
        }
    }

    /// Bring the largest entry of column `k` from row `k` on to row `k`.
    #[inline(always)]
    fn pivot(&mut self, k: usize) {
        let mut size = self.lu[k][k].square();
        for i in k + 1..N {
            let other = self.lu[i][k].square();
            let larger = other - size;
            size = larger.if_positive(other, size);
            let (above, below) = self.lu.split_at_mut(i);
            let (upper, lower) = (&mut above[k], &mut below[0]);
            for j in 0..N {
                exchange(larger, &mut upper[j].re, &mut lower[j].re);
                exchange(larger, &mut upper[j].im, &mut lower[j].im);
            }
            for list in [&mut self.scale, &mut self.row] {
                let (above, below) = list.split_at_mut(i);
                exchange(larger, &mut above[k], &mut below[0]);
            }
        }
    }

    /// `L x = b` from place `first` on, in place; zero before it.
    #[inline(always)]
    fn forward_substitute(&self, b: &mut [Pair; N], first: usize) {
        for i in first + 1..N {
            let mut x = b[i];
            for k in first..i {
                x = x.minus_product(self.lu[i][k], b[k]);
            }
            b[i] = x;
        }
    }

    /// `U x = b`, in place.
    #[inline(always)]
    fn back_substitute(&mut self, b: &mut [Pair; N]) {
        for i in (0..N).rev() {
            let mut x = b[i];
            for k in i + 1..N {
                x = x.minus_product(self.lu[i][k], b[k]);
            }
            b[i] = x.times(self.lu[i][i]);
        }
    }

    /// Note where a result is not finite.
    #[inline(always)]
    fn check(&mut self, x: Pair) {
        // Zero times a number is zero, times anything else NaN, which is not positive.
        let finite = V::one() + (x.re + x.im) * 0.0;
        self.bad = finite.if_positive(self.bad, V::one());
    }

    fn row(&self, place: usize, lane: usize) -> usize {
        // Whole numbers below N, also where the entries are NaN.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let row = self.row[place].0[lane] as usize;
        row
    }
}

/// Four slices of `size` numbers; beyond the last slice, the last again.
#[inline(always)]
fn four(a: &[C], size: usize) -> [&[C]; LANES] {
    let last = (a.len() / size).saturating_sub(1);
    from_fn(|l| &a[l.min(last) * size..][..size])
}

fn invert_some<const N: usize>(a: &[C], out: &mut [C], singular: &mut [bool]) {
    let size = N * N;
    let mut factors = Factors::<N>::EMPTY;
    let groups = a.chunks(LANES * size).zip(out.chunks_mut(LANES * size));
    for ((a, out), singular) in groups.zip(singular.chunks_mut(LANES)) {
        let matrices = four(a, size);
        for i in 0..N {
            for j in 0..N {
                factors.lu[i][j] = Pair::gather(&matrices, i * N + j);
            }
        }
        factors.factor();
        for j in 0..N {
            let mut x = [Pair::ZERO; N];
            x[j].re = factors.scale[j];
            factors.forward_substitute(&mut x, j);
            factors.back_substitute(&mut x);
            for x in x {
                factors.check(x);
            }
            for (l, out) in out.chunks_exact_mut(size).enumerate() {
                let column = factors.row(j, l);
                for i in 0..N {
                    out[i * N + column] = x[i].lane(l);
                }
            }
        }
        finish(factors.bad, size, out, singular);
    }
}

fn divide_some<const N: usize>(
    y: &[C],
    u: &[C],
    rows: usize,
    out: &mut [C],
    singular: &mut [bool],
) {
    let (size, wide) = (N * N, rows * N);
    let mut factors = Factors::<N>::EMPTY;
    let groups = u.chunks(LANES * size).zip(y.chunks(LANES * wide));
    let results = out.chunks_mut(LANES * wide).zip(singular.chunks_mut(LANES));
    for ((u, y), (out, singular)) in groups.zip(results) {
        // g u = y is u' g' = y'.
        let (matrices, right) = (four(u, size), four(y, wide));
        for i in 0..N {
            for j in 0..N {
                factors.lu[i][j] = Pair::gather(&matrices, j * N + i);
            }
        }
        factors.factor();
        for r in 0..rows {
            let mut x = [Pair::ZERO; N];
            for (i, x) in x.iter_mut().enumerate() {
                for l in 0..LANES {
                    let entry = right[l][r * N + factors.row(i, l)];
                    (x.re.0[l], x.im.0[l]) = (entry.re, entry.im);
                }
                *x = x.scaled(factors.scale[i]);
            }
            factors.forward_substitute(&mut x, 0);
            factors.back_substitute(&mut x);
            for (i, x) in x.iter().enumerate() {
                factors.check(*x);
                for (l, out) in out.chunks_exact_mut(wide).enumerate() {
                    out[r * N + i] = x.lane(l);
                }
            }
        }
        finish(factors.bad, wide, out, singular);
    }
}

/// Flag the bad lanes and make their results NaN.
#[inline(always)]
fn finish(bad: V, size: usize, out: &mut [C], singular: &mut [bool]) {
    for (l, (out, singular)) in out.chunks_exact_mut(size).zip(singular).enumerate() {
        *singular = bad.0[l] > 0.0;
        if *singular {
            out.fill(NAN);
        }
    }
}
