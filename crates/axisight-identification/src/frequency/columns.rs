//! Responses and their derivatives, by element over the lines.

use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// The response (column 0) and its derivatives over the lines.
///
/// Only upper elements are stored, because a robot of passive joints has a symmetric response.
pub struct Columns {
    pub(super) n_axes: usize,
    pub(super) n_lines: usize,
    /// Column `p n_elements + element`: the real parts of all lines, then the imaginary parts.
    pub(super) data: DMatrix<f64>,
}

impl Columns {
    pub(super) fn zeros(n_axes: usize, n_lines: usize, n_derivatives: usize) -> Self {
        let columns = (n_derivatives + 1) * n_axes * (n_axes + 1) / 2;
        Self {
            n_axes,
            n_lines,
            data: DMatrix::zeros(2 * n_lines, columns),
        }
    }

    pub(super) fn set(&mut self, line: usize, p: usize, value: &DMatrix<C>) {
        for a in 0..self.n_axes {
            for b in a..self.n_axes {
                let column = self.column(p, a, b);
                self.data[(line, column)] = value[(a, b)].re;
                self.data[(self.n_lines + line, column)] = value[(a, b)].im;
            }
        }
    }

    fn column(&self, p: usize, a: usize, b: usize) -> usize {
        let (a, b) = (a.min(b), a.max(b));
        let m = self.n_axes;
        p * (m * (m + 1) / 2) + a * m - a * (a + 1) / 2 + b
    }

    /// Real and imaginary parts over the lines, for the response (`p = 0`) or for its derivative
    /// with respect to parameter `p - 1`.
    pub fn parts(&self, p: usize, output: usize, input: usize) -> (&[f64], &[f64]) {
        let start = self.column(p, output, input) * 2 * self.n_lines;
        self.data.as_slice()[start..start + 2 * self.n_lines].split_at(self.n_lines)
    }
}
