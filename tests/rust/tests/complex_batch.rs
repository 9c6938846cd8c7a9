//! Batched complex inversion and division: residuals, singular matrices, every size.

use axisight_numerics::{Threads, invert_batch, right_divide_batch};
use nalgebra::{Complex, DMatrix};
use rand::{Rng, SeedableRng, rngs::StdRng};

type C = Complex<f64>;

fn random(rng: &mut StdRng, n: usize) -> Vec<C> {
    (0..n)
        .map(|_| C::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)))
        .collect()
}

/// Matrices with condition number about `10^decades`, by scaling the singular values.
fn conditioned(rng: &mut StdRng, n: usize, count: usize, decades: f64) -> Vec<C> {
    let share = |i: usize| i as f64 / (n - 1).max(1) as f64;
    let values: Vec<f64> = (0..n).map(|i| 10f64.powf(-decades * share(i))).collect();
    with_singular_values(rng, &values, count)
}

fn with_singular_values(rng: &mut StdRng, values: &[f64], count: usize) -> Vec<C> {
    let (n, mut out) = (values.len(), Vec::new());
    for _ in 0..count {
        let q = |rng: &mut StdRng| DMatrix::from_row_slice(n, n, &random(rng, n * n)).qr().q();
        let (left, right) = (q(rng), q(rng));
        let s = DMatrix::from_fn(n, n, |i, j| {
            if i == j {
                C::new(values[i], 0.0)
            } else {
                C::default()
            }
        });
        out.extend((left * s * right).transpose().iter());
    }
    out
}

/// Largest of `|A X - 1| / (eps n |A| |X|)` in the Frobenius norm.
fn worst_residual(a: &[C], x: &[C], n: usize) -> f64 {
    let matrices = a.chunks_exact(n * n).zip(x.chunks_exact(n * n));
    let residuals = matrices.map(|(a, x)| {
        let (a, x) = (
            DMatrix::from_row_slice(n, n, a),
            DMatrix::from_row_slice(n, n, x),
        );
        let residual = (&a * &x - DMatrix::identity(n, n)).norm();
        residual / (f64::EPSILON * n as f64 * a.norm() * x.norm())
    });
    residuals.fold(0.0, f64::max)
}

#[test]
fn residuals_are_backward_stable_at_any_condition() {
    let mut rng = StdRng::seed_from_u64(1);
    for n in 1..=9 {
        for decades in [0.0, 4.0, 8.0, 11.0] {
            let a = conditioned(&mut rng, n, 203, decades);
            let mut x = vec![C::default(); a.len()];
            let singular = invert_batch(&a, n, 203, &mut x, Threads::Pool).unwrap();
            assert!(
                singular.iter().all(|s| !s),
                "size {n}, condition 1e{decades}"
            );
            // Gaussian elimination with partial pivoting is good for a few units of this.
            let worst = worst_residual(&a, &x, n);
            assert!(worst < 3.0, "size {n}, condition 1e{decades}: {worst}");
        }
    }
}

/// 3x3 inverses change from cofactors to elimination as the first two singular values part.
#[test]
fn residuals_do_not_depend_on_how_a_matrix_is_inverted() {
    let mut rng = StdRng::seed_from_u64(5);
    for ratio in [1.0, 2.0, 4.0, 5.0, 7.0, 20.0, 1e5] {
        for smallest in [1e-6, 1e-10] {
            let values = [1.0, 1.0 / ratio, smallest];
            let a = with_singular_values(&mut rng, &values, 2000);
            let mut x = vec![C::default(); a.len()];
            let singular = invert_batch(&a, 3, 2000, &mut x, Threads::This).unwrap();
            assert!(singular.iter().all(|s| !s));
            let worst = worst_residual(&a, &x, 3);
            assert!(worst < 1.0, "ratio {ratio}, smallest {smallest}: {worst}");
        }
    }
}

#[test]
fn division_is_multiplication_by_the_inverse() {
    let mut rng = StdRng::seed_from_u64(2);
    for n in 1..=9 {
        for rows in [1, 3] {
            let count = 11;
            let (u, g) = (
                random(&mut rng, count * n * n),
                random(&mut rng, count * rows * n),
            );
            let mut y = Vec::new();
            for l in 0..count {
                let u = DMatrix::from_row_slice(n, n, &u[l * n * n..(l + 1) * n * n]);
                let g = DMatrix::from_row_slice(rows, n, &g[l * rows * n..(l + 1) * rows * n]);
                y.extend((g * u).transpose().iter());
            }
            let mut out = vec![C::default(); y.len()];
            let singular =
                right_divide_batch(&y, &u, (rows, n), count, &mut out, Threads::Pool).unwrap();
            assert!(singular.iter().all(|s| !s));
            for (a, b) in out.iter().zip(&g) {
                // Random matrices of this size have condition numbers up to some thousand.
                assert!((a - b).norm() < 1e-11, "size {n}: {a} and {b}");
            }
        }
    }
}

#[test]
fn singular_and_broken_matrices_are_flagged_where_they_stand() {
    let mut rng = StdRng::seed_from_u64(3);
    for n in 1..=9 {
        let count = 9;
        let mut a = random(&mut rng, count * n * n);
        let size = n * n;
        a[size..2 * size].fill(C::default());
        a[3 * size] = C::new(f64::NAN, 0.0);
        a[4 * size + n - 1] = C::new(0.0, f64::INFINITY);
        // The last row repeats the first but for rounding.
        for j in 0..n {
            let first = a[6 * size + j];
            a[6 * size + (n - 1) * n + j] = if n == 1 {
                C::default()
            } else {
                first * C::new(0.3, 0.7)
            };
        }
        let mut x = vec![C::default(); a.len()];
        let singular = invert_batch(&a, n, count, &mut x, Threads::Pool).unwrap();
        let y = random(&mut rng, count * 2 * n);
        let mut g = vec![C::default(); y.len()];
        let other = right_divide_batch(&y, &a, (2, n), count, &mut g, Threads::Pool).unwrap();
        assert_eq!(singular, other);
        for l in 0..count {
            let expected = [1, 3, 4, 6].contains(&l);
            assert_eq!(singular[l], expected, "size {n}, matrix {l}");
            let nan = x[l * size..(l + 1) * size].iter().all(|c| c.re.is_nan());
            let finite = x[l * size..(l + 1) * size].iter().all(|c| c.re.is_finite());
            assert!(if expected { nan } else { finite });
        }
    }
}

#[test]
fn units_of_rows_and_columns_do_not_matter() {
    let mut rng = StdRng::seed_from_u64(4);
    let n = 3;
    let a = random(&mut rng, n * n);
    let mut x = vec![C::default(); n * n];
    invert_batch(&a, n, 1, &mut x, Threads::Pool).unwrap();
    let (rows, columns) = ([1e-140, 1.0, 1e90], [1e-30, 1e40, 1.0]);
    let scaled: Vec<C> = (0..n * n)
        .map(|i| a[i] * rows[i / n] * columns[i % n])
        .collect();
    let mut back = vec![C::default(); n * n];
    assert_eq!(
        invert_batch(&scaled, n, 1, &mut back, Threads::Pool),
        Ok(vec![false])
    );
    for i in 0..n * n {
        let unscaled = back[i] * columns[i / n] * rows[i % n];
        assert!((unscaled - x[i]).norm() < 1e-12 * x[i].norm().max(1.0));
    }
}

#[test]
fn wrong_lengths_are_named() {
    let a = vec![C::default(); 8];
    let error = invert_batch(&a, 3, 1, &mut [C::default(); 9], Threads::Pool).unwrap_err();
    assert_eq!((error.field, error.expected, error.got), ("matrices", 9, 8));
}
