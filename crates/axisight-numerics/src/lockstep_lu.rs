//! LU with partial pivoting of several matrices in lock-step, one per lane.
//!
//! Rows are scaled by powers of two, which causes no rounding. The substitutions are those of
//! LAPACK's `gesv`, so the residuals are the same too: column `j` of the inverse solves
//! `A x = e_j`. Rows are exchanged by selection, lane by lane.

use super::ahead::Ahead;
use super::pair::Pair;
use axisight_scalar::{MOST_LANES, Register};
use nalgebra::Complex;

type C = Complex<f64>;

/// `P D A = L U`, in one array: U above the diagonal, L below it, the inverses of U's diagonal on
/// it. The diagonal of L is one.
pub(super) struct Factors<R, const N: usize> {
    lu: [[Pair<R>; N]; N],
    /// Scale of the row at each place.
    scale: [R; N],
    /// Original index of the row at each place.
    row: [R; N],
    /// Above zero where the matrix is singular.
    singular: R,
    /// Zero times every result: zero if all results are finite, otherwise NaN.
    spoiled: R,
}

impl<R: Register, const N: usize> Factors<R, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let zero = R::splat(0.0);
        Self {
            lu: [[Pair::zero(); N]; N],
            scale: [zero; N],
            row: [zero; N],
            singular: zero,
            spoiled: zero,
        }
    }

    /// Inverses of `R::LANES` matrices; a lane of the result is above zero if its matrix is
    /// singular or not finite.
    #[inline(always)]
    pub(super) fn invert(&mut self, a: &[C], out: &mut [C], mut ahead: Ahead<'_>) -> R {
        for i in 0..N {
            for j in 0..N {
                self.lu[i][j] = Pair::split(&a[i * N + j..], N * N);
            }
        }
        // Each row prefetches its share of the next group of R::LANES N^2 / 4 cache lines.
        let lines = (R::LANES * N).div_ceil(12);
        self.factor(|| ahead.ask(lines));
        // All columns at a time, so that one load of L or U serves N products. Row i of the right
        // side is scale e_c, where c is the original index of the row at place i.
        let zero = R::splat(0.0);
        let mut x = [[Pair::zero(); N]; N];
        for i in 0..N {
            for j in 0..N {
                let off = self.row[i] - R::splat(j as f64);
                let here = off.fnma(off, R::splat(0.25));
                x[i][j].re = here.if_positive(self.scale[i], zero);
            }
        }
        for i in 0..N {
            ahead.ask(lines);
            let mut sums = x[i];
            for k in 0..i {
                let factor = self.lu[i][k];
                for j in 0..N {
                    sums[j] = sums[j].minus_product(factor, x[k][j]);
                }
            }
            x[i] = sums;
        }
        for i in (0..N).rev() {
            ahead.ask(lines);
            let mut sums = x[i];
            for k in i + 1..N {
                let factor = self.lu[i][k];
                for j in 0..N {
                    sums[j] = sums[j].minus_product(factor, x[k][j]);
                }
            }
            for j in 0..N {
                sums[j] = sums[j].times(self.lu[i][i]);
                self.check(sums[j]);
                sums[j].join(&mut out[i * N + j..], N * N);
            }
            x[i] = sums;
        }
        self.bad()
    }

    /// `Y U^-1` for `R::LANES` pairs with `rows` rows in each Y; the result flags lanes as `invert`
    /// does.
    #[inline(always)]
    pub(super) fn right_divide(&mut self, y: &[C], u: &[C], rows: usize, out: &mut [C]) -> R {
        // `g u = y` is the same system as `u' g' = y'`.
        for i in 0..N {
            for j in 0..N {
                self.lu[i][j] = Pair::split(&u[j * N + i..], N * N);
            }
        }
        self.factor(|| ());
        let mut places = [[0; MOST_LANES]; N];
        for (row, places) in self.row.iter().zip(&mut places) {
            let mut numbers = [0.0; MOST_LANES];
            row.store(&mut numbers);
            // The numbers are whole and below N, even if the entries are NaN.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            for (place, number) in places.iter_mut().zip(numbers) {
                *place = number as usize;
            }
        }
        let wide = rows * N;
        for r in 0..rows {
            let mut x = [Pair::zero(); N];
            for i in 0..N {
                let (mut re, mut im) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
                for l in 0..R::LANES {
                    let entry = y[l * wide + r * N + places[i][l]];
                    (re[l], im[l]) = (entry.re, entry.im);
                }
                let entry = Pair {
                    re: R::load(&re),
                    im: R::load(&im),
                };
                x[i] = entry.scaled(self.scale[i]);
                for k in 0..i {
                    x[i] = x[i].minus_product(self.lu[i][k], x[k]);
                }
            }
            for i in (0..N).rev() {
                for k in i + 1..N {
                    x[i] = x[i].minus_product(self.lu[i][k], x[k]);
                }
                x[i] = x[i].times(self.lu[i][i]);
                self.check(x[i]);
                x[i].join(&mut out[r * N + i..], wide);
            }
        }
        self.bad()
    }

    /// Factor the matrix in `lu`; `between` runs before each column.
    #[inline(always)]
    fn factor(&mut self, mut between: impl FnMut()) {
        let zero = R::splat(0.0);
        // Largest square of each column.
        let mut square_of = [zero; N];
        for i in 0..N {
            let mut largest = zero;
            for j in 0..N {
                let entry = self.lu[i][j];
                largest = entry.re.magnitude_or(entry.im.magnitude_or(largest));
            }
            let scale = largest.inverse_power_of_two();
            for j in 0..N {
                self.lu[i][j] = self.lu[i][j].scaled(scale);
                square_of[j] = self.lu[i][j].square().magnitude_or(square_of[j]);
            }
            (self.scale[i], self.row[i]) = (scale, R::splat(i as f64));
        }
        (self.singular, self.spoiled) = (zero, zero);
        let smallest = R::splat((4.0 * N as f64 * f64::EPSILON).powi(2));
        for k in 0..N {
            between();
            self.pivot(k);
            let above = square_of[k].fnma(smallest, self.lu[k][k].square());
            self.singular = above.if_positive(self.singular, R::splat(1.0));
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

    /// Move the largest entry of column `k`, from row `k` downwards, to row `k`.
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

    #[inline(always)]
    fn check(&mut self, x: Pair<R>) {
        let zero = R::splat(0.0);
        self.spoiled = x.re.fma(zero, x.im.fma(zero, self.spoiled));
    }

    #[inline(always)]
    fn bad(&self) -> R {
        // NaN is not positive.
        let finite = R::splat(1.0) + self.spoiled;
        finite.if_positive(self.singular, R::splat(1.0))
    }
}

/// Exchange two numbers in the lanes where `when > 0`.
#[inline(always)]
fn exchange<R: Register>(when: R, a: &mut R, b: &mut R) {
    (*a, *b) = (when.if_positive(*b, *a), when.if_positive(*a, *b));
}
