//! One axis as a chain of masses, fitted by its prediction error (thesis chapter 9).
//!
//! Bottom to top: [`Layout`] says where each parameter stands; `chain` holds the equations of
//! motion over any scalar, `motion` steps them through a sample with the sign of the friction
//! followed exactly; `predictor` runs a data set; [`AxisProblem`] turns data sets into
//! residuals and normal equations, which [`search`] minimizes.
//!
//! `Plant` could serve two masses with smoothed friction. It agrees to 3e-13, and takes 12 times as
//! long a sample with seven derivatives, 4 times without (`benches/benches/axis_paths.rs`: 2054 and 640
//! against 165 and 146 ns): it steps an arm of any joints, where a chain knows its few springs, and
//! it does not follow the sign of dry friction. That is what the second path buys.

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
pub use layout::{AxisModel, Hold, Layout, Output};
pub use predictor::Trajectory;
pub use problem::{AxisProblem, Linearization};
pub use search::{SearchOptions, SearchParameter, SearchResult, search};
