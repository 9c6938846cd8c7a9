//! Fits to logs: residuals of several logs, exact sensitivities, and their least squares.

mod courses;
mod divergence;
mod fit;
mod gram;
mod inverse_dynamics;
mod lateness;
mod linearize;
mod loss;
mod outputs;
mod packing;
mod problem;
mod record;
mod simulation_error;

pub use courses::Courses;
pub use divergence::Divergence;
pub use fit::{Fit, FitOptions, fit};
pub use gram::{Block, BlockGram};
pub use inverse_dynamics::{InverseDynamics, MotionRecord};
pub use linearize::{Column, Linearization};
pub use loss::Loss;
pub use outputs::{Sensed, SensedOutput};
pub use problem::{Evaluation, FitParameter, Problem, ProblemError, Target};
pub use record::{OwnValue, Record};
pub use simulation_error::{SimulationErrorProblem, SimulationInput, SimulationOutput};
