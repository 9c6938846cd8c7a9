//! The distinction between a model that has no valid run and invalid input.
//!
//! A fit tries models that may be unstable, too stiff or without an equilibrium. This is a result
//! that the caller handles. Invalid input is an error.

use super::problem::ProblemError;
use axisight_core::effects::EffectError;
use axisight_core::plant::{EquilibriumError, PlantError};
use axisight_core::simulation::{CourseOfAnother, SimulationError};

/// Where and why a model has no valid run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the simulation failed: {reason}")]
pub struct Divergence {
    /// The logs in lock-step of which one diverged; empty if the model cannot run at all.
    pub records: Vec<usize>,
    /// The sample at which the run diverged.
    pub sample: Option<usize>,
    /// Reason.
    pub reason: String,
}

impl ProblemError {
    /// The error of a model that cannot run along any log.
    pub(super) fn does_not_hold(reason: &impl ToString) -> Self {
        Self::diverged(&[], None, reason)
    }

    /// The error of a run along the logs `records` that ended at `sample`.
    pub(super) fn diverged(
        records: &[usize],
        sample: Option<usize>,
        reason: &impl ToString,
    ) -> Self {
        Self::Diverged(Divergence {
            records: records.to_vec(),
            sample,
            reason: reason.to_string(),
        })
    }

    fn misuse(error: &impl ToString) -> Self {
        Self::Misuse(error.to_string())
    }
}

impl From<EffectError> for ProblemError {
    fn from(error: EffectError) -> Self {
        match error {
            // Whether an effect can act depends on the robot and its other effects.
            EffectError::Lacking { .. } => Self::does_not_hold(&error),
            EffectError::Unknown { .. }
            | EffectError::ParameterCount { .. }
            | EffectError::Axis { .. }
            | EffectError::Unsupported { .. }
            | EffectError::Bounds { .. } => Self::misuse(&error),
        }
    }
}

impl From<PlantError> for ProblemError {
    fn from(error: PlantError) -> Self {
        match error {
            PlantError::Mass { .. } | PlantError::TooManyJoints(_) => Self::does_not_hold(&error),
            PlantError::FloatingBase => Self::misuse(&error),
            PlantError::Effect(error) => error.into(),
        }
    }
}

impl From<SimulationError> for ProblemError {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Equilibrium(
                EquilibriumError::NoDeflection { .. } | EquilibriumError::NotSettled { .. },
            ) => Self::does_not_hold(&error),
            SimulationError::Effect(error) => error.into(),
            SimulationError::Known(error) => error.into(),
            SimulationError::Equilibrium(EquilibriumError::Shape { .. })
            | SimulationError::Shape { .. }
            | SimulationError::NoJacobian(_)
            | SimulationError::Course { .. }
            | SimulationError::NoController => Self::misuse(&error),
        }
    }
}

impl From<CourseOfAnother> for ProblemError {
    fn from(error: CourseOfAnother) -> Self {
        Self::misuse(&error)
    }
}
