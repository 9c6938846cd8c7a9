//! Levenberg-Marquardt with bounds, priors, robust loss and lazy nuisance columns.
//!
//! Moré (1978), *The Levenberg-Marquardt algorithm: implementation and theory*,
//! with the projection of Kanzow, Yamashita, Fukushima (2004) on the bounds.
//! A trial point costs a plain simulation; only an accepted one gets its derivatives.

use super::gram::BlockGram;
use super::loss::Loss;
use super::problem::{FitParameter, Problem, ProblemError};
use nalgebra::{DMatrix, DVector};

/// Settings of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Largest number of accepted steps.
    pub max_iterations: usize,
    /// Stop when the loss falls by less than this share.
    pub loss_tolerance: f64,
    /// Stop when no parameter moves by more than this share of its scale.
    pub step_tolerance: f64,
    /// Loss of whitened residuals.
    pub loss: Loss,
    /// How often nuisance columns are computed anew after the search has settled.
    pub nuisance_refreshes: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            max_iterations: 50,
            loss_tolerance: 1e-10,
            step_tolerance: 1e-8,
            loss: Loss::Squared,
            nuisance_refreshes: 2,
        }
    }
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitStatus {
    /// The loss no longer falls.
    LossConverged,
    /// The parameters no longer move.
    StepConverged,
    /// Out of iterations: start closer, or allow more.
    MaxIterations,
    /// No damping gives a lower loss although the gradient is not zero: the model is
    /// not smooth here, or its derivatives are inaccurate.
    Stalled,
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// How it ended.
    pub status: FitStatus,
    /// Parameters, frozen ones included.
    pub theta: Vec<f64>,
    /// Loss of the residuals, prior excluded.
    pub loss: f64,
    /// Loss at the start, prior excluded.
    pub initial_loss: f64,
    /// Number of residuals.
    pub n_residuals: usize,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations of the problem.
    pub evaluations: usize,
    /// Numbers of the free parameters, the order of the matrices below.
    pub free: Vec<usize>,
    /// Inverse of the normal matrix (prior included), row-major: covariance for unit white noise.
    pub covariance: Vec<f64>,
    /// Covariance from the scatter of block gradients, valid when the residuals are
    /// correlated or the model is incomplete; row-major.
    pub sandwich: Vec<f64>,
    /// Condition number of the normal matrix scaled to unit diagonal.
    pub condition: f64,
    /// Free parameters that ended on a bound.
    pub at_bound: Vec<usize>,
    /// Normal equations by block.
    pub blocks: Vec<BlockGram>,
    /// Whitened residuals.
    pub residual: Vec<f64>,
    /// Jacobian columns of the free parameters.
    pub columns: Vec<Vec<f64>>,
}

/// Trial steps, each damped eight times more, before the search gives up.
const MAX_REJECTIONS: usize = 8;

/// Mean square of a whitened residual that no natural change of a parameter causes: a
/// thousand standard deviations of noise.
const LARGEST_SQUARE: f64 = 1e6;

/// A point with everything the next step needs.
struct Point {
    theta: Vec<f64>,
    residual: Vec<f64>,
    weight: Vec<f64>,
    losses: Vec<f64>,
    loss: f64,
    prior: f64,
}

struct Search<'a, P: Problem> {
    problem: &'a P,
    parameters: &'a [FitParameter],
    options: FitOptions,
    free: Vec<usize>,
    columns: Vec<Vec<f64>>,
    evaluations: usize,
}

/// Fit `parameters` of `problem`. `warm` may hold Jacobian columns from an earlier
/// fit for nuisance parameters: pairs of parameter number and column.
///
/// # Errors
/// [`ProblemError`] for misuse or when the starting point cannot be evaluated.
pub fn fit<P: Problem>(
    problem: &P,
    parameters: &[FitParameter],
    options: FitOptions,
    warm: &[(usize, Vec<f64>)],
) -> Result<Fit, ProblemError> {
    check(parameters)?;
    let free: Vec<usize> = (0..parameters.len())
        .filter(|i| !parameters[*i].frozen)
        .collect();
    let mut search = Search {
        problem,
        parameters,
        options,
        columns: vec![Vec::new(); free.len()],
        free,
        evaluations: 0,
    };
    let theta: Vec<f64> = parameters.iter().map(|p| p.initial).collect();
    let mut stale = Vec::new();
    for (slot, i) in search.free.iter().enumerate() {
        match warm.iter().find(|(j, _)| j == i) {
            Some((_, column)) => search.columns[slot].clone_from(column),
            None => stale.push(slot),
        }
    }
    let mut point = search.evaluate(theta, &stale)?;
    let (initial_loss, n) = (point.loss, point.residual.len());
    if let Some(slot) = search.columns.iter().position(|c| c.len() != n) {
        return Err(ProblemError::Invalid {
            field: "warm".into(),
            expected: format!("columns of {n} residuals"),
            got: search.columns[slot].len().to_string(),
        });
    }
    let mut iterations = 0;
    let mut refreshes = options.nuisance_refreshes;
    let status = loop {
        let status = search.descend(&mut point, &mut iterations)?;
        let nuisance: Vec<usize> = (0..search.free.len())
            .filter(|s| parameters[search.free[*s]].nuisance)
            .collect();
        if refreshes == 0 || nuisance.is_empty() || status == FitStatus::MaxIterations {
            break status;
        }
        refreshes -= 1;
        let before = point.loss + point.prior;
        let all: Vec<usize> = (0..search.free.len()).collect();
        point = search.evaluate(point.theta.clone(), &all)?;
        let status = search.descend(&mut point, &mut iterations)?;
        let gained = before - (point.loss + point.prior);
        if gained <= 1e-4 * before || status == FitStatus::MaxIterations {
            break status;
        }
    };
    Ok(search.finish(point, status, initial_loss, iterations))
}

fn check(parameters: &[FitParameter]) -> Result<(), ProblemError> {
    for (i, p) in parameters.iter().enumerate() {
        let good =
            p.lower <= p.initial && p.initial <= p.upper && p.scale > 0.0 && p.scale.is_finite();
        let prior = p
            .prior
            .is_none_or(|(mean, std)| mean.is_finite() && std > 0.0);
        if !good || !prior {
            return Err(ProblemError::Invalid {
                field: format!("parameters[{i}]"),
                expected: "lower <= initial <= upper, positive scale and prior deviation".into(),
                got: format!("{p:?}"),
            });
        }
    }
    Ok(())
}

impl<P: Problem> Search<'_, P> {
    /// Evaluate at `theta`, renewing the Jacobian columns `slots`.
    fn evaluate(&mut self, theta: Vec<f64>, slots: &[usize]) -> Result<Point, ProblemError> {
        self.evaluations += 1;
        let wanted: Vec<usize> = slots.iter().map(|s| self.free[*s]).collect();
        let evaluation = self.problem.evaluate(&theta, &wanted)?;
        if evaluation.residual.iter().any(|r| !r.is_finite()) {
            return Err(ProblemError::Failed("a residual is not finite".into()));
        }
        for (slot, column) in slots.iter().zip(evaluation.columns) {
            self.columns[*slot] = column;
        }
        let (losses, weight): (Vec<f64>, Vec<f64>) = evaluation
            .residual
            .iter()
            .map(|r| self.options.loss.evaluate(*r))
            .unzip();
        Ok(Point {
            loss: losses.iter().sum(),
            prior: self.prior_loss(&theta),
            theta,
            residual: evaluation.residual,
            weight,
            losses,
        })
    }

    fn prior_loss(&self, theta: &[f64]) -> f64 {
        let priors = self.free.iter().filter_map(|i| {
            let (mean, std) = self.parameters[*i].prior?;
            Some(((theta[*i] - mean) / std).powi(2))
        });
        priors.sum()
    }

    /// Columns renewed at every step.
    fn fresh(&self) -> Vec<usize> {
        let slots = 0..self.free.len();
        slots
            .filter(|s| !self.parameters[self.free[*s]].nuisance)
            .collect()
    }

    /// Normal matrix and gradient in scaled parameters, prior included.
    fn normal(&self, point: &Point) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.free.len();
        let blocks = self.grams(point);
        let mut matrix = DMatrix::zeros(n, n);
        let mut gradient = DVector::zeros(n);
        for gram in &blocks {
            for i in 0..n {
                gradient[i] += gram.gradient[i];
                for j in 0..n {
                    matrix[(i, j)] += gram.matrix[i * n + j];
                }
            }
        }
        for (slot, i) in self.free.iter().enumerate() {
            if let Some((mean, std)) = self.parameters[*i].prior {
                matrix[(slot, slot)] += 1.0 / (std * std);
                gradient[slot] += (point.theta[*i] - mean) / (std * std);
            }
        }
        let scale = DVector::from_iterator(n, self.free.iter().map(|i| self.parameters[*i].scale));
        for i in 0..n {
            gradient[i] *= scale[i];
            for j in 0..n {
                matrix[(i, j)] *= scale[i] * scale[j];
            }
        }
        (matrix, gradient)
    }

    fn grams(&self, point: &Point) -> Vec<BlockGram> {
        use rayon::prelude::*;
        let columns: Vec<&[f64]> = self.columns.iter().map(|c| &c[..]).collect();
        self.problem
            .blocks()
            .into_par_iter()
            .map(|block| {
                let range = block.start..block.start + block.len;
                let loss = point.losses[range].iter().sum();
                let mut gram =
                    BlockGram::new(block, &point.residual, loss, &point.weight, &columns);
                if self.unpredictable(&gram) {
                    gram.matrix.fill(0.0);
                    gram.gradient.fill(0.0);
                }
                gram
            })
            .collect()
    }

    /// Whether a parameter's natural change moves this block beyond all reason: the
    /// simulation is chaotic there (lost motion, stiction). Such a block counts in the
    /// loss, but its derivative says nothing about a finite change.
    fn unpredictable(&self, gram: &BlockGram) -> bool {
        let n = self.free.len();
        self.free.iter().enumerate().any(|(slot, i)| {
            let scale = self.parameters[*i].scale;
            let square = gram.matrix[slot * n + slot] * scale * scale / gram.block.len as f64;
            square > LARGEST_SQUARE || square.is_nan()
        })
    }

    /// Steps until one of the stopping rules holds.
    fn descend(
        &mut self,
        point: &mut Point,
        iterations: &mut usize,
    ) -> Result<FitStatus, ProblemError> {
        let fresh = self.fresh();
        let mut damping = 1e-3;
        while *iterations < self.options.max_iterations {
            let (matrix, gradient) = self.normal(point);
            let total = point.loss + point.prior;
            let mut rejected = 0;
            loop {
                let step = self.step(point, &matrix, &gradient, damping);
                let moved = self.moved(point, &step);
                if moved < self.options.step_tolerance {
                    return Ok(FitStatus::StepConverged);
                }
                match self.evaluate(step, &[]) {
                    Ok(next) if next.loss + next.prior < total => {
                        let gain = total - (next.loss + next.prior);
                        *iterations += 1;
                        damping = (damping * 0.2).max(1e-12);
                        *point = self.evaluate(next.theta, &fresh)?;
                        if gain < self.options.loss_tolerance * total && rejected == 0 {
                            return Ok(FitStatus::LossConverged);
                        }
                        break;
                    }
                    Err(ProblemError::Cancelled) => return Err(ProblemError::Cancelled),
                    _ => {
                        rejected += 1;
                        damping *= 8.0;
                        if rejected > MAX_REJECTIONS {
                            return Ok(stall(&matrix, &gradient, total));
                        }
                    }
                }
            }
        }
        Ok(FitStatus::MaxIterations)
    }

    /// Damped Gauss-Newton step projected on the bounds.
    fn step(
        &self,
        point: &Point,
        matrix: &DMatrix<f64>,
        gradient: &DVector<f64>,
        damping: f64,
    ) -> Vec<f64> {
        let n = self.free.len();
        let mut active = vec![false; n];
        // A parameter that a step pushes through its bound is put on it and left out.
        for _ in 0..=n {
            let step = damped_step(matrix, gradient, damping, &active);
            let mut theta = point.theta.clone();
            let mut hit = false;
            for (slot, i) in self.free.iter().enumerate() {
                let p = &self.parameters[*i];
                let wanted = point.theta[*i] + step[slot] * p.scale;
                theta[*i] = wanted.clamp(p.lower, p.upper);
                let below = wanted < p.lower && point.theta[*i] <= p.lower;
                let above = wanted > p.upper && point.theta[*i] >= p.upper;
                let outward = below || above;
                if outward && !active[slot] {
                    active[slot] = true;
                    hit = true;
                }
            }
            if !hit {
                return theta;
            }
        }
        point.theta.clone()
    }

    fn moved(&self, point: &Point, theta: &[f64]) -> f64 {
        let change = |i: &usize| (theta[*i] - point.theta[*i]).abs() / self.parameters[*i].scale;
        self.free.iter().map(change).fold(0.0, f64::max)
    }

    fn finish(self, point: Point, status: FitStatus, initial_loss: f64, iterations: usize) -> Fit {
        let n = self.free.len();
        let (scaled, _) = self.normal(&point);
        let blocks = self.grams(&point);
        let scale: Vec<f64> = self
            .free
            .iter()
            .map(|i| self.parameters[*i].scale)
            .collect();
        let inverse = scaled
            .clone()
            .try_inverse()
            .unwrap_or_else(|| DMatrix::from_element(n, n, f64::NAN));
        let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let mut scatter = DMatrix::zeros(n, n);
        for gram in &blocks {
            let g = DVector::from_column_slice(&gram.gradient);
            scatter += &g * g.transpose();
        }
        let sandwich = &covariance * scatter * &covariance;
        let at_bound = self
            .free
            .iter()
            .copied()
            .filter(|i| {
                let p = &self.parameters[*i];
                let near = 1e-9 * p.scale;
                point.theta[*i] - p.lower <= near || p.upper - point.theta[*i] <= near
            })
            .collect();
        Fit {
            status,
            theta: point.theta,
            loss: point.loss,
            initial_loss,
            n_residuals: point.residual.len(),
            iterations,
            evaluations: self.evaluations,
            free: self.free,
            covariance: covariance.as_slice().to_vec(),
            sandwich: sandwich.as_slice().to_vec(),
            condition: condition(&scaled),
            at_bound,
            blocks,
            residual: point.residual,
            columns: self.columns,
        }
    }
}

/// No step helps: settled if even the undamped step promises nothing.
fn stall(matrix: &DMatrix<f64>, gradient: &DVector<f64>, total: f64) -> FitStatus {
    let promised = matrix
        .clone()
        .cholesky()
        .map_or(f64::INFINITY, |c| gradient.dot(&c.solve(gradient)));
    if promised < 1e-4 * total {
        FitStatus::LossConverged
    } else {
        FitStatus::Stalled
    }
}

/// `-(A + damping diag A)^-1 g` without the active parameters; zero where unsolvable.
fn damped_step(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
    active: &[bool],
) -> DVector<f64> {
    let n = gradient.len();
    let mut a = matrix.clone();
    let mut g = gradient.clone();
    for i in 0..n {
        // A parameter without influence must not make the matrix singular.
        a[(i, i)] += damping * a[(i, i)] + 1e-12;
        if active[i] {
            a.row_mut(i).fill(0.0);
            a.column_mut(i).fill(0.0);
            a[(i, i)] = 1.0;
            g[i] = 0.0;
        }
    }
    a.cholesky()
        .map_or_else(|| DVector::zeros(n), |c| -c.solve(&g))
}

fn condition(matrix: &DMatrix<f64>) -> f64 {
    let n = matrix.nrows();
    if n == 0 {
        return 1.0;
    }
    let unit = DMatrix::from_fn(n, n, |i, j| {
        matrix[(i, j)] / (matrix[(i, i)] * matrix[(j, j)]).sqrt()
    });
    if unit.iter().any(|x| !x.is_finite()) {
        return f64::INFINITY;
    }
    let values = unit.symmetric_eigenvalues();
    let (low, high) = (values.min(), values.max());
    if low > 0.0 { high / low } else { f64::INFINITY }
}
