//! What can go wrong with an axis model.

/// Why an axis cannot be simulated or fitted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AxisError {
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
    /// The simulated motion grew without bound.
    #[error("data set {set}: the simulated motion diverges at sample {sample}")]
    Diverged {
        /// Number of the data set, from 0.
        set: usize,
        /// First sample without a finite speed.
        sample: usize,
    },
    /// Another thread asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl AxisError {
    /// Misuse of `field`.
    // Callers hand over what they have just computed.
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
