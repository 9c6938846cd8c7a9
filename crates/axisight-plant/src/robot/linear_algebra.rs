//! Small symmetric solves over any scalar.

use axisight_scalar::Scalar;

/// `L D L^T` of the first `n` rows of a symmetric positive definite `a`, in its upper triangle.
///
/// The diagonal becomes `1 / d`, and the entries right of it hold `d l`. It takes about `n^3 / 6`
/// multiplications.
#[inline(always)]
pub(super) fn factorize<S: Scalar, const N: usize>(a: &mut [[S; N]; N], n: usize) {
    for j in 0..n {
        let (done, below) = a.split_at_mut(j + 1);
        let Some(pivot_row) = done.last_mut() else {
            return;
        };
        let inverse = pivot_row[j].recip();
        for (i, row) in (j + 1..n).zip(below) {
            let l = -(pivot_row[i] * inverse);
            for k in i..n {
                row[k] = l.fma(pivot_row[k], row[k]);
            }
        }
        pivot_row[j] = inverse;
    }
}

/// Solve with the matrix that [`factorize`] returned.
///
/// The solve works on a copy of `b`, which stays in registers. In memory, overlapping vectors would
/// wait for each other, which costs a third of the time.
#[inline(always)]
pub(super) fn solve_factorized<S: Scalar, const N: usize>(
    a: &[[S; N]; N],
    b: &mut [S; N],
    n: usize,
) {
    let mut x = *b;
    for j in 0..n {
        let scaled = -(x[j] * a[j][j]);
        for i in j + 1..n {
            x[i] = a[j][i].fma(scaled, x[i]);
        }
    }
    for j in (0..n).rev() {
        let mut sum = x[j];
        for i in j + 1..n {
            sum = (-a[j][i]).fma(x[i], sum);
        }
        x[j] = sum * a[j][j];
    }
    *b = x;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_known_system() {
        // A = G G^T with a fixed G, a chosen x, and b = A x.
        let g = [
            1.0, 0.3, -0.2, 0.7, 0.0, 2.0, 0.4, -1.1, 0.5, 0.0, 1.5, 0.3, -0.6, 0.2, 0.0, 1.2,
        ];
        let mut a = [[0.0_f64; 4]; 4];
        for i in 0..4 {
            for j in 0..4 {
                a[i][j] = (0..4).map(|k| g[i * 4 + k] * g[j * 4 + k]).sum();
            }
        }
        let x = [1.0, -2.0, 0.5, 3.0];
        let mut b: [f64; 4] = std::array::from_fn(|i| (0..4).map(|j| a[i][j] * x[j]).sum());
        factorize(&mut a, 4);
        solve_factorized(&a, &mut b, 4);
        for (got, want) in b.iter().zip(x) {
            assert!((got - want).abs() < 1e-12, "{got} {want}");
        }
    }
}
