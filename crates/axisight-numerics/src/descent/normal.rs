//! The normal equations of a least-squares problem.

use nalgebra::{DMatrix, DVector};

/// Loss, half its gradient, and the Gauss-Newton matrix, over the free parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// `r^T W r`, or the value of a robust loss in its place.
    pub loss: f64,
    /// `J^T W r`.
    pub gradient: DVector<f64>,
    /// `J^T W J`.
    pub matrix: DMatrix<f64>,
}

impl Normal {
    /// The equations of `n` parameters without any residual.
    pub fn zero(n: usize) -> Self {
        Self {
            loss: 0.0,
            gradient: DVector::zeros(n),
            matrix: DMatrix::zeros(n, n),
        }
    }

    /// Add the residuals of other data.
    pub fn add(&mut self, other: &Self) {
        self.loss += other.loss;
        self.gradient += &other.gradient;
        self.matrix += &other.matrix;
    }

    /// Add prior knowledge of parameter `slot`: its `deviation` from the mean, and the standard
    /// deviation `std`.
    pub fn add_prior(&mut self, slot: usize, deviation: f64, std: f64) {
        let weight = 1.0 / (std * std);
        self.loss += deviation * deviation * weight;
        self.gradient[slot] += deviation * weight;
        self.matrix[(slot, slot)] += weight;
    }

    /// Reduction of the loss that the linear model predicts for `step`.
    pub fn promise(&self, step: &[f64]) -> f64 {
        let mut total = 0.0;
        for (i, s) in step.iter().enumerate() {
            let column = self.matrix.column(i);
            let curved: f64 = column.iter().zip(step).map(|(a, s)| a * s).sum();
            total -= s * (2.0 * self.gradient[i] + curved);
        }
        total
    }
}
