//! What may be wrong with a study.

use axisight_core::plant::{EquilibriumError, PlantError};
use axisight_core::simulation::LinearPlantError;
use axisight_spectra::excitation::ExcitationError;

/// A study that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// A field has an impossible value.
    #[error("{field}: expected {expected}, got {got}")]
    Field {
        /// Field.
        field: &'static str,
        /// What it should be.
        expected: String,
        /// What came.
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
    // Callers hand over numbers and fresh strings alike.
    #[allow(clippy::needless_pass_by_value)]
    pub(super) fn field(field: &'static str, expected: &str, got: impl std::fmt::Display) -> Self {
        Self::Field {
            field,
            expected: expected.to_owned(),
            got: got.to_string(),
        }
    }
}
