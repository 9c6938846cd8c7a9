//! Plants of robots, with effects by name.

mod assemble;

pub use assemble::{assemble, linearize, stable_substeps, stepper};
pub use axisight_plant::plant::{
    Axis, Equilibrium, EquilibriumError, Gear, Linearization, LinearizationError, PlacedKernel,
    Plant, PlantError, Seeded, equilibrium, fastest_decay, zoh_frequency_response,
};
