//! The interface between a fit and a problem.

use super::courses::Runs;
use super::divergence::Divergence;
use super::gram::Block;
use axisight_core::robot::{EffectSetting, Parameter};
use axisight_numerics::Weighting;
use axisight_scalar::Scalar;
use std::sync::Arc;

/// The quantity that a fitted number stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A parameter of the robot.
    Robot(Parameter),
    /// A parameter of an effect: index in the list of effects, then in the table of the effect.
    Effect(usize, usize),
}

/// One parameter to fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitParameter {
    /// The quantity.
    pub target: Target,
    /// Start value of the search.
    pub initial: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Natural size of a change, which makes parameters of all units comparable.
    pub scale: f64,
    /// Prior mean and standard deviation.
    pub prior: Option<(f64, f64)>,
    /// Whether the parameter stays at its initial value.
    pub frozen: bool,
    /// For a shape: index of the only size parameter of its effect.
    pub amplitude: Option<usize>,
    /// Whether its sensitivity changes little. Its column is then computed once, or taken from an
    /// earlier fit, and renewed only on request.
    pub nuisance: bool,
    /// Whether its logarithm is searched. Its lower bound is then above zero.
    pub logarithmic: bool,
}

/// Natural change of a parameter whose logarithm is searched, as a share of its value.
///
/// Doubling a stiffness changes the torques of a precise log by thousands of standard deviations of
/// its noise. No chaos is needed for that.
const SMALL_SHARE: f64 = 0.01;

impl FitParameter {
    /// The change by which the sensitivity of residuals is judged.
    pub(super) fn natural_change(&self) -> f64 {
        if self.logarithmic {
            SMALL_SHARE * self.initial
        } else {
            self.scale
        }
    }
}

/// Residuals with some columns of their Jacobian.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Whitened residuals, model minus measurement.
    pub residual: Vec<f64>,
    /// Derivatives of the residuals, one vector per requested parameter.
    pub columns: Vec<Vec<f64>>,
    /// Runs along which more derivatives at the same point can be computed; empty for some
    /// problems.
    pub(super) runs: Runs,
}

impl Evaluation {
    /// Residuals and columns, for a problem without runs.
    pub fn new(residual: Vec<f64>, columns: Vec<Vec<f64>>) -> Self {
        Self {
            residual,
            columns,
            runs: Vec::new(),
        }
    }

    /// Returns itself if all residuals are finite, otherwise an error.
    pub(super) fn finite(self) -> Result<Self, ProblemError> {
        if self.residual.iter().all(|r| r.is_finite()) {
            Ok(self)
        } else {
            Err(ProblemError::does_not_hold(&"a residual is not finite"))
        }
    }
}

/// Reason why a problem cannot be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// The model has no valid run at these parameters (unstable, too stiff, no equilibrium).
    #[error(transparent)]
    Diverged(Divergence),
    /// Another thread cancelled the fit.
    #[error("cancelled")]
    Cancelled,
    /// Invalid input that shows when the model is built or run.
    #[error("{0}")]
    Misuse(String),
    /// Invalid input, reported at the first evaluation at the latest.
    #[error("{field}: expected {expected}, got {got}")]
    Invalid {
        /// Name of the argument.
        field: String,
        /// Expected value.
        expected: String,
        /// Actual value.
        got: String,
    },
}

pub(super) fn invalid(field: String, expected: String, got: String) -> ProblemError {
    ProblemError::Invalid {
        field,
        expected,
        got,
    }
}

/// Refuse a problem without logs, or with a weighting that does not fit its axes.
pub(super) fn check_logs(
    n_logs: usize,
    weighting: &[Weighting],
    n_axes: usize,
) -> Result<(), ProblemError> {
    if n_logs == 0 {
        let expected = "at least one log".into();
        return Err(invalid("records".into(), expected, "none".into()));
    }
    if weighting.len() != n_axes {
        let expected = format!("one for each of {n_axes} axes");
        let got = weighting.len().to_string();
        return Err(invalid("weighting".into(), expected, got));
    }
    weighting.iter().try_for_each(check_weighting)
}

/// Refuse an invalid weighting.
pub(super) fn check_weighting(weighting: &Weighting) -> Result<(), ProblemError> {
    let refused = weighting.validate();
    refused.map_err(|e| invalid(e.field.into(), e.expected.into(), e.got))
}

/// Some of the logs of a problem, by their indices; an error if an index does not exist.
pub(super) fn picked<T>(records: &[Arc<T>], logs: &[usize]) -> Result<Vec<Arc<T>>, ProblemError> {
    let one = |i: &usize| {
        let found = records.get(*i).map(Arc::clone);
        found.ok_or_else(|| {
            let expected = format!("numbers below {}", records.len());
            invalid("logs".into(), expected, i.to_string())
        })
    };
    if logs.is_empty() {
        let expected = "at least one".into();
        return Err(invalid("logs".into(), expected, "none".into()));
    }
    logs.iter().map(one).collect()
}

/// A nonlinear least-squares problem over logs.
pub trait Problem: Sync {
    /// Residuals at `theta` and their derivatives with respect to the parameters `columns`.
    ///
    /// # Errors
    /// [`ProblemError::Diverged`] if the model has no valid run at `theta`.
    fn evaluate(&self, theta: &[f64], columns: &[usize]) -> Result<Evaluation, ProblemError>;
    /// The same as [`Problem::evaluate`], with the `runs` of an earlier evaluation at `theta`,
    /// which may save a simulation.
    ///
    /// # Errors
    /// [`ProblemError::Diverged`] if the model has no valid run at `theta`.
    fn differentiate(
        &self,
        theta: &[f64],
        columns: &[usize],
        runs: &Runs,
    ) -> Result<Evaluation, ProblemError> {
        let _ = runs;
        self.evaluate(theta, columns)
    }
    /// The blocks of the residual vector.
    fn blocks(&self) -> Vec<Block>;
}

/// Parameters of a plant at `theta`; `seed` adds derivatives to those in `seeds`, by their position
/// there.
pub(super) fn seeded<S: Scalar>(
    parameters: &[FitParameter],
    effects: &[EffectSetting<f64>],
    theta: &[f64],
    seeds: &[usize],
    seed: impl Fn(S, usize) -> S,
) -> (Vec<(Parameter, S)>, Vec<EffectSetting<S>>) {
    let mut overrides = Vec::new();
    let mut settings: Vec<EffectSetting<S>> = effects.iter().map(EffectSetting::lifted).collect();
    for (i, (parameter, value)) in parameters.iter().zip(theta).enumerate() {
        let constant = S::constant(*value);
        let place = seeds.iter().position(|s| *s == i);
        let number = place.map_or(constant, |s| seed(constant, s));
        match parameter.target {
            Target::Robot(p) => overrides.push((p, number)),
            Target::Effect(e, j) => {
                if let Some(slot) = settings.get_mut(e).and_then(|s| s.parameters.get_mut(j)) {
                    *slot = number;
                }
            }
        }
    }
    (overrides, settings)
}
