//! One axis as a chain of masses, fitted by its prediction error (thesis chapter 9).
//!
//! Bottom to top: [`Layout`] says where each parameter stands; `chain` holds the equations of
//! motion over any scalar, `motion` steps them through a sample with the sign of the friction
//! followed exactly; `predictor` runs a data set; [`AxisProblem`] turns data sets into
//! residuals and normal equations, which [`search`] minimizes.

mod chain;
mod error;
mod gram;
mod jet;
mod layout;
mod motion;
mod predictor;
mod problem;
mod search;
#[cfg(target_arch = "x86_64")]
mod wide;

pub use error::AxisError;
pub use layout::{AxisModel, Hold, Layout, Output};
pub use predictor::Trajectory;
pub use problem::{AxisProblem, AxisSet, Linearization};
pub use search::{SearchOptions, SearchParameter, SearchResult, search};
