//! One axis as a chain of masses, fitted by its prediction error (thesis chapter 9).
//!
//! From bottom to top:
//!
//! * [`Layout`] gives the place of each parameter.
//! * `chain` holds the equations of motion over any scalar.
//! * `motion` integrates them over a sample, and follows the sign of the friction exactly.
//! * `predictor` runs a data set.
//! * [`AxisProblem`] turns data sets into residuals and normal equations.
//! * [`search`] minimizes the loss.
//!
//! `Plant` could also simulate two masses with smoothed friction, with a difference of 3e-13. Per
//! sample it takes 12 times as long with seven derivatives and 4 times as long without (2054 ns and
//! 640 ns against 165 ns and 146 ns, `benches/benches/axis_paths.rs`), because it supports any
//! number of joints. It also does not follow the sign of dry friction.

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
