//! Equations of the effects as plain functions over any scalar.
//!
//! The kernels of the effects use them, and so do models without a plant, above all the chain of
//! masses that is fitted to one axis. Each equation is written once, so that identification and
//! simulation agree.

mod friction;
mod gear;
mod harmonic;

pub use friction::{smoothed_sign, stribeck_level};
pub use gear::{dead_zone, dead_zone_inverse, spring_torque};
pub use harmonic::{harmonic, harmonic_slope};
