//! The linearized plant in the sampled closed loop.
//!
//! Between samples the deviation from rest obeys `x' = A x + B (tau + v)`, with the torque `tau` of
//! the drive and the torque ripple `v(phi, u)`. The linear part is propagated exactly, by the
//! matrix exponential. Only the ripple is approximated, with global order 4 in the step.
//!
//! | effect | treatment |
//! |---|---|
//! | viscous friction, stiffness (linear, cubic), damping, motor inertia, payload, balancer, cables | in `A`; a cubic spring by its slope under the static load |
//! | delay, bandwidth, torque constant, offset, limit | on the commanded torque, as in the nonlinear loop |
//! | torque ripple | at the motor angle, inside the sample |
//! | resolver ripple | on the measurement |
//! | dry friction, backlash, quadratic drag, transmission error | refused: their slope at rest does not hold in motion |

mod harmonics;
mod plant;
mod propagator;
mod sampled;
mod sensing;
mod tiles;

pub use plant::{LinearPlant, LinearPlantError, Operations};
pub use sampled::simulate_linear;
