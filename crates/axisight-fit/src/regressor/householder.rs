//! Triangular factor of tall matrices that arrive in pieces.

use super::evaluate::LANES;

/// Number of rows of a piece. A piece of 40 columns fits in the second-level cache.
pub(super) const PIECE: usize = 256;
/// Number of reflections that are applied together.
const PANEL: usize = 4;

/// One column of a piece, in groups of lanes, so that no length needs a check.
pub(super) type Column = [[f64; LANES]; PIECE / LANES];
/// A column of zeros.
pub(super) const EMPTY: Column = [[0.0; LANES]; PIECE / LANES];

/// Triangular factor R of all rows so far.
#[derive(Debug, Clone)]
pub(super) struct Triangle {
    n: usize,
    /// Row-major; zero below the diagonal.
    pub(super) factor: Vec<f64>,
}

impl Triangle {
    pub(super) fn new(n: usize) -> Self {
        Self {
            n,
            factor: vec![0.0; n * n],
        }
    }

    /// Add a piece of `n` columns to the factor, and overwrite the piece. Rows of zeros have no
    /// effect.
    ///
    /// A Householder reflection of the triangle over a full block changes one row of the triangle,
    /// so nothing below its diagonal fills in. `PANEL` reflections are applied at a time, as
    /// `1 - V T^T V^T` (Schreiber and Van Loan 1989), so that every number is used that often once
    /// it is loaded.
    pub(super) fn update(&mut self, piece: &mut [Column]) {
        let mut first = 0;
        let mut rest = piece;
        while rest.len() >= PANEL {
            let all = std::mem::take(&mut rest);
            let Some((panel, columns)) = all.split_first_chunk_mut::<PANEL>() else {
                return;
            };
            let reflections = self.reflect_panel(first, panel);
            for (i, column) in columns.iter_mut().enumerate() {
                self.apply(&reflections, first, panel, column, first + PANEL + i);
            }
            first += PANEL;
            rest = columns;
        }
        self.reflect_panel(first, rest);
    }

    /// Reflect the columns of a panel, one after the other.
    fn reflect_panel(&mut self, first: usize, panel: &mut [Column]) -> Reflections {
        let n = self.n;
        let mut out = Reflections {
            leading: [0.0; PANEL],
            t: [[0.0; PANEL]; PANEL],
        };
        for j in 0..panel.len() {
            let (head, rest) = panel.split_at_mut(j + 1);
            let (v, before) = (&head[j], &head[..j]);
            let row = &mut self.factor[(first + j) * n..(first + j + 1) * n];
            let below = dot(v, v);
            // A piece with fewer rows than columns leaves only rounding errors here. Their square
            // is too small for a division.
            if below < NOTHING {
                continue;
            }
            let pivot = row[first + j];
            let norm = pivot.mul_add(pivot, below).sqrt();
            // With this sign, nothing cancels.
            let signed = if pivot < 0.0 { -norm } else { norm };
            let leading = pivot + signed;
            let scale = 2.0 / leading.mul_add(leading, below);
            row[first + j] = -signed;
            for (i, column) in rest.iter_mut().enumerate() {
                let place = first + j + 1 + i;
                let s = leading.mul_add(row[place], dot(v, column)) * scale;
                row[place] -= s * leading;
                subtract(v, s, column);
            }
            out.leading[j] = leading;
            out.t[j][j] = scale;
            let mut overlap = [0.0; PANEL];
            for (overlap, other) in overlap.iter_mut().zip(before) {
                *overlap = dot(other, v);
            }
            for i in 0..j {
                let sum: f64 = (i..j).map(|k| out.t[i][k] * overlap[k]).sum();
                out.t[i][j] = -scale * sum;
            }
        }
        out
    }

    /// Apply the reflections of a panel to the column at `place`.
    #[inline(always)]
    fn apply(
        &mut self,
        reflections: &Reflections,
        first: usize,
        panel: &[Column; PANEL],
        column: &mut Column,
        place: usize,
    ) {
        let n = self.n;
        let mut sums = dots(panel, column);
        for (j, sum) in sums.iter_mut().enumerate() {
            *sum += reflections.leading[j] * self.factor[(first + j) * n + place];
        }
        let mut steps = [0.0; PANEL];
        for j in 0..PANEL {
            steps[j] = (0..=j).map(|i| reflections.t[i][j] * sums[i]).sum();
            self.factor[(first + j) * n + place] -= steps[j] * reflections.leading[j];
        }
        subtract_all(panel, steps, column);
    }
}

/// Sum of squares below which a column is zero.
const NOTHING: f64 = 1e-280;

/// Reflections of a panel: their entries in the triangle, and the matrix that combines them.
struct Reflections {
    leading: [f64; PANEL],
    t: [[f64; PANEL]; PANEL],
}

#[inline(always)]
fn dot(a: &Column, b: &Column) -> f64 {
    // Two sums, because a multiply-add takes four cycles and two start in each cycle.
    let mut sums = [[0.0; LANES]; 2];
    for (x, y) in a.chunks_exact(2).zip(b.chunks_exact(2)) {
        for half in 0..2 {
            for i in 0..LANES {
                sums[half][i] = x[half][i].mul_add(y[half][i], sums[half][i]);
            }
        }
    }
    sums.as_flattened().iter().sum()
}

#[inline(always)]
fn dots(panel: &[Column; PANEL], column: &Column) -> [f64; PANEL] {
    let mut sums = [[0.0; LANES]; PANEL];
    for (k, x) in column.iter().enumerate() {
        for j in 0..PANEL {
            for i in 0..LANES {
                sums[j][i] = x[i].mul_add(panel[j][k][i], sums[j][i]);
            }
        }
    }
    sums.map(|sum| sum.iter().sum())
}

#[inline(always)]
fn subtract(v: &Column, s: f64, column: &mut Column) {
    for (x, v) in column.iter_mut().zip(v) {
        for i in 0..LANES {
            x[i] = (-s).mul_add(v[i], x[i]);
        }
    }
}

#[inline(always)]
fn subtract_all(panel: &[Column; PANEL], steps: [f64; PANEL], column: &mut Column) {
    for (k, x) in column.iter_mut().enumerate() {
        for j in 0..PANEL {
            for i in 0..LANES {
                x[i] = (-steps[j]).mul_add(panel[j][k][i], x[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::array::from_fn;

    #[test]
    fn normal_equations_are_those_of_the_rows() {
        // R^T R = A^T A for rows that arrive in two pieces, the second with a zero column.
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
            let column = |j: usize| from_fn(|k| from_fn(|i| value(k * LANES + i, j)));
            let mut block: Vec<Column> = (0..n).map(column).collect();
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
