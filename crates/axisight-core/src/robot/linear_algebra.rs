//! Small symmetric solves over any scalar.

use crate::scalar::Scalar;

/// Solve `a x = b` in place for a symmetric positive definite `a` (row-major,
/// `n * n`, destroyed) by `L D L^T`; about `n^3 / 6` multiplications.
#[inline]
pub(super) fn solve_symmetric<S: Scalar>(a: &mut [S], b: &mut [S], n: usize) {
    for j in 0..n {
        let inverse = a[j * n + j].recip();
        for i in j + 1..n {
            // Row i of L is the scaled column below the pivot.
            let l = a[i * n + j] * inverse;
            for k in j + 1..=i {
                let update = a[k * n + j];
                a[i * n + k] = (-l).fma(update, a[i * n + k]);
            }
            b[i] = (-l).fma(b[j], b[i]);
        }
        a[j * n + j] = inverse;
    }
    // Column entries below the diagonal still hold l * d.
    for j in (0..n).rev() {
        let mut sum = b[j];
        for i in j + 1..n {
            sum = (-a[i * n + j]).fma(b[i], sum);
        }
        b[j] = sum * a[j * n + j];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_known_system() {
        // A = G G^T with a fixed G, x chosen, b = A x.
        let n = 4;
        let g = [
            1.0, 0.3, -0.2, 0.7, 0.0, 2.0, 0.4, -1.1, 0.5, 0.0, 1.5, 0.3, -0.6, 0.2, 0.0, 1.2,
        ];
        let mut a = vec![0.0_f64; n * n];
        for i in 0..n {
            for j in 0..n {
                a[i * n + j] = (0..n).map(|k| g[i * n + k] * g[j * n + k]).sum();
            }
        }
        let x = [1.0, -2.0, 0.5, 3.0];
        let mut b: Vec<f64> = (0..n)
            .map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum())
            .collect();
        solve_symmetric(&mut a, &mut b, n);
        for (got, want) in b.iter().zip(x) {
            assert!((got - want).abs() < 1e-12, "{got} {want}");
        }
    }
}
