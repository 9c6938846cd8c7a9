//! How searches end, and what to do then.

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The loss cannot fall any more.
    LossConverged,
    /// The parameters no longer move.
    StepConverged,
    /// The residuals are rounding errors.
    Exact,
    /// Out of iterations.
    MaxIterations,
    /// No damping gives a lower loss although the slope promises one: the model is not
    /// smooth here, or its derivatives are inaccurate.
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

    /// The word for it in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::LossConverged => "loss_converged",
            Self::StepConverged => "step_converged",
            Self::Exact => "exact",
            Self::MaxIterations => "max_iterations",
            Self::Stalled => "stalled",
        }
    }

    /// What to mind; nothing where the search ended at a minimum.
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
