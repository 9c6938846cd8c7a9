//! Levenberg-Marquardt on normal equations that are summed up while the model runs.
//!
//! Marquardt (1963) with his scaling by the diagonal, which makes the units of the parameters
//! irrelevant, the damping rule of Nielsen (1999), and the projection of Kanzow, Yamashita,
//! Fukushima (2004) on the bounds. Every trial point comes with its derivatives: they cost
//! less than a second run. The optimizer of the core keeps residuals and Jacobian in memory
//! and runs the model twice per step; here that would take half of the time.

use super::AxisError;
use super::gram::Normal;
use super::problem::{AxisProblem, Evaluation};
use nalgebra::{DMatrix, DVector};

/// One parameter of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchParameter {
    /// Where the search starts.
    pub initial: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// What a small change is compared with where the parameter itself is near zero.
    pub scale: f64,
    /// May move.
    pub free: bool,
}

/// Largest factor by which one step changes a parameter that cannot change its sign.
const LARGEST_FACTOR: f64 = 5.0;

impl SearchParameter {
    /// A step far from the minimum may promise nonsense: half of the inertias of none. What is
    /// left near zero may go there.
    fn restrained(&self, from: f64, to: f64) -> f64 {
        if self.lower >= 0.0 && from > 1e-3 * self.scale {
            to.clamp(from / LARGEST_FACTOR, from * LARGEST_FACTOR)
        } else {
            to
        }
    }
}

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Most accepted steps.
    pub max_iterations: usize,
    /// Stop when the linear model promises to lower the loss by less than this share.
    pub loss_tolerance: f64,
    /// Stop when no parameter moves by more than this share of itself.
    pub step_tolerance: f64,
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchStatus {
    /// The loss cannot fall any more.
    LossConverged,
    /// The parameters no longer move.
    StepConverged,
    /// The residuals are rounding errors.
    Exact,
    /// Out of iterations.
    MaxIterations,
    /// No damping gives a lower loss although the slope promises one.
    Stalled,
}

/// Where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    /// How.
    pub status: SearchStatus,
    /// All parameters.
    pub theta: Vec<f64>,
    /// Weighted sum of squared residuals.
    pub loss: f64,
    /// The same at the start.
    pub initial_loss: f64,
    /// Accepted steps.
    pub iterations: usize,
    /// Runs through the data.
    pub evaluations: usize,
    /// Normal equations at the end, over the free parameters.
    pub normal: Normal,
    /// Weighted, whitened residuals, model minus measurement, set after set.
    pub residual: Vec<f64>,
    /// `J^T r` of every block of every set over the free parameters.
    pub block_gradients: Vec<f64>,
}

/// Damped trials, each damped more, before the search gives up.
const MOST_TRIALS: usize = 12;

/// Promise, in variances of one residual, below which a search has settled: all parameters
/// together are then within 0.7 standard deviations of the minimum. Instants at which the friction
/// changes put kinks of that size into a noisy loss.
const SETTLED: f64 = 0.5;

/// Share of the energy of the data below which residuals are rounding errors.
const ROUNDING: f64 = 1e-24;

struct Search<'a> {
    problem: &'a AxisProblem<'a>,
    parameters: &'a [SearchParameter],
    free: Vec<usize>,
    options: SearchOptions,
    evaluations: usize,
    /// Memory of a point that was left.
    spare: Option<Evaluation>,
}

/// Minimize the loss of `problem` from the initial parameters.
///
/// # Errors
/// [`AxisError::Invalid`] for misuse, [`AxisError::Diverged`] where the start cannot be
/// simulated, [`AxisError::Cancelled`].
pub fn search(
    problem: &AxisProblem<'_>,
    parameters: &[SearchParameter],
    options: SearchOptions,
) -> Result<SearchResult, AxisError> {
    check(problem, parameters)?;
    let mut search = Search {
        problem,
        parameters,
        free: (0..parameters.len())
            .filter(|i| parameters[*i].free)
            .collect(),
        options,
        evaluations: 0,
        spare: None,
    };
    search.run(parameters.iter().map(|p| p.initial).collect())
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
    fn evaluate(&mut self, theta: &[f64]) -> Result<Evaluation, AxisError> {
        self.evaluations += 1;
        let spare = self.spare.take();
        self.problem.evaluate(theta, &self.free, spare)
    }

    fn run(&mut self, theta: Vec<f64>) -> Result<SearchResult, AxisError> {
        let mut theta = theta;
        let mut point = self.evaluate(&theta)?;
        let initial_loss = point.normal.loss;
        let floor = ROUNDING * self.problem.energy();
        let (mut iterations, mut damping) = (0, 1e-3);
        let status = 'search: loop {
            if point.normal.loss <= floor {
                break SearchStatus::Exact;
            }
            if iterations == self.options.max_iterations {
                break SearchStatus::MaxIterations;
            }
            let (mut growth, mut trials) = (2.0, 0);
            loop {
                let Step { next, worth } = self.step(&theta, &point.normal, damping);
                let loss = point.normal.loss;
                let promised = promise(&point.normal, &self.change(&theta, &next));
                if worth <= self.options.loss_tolerance * loss && damping < 1.0 {
                    break 'search SearchStatus::LossConverged;
                }
                if self.moved(&theta, &next) <= self.options.step_tolerance {
                    break 'search self.stopped(&theta, &point.normal);
                }
                // A step that was cut may lead uphill: a shorter one is cut less.
                let trial = (promised > 0.0).then(|| self.evaluate(&next)).transpose();
                match trial {
                    Ok(Some(trial)) if trial.normal.loss < loss => {
                        let ratio = (loss - trial.normal.loss) / promised;
                        let cube = (2.0 * ratio - 1.0).powi(3);
                        damping = (damping * (1.0 - cube).clamp(0.1, 2.0)).max(1e-15);
                        self.spare = Some(std::mem::replace(&mut point, trial));
                        theta = next;
                        iterations += 1;
                        break;
                    }
                    Err(AxisError::Cancelled) => return Err(AxisError::Cancelled),
                    failed => {
                        if let Ok(Some(trial)) = failed {
                            self.spare = Some(trial);
                        }
                        damping *= growth;
                        growth *= 2.0;
                        trials += 1;
                        if trials > MOST_TRIALS {
                            break 'search self.stopped(&theta, &point.normal);
                        }
                    }
                }
            }
        };
        let sets = self.problem.sets().iter();
        let blocks = sets.zip(&point.rows);
        Ok(SearchResult {
            status,
            theta,
            block_gradients: blocks
                .flat_map(|(s, r)| r.block_gradients(s.block, self.free.len()))
                .collect(),
            residual: point.rows.into_iter().flat_map(|r| r.residual).collect(),
            loss: point.normal.loss,
            initial_loss,
            iterations,
            evaluations: self.evaluations,
            normal: point.normal,
        })
    }

    /// A search that no longer moves: settled if the undamped step promises next to nothing of
    /// what the noise of one parameter is worth, stalled otherwise.
    fn stopped(&self, theta: &[f64], normal: &Normal) -> SearchStatus {
        let Step { worth, .. } = self.step(theta, normal, 0.0);
        if worth * normal.count as f64 <= SETTLED * normal.loss {
            SearchStatus::StepConverged
        } else {
            SearchStatus::Stalled
        }
    }

    fn change(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        self.free.iter().map(|i| to[*i] - from[*i]).collect()
    }

    fn moved(&self, from: &[f64], to: &[f64]) -> f64 {
        let share = |i: &usize| {
            let size = from[*i].abs().max(1e-3 * self.parameters[*i].scale);
            (to[*i] - from[*i]).abs() / size
        };
        self.free.iter().map(share).fold(0.0, f64::max)
    }

    /// Damped step, with parameters on a bound that it would push outwards left out.
    fn step(&self, theta: &[f64], normal: &Normal, damping: f64) -> Step {
        let n = self.free.len();
        let mut held = vec![false; n];
        for _ in 0..=n {
            let step = damped_step(normal, damping, &held);
            let mut next = theta.to_vec();
            let mut hit = false;
            for (slot, i) in self.free.iter().enumerate() {
                let p = &self.parameters[*i];
                let wanted = p.restrained(theta[*i], theta[*i] + step[slot]);
                next[*i] = wanted.clamp(p.lower, p.upper);
                let outward = (wanted < p.lower && theta[*i] <= p.lower)
                    || (wanted > p.upper && theta[*i] >= p.upper);
                if outward && !held[slot] {
                    held[slot] = true;
                    hit = true;
                }
            }
            if !hit {
                let worth = promise(normal, step.as_slice());
                return Step { next, worth };
            }
        }
        Step {
            next: theta.to_vec(),
            worth: 0.0,
        }
    }
}

/// A step, cut to what the parameters may do.
struct Step {
    next: Vec<f64>,
    /// What it promised before it was cut: a search is at its end when that is nothing.
    worth: f64,
}

/// By how much the linear model lowers the loss.
fn promise(normal: &Normal, step: &[f64]) -> f64 {
    let n = step.len();
    let mut total = 0.0;
    for i in 0..n {
        let row = &normal.matrix[i * n..(i + 1) * n];
        let curved: f64 = row.iter().zip(step).map(|(a, s)| a * s).sum();
        total -= step[i] * (2.0 * normal.gradient[i] + curved);
    }
    total
}

/// `-(A + damping diag A)^-1 g` without the held parameters; zero where unsolvable.
fn damped_step(normal: &Normal, damping: f64, held: &[bool]) -> DVector<f64> {
    let n = held.len();
    let size = |i: usize| {
        let d = normal.matrix[i * n + i].sqrt();
        if d > 0.0 { d } else { 1.0 }
    };
    // Scaled to unit diagonal, so that one number damps all.
    let mut a = DMatrix::from_fn(n, n, |i, j| normal.matrix[i * n + j] / (size(i) * size(j)));
    let mut g = DVector::from_fn(n, |i, _| normal.gradient[i] / size(i));
    for i in 0..n {
        if held[i] || normal.matrix[i * n + i] <= 0.0 {
            a.row_mut(i).fill(0.0);
            a.column_mut(i).fill(0.0);
            g[i] = 0.0;
            a[(i, i)] = 1.0;
        }
        a[(i, i)] += damping;
    }
    let Some(factor) = a.cholesky() else {
        return DVector::zeros(n);
    };
    let step = -factor.solve(&g);
    DVector::from_fn(n, |i, _| step[i] / size(i))
}
