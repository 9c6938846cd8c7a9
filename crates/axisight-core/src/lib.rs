//! Axisight core: identify industrial robots, simulate them, and explain the
//! gap between simulator and machine.
//!
//! Modules stand bottom to top: [`scalar`] and [`signal`] know nothing of
//! robots; [`robot`] is the arm; [`effects`] is what a simulator may lack;
//! [`simulation`] closes the loop; [`identification`] fits parameters.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod effects;
pub mod identification;
pub mod robot;
pub mod scalar;
pub mod signal;
pub mod simulation;
