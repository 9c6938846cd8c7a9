//! Inverses of 3x3 matrices by cofactors, where these are as accurate as elimination.
//!
//! The rounding error of a cofactor is about `eps |A|^2`. Let `R = |A|^2 / |adj A|`, which is
//! within a small factor of the ratio of the first two singular values. The residual `|A X - 1|` is
//! then a few `eps R |A| |X|`, and the rounding of the determinant adds no more. A small `R`
//! therefore gives residuals as small as those of elimination with pivoting, whatever the condition
//! number.

use super::pair::Pair;
use axisight_scalar::{MOST_LANES, Register};
use nalgebra::Complex;

type C = Complex<f64>;

/// Largest accepted `|A|^2 / |adj A|` in Frobenius norms. The ratio is at least 1.7.
const LARGEST_RATIO: f64 = 6.0;

/// Smallest accepted `|det A| / (|A| |adj A|)`, far above the value of a singular matrix.
const SMALLEST_DETERMINANT: f64 = 1e-12;

/// Range of squared norms in which no product overflows or vanishes.
const SQUARES: (f64, f64) = (1e-80, 1e80);

/// Inverses of `R::LANES` matrices; a lane of the result is above zero if its inverse is accurate.
#[inline(always)]
pub(super) fn invert<R: Register>(a: &[C], out: &mut [C]) -> R {
    let zero = R::splat(0.0);
    let mut m = [[Pair::<R>::zero(); 3]; 3];
    let mut size = zero;
    for i in 0..3 {
        for j in 0..3 {
            m[i][j] = Pair::split(&a[3 * i + j..], 9);
            size = m[i][j].add_square(size);
        }
    }
    let mut adjugate = [[Pair::<R>::zero(); 3]; 3];
    let mut cofactors = zero;
    for i in 0..3 {
        let (below, last) = ((i + 1) % 3, (i + 2) % 3);
        for j in 0..3 {
            let (right, end) = ((j + 1) % 3, (j + 2) % 3);
            let product = m[below][right].times(m[last][end]);
            adjugate[j][i] = product.minus_product(m[below][end], m[last][right]);
            cofactors = adjugate[j][i].add_square(cofactors);
        }
    }
    let mut determinant = m[0][0].times(adjugate[0][0]);
    determinant = determinant.plus_product(m[0][1], adjugate[1][0]);
    determinant = determinant.plus_product(m[0][2], adjugate[2][0]);
    let inverse = determinant.recip();
    for i in 0..3 {
        for j in 0..3 {
            adjugate[i][j].times(inverse).join(&mut out[3 * i + j..], 9);
        }
    }
    let ratio = cofactors * R::splat(LARGEST_RATIO.powi(2)) - size * size;
    let smallest = size * cofactors * R::splat(SMALLEST_DETERMINANT.powi(2));
    let regular = determinant.square() - smallest;
    let large = size - R::splat(SQUARES.0);
    let small = R::splat(SQUARES.1) - size;
    let good = large.if_positive(small, zero);
    ratio.if_positive(regular.if_positive(good, zero), zero)
}

/// Append the places of the inaccurate inverses to `later`, counted from `first`.
#[inline(always)]
pub(super) fn leave<R: Register>(good: R, first: usize, later: &mut Vec<usize>) {
    let mut lanes = [0.0; MOST_LANES];
    good.store(&mut lanes);
    let lanes = &lanes[..R::LANES];
    if lanes.iter().any(|good| *good <= 0.0) {
        let places = lanes.iter().enumerate().filter(|(_, good)| **good <= 0.0);
        later.extend(places.map(|(l, _)| first + l));
    }
}
