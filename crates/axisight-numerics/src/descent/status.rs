//! Status of a finished search, with advice.

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The loss cannot fall any more.
    LossConverged,
    /// The parameters no longer change.
    StepConverged,
    /// The residuals are rounding errors.
    Exact,
    /// The iteration limit was reached.
    MaxIterations,
    /// No damping lowers the loss although the slope predicts a reduction. The model is not smooth
    /// here, or its derivatives are inaccurate.
    Stalled,
}

impl Status {
    /// Every status.
    pub const ALL: [Self; 5] = [
        Self::LossConverged,
        Self::StepConverged,
        Self::Exact,
        Self::MaxIterations,
        Self::Stalled,
    ];

    /// Name of the status in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::LossConverged => "loss_converged",
            Self::StepConverged => "step_converged",
            Self::Exact => "exact",
            Self::MaxIterations => "max_iterations",
            Self::Stalled => "stalled",
        }
    }

    /// Advice to the user, or `None` if the search ended at a minimum.
    pub fn advice(self) -> Option<&'static str> {
        match self {
            Self::LossConverged | Self::StepConverged | Self::Exact => None,
            Self::MaxIterations => {
                Some("stopped at the iteration limit: start closer or allow more iterations")
            }
            Self::Stalled => Some("no step lowers the loss although its slope promises one"),
        }
    }

    /// Whether the search ended at a minimum.
    pub fn converged(self) -> bool {
        self.advice().is_none()
    }
}
