//! Errors of axis models.

/// Reason why an axis cannot be simulated or fitted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AxisError {
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
    /// The simulated motion grew without bound.
    #[error("data set {set}: the simulated motion diverges at sample {sample}")]
    Diverged {
        /// Number of the data set, from 0.
        set: usize,
        /// First sample without a finite speed.
        sample: usize,
    },
    /// Another thread cancelled the work.
    #[error("cancelled")]
    Cancelled,
}

impl AxisError {
    /// An [`AxisError::Invalid`] for `field`.
    #[allow(clippy::needless_pass_by_value)]
    pub(super) fn invalid(
        field: impl Into<String>,
        expected: impl Into<String>,
        got: impl ToString,
    ) -> Self {
        Self::Invalid {
            field: field.into(),
            expected: expected.into(),
            got: got.to_string(),
        }
    }
}
