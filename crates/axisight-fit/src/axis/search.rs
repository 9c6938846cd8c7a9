//! The search for the parameters of an axis.
//!
//! Every trial point is evaluated with its derivatives, which cost less than a second run. The fit
//! to logs instead keeps residuals and Jacobian in memory and runs the model twice per step; here
//! that would take half of the total time.

use super::AxisError;
use super::problem::{AxisProblem, Evaluation};
use axisight_numerics::descent::{
    self, Bounded, Damping, LeastSquares, Limits, Normal, Progress, Reach, Rules, Status,
};

/// One parameter of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchParameter {
    /// Start value.
    pub initial: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Scale of small changes, for values of the parameter near zero.
    pub scale: f64,
    /// Whether the parameter may move.
    pub free: bool,
}

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Largest number of accepted steps.
    pub max_iterations: usize,
    /// Stop if the linear model predicts a reduction of the loss below this share.
    pub loss_tolerance: f64,
    /// Stop if no parameter moves by more than this share of itself.
    pub step_tolerance: f64,
}

/// Result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    /// Why the search ended.
    pub status: Status,
    /// All parameters at the end.
    pub theta: Vec<f64>,
    /// Weighted sum of squared residuals.
    pub loss: f64,
    /// Weighted sum of squared residuals at the start.
    pub initial_loss: f64,
    /// Number of accepted steps.
    pub iterations: usize,
    /// Number of evaluations.
    pub evaluations: usize,
    /// Normal equations at the end, over the free parameters.
    pub normal: Normal,
    /// Weighted and whitened residuals, model minus measurement, data set by data set.
    pub residual: Vec<f64>,
    /// `J^T r` of every block of every data set, over the free parameters.
    pub block_gradients: Vec<f64>,
}

/// Largest factor by which one step changes a parameter of fixed sign. Far from the minimum the
/// linear model fails: an unlimited step may set half of the inertias to zero.
const LARGEST_FACTOR: f64 = 5.0;

/// Predicted reduction, in variances of one residual, below which a search has converged. All
/// parameters together are then within 0.7 standard deviations of the minimum. Changes of the
/// friction's sign put kinks of this size into a noisy loss.
const SETTLED: f64 = 0.5;

/// Residuals below this share of the energy of the data are rounding errors.
const ROUNDING: f64 = 1e-24;

struct Search<'a> {
    problem: &'a AxisProblem<'a>,
    /// All parameters.
    theta: Vec<f64>,
    free: Vec<usize>,
    evaluations: usize,
    point: Evaluation,
    /// Memory of a discarded point, for reuse.
    spare: Option<Evaluation>,
}

/// Minimize the loss of `problem` from the initial parameters.
///
/// # Errors
/// [`AxisError::Invalid`] if `parameters` do not fit the problem, [`AxisError::Diverged`] if the
/// start cannot be simulated, and [`AxisError::Cancelled`].
pub fn search(
    problem: &AxisProblem<'_>,
    parameters: &[SearchParameter],
    options: SearchOptions,
) -> Result<SearchResult, AxisError> {
    check(problem, parameters)?;
    let is_free = |i: &usize| parameters[*i].free;
    let free: Vec<usize> = (0..parameters.len()).filter(is_free).collect();
    let limits = limits(parameters, &free);
    let theta: Vec<f64> = parameters.iter().map(|p| p.initial).collect();
    let start = free.iter().map(|i| theta[*i]).collect();
    let point = problem.evaluate(&theta, &free, None)?;
    let initial_loss = point.normal.loss;
    let count: usize = point.rows.iter().map(|r| r.residual.len()).sum();
    let rules = Rules {
        max_iterations: options.max_iterations,
        loss_tolerance: options.loss_tolerance,
        progress: Progress::Promised,
        step_tolerance: options.step_tolerance,
        rounding: ROUNDING * problem.energy(),
        settled: SETTLED / count.max(1) as f64,
        damping: Damping::KEPT,
    };
    let mut search = Search {
        problem,
        theta,
        free,
        evaluations: 1,
        point,
        spare: None,
    };
    let mut descent = Bounded::new(&mut search, &limits, start);
    let outcome = descent::search(&mut descent, &rules)?;
    let end = descent.into_theta();
    search.place(&end);
    Ok(search.finish(outcome.status, initial_loss, outcome.iterations))
}

fn limits(parameters: &[SearchParameter], free: &[usize]) -> Limits {
    let each = |of: fn(&SearchParameter) -> f64| free.iter().map(|i| of(&parameters[*i])).collect();
    Limits {
        lower: each(|p| p.lower),
        upper: each(|p| p.upper),
        scale: each(|p| p.scale),
        reach: Reach::Factor(LARGEST_FACTOR),
        logarithmic: vec![false; free.len()],
    }
}

fn check(problem: &AxisProblem<'_>, parameters: &[SearchParameter]) -> Result<(), AxisError> {
    let n = problem.n_parameters();
    if parameters.len() != n {
        let wanted = format!("{n} parameters");
        return Err(AxisError::invalid("parameters", wanted, parameters.len()));
    }
    for (i, p) in parameters.iter().enumerate() {
        let inside = p.lower <= p.initial && p.initial <= p.upper && p.initial.is_finite();
        if !(inside && p.scale > 0.0 && p.scale.is_finite()) {
            return Err(AxisError::invalid(
                format!("parameters[{i}]"),
                "lower <= initial <= upper and a positive scale",
                format!("{p:?}"),
            ));
        }
    }
    Ok(())
}

impl Search<'_> {
    fn finish(self, status: Status, initial_loss: f64, iterations: usize) -> SearchResult {
        let point = self.point;
        let blocks = self.problem.sets().iter().zip(&point.rows);
        SearchResult {
            status,
            theta: self.theta,
            block_gradients: blocks
                .flat_map(|(s, r)| r.block_gradients(s.block, self.free.len()))
                .collect(),
            residual: point.rows.into_iter().flat_map(|r| r.residual).collect(),
            loss: point.normal.loss,
            initial_loss,
            iterations,
            evaluations: self.evaluations,
            normal: point.normal,
        }
    }

    /// Copy the free parameters to their places.
    fn place(&mut self, free: &[f64]) {
        for (i, x) in self.free.iter().zip(free) {
            self.theta[*i] = *x;
        }
    }
}

impl LeastSquares for Search<'_> {
    type Trial = Evaluation;
    type Error = AxisError;

    fn normal(&self) -> &Normal {
        &self.point.normal
    }

    fn attempt(&mut self, theta: &[f64]) -> Result<Option<(f64, Evaluation)>, AxisError> {
        self.evaluations += 1;
        self.place(theta);
        let spare = self.spare.take();
        match self.problem.evaluate(&self.theta, &self.free, spare) {
            Ok(trial) => Ok(Some((trial.normal.loss, trial))),
            Err(AxisError::Cancelled) => Err(AxisError::Cancelled),
            Err(_) => Ok(None),
        }
    }

    fn accept(&mut self, _: &[f64], trial: Evaluation) -> Result<(), AxisError> {
        self.spare = Some(std::mem::replace(&mut self.point, trial));
        Ok(())
    }

    fn reject(&mut self, trial: Evaluation) {
        self.spare = Some(trial);
    }
}
