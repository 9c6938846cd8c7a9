//! Small problems of least squares that count what is asked of them.

use axisight_numerics::descent::{
    Bounded, LeastSquares, Limits, Normal, Outcome, Reach, Rules, search,
};
use nalgebra::{DMatrix, DVector};

/// Residuals and the rows of their Jacobian; nothing where the model does not hold.
pub type Rows = Option<(Vec<f64>, Vec<Vec<f64>>)>;

pub struct Model<F> {
    rows: F,
    pub normal: Normal,
    pub trials: usize,
    pub rejected: usize,
    /// Trial at which another thread asks to stop.
    pub cancel_at: usize,
}

impl<F: Fn(&[f64]) -> Rows> Model<F> {
    pub fn new(rows: F, start: &[f64]) -> Self {
        let normal = normal(rows(start).expect("holds at the start"), start.len());
        Self {
            rows,
            normal,
            trials: 0,
            rejected: 0,
            cancel_at: usize::MAX,
        }
    }
}

pub fn normal((residual, rows): (Vec<f64>, Vec<Vec<f64>>), n: usize) -> Normal {
    let r = DVector::from_vec(residual);
    let jacobian = DMatrix::from_fn(r.len(), n, |i, j| rows[i][j]);
    Normal {
        loss: r.dot(&r),
        gradient: jacobian.transpose() * &r,
        matrix: jacobian.transpose() * &jacobian,
    }
}

impl<F: Fn(&[f64]) -> Rows> LeastSquares for Model<F> {
    type Trial = Normal;
    type Error = &'static str;

    fn normal(&self) -> &Normal {
        &self.normal
    }

    fn attempt(&mut self, theta: &[f64]) -> Result<Option<(f64, Normal)>, &'static str> {
        self.trials += 1;
        if self.trials == self.cancel_at {
            return Err("cancelled");
        }
        let found = (self.rows)(theta).map(|rows| normal(rows, theta.len()));
        Ok(found.map(|n| (n.loss, n)))
    }

    fn accept(&mut self, _: &[f64], trial: Normal) -> Result<(), &'static str> {
        self.normal = trial;
        Ok(())
    }

    fn reject(&mut self, _: Normal) {
        self.rejected += 1;
    }
}

pub fn wide(n: usize) -> Limits {
    Limits {
        lower: vec![f64::NEG_INFINITY; n],
        upper: vec![f64::INFINITY; n],
        scale: vec![1.0; n],
        reach: Reach::Bounds,
        logarithmic: vec![false; n],
    }
}

pub fn run<F: Fn(&[f64]) -> Rows>(
    model: &mut Model<F>,
    limits: &Limits,
    rules: &Rules,
    start: &[f64],
) -> (Outcome, Vec<f64>) {
    let mut descent = Bounded::new(model, limits, start.to_vec());
    let outcome = search(&mut descent, rules).expect("not cancelled");
    (outcome, descent.into_theta())
}
