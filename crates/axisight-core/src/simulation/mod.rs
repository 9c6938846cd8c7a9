//! Sampled-data simulation: controller at the sample time, plant in between.

mod batch;
mod closed_loop;
mod controller;
mod dormand_prince;
mod implicit;
pub mod linear;
mod method;
mod noise;
mod nystrom4;
mod runge_kutta4;
mod torque_path;

pub use batch::{Batch, BatchError, BatchInput, Model, Outcome, Traces, simulate_batch};
pub use closed_loop::{Drive, Run, Sample, SimulationError, Status, simulate};
pub use linear::{LinearPlant, LinearPlantError, simulate_linear};
pub use method::{Effort, Method, Stepper};
pub use noise::{coloured_noise, measurement_noise};
