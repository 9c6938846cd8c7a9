//! The plant: equations of motion of motors, gears and the elastic arm with its effects, its
//! equilibrium and its linearization.

mod axis;
mod build;
mod equations;
mod equilibrium;
mod linearization;
mod own;
mod zoh_response;

pub use axis::{Axis, Gear, Lead};
pub use build::{PlacedKernel, PlantError};
pub use equations::Plant;
pub use equilibrium::{Equilibrium, EquilibriumError, equilibrium};
pub(crate) use linearization::WIDTH;
pub use linearization::{
    LinearReadings, Linearization, LinearizationError, Seeded, fastest_decay, linearize,
};
pub use zoh_response::zoh_frequency_response;
