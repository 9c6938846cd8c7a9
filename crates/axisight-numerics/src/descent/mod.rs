//! Least squares by the Levenberg-Marquardt method: the only such loop of the project.
//!
//! The three parts are independent of each other:
//!
//! * [`search`] sets the damping, accepts steps and stops. It sees the loss and its predicted
//!   reduction, but no parameter and no matrix.
//! * [`Bounded`] computes a damped step from the normal equations and keeps it within bounds.
//!   Searches with a special structure implement [`Descent`] themselves.
//! * [`LeastSquares`] is the problem: it gives the loss and the normal equations, and decides
//!   whether a trial point needs derivatives.
//!
//! The module lies below all crates that fit. It serves the models of logs, of axes and of
//! frequency responses, and the phases of multisines.

mod bounded;
mod normal;
mod search;
mod status;

pub use bounded::{Bounded, LeastSquares, Limits, Reach};
pub use normal::Normal;
pub use search::{Damping, Descent, Outcome, Progress, Rules, Step, search};
pub use status::Status;
