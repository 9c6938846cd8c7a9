//! The linear plant in the sampled loop, batches of runs, and noise.

mod batch;
pub mod linear;
mod noise;

pub use axisight_plant::simulation::{
    Beside, CourseOfAnother, Drive, Effort, Method, Moment, Run, Sample, SimulationError, Status,
    Stepper, simulate, stable_substeps,
};
pub use batch::{Batch, BatchError, BatchInput, Model, Outcome, Traces, simulate_batch};
pub use linear::{LinearPlant, LinearPlantError, simulate_linear};
pub use noise::{coloured_noise, measurement_noise};
