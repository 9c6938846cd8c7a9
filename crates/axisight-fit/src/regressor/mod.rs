//! The torque regressor of a chain, linear in its inertial parameters (thesis (4.2)).
//!
//! The parameters of each link are its mass, its first moments and its inertia about the link's own
//! frame. Inverse dynamics is linear in them: `tau = Phi(q, q', q'') theta`. [`Regressor`]
//! evaluates `Phi`, the energy of (4.3), and the triangular factors of `[Phi | tau]` that least
//! squares needs. The factors take constant memory for any number of samples.

mod chain;
mod energy;
mod evaluate;
mod extra;
mod factors;
mod householder;
mod parameters;

pub use chain::LINK_PARAMETERS;
pub use evaluate::{Motion, Regressor};
pub use extra::{Extra, Signal};
pub use factors::{FactorRequest, Factors};
pub use parameters::link_parameters;

/// Error: a regressor cannot be built or evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct RegressorError {
    /// Name of the argument.
    pub field: String,
    /// Expected value.
    pub expected: String,
    /// Actual value.
    pub got: String,
}

impl RegressorError {
    fn new(field: &str, expected: impl Into<String>, got: &impl ToString) -> Self {
        Self {
            field: field.to_owned(),
            expected: expected.into(),
            got: got.to_string(),
        }
    }
}

/// Check the length of a row-major array, and that its entries are finite.
fn check_rows(
    field: &str,
    x: &[f64],
    n_samples: usize,
    columns: usize,
) -> Result<(), RegressorError> {
    if x.len() != n_samples * columns {
        let expected = format!("{n_samples} rows of {columns} numbers");
        return Err(RegressorError::new(field, expected, &x.len()));
    }
    match x.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(i) => Err(RegressorError::new(
            field,
            "finite numbers",
            &format!("{} at row {}, column {}", x[i], i / columns, i % columns),
        )),
    }
}
