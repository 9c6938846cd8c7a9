//! Fits of the linearized robot to frequency responses (thesis section 3.4.2).

mod checks;
mod columns;
mod design;
mod direct;
mod error;
mod hold;
mod minimize;
mod modal;
mod modes;
mod problem;
mod residuals;
mod response;
mod second_order;
mod settings;
mod weighting;

pub use columns::Columns;
pub use design::{Design, DesignError, DesignOptions, design};
pub use error::FrequencyFitError;
pub use hold::Hold;
pub use minimize::{FrequencyFit, SearchOptions, minimize};
pub use modes::{Mode, ModesError, modes};
pub use problem::{FrequencyProblem, Scatter};
pub use response::evaluate;
pub use second_order::{Linearizer, SecondOrder, SecondOrderDerivative, SecondOrderError};
pub use settings::{FrequencyOptions, FrequencyParameter};
pub use weighting::{Criterion, PoseResponse, Uncertainty};

/// Information on the parameters, symmetric.
pub type InformationMatrix = nalgebra::DMatrix<f64>;
