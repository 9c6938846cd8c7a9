//! Errors in the settings of a study.

use axisight_core::plant::{EquilibriumError, PlantError};
use axisight_core::simulation::LinearPlantError;
use axisight_spectra::excitation::ExcitationError;

/// Reason why a study cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// A field has an invalid value.
    #[error("{field}: expected {expected}, got {got}")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// Expected value.
        expected: String,
        /// Actual value.
        got: String,
    },
    /// The excitation cannot be made.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The arm does not settle.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The robot or its effects have no linear plant.
    #[error(transparent)]
    Linear(#[from] LinearPlantError),
}

impl StudyError {
    #[allow(clippy::needless_pass_by_value)]
    pub(super) fn field(field: &'static str, expected: &str, got: impl std::fmt::Display) -> Self {
        Self::Field {
            field,
            expected: expected.to_owned(),
            got: got.to_string(),
        }
    }
}
