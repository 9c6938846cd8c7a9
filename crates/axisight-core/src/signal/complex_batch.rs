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

fn divide_large(
    n: usize,
    y: &[C],
    u: &[C],
    rows: usize,
    out: &mut [C],
    singular: &mut [bool],
) {
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
            *out = (0..n).fold(nothing, |sum, k| sum + y[row * n + k] * inverse[k * n + column]);
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
            re: self.re.fma(b.re, -(self.im * b.im)),
            im: self.re.fma(b.im, self.im * b.re),
        }
    }

    /// `self - a b`.
    #[inline(always)]
    fn minus_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.fma(b.im, (-a.re).fma(b.re, self.re)),
            im: (-a.im).fma(b.re, (-a.re).fma(b.im, self.im)),
        }
    }

    #[inline(always)]
    fn scaled(self, factor: V) -> Self {
        Self {
            re: self.re * factor,
            im: self.im * factor,
        }
    }

    /// `|re| + |im|`, what LAPACK compares pivots by.
    #[inline(always)]
    fn size(self) -> V {
        self.re.abs() + self.im.abs()
    }

    #[inline(always)]
    fn recip(self) -> Self {
        let factor = self.re.fma(self.re, self.im * self.im).recip();
        Self {
            re: self.re * factor,
            im: -(self.im * factor),
        }
    }
}

/// Exchange two numbers in the lanes where `when > 0`.
#[inline(always)]
fn exchange(when: V, a: &mut V, b: &mut V) {
    (*a, *b) = (when.if_positive(*b, *a), when.if_positive(*a, *b));
}

#[inline(always)]
fn maximum(a: V, b: V) -> V {
    // A NaN in `a` stays.
    (b - a).if_positive(b, a)
}

/// The power of two at or below a positive number, inverted; other numbers give zero,
/// infinity or NaN, which end in a flag.
#[inline(always)]
fn inverse_power_of_two(x: V) -> V {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    Lanes(from_fn(|l| f64::from_bits(x.0[l].to_bits() & EXPONENT))).recip()
}

/// `P D A = L U`: U above the diagonal, L below (its diagonal is one), the inverses of the
/// diagonal of U on it.
struct Factors<const N: usize> {
    lu: [[Pair; N]; N],
    /// Scale of the row that has come to each place.
    scale: [V; N],
    /// Which row has come to each place.
    row: [V; N],
    /// Above zero where the matrix is singular.
    singular: V,
}

impl<const N: usize> Factors<N> {
    #[inline(always)]
    fn new(mut a: [[Pair; N]; N]) -> Self {
        let mut scale = [V::zero(); N];
        for (row, scale) in a.iter_mut().zip(&mut scale) {
            let largest = row.iter().fold(V::zero(), |m, x| maximum(m, x.size()));
            *scale = inverse_power_of_two(largest);
            for x in row {
                *x = x.scaled(*scale);
            }
        }
        let threshold: [V; N] = from_fn(|j| {
            let largest = (0..N).fold(V::zero(), |m, i| maximum(m, a[i][j].size()));
            largest * (4.0 * N as f64 * f64::EPSILON)
        });
        let mut out = Self {
            lu: a,
            scale,
            row: from_fn(|i| V::constant(i as f64)),
            singular: V::zero(),
        };
        for k in 0..N {
            out.pivot(k);
            let above = out.lu[k][k].size() - threshold[k];
            out.singular = above.if_positive(out.singular, V::one());
            let inverse = out.lu[k][k].recip();
            out.lu[k][k] = inverse;
            for i in k + 1..N {
                let factor = out.lu[i][k].times(inverse);
                out.lu[i][k] = factor;
                for j in k + 1..N {
                    out.lu[i][j] = out.lu[i][j].minus_product(factor, out.lu[k][j]);
                }
            }
        }
        out
    }

    /// Bring the largest entry of column `k` from row `k` on to row `k`.
    #[inline(always)]
    fn pivot(&mut self, k: usize) {
        for i in k + 1..N {
            let larger = self.lu[i][k].size() - self.lu[k][k].size();
            let (above, below) = self.lu.split_at_mut(i);
            for (a, b) in above[k].iter_mut().zip(&mut below[0]) {
                exchange(larger, &mut a.re, &mut b.re);
                exchange(larger, &mut a.im, &mut b.im);
            }
            for list in [&mut self.scale, &mut self.row] {
                let (above, below) = list.split_at_mut(i);
                exchange(larger, &mut above[k], &mut below[0]);
            }
        }
    }

    /// `x` with `U x = b`, in place.
    #[inline(always)]
    fn back_substitute(&self, b: &mut [Pair; N]) {
        for i in (0..N).rev() {
            let mut x = b[i];
            for k in i + 1..N {
                x = x.minus_product(self.lu[i][k], b[k]);
            }
            b[i] = x.times(self.lu[i][i]);
        }
    }

    /// Column `j` of `U^-1 L^-1`, scaled: the column `row[j]` of the inverse.
    #[inline(always)]
    fn inverse_column(&self, j: usize) -> [Pair; N] {
        let mut x = [Pair::ZERO; N];
        x[j].re = V::one();
        for i in j + 1..N {
            for k in j..i {
                x[i] = x[i].minus_product(self.lu[i][k], x[k]);
            }
        }
        self.back_substitute(&mut x);
        x.map(|x| x.scaled(self.scale[j]))
    }

    fn row(&self, place: usize, lane: usize) -> usize {
        // Whole numbers below N, also where the entries are NaN.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let row = self.row[place].0[lane] as usize;
        row
    }
}

/// Entry `(i, j)` of up to four matrices; lanes beyond the last hold it again.
#[inline(always)]
fn gather(a: &[C], size: usize, entry: usize) -> Pair {
    let last = a.len() / size - 1;
    let at = |l: usize| a[l.min(last) * size + entry];
    Pair {
        re: Lanes(from_fn(|l| at(l).re)),
        im: Lanes(from_fn(|l| at(l).im)),
    }
}

fn invert_some<const N: usize>(a: &[C], out: &mut [C], singular: &mut [bool]) {
    let size = N * N;
    let groups = a.chunks(LANES * size).zip(out.chunks_mut(LANES * size));
    for ((a, out), singular) in groups.zip(singular.chunks_mut(LANES)) {
        let factors = Factors::<N>::new(from_fn(|i| from_fn(|j| gather(a, size, i * N + j))));
        let mut worst = factors.singular;
        for j in 0..N {
            let x = factors.inverse_column(j);
            // Zero times a number is zero, times anything else NaN, which is not positive.
            for x in &x {
                let finite = V::one() + (x.re + x.im) * 0.0;
                worst = finite.if_positive(worst, V::one());
            }
            for (l, out) in out.chunks_exact_mut(size).enumerate() {
                let column = factors.row(j, l);
                for (i, x) in x.iter().enumerate() {
                    out[i * N + column] = C::new(x.re.0[l], x.im.0[l]);
                }
            }
        }
        finish(worst, size, out, singular);
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
    let groups = u.chunks(LANES * size).zip(y.chunks(LANES * wide));
    let results = out.chunks_mut(LANES * wide).zip(singular.chunks_mut(LANES));
    for ((u, y), (out, singular)) in groups.zip(results) {
        // g u = y is u' g' = y'.
        let factors = Factors::<N>::new(from_fn(|i| from_fn(|j| gather(u, size, j * N + i))));
        let mut worst = factors.singular;
        let last = y.len() / wide - 1;
        for r in 0..rows {
            let mut x: [Pair; N] = from_fn(|i| {
                let at = |l: usize| y[l.min(last) * wide + r * N + factors.row(i, l)];
                let entry = Pair {
                    re: Lanes(from_fn(|l| at(l).re)),
                    im: Lanes(from_fn(|l| at(l).im)),
                };
                entry.scaled(factors.scale[i])
            });
            for i in 0..N {
                for k in 0..i {
                    x[i] = x[i].minus_product(factors.lu[i][k], x[k]);
                }
            }
            factors.back_substitute(&mut x);
            for (i, x) in x.iter().enumerate() {
                let finite = V::one() + (x.re + x.im) * 0.0;
                worst = finite.if_positive(worst, V::one());
                for (l, out) in out.chunks_exact_mut(wide).enumerate() {
                    out[r * N + i] = C::new(x.re.0[l], x.im.0[l]);
                }
            }
        }
        finish(worst, wide, out, singular);
    }
}

/// Flag the singular lanes and make their results NaN.
#[inline(always)]
fn finish(worst: V, size: usize, out: &mut [C], singular: &mut [bool]) {
    for (l, (out, singular)) in out.chunks_exact_mut(size).zip(singular).enumerate() {
        *singular = worst.0[l] > 0.0;
        if *singular {
            out.fill(NAN);
        }
    }
}
