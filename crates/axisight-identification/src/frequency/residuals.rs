//! Residuals of one operating point, their weights and normal equations.

use crate::logs::Loss;
use axisight_numerics::descent::Normal;
use nalgebra::{Complex, DMatrix, DVector};

type C = Complex<f64>;

/// Residuals of one pose, `[element][real, imaginary][line]`, with weights by element and line.
pub(super) struct Residuals {
    pub(super) values: Vec<f64>,
    pub(super) weight: Vec<f64>,
    pub(super) loss: f64,
    pub(super) jacobian: Vec<Vec<f64>>,
}

impl Residuals {
    /// Multiply the elements of every line by the matrix of that line.
    pub(super) fn whiten(&mut self, matrices: &[DMatrix<C>]) {
        let lines = matrices.len();
        let turn = |values: &mut [f64]| {
            for (line, matrix) in matrices.iter().enumerate() {
                let n = matrix.nrows();
                let at = |e: usize| (e * 2 * lines + line, (e * 2 + 1) * lines + line);
                // From the last row upwards, no value is overwritten before its last use.
                for row in (0..n).rev() {
                    let term = |k: usize| {
                        let (re, im) = at(k);
                        matrix[(row, k)] * C::new(values[re], values[im])
                    };
                    let sum: C = (0..=row).map(term).sum();
                    let (re, im) = at(row);
                    (values[re], values[im]) = (sum.re, sum.im);
                }
            }
        };
        turn(&mut self.values);
        self.jacobian.iter_mut().for_each(|column| turn(column));
    }

    /// Compute the weights of a robust loss from the magnitudes of the complex residuals.
    pub(super) fn weigh(&mut self, loss: Loss, lines: usize) {
        if loss == Loss::Squared {
            self.loss = self.values.iter().map(|r| r * r).sum();
            return;
        }
        self.weight = vec![1.0; self.values.len()];
        let pairs = self
            .values
            .chunks(2 * lines)
            .zip(self.weight.chunks_mut(2 * lines));
        for (values, weight) in pairs {
            for line in 0..lines {
                let (value, w) = loss.evaluate(values[line].hypot(values[lines + line]));
                self.loss += value;
                (weight[line], weight[lines + line]) = (w, w);
            }
        }
        for column in &mut self.jacobian {
            column
                .iter_mut()
                .zip(&self.weight)
                .for_each(|(x, w)| *x *= w.sqrt());
        }
        self.values
            .iter_mut()
            .zip(&self.weight)
            .for_each(|(r, w)| *r *= w.sqrt());
    }

    pub(super) fn normal(self) -> Normal {
        let n = self.jacobian.len();
        let mut matrix = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let entry = dot(&self.jacobian[i], &self.jacobian[j]);
                matrix[(i, j)] = entry;
                matrix[(j, i)] = entry;
            }
        }
        let gradient = self.jacobian.iter().map(|column| dot(column, &self.values));
        Normal {
            loss: self.loss,
            gradient: DVector::from_iterator(n, gradient),
            matrix,
        }
    }

    /// `J^T V J`, with the variances `V` of the residuals due to the uncertainty of the response.
    pub(super) fn expected(&self, variance: &[f64], lines: usize) -> DMatrix<f64> {
        let n_elements = self.values.len() / (2 * lines).max(1);
        let by_place = |k: usize| {
            let (element, line) = (k / (2 * lines), k % lines);
            let robust = self.weight.get(k).copied().unwrap_or(1.0);
            variance[line * n_elements + element] * robust
        };
        let scale: Vec<f64> = (0..self.values.len()).map(by_place).collect();
        let weighed = |column: &Vec<f64>| column.iter().zip(&scale).map(|(x, v)| x * v).collect();
        let other: Vec<Vec<f64>> = self.jacobian.iter().map(weighed).collect();
        let n = self.jacobian.len();
        DMatrix::from_fn(n, n, |i, j| dot(&self.jacobian[i], &other[j]))
    }

    /// Sum of the squared gradients of blocks of `block` lines, with all elements together.
    pub(super) fn blocks(&self, lines: usize, block: usize) -> DMatrix<f64> {
        let n = self.jacobian.len();
        let mut sum = DMatrix::zeros(n, n);
        for first in (0..lines).step_by(block) {
            let last = (first + block).min(lines);
            let part = |column: &Vec<f64>| -> f64 {
                let rows = column.chunks(lines).zip(self.values.chunks(lines));
                rows.map(|(c, r)| dot(&c[first..last], &r[first..last]))
                    .sum()
            };
            let gradient = DVector::from_iterator(n, self.jacobian.iter().map(part));
            sum += &gradient * gradient.transpose();
        }
        sum
    }

    pub(super) fn complex(&self, lines: usize) -> Vec<C> {
        let n_elements = self.values.len() / (2 * lines).max(1);
        let at = |k: usize| {
            let (line, element) = (k / n_elements, k % n_elements);
            let place = element * 2 * lines + line;
            C::new(self.values[place], self.values[place + lines])
        };
        (0..lines * n_elements).map(at).collect()
    }
}

/// Inner product with eight partial sums, which becomes vector code and has smaller rounding
/// errors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (chunks_a, tail_a) = a.as_chunks::<8>();
    let (chunks_b, tail_b) = b.as_chunks::<8>();
    for (x, y) in chunks_a.iter().zip(chunks_b) {
        for i in 0..8 {
            sums[i] = x[i].mul_add(y[i], sums[i]);
        }
    }
    let tail: f64 = tail_a.iter().zip(tail_b).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + tail
}
