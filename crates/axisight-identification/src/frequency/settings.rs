//! What is fitted, and by which criterion.

use super::hold::Hold;
use super::weighting::Criterion;
use crate::logs::Loss;
use axisight_core::robot::Parameter;

/// One number to fit; bounds, start and prior in its own unit.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyParameter {
    /// What it is.
    pub parameter: Parameter,
    /// Where the search starts.
    pub initial: f64,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Searched over its logarithm; start and bounds are positive.
    pub logarithmic: bool,
    /// Mean and standard deviation of what is known beforehand.
    pub prior: Option<(f64, f64)>,
    /// Kept at its initial value.
    pub frozen: bool,
}

/// How responses are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrequencyOptions {
    /// How the torque reaches the plant.
    pub hold: Hold,
    /// What is compared.
    pub criterion: Criterion,
    /// Weigh by the response's uncertainty.
    pub weighted: bool,
    /// Loss of the magnitude of a complex residual.
    pub loss: Loss,
    /// Lines in a row whose residuals may depend on each other, for the sandwich covariance.
    pub block_lines: usize,
}
