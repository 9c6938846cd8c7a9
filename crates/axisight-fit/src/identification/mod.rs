//! Fitting: residuals of several logs, exact sensitivities, Levenberg-Marquardt.

mod gram;
mod inverse_dynamics;
mod levenberg_marquardt;
mod loss;
mod problem;
mod simulation_error;

pub use gram::{Block, BlockGram};
pub use inverse_dynamics::{InverseDynamics, MotionRecord};
pub use levenberg_marquardt::{Fit, FitOptions, FitStatus, fit};
pub use loss::Loss;
pub use problem::{Evaluation, FitParameter, Problem, ProblemError, Target};
pub use simulation_error::{Record, SimulationErrorProblem, SimulationInput, SimulationOutput};
