//! Triangular factor of tall matrices that come in pieces.

/// Rows of a piece; a piece of 40 columns fits in the second-level cache.
pub(super) const PIECE: usize = 256;
/// Reflections applied together.
const PANEL: usize = 4;
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
    /// each, so nothing below its diagonal fills in. They are applied `PANEL` at a time, as
    /// `1 - V T^T V^T` (Schreiber and Van Loan 1989), so that every number fetched is used
    /// that often.
    pub(super) fn update(&mut self, piece: &mut [f64]) {
        let n = self.n;
        for first in (0..n).step_by(PANEL) {
            let width = PANEL.min(n - first);
            let (head, rest) = piece.split_at_mut((first + width) * PIECE);
            let panel = &mut head[first * PIECE..];
            let reflections = self.reflect_panel(first, width, panel);
            for (i, column) in rest.chunks_exact_mut(PIECE).enumerate() {
                let place = first + width + i;
                self.apply(&reflections, first, width, panel, column, place);
            }
        }
    }

    /// Reflect the columns of a panel one after the other.
    fn reflect_panel(&mut self, first: usize, width: usize, panel: &mut [f64]) -> Reflections {
        let n = self.n;
        let mut out = Reflections {
            leading: [0.0; PANEL],
            t: [[0.0; PANEL]; PANEL],
        };
        for j in 0..width {
            let (head, rest) = panel.split_at_mut((j + 1) * PIECE);
            let v = &head[j * PIECE..];
            let row = &mut self.factor[(first + j) * n..(first + j + 1) * n];
            let below = dot(v, v);
            if below == 0.0 {
                continue;
            }
            let pivot = row[first + j];
            let norm = pivot.mul_add(pivot, below).sqrt();
            // The sign that adds, so that nothing cancels.
            let signed = if pivot < 0.0 { -norm } else { norm };
            let leading = pivot + signed;
            let scale = 2.0 / leading.mul_add(leading, below);
            row[first + j] = -signed;
            for (i, column) in rest.chunks_exact_mut(PIECE).enumerate() {
                let place = first + j + 1 + i;
                let s = leading.mul_add(row[place], dot(v, column)) * scale;
                row[place] -= s * leading;
                subtract(v, s, column);
            }
            out.leading[j] = leading;
            out.t[j][j] = scale;
            let mut overlap = [0.0; PANEL];
            for (i, other) in head.chunks_exact(PIECE).enumerate().take(j) {
                overlap[i] = dot(other, v);
            }
            for i in 0..j {
                let sum: f64 = (i..j).map(|k| out.t[i][k] * overlap[k]).sum();
                out.t[i][j] = -scale * sum;
            }
        }
        out
    }

    /// Apply the reflections of a panel to one column.
    #[inline(always)]
    fn apply(
        &mut self,
        reflections: &Reflections,
        first: usize,
        width: usize,
        panel: &[f64],
        column: &mut [f64],
        place: usize,
    ) {
        let n = self.n;
        let mut sums = [0.0; PANEL];
        if width == PANEL {
            sums = dots(panel, column);
        } else {
            for (sum, v) in sums.iter_mut().zip(panel.chunks_exact(PIECE)) {
                *sum = dot(v, column);
            }
        }
        for (j, sum) in sums.iter_mut().enumerate().take(width) {
            *sum += reflections.leading[j] * self.factor[(first + j) * n + place];
        }
        let mut steps = [0.0; PANEL];
        for j in 0..width {
            steps[j] = (0..=j).map(|i| reflections.t[i][j] * sums[i]).sum();
            self.factor[(first + j) * n + place] -= steps[j] * reflections.leading[j];
        }
        if width == PANEL {
            subtract_all(panel, steps, column);
        } else {
            for (step, v) in steps.iter().zip(panel.chunks_exact(PIECE)) {
                subtract(v, *step, column);
            }
        }
    }
}

/// Reflections of a panel: their entries in the triangle and the matrix that joins them.
struct Reflections {
    leading: [f64; PANEL],
    t: [[f64; PANEL]; PANEL],
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

/// The panel's columns, one by one.
#[inline(always)]
fn split(panel: &[f64]) -> [&[f64]; PANEL] {
    std::array::from_fn(|j| &panel[j * PIECE..(j + 1) * PIECE])
}

#[inline(always)]
fn dots(panel: &[f64], column: &[f64]) -> [f64; PANEL] {
    let v = split(panel);
    let mut sums = [[0.0; WIDE]; PANEL];
    for (k, x) in column.chunks_exact(WIDE).enumerate() {
        for j in 0..PANEL {
            let v = &v[j][k * WIDE..(k + 1) * WIDE];
            for i in 0..WIDE {
                sums[j][i] = x[i].mul_add(v[i], sums[j][i]);
            }
        }
    }
    sums.map(|sum| sum.iter().sum())
}

#[inline(always)]
fn subtract(v: &[f64], s: f64, a: &mut [f64]) {
    for (x, a) in v.iter().zip(a) {
        *a = (-s).mul_add(*x, *a);
    }
}

#[inline(always)]
fn subtract_all(panel: &[f64], steps: [f64; PANEL], column: &mut [f64]) {
    let v = split(panel);
    for (k, x) in column.chunks_exact_mut(WIDE).enumerate() {
        for j in 0..PANEL {
            let v = &v[j][k * WIDE..(k + 1) * WIDE];
            for i in 0..WIDE {
                x[i] = (-steps[j]).mul_add(v[i], x[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_equations_are_those_of_the_rows() {
        // R^T R = A^T A for rows that come in two pieces, the second with a zero column.
        let n = 7;
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
