//! Parameters and criterion of a fit.

use super::hold::Hold;
use super::weighting::Criterion;
use crate::logs::Loss;
use axisight_core::robot::Parameter;

/// One parameter to fit. Bounds, start and prior are in its own unit.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyParameter {
    /// The parameter of the robot.
    pub parameter: Parameter,
    /// Start value of the search.
    pub initial: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Whether the search is over the logarithm. Start and bounds must then be positive.
    pub logarithmic: bool,
    /// Prior mean and standard deviation.
    pub prior: Option<(f64, f64)>,
    /// Whether the parameter stays at its initial value.
    pub frozen: bool,
}

/// How responses are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrequencyOptions {
    /// The course of the torque between samples.
    pub hold: Hold,
    /// The criterion.
    pub criterion: Criterion,
    /// Whether deviations are weighted by the uncertainty of the response.
    pub weighted: bool,
    /// Loss over the magnitude of a complex residual.
    pub loss: Loss,
    /// Number of successive lines with dependent residuals, for the sandwich covariance.
    pub block_lines: usize,
}
