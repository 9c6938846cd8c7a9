//! One axis as a chain of masses, fitted by its prediction error (thesis chapter 9).
//!
//! Bottom to top: [`Layout`] says where each parameter stands; `chain` holds the equations of
//! motion over any scalar, `motion` steps them through a sample with the sign of the friction
//! followed exactly; `predictor` runs a data set; [`AxisProblem`] turns data sets into
//! residuals and normal equations; [`search`] and [`multistart`] minimize.

mod chain;
mod data;
mod error;
mod gram;
mod layout;
mod motion;
mod numbers;
mod predictor;
mod problem;
mod search;

pub use data::AxisSet;
pub use error::AxisError;
pub use gram::Normal;
pub use layout::{AxisModel, Hold, Layout, Output};
pub use predictor::Trajectory;
pub use problem::{AxisProblem, Linearization};
pub use search::{SearchOptions, SearchParameter, SearchResult, SearchStatus, search};
