//! Plants of robots, with effects by name.

mod assemble;

pub use assemble::{assemble, linearize, stepper};
pub use axisight_plant::plant::{
    Axis, Equilibrium, EquilibriumError, Gear, Linearization, LinearizationError, PlacedKernel,
    Plant, PlantError, equilibrium, zoh_frequency_response,
};
