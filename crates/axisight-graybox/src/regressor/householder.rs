//! Triangular factor of tall matrices that come in pieces.

/// Rows of a piece; a piece of 40 columns fits in the second-level cache.
pub(super) const PIECE: usize = 256;
const WIDE: usize = 8;

/// The triangular factor R of rows seen so far.
#[derive(Debug, Clone)]
pub(super) struct Triangle {
    n: usize,
    /// Row-major; below the diagonal zero.
    pub(super) factor: Vec<f64>,
}

impl Triangle {
    pub(super) fn new(n: usize) -> Self {
        Self {
            n,
            factor: vec![0.0; n * n],
        }
    }

    /// Take in a piece: `n` columns of `PIECE` rows each, zero rows are nothing. Destroys it.
    ///
    /// Householder reflections on a triangle over a full block touch one row of the triangle
    /// each, so nothing below its diagonal fills in.
    pub(super) fn update(&mut self, piece: &mut [f64]) {
        let n = self.n;
        for j in 0..n {
            let (head, rest) = piece.split_at_mut((j + 1) * PIECE);
            let v = &head[j * PIECE..];
            let row = &mut self.factor[j * n..(j + 1) * n];
            let below = dot(v, v);
            if below == 0.0 {
                continue;
            }
            let pivot = row[j];
            let norm = pivot.mul_add(pivot, below).sqrt();
            // The sign that adds, so that nothing cancels.
            let leading = if pivot < 0.0 {
                pivot - norm
            } else {
                pivot + norm
            };
            let scale = 2.0 / leading.mul_add(leading, below);
            row[j] = if pivot < 0.0 { norm } else { -norm };
            let mut columns = rest.chunks_exact_mut(2 * PIECE);
            let mut l = j + 1;
            for pair in &mut columns {
                let (a, b) = pair.split_at_mut(PIECE);
                let sums = dot_two(v, a, b);
                let s = leading.mul_add(row[l], sums.0) * scale;
                let t = leading.mul_add(row[l + 1], sums.1) * scale;
                row[l] -= s * leading;
                row[l + 1] -= t * leading;
                subtract(v, s, a);
                subtract(v, t, b);
                l += 2;
            }
            let a = columns.into_remainder();
            if !a.is_empty() {
                let s = leading.mul_add(row[l], dot(v, a)) * scale;
                row[l] -= s * leading;
                subtract(v, s, a);
            }
        }
    }
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 2 * WIDE];
    for (x, y) in a.chunks_exact(2 * WIDE).zip(b.chunks_exact(2 * WIDE)) {
        for i in 0..2 * WIDE {
            sums[i] = x[i].mul_add(y[i], sums[i]);
        }
    }
    sums.iter().sum()
}

#[inline(always)]
fn dot_two(v: &[f64], a: &[f64], b: &[f64]) -> (f64, f64) {
    let (mut s, mut t) = ([0.0; WIDE], [0.0; WIDE]);
    let pairs = a.chunks_exact(WIDE).zip(b.chunks_exact(WIDE));
    for (x, (y, z)) in v.chunks_exact(WIDE).zip(pairs) {
        for i in 0..WIDE {
            s[i] = x[i].mul_add(y[i], s[i]);
            t[i] = x[i].mul_add(z[i], t[i]);
        }
    }
    (s.iter().sum(), t.iter().sum())
}

#[inline(always)]
fn subtract(v: &[f64], s: f64, a: &mut [f64]) {
    for (x, a) in v.iter().zip(a) {
        *a = (-s).mul_add(*x, *a);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_equations_are_those_of_the_rows() {
        // R^T R = A^T A for rows that come in two pieces, the second with a zero column.
        let n = 5;
        let entry = |i: usize, j: usize| ((i * 7 + j * 13) as f64 * 0.37).sin() + 0.1 * j as f64;
        let mut triangle = Triangle::new(n);
        let mut gram = vec![0.0; n * n];
        for piece in 0..2 {
            let value = |i: usize, j: usize| {
                if piece == 1 && j == 2 {
                    0.0
                } else {
                    entry(piece * PIECE + i, j)
                }
            };
            let mut block: Vec<f64> = (0..n * PIECE)
                .map(|k| value(k % PIECE, k / PIECE))
                .collect();
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += (0..PIECE).map(|k| value(k, i) * value(k, j)).sum::<f64>();
                }
            }
            triangle.update(&mut block);
        }
        for i in 0..n {
            for j in 0..n {
                let got: f64 = (0..n)
                    .map(|k| triangle.factor[k * n + i] * triangle.factor[k * n + j])
                    .sum();
                assert!((got - gram[i * n + j]).abs() < 1e-11, "{i} {j}");
                assert!(i <= j || triangle.factor[i * n + j] == 0.0);
            }
        }
    }
}
