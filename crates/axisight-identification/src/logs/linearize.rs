//! Residuals and Jacobian at one point, and their normal equations by block.
//!
//! It serves all uses of a model at given parameters without a search: a prediction, the predicted
//! gain of a candidate, the information of an experiment.

use super::gram::BlockGram;
use super::loss::Loss;
use super::problem::{FitParameter, Problem, ProblemError};
use axisight_numerics::descent::{Limits, Reach};
use rayon::prelude::*;
use std::sync::Arc;

/// A column of a Jacobian, shared by the fits that use it.
pub type Column = Arc<Vec<f64>>;

/// A problem, linearized at one point.
#[derive(Debug, Clone)]
pub struct Linearization {
    /// All parameters.
    pub theta: Vec<f64>,
    /// Indices of the parameters that are not frozen, in the order of the fields below.
    pub free: Vec<usize>,
    /// Indices of the free parameters on a bound.
    pub at_bound: Vec<usize>,
    /// Loss of the residuals, without the priors.
    pub loss: f64,
    /// Whitened residuals.
    pub residual: Vec<f64>,
    /// Jacobian columns of the free parameters.
    pub columns: Vec<Column>,
    /// Normal equations of each block.
    pub blocks: Vec<BlockGram>,
}

/// Largest plausible mean square of the change of whitened residuals for a natural change of a
/// parameter: a thousand standard deviations of noise.
const LARGEST_SQUARE: f64 = 1e6;

impl Linearization {
    /// Linearize `problem` at the initial values of `parameters`.
    ///
    /// `warm` holds pairs of parameter index and column. These columns are used and not computed.
    ///
    /// # Errors
    /// [`ProblemError`] if the input is invalid or the model has no valid run.
    pub fn new<P: Problem>(
        problem: &P,
        parameters: &[FitParameter],
        loss: Loss,
        warm: &[(usize, Column)],
    ) -> Result<Self, ProblemError> {
        check(parameters)?;
        let theta: Vec<f64> = parameters.iter().map(|p| p.initial).collect();
        let is_free = |i: &usize| !parameters[*i].frozen;
        let free: Vec<usize> = (0..parameters.len()).filter(is_free).collect();
        let known = |i: &usize| warm.iter().find(|(j, _)| j == i).map(|(_, column)| column);
        let wanted: Vec<usize> = free
            .iter()
            .copied()
            .filter(|i| known(i).is_none())
            .collect();
        let evaluation = problem.evaluate(&theta, &wanted)?.finite()?;
        let mut computed = evaluation.columns.into_iter().map(Arc::new);
        let columns: Vec<Column> = free
            .iter()
            .map(|i| known(i).map_or_else(|| computed.next().unwrap_or_default(), Arc::clone))
            .collect();
        let n = evaluation.residual.len();
        if let Some(column) = columns.iter().find(|c| c.len() != n) {
            return Err(ProblemError::Invalid {
                field: "warm".into(),
                expected: format!("columns of {n} residuals"),
                got: column.len().to_string(),
            });
        }
        let residual = evaluation.residual;
        let (loss, blocks) = grams(problem, parameters, &free, loss, &residual, &columns);
        Ok(Self {
            at_bound: at_bound(parameters, &free, &theta),
            theta,
            free,
            loss,
            residual,
            columns,
            blocks,
        })
    }
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
        if p.logarithmic && p.lower <= 0.0 {
            return Err(ProblemError::Invalid {
                field: format!("parameters[{i}].lower"),
                expected: "above zero, as the logarithm is searched".into(),
                got: p.lower.to_string(),
            });
        }
    }
    Ok(())
}

/// Bounds and scales of the parameters `free`.
pub(super) fn limits(parameters: &[FitParameter], free: &[usize]) -> Limits {
    let each = |of: fn(&FitParameter) -> f64| free.iter().map(|i| of(&parameters[*i])).collect();
    Limits {
        lower: each(|p| p.lower),
        upper: each(|p| p.upper),
        scale: each(|p| p.scale),
        reach: Reach::Bounds,
        logarithmic: free.iter().map(|i| parameters[*i].logarithmic).collect(),
    }
}

/// Those of the parameters `free` that lie on a bound.
pub(super) fn at_bound(parameters: &[FitParameter], free: &[usize], theta: &[f64]) -> Vec<usize> {
    let values: Vec<f64> = free.iter().map(|i| theta[*i]).collect();
    let slots = limits(parameters, free).at_bound(&values);
    slots.into_iter().map(|slot| free[slot]).collect()
}

/// The loss, and the normal equations of every block.
pub(super) fn grams<P: Problem>(
    problem: &P,
    parameters: &[FitParameter],
    free: &[usize],
    loss: Loss,
    residual: &[f64],
    columns: &[Column],
) -> (f64, Vec<BlockGram>) {
    let (losses, weight): (Vec<f64>, Vec<f64>) = residual.iter().map(|r| loss.evaluate(*r)).unzip();
    let columns: Vec<&[f64]> = columns.iter().map(|c| &c[..]).collect();
    let scale: Vec<f64> = free
        .iter()
        .map(|i| parameters[*i].natural_change())
        .collect();
    let blocks = problem.blocks().into_par_iter();
    let blocks = blocks.map(|block| {
        let range = block.start..block.start + block.len;
        let loss = losses[range].iter().sum();
        let mut gram = BlockGram::new(block, residual, loss, &weight, &columns);
        if unpredictable(&gram, &scale) {
            gram.matrix.fill(0.0);
            gram.gradient.fill(0.0);
        }
        gram
    });
    (losses.iter().sum(), blocks.collect())
}

/// Whether a natural change of a parameter changes a block implausibly much.
///
/// The simulation is then chaotic (lost motion, stiction). Such a block counts in the loss, but its
/// derivatives do not describe a finite change.
fn unpredictable(gram: &BlockGram, scale: &[f64]) -> bool {
    let n = scale.len();
    scale.iter().enumerate().any(|(slot, scale)| {
        let square = gram.matrix[slot * n + slot] * scale * scale / gram.block.len as f64;
        square > LARGEST_SQUARE || square.is_nan()
    })
}
