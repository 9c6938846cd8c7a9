//! Normal equations.

use nalgebra::{DMatrix, DVector};

/// Loss, half its gradient, and the Gauss-Newton matrix, over the free parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// `r^T W r`, or what a robust loss makes of it.
    pub loss: f64,
    /// `J^T W r`.
    pub gradient: DVector<f64>,
    /// `J^T W J`.
    pub matrix: DMatrix<f64>,
}

impl Normal {
    /// Of `n` parameters and no residual.
    pub fn zero(n: usize) -> Self {
        Self {
            loss: 0.0,
            gradient: DVector::zeros(n),
            matrix: DMatrix::zeros(n, n),
        }
    }

    /// Residuals of other data.
    pub fn add(&mut self, other: &Self) {
        self.loss += other.loss;
        self.gradient += &other.gradient;
        self.matrix += &other.matrix;
    }

    /// What is known of parameter `slot` beforehand: it is `deviation` off its mean, `std` its
    /// standard deviation.
    pub fn add_prior(&mut self, slot: usize, deviation: f64, std: f64) {
        let weight = 1.0 / (std * std);
        self.loss += deviation * deviation * weight;
        self.gradient[slot] += deviation * weight;
        self.matrix[(slot, slot)] += weight;
    }

    /// By how much the linear model lowers the loss.
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
