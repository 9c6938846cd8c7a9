//! Fits with bounds, priors, robust loss and lazy nuisance columns.
//!
//! A trial point costs one simulation without derivatives. Only an accepted point gets its
//! derivatives, along that simulation if possible. If there are few derivatives, every trial point
//! gets them at once, because most trials are accepted.
//!
//! Derivatives of nuisance parameters are kept from point to point, so the predictions of the
//! linear model are not reliable and are not used.

use super::courses::Runs;
use super::gram::BlockGram;
use super::linearize::{Column, Linearization, at_bound, grams, limits};
use super::loss::Loss;
use super::problem::{Evaluation, FitParameter, Problem, ProblemError};
use axisight_numerics::descent::{
    Bounded, Damping, Descent, LeastSquares, Normal, Progress, Rules, Status, search,
};
use nalgebra::{DMatrix, DVector};

/// Settings of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Largest number of accepted steps.
    pub max_iterations: usize,
    /// Stop if the loss falls by less than this share.
    pub loss_tolerance: f64,
    /// Stop if no parameter moves by more than this share of its scale.
    pub step_tolerance: f64,
    /// Loss of whitened residuals.
    pub loss: Loss,
    /// How often nuisance columns may be computed again: if a step fails because of them, or if the
    /// loss has fallen far since they were computed.
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

impl FitOptions {
    /// Rules of a search with `left` iterations.
    fn rules(&self, left: usize, damping: Damping) -> Rules {
        Rules {
            max_iterations: left,
            loss_tolerance: self.loss_tolerance,
            progress: Progress::Gained { always: false },
            step_tolerance: self.step_tolerance,
            rounding: 0.0,
            settled: WORTH_A_STEP,
            damping,
        }
    }
}

/// Damping of the first step if logarithms are searched. They are searched where the start may be
/// far off, so the first steps are short.
const FAR: f64 = 1.0;
/// Damping of the first step otherwise.
const NEAR: f64 = 1e-3;

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Why the fit ended.
    pub status: Status,
    /// All parameters, including frozen ones.
    pub theta: Vec<f64>,
    /// Loss of the residuals, without the priors.
    pub loss: f64,
    /// Loss at the start, without the priors.
    pub initial_loss: f64,
    /// Number of residuals.
    pub n_residuals: usize,
    /// Number of accepted steps.
    pub iterations: usize,
    /// Number of evaluations of the problem.
    pub evaluations: usize,
    /// Indices of the free parameters, in the order of the matrices below.
    pub free: Vec<usize>,
    /// Inverse of the normal matrix with the priors, row-major: the covariance for white noise of
    /// unit variance.
    pub covariance: Vec<f64>,
    /// Covariance from the scatter of the block gradients and of the priors, row-major. It is valid
    /// even if residuals are correlated or the model is incomplete.
    pub sandwich: Vec<f64>,
    /// Condition number of the normal matrix, scaled to a unit diagonal.
    pub condition: f64,
    /// Indices of the free parameters that ended on a bound.
    pub at_bound: Vec<usize>,
    /// Normal equations of each block.
    pub blocks: Vec<BlockGram>,
    /// Whitened residuals.
    pub residual: Vec<f64>,
    /// Jacobian columns of the free parameters.
    pub columns: Vec<Column>,
    /// Whether all columns were computed at `theta`.
    pub up_to_date: bool,
}

/// Predicted reduction, as a share of the loss, above which a search that no longer moves has
/// stalled.
const WORTH_A_STEP: f64 = 1e-4;

/// Reduction of the loss, as a share, after which nuisance columns are out of date.
const MOVED: f64 = 0.1;

/// How long a search continues with the present nuisance columns.
#[derive(Debug, Clone, Copy)]
struct Patience {
    /// Largest number of accepted steps.
    steps: usize,
    /// Largest number of failures in a row.
    failures: usize,
}

impl Patience {
    /// For searches that renew all columns at every step.
    const LONG: Self = Self {
        steps: usize::MAX,
        failures: 8,
    };
    /// For the first step after columns were computed.
    const FIRST: Self = Self {
        steps: 1,
        failures: 3,
    };
    /// For further steps, if columns cannot be renewed. Shorter steps rarely help if columns of
    /// another point make a step fail.
    const FURTHER: Self = Self {
        steps: usize::MAX,
        failures: 1,
    };
    /// For further steps, if columns can be renewed.
    const BRIEF: Self = Self {
        steps: 1,
        failures: 0,
    };
}

/// Smallest influence of a parameter: the sum of squares of the whitened residuals' change for a
/// natural change of the parameter. A parameter with less influence, a millionth of the noise of
/// one residual, is not moved. Example: the shape of a friction of zero size.
const LEAST_INFLUENCE: f64 = 1e-12;

/// Largest factor by which the step of a shape is stretched if the size of its effect shrinks.
const MOST_STRETCHED: f64 = 2.0;

/// Number of derivatives that every trial point gets at once, because they cost less than another
/// simulation.
const FEW: usize = 4;

/// The present point of a fit, with all data for the next step.
struct Search<'a, P: Problem> {
    problem: &'a P,
    parameters: &'a [FitParameter],
    rho: Loss,
    /// All parameters.
    theta: Vec<f64>,
    free: Vec<usize>,
    /// Columns that are renewed at every step, as positions in `free`.
    fresh: Vec<usize>,
    columns: Vec<Column>,
    residual: Vec<f64>,
    /// Runs along which derivatives at the present point can be computed.
    runs: Runs,
    blocks: Vec<BlockGram>,
    /// Loss of the residuals, without the priors.
    plain: f64,
    /// Normal equations, with the priors.
    normal: Normal,
    evaluations: usize,
}

/// Fit `parameters` of `problem`.
///
/// `warm` may hold Jacobian columns of nuisance parameters from an earlier fit, as pairs of
/// parameter index and column.
///
/// # Errors
/// [`ProblemError`] if the input is invalid, the start cannot be evaluated, or the fit is
/// cancelled.
pub fn fit<P: Problem>(
    problem: &P,
    parameters: &[FitParameter],
    options: FitOptions,
    warm: &[(usize, Column)],
) -> Result<Fit, ProblemError> {
    let start = Linearization::new(problem, parameters, options.loss, warm)?;
    let initial_loss = start.loss;
    let mut search = Search::new(problem, parameters, options.loss, start);
    let lazy = search.fresh.len() < search.free.len();
    let mut before = search.normal.loss;
    // Number of steps after which all columns were last computed.
    let mut renewed = warm.is_empty().then_some(0);
    let (mut status, mut iterations) = (Status::MaxIterations, 0);
    for left in (0..=options.nuisance_refreshes).rev() {
        (status, iterations) = if lazy {
            search.descend_lazily(&options, iterations, left > 0)?
        } else {
            search.descend(&options, iterations, Patience::LONG)?
        };
        let over = status == Status::Exact || iterations == options.max_iterations;
        // The same columns at the same point would fail again.
        if !lazy || left == 0 || over || renewed == Some(iterations) {
            break;
        }
        let little = search.promise()? <= options.loss_tolerance * search.normal.loss;
        if little && !search.gone_far(before) {
            status = Status::LossConverged;
            break;
        }
        before = search.normal.loss;
        search.refresh()?;
        renewed = Some(iterations);
    }
    // With columns that are out of date, the search does not end at the minimum.
    let astray = lazy && options.nuisance_refreshes > 0 && search.gone_far(before);
    if astray && status.advice().is_none() {
        status = Status::MaxIterations;
    }
    let up_to_date = !lazy || renewed == Some(iterations);
    Ok(search.finish(status, initial_loss, iterations, up_to_date))
}

impl<'a, P: Problem> Search<'a, P> {
    fn new(
        problem: &'a P,
        parameters: &'a [FitParameter],
        rho: Loss,
        start: Linearization,
    ) -> Self {
        let free = start.free;
        let changing = |slot: &usize| !parameters[free[*slot]].nuisance;
        let mut search = Self {
            problem,
            parameters,
            rho,
            fresh: (0..free.len()).filter(changing).collect(),
            normal: Normal::zero(free.len()),
            theta: start.theta,
            free,
            columns: start.columns,
            residual: start.residual,
            runs: Vec::new(),
            blocks: start.blocks,
            plain: start.loss,
            evaluations: 1,
        };
        search.sum();
        search
    }

    /// The damping of a search that gives up after `failures` in a row.
    ///
    /// Predictions are reliable only if all columns belong to the present point.
    fn damping(&self, failures: usize) -> Damping {
        let far = self.free.iter().any(|i| self.parameters[*i].logarithmic);
        let start = if far { FAR } else { NEAR };
        if far && self.fresh.len() == self.free.len() {
            return Damping::Kept { start };
        }
        Damping::Constant {
            start,
            shrink: 0.2,
            grow: 8.0,
            least: 1e-12,
            failures,
        }
    }

    /// Take steps from the present point, after `iterations` earlier steps. Returns the status and
    /// the new number of steps.
    fn descend(
        &mut self,
        options: &FitOptions,
        iterations: usize,
        patience: Patience,
    ) -> Result<(Status, usize), ProblemError> {
        let limits = limits(self.parameters, &self.free);
        let left = options.max_iterations - iterations;
        let rules = options.rules(left.min(patience.steps), self.damping(patience.failures));
        let theta = self.free.iter().map(|i| self.theta[*i]).collect();
        let outcome = search(&mut Bounded::new(self, &limits, theta), &rules)?;
        Ok((outcome.status, iterations + outcome.iterations))
    }

    /// The same as [`Self::descend`], with nuisance columns that stay as they are. `renewed` says
    /// whether they can be renewed afterwards.
    fn descend_lazily(
        &mut self,
        options: &FitOptions,
        iterations: usize,
        renewed: bool,
    ) -> Result<(Status, usize), ProblemError> {
        let (status, now) = self.descend(options, iterations, Patience::FIRST)?;
        let stepped = now > iterations && status == Status::MaxIterations;
        if !stepped || now == options.max_iterations {
            return Ok((status, now));
        }
        let patience = if renewed {
            Patience::BRIEF
        } else {
            Patience::FURTHER
        };
        self.descend(options, now, patience)
    }

    /// Reduction of the loss that the linear model predicts for an undamped step.
    fn promise(&mut self) -> Result<f64, ProblemError> {
        let limits = limits(self.parameters, &self.free);
        let theta = self.free.iter().map(|i| self.theta[*i]).collect();
        let step = Bounded::new(self, &limits, theta).step(0.0)?;
        Ok(step.map_or(0.0, |step| step.worth))
    }

    /// Whether the loss has fallen so far since `before` that the nuisance columns are out of date.
    fn gone_far(&self, before: f64) -> bool {
        before - self.normal.loss > MOVED * before
    }

    /// Compute all columns at the present point.
    fn refresh(&mut self) -> Result<(), ProblemError> {
        let all: Vec<usize> = (0..self.free.len()).collect();
        let runs = std::mem::take(&mut self.runs);
        let evaluation = self.differentiate(&all, &runs)?;
        self.take(evaluation, &all);
        Ok(())
    }

    fn evaluate(&mut self, theta: &[f64], slots: &[usize]) -> Result<Evaluation, ProblemError> {
        self.evaluations += 1;
        let wanted = self.numbers(slots);
        self.problem.evaluate(theta, &wanted)?.finite()
    }

    /// Evaluate the present point with the columns `slots`; `runs` are those of an evaluation
    /// there.
    fn differentiate(&mut self, slots: &[usize], runs: &Runs) -> Result<Evaluation, ProblemError> {
        self.evaluations += 1;
        let wanted = self.numbers(slots);
        let found = self.problem.differentiate(&self.theta, &wanted, runs)?;
        found.finite()
    }

    /// Indices of the free parameters `slots`.
    fn numbers(&self, slots: &[usize]) -> Vec<usize> {
        slots.iter().map(|s| self.free[*s]).collect()
    }

    /// Store residuals and the columns `slots` of the present point.
    fn take(&mut self, evaluation: Evaluation, slots: &[usize]) {
        for (slot, column) in slots.iter().zip(evaluation.columns) {
            self.columns[*slot] = Column::new(column);
        }
        self.residual = evaluation.residual;
        self.runs = evaluation.runs;
        (self.plain, self.blocks) = grams(
            self.problem,
            self.parameters,
            &self.free,
            self.rho,
            &self.residual,
            &self.columns,
        );
        self.sum();
    }

    /// Compute the normal equations of the present point.
    fn sum(&mut self) {
        let mut normal = self.total();
        for (slot, i) in self.free.iter().enumerate() {
            normal.matrix[(slot, slot)] += LEAST_INFLUENCE / self.parameters[*i].scale.powi(2);
        }
        self.normal = normal;
    }

    /// Normal equations of all blocks and the priors.
    fn total(&self) -> Normal {
        let n = self.free.len();
        let mut normal = Normal::zero(n);
        normal.loss = self.plain;
        for gram in &self.blocks {
            let (gradient, matrix) = (normal.gradient.iter_mut(), normal.matrix.iter_mut());
            gradient.zip(&gram.gradient).for_each(|(sum, x)| *sum += x);
            matrix.zip(&gram.matrix).for_each(|(sum, x)| *sum += x);
        }
        for (slot, i) in self.free.iter().enumerate() {
            if let Some((mean, std)) = self.parameters[*i].prior {
                normal.add_prior(slot, self.theta[*i] - mean, std);
            }
        }
        normal
    }

    /// All parameters, with `free` as the values of the free ones.
    fn all(&self, free: &[f64]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        for (i, x) in self.free.iter().zip(free) {
            theta[*i] = *x;
        }
        theta
    }

    fn prior_loss(&self, theta: &[f64]) -> f64 {
        let priors = self.free.iter().filter_map(|i| {
            let (mean, std) = self.parameters[*i].prior?;
            Some(((theta[*i] - mean) / std).powi(2))
        });
        priors.sum()
    }

    fn finish(self, status: Status, initial_loss: f64, iterations: usize, up_to_date: bool) -> Fit {
        let scale = limits(self.parameters, &self.free).scale;
        let n = self.free.len();
        let total = self.total();
        let scaled = DMatrix::from_fn(n, n, |i, j| total.matrix[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled
            .clone()
            .try_inverse()
            .unwrap_or_else(|| DMatrix::from_element(n, n, f64::NAN));
        let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let mut scatter = DMatrix::zeros(n, n);
        for gram in &self.blocks {
            let g = DVector::from_column_slice(&gram.gradient);
            scatter += &g * g.transpose();
        }
        // The scatter of a prior is that of its standard deviation.
        for (slot, i) in self.free.iter().enumerate() {
            if let Some((_, std)) = self.parameters[*i].prior {
                scatter[(slot, slot)] += std.powi(-2);
            }
        }
        let sandwich = &covariance * scatter * &covariance;
        Fit {
            status,
            loss: self.plain,
            initial_loss,
            n_residuals: self.residual.len(),
            iterations,
            evaluations: self.evaluations,
            covariance: covariance.as_slice().to_vec(),
            sandwich: sandwich.as_slice().to_vec(),
            condition: condition(&scaled),
            at_bound: at_bound(self.parameters, &self.free, &self.theta),
            theta: self.theta,
            free: self.free,
            blocks: self.blocks,
            residual: self.residual,
            columns: self.columns,
            up_to_date,
        }
    }
}

impl<P: Problem> LeastSquares for Search<'_, P> {
    type Trial = Evaluation;
    type Error = ProblemError;

    fn normal(&self) -> &Normal {
        &self.normal
    }

    /// Scale the step of a shape down if the size of its effect grows, and up if it shrinks.
    ///
    /// An effect `a f(s)` changes by `f da + a f' ds`. At the new size, a step of `ds a / (a + da)`
    /// gives the same change. The search then follows a curved valley, along which size and shape
    /// compensate each other, in long steps instead of many short ones.
    fn land(&self, from: &[f64], to: &mut [f64]) {
        for slot in 0..to.len() {
            let amplitude = self.parameters[self.free[slot]].amplitude;
            let place = amplitude.and_then(|size| self.free.iter().position(|i| *i == size));
            if let Some(size) = place {
                let shrunk = if to[size] == 0.0 {
                    0.0
                } else {
                    from[size] / to[size]
                };
                to[slot] = from[slot] + (to[slot] - from[slot]) * shrunk.clamp(0.0, MOST_STRETCHED);
            }
        }
    }

    fn attempt(&mut self, theta: &[f64]) -> Result<Option<(f64, Evaluation)>, ProblemError> {
        let theta = self.all(theta);
        let fresh = std::mem::take(&mut self.fresh);
        let wanted = if fresh.len() <= FEW { &fresh[..] } else { &[] };
        let evaluated = self.evaluate(&theta, wanted);
        self.fresh = fresh;
        match evaluated {
            Ok(trial) => {
                let losses = trial.residual.iter().map(|r| self.rho.evaluate(*r).0);
                let loss: f64 = losses.sum();
                Ok(Some((loss + self.prior_loss(&theta), trial)))
            }
            Err(ProblemError::Cancelled) => Err(ProblemError::Cancelled),
            // Invalid input has been reported at the start, so an error here is due to the
            // parameters.
            Err(_) => Ok(None),
        }
    }

    fn accept(&mut self, theta: &[f64], trial: Evaluation) -> Result<(), ProblemError> {
        self.theta = self.all(theta);
        let fresh = std::mem::take(&mut self.fresh);
        let evaluation = if trial.columns.len() == fresh.len() {
            trial
        } else {
            self.differentiate(&fresh, &trial.runs)?
        };
        self.take(evaluation, &fresh);
        self.fresh = fresh;
        Ok(())
    }
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
