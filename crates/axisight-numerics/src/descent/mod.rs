//! Minimizing sums of squares: the one loop of Levenberg-Marquardt type.
//!
//! Three parts that know nothing of each other, as in a search and a descent:
//!
//! * [`search`] says how much a step is damped, when it is accepted and when to stop; it sees
//!   the loss and what a step promises, no parameter and no matrix.
//! * [`Bounded`] says how a damped step is found from normal equations and kept within
//!   bounds. Searches with a structure of their own bring their own [`Descent`].
//! * [`LeastSquares`] is the problem: loss and normal equations, and whether a trial point
//!   costs less than one with derivatives.
//!
//! It stands here, below all crates that fit, because models of logs, of axes and of
//! frequency responses and the phases of multisines are found by it.

mod bounded;
mod normal;
mod search;
mod status;

pub use bounded::{Bounded, LeastSquares, Limits, Reach};
pub use normal::Normal;
pub use search::{Damping, Descent, Outcome, Progress, Rules, Step, search};
pub use status::Status;
