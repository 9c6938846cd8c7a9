//! The search for the parameters of a linearized robot, over logarithms if requested.
//!
//! One evaluation per trial gives the loss and the normal equations. All derivatives together cost
//! as much as two or three responses, so an accepted trial needs no further evaluation.

use super::error::FrequencyFitError;
use super::problem::{FrequencyProblem, Scatter};
use axisight_numerics::descent::{
    Bounded, Damping, LeastSquares, Limits, Normal, Progress, Reach, Rules, Status, search,
};
use nalgebra::{DMatrix, DVector};

/// Limits of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Largest number of accepted steps.
    pub max_iterations: usize,
    /// Stop if the linear model predicts a reduction of the loss below this share.
    pub gain_tolerance: f64,
    /// Stop if no parameter moves by more than this value, or by this share if it is searched over
    /// its logarithm.
    pub step_tolerance: f64,
}

/// Result of a search. Matrices cover the free parameters in their search units.
#[derive(Debug, Clone)]
pub struct FrequencyFit {
    /// Why the search ended.
    pub status: Status,
    /// All parameters, in their own units.
    pub values: Vec<f64>,
    /// Slopes of the values over their search units, for the free parameters.
    pub slopes: Vec<f64>,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    /// Loss without the priors.
    pub loss: f64,
    /// Loss at the start, without the priors.
    pub initial_loss: f64,
    /// Number of accepted steps.
    pub iterations: usize,
    /// Number of evaluations of the model.
    pub evaluations: usize,
    /// `J^T W J`, with the priors.
    pub matrix: DMatrix<f64>,
    /// `J^T W r`, with the priors.
    pub gradient: DVector<f64>,
    /// Covariance information from the residuals.
    pub scatter: Scatter,
    /// Indices of the parameters on a bound.
    pub at_bound: Vec<usize>,
}

/// Predicted reduction, in variances of one residual, below which a search has converged if no step
/// helps. A smaller reduction is lost in the rounding of the loss.
const SETTLED: f64 = 1e-3;
/// Longest step in search units; a factor of e over logarithms.
const LONGEST_STEP: f64 = 1.0;

/// Fit the parameters of `problem` from their initial values.
///
/// # Errors
/// [`FrequencyFitError`] if the model is not valid at the start, or if the fit is cancelled.
pub fn minimize(
    problem: &FrequencyProblem,
    options: SearchOptions,
) -> Result<FrequencyFit, FrequencyFitError> {
    let mut search = Search::new(problem)?;
    let initial_loss = search.point.plain;
    let (status, iterations) = search.run(options)?;
    let scatter = problem.scatter(&search.theta)?;
    let values = problem.values(&search.theta);
    let slope = |i: &usize| {
        if problem.parameters[*i].logarithmic {
            values[*i]
        } else {
            1.0
        }
    };
    let at_bound = search.limits().at_bound(&search.free());
    Ok(FrequencyFit {
        status,
        slopes: problem.free.iter().map(slope).collect(),
        free: problem.free.clone(),
        loss: search.point.plain,
        initial_loss,
        iterations,
        evaluations: search.evaluations,
        matrix: search.point.normal.matrix,
        gradient: search.point.normal.gradient,
        at_bound: at_bound.into_iter().map(|s| problem.free[s]).collect(),
        scatter,
        values,
    })
}

/// An evaluated point.
struct Point {
    /// Normal equations, with the priors.
    normal: Normal,
    /// Loss of the residuals.
    plain: f64,
}

struct Search<'a> {
    problem: &'a FrequencyProblem,
    /// All parameters, in search units.
    theta: Vec<f64>,
    /// Mean and standard deviation of the free parameters, in search units.
    priors: Vec<Option<(f64, f64)>>,
    point: Point,
    evaluations: usize,
}

/// A parameter in search units.
fn searched(logarithmic: bool, value: f64) -> f64 {
    if logarithmic { value.ln() } else { value }
}

impl<'a> Search<'a> {
    fn new(problem: &'a FrequencyProblem) -> Result<Self, FrequencyFitError> {
        let start = problem.parameters.iter();
        let theta: Vec<f64> = start.map(|p| searched(p.logarithmic, p.initial)).collect();
        let prior = |i: &usize| {
            let p = &problem.parameters[*i];
            let (mean, std) = p.prior?;
            let share = if p.logarithmic { std / mean } else { std };
            Some((searched(p.logarithmic, mean), share))
        };
        let priors: Vec<_> = problem.free.iter().map(prior).collect();
        Ok(Self {
            point: evaluate(problem, &priors, &theta)?,
            problem,
            theta,
            priors,
            evaluations: 1,
        })
    }

    fn free(&self) -> Vec<f64> {
        self.problem.free.iter().map(|i| self.theta[*i]).collect()
    }

    fn limits(&self) -> Limits {
        let free = || {
            self.problem
                .free
                .iter()
                .map(|i| &self.problem.parameters[*i])
        };
        Limits {
            lower: free().map(|p| searched(p.logarithmic, p.lower)).collect(),
            upper: free().map(|p| searched(p.logarithmic, p.upper)).collect(),
            scale: vec![1.0; self.problem.free.len()],
            reach: Reach::Scales(LONGEST_STEP),
            // The problem takes logarithms itself.
            logarithmic: vec![false; self.problem.free.len()],
        }
    }

    fn run(&mut self, options: SearchOptions) -> Result<(Status, usize), FrequencyFitError> {
        let rules = Rules {
            max_iterations: options.max_iterations,
            loss_tolerance: options.gain_tolerance,
            progress: Progress::Promised,
            step_tolerance: options.step_tolerance,
            rounding: 0.0,
            settled: SETTLED / self.problem.count().max(1) as f64,
            damping: Damping::KEPT,
        };
        let (limits, start) = (self.limits(), self.free());
        let mut descent = Bounded::new(self, &limits, start);
        let outcome = search(&mut descent, &rules)?;
        let end = descent.into_theta();
        self.place(&end);
        Ok((outcome.status, outcome.iterations))
    }

    /// Copy the free parameters to their places.
    fn place(&mut self, free: &[f64]) {
        for (i, x) in self.problem.free.iter().zip(free) {
            self.theta[*i] = *x;
        }
    }
}

impl LeastSquares for Search<'_> {
    type Trial = Point;
    type Error = FrequencyFitError;

    fn normal(&self) -> &Normal {
        &self.point.normal
    }

    fn attempt(&mut self, theta: &[f64]) -> Result<Option<(f64, Point)>, FrequencyFitError> {
        self.evaluations += 1;
        self.place(theta);
        match evaluate(self.problem, &self.priors, &self.theta) {
            Ok(trial) => Ok(Some((trial.normal.loss, trial))),
            Err(FrequencyFitError::Cancelled) => Err(FrequencyFitError::Cancelled),
            Err(_) => Ok(None),
        }
    }

    fn accept(&mut self, _: &[f64], trial: Point) -> Result<(), FrequencyFitError> {
        self.point = trial;
        Ok(())
    }
}

/// Normal equations with the priors, and the loss without them.
fn evaluate(
    problem: &FrequencyProblem,
    priors: &[Option<(f64, f64)>],
    theta: &[f64],
) -> Result<Point, FrequencyFitError> {
    let mut normal = problem.evaluate(theta)?;
    let plain = normal.loss;
    for (slot, (i, prior)) in problem.free.iter().zip(priors).enumerate() {
        if let Some((mean, std)) = prior {
            normal.add_prior(slot, theta[*i] - mean, *std);
        }
    }
    Ok(Point { normal, plain })
}
