//! Errors of fits of frequency responses.

use super::second_order::SecondOrderError;

/// Reason why responses cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrequencyFitError {
    /// An argument is invalid.
    #[error("{field}: expected {expected}, got {got}")]
    Invalid {
        /// Name of the argument.
        field: String,
        /// Expected value.
        expected: String,
        /// Actual value.
        got: String,
    },
    /// The criterion is weighted, but the uncertainty of a response is missing.
    #[error(
        "response {pose}: expected a variance or covariance for a weighted criterion, got none"
    )]
    NoVariance {
        /// Operating point, counted from 1.
        pose: usize,
    },
    /// A covariance matrix is not positive definite.
    #[error("response {pose}: expected a positive definite covariance at line {line}")]
    Covariance {
        /// Operating point, counted from 1.
        pose: usize,
        /// Line, counted from 1.
        line: usize,
    },
    /// The robot cannot be linearized.
    #[error("operating point {pose}: {source}")]
    Robot {
        /// Operating point, counted from 1.
        pose: usize,
        /// Reason.
        source: SecondOrderError,
    },
    /// A response of the model is not finite, or is zero where a logarithm is needed.
    #[error(
        "operating point {pose}: expected a finite response that is not zero at {frequency_hz} Hz \
         from axis {input} to axis {output}; leave the element out if the axes do not couple"
    )]
    NotFinite {
        /// Operating point, counted from 1.
        pose: usize,
        /// Frequency of the line [Hz].
        frequency_hz: f64,
        /// Output axis, counted from 1.
        output: usize,
        /// Input axis, counted from 1.
        input: usize,
    },
    /// Another thread cancelled the fit.
    #[error("cancelled")]
    Cancelled,
}

/// A [`FrequencyFitError::Invalid`] for `field`.
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
