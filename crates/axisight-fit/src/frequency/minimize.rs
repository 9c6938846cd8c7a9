//! Levenberg-Marquardt over normal equations, with bounds and priors.
//!
//! Moré (1978), *The Levenberg-Marquardt algorithm: implementation and theory*, with the
//! damping rule of Nielsen (1999), *Damping parameter in Marquardt's method*. One evaluation
//! per trial gives loss and normal equations: with all derivatives at the price of two or
//! three responses, a trial that is accepted has nothing left to compute.

use super::error::FrequencyFitError;
use super::problem::{FrequencyProblem, Scatter};
use super::residuals::Normal;
use nalgebra::{DMatrix, DVector};

/// When a search stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Largest number of accepted steps.
    pub max_iterations: usize,
    /// Stop when an undamped step promises to lower the loss by less than this share.
    pub gain_tolerance: f64,
    /// Stop when no parameter moves by more than this (a share, where searched over logarithms).
    pub step_tolerance: f64,
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchStatus {
    /// A step promises nothing more.
    LossConverged,
    /// The parameters no longer move.
    StepConverged,
    /// Out of iterations.
    MaxIterations,
    /// No damping gives a lower loss although the gradient is not zero.
    Stalled,
}

/// Result of a search; matrices run over the free parameters as searched.
#[derive(Debug, Clone)]
pub struct FrequencyFit {
    /// How it ended.
    pub status: SearchStatus,
    /// All parameters in their own units.
    pub values: Vec<f64>,
    /// Slope of the value over the searched number, for the free parameters.
    pub slopes: Vec<f64>,
    /// Positions of the free parameters.
    pub free: Vec<usize>,
    /// Loss, prior excluded.
    pub loss: f64,
    /// Loss at the start, prior excluded.
    pub initial_loss: f64,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations of the model.
    pub evaluations: usize,
    /// `J^T W J`, prior included.
    pub matrix: DMatrix<f64>,
    /// `J^T W r`, prior included.
    pub gradient: DVector<f64>,
    /// What the residuals say of the covariance.
    pub scatter: Scatter,
    /// Parameters on a bound.
    pub at_bound: Vec<usize>,
}

/// Trial steps that fail in a row before the search gives up.
const MAX_REJECTIONS: usize = 14;
/// Longest step: a factor of e where searched over logarithms.
const LONGEST_STEP: f64 = 1.0;

/// Fit the parameters of `problem` from their initial values.
///
/// # Errors
/// [`FrequencyFitError`] if the model does not hold at the start, or when cancelled.
pub fn minimize(
    problem: &FrequencyProblem,
    options: SearchOptions,
) -> Result<FrequencyFit, FrequencyFitError> {
    let mut search = Search::new(problem)?;
    let initial_loss = search.point.loss;
    let status = search.run(options)?;
    let scatter = problem.scatter(&search.theta)?;
    let values = problem.values(&search.theta);
    let slope = |i: &usize| {
        if problem.parameters[*i].logarithmic {
            values[*i]
        } else {
            1.0
        }
    };
    Ok(FrequencyFit {
        status,
        slopes: problem.free.iter().map(slope).collect(),
        free: problem.free.clone(),
        loss: search.point.loss,
        initial_loss,
        iterations: search.iterations,
        evaluations: search.evaluations,
        matrix: search.point.matrix,
        gradient: search.point.gradient,
        at_bound: search.limits.at_bound(&problem.free, &search.theta),
        scatter,
        values,
    })
}

/// Bounds and priors as searched, of all parameters.
struct Limits {
    lower: Vec<f64>,
    upper: Vec<f64>,
    prior: Vec<Option<(f64, f64)>>,
}

impl Limits {
    fn new(problem: &FrequencyProblem) -> Self {
        let all = || problem.parameters.iter();
        let searched = |log: bool, x: f64| if log { x.ln() } else { x };
        Self {
            lower: all().map(|p| searched(p.logarithmic, p.lower)).collect(),
            upper: all().map(|p| searched(p.logarithmic, p.upper)).collect(),
            prior: all()
                .map(|p| {
                    let (mean, std) = p.prior?;
                    let share = if p.logarithmic { std / mean } else { std };
                    Some((searched(p.logarithmic, mean), share))
                })
                .collect(),
        }
    }

    fn at_bound(&self, free: &[usize], theta: &[f64]) -> Vec<usize> {
        let near = |i: &usize| {
            let small = 1e-9 * theta[*i].abs().max(1.0);
            theta[*i] - self.lower[*i] <= small || self.upper[*i] - theta[*i] <= small
        };
        free.iter().copied().filter(near).collect()
    }

    fn prior_loss(&self, free: &[usize], theta: &[f64]) -> f64 {
        let one = |i: &usize| {
            self.prior[*i].map_or(0.0, |(mean, std)| ((theta[*i] - mean) / std).powi(2))
        };
        free.iter().map(one).sum()
    }
}

struct Search<'a> {
    problem: &'a FrequencyProblem,
    limits: Limits,
    theta: Vec<f64>,
    /// Normal equations at `theta`, prior included except in the loss.
    point: Normal,
    iterations: usize,
    evaluations: usize,
}

impl<'a> Search<'a> {
    fn new(problem: &'a FrequencyProblem) -> Result<Self, FrequencyFitError> {
        let start = problem.parameters.iter();
        let theta: Vec<f64> = start
            .map(|p| {
                if p.logarithmic {
                    p.initial.ln()
                } else {
                    p.initial
                }
            })
            .collect();
        let limits = Limits::new(problem);
        let point = evaluate(problem, &limits, &theta)?;
        Ok(Self {
            problem,
            limits,
            theta,
            point,
            iterations: 0,
            evaluations: 1,
        })
    }

    fn total(&self, point: &Normal, theta: &[f64]) -> f64 {
        point.loss + self.limits.prior_loss(&self.problem.free, theta)
    }

    fn run(&mut self, options: SearchOptions) -> Result<SearchStatus, FrequencyFitError> {
        let (mut damping, mut growth, mut rejected) = (1e-3, 2.0, 0);
        loop {
            let total = self.total(&self.point, &self.theta);
            let (_, promised) = self.step(1e-13);
            if promised <= options.gain_tolerance * total {
                return Ok(SearchStatus::LossConverged);
            }
            if self.iterations >= options.max_iterations {
                return Ok(SearchStatus::MaxIterations);
            }
            let (theta, promised) = self.step(damping);
            let moved = theta.iter().zip(&self.theta).map(|(a, b)| (a - b).abs());
            if moved.fold(0.0, f64::max) < options.step_tolerance {
                return Ok(SearchStatus::StepConverged);
            }
            self.evaluations += 1;
            let trial = match evaluate(self.problem, &self.limits, &theta) {
                Err(FrequencyFitError::Cancelled) => return Err(FrequencyFitError::Cancelled),
                other => other.ok(),
            };
            let gain = trial.as_ref().map(|p| total - self.total(p, &theta));
            match (trial, gain) {
                (Some(point), Some(gain)) if gain > 0.0 => {
                    let quality = (2.0 * gain / promised.max(f64::MIN_POSITIVE) - 1.0).powi(3);
                    damping = (damping * (1.0 - quality).max(0.1)).max(1e-12);
                    (self.theta, self.point) = (theta, point);
                    (growth, rejected) = (2.0, 0);
                    self.iterations += 1;
                }
                _ => {
                    damping *= growth;
                    growth *= 2.0;
                    rejected += 1;
                    if rejected > MAX_REJECTIONS {
                        return Ok(SearchStatus::Stalled);
                    }
                }
            }
        }
    }

    /// Damped step within the bounds, and the fall of the loss it promises.
    fn step(&self, damping: f64) -> (Vec<f64>, f64) {
        let (free, n) = (&self.problem.free, self.problem.free.len());
        let mut held = vec![false; n];
        for _ in 0..=n {
            let step = damped(&self.point, damping, &held);
            let longest = step.amax();
            let shrink = if longest > LONGEST_STEP {
                LONGEST_STEP / longest
            } else {
                1.0
            };
            let mut theta = self.theta.clone();
            let mut hit = false;
            for (slot, i) in free.iter().enumerate() {
                let wanted = self.theta[*i] + shrink * step[slot];
                let outward = (wanted < self.limits.lower[*i]
                    && self.theta[*i] <= self.limits.lower[*i])
                    || (wanted > self.limits.upper[*i] && self.theta[*i] >= self.limits.upper[*i]);
                if outward && !held[slot] {
                    held[slot] = true;
                    hit = true;
                }
                theta[*i] = wanted.clamp(self.limits.lower[*i], self.limits.upper[*i]);
            }
            if !hit {
                let taken = free.iter().map(|i| theta[*i] - self.theta[*i]);
                let taken = DVector::from_iterator(n, taken);
                let curved = taken.dot(&(&self.point.matrix * &taken));
                let promised = -2.0 * self.point.gradient.dot(&taken) - curved;
                return (theta, promised.max(0.0));
            }
        }
        (self.theta.clone(), 0.0)
    }
}

/// Normal equations with those of the prior.
fn evaluate(
    problem: &FrequencyProblem,
    limits: &Limits,
    theta: &[f64],
) -> Result<Normal, FrequencyFitError> {
    let mut point = problem.evaluate(theta, true)?;
    for (slot, i) in problem.free.iter().enumerate() {
        if let Some((mean, std)) = limits.prior[*i] {
            point.matrix[(slot, slot)] += 1.0 / (std * std);
            point.gradient[slot] += (theta[*i] - mean) / (std * std);
        }
    }
    Ok(point)
}

/// `-(A + damping diag A)^-1 g`, nothing for the held parameters.
fn damped(point: &Normal, damping: f64, held: &[bool]) -> DVector<f64> {
    let mut matrix = point.matrix.clone();
    let mut gradient = point.gradient.clone();
    for (i, held) in held.iter().enumerate() {
        let own = matrix[(i, i)];
        matrix[(i, i)] += damping * own;
        // A parameter without influence stays where it is.
        if *held || own <= 0.0 {
            matrix.row_mut(i).fill(0.0);
            matrix.column_mut(i).fill(0.0);
            matrix[(i, i)] = 1.0;
            gradient[i] = 0.0;
        }
    }
    // Scaled to unit diagonal, the matrix loses no digits to units.
    let scale = matrix.diagonal().map(|x| 1.0 / x.sqrt());
    let unit = DMatrix::from_fn(held.len(), held.len(), |i, j| {
        matrix[(i, j)] * scale[i] * scale[j]
    });
    let right = gradient.component_mul(&scale);
    unit.cholesky().map_or_else(
        || DVector::zeros(held.len()),
        |c| -(c.solve(&right).component_mul(&scale)),
    )
}
