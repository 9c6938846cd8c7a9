//! What can go wrong with a fit of frequency responses.

use super::second_order::SecondOrderError;

/// Why responses cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrequencyFitError {
    /// Misuse.
    #[error("{field}: expected {expected}, got {got}")]
    Invalid {
        /// Argument.
        field: String,
        /// What it should be.
        expected: String,
        /// What came.
        got: String,
    },
    /// A weighted criterion without uncertainty.
    #[error(
        "response {pose}: expected a variance or covariance for a weighted criterion, got none"
    )]
    NoVariance {
        /// Operating point, from 1.
        pose: usize,
    },
    /// A covariance that is none.
    #[error("response {pose}: expected a positive definite covariance at line {line}")]
    Covariance {
        /// Operating point, from 1.
        pose: usize,
        /// Line, from 1.
        line: usize,
    },
    /// The robot cannot be linearized.
    #[error("operating point {pose}: {source}")]
    Robot {
        /// Operating point, from 1.
        pose: usize,
        /// Why.
        source: SecondOrderError,
    },
    /// A response of the model is not finite or, for a logarithm, zero.
    #[error(
        "operating point {pose}: expected a finite response that is not zero at {frequency_hz} Hz \
         from axis {input} to axis {output}; leave the element out if the axes do not couple"
    )]
    NotFinite {
        /// Operating point, from 1.
        pose: usize,
        /// Line [Hz].
        frequency_hz: f64,
        /// Axis, from 1.
        output: usize,
        /// Axis, from 1.
        input: usize,
    },
    /// Another thread asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Misuse of `field`.
pub(super) fn invalid(
    field: &str,
    expected: &str,
    got: impl std::fmt::Display,
) -> FrequencyFitError {
    FrequencyFitError::Invalid {
        field: field.to_owned(),
        expected: expected.to_owned(),
        got: got.to_string(),
    }
}
