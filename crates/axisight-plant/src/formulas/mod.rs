//! Equations of the effects as plain functions over any scalar.
//!
//! The kernels of the effects are made of them, and so are the models that do not go through a
//! plant, above all the chain of masses that is fitted to one axis: an equation is written once,
//! and what one model identifies is what the other simulates.

mod friction;
mod gear;
mod harmonic;

pub use friction::{smoothed_sign, stribeck_level};
pub use gear::{dead_zone, dead_zone_inverse, spring_torque};
pub use harmonic::{harmonic, harmonic_slope};
