//! Sampled-data simulation: controller at the sample time, plant in between.

mod closed_loop;
mod controller;
mod dormand_prince;
pub mod linear;
mod method;
mod noise;
mod runge_kutta4;
mod torque_path;

pub use closed_loop::{Drive, Run, Sample, SimulationError, Status, simulate};
pub use linear::{LinearPlant, LinearPlantError, simulate_linear};
pub use method::{Method, Stepper};
pub use noise::measurement_noise;
